//! Transversely isotropic law (thesis 6.4–6.5): Ψ = μ/2 (Ī₁ − 3) + η/2 (Ī₄ − 1)² + κ/2 (J − 1)².
//! Fibres resist compression as well as tension. The thesis's stress (6.6) misses a factor 2 against its own energy;
//! parameters published with it are half as stiff and are read with `convention = "taylor"`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::neo_hookean::NeoHookean;
use super::{Deformation, ElasticConstants, Law, ParameterError, SmallStrainModuli, Split};
use crate::Real;
use crate::tensor::{Symmetric, Vector};

/// Neo-Hookean matrix with one family of fibres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransverselyIsotropic {
    /// The matrix.
    pub matrix: NeoHookean,
    /// Fibre modulus η of the energy η/2 (Ī₄ − 1)² [Pa].
    pub fibre: f64,
}

/// Which formula a published fibre modulus belongs to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FibreConvention {
    /// The modulus of the energy η/2 (Ī₄ − 1)²; stress and energy agree.
    #[default]
    Energy,
    /// The modulus of Taylor 2009, NiftySim and SOFA, whose stress corresponds to η/4 (Ī₄ − 1)².
    Taylor,
}

/// Parameters of the transversely isotropic law: Ψ = μ/2 (Ī₁ − 3) + η/2 (Ī₄ − 1)² + κ/2 (J − 1)².
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct TransverselyIsotropicParameters {
    /// The two moduli of the matrix.
    #[serde(flatten)]
    pub elastic: ElasticConstants,
    /// Fibre modulus η [Pa].
    #[schemars(range(min = 0.0))]
    pub fibre_modulus: f64,
    /// `energy`: η belongs to the energy above. `taylor`: η as published with Taylor 2009, NiftySim or SOFA (half).
    #[serde(default)]
    pub convention: FibreConvention,
}

impl TransverselyIsotropic {
    /// Ī₄ − 1 of the unit fibre `a`, without cancellation.
    #[inline(always)]
    fn fibre_strain<R: Real>(deformation: &Deformation<R>, a: Vector<R>) -> R {
        deformation.isochoric_change + deformation.isochoric_factor * deformation.strain_twice.quadratic(a)
    }
}

impl Law for TransverselyIsotropic {
    type Parameters = TransverselyIsotropicParameters;
    const FIBRE: bool = true;

    fn new(parameters: &TransverselyIsotropicParameters) -> Result<Self, ParameterError> {
        let SmallStrainModuli { shear, bulk } = parameters.elastic.moduli()?;
        let given = parameters.fibre_modulus;
        if !(given >= 0.0 && given.is_finite()) {
            return Err(ParameterError {
                key: "fibre-modulus",
                message: format!("`fibre-modulus` must be 0 Pa or more, found {given}"),
                help: "0 makes the law isotropic".into(),
            });
        }
        let fibre = match parameters.convention {
            FibreConvention::Energy => given,
            FibreConvention::Taylor => 0.5 * given,
        };
        Ok(Self { matrix: NeoHookean { shear, bulk }, fibre })
    }

    #[inline(always)]
    fn energy<R: Real>(&self, deformation: &Deformation<R>, fibre: Vector<R>) -> Split<R> {
        let strain = Self::fibre_strain(deformation, fibre);
        let mut energy = self.matrix.energy(deformation, fibre);
        energy.isochoric += R::of(0.5 * self.fibre) * strain * strain;
        energy
    }

    #[inline(always)]
    fn stress<R: Real>(&self, deformation: &Deformation<R>, fibre: Vector<R>) -> Split<Symmetric<R>> {
        // 2 η q (Ī₄ − 1) (a₀⊗a₀ − I₄/3 C⁻¹)
        let squared_stretch = R::ONE + deformation.strain_twice.quadratic(fibre);
        let direction =
            Symmetric::dyad(fibre) - deformation.inverse_cauchy_green * (squared_stretch * R::of(1.0 / 3.0));
        let factor =
            R::of(2.0 * self.fibre) * deformation.isochoric_factor * Self::fibre_strain(deformation, fibre);
        let mut stress = self.matrix.stress(deformation, fibre);
        stress.isochoric = stress.isochoric + direction * factor;
        stress
    }

    fn small_strain(&self) -> SmallStrainModuli {
        self.matrix.small_strain()
    }

    fn longitudinal_modulus(&self) -> f64 {
        self.matrix.longitudinal_modulus() + 4.0 * self.fibre
    }
}
