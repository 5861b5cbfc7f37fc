//! A flat triangular shell in large rotation: the linear element in a frame that turns with it. The frame is
//! the facet's normal and the two-dimensional polar rotation in its plane, so it does not depend on the order
//! of the corners. Nodal forces are the exact gradient of the energy ½ dᵀ K d in that frame.
//! Element-independent co-rotation after Felippa and Haugen (2005), CMAME 194:2285; polar frame after Caselli
//! and Bisegna (2013), IJNME 95:499. Leaves out: large strains (the energy is linear elastic) and shear of
//! the thickness.

#[cfg(test)]
mod single;
#[cfg(test)]
mod tests;

use nalgebra::{
    Matrix2, Matrix3, Matrix3x2, Rotation3, SMatrix, SVector, SymmetricEigen, UnitQuaternion, Vector2,
    Vector3,
};

use crate::element::{
    Bending, Corners, CurvedMembrane, Formulation, Layer, Matrix3x18, Matrix9, Membrane, PlaneStress,
    Section, Wall, andes_higher, area, density, gradients, mean, mean_curvature, thickness,
};
use crate::patch::{EdgeRule, Patch, Vector18};
use crate::rotation::logarithm;
use crate::strain::ShellStrain;

/// Stiffness over them.
pub type Matrix18 = SMatrix<f64, 18, 18>;

/// Places of (u, v, θz) among the eighteen.
const MEMBRANE: [usize; 9] = [0, 1, 5, 6, 7, 11, 12, 13, 17];

/// Places of (w, θx, θy).
const BENDING: [usize; 9] = [2, 3, 4, 8, 9, 10, 14, 15, 16];

/// Above this rotation [rad] of a node out of the plane of its facet the facet is folded over, not deformed.
const FOLDED: f64 = 2.0;

/// Above this rotation [rad], about any axis, the rotation vector is not safely one of its kind: at π it
/// changes sign.
const FULL: f64 = 3.0;

/// A shell element: what its rest shape gives.
#[derive(Clone, Debug)]
pub struct Facet {
    /// Nodes, counter-clockwise about the normal.
    pub nodes: [u32; 3],
    /// Thickness [m].
    pub thickness: f64,
    /// Area at rest [m²].
    pub area: f64,
    /// Mass that it gives to each node [kg].
    pub mass: f64,
    /// Rotary inertia that it gives to each node [kg m²]. It is at least the inertia of a square of its area,
    /// so that rotations do not shorten the steps of an explicit solver.
    pub inertia: f64,
    elastic: PlaneStress,
    /// Section of a wall of layers.
    section: Option<Box<Section>>,
    /// Corners at rest in the facet's axes, relative to the centroid [m].
    corners: Corners,
    /// Gradients of the shape functions there [1/m].
    gradient: [Vector2<f64>; 3],
    /// Axes at rest.
    axes: UnitQuaternion<f64>,
    formulation: Formulation,
    /// Normals of a curved membrane in the facet's axes, and flags of its straight edges; `None` while it is
    /// flat.
    curved: Option<([Vector3<f64>; 3], [bool; 6])>,
    /// Stiffness of the whole element, in the facet's axes.
    stiffness: Matrix18,
    /// The part of it that resists bending.
    bending: Matrix9,
    /// Mean curvature [1/m] over (w, θx, θy), of the discrete Kirchhoff triangle.
    mean_curvature: SMatrix<f64, 3, 9>,
    /// Mean membrane strain (εxx, εyy, γxy), and the area [m²] over which it is the mean.
    strain: (Matrix3x18, f64),
    /// Nodal forces of its tension at rest, and that tension [N/m].
    tension: (Vector18, f64),
}

/// Data of a facet at rest, for code that finds its forces elsewhere.
#[derive(Clone, Copy, Debug)]
pub struct FacetAtRest<'a> {
    /// Its axes as columns; the third is the normal.
    pub axes: Matrix3<f64>,
    /// Corners in them, relative to the centroid [m].
    pub corners: Corners,
    /// Gradients of the shape functions there [1/m].
    pub gradient: [Vector2<f64>; 3],
    /// Stiffness over (u, v, w, θx, θy, θz) of three nodes.
    pub stiffness: &'a Matrix18,
    /// Nodal forces of its tension.
    pub tension: &'a Vector18,
}

/// Energy of a shell in its parts [J].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ShellEnergy {
    /// Stretch and shear of the middle surface.
    pub membrane: f64,
    /// Bending and twist.
    pub bending: f64,
    /// Nodes that turn about the normal otherwise than their facet.
    pub drilling: f64,
}

