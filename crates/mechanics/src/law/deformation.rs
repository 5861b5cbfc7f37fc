//! Measures of a deformation for the laws. They are computed from the displacement gradient H = F − I, so
//! that small strains keep their digits in single precision. J − 1 = tr H + II(H) + det H, C − I = H + Hᵀ +
//! Hᵀ H.
//!
//! A bar marks an isochoric measure: C̄ = q C, q = J^(−2/3); Ī₁ = tr C̄, Ī₂ = ½ (Ī₁² − tr C̄²), Ī₄ = a·C̄a,
//! Ī₅ = a·C̄²a. Let an energy Ψ(Ī₁, Ī₂, Ī₄, Ī₅) have the derivatives Wₖ = ∂Ψ/∂Īₖ. Its stress is S = q (Φ − ⅓
//! (Φ:C) C⁻¹). Here Φ = 2 (W₁ + Ī₁ W₂) I − 2 W₂ C̄ + 2 W₄ a⊗a + 2 W₅ (a⊗C̄a + C̄a⊗a). The stress is computed
//! from terms that vanish at rest: the isotropic part is C⁻¹ dev M with M a polynomial of X = C − I. By E =
//! I − C⁻¹, C⁻¹ X = E and C⁻¹ X² = X − E, so that no tensors are multiplied. E itself is ((J² − 1 − tr X) I +
//! X − cof X)/J², as cof C = (1 + tr X) I − X + cof X.

use crate::Number;
use crate::tensor::{Symmetric, Tensor, Vector, dot};

/// A deformation at one point and its measures.
#[derive(Clone, Copy, Debug)]
pub struct Deformation<R> {
    /// Deformation gradient F.
    pub gradient: Tensor<R>,
    /// Twice the Green–Lagrange strain: C − I.
    pub strain_twice: Symmetric<R>,
    /// I − C⁻¹, without cancellation.
    pub inverse_strain: Symmetric<R>,
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

impl<R: Number> Deformation<R> {
    /// Computes the measures from the displacement gradient H = ∂u/∂X. The caller must report J ≤ 0: the
    /// measures are then meaningless.
    #[inline(always)]
    pub fn from_displacement_gradient(h: &Tensor<R>) -> Self {
        let mut gradient = *h;
        for i in 0..3 {
            gradient.0[i][i] += R::ONE;
        }
        let strain_twice = Symmetric::green_lagrange_twice(h);
        let x = h.trace() + h.second_invariant() + h.determinant();
        let j = R::ONE + x;
        // y = J^(−1/3), and 1/J from its cube, once corrected.
        let y = j.inverse_cbrt();
        let cube = y * y * y;
        let inverse = cube * (-j).mul_add(cube, R::of(2.0));
        // J² − 1 = x (2 + x).
        let isotropic = x.mul_add(x, x + x) - strain_twice.trace();
        let shape = (strain_twice - strain_twice.cofactor()).plus_isotropic(isotropic);
        let inverse_strain = shape * (inverse * inverse);
        // y³ − 1 = −x y³, hence q − 1 = (y − 1)(y + 1) = −x y³ (y + 1)/(y² + y + 1).
        let isochoric_change = -x * inverse * (y + R::ONE) / (y * y + y + R::ONE);
        Self {
            gradient,
            strain_twice,
            inverse_strain,
            inverse_cauchy_green: (-inverse_strain).plus_isotropic(R::ONE),
            volume_ratio: j,
            volume_change: x,
            isochoric_factor: y * y,
            isochoric_change,
        }
    }

    /// I₁ of the isochoric C, minus 3, without cancellation in J.
    #[inline(always)]
    pub(crate) fn isochoric_first_invariant_minus_3(&self) -> R {
        R::of(3.0) * self.isochoric_change + self.isochoric_factor * self.strain_twice.trace()
    }

    /// C̄ − I.
    #[inline(always)]
    pub(crate) fn isochoric_strain_twice(&self) -> Symmetric<R> {
        (self.strain_twice * self.isochoric_factor).plus_isotropic(self.isochoric_change)
    }

    /// Ī₁ − 3 and Ī₂ − 3. With B = C̄ − I and t = tr B = Ī₁ − 3: Ī₂ − 3 = 2t + ½ (t² − B:B).
    #[inline(always)]
    pub(crate) fn isochoric_invariants_minus_3(&self) -> [R; 2] {
        let t = self.isochoric_first_invariant_minus_3();
        let b = self.isochoric_strain_twice();
        [t, R::of(2.0) * t + R::of(0.5) * (t * t - b.double_dot(&b))]
    }

