//! Demiray law (1972), the exponential law of Fung in Ī₁: Ψ = μ/(2b) (e^(b (Ī₁−3)) − 1) + U(J), W₁ = μ/2 e^(b
//! (Ī₁−3)). The exponential of a large strain overflows to infinity, which stops a run with an error.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Deformation, Matrix, ParameterError, SplitLaw, Volumetric, check};
use crate::Number;
use crate::tensor::{Symmetric, Vector};

/// Isotropic solid that stiffens exponentially.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Demiray {
    /// Shear modulus μ at rest [Pa].
    pub shear: f64,
    /// Exponent b.
    pub exponent: f64,
    /// Volumetric energy.
    pub volumetric: Volumetric,
}

/// Parameters of the Demiray law: Ψ = μ/(2b) (e^(b (Ī₁−3)) − 1) + U(J).
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct DemirayParameters {
    /// The moduli at rest.
    #[serde(flatten)]
    pub matrix: Matrix,
    /// Exponent b.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub exponent: f64,
}

impl SplitLaw for Demiray {
    type Parameters = DemirayParameters;

    const WGSL: &'static str = include_str!("demiray.wgsl");

    fn new(parameters: &DemirayParameters) -> Result<Self, ParameterError> {
        let (shear, volumetric) = parameters.matrix.parts()?;
        Ok(Self { shear, exponent: check::positive("exponent", parameters.exponent, "")?, volumetric })
    }

    #[inline(always)]
    fn isochoric_energy<R: Number>(&self, deformation: &Deformation<R>, _fibres: &[Vector<R>]) -> R {
        let x = deformation.isochoric_first_invariant_minus_3();
        R::of(0.5 * self.shear / self.exponent) * (R::of(self.exponent) * x).exp_m1()
    }

    #[inline(always)]
    fn isochoric_stress<R: Number>(
        &self,
        deformation: &Deformation<R>,
        _fibres: &[Vector<R>],
    ) -> Symmetric<R> {
        let x = deformation.isochoric_first_invariant_minus_3();
        deformation.first_invariant_stress(R::of(0.5 * self.shear) * (R::of(self.exponent) * x).exp())
    }

    fn shader_parameters(&self) -> Vec<f64> {
        vec![0.5 * self.shear, self.exponent]
    }

    fn volumetric(&self) -> Volumetric {
        self.volumetric
    }

    fn shear(&self) -> f64 {
        self.shear
    }
}
