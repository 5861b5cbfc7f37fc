//! The shear stiffness of a deformed state over the shear stiffness at rest. It makes the stiffness against
//! hourglass patterns follow the law.
//!
//! The modulus |dev τ| / |dev b̄| belongs to a neo-Hookean solid with the same Kirchhoff stress τ at the same
//! b̄ = J^(−2/3) F Fᵀ. In a plane of two principal stretches it is (τᵢ − τⱼ)/(λ̄ᵢ² − λ̄ⱼ²). This is the
//! tangent modulus of a superposed shear over the mean of λ̄² (Ogden 1984, *Non-linear Elastic Deformations*,
//! 6.3). The ratio of that modulus to the one at rest is
//!
//! ```text
//! r = |dev τ| / (μ √(|dev b̄|² + ε²)),   ε = SMALL,
//! ```
//!
//! where ε keeps it below 1 at small strains, at which both norms are round-off. The factor is 1 up to r = 1
//! and close to r far above:
//!
//! ```text
//! g = 1 + x³/(x² + δ²),   x = max(r − 1, 0),   δ = BEND.
//! ```
//!
//! It has two continuous derivatives, which Newton's method and explicit steps need; max(1, r) has a kink.
//! It depends on F alone. Its gradient is ∂g/∂F = F G with
//!
//! ```text
//! G = g′ r ((2 T S + S′)/|dev τ|² − ∂|dev b̄|²/∂C / (|dev b̄|² + ε²)),   g′ = (x⁴ + 3 δ² x²)/(x² + δ²)²,   T = S C − ⅓ tr(S C) I,
//! ```
//!
//! where S′ is the derivative of S along δF = dev τ F = F T, found by differences: only the stress of a law
//! is needed. A part J U′(J) C⁻¹ of the stress does not change G, since its 2 T S + S′ vanishes.

use super::Deformation;
use crate::Number;
use crate::tensor::{Symmetric, Tensor, dot};

/// ε: |dev b̄| of about five per cent of shear. Below a tenth of μ the stress turns no cell over, and fibres
/// make r vary with the direction of strain.
const SMALL: f64 = 0.1;

/// δ: width of the range of r above 1 in which the factor bends from 1 to r.
const BEND: f64 = 0.1;

/// The growth of a point's shear stiffness.
#[derive(Clone, Copy, Debug)]
pub struct ShearGrowth<N> {
    /// g.
    pub factor: N,
    /// g′ r, the change of g by the change of ln r.
    slope: N,
    /// T [Pa].
    deviator: Tensor<N>,
    /// |dev τ|² [Pa²].
    stress_square: N,
    /// |dev b̄|².
    strain_square: N,
}

impl<N: Number> ShearGrowth<N> {
    /// From the elastic second Piola–Kirchhoff stress [Pa] of a deformation and the shear modulus at rest
    /// [Pa].
    #[inline(always)]
    pub fn new(deformation: &Deformation<N>, stress: &Symmetric<N>, shear: N) -> Self {
        let strain = &deformation.strain_twice;
        let mut deviator = stress.full().times_symmetric(&strain.plus_isotropic(N::ONE));
        let third = N::of(1.0 / 3.0);
        let mean = deviator.trace() * third;
        (0..3).for_each(|i| deviator.0[i][i] += -mean);
        let (rows, columns) = (deviator.0, deviator.transpose().0);
        let square = dot(rows[0], columns[0]) + dot(rows[1], columns[1]) + dot(rows[2], columns[2]);
        let stress_square = square.max(N::of(1e-30));
        let (q, trace) = (deformation.isochoric_factor, strain.trace());
        let strain_square = q * q * (strain.double_dot(strain) - trace * trace * third);
        let ratio = (stress_square / Self::judged(strain_square)).sqrt() / shear;
        let x = (ratio - N::ONE).max(N::of(0.0));
        let (square, bend) = (x * x, N::of(BEND * BEND));
        let share = square / (square + bend);
        Self {
            factor: N::ONE + share * x,
            slope: share * (square + bend * N::of(3.0)) / (square + bend) * ratio,
            deviator,
            stress_square,
            strain_square,
        }
    }

    /// |dev b̄|² + ε².
    #[inline(always)]
    fn judged(strain_square: N) -> N {
        strain_square + N::of(SMALL * SMALL)
    }

