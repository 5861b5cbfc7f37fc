//! Laws whose energy is the sum of one of shape and one of volume, Ψ = Ψ_iso(C̄) + U(J). Such a law states
//! its isochoric part and names its [`Volumetric`] energy; this file makes it a [`Law`]. The file also has
//! the parameters that all these laws share.

use schemars::JsonSchema;
use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::elastic_constants::poisson_range;
use super::{
    Deformation, ElasticConstants, Law, NamedLaw, ParameterError, Shader, SmallStrainModuli, Split,
    Volumetric, VolumetricEnergy,
};
use crate::Number;
use crate::tensor::{Symmetric, Vector};

/// A law with an isochoric and a volumetric energy.
pub trait SplitLaw: Copy + Send + Sync + 'static {
    /// Parameters from the user, each with unit and range.
    type Parameters: DeserializeOwned + JsonSchema;

    /// Checks and converts the user's parameters.
    fn new(parameters: &Self::Parameters) -> Result<Self, ParameterError>;

    /// Isochoric energy per reference volume [J/m³]. `fibres` are the unit directions of the families at
    /// rest.
    fn isochoric_energy<R: Number>(&self, deformation: &Deformation<R>, fibres: &[Vector<R>]) -> R;

    /// Second Piola–Kirchhoff stress of the isochoric energy [Pa], put together by [`Deformation`].
    fn isochoric_stress<R: Number>(&self, deformation: &Deformation<R>, fibres: &[Vector<R>])
    -> Symmetric<R>;

    /// The isochoric stress in WGSL: `fn isochoric_stress(d: Deformation, a: vec3f, b: vec3f) -> Symmetric`.
    const WGSL: &'static str;

    /// Values of `parameter(1)` and on; `parameter(0)` is the bulk modulus.
    fn shader_parameters(&self) -> Vec<f64>;

    /// The volumetric energy.
    fn volumetric(&self) -> Volumetric;

    /// Shear modulus of the matrix at rest [Pa]: 2 (W₁ + W₂).
    fn shear(&self) -> f64;

    /// Families of fibres, each with a direction in every cell.
    fn families(&self) -> usize {
        0
    }

    /// An upper bound of what fibres add to ρc² at rest, over all directions [Pa].
    fn fibre_stiffness(&self) -> f64 {
        0.0
    }

    /// True if the shear stiffness never rises; see [`Law::keeps_shear_stiffness`].
    fn keeps_shear_stiffness(&self) -> bool {
        false
    }
}

/// The largest ρc² [Pa] that fibres of the energy η/2 (Ī₄ − 1)² feel at rest. For a wave along n that moves
/// along m the rate of Ī₄ is 2 ((a·n)(a·m) − n·m/3). The product (a·n)(a·m) lies between (n·m − 1)/2 and
/// (n·m + 1)/2. Hence |rate| ≤ 4/3, reached along the fibre: 16/9 η.
pub(super) fn fibre_stiffness(modulus: f64) -> f64 {
    16.0 / 9.0 * modulus
}

impl<L: SplitLaw> NamedLaw for L {
    type Parameters = L::Parameters;

    fn new(parameters: &L::Parameters) -> Result<Self, ParameterError> {
        <L as SplitLaw>::new(parameters)
    }
}

impl<L: SplitLaw> Law for L {
    #[inline(always)]
    fn energy<R: Number>(&self, deformation: &Deformation<R>, fibres: &[Vector<R>]) -> Split<R> {
        Split {
            isochoric: self.isochoric_energy(deformation, fibres),
            volumetric: self.volumetric().energy(deformation),
        }
    }

    #[inline(always)]
    fn stress<R: Number>(&self, deformation: &Deformation<R>, fibres: &[Vector<R>]) -> Split<Symmetric<R>> {
        Split {
            isochoric: self.isochoric_stress(deformation, fibres),
            volumetric: self.volumetric().stress(deformation),
        }
    }

    #[inline(always)]
    fn whole_stress<R: Number>(&self, deformation: &Deformation<R>, fibres: &[Vector<R>]) -> Symmetric<R> {
        let pressure = self.volumetric().kirchhoff_pressure(deformation);
        self.isochoric_stress(deformation, fibres).plus_scaled(&deformation.inverse_cauchy_green, pressure)
    }

    fn shader(&self) -> Option<Shader> {
        Some(self.volumetric().shader(&[L::WGSL, include_str!("split.wgsl")], &self.shader_parameters()))
    }

