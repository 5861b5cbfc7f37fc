//! Gent law (Gent 1996): Ψ = −μ Jₘ/2 ln(1 − (Ī₁ − 3)/Jₘ) + U(J), W₁ = μ/2 · Jₘ/(Jₘ − (Ī₁ − 3)). The tissue
//! locks at Ī₁ − 3 = Jₘ. There and beyond, energy and stress are infinite or not a number, never a finite
//! number of the wrong sign. A run that gets there stops with an error.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Deformation, Matrix, ParameterError, SplitLaw, Volumetric, check};
use crate::Number;
use crate::tensor::{Symmetric, Vector};

/// Neo-Hookean solid that locks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gent {
    /// Shear modulus μ at rest [Pa].
    pub shear: f64,
    /// Limit Jₘ of Ī₁ − 3.
    pub limit: f64,
    /// Volumetric energy.
    pub volumetric: Volumetric,
}

/// Parameters of the Gent law: Ψ = −μ Jₘ/2 ln(1 − (Ī₁ − 3)/Jₘ) + U(J).
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct GentParameters {
    /// The moduli at rest.
    #[serde(flatten)]
    pub matrix: Matrix,
    /// Limit Jₘ of Ī₁ − 3, where the tissue locks; under uniaxial stretch λ: λ² + 2/λ − 3.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub limit: f64,
}

impl SplitLaw for Gent {
    type Parameters = GentParameters;

    const WGSL: &'static str = include_str!("gent.wgsl");

    fn new(parameters: &GentParameters) -> Result<Self, ParameterError> {
        let (shear, volumetric) = parameters.matrix.parts()?;
        Ok(Self { shear, limit: check::positive("limit", parameters.limit, "")?, volumetric })
    }

    #[inline(always)]
    fn isochoric_energy<R: Number>(&self, deformation: &Deformation<R>, _fibres: &[Vector<R>]) -> R {
        let used = deformation.isochoric_first_invariant_minus_3() * R::of(1.0 / self.limit);
        R::of(-0.5 * self.shear * self.limit) * (-used).max(-R::ONE).ln_1p()
    }

    #[inline(always)]
    fn isochoric_stress<R: Number>(
        &self,
        deformation: &Deformation<R>,
        _fibres: &[Vector<R>],
    ) -> Symmetric<R> {
        let used = deformation.isochoric_first_invariant_minus_3() * R::of(1.0 / self.limit);
        deformation.first_invariant_stress(R::of(0.5 * self.shear) / (R::ONE - used).max(R::ZERO))
    }

    fn shader_parameters(&self) -> Vec<f64> {
        vec![0.5 * self.shear, 1.0 / self.limit]
    }

    fn volumetric(&self) -> Volumetric {
        self.volumetric
    }

    fn shear(&self) -> f64 {
        self.shear
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tensor::Tensor;

    #[test]
    fn beyond_the_limit_nothing_is_finite() {
        let law = Gent { shear: 1.0, limit: 0.5, volumetric: Volumetric::quadratic(10.0) };
        let sheared = |g: f64| {
            let h = Tensor([[0.0, g, 0.0], [0.0; 3], [0.0; 3]]);
            let deformation = Deformation::from_displacement_gradient(&h);
            let energy: f64 = law.isochoric_energy(&deformation, &[]);
            (energy, law.isochoric_stress(&deformation, &[]))
        };
        // Ī₁ − 3 = g² in simple shear.
        let (energy, stress) = sheared(0.7);
        assert!(energy.is_finite() && stress.0.iter().all(|s| s.is_finite()));
        for g in [0.5_f64.sqrt() + 1e-12, 0.8, 3.0] {
            let (energy, stress) = sheared(g);
            assert_eq!(energy, f64::INFINITY);
            assert!(stress.0.iter().any(|s| !s.is_finite()));
        }
    }
}
