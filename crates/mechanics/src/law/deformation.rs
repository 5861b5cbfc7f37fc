//! What the laws need of a deformation, computed from the displacement gradient H = F − I so that small strains
//! keep their digits in single precision: J − 1 = tr H + II(H) + det H, C − I = H + Hᵀ + Hᵀ H.

use crate::Real;
use crate::tensor::{Symmetric, Tensor};

/// A deformation at one point and its measures.
#[derive(Clone, Copy, Debug)]
pub struct Deformation<R> {
    /// Deformation gradient F.
    pub gradient: Tensor<R>,
    /// Twice the Green–Lagrange strain: C − I.
    pub strain_twice: Symmetric<R>,
    /// C⁻¹.
    pub inverse_cauchy_green: Symmetric<R>,
    /// J = det F.
    pub volume_ratio: R,
    /// J − 1, without cancellation.
    pub volume_change: R,
    /// q = J^(−2/3).
    pub isochoric_factor: R,
    /// q − 1, without cancellation.
    pub isochoric_change: R,
}

impl<R: Real> Deformation<R> {
    /// From the displacement gradient H = ∂u/∂X. J ≤ 0 is the caller's to report: the measures are then meaningless.
    #[inline(always)]
    pub fn from_displacement_gradient(h: &Tensor<R>) -> Self {
        let mut gradient = *h;
        for i in 0..3 {
            gradient.0[i][i] += R::ONE;
        }
        let strain_twice = Symmetric::green_lagrange_twice(h);
        let x = h.trace() + h.second_invariant() + h.determinant();
        let j = R::ONE + x;
        let cauchy_green = strain_twice + Symmetric::IDENTITY;
        let inverse_cauchy_green = cauchy_green.cofactor() * (R::ONE / (j * j));
        // c = J^(1/3), c − 1 = x/(c² + c + 1), hence q − 1 = (1 − c²)/c² = −x (c + 1)/(c² (c² + c + 1)).
        let c = j.cbrt();
        let c2 = c * c;
        let isochoric_change = -x * (c + R::ONE) / (c2 * (c2 + c + R::ONE));
        Self {
            gradient,
            strain_twice,
            inverse_cauchy_green,
            volume_ratio: j,
            volume_change: x,
            isochoric_factor: R::ONE + isochoric_change,
            isochoric_change,
        }
    }

    /// I₁ of the isochoric C, minus 3, without cancellation in J.
    #[inline(always)]
    pub fn isochoric_first_invariant_minus_3(&self) -> R {
        R::of(3.0) * self.isochoric_change + self.isochoric_factor * self.strain_twice.trace()
    }

    /// S of the isochoric energy ½ (I₁ − 3) (isochoric I₁): q (I − I₁/3 C⁻¹), written as
    /// q (C⁻¹ (C − I) − tr(C − I)/3 C⁻¹).
    #[inline(always)]
    pub fn deviatoric_identity(&self) -> Symmetric<R> {
        let inverse = &self.inverse_cauchy_green;
        let product = inverse.commuting_product(&self.strain_twice);
        (product - *inverse * (self.strain_twice.trace() * R::of(1.0 / 3.0))) * self.isochoric_factor
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_strains_keep_their_digits_in_single_precision() {
        let h = Tensor([[1e-4, 2e-5, 0.0], [0.0, -3e-5, 1e-5], [4e-6, 0.0, 2e-5]]);
        let fine = Deformation::<f64>::from_displacement_gradient(&h);
        let coarse =
            Deformation::<f32>::from_displacement_gradient(&Tensor(h.0.map(|row| row.map(|x| x as f32))));
        let relative = |a: f64, b: f32| ((a - f64::from(b)) / a).abs();
        assert!(relative(fine.volume_change, coarse.volume_change) < 1e-6);
        assert!(relative(fine.isochoric_change, coarse.isochoric_change) < 1e-6);
        let (a, b) = (fine.deviatoric_identity(), coarse.deviatoric_identity());
        for k in 0..6 {
            assert!((a.0[k] - f64::from(b.0[k])).abs() < 1e-6 * 1e-4, "component {k}");
        }
    }

    #[test]
    fn measures_agree_with_their_definitions() {
        let h = Tensor([[0.2, 0.1, -0.05], [0.03, -0.1, 0.2], [-0.15, 0.07, 0.3]]);
        let d = Deformation::<f64>::from_displacement_gradient(&h);
        let j = d.gradient.determinant();
        assert!((d.volume_ratio - j).abs() < 1e-15);
        assert!((d.isochoric_factor - j.powf(-2.0 / 3.0)).abs() < 1e-15);
        let c = (d.strain_twice + Symmetric::IDENTITY).full();
        let product = Tensor(c.0.map(|row| d.inverse_cauchy_green.full().transpose().apply(row)));
        for (i, row) in product.0.iter().enumerate() {
            for (k, entry) in row.iter().enumerate() {
                assert!((entry - f64::from(u8::from(i == k))).abs() < 1e-14);
            }
        }
    }
}
