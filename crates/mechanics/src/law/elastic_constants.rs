//! The two moduli of an isotropic matrix. They are given as shear and bulk modulus, or as Young's modulus and
//! Poisson's ratio: μ = E/(2(1+ν)), κ = E/(3(1−2ν)).

use schemars::JsonSchema;
use serde::Deserialize;

use super::{ParameterError, SmallStrainModuli};

/// Stiffness of the matrix: `shear-modulus` with `bulk-modulus`, or `young-modulus` with `poisson-ratio`.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct ElasticConstants {
    /// Shear modulus μ [Pa].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub shear_modulus: Option<f64>,
    /// Bulk modulus κ [Pa].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub bulk_modulus: Option<f64>,
    /// Young's modulus E [Pa].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub young_modulus: Option<f64>,
    /// Poisson's ratio ν; soft tissue lies near 0.45 to 0.49. 0.5, a volume that never changes, is for
    /// membranes and shells.
    #[schemars(extend("exclusiveMinimum" = -1.0, "maximum" = 0.5))]
    pub poisson_ratio: Option<f64>,
}

const ACCEPTED: &str =
    "give `shear-modulus` and `bulk-modulus` [Pa], or `young-modulus` [Pa] and `poisson-ratio`";

impl ElasticConstants {
    /// Shear and bulk modulus [Pa].
    ///
    /// # Errors
    /// If both pairs, parts of both or neither are given, or a value is out of range.
    pub fn moduli(&self) -> Result<SmallStrainModuli, ParameterError> {
        let given = [
            ("shear-modulus", self.shear_modulus),
            ("bulk-modulus", self.bulk_modulus),
            ("young-modulus", self.young_modulus),
        ];
        for (key, value) in given {
            if let Some(value) = value
                && !(value > 0.0 && value.is_finite())
            {
                return Err(error(key, format!("`{key}` must be greater than 0 Pa, found {value}")));
            }
        }
        match *self {
            Self {
                shear_modulus: Some(shear),
                bulk_modulus: Some(bulk),
                young_modulus: None,
                poisson_ratio: None,
            } => {
                if 3.0 * bulk <= 2.0 * shear * 1e-9 {
                    return Err(error("bulk-modulus", format!("`bulk-modulus` {bulk} Pa is negligible")));
                }
                Ok(SmallStrainModuli { shear, bulk })
            }
            Self {
                shear_modulus: None,
                bulk_modulus: None,
                young_modulus: Some(e),
                poisson_ratio: Some(nu),
            } => {
                if !(-1.0 < nu && nu <= 0.5) {
                    return Err(error("poisson-ratio", poisson_range(nu)));
                }
                Ok(SmallStrainModuli { shear: e / (2.0 * (1.0 + nu)), bulk: e / (3.0 * (1.0 - 2.0 * nu)) })
            }
            _ => Err(self.wrong_combination()),
        }
    }

    /// Returns the moduli of a law that must be able to change its volume.
    ///
    /// # Errors
    /// As [`moduli`](Self::moduli), and if ν = ½.
    pub(crate) fn compressible_moduli(&self) -> Result<SmallStrainModuli, ParameterError> {
        let moduli = self.moduli()?;
        if moduli.bulk.is_infinite() {
            let message = "this law has no version that keeps the volume (`poisson-ratio` 0.5)".into();
            let help = "take a `poisson-ratio` below 0.5, or for a membrane a law such as `neo-hookean`";
            return Err(ParameterError { key: "poisson-ratio", message, help: help.into() });
        }
        Ok(moduli)
    }

    fn wrong_combination(&self) -> ParameterError {
        let moduli = self.shear_modulus.is_some() || self.bulk_modulus.is_some();
        let engineering = self.young_modulus.is_some() || self.poisson_ratio.is_some();
        match (moduli, engineering) {
            (true, true) => error(
                if self.young_modulus.is_some() { "young-modulus" } else { "poisson-ratio" },
                "the stiffness is given in two ways at once".into(),
            ),
            (true, false) => missing(self.shear_modulus.is_some(), "shear-modulus", "bulk-modulus"),
            (false, true) => missing(self.young_modulus.is_some(), "young-modulus", "poisson-ratio"),
            (false, false) => error("type", "the stiffness is missing".into()),
        }
    }
}

/// Message for a Poisson's ratio out of range.
pub(super) fn poisson_range(nu: f64) -> String {
    format!("`poisson-ratio` must be above −1 and at most 0.5; found {nu}")
}

fn missing(first_given: bool, first: &'static str, second: &'static str) -> ParameterError {
    let (given, missing) = if first_given { (first, second) } else { (second, first) };
    error(given, format!("`{given}` is given without `{missing}`"))
}

fn error(key: &'static str, message: String) -> ParameterError {
    ParameterError { key, message, help: ACCEPTED.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn engineering_constants_give_the_moduli_of_linear_elasticity() {
        let given =
            ElasticConstants { young_modulus: Some(3000.0), poisson_ratio: Some(0.45), ..Default::default() };
        let moduli = given.moduli().unwrap();
        assert!((moduli.shear - 1034.4827586206898).abs() < 1e-9);
        assert!((moduli.bulk - 10000.0).abs() < 1e-9);
        assert!((moduli.young() - 3000.0).abs() < 1e-9 && (moduli.poisson() - 0.45).abs() < 1e-12);
    }

    #[test]
    fn half_a_poisson_ratio_keeps_the_volume() {
        let given =
            ElasticConstants { young_modulus: Some(3000.0), poisson_ratio: Some(0.5), ..Default::default() };
        let moduli = given.moduli().unwrap();
        assert_eq!((moduli.shear, moduli.bulk), (1000.0, f64::INFINITY));
        assert_eq!((moduli.young(), moduli.poisson()), (3000.0, 0.5));
        assert_eq!(given.compressible_moduli().unwrap_err().key, "poisson-ratio");
    }

    #[test]
    fn both_neither_and_half_a_pair_are_refused() {
        let key = |constants: ElasticConstants| constants.moduli().unwrap_err().key;
        assert_eq!(key(ElasticConstants::default()), "type");
        assert_eq!(key(ElasticConstants { shear_modulus: Some(1.0), ..Default::default() }), "shear-modulus");
        assert_eq!(
            key(ElasticConstants {
                shear_modulus: Some(1.0),
                young_modulus: Some(1.0),
                ..Default::default()
            }),
            "young-modulus"
        );
        for nu in [0.51, -1.0, 0.7, f64::NAN] {
            let constants =
                ElasticConstants { young_modulus: Some(1.0), poisson_ratio: Some(nu), ..Default::default() };
            assert_eq!(key(constants), "poisson-ratio");
        }
    }
}
