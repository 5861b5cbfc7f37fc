//! Stiffness of triangles in their rest shape: flat ones in their own plane, and the membrane of curved ones.
//! Degrees of freedom of the membrane are (u, v, θz) node by node. Degrees of freedom of bending are (w, θx,
//! θy), with θx = ∂w/∂y and θy = −∂w/∂x.

mod bending;
mod comas;
mod curved;
mod layers;
mod membrane;

/// Elasticity and density of a homogeneous wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wall {
    /// Isotropic elasticity.
    pub elastic: Elasticity,
    /// Density [kg/m³].
    pub density: f64,
}

#[cfg(test)]
mod tests;

use nalgebra::{Matrix3, SMatrix, Vector2};

/// Nine degrees of freedom squared.
pub(crate) type Matrix9 = SMatrix<f64, 9, 9>;

/// Coordinates of the corners of a flat triangle in its plane [m], counter-clockwise.
pub type Corners = [Vector2<f64>; 3];

pub use bending::discrete_kirchhoff;
pub(crate) use bending::mean_curvature;
pub use comas::comas_2010;
pub(crate) use curved::{CurvedMembrane, Matrix3x18};
pub use layers::{Layer, Orthotropic, Section};
pub(crate) use layers::{density, mean, thickness};
pub(crate) use membrane::andes_higher;
pub use membrane::{andes_opt, constant_strain};

/// Membrane element of a shell, its resistance in the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Membrane {
    /// The mean strain of the curved triangle (`Opt` on flat facets), for use with `Spread::Curved`. Pressure
    /// on a curved wall then stretches it and bends it no more than the true load. Do not use it with
    /// `Spread::Lumped`. Either one without the other scatters displacements from node to node, the more the
    /// thinner the wall. Give normals of the true surface: normals estimated from the triangles describe
    /// another wall.
    Curved {
        /// κ, as in `Opt`; 10 by default.
        adaptation: f64,
    },
    /// Felippa's optimal ANDES triangle with its higher-order part scaled by min(1, κ t²/A), so that drilling
    /// does not lock thin curved shells. κ = ∞ is Felippa's OPT. In thin curved shells under large tension,
    /// such as balloons, drilling moments of unequal facets tilt the nodes. The tilt is about ε h³/(R t²) for
    /// a strain ε, edges h and a radius R. For example, a sphere with R/t = 50 is blown up to twice its
    /// volume. With 128 facets it folds. With 512 facets it tilts by 1.2 rad at a pressure 1.6 % off, with
    /// 2048 by 0.24 rad at 0.02 % (`validation`, `shell_balloon`). In such shells take `Curved`, `Cst`, or a
    /// mesh with h³ well below R t²/ε.
    Opt {
        /// κ; 10 by default.
        adaptation: f64,
    },
    /// The constant-strain triangle, for membranes under pressure. It tilts no node there, whatever its
    /// drilling (0.3 % off the pressure of the balloon of 512 facets, 0.07 % of 2048). It is much too stiff
    /// for bending in its plane: 0.72 of Cook's membrane at N = 8, where `Opt` has 0.95.
    Cst {
        /// Stiffness against drilling as a part of G t A/3 per node.
        drilling: f64,
    },
    /// No resistance in the plane: for studies of plates.
    None,
}

impl Default for Membrane {
    fn default() -> Self {
        Self::Curved { adaptation: 10.0 }
    }
}

/// Bending element of a shell, its resistance to bending and twist.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Bending {
    /// The discrete Kirchhoff triangle.
    #[default]
    Dkt,
    /// The element of Comas (2010), corrected for its typing errors. Only for comparison: it depends on the
    /// numbering of the corners, fails the patch test and converges to plates 6 to 26 % too soft.
    Comas2010,
    /// No resistance: for studies of membranes.
    None,
}

/// The parts that make up a shell element.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Formulation {
    /// Resistance in the plane.
    pub membrane: Membrane,
    /// Resistance against bending.
    pub bending: Bending,
}

