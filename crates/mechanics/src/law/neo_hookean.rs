//! Split neo-Hookean law (thesis 6.4–6.5 without fibres): Ψ = μ/2 (Ī₁ − 3) + U(J).

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Deformation, Matrix, ParameterError, SplitLaw, Volumetric};
use crate::Number;
use crate::tensor::{Symmetric, Vector};

/// Neo-Hookean solid with shape and volume separated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NeoHookean {
    /// Shear modulus μ [Pa].
    pub shear: f64,
    /// Volumetric energy.
    pub volumetric: Volumetric,
}

/// Parameters of the split neo-Hookean law: Ψ = μ/2 (Ī₁ − 3) + U(J).
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct NeoHookeanParameters {
    /// The moduli.
    #[serde(flatten)]
    pub matrix: Matrix,
}

impl SplitLaw for NeoHookean {
    type Parameters = NeoHookeanParameters;

    const WGSL: &'static str = include_str!("neo_hookean.wgsl");

    fn new(parameters: &NeoHookeanParameters) -> Result<Self, ParameterError> {
        let (shear, volumetric) = parameters.matrix.parts()?;
        Ok(Self { shear, volumetric })
    }

    #[inline(always)]
    fn isochoric_energy<R: Number>(&self, deformation: &Deformation<R>, _fibres: &[Vector<R>]) -> R {
        R::of(0.5 * self.shear) * deformation.isochoric_first_invariant_minus_3()
    }

    #[inline(always)]
    fn isochoric_stress<R: Number>(
        &self,
        deformation: &Deformation<R>,
        _fibres: &[Vector<R>],
    ) -> Symmetric<R> {
        deformation.first_invariant_stress(R::of(0.5 * self.shear))
    }

    fn shader_parameters(&self) -> Vec<f64> {
        vec![0.5 * self.shear]
    }

    fn volumetric(&self) -> Volumetric {
        self.volumetric
    }

    fn shear(&self) -> f64 {
        self.shear
    }

    fn keeps_shear_stiffness(&self) -> bool {
        true
    }
}
