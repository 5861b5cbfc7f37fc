//! Mooney–Rivlin law (Rivlin 1948): Ψ = c₁₀ (Ī₁ − 3) + c₀₁ (Ī₂ − 3) + U(J); μ = 2 (c₁₀ + c₀₁) at rest.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Compressibility, Deformation, ParameterError, SplitLaw, Volumetric, check};
use crate::Number;
use crate::tensor::{Symmetric, Vector};

/// Energy linear in both invariants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MooneyRivlin {
    /// Coefficient c₁₀ of Ī₁ − 3 [Pa].
    pub c10: f64,
    /// Coefficient c₀₁ of Ī₂ − 3 [Pa].
    pub c01: f64,
    /// Volumetric energy.
    pub volumetric: Volumetric,
}

/// Parameters of the Mooney–Rivlin law: Ψ = c₁₀ (Ī₁ − 3) + c₀₁ (Ī₂ − 3) + U(J); μ = 2 (c₁₀ + c₀₁) > 0 at
/// rest.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct MooneyRivlinParameters {
    /// Coefficient c₁₀ of Ī₁ − 3 [Pa].
    pub c10: f64,
    /// Coefficient c₀₁ of Ī₂ − 3 [Pa].
    pub c01: f64,
    /// The resistance to a change of volume.
    #[serde(flatten)]
    pub compressibility: Compressibility,
}

impl SplitLaw for MooneyRivlin {
    type Parameters = MooneyRivlinParameters;

    const WGSL: &'static str = include_str!("mooney_rivlin.wgsl");

    fn new(parameters: &MooneyRivlinParameters) -> Result<Self, ParameterError> {
        let MooneyRivlinParameters { c10, c01, compressibility } = *parameters;
        let shear = check::shear_at_rest("c10", 2.0 * (c10 + c01), "2 (c10 + c01)")?;
        Ok(Self { c10, c01, volumetric: compressibility.volumetric(shear)? })
    }

    #[inline(always)]
    fn isochoric_energy<R: Number>(&self, deformation: &Deformation<R>, _fibres: &[Vector<R>]) -> R {
        let [first, second] = deformation.isochoric_invariants_minus_3();
        R::of(self.c10) * first + R::of(self.c01) * second
    }

    #[inline(always)]
    fn isochoric_stress<R: Number>(
        &self,
        deformation: &Deformation<R>,
        _fibres: &[Vector<R>],
    ) -> Symmetric<R> {
        deformation.isotropic_stress(R::of(self.c10), R::of(self.c01))
    }

    fn shader_parameters(&self) -> Vec<f64> {
        vec![self.c10, self.c01]
    }

    fn volumetric(&self) -> Volumetric {
        self.volumetric
    }

    fn shear(&self) -> f64 {
        2.0 * (self.c10 + self.c01)
    }
}