impl Formulation {
    /// Stiffness of a flat facet against (u, v, θz).
    pub(crate) fn membrane_stiffness(
        &self,
        corners: &Corners,
        elastic: &PlaneStress,
        thickness: f64,
    ) -> Matrix9 {
        match self.membrane {
            Membrane::Curved { adaptation } | Membrane::Opt { adaptation } => {
                andes_opt(corners, elastic, thickness, adaptation)
            }
            Membrane::Cst { drilling } => constant_strain(corners, elastic, thickness, drilling),
            Membrane::None => Matrix9::zeros(),
        }
    }

    /// Mean strain (εxx, εyy, γxy) of a flat facet over (u, v, θz).
    pub(crate) fn mean_strain(&self, corners: &Corners) -> SMatrix<f64, 3, 9> {
        match self.membrane {
            Membrane::Curved { .. } | Membrane::Opt { .. } => membrane::andes_strain(corners),
            Membrane::Cst { .. } => membrane::strain(corners),
            Membrane::None => SMatrix::zeros(),
        }
    }

    /// Mean curvature [1/m] over (w, θx, θy), of elements whose layers bend and stretch together.
    pub(crate) fn mean_curvature(&self, corners: &Corners) -> SMatrix<f64, 3, 9> {
        if self.bending == Bending::Dkt { mean_curvature(corners) } else { SMatrix::zeros() }
    }

    /// Stiffness against (w, θx, θy).
    pub(crate) fn bending_stiffness(
        &self,
        corners: &Corners,
        elastic: &PlaneStress,
        thickness: f64,
    ) -> Matrix9 {
        match self.bending {
            Bending::Dkt => discrete_kirchhoff(corners, elastic, thickness),
            Bending::Comas2010 => comas_2010(corners, elastic, thickness),
            Bending::None => Matrix9::zeros(),
        }
    }
}

/// Isotropic linear elasticity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Elasticity {
    /// Young's modulus [Pa].
    pub young: f64,
    /// Poisson's ratio.
    pub poisson: f64,
}

impl Elasticity {
    /// Plane stress: (σxx, σyy, σxy) over (εxx, εyy, γxy) [Pa].
    pub fn matrix(&self) -> Matrix3<f64> {
        let nu = self.poisson;
        Matrix3::new(1.0, nu, 0.0, nu, 1.0, 0.0, 0.0, 0.0, 0.5 * (1.0 - nu)) * (self.young / (1.0 - nu * nu))
    }

    /// Shear modulus [Pa].
    pub(crate) fn shear(&self) -> f64 {
        0.5 * self.young / (1.0 + self.poisson)
    }
}

/// Elasticity of a wall in its plane, and two numbers of it by which elements scale what every value of keeps
/// their convergence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneStress {
    /// (σxx, σyy, σxy) over (εxx, εyy, γxy) [Pa].
    pub matrix: Matrix3<f64>,
    /// Poisson's ratio; of layers that on the mean over all angles.
    pub poisson: f64,
    /// Shear modulus [Pa], the same.
    pub shear: f64,
}

impl From<Elasticity> for PlaneStress {
    fn from(elastic: Elasticity) -> Self {
        Self { matrix: elastic.matrix(), poisson: elastic.poisson, shear: elastic.shear() }
    }
}

/// Differences of coordinates x_ij = x_i − x_j, twice the area, squared lengths: what the papers write.
struct Differences {
    x12: f64,
    x23: f64,
    x31: f64,
    y12: f64,
    y23: f64,
    y31: f64,
}

impl Differences {
    fn new([a, b, c]: &Corners) -> Self {
        let (ab, bc, ca) = (a - b, b - c, c - a);
        Self { x12: ab.x, x23: bc.x, x31: ca.x, y12: ab.y, y23: bc.y, y31: ca.y }
    }

    /// 2A [m²].
    fn double_area(&self) -> f64 {
        self.x31 * self.y12 - self.x12 * self.y31
    }
}

/// Gradients of the linear shape functions [1/m].
pub(crate) fn gradients(corners: &Corners) -> [Vector2<f64>; 3] {
    let d = Differences::new(corners);
    let inverse = 1.0 / d.double_area();
    [
        Vector2::new(d.y23, -d.x23) * inverse,
        Vector2::new(d.y31, -d.x31) * inverse,
        Vector2::new(d.y12, -d.x12) * inverse,
    ]
}

/// Area [m²], positive if the corners run counter-clockwise.
pub(crate) fn area(corners: &Corners) -> f64 {
    0.5 * Differences::new(corners).double_area()
}
