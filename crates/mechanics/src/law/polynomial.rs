//! Polynomial law of order 2 (Rivlin and Saunders 1951): Ψ = Σ cᵢⱼ (Ī₁ − 3)ⁱ (Ī₂ − 3)ʲ + U(J), 1 ≤ i + j ≤ 2;
//! μ = 2 (c₁₀ + c₀₁) at rest. Fitted coefficients may bend the energy down outside the range of the fit.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Compressibility, Deformation, ParameterError, SplitLaw, Volumetric, check};
use crate::Number;
use crate::tensor::{Symmetric, Vector};

/// Energy quadratic in both invariants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Polynomial {
    /// Coefficients c₁₀ and c₀₁ of the invariants [Pa].
    pub linear: [f64; 2],
    /// Coefficients c₂₀, c₁₁ and c₀₂ of their products [Pa].
    pub quadratic: [f64; 3],
    /// Volumetric energy.
    pub volumetric: Volumetric,
}

/// Parameters of the polynomial law: Ψ = Σ cᵢⱼ (Ī₁ − 3)ⁱ (Ī₂ − 3)ʲ + U(J), 1 ≤ i + j ≤ 2; μ = 2 (c₁₀ + c₀₁) >
/// 0 at rest.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct PolynomialParameters {
    /// Coefficient c₁₀ of Ī₁ − 3 [Pa].
    pub c10: f64,
    /// Coefficient c₀₁ of Ī₂ − 3 [Pa].
    pub c01: f64,
    /// Coefficient c₂₀ of (Ī₁ − 3)² [Pa].
    #[serde(default)]
    pub c20: f64,
    /// Coefficient c₁₁ of (Ī₁ − 3)(Ī₂ − 3) [Pa].
    #[serde(default)]
    pub c11: f64,
    /// Coefficient c₀₂ of (Ī₂ − 3)² [Pa].
    #[serde(default)]
    pub c02: f64,
    /// The resistance to a change of volume.
    #[serde(flatten)]
    pub compressibility: Compressibility,
}

impl SplitLaw for Polynomial {
    type Parameters = PolynomialParameters;

    const WGSL: &'static str = include_str!("polynomial.wgsl");

    fn new(parameters: &PolynomialParameters) -> Result<Self, ParameterError> {
        let PolynomialParameters { c10, c01, c20, c11, c02, compressibility } = *parameters;
        let shear = check::shear_at_rest("c10", 2.0 * (c10 + c01), "2 (c10 + c01)")?;
        let quadratic = [check::finite("c20", c20)?, check::finite("c11", c11)?, check::finite("c02", c02)?];
        Ok(Self { linear: [c10, c01], quadratic, volumetric: compressibility.volumetric(shear)? })
    }

    #[inline(always)]
    fn isochoric_energy<R: Number>(&self, deformation: &Deformation<R>, _fibres: &[Vector<R>]) -> R {
        let [first, second] = deformation.isochoric_invariants_minus_3();
        let ([c10, c01], [c20, c11, c02]) = (self.linear, self.quadratic);
        first * (R::of(c10) + R::of(c20) * first + R::of(c11) * second)
            + second * (R::of(c01) + R::of(c02) * second)
    }

    #[inline(always)]
    fn isochoric_stress<R: Number>(
        &self,
        deformation: &Deformation<R>,
        _fibres: &[Vector<R>],
    ) -> Symmetric<R> {
        let [first, second] = deformation.isochoric_invariants_minus_3();
        let ([c10, c01], [c20, c11, c02]) = (self.linear, self.quadratic);
        let w1 = R::of(c10) + R::of(2.0 * c20) * first + R::of(c11) * second;
        let w2 = R::of(c01) + R::of(c11) * first + R::of(2.0 * c02) * second;
        deformation.isotropic_stress(w1, w2)
    }

    fn shader_parameters(&self) -> Vec<f64> {
        let ([c10, c01], [c20, c11, c02]) = (self.linear, self.quadratic);
        vec![c10, c01, 2.0 * c20, c11, 2.0 * c02]
    }

    fn volumetric(&self) -> Volumetric {
        self.volumetric
    }

    fn shear(&self) -> f64 {
        2.0 * (self.linear[0] + self.linear[1])
    }
}