/// Forces and moments per length in the axes of a facet, their means over it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resultants {
    /// (nxx, nyy, nxy) [N/m].
    pub membrane: Vector3<f64>,
    /// (mxx, myy, mxy) [N]; stress at a height z above the middle surface is n/t + 12 z m/t³.
    pub moment: Vector3<f64>,
    /// The axes as columns; the third is the normal.
    pub axes: Matrix3<f64>,
}

impl Resultants {
    /// A tensor (xx, yy, xy) in the facet's axes as one in space: A t Aᵀ with the first two axes A.
    pub fn in_space(&self, tensor: &Vector3<f64>) -> Matrix3<f64> {
        let plane = self.axes.fixed_columns::<2>(0);
        plane * Matrix2::new(tensor.x, tensor.z, tensor.z, tensor.y) * plane.transpose()
    }

    /// Stress (σxx, σyy, σxy) [Pa] at a height [m] above the middle surface of a shell of this thickness.
    pub fn stress(&self, thickness: f64, height: f64) -> Vector3<f64> {
        self.membrane / thickness + self.moment * (12.0 * height / thickness.powi(3))
    }
}

/// A facet where it is now.
pub struct Placed {
    /// Axes as columns.
    pub axes: Matrix3<f64>,
    /// Corners in them, relative to the centroid.
    pub local: [Vector2<f64>; 3],
    /// Displacements, and rotations of the nodes relative to the facet [rad], in the axes.
    pub deformation: Vector18,
}

/// Reason why a facet or a cell of a solid has no force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Broken {
    /// Its area is zero or not finite [m²].
    Area(f64),
    /// A node has turned by this angle [rad] against it.
    Folded(f64),
    /// The determinant of the deformation gradient of a solid's cell is not positive, at an evaluation point
    /// or at a corner.
    Inverted(f64),
}

impl Facet {
    /// A flat facet of corners at rest [m]; `None` if its area is below 1e-12 of its longest edge squared.
    pub fn new(
        nodes: [u32; 3],
        rest: [Vector3<f64>; 3],
        thickness: f64,
        material: Wall,
        formulation: Formulation,
    ) -> Option<Self> {
        Self::of_wall(nodes, rest, thickness, material, None, formulation)
    }

    /// A facet of layers from the bottom (against its normal) to the top; their angles count from a
    /// direction, which is projected on the facet.
    pub fn layered(
        nodes: [u32; 3],
        rest: [Vector3<f64>; 3],
        layers: &[Layer],
        direction: &Vector3<f64>,
        formulation: Formulation,
    ) -> Option<Self> {
        let material = Wall { elastic: mean(layers), density: density(layers) };
        Self::of_wall(nodes, rest, thickness(layers), material, Some((layers, direction)), formulation)
    }

    fn of_wall(
        nodes: [u32; 3],
        rest: [Vector3<f64>; 3],
        thickness: f64,
        Wall { elastic, density }: Wall,
        layers: Option<(&[Layer], &Vector3<f64>)>,
        formulation: Formulation,
    ) -> Option<Self> {
        let [a, b, c] = rest;
        let cross = (b - a).cross(&(c - a));
        let longest = (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared());
        // Written so that NaN is degenerate too.
        if !(0.5 * cross.norm() > 1e-12 * longest && longest > 0.0) {
            return None;
        }
        let normal = cross.normalize();
        let along = (b - a).normalize();
        let axes = Matrix3::from_columns(&[along, normal.cross(&along), normal]);
        let centroid = (a + b + c) / 3.0;
        let corners = rest.map(|x| (axes.transpose() * (x - centroid)).xy());
        let area = area(&corners);
        let mass = density * thickness * area / 3.0;
        let section = layers.map(|(layers, direction)| {
            let local = axes.tr_mul(direction);
            Box::new(Section::new(layers, local.y.atan2(local.x)))
        });
        let [elastic, bent] = match &section {
            None => [PlaneStress::from(elastic); 2],
            Some(section) => [section.in_plane(), section.in_bending()],
        };
        let mut membrane = Matrix18::zeros();
        add_block(&mut membrane, MEMBRANE, &formulation.membrane_stiffness(&corners, &elastic, thickness));
        let strain = spread(MEMBRANE, &formulation.mean_strain(&corners));
        let mut facet = Self {
            nodes,
            thickness,
            area,
            mass,
            inertia: mass * (thickness * thickness).max(area) / 12.0,
            elastic,
            section,
            corners,
            gradient: gradients(&corners),
            axes: quaternion(axes),
            formulation,
            curved: None,
            stiffness: Matrix18::zeros(),
            bending: formulation.bending_stiffness(&corners, &bent, thickness),
            mean_curvature: mean_curvature(&corners),
            strain: (strain, area),
            tension: (Vector18::zeros(), 0.0),
        };
        facet.put_together(membrane, strain, area);
        Some(facet)
    }

