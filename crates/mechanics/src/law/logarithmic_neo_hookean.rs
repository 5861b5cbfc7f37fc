//! Neo-Hookean law with ln²: Ψ = μ/2 (I₁ − 3 − 2 ln J) + λ/2 ln² J, S = μ (I − C⁻¹) + λ ln J C⁻¹ (Bonet and
//! Wood). Stiffens without bound at J → 0, but the volumetric term loses convexity beyond J = e.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Deformation, ElasticConstants, Law, NamedLaw, ParameterError, Shader, SmallStrainModuli, Split};
use crate::Number;
use crate::tensor::{Symmetric, Vector};

/// Neo-Hookean solid of many textbooks and codes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LogarithmicNeoHookean {
    /// Shear modulus μ [Pa].
    pub shear: f64,
    /// Lamé's first constant λ [Pa].
    pub lame: f64,
}

/// Parameters of the ln² neo-Hookean law: Ψ = μ/2 (I₁ − 3 − 2 ln J) + λ/2 ln² J, λ = κ − 2μ/3.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(crate) struct LogarithmicNeoHookeanParameters {
    /// The two moduli.
    #[serde(flatten)]
    pub elastic: ElasticConstants,
}

impl NamedLaw for LogarithmicNeoHookean {
    type Parameters = LogarithmicNeoHookeanParameters;

    fn new(parameters: &LogarithmicNeoHookeanParameters) -> Result<Self, ParameterError> {
        let SmallStrainModuli { shear, bulk } = parameters.elastic.compressible_moduli()?;
        Ok(Self { shear, lame: bulk - 2.0 / 3.0 * shear })
    }
}

impl Law for LogarithmicNeoHookean {
    #[inline(always)]
    fn energy<R: Number>(&self, deformation: &Deformation<R>, _fibres: &[Vector<R>]) -> Split<R> {
        let ln_j = deformation.volume_change.ln_1p();
        let shape = deformation.strain_twice.trace() - R::of(2.0) * ln_j;
        Split { isochoric: R::of(0.5 * self.shear) * shape, volumetric: R::of(0.5 * self.lame) * ln_j * ln_j }
    }

    #[inline(always)]
    fn stress<R: Number>(&self, deformation: &Deformation<R>, _fibres: &[Vector<R>]) -> Split<Symmetric<R>> {
        let inverse = deformation.inverse_cauchy_green;
        Split {
            isochoric: deformation.inverse_strain * R::of(self.shear),
            volumetric: inverse * (R::of(self.lame) * deformation.volume_change.ln_1p()),
        }
    }

    fn shader(&self) -> Option<Shader> {
        Some(Shader::new(&[include_str!("logarithmic_neo_hookean.wgsl")], &[self.shear, self.lame]))
    }

    fn small_strain(&self) -> SmallStrainModuli {
        SmallStrainModuli { shear: self.shear, bulk: self.lame + 2.0 / 3.0 * self.shear }
    }
}