    /// Ī₄ − 1 of the unit fibre `a`.
    #[inline(always)]
    pub(crate) fn fibre_strain(&self, a: Vector<R>) -> R {
        self.isochoric_change + self.isochoric_factor * self.strain_twice.quadratic(a)
    }

    /// Ī₄ − 1 and Ī₅ − 1 of the unit fibre `a`. With B = C̄ − I: Ī₅ − 1 = 2 a·Ba + |Ba|².
    #[inline(always)]
    pub(crate) fn fibre_strains(&self, a: Vector<R>) -> [R; 2] {
        let ba = self.isochoric_strain_twice().apply(a);
        let strain = dot(a, ba);
        [strain, R::of(2.0) * strain + dot(ba, ba)]
    }

    /// S of an energy of Ī₁: 2 W₁ q (E − ⅓ tr X C⁻¹).
    #[inline(always)]
    pub(crate) fn first_invariant_stress(&self, w1: R) -> Symmetric<R> {
        let factor = R::of(2.0) * w1 * self.isochoric_factor;
        let mean = factor * self.strain_twice.trace() * R::of(1.0 / 3.0);
        (self.inverse_strain * (factor + mean)).plus_isotropic(-mean)
    }

    /// S of an energy of Ī₁ and Ī₄ of the unit fibre `a`, the multiples of C⁻¹ taken together.
    #[inline(always)]
    pub(crate) fn fibre_reinforced_stress(&self, w1: R, a: Vector<R>, w4: R) -> Symmetric<R> {
        let factor = R::of(2.0) * self.isochoric_factor;
        let (matrix, fibre) = (factor * w1, factor * w4);
        let i4 = R::ONE + self.strain_twice.quadratic(a);
        let mean = (matrix * self.strain_twice.trace() + fibre * i4) * R::of(1.0 / 3.0);
        let shape = (self.inverse_strain * (matrix + mean)).plus_isotropic(-mean);
        shape.plus_scaled(&Symmetric::dyad(a), fibre)
    }

    /// S of an energy of Ī₁ and Ī₂: with C² − I = 2X + X², M = 2 (W₁ + Ī₁ W₂) q X − 2 W₂ q² (2X + X²).
    #[inline(always)]
    pub(crate) fn isotropic_stress(&self, w1: R, w2: R) -> Symmetric<R> {
        let (q, x) = (self.isochoric_factor, &self.strain_twice);
        let i1 = R::of(3.0) + self.isochoric_first_invariant_minus_3();
        let factor = R::of(2.0) * q;
        let (linear, square) = (factor * (w1 + (i1 - factor) * w2), factor * q * w2);
        let mean = (linear * x.trace() - square * x.double_dot(x)) * R::of(1.0 / 3.0);
        let shape = (self.inverse_strain * (linear + square + mean)).plus_scaled(x, -square);
        shape.plus_isotropic(-mean)
    }

    /// S of an energy of Ī₄ of the unit fibre `a`: 2 W₄ q (a⊗a − I₄/3 C⁻¹).
    #[inline(always)]
    pub(crate) fn fibre_stress(&self, a: Vector<R>, w4: R) -> Symmetric<R> {
        let i4 = R::ONE + self.strain_twice.quadratic(a);
        let direction = Symmetric::dyad(a).plus_scaled(&self.inverse_cauchy_green, i4 * R::of(-1.0 / 3.0));
        direction * (R::of(2.0) * w4 * self.isochoric_factor)
    }

