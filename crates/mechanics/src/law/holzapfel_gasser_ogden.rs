//! Arterial wall of Holzapfel, Gasser and Ogden (2000) with dispersed fibres (Gasser, Ogden and Holzapfel
//! 2006). The energy is Ψ = c/2 (Ī₁ − 3) + Σ k₁/(2k₂) (e^(k₂ ⟨E⟩²) − 1) + U(J) over one or two families. Here
//! E = κ (Ī₁ − 3) + (1 − 3κ)(Ī₄ − 1), with κ between 0 (aligned) and 1/3 (isotropic). Fibres carry tension
//! only (E > 0), as a maximum instead of a branch. With p = k₁ E e^(k₂ E²) this gives W₁ = c/2 + Σ κ p, W₄ =
//! (1 − 3κ) p. The stiffness jumps where E changes sign. The exponential stiffens far beyond the bound at
//! rest: watch the step.

use schemars::JsonSchema;
use serde::Deserialize;

use super::split::fibre_stiffness;
use super::{Deformation, Matrix, ParameterError, SplitLaw, Volumetric, check};
use crate::Number;
use crate::tensor::{Symmetric, Vector};

/// Neo-Hookean matrix with one or two families of stiffening fibres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HolzapfelGasserOgden {
    /// Shear modulus c of the matrix [Pa].
    pub shear: f64,
    /// Fibre modulus k₁ [Pa].
    pub fibre: f64,
    /// Fibre exponent k₂.
    pub exponent: f64,
    /// Dispersion κ of the fibres.
    pub dispersion: f64,
    /// Families of fibres, 1 or 2.
    pub families: usize,
    /// Volumetric energy.
    pub volumetric: Volumetric,
}

/// Parameters of the Holzapfel–Gasser–Ogden law: Ψ = c/2 (Ī₁ − 3) + Σ k₁/(2k₂) (e^(k₂ ⟨E⟩²) − 1) + U(J),
/// E = κ (Ī₁ − 3) + (1 − 3κ)(Ī₄ − 1). The families are `fibre` and
/// `second-fibre` of the law or the body.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct HolzapfelGasserOgdenParameters {
    /// The moduli of the matrix; the shear modulus is c.
    #[serde(flatten)]
    pub matrix: Matrix,
    /// Fibre modulus k₁ [Pa].
    #[schemars(range(min = 0.0))]
    pub fibre_modulus: f64,
    /// Fibre exponent k₂.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub fibre_exponent: f64,
    /// Dispersion κ of the fibres: 0 aligned, 1/3 in all directions.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 0.333_333_333_333_333_3))]
    pub dispersion: f64,
    /// Families of fibres; with 2, the law or the body has a `second-fibre`.
    #[serde(default = "one")]
    #[schemars(range(min = 1, max = 2))]
    pub families: usize,
}

fn one() -> usize {
    1
}

impl HolzapfelGasserOgden {
    /// ⟨E⟩ of one family.
    #[inline(always)]
    fn tension<R: Number>(&self, deformation: &Deformation<R>, a: Vector<R>) -> R {
        let spread = R::of(self.dispersion) * deformation.isochoric_first_invariant_minus_3();
        let along = R::of(1.0 - 3.0 * self.dispersion) * deformation.fibre_strain(a);
        (spread + along).max(R::ZERO)
    }

    #[inline(always)]
    fn family_energy<R: Number>(&self, deformation: &Deformation<R>, a: Vector<R>) -> R {
        let tension = self.tension(deformation, a);
        R::of(0.5 * self.fibre / self.exponent) * (R::of(self.exponent) * tension * tension).exp_m1()
    }

    #[inline(always)]
    fn family_stress<R: Number>(&self, deformation: &Deformation<R>, a: Vector<R>) -> Symmetric<R> {
        let tension = self.tension(deformation, a);
        let p = R::of(self.fibre) * tension * (R::of(self.exponent) * tension * tension).exp();
        deformation.first_invariant_stress(R::of(self.dispersion) * p)
            + deformation.fibre_stress(a, R::of(1.0 - 3.0 * self.dispersion) * p)
    }
}

impl SplitLaw for HolzapfelGasserOgden {
    type Parameters = HolzapfelGasserOgdenParameters;

    const WGSL: &'static str = include_str!("holzapfel_gasser_ogden.wgsl");

    fn new(parameters: &HolzapfelGasserOgdenParameters) -> Result<Self, ParameterError> {
        let (shear, volumetric) = parameters.matrix.parts()?;
        let dispersion = parameters.dispersion;
        if !(0.0..=1.0 / 3.0).contains(&dispersion) {
            let message = format!("`dispersion` must lie between 0 and 1/3, found {dispersion}");
            let help = "0: all fibres along one direction; 1/3: fibres in all directions";
            return Err(ParameterError { key: "dispersion", message, help: help.into() });
        }
        let families = parameters.families;
        if !(1..=2).contains(&families) {
            let message = format!("`families` must be 1 or 2, found {families}");
            let help = "1: fibres along `fibre`; 2: also along `second-fibre`";
            return Err(ParameterError { key: "families", message, help: help.into() });
        }
        Ok(Self {
            shear,
            fibre: check::not_negative("fibre-modulus", parameters.fibre_modulus, "0 leaves the fibres out")?,
            exponent: check::positive("fibre-exponent", parameters.fibre_exponent, "")?,
            dispersion,
            families,
            volumetric,
        })
    }

    #[inline(always)]
    fn isochoric_energy<R: Number>(&self, deformation: &Deformation<R>, fibres: &[Vector<R>]) -> R {
        let mut energy = R::of(0.5 * self.shear) * deformation.isochoric_first_invariant_minus_3();
        for &fibre in fibres {
            energy += self.family_energy(deformation, fibre);
        }
        energy
    }

    #[inline(always)]
    fn isochoric_stress<R: Number>(
        &self,
        deformation: &Deformation<R>,
        fibres: &[Vector<R>],
    ) -> Symmetric<R> {
        let mut stress = deformation.first_invariant_stress(R::of(0.5 * self.shear));
        for &fibre in fibres {
            stress = stress + self.family_stress(deformation, fibre);
        }
        stress
    }

    fn shader_parameters(&self) -> Vec<f64> {
        let (spread, along) = (self.dispersion, 1.0 - 3.0 * self.dispersion);
        vec![0.5 * self.shear, self.fibre, self.exponent, spread, along, self.families as f64]
    }

    fn volumetric(&self) -> Volumetric {
        self.volumetric
    }

    fn shear(&self) -> f64 {
        self.shear
    }

    fn families(&self) -> usize {
        self.families
    }

    fn fibre_stiffness(&self) -> f64 {
        // To first order E = (1 − 3κ)(Ī₄ − 1); every family under tension.
        self.families as f64 * fibre_stiffness(self.fibre * (1.0 - 3.0 * self.dispersion).powi(2))
    }
}
