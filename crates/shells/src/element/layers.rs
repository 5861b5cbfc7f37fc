//! Walls of layers: classical laminate theory (Reissner and Stavsky 1961, J. Appl. Mech. 28:402; Jones 1999).
//! Each layer has the plane stress Q, turned to the axes of the wall. Strains ε and curvatures κ give the
//! membrane forces n = A ε + B κ and the moments m = B ε + D κ. Here (A, B, D) = ∫ Q (1, z, z²) dz. Leaves
//! out: shear across the thickness, slip between layers.

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use super::{Elasticity, PlaneStress};

/// Elasticity of a layer in its plane, along its axes 1 and 2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orthotropic {
    /// Young's moduli along the axes [Pa].
    pub young: [f64; 2],
    /// Poisson's ratio ν₁₂: how much axis 2 shortens when axis 1 is pulled.
    pub poisson: f64,
    /// Shear modulus in the plane [Pa].
    pub shear: f64,
}

impl From<Elasticity> for Orthotropic {
    fn from(elastic: Elasticity) -> Self {
        Self { young: [elastic.young; 2], poisson: elastic.poisson, shear: elastic.shear() }
    }
}

impl Orthotropic {
    /// True if every deformation costs energy: moduli above 0, and ν₁₂² < E₁/E₂.
    pub fn is_stable(&self) -> bool {
        let [first, second] = self.young;
        let positive =
            [first, second, self.shear].iter().all(|modulus| *modulus > 0.0 && modulus.is_finite());
        positive && self.poisson * self.poisson < first / second
    }

    /// Stress (σ₁₁, σ₂₂, σ₁₂) over strain (ε₁₁, ε₂₂, γ₁₂) [Pa].
    fn matrix(&self) -> Matrix3<f64> {
        let [first, second] = self.young;
        let part = 1.0 - self.poisson * self.poisson * second / first;
        let mixed = self.poisson * second / part;
        Matrix3::new(first / part, mixed, 0.0, mixed, second / part, 0.0, 0.0, 0.0, self.shear)
    }

    /// Stress over strain in axes from which axis 1 is turned by an angle [rad].
    fn turned(&self, angle: f64) -> Matrix3<f64> {
        let (s, c) = angle.sin_cos();
        #[rustfmt::skip]
        let to_own = Matrix3::new(
            c * c, s * s, c * s,
            s * s, c * c, -c * s,
            -2.0 * c * s, 2.0 * c * s, c * c - s * s,
        );
        to_own.transpose() * self.matrix() * to_own
    }
}

/// A layer of a wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layer {
    /// Its elasticity.
    pub elastic: Orthotropic,
    /// Thickness [m].
    pub thickness: f64,
    /// Angle [rad] of its axis 1 from the wall's direction, counter-clockwise about the normal.
    pub angle: f64,
    /// Density [kg/m³].
    pub density: f64,
}

/// The thickness of some layers [m].
pub(crate) fn thickness(layers: &[Layer]) -> f64 {
    layers.iter().map(|layer| layer.thickness).sum()
}

/// The mean over the thickness of what the layers have [1/m³ of their density].
pub(crate) fn density(layers: &[Layer]) -> f64 {
    layers.iter().map(|layer| layer.density * layer.thickness).sum::<f64>() / thickness(layers)
}

/// The isotropic elasticity that layers have as a mean over all angles (Tsai and Pagano 1968). It represents
/// the layers where an element needs one number.
pub(crate) fn mean(layers: &[Layer]) -> Elasticity {
    let whole = thickness(layers);
    let q = layers
        .iter()
        .fold(Matrix3::zeros(), |sum, layer| sum + layer.elastic.matrix() * (layer.thickness / whole));
    let ends = q[(0, 0)] + q[(1, 1)];
    let along = (3.0 * ends + 2.0 * q[(0, 1)] + 4.0 * q[(2, 2)]) / 8.0;
    let across = (ends + 6.0 * q[(0, 1)] - 4.0 * q[(2, 2)]) / 8.0;
    let poisson = across / along;
    Elasticity { young: along * (1.0 - poisson * poisson), poisson }
}

/// A layer in its wall.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Ply {
    /// Heights of its faces above the middle surface [m].
    heights: [f64; 2],
    /// Stress over strain in the wall's axes [Pa].
    stiffness: Matrix3<f64>,
}

