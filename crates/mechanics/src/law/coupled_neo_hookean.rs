//! Coupled neo-Hookean law (thesis 5.9): Ψ = μ/2 (I₁ − 3 − 2 ln J) + λ/2 (J − 1)². Equal to the split law to
//! first order only (λ = κ − 2μ/3): name the law with every number.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Deformation, ElasticConstants, Law, NamedLaw, ParameterError, Shader, SmallStrainModuli, Split};
use crate::Number;
use crate::tensor::{Symmetric, Vector};

/// Neo-Hookean solid whose shear term changes volume too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoupledNeoHookean {
    /// Shear modulus μ [Pa].
    pub shear: f64,
    /// Lamé's first constant λ [Pa].
    pub lame: f64,
}

/// Parameters of the coupled neo-Hookean law: Ψ = μ/2 (I₁ − 3 − 2 ln J) + λ/2 (J − 1)², λ = κ − 2μ/3.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(crate) struct CoupledNeoHookeanParameters {
    /// The two moduli.
    #[serde(flatten)]
    pub elastic: ElasticConstants,
}

impl NamedLaw for CoupledNeoHookean {
    type Parameters = CoupledNeoHookeanParameters;

    fn new(parameters: &CoupledNeoHookeanParameters) -> Result<Self, ParameterError> {
        let SmallStrainModuli { shear, bulk } = parameters.elastic.compressible_moduli()?;
        Ok(Self { shear, lame: bulk - 2.0 / 3.0 * shear })
    }
}

impl Law for CoupledNeoHookean {
    #[inline(always)]
    fn energy<R: Number>(&self, deformation: &Deformation<R>, _fibres: &[Vector<R>]) -> Split<R> {
        let x = deformation.volume_change;
        let shape = deformation.strain_twice.trace() - R::of(2.0) * x.ln_1p();
        Split { isochoric: R::of(0.5 * self.shear) * shape, volumetric: R::of(0.5 * self.lame) * x * x }
    }

    #[inline(always)]
    fn stress<R: Number>(&self, deformation: &Deformation<R>, _fibres: &[Vector<R>]) -> Split<Symmetric<R>> {
        let inverse = deformation.inverse_cauchy_green;
        let pressure = R::of(self.lame) * deformation.volume_change;
        Split {
            isochoric: deformation.inverse_strain * R::of(self.shear),
            volumetric: inverse * (deformation.volume_ratio * pressure),
        }
    }

    fn shader(&self) -> Option<Shader> {
        Some(Shader::new(&[include_str!("coupled_neo_hookean.wgsl")], &[self.shear, self.lame]))
    }

    fn small_strain(&self) -> SmallStrainModuli {
        SmallStrainModuli { shear: self.shear, bulk: self.lame + 2.0 / 3.0 * self.shear }
    }
}
