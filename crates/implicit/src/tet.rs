//! Linear tetrahedra in large rotation with the co-rotated linear law ψ = μ |F − R|² + λ/2 tr²(Rᵀ F − I), R the rotation of the polar
//! decomposition of F: its force P = 2μ (F − R) + λ tr(Rᵀ F − I) R is the exact gradient, its tangent symmetric (McAdams et al. 2011,
//! ACM TOG 30:37). For small strains it is linear elasticity.
//! Leaves out: large strains and incompressibility (ν near 0.5 locks; see `pliant-mechanics` for elements that do not).

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use crate::facet::Broken;
use crate::model::Material;
use crate::state::State;

/// Numbers of (x, y, z) of four nodes, node by node.
pub(crate) type Vector12 = SVector<f64, 12>;

/// Stiffness over them.
pub(crate) type Matrix12 = SMatrix<f64, 12, 12>;

/// What a tetrahedron bears at a state.
pub(crate) struct TetStress {
    /// Cauchy stress [Pa].
    pub(crate) cauchy: Matrix3<f64>,
    /// Strain energy over the volume at rest [J/m³].
    pub(crate) density: f64,
    /// J.
    pub(crate) volume_ratio: f64,
}

/// A tetrahedron: what its rest shape gives.
#[derive(Clone, Debug)]
pub struct Tet {
    /// Nodes; (1−0, 2−0, 3−0) is right-handed.
    pub nodes: [u32; 4],
    /// Volume at rest [m³].
    pub volume: f64,
    /// Mass that it gives to each node [kg].
    pub mass: f64,
    /// Gradients of the shape functions [1/m].
    gradient: [Vector3<f64>; 4],
    /// Lamé's constants λ and μ [Pa].
    lame: [f64; 2],
}

impl Tet {
    /// A tetrahedron of corners at rest [m]; the signed volume if it is not positive.
    ///
    /// # Errors
    /// If the volume is not above 1e-12 of the longest edge cubed.
    pub fn new(nodes: [u32; 4], rest: [Vector3<f64>; 4], material: Material) -> Result<Self, f64> {
        let [a, b, c] = [1, 2, 3].map(|i| rest[i] - rest[0]);
        let edges = Matrix3::from_columns(&[a, b, c]);
        let volume = edges.determinant() / 6.0;
        let longest = [a, b, c, b - a, c - b, a - c].iter().map(|e| e.norm()).fold(0.0, f64::max);
        let Some(inverse) = edges.try_inverse().filter(|_| volume > 1e-12 * longest.powi(3)) else {
            return Err(volume);
        };
        let [g1, g2, g3] = [0, 1, 2].map(|i| inverse.row(i).transpose());
        let (young, nu) = (material.elastic.young, material.elastic.poisson);
        Ok(Self {
            nodes,
            volume,
            mass: material.density * volume / 4.0,
            gradient: [-g1 - g2 - g3, g1, g2, g3],
            lame: [young * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), 0.5 * young / (1.0 + nu)],
        })
    }

    fn gradient_at(&self, x: &[Vector3<f64>; 4]) -> Matrix3<f64> {
        x.iter().zip(&self.gradient).fold(Matrix3::zeros(), |f, (x, g)| f + x * g.transpose())
    }

    /// Energy [J] and internal nodal forces at a state, with the stiffness if asked for.
    pub(crate) fn force(
        &self,
        state: &State,
        tangent: Option<&mut Matrix12>,
    ) -> Result<(f64, Vector12), Broken> {
        let f = self.gradient_at(&self.nodes.map(|node| state.position[node as usize]));
        let determinant = f.determinant();
        if determinant <= 0.0 || determinant.is_nan() {
            return Err(Broken::Inverted(determinant));
        }
        let [lambda, mu] = self.lame;
        let r = rotation(&f);
        let s = r.tr_mul(&f);
        let trace = s.trace() - 3.0;
        let stress = 2.0 * mu * (f - r) + lambda * trace * r;
        let energy = self.volume * (mu * (f - r).norm_squared() + 0.5 * lambda * trace * trace);
        let mut force = Vector12::zeros();
        for (i, g) in self.gradient.iter().enumerate() {
            force.fixed_rows_mut::<3>(3 * i).copy_from(&(self.volume * stress * g));
        }
        if let Some(k) = tangent {
            let spread = Matrix3::from_diagonal_element(s.trace()) - s;
            let Some(inverse) = spread.try_inverse() else { return Err(Broken::Inverted(determinant)) };
            for (j, g) in self.gradient.iter().enumerate() {
                for c in 0..3 {
                    let df = Vector3::ith(c, 1.0) * g.transpose();
                    let a = r.tr_mul(&df);
                    let axial =
                        Vector3::new(a[(2, 1)] - a[(1, 2)], a[(0, 2)] - a[(2, 0)], a[(1, 0)] - a[(0, 1)]);
                    let dr = r * crate::rotation::skew(&(inverse * axial));
                    let dp = 2.0 * mu * (df - dr) + lambda * (a.trace() * r + trace * dr);
                    for (i, g) in self.gradient.iter().enumerate() {
                        let mut block = k.fixed_view_mut::<3, 1>(3 * i, 3 * j + c);
                        block.copy_from(&(self.volume * dp * g));
                    }
                }
            }
        }
        Ok((energy, force))
    }

    /// Cauchy stress P Fᵀ/J with P = R (2μ (S − I) + λ tr(S − I) I), and the energy density it is the derivative of.
    pub(crate) fn stress(&self, state: &State) -> Result<TetStress, Broken> {
        let f = self.gradient_at(&self.nodes.map(|node| state.position[node as usize]));
        let volume_ratio = f.determinant();
        if volume_ratio <= 0.0 || volume_ratio.is_nan() {
            return Err(Broken::Inverted(volume_ratio));
        }
        let [lambda, mu] = self.lame;
        let r = rotation(&f);
        let trace = r.dot(&f) - 3.0;
        let cauchy = (2.0 * mu * (f - r) + lambda * trace * r) * f.transpose() / volume_ratio;
        Ok(TetStress {
            cauchy: 0.5 * (cauchy + cauchy.transpose()),
            density: mu * (f - r).norm_squared() + 0.5 * lambda * trace * trace,
            volume_ratio,
        })
    }

    /// The longest stable step [s] by itself, at rest.
    pub fn stable_step(&self) -> f64 {
        2.0 / self.highest_frequency_squared().sqrt()
    }

    /// The largest ω² [1/s²] by itself about rest, with its lumped mass.
    pub(crate) fn highest_frequency_squared(&self) -> f64 {
        let [lambda, mu] = self.lame;
        let mut k = Matrix12::zeros();
        for (i, gi) in self.gradient.iter().enumerate() {
            for (j, gj) in self.gradient.iter().enumerate() {
                let block = lambda * gi * gj.transpose()
                    + mu * gj * gi.transpose()
                    + Matrix3::from_diagonal_element(mu * gi.dot(gj));
                k.fixed_view_mut::<3, 3>(3 * i, 3 * j).copy_from(&(self.volume * block));
            }
        }
        nalgebra::SymmetricEigen::new(k / self.mass).eigenvalues.max()
    }

    /// The stiffness of a wave of compression [Pa].
    pub(crate) fn modulus(&self) -> f64 {
        self.lame[0] + 2.0 * self.lame[1]
    }
}