    /// Takes up a membrane with its mean strain and the area of that [m²]: whole stiffness and forces at
    /// rest.
    fn put_together(&mut self, membrane: Matrix18, strain: Matrix3x18, area: f64) {
        self.stiffness = membrane;
        add_block(&mut self.stiffness, BENDING, &self.bending);
        if let Some(section) = &self.section {
            // Of layers that are not symmetric.
            let part = strain.tr_mul(&(section.coupling * self.curvature())) * area;
            self.stiffness += part + part.transpose();
        }
        let tension = self.tension.1;
        self.strain = (strain, area);
        self.tension.0 = strain.tr_mul(&Vector3::new(tension, tension, 0.0)) * area;
    }

    /// Mean curvature [1/m].
    fn curvature(&self) -> Matrix3x18 {
        spread(BENDING, &self.formulation.mean_curvature(&self.corners))
    }

    /// Adds a tension [N/m] in its rest shape, equal in all directions.
    #[must_use]
    pub fn under_tension(self, tension: f64) -> Self {
        let (strain, area) = self.strain;
        let forces = strain.tr_mul(&Vector3::new(tension, tension, 0.0)) * area;
        Self { tension: (forces, tension), ..self }
    }

    /// Gives a curved membrane the normals of its corners at rest, and says which of its edges are straight;
    /// others stay as they are.
    pub fn curve(&mut self, normals: [Vector3<f64>; 3], straight: [bool; 6]) {
        let Membrane::Curved { adaptation } = self.formulation.membrane else { return };
        let back = self.axes.inverse();
        let curved = (normals.map(|normal| back * normal), straight);
        if self.curved == Some(curved) {
            return;
        }
        self.curved = Some(curved);
        let corners = self.corners.map(|corner| corner.push(0.0));
        let patch = Patch::new(corners, curved.0, straight, EdgeRule::Arc);
        let CurvedMembrane { area, strain, hierarchical } = CurvedMembrane::new(&patch, &self.gradient);
        let higher = andes_higher(&self.corners, &self.elastic, self.thickness, adaptation);
        let membrane = strain.transpose() * (self.elastic.matrix * (self.thickness * area)) * strain
            + hierarchical.transpose() * higher * hierarchical;
        self.put_together(membrane, strain, area);
    }

    /// Places the facet, with its nodes at positions [m] and turned from rest by rotations.
    ///
    /// # Errors
    /// If its area is zero or not finite, or a node has turned too far against it.
    pub fn place(
        &self,
        x: &[Vector3<f64>; 3],
        rotation: &[UnitQuaternion<f64>; 3],
    ) -> Result<Placed, Broken> {
        let centroid = (x[0] + x[1] + x[2]) / 3.0;
        let cross = (x[1] - x[0]).cross(&(x[2] - x[0]));
        let double_area = cross.norm();
        has_area(double_area)?;
        let normal = cross / double_area;
        let side = (x[1] - x[0]).normalize();
        let plane = Matrix3x2::from_columns(&[side, normal.cross(&side)]);
        let flat = x.map(|x| plane.tr_mul(&(x - centroid)));
        // F = Σ q ⊗ ∇N, and the rotation of its polar decomposition.
        let f = |row: usize, column: usize| -> f64 {
            (0..3).map(|i| flat[i][row] * self.gradient[i][column]).sum()
        };
        let (sum, difference) = (f(0, 0) + f(1, 1), f(1, 0) - f(0, 1));
        let trace = (sum * sum + difference * difference).sqrt();
        let (sine, cosine) = if trace > 0.0 { (difference / trace, sum / trace) } else { (0.0, 1.0) };
        let e1 = plane * Vector2::new(cosine, sine);
        let e2 = plane * Vector2::new(-sine, cosine);
        let axes = Matrix3::from_columns(&[e1, e2, normal]);
        let local = flat.map(|q| Vector2::new(cosine * q.x + sine * q.y, cosine * q.y - sine * q.x));

        let back = quaternion(axes).inverse();
        let theta = rotation.map(|r| logarithm(&(back * r * self.axes)));
        let mut deformation = Vector18::zeros();
        for i in 0..3 {
            let moved = local[i] - self.corners[i];
            deformation[6 * i] = moved.x;
            deformation[6 * i + 1] = moved.y;
            deformation.fixed_rows_mut::<3>(6 * i + 3).copy_from(&theta[i]);
        }
        theta.iter().try_for_each(not_folded)?;
        Ok(Placed { axes, local, deformation })
    }