    /// dev τ F/|dev τ|, the direction of F in which the stress is asked for once more.
    #[inline(always)]
    pub fn direction(&self, deformation: &Deformation<N>) -> Tensor<N> {
        let mut direction = Tensor::ZERO;
        let columns = self.deviator.transpose().0;
        for (row, f) in direction.0.iter_mut().zip(deformation.gradient.0) {
            *row = [dot(f, columns[0]), dot(f, columns[1]), dot(f, columns[2])];
        }
        direction.scaled(N::ONE / self.stress_square.sqrt())
    }

    /// G, from the stress [Pa] and its derivative along [`direction`](Self::direction) [Pa].
    #[inline(always)]
    pub fn gradient(
        &self,
        deformation: &Deformation<N>,
        stress: &Symmetric<N>,
        derivative: &Symmetric<N>,
    ) -> Symmetric<N> {
        let Tensor([x, y, z]) = self.deviator.times_symmetric(stress);
        let product = Symmetric([x[0], y[1], z[2], x[1], y[2], x[2]]);
        let of_stress = (product + product).plus_scaled(derivative, self.stress_square.sqrt());
        let (q, strain) = (deformation.isochoric_factor, &deformation.strain_twice);
        let shape = strain.plus_isotropic(-strain.trace() * N::of(1.0 / 3.0)) * (N::of(2.0) * q * q);
        let volume = N::of(-2.0 / 3.0) * self.strain_square;
        let of_strain = shape.plus_scaled(&deformation.inverse_cauchy_green, volume);
        let change = (of_stress * (N::ONE / self.stress_square))
            .plus_scaled(&of_strain, -(N::ONE / Self::judged(self.strain_square)));
        change * self.slope
    }
}

#[cfg(test)]
mod tests {
    use pliant_testing::Random;

    use super::super::samples::every_law;
    use super::super::{AnyLaw, NeoHookean, Volumetric};
    use super::*;

    const UNIT: [[f64; 3]; 2] = [[0.6, 0.0, 0.8], [0.0, 1.0, 0.0]];

    fn at(law: &AnyLaw, h: &Tensor<f64>) -> (Deformation<f64>, Symmetric<f64>, ShearGrowth<f64>) {
        let deformation = Deformation::from_displacement_gradient(h);
        let split = law.stress(&deformation, &UNIT[..law.families()]);
        let stress = split.isochoric + split.volumetric;
        let growth = ShearGrowth::new(&deformation, &stress, law.small_strain().shear);
        (deformation, stress, growth)
    }

    /// The gradient matches differences for every law in a pressed and sheared state.
    #[test]
    fn the_gradient_is_the_derivative_of_the_factor() {
        let mut random = Random::new(23);
        let mut risen = 0;
        for law in every_law() {
            for _ in 0..4 {
                let mut h = Tensor(std::array::from_fn(|_| random.vector().map(|x| 0.25 * x)));
                h.0[2][2] -= 0.15;
                let (deformation, stress, growth) = at(&law, &h);
                let step = 1e-5;
                let direction = growth.direction(&deformation);
                let [ahead, behind] = [step, -step].map(|by| at(&law, &h.plus_scaled(&direction, by)).1);
                let derivative = (ahead - behind) * (0.5 / step);
                let gradient = growth.gradient(&deformation, &stress, &derivative);
                let gradient = deformation.gradient.times_symmetric(&gradient);
                risen += usize::from(growth.factor > 1.0);
                for i in 0..3 {
                    for j in 0..3 {
                        let moved = |by: f64| {
                            let mut moved = h;
                            moved.0[i][j] += by;
                            at(&law, &moved).2.factor
                        };
                        let slope = (moved(step) - moved(-step)) / (2.0 * step);
                        let apart = (slope - gradient.0[i][j]).abs();
                        assert!(apart < 1e-6 * growth.factor, "{}: {slope} {:?}", law.name(), gradient);
                    }
                }
            }
        }
        assert!(risen > 20, "{risen} states");
    }

    #[test]
    fn a_neo_hookean_solid_keeps_its_shear_stiffness() {
        let law = AnyLaw::NeoHookean(NeoHookean { shear: 700.0, volumetric: Volumetric::quadratic(7e5) });
        let mut random = Random::new(5);
        for size in [0.0, 1e-9, 1e-3, 0.3, 0.5] {
            let h = Tensor(std::array::from_fn(|_| random.vector().map(|x| size * x)));
            let growth = at(&law, &h).2;
            assert_eq!((growth.factor, law.keeps_shear_stiffness()), (1.0, true), "{size}");
        }
    }
}
