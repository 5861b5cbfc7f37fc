//! Veronda–Westmann law (1970, skin): Ψ = c₁ (e^(c₂ (Ī₁−3)) − 1) − c₁c₂/2 (Ī₂ − 3) + U(J); μ = c₁ c₂ at rest.
//! The exponential of a large strain overflows to infinity, which stops a run with an error.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Compressibility, Deformation, ParameterError, SplitLaw, Volumetric, check};
use crate::Number;
use crate::tensor::{Symmetric, Vector};

/// Exponential in the first invariant, linear in the second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VerondaWestmann {
    /// Coefficient c₁ [Pa].
    pub c1: f64,
    /// Exponent c₂.
    pub c2: f64,
    /// Volumetric energy.
    pub volumetric: Volumetric,
}

/// Parameters of the Veronda–Westmann law: Ψ = c₁ (e^(c₂ (Ī₁−3)) − 1) − c₁c₂/2 (Ī₂ − 3) + U(J); μ = c₁ c₂ at
/// rest.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct VerondaWestmannParameters {
    /// Coefficient c₁ [Pa].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub c1: f64,
    /// Exponent c₂.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub c2: f64,
    /// The resistance to a change of volume.
    #[serde(flatten)]
    pub compressibility: Compressibility,
}

impl SplitLaw for VerondaWestmann {
    type Parameters = VerondaWestmannParameters;

    const WGSL: &'static str = include_str!("veronda_westmann.wgsl");

    fn new(parameters: &VerondaWestmannParameters) -> Result<Self, ParameterError> {
        let c1 = check::positive("c1", parameters.c1, " Pa")?;
        let c2 = check::positive("c2", parameters.c2, "")?;
        Ok(Self { c1, c2, volumetric: parameters.compressibility.volumetric(c1 * c2)? })
    }

    #[inline(always)]
    fn isochoric_energy<R: Number>(&self, deformation: &Deformation<R>, _fibres: &[Vector<R>]) -> R {
        let [first, second] = deformation.isochoric_invariants_minus_3();
        R::of(self.c1) * (R::of(self.c2) * first).exp_m1() - R::of(0.5 * self.c1 * self.c2) * second
    }

    #[inline(always)]
    fn isochoric_stress<R: Number>(
        &self,
        deformation: &Deformation<R>,
        _fibres: &[Vector<R>],
    ) -> Symmetric<R> {
        let x = deformation.isochoric_first_invariant_minus_3();
        let w1 = R::of(self.c1 * self.c2) * (R::of(self.c2) * x).exp();
        deformation.isotropic_stress(w1, R::of(-0.5 * self.c1 * self.c2))
    }

    fn shader_parameters(&self) -> Vec<f64> {
        vec![self.c1 * self.c2, self.c2]
    }

    fn volumetric(&self) -> Volumetric {
        self.volumetric
    }

    fn shear(&self) -> f64 {
        self.c1 * self.c2
    }
}