    fn small_strain(&self) -> SmallStrainModuli {
        SmallStrainModuli { shear: self.shear(), bulk: self.volumetric().bulk }
    }

    fn families(&self) -> usize {
        SplitLaw::families(self)
    }

    fn fibre_modulus(&self) -> f64 {
        self.fibre_stiffness()
    }

    fn keeps_shear_stiffness(&self) -> bool {
        SplitLaw::keeps_shear_stiffness(self)
    }
}

/// The matrix of a split law whose shear modulus is a parameter: two elastic constants and the volumetric
/// energy.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct Matrix {
    /// The two moduli.
    #[serde(flatten)]
    pub elastic: ElasticConstants,
    /// Form of the energy U(J) of a change of volume.
    #[serde(default)]
    pub volumetric: VolumetricEnergy,
}

impl Matrix {
    /// Shear modulus [Pa] and volumetric energy.
    ///
    /// # Errors
    /// As [`ElasticConstants::moduli`].
    pub fn parts(&self) -> Result<(f64, Volumetric), ParameterError> {
        let SmallStrainModuli { shear, bulk } = self.elastic.moduli()?;
        Ok((shear, Volumetric { energy: self.volumetric, bulk }))
    }
}

/// The resistance to a change of volume of a law whose shear modulus follows from its own coefficients:
/// `bulk-modulus`, or `poisson-ratio`, which with the shear modulus μ at rest gives κ = 2μ (1+ν)/(3 (1−2ν)).
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct Compressibility {
    /// Bulk modulus κ [Pa].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub bulk_modulus: Option<f64>,
    /// Poisson's ratio ν at rest; soft tissue lies near 0.45 to 0.49. 0.5, a volume that never changes, is
    /// for membranes and shells.
    #[schemars(extend("exclusiveMinimum" = -1.0, "maximum" = 0.5))]
    pub poisson_ratio: Option<f64>,
    /// Form of the energy U(J) of a change of volume.
    #[serde(default)]
    pub volumetric: VolumetricEnergy,
}

impl Compressibility {
    /// The volumetric energy of a law with this shear modulus at rest [Pa].
    ///
    /// # Errors
    /// If both or neither is given, or a value is out of range.
    pub fn volumetric(&self, shear: f64) -> Result<Volumetric, ParameterError> {
        let error = |key, message| {
            let help = "give `bulk-modulus` [Pa] or `poisson-ratio`";
            Err(ParameterError { key, message, help: help.into() })
        };
        let bulk = match (self.bulk_modulus, self.poisson_ratio) {
            (Some(bulk), None) if bulk > 0.0 && bulk.is_finite() => bulk,
            (Some(bulk), None) => {
                return error(
                    "bulk-modulus",
                    format!("`bulk-modulus` must be greater than 0 Pa, found {bulk}"),
                );
            }
            (None, Some(nu)) if -1.0 < nu && nu <= 0.5 => 2.0 * shear * (1.0 + nu) / (3.0 * (1.0 - 2.0 * nu)),
            (None, Some(nu)) => {
                return error("poisson-ratio", poisson_range(nu));
            }
            (Some(_), Some(_)) => {
                return error("poisson-ratio", "the resistance to volume change is given in two ways".into());
            }
            (None, None) => return error("type", "the resistance to volume change is missing".into()),
        };
        Ok(Volumetric { energy: self.volumetric, bulk })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poisson_ratio_and_bulk_modulus_mean_the_same() {
        let poisson = Compressibility { poisson_ratio: Some(0.45), ..Default::default() };
        // E = 3000 Pa and ν = 0.45: μ = 1034.48, κ = 10000 Pa.
        let bulk = poisson.volumetric(3000.0 / 2.9).unwrap().bulk;
        assert!((bulk - 10_000.0).abs() < 1e-8);
    }

    #[test]
    fn both_neither_and_values_out_of_range_are_refused() {
        let key = |bulk_modulus, poisson_ratio| {
            let given = Compressibility { bulk_modulus, poisson_ratio, ..Default::default() };
            given.volumetric(1.0).unwrap_err().key
        };
        assert_eq!(key(None, None), "type");
        assert_eq!(key(Some(1.0), Some(0.4)), "poisson-ratio");
        assert_eq!(key(None, Some(0.51)), "poisson-ratio");
        assert_eq!(key(Some(0.0), None), "bulk-modulus");
        assert_eq!(key(Some(f64::NAN), None), "bulk-modulus");
    }
}