/// The rotation of the polar decomposition of a matrix with positive determinant: Newton's iteration R ← (R + R⁻ᵀ)/2, scaled
/// (Higham 1986), to round-off.
fn rotation(f: &Matrix3<f64>) -> Matrix3<f64> {
    let mut r = *f;
    for _ in 0..40 {
        let Some(inverse) = r.try_inverse() else { return r };
        let scale = (inverse.norm() / r.norm()).sqrt();
        let next = 0.5 * (scale * r + inverse.transpose() / scale);
        let still = (next - r).norm() < 1e-15 * next.norm();
        r = next;
        if still {
            break;
        }
    }
    r
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::Elasticity;
    use crate::model::Model;
    use crate::rotation::exponential;
    use pliant_testing::Random;

    fn tet() -> (Tet, Model) {
        let rest = [[0.0, 0.0, 0.0], [1.0, 0.1, 0.0], [0.2, 0.9, 0.1], [0.1, 0.3, 0.8]].map(Vector3::from);
        let material = Material { elastic: Elasticity { young: 1e3, poisson: 0.3 }, density: 1000.0 };
        (Tet::new([0, 1, 2, 3], rest, material).unwrap(), Model::new(rest.to_vec()))
    }

    /// Turned far, strained by up to 30 %.
    fn state(model: &Model, seed: u64) -> State {
        let mut random = Random::new(seed);
        let turn = exponential(&Vector3::new(1.0, -2.0, 0.5));
        let mut state = State::at_rest(model);
        for x in &mut state.position {
            *x = turn * (*x + 0.1 * Vector3::from_fn(|_, _| random.number()));
        }
        state
    }

    /// Central differences with 1e-5: 1e-8 of the force, 1e-8 of the stiffness; the tangent is symmetric.
    #[test]
    fn force_and_tangent_are_derivatives() {
        let (tet, model) = tet();
        let state = state(&model, 1);
        let mut k = Matrix12::zeros();
        let (_, force) = tet.force(&state, Some(&mut k)).unwrap();
        let h = 1e-5;
        for place in 0..12 {
            let at = |by: f64| {
                let mut state = state.clone();
                state.position[place / 3][place % 3] += by;
                tet.force(&state, None).unwrap()
            };
            let (ahead, behind) = (at(h), at(-h));
            assert!(((ahead.0 - behind.0) / (2.0 * h) - force[place]).abs() < 1e-8 * force.amax());
            let off = (ahead.1 - behind.1) / (2.0 * h) - k.column(place);
            assert!(off.amax() < 1e-8 * k.amax(), "{place}: {off}");
        }
        assert!((k - k.transpose()).amax() < 1e-12 * k.amax());
    }

    #[test]
    fn a_rigid_rotation_costs_nothing_and_inversion_is_told() {
        let (tet, model) = tet();
        let turn = exponential(&Vector3::new(2.0, 1.0, -0.5));
        let mut state = State::at_rest(&model);
        state.position.iter_mut().for_each(|x| *x = turn * *x);
        let (energy, force) = tet.force(&state, None).unwrap();
        assert!(energy < 1e-20 && force.amax() < 1e-10, "{energy:e} {force}");
        state.position.iter_mut().for_each(|x| x.z = -x.z);
        assert!(matches!(tet.force(&state, None), Err(Broken::Inverted(_))));
    }
}
