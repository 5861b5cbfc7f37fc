//! St Venant–Kirchhoff law: Ψ = λ/2 (tr E)² + μ E:E, S = λ tr(E) I + 2μ E. Linear in the Green–Lagrange
//! strain, for small strains under large rotations only. It softens under compression and collapses: in
//! uniaxial strain the force falls from the stretch 1/√3 = 0.577 on. Its energy stays finite at J → 0.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Deformation, ElasticConstants, Law, NamedLaw, ParameterError, Shader, SmallStrainModuli, Split};
use crate::Number;
use crate::tensor::{Symmetric, Vector};

/// Hooke's law in the Green–Lagrange strain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StVenantKirchhoff {
    /// Shear modulus μ [Pa].
    pub shear: f64,
    /// Lamé's first constant λ [Pa].
    pub lame: f64,
}

/// Parameters of the St Venant–Kirchhoff law: Ψ = λ/2 (tr E)² + μ E:E, λ = κ − 2μ/3. Collapses under
/// compression.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(crate) struct StVenantKirchhoffParameters {
    /// The two moduli.
    #[serde(flatten)]
    pub elastic: ElasticConstants,
}

impl NamedLaw for StVenantKirchhoff {
    type Parameters = StVenantKirchhoffParameters;

    fn new(parameters: &StVenantKirchhoffParameters) -> Result<Self, ParameterError> {
        let SmallStrainModuli { shear, bulk } = parameters.elastic.compressible_moduli()?;
        Ok(Self { shear, lame: bulk - 2.0 / 3.0 * shear })
    }
}

impl Law for StVenantKirchhoff {
    // tr E is no function of J.
    const VOLUMETRIC_ENERGY: bool = false;

    #[inline(always)]
    fn energy<R: Number>(&self, deformation: &Deformation<R>, _fibres: &[Vector<R>]) -> Split<R> {
        let strain = deformation.strain_twice * R::of(0.5);
        let trace = strain.trace();
        Split {
            isochoric: R::of(self.shear) * strain.commuting_product(&strain).trace(),
            volumetric: R::of(0.5 * self.lame) * trace * trace,
        }
    }

    #[inline(always)]
    fn stress<R: Number>(&self, deformation: &Deformation<R>, _fibres: &[Vector<R>]) -> Split<Symmetric<R>> {
        let strain_twice = deformation.strain_twice;
        Split {
            isochoric: strain_twice * R::of(self.shear),
            volumetric: Symmetric::IDENTITY * (R::of(0.5 * self.lame) * strain_twice.trace()),
        }
    }

    fn shader(&self) -> Option<Shader> {
        Some(Shader::new(&[include_str!("st_venant_kirchhoff.wgsl")], &[self.shear, 0.5 * self.lame]))
    }

    fn small_strain(&self) -> SmallStrainModuli {
        SmallStrainModuli { shear: self.shear, bulk: self.lame + 2.0 / 3.0 * self.shear }
    }
}