    /// Stress S of an energy of Ī₄ and Ī₅ of the unit fibre `a`: the stress of Ī₄ and 2 W₅ q² (a⊗Ca + Ca⊗a −
    /// ⅔ |Ca|² C⁻¹).
    #[inline(always)]
    pub(crate) fn fibre_stresses(&self, a: Vector<R>, [w4, w5]: [R; 2]) -> Symmetric<R> {
        let (q, x) = (self.isochoric_factor, self.strain_twice.apply(a));
        let ca = [a[0] + x[0], a[1] + x[1], a[2] + x[2]];
        let pull = self.inverse_cauchy_green * (dot(ca, ca) * R::of(2.0 / 3.0));
        self.fibre_stress(a, w4) + (twice_symmetrised(a, ca) - pull) * (R::of(2.0) * w5 * q * q)
    }
}

/// a⊗b + b⊗a.
#[inline(always)]
fn twice_symmetrised<R: Number>(a: Vector<R>, b: Vector<R>) -> Symmetric<R> {
    let two = R::of(2.0);
    Symmetric([
        two * a[0] * b[0],
        two * a[1] * b[1],
        two * a[2] * b[2],
        a[0] * b[1] + a[1] * b[0],
        a[1] * b[2] + a[2] * b[1],
        a[0] * b[2] + a[2] * b[0],
    ])
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
        for k in 0..6 {
            let (fine, coarse) = (fine.inverse_strain.0[k], f64::from(coarse.inverse_strain.0[k]));
            assert!((fine - coarse).abs() < 1e-6 * 1e-4, "component {k} of I − C⁻¹");
        }
        let unit = [0.6, 0.0, 0.8];
        let stresses = [
            (fine.first_invariant_stress(0.5), coarse.first_invariant_stress(0.5)),
            (fine.isotropic_stress(0.2, 0.3), coarse.isotropic_stress(0.2, 0.3)),
            (
                fine.fibre_reinforced_stress(0.5, unit, fine.fibre_strain(unit)),
                coarse.fibre_reinforced_stress(
                    0.5,
                    unit.map(|x| x as f32),
                    coarse.fibre_strain(unit.map(|x| x as f32)),
                ),
            ),
            (
                fine.fibre_stresses(unit, fine.fibre_strains(unit)),
                coarse.fibre_stresses(unit.map(|x| x as f32), coarse.fibre_strains(unit.map(|x| x as f32))),
            ),
        ];
        for (a, b) in stresses {
            for k in 0..6 {
                assert!((a.0[k] - f64::from(b.0[k])).abs() < 1e-6 * 1e-4, "component {k}");
            }
        }
    }

    #[test]
    fn measures_agree_with_their_definitions() {
        let h = Tensor([[0.2, 0.1, -0.05], [0.03, -0.1, 0.2], [-0.15, 0.07, 0.3]]);
        let d = Deformation::<f64>::from_displacement_gradient(&h);
        let j = d.gradient.determinant();
        assert!((d.volume_ratio - j).abs() < 1e-15);
        assert!((d.isochoric_factor - j.powf(-2.0 / 3.0)).abs() < 1e-15);
        let difference = d.inverse_strain + d.inverse_cauchy_green - Symmetric::IDENTITY;
        assert!(difference.0.iter().all(|entry| entry.abs() < 1e-15));
        let c = (d.strain_twice + Symmetric::IDENTITY).full();
        let product = Tensor(c.0.map(|row| d.inverse_cauchy_green.full().transpose().apply(row)));
        for (i, row) in product.0.iter().enumerate() {
            for (k, entry) in row.iter().enumerate() {
                assert!((entry - f64::from(u8::from(i == k))).abs() < 1e-14);
            }
        }
        let a = [0.6, 0.0, 0.8];
        let apart = d.first_invariant_stress(0.7) + d.fibre_stress(a, 0.3);
        let together = d.fibre_reinforced_stress(0.7, a, 0.3);
        assert!((apart - together).0.iter().all(|entry| entry.abs() < 1e-15));
        let bar = c.0.map(|row| row.map(|x| x * d.isochoric_factor));
        let squared =
            [0, 1, 2].map(|i| [0, 1, 2].map(|k| (0..3).map(|l| bar[i][l] * bar[l][k]).sum::<f64>()));
        let trace = |t: &[[f64; 3]; 3]| t[0][0] + t[1][1] + t[2][2];
        let i1 = trace(&bar);
        let [first, second] = d.isochoric_invariants_minus_3();
        assert!((first - (i1 - 3.0)).abs() < 1e-14);
        assert!((second - (0.5 * (i1 * i1 - trace(&squared)) - 3.0)).abs() < 1e-14);
        let along = |t: [[f64; 3]; 3]| dot(a, Tensor(t).apply(a)) - 1.0;
        let [fourth, fifth] = d.fibre_strains(a);
        assert!((fourth - along(bar)).abs() < 1e-14 && (fourth - d.fibre_strain(a)).abs() < 1e-14);
        assert!((fifth - along(squared)).abs() < 1e-14);
    }
}