/// Stiffness of a wall per length, in its axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    /// A [N/m].
    stretch: Matrix3<f64>,
    /// B [N].
    pub(crate) coupling: Matrix3<f64>,
    /// D [N m].
    flexure: Matrix3<f64>,
    /// ε and κ over n and m.
    compliance: Matrix6<f64>,
    plies: Vec<Ply>,
    thickness: f64,
    mean: Elasticity,
}

impl Section {
    /// Makes the section of layers from the bottom (against the normal) to the top. The direction of the
    /// layers is turned by an angle [rad] from the first axis.
    pub fn new(layers: &[Layer], direction: f64) -> Self {
        let whole = thickness(layers);
        let mut bottom = -0.5 * whole;
        let (mut a, mut b, mut d) = (Matrix3::zeros(), Matrix3::zeros(), Matrix3::zeros());
        let mut plies = Vec::with_capacity(layers.len());
        for layer in layers {
            let top = bottom + layer.thickness;
            let stiffness = layer.elastic.turned(direction + layer.angle);
            a += stiffness * (top - bottom);
            b += stiffness * ((top * top - bottom * bottom) / 2.0);
            d += stiffness * ((top.powi(3) - bottom.powi(3)) / 3.0);
            plies.push(Ply { heights: [bottom, top], stiffness });
            bottom = top;
        }
        let mut stiffness = Matrix6::zeros();
        for (row, column, part) in [(0, 0, &a), (0, 3, &b), (3, 0, &b), (3, 3, &d)] {
            stiffness.fixed_view_mut::<3, 3>(row, column).copy_from(part);
        }
        // Of stable layers it is positive definite.
        let compliance = stiffness.try_inverse().unwrap_or_else(|| Matrix6::repeat(f64::NAN));
        Self { stretch: a, coupling: b, flexure: d, compliance, plies, thickness: whole, mean: mean(layers) }
    }

    /// Plane stress of a homogeneous wall of the same thickness that stretches like this one, without
    /// bending.
    pub fn in_plane(&self) -> PlaneStress {
        PlaneStress { matrix: self.stretch / self.thickness, ..PlaneStress::from(self.mean) }
    }

    /// Plane stress of a homogeneous wall of the same thickness that bends like this one, without stretch.
    pub(crate) fn in_bending(&self) -> PlaneStress {
        let matrix = self.flexure * (12.0 / self.thickness.powi(3));
        PlaneStress { matrix, ..PlaneStress::from(self.mean) }
    }

