//! Split neo-Hookean law (thesis 6.4–6.5 without fibres): Ψ = μ/2 (Ī₁ − 3) + κ/2 (J − 1)².
//! Finite at J → 0, hence weak against inversion.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Deformation, ElasticConstants, Law, ParameterError, SmallStrainModuli, Split};
use crate::Real;
use crate::tensor::{Symmetric, Vector};

/// Neo-Hookean solid with shape and volume separated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NeoHookean {
    /// Shear modulus μ [Pa].
    pub shear: f64,
    /// Bulk modulus κ [Pa].
    pub bulk: f64,
}

/// Parameters of the split neo-Hookean law: Ψ = μ/2 (Ī₁ − 3) + κ/2 (J − 1)².
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct NeoHookeanParameters {
    /// The two moduli.
    #[serde(flatten)]
    pub elastic: ElasticConstants,
}

impl Law for NeoHookean {
    type Parameters = NeoHookeanParameters;

    fn new(parameters: &NeoHookeanParameters) -> Result<Self, ParameterError> {
        let SmallStrainModuli { shear, bulk } = parameters.elastic.moduli()?;
        Ok(Self { shear, bulk })
    }

    #[inline(always)]
    fn energy<R: Real>(&self, deformation: &Deformation<R>, _fibre: Vector<R>) -> Split<R> {
        let x = deformation.volume_change;
        Split {
            isochoric: R::of(0.5 * self.shear) * deformation.isochoric_first_invariant_minus_3(),
            volumetric: R::of(0.5 * self.bulk) * x * x,
        }
    }

    #[inline(always)]
    fn stress<R: Real>(&self, deformation: &Deformation<R>, _fibre: Vector<R>) -> Split<Symmetric<R>> {
        // S_vol = J U'(J) C⁻¹ with U' = κ (J − 1).
        let pressure = R::of(self.bulk) * deformation.volume_change;
        Split {
            isochoric: deformation.deviatoric_identity() * R::of(self.shear),
            volumetric: deformation.inverse_cauchy_green * (deformation.volume_ratio * pressure),
        }
    }

    fn small_strain(&self) -> SmallStrainModuli {
        SmallStrainModuli { shear: self.shear, bulk: self.bulk }
    }
}
