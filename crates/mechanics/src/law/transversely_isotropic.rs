//! Transversely isotropic law (thesis 6.4–6.5): Ψ = μ/2 (Ī₁ − 3) + η/2 (Ī₄ − 1)² + U(J). Fibres resist
//! compression as well as tension. The thesis's stress (6.6) misses a factor 2 against its own energy;
//! parameters published with it are half as stiff and are read with `convention = "taylor"`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::split::fibre_stiffness;
use super::{Deformation, Matrix, ParameterError, SplitLaw, Volumetric, check};
use crate::Number;
use crate::tensor::{Symmetric, Vector};

/// Neo-Hookean matrix with one family of fibres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransverselyIsotropic {
    /// Shear modulus μ of the matrix [Pa].
    pub shear: f64,
    /// Fibre modulus η of the energy η/2 (Ī₄ − 1)² [Pa].
    pub fibre: f64,
    /// Volumetric energy.
    pub volumetric: Volumetric,
}

/// Formula to which a published fibre modulus belongs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FibreConvention {
    /// The modulus of the energy η/2 (Ī₄ − 1)²; stress and energy agree.
    #[default]
    Energy,
    /// The modulus of Taylor 2009, NiftySim and SOFA, whose stress corresponds to η/4 (Ī₄ − 1)².
    Taylor,
}

/// Parameters of the transversely isotropic law: Ψ = μ/2 (Ī₁ − 3) + η/2 (Ī₄ − 1)² + U(J).
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct TransverselyIsotropicParameters {
    /// The moduli of the matrix.
    #[serde(flatten)]
    pub matrix: Matrix,
    /// Fibre modulus η [Pa].
    #[schemars(range(min = 0.0))]
    pub fibre_modulus: f64,
    /// `energy`: η belongs to the energy above. `taylor`: η as published with Taylor 2009, NiftySim or SOFA
    /// (half).
    #[serde(default)]
    pub convention: FibreConvention,
}

impl SplitLaw for TransverselyIsotropic {
    type Parameters = TransverselyIsotropicParameters;

    const WGSL: &'static str = include_str!("transversely_isotropic.wgsl");

    fn new(parameters: &TransverselyIsotropicParameters) -> Result<Self, ParameterError> {
        let (shear, volumetric) = parameters.matrix.parts()?;
        let given =
            check::not_negative("fibre-modulus", parameters.fibre_modulus, "0 makes the law isotropic")?;
        let fibre = match parameters.convention {
            FibreConvention::Energy => given,
            FibreConvention::Taylor => 0.5 * given,
        };
        Ok(Self { shear, fibre, volumetric })
    }

    #[inline(always)]
    fn isochoric_energy<R: Number>(&self, deformation: &Deformation<R>, fibres: &[Vector<R>]) -> R {
        let strain = deformation.fibre_strain(fibres[0]);
        R::of(0.5 * self.shear) * deformation.isochoric_first_invariant_minus_3()
            + R::of(0.5 * self.fibre) * strain * strain
    }

    #[inline(always)]
    fn isochoric_stress<R: Number>(
        &self,
        deformation: &Deformation<R>,
        fibres: &[Vector<R>],
    ) -> Symmetric<R> {
        let w4 = R::of(self.fibre) * deformation.fibre_strain(fibres[0]);
        deformation.fibre_reinforced_stress(R::of(0.5 * self.shear), fibres[0], w4)
    }

    fn shader_parameters(&self) -> Vec<f64> {
        vec![0.5 * self.shear, self.fibre]
    }

    fn volumetric(&self) -> Volumetric {
        self.volumetric
    }

    fn shear(&self) -> f64 {
        self.shear
    }

    fn families(&self) -> usize {
        1
    }

    fn fibre_stiffness(&self) -> f64 {
        fibre_stiffness(self.fibre)
    }
}