    /// Data of the facet at rest.
    pub fn at_rest(&self) -> FacetAtRest<'_> {
        FacetAtRest {
            axes: self.axes.to_rotation_matrix().into_inner(),
            corners: self.corners,
            gradient: self.gradient,
            stiffness: &self.stiffness,
            tension: &self.tension.0,
        }
    }

    /// Stiffness of all, in the facet's axes.
    pub fn stiffness(&self) -> &Matrix18 {
        &self.stiffness
    }

    /// Nodal forces of its tension at rest.
    pub fn tension(&self) -> &Vector18 {
        &self.tension.0
    }

    /// Gradients of the shape functions at rest [1/m].
    pub fn gradient(&self) -> &[Vector2<f64>; 3] {
        &self.gradient
    }

    /// Work of the tension at rest along a deformation [J], in addition to the elastic energy.
    fn tension_energy(&self, d: &Vector18) -> f64 {
        d.dot(&self.tension.0)
    }

    /// Energy in its parts.
    pub fn energy(&self, placed: &Placed) -> ShellEnergy {
        let d = &placed.deformation;
        let whole = 0.5 * d.dot(&(self.stiffness * d));
        let turned = SVector::<f64, 9>::from_fn(|i, _| d[BENDING[i]]);
        let mut bending = 0.5 * turned.dot(&(self.bending * turned));
        let strain = self.strain.0 * d;
        if let Some(section) = &self.section {
            bending += strain.dot(&(section.coupling * (self.curvature() * d))) * self.strain.1;
        }
        let membrane = 0.5 * self.thickness * self.strain.1 * strain.dot(&(self.elastic.matrix * strain));
        let drilling = (whole - membrane - bending).max(0.0);
        ShellEnergy { membrane: membrane + self.tension_energy(d), bending, drilling }
    }

    /// Mean forces and moments per length. Forces are t D times the mean strain. Moments do the same work
    /// with a uniform curvature as the element's nodal forces (for the discrete Kirchhoff triangle D times
    /// the mean curvature).
    pub fn resultants(&self, placed: &Placed) -> Resultants {
        let d = &placed.deformation;
        let strain = self.strain.0 * d;
        let tension = Vector3::new(self.tension.1, self.tension.1, 0.0);
        let mut membrane = self.elastic.matrix * strain * self.thickness + tension;
        let force = self.bending * SVector::<f64, 9>::from_fn(|i, _| d[BENDING[i]]);
        let mut moment = Vector3::zeros();
        for (i, corner) in self.corners.iter().enumerate() {
            let (x, y) = (corner.x, corner.y);
            let [fz, mx, my] = [0, 1, 2].map(|c| force[3 * i + c]);
            // w of curvatures −w,xx = 1, −w,yy = 1 and −2 w,xy = 1, with θx = w,y and θy = −w,x.
            let deflection = -0.5 * Vector3::new(x * x, y * y, x * y);
            moment += deflection * fz + Vector3::new(x * my, -y * mx, 0.5 * (y * my - x * mx));
        }
        moment /= self.area;
        if let Some(section) = &self.section {
            membrane += section.coupling * (self.curvature() * d);
            moment += section.coupling * strain;
        }
        Resultants { membrane, moment, axes: placed.axes }
    }

    /// The largest ω² [1/s²] of the element by itself about its rest shape, with its lumped masses: none of
    /// the model's is higher.
    pub fn highest_frequency_squared(&self) -> f64 {
        let scale = |i: usize| if i % 6 < 3 { self.mass } else { self.inertia }.sqrt();
        let scaled = Matrix18::from_fn(|i, j| self.stiffness[(i, j)] / (scale(i) * scale(j)));
        SymmetricEigen::new(scaled).eigenvalues.max()
    }

    /// Its membrane element.
    pub fn membrane(&self) -> Membrane {
        self.formulation.membrane
    }

    /// The longest stable step [s] of the element by itself, at rest.
    pub fn stable_step(&self) -> f64 {
        2.0 / self.highest_frequency_squared().sqrt()
    }

    /// The largest force of a displacement of one node [N/m]: of slivers far above E t.
    pub fn stiffest(&self) -> f64 {
        (0..18).filter(|i| i % 6 < 3).map(|i| self.stiffness[(i, i)]).fold(0.0, f64::max)
    }

    /// Stress (σxx, σyy, σxy) [Pa] at the top, in the middle and at the bottom, and the largest von Mises
    /// stress there. In a wall of layers the largest includes the faces of each layer.
    pub fn stresses(&self, resultants: &Resultants) -> ([Vector3<f64>; 3], f64) {
        let mises = |s: &Vector3<f64>| (s.x * s.x - s.x * s.y + s.y * s.y + 3.0 * s.z * s.z).sqrt();
        let Some(section) = &self.section else {
            let stresses =
                [0.5, 0.0, -0.5].map(|part| resultants.stress(self.thickness, part * self.thickness));
            return (stresses, stresses.iter().map(mises).fold(0.0, f64::max));
        };
        // The tension at rest is the same in all layers.
        let tension = Vector3::new(self.tension.1, self.tension.1, 0.0);
        let elastic = resultants.membrane - tension;
        let (stresses, faces) = section.stresses(&elastic, &resultants.moment);
        let whole = |stress: Vector3<f64>| stress + tension / self.thickness;
        (stresses.map(whole), faces.map(|stress| mises(&whole(stress))).fold(0.0, f64::max))
    }

    /// Strain of the facet.
    pub fn strain(&self, placed: &Placed) -> ShellStrain {
        let entry = |row: usize, column: usize| -> f64 {
            (0..3).map(|i| placed.local[i][row] * self.gradient[i][column]).sum()
        };
        let strain = Vector3::new(entry(0, 0) - 1.0, entry(1, 1) - 1.0, entry(0, 1) + entry(1, 0));
        let bending = SVector::<f64, 9>::from_fn(|i, _| placed.deformation[BENDING[i]]);
        ShellStrain::new(&strain, &(self.mean_curvature * bending), self.thickness)
    }

    /// Thickness [m] with the strain across from plane stress, t (A/A₀)^(−ν/(1 − ν)). For small strains the
    /// strain across is −ν/(1 − ν) (ε₁ + ε₂). For ν = ½ the volume stays the same at any strain. Forces do
    /// not depend on this thickness.
    pub fn thickness_now(&self, placed: &Placed) -> f64 {
        let nu = self.elastic.poisson;
        let ratio = area(&placed.local) / self.area;
        self.thickness * ratio.powf(-nu / (1.0 - nu))
    }

    /// True if it resists bending.
    pub fn bends(&self) -> bool {
        self.bending != Matrix9::zeros()
    }

    /// True if its nodes turn. Nodes of a mere membrane do not.
    pub fn turns(&self) -> bool {
        self.formulation.bending != Bending::None || self.formulation.membrane == Membrane::None
    }

    /// The smallest altitude at rest [m].
    pub fn altitude(&self) -> f64 {
        let longest =
            (0..3).map(|i| (self.corners[i] - self.corners[(i + 1) % 3]).norm()).fold(0.0, f64::max);
        2.0 * self.area / longest
    }
}

