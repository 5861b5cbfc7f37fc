//! Yeoh law (Yeoh 1993): Ψ = c₁ (Ī₁ − 3) + c₂ (Ī₁ − 3)² + c₃ (Ī₁ − 3)³ + U(J); μ = 2 c₁ at rest.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Compressibility, Deformation, ParameterError, SplitLaw, Volumetric, check};
use crate::Number;
use crate::tensor::{Symmetric, Vector};

/// Energy cubic in the first invariant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Yeoh {
    /// Coefficients of the powers 1, 2, 3 of Ī₁ − 3 [Pa].
    pub c: [f64; 3],
    /// Volumetric energy.
    pub volumetric: Volumetric,
}

/// Parameters of the Yeoh law: Ψ = c₁ (Ī₁ − 3) + c₂ (Ī₁ − 3)² + c₃ (Ī₁ − 3)³ + U(J); μ = 2 c₁ at rest.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct YeohParameters {
    /// Coefficient c₁ of Ī₁ − 3 [Pa].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub c1: f64,
    /// Coefficient c₂ of (Ī₁ − 3)² [Pa].
    #[serde(default)]
    pub c2: f64,
    /// Coefficient c₃ of (Ī₁ − 3)³ [Pa].
    #[serde(default)]
    pub c3: f64,
    /// The resistance to a change of volume.
    #[serde(flatten)]
    pub compressibility: Compressibility,
}

impl SplitLaw for Yeoh {
    type Parameters = YeohParameters;

    const WGSL: &'static str = include_str!("yeoh.wgsl");

    fn new(parameters: &YeohParameters) -> Result<Self, ParameterError> {
        let YeohParameters { c1, c2, c3, compressibility } = *parameters;
        let c = [check::positive("c1", c1, " Pa")?, check::finite("c2", c2)?, check::finite("c3", c3)?];
        Ok(Self { c, volumetric: compressibility.volumetric(2.0 * c1)? })
    }

    #[inline(always)]
    fn isochoric_energy<R: Number>(&self, deformation: &Deformation<R>, _fibres: &[Vector<R>]) -> R {
        let x = deformation.isochoric_first_invariant_minus_3();
        let [c1, c2, c3] = self.c;
        x * (R::of(c1) + x * (R::of(c2) + x * R::of(c3)))
    }

    #[inline(always)]
    fn isochoric_stress<R: Number>(
        &self,
        deformation: &Deformation<R>,
        _fibres: &[Vector<R>],
    ) -> Symmetric<R> {
        let x = deformation.isochoric_first_invariant_minus_3();
        let [c1, c2, c3] = self.c;
        deformation.first_invariant_stress(R::of(c1) + x * (R::of(2.0 * c2) + x * R::of(3.0 * c3)))
    }

    fn shader_parameters(&self) -> Vec<f64> {
        let [c1, c2, c3] = self.c;
        vec![c1, 2.0 * c2, 3.0 * c3]
    }

    fn volumetric(&self) -> Volumetric {
        self.volumetric
    }

    fn shear(&self) -> f64 {
        2.0 * self.c[0]
    }
}