    /// Stress [Pa] under membrane forces [N/m] and moments [N]. It is given at the top, in the middle (of two
    /// layers there the upper one), at the bottom, and at both faces of each layer.
    pub(crate) fn stresses(
        &self,
        forces: &Vector3<f64>,
        moments: &Vector3<f64>,
    ) -> ([Vector3<f64>; 3], impl Iterator<Item = Vector3<f64>>) {
        let strains =
            self.compliance * Vector6::new(forces.x, forces.y, forces.z, moments.x, moments.y, moments.z);
        let (strain, curvature) =
            (strains.fixed_rows::<3>(0).into_owned(), strains.fixed_rows::<3>(3).into_owned());
        let at = move |ply: &Ply, height: f64| ply.stiffness * (strain + height * curvature);
        let [first, last] = [self.plies.first(), self.plies.last()]
            .map(|ply| ply.copied().unwrap_or(Ply { heights: [0.0; 2], stiffness: Matrix3::zeros() }));
        let middle = self.plies.iter().find(|ply| ply.heights[1] > 0.0).copied().unwrap_or(last);
        let faces = self.plies.iter().flat_map(move |ply| ply.heights.map(|height| at(ply, height)));
        ([at(&last, last.heights[1]), at(&middle, 0.0), at(&first, first.heights[0])], faces)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOFT: Orthotropic = Orthotropic { young: [2e6, 0.5e6], poisson: 0.3, shear: 0.2e6 };

    fn layer(angle: f64) -> Layer {
        Layer { elastic: SOFT, thickness: 1e-3, angle: angle.to_radians(), density: 1000.0 }
    }

    /// Isotropic layers of one kind are one wall: A = t Q, B = 0, D = t³ Q/12.
    #[test]
    fn layers_of_one_kind_are_one_wall() {
        let elastic = Elasticity { young: 1e6, poisson: 0.3 };
        let one = |angle| Layer { elastic: elastic.into(), ..layer(angle) };
        let section = Section::new(&[one(0.0), one(20.0), one(70.0)], 0.4);
        let q = elastic.matrix();
        assert!((section.in_plane().matrix - q).norm() < 1e-12 * q.norm());
        assert!((section.in_bending().matrix - q).norm() < 1e-12 * q.norm());
        assert!(section.coupling.norm() < 1e-12 * q.norm() * 9e-6);
        let PlaneStress { poisson, shear, .. } = section.in_plane();
        assert!((poisson - 0.3).abs() < 1e-12 && (shear / elastic.shear() - 1.0).abs() < 1e-12);
    }

    /// A layer turned by a right angle has its axes swapped; one turned half a turn is itself.
    #[test]
    fn turning_swaps_the_axes() {
        let (q, turned) = (SOFT.matrix(), SOFT.turned(90_f64.to_radians()));
        assert!((turned[(0, 0)] - q[(1, 1)]).abs() < 1e-9 && (turned[(1, 1)] - q[(0, 0)]).abs() < 1e-9);
        assert!((SOFT.turned(std::f64::consts::PI) - q).norm() < 1e-9 * q.norm());
        // Pulled along its stiff axis at 30°, it does not shear in its own axes: E₁ ν₁₂ there (Jones 1999,
        // 2.97).
        let inverse = SOFT.turned(30_f64.to_radians()).try_inverse().unwrap();
        let (s, c) = 30_f64.to_radians().sin_cos();
        let young = 1.0 / (c.powi(4) / 2e6 + s.powi(4) / 0.5e6 + (1.0 / 0.2e6 - 0.6 / 2e6) * s * s * c * c);
        assert!((1.0 / inverse[(0, 0)] / young - 1.0).abs() < 1e-12);
    }

    /// ±θ: no coupling of stretch and shear; and only stretch with twist, as they are not symmetric. Four of
    /// them are.
    #[test]
    fn balanced_layers_do_not_shear() {
        let pair = Section::new(&[layer(35.0), layer(-35.0)], 0.0);
        let scale = pair.stretch.norm();
        assert!(pair.stretch[(0, 2)].abs().max(pair.stretch[(1, 2)].abs()) < 1e-12 * scale);
        assert!(pair.coupling[(0, 0)].abs() < 1e-15 * scale && pair.coupling[(0, 2)].abs() > 1e-5 * scale);
        let four = Section::new(&[layer(35.0), layer(-35.0), layer(-35.0), layer(35.0)], 0.0);
        assert!(four.coupling.norm() < 1e-12 * scale);
    }

    /// Stress at the faces adds up to the forces and moments it came from: it is linear in each layer.
    #[test]
    fn stresses_add_up_to_forces_and_moments() {
        let layers = [layer(10.0), Layer { thickness: 2e-3, ..layer(-60.0) }, layer(80.0)];
        let section = Section::new(&layers, 0.3);
        let (n, m) = (Vector3::new(100.0, -40.0, 25.0), Vector3::new(0.02, 0.05, -0.03));
        let ([top, _, bottom], faces) = section.stresses(&n, &m);
        let faces: Vec<Vector3<f64>> = faces.collect();
        assert_eq!((bottom, top), (faces[0], faces[5]));
        let (mut forces, mut moments) = (Vector3::zeros(), Vector3::zeros());
        for (ply, ends) in section.plies.iter().zip(faces.chunks(2)) {
            let [low, high] = ply.heights;
            let t = high - low;
            forces += (ends[0] + ends[1]) * (0.5 * t);
            // ∫ z σ dz with σ linear: Simpson's rule is exact.
            let middle = (ends[0] + ends[1]) * 0.5 * (0.5 * (low + high));
            moments += (ends[0] * low + 4.0 * middle + ends[1] * high) * (t / 6.0);
        }
        assert!((forces - n).norm() < 1e-10 * n.norm() && (moments - m).norm() < 1e-10 * m.norm());
    }
}