/// Strains over the nine displacements at some places, over all eighteen.
fn spread(places: [usize; 9], strains: &SMatrix<f64, 3, 9>) -> Matrix3x18 {
    let mut wide = Matrix3x18::zeros();
    for (column, place) in places.into_iter().enumerate() {
        wide.set_column(place, &strains.column(column));
    }
    wide
}

/// Adds a part of the stiffness at its places among the eighteen.
fn add_block(k: &mut Matrix18, places: [usize; 9], part: &Matrix9) {
    for (j, &column) in places.iter().enumerate() {
        for (i, &row) in places.iter().enumerate() {
            k[(row, column)] += part[(i, j)];
        }
    }
}

/// Keeps the symmetric part.
pub fn symmetrise(k: &mut Matrix18) {
    for j in 0..18 {
        for i in 0..j {
            let mean = 0.5 * (k[(i, j)] + k[(j, i)]);
            (k[(i, j)], k[(j, i)]) = (mean, mean);
        }
    }
}

/// Returns an error if twice an area [m²] is not positive or not finite.
pub(crate) fn has_area(double_area: f64) -> Result<(), Broken> {
    let is_some = double_area > 0.0 && double_area.is_finite();
    if is_some { Ok(()) } else { Err(Broken::Area(0.5 * double_area)) }
}

/// An error if a node has turned too far against its facet [rad].
pub(crate) fn not_folded(theta: &Vector3<f64>) -> Result<(), Broken> {
    // Written so that NaN is found too.
    let is_safe = theta.xy().norm() < FOLDED && theta.norm() < FULL;
    if is_safe { Ok(()) } else { Err(Broken::Folded(theta.norm())) }
}

fn quaternion(axes: Matrix3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes))
}
