//! Ogden law (1972): Ψ = Σₚ 2μₚ/αₚ² (λ̄₁^αₚ + λ̄₂^αₚ + λ̄₃^αₚ − 3) + U(J), isochoric principal stretches λ̄ᵢ;
//! μ = Σ μₚ at rest. The Kirchhoff stress has the principal values tᵢ = Σₚ 2μₚ/αₚ λ̄ᵢ^αₚ minus their mean.
//! The stress is S = Σᵢ tᵢ/λᵢ² Nᵢ⊗Nᵢ. The law never divides by a difference of stretches, so that equal
//! stretches are no special case. Let β = λ̄² − 1 be a principal value of C̄ − I. Then λ̄^α − 1 = e^(α/2
//! ln(1+β)) − 1 keeps the digits of small strains.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::principal::principal;
use super::{Compressibility, Deformation, ParameterError, SplitLaw, Volumetric, check};
use crate::Number;
use crate::tensor::{Symmetric, Vector};

/// The most terms a law can have; six serve every fit known to us.
pub(crate) const MOST_TERMS: usize = 6;

/// Sum of powers of the principal stretches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ogden {
    /// The terms; those beyond `count` are not used.
    pub terms: [OgdenTerm; MOST_TERMS],
    /// Number of terms.
    pub count: usize,
    /// Volumetric energy.
    pub volumetric: Volumetric,
}

/// One term of the Ogden law: 2μ/α² (λ̄₁^α + λ̄₂^α + λ̄₃^α − 3).
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct OgdenTerm {
    /// Share μ of the shear modulus at rest [Pa]; the shares sum to more than 0.
    pub shear_modulus: f64,
    /// Exponent α, not 0.
    pub exponent: f64,
}

/// Parameters of the Ogden law: Ψ = Σₚ 2μₚ/αₚ² (λ̄₁^αₚ + λ̄₂^αₚ + λ̄₃^αₚ − 3) + U(J); μ = Σ μₚ at rest.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct OgdenParameters {
    /// One to six terms, each with `shear-modulus` [Pa] and `exponent`.
    #[schemars(length(min = 1, max = 6))]
    pub terms: Vec<OgdenTerm>,
    /// The resistance to a change of volume.
    #[serde(flatten)]
    pub compressibility: Compressibility,
}

impl Ogden {
    fn terms(&self) -> &[OgdenTerm] {
        &self.terms[..self.count]
    }
}

impl SplitLaw for Ogden {
    type Parameters = OgdenParameters;

    const WGSL: &'static str = concat!(include_str!("principal.wgsl"), "\n", include_str!("ogden.wgsl"));

    fn new(parameters: &OgdenParameters) -> Result<Self, ParameterError> {
        let given = &parameters.terms;
        let wrong = |message| {
            let help = format!("give 1 to {MOST_TERMS} terms, each with `shear-modulus` [Pa] and `exponent`");
            ParameterError { key: "terms", message, help }
        };
        if given.is_empty() || given.len() > MOST_TERMS {
            return Err(wrong(format!("the law has {} terms", given.len())));
        }
        for (index, term) in given.iter().enumerate() {
            if !(term.exponent.is_finite() && term.exponent != 0.0 && term.shear_modulus.is_finite()) {
                let message = format!(
                    "term {index} has the exponent {} and the modulus {} Pa; the exponent must not be 0",
                    term.exponent, term.shear_modulus
                );
                return Err(wrong(message));
            }
        }
        let sum = given.iter().map(|term| term.shear_modulus).sum();
        let shear = check::shear_at_rest("terms", sum, "the sum of the terms")?;
        let mut terms = [OgdenTerm::default(); MOST_TERMS];
        terms[..given.len()].copy_from_slice(given);
        Ok(Self { terms, count: given.len(), volumetric: parameters.compressibility.volumetric(shear)? })
    }

    #[inline(always)]
    fn isochoric_energy<R: Number>(&self, deformation: &Deformation<R>, _fibres: &[Vector<R>]) -> R {
        let (strains, _) = principal(&deformation.isochoric_strain_twice());
        let mut energy = R::ZERO;
        for term in self.terms() {
            let half = R::of(0.5 * term.exponent);
            let powers = (half * strains[0].ln_1p()).exp_m1()
                + (half * strains[1].ln_1p()).exp_m1()
                + (half * strains[2].ln_1p()).exp_m1();
            energy += R::of(2.0 * term.shear_modulus / (term.exponent * term.exponent)) * powers;
        }
        energy
    }

    #[inline(always)]
    fn isochoric_stress<R: Number>(
        &self,
        deformation: &Deformation<R>,
        _fibres: &[Vector<R>],
    ) -> Symmetric<R> {
        let (strains, directions) = principal(&deformation.isochoric_strain_twice());
        let mut kirchhoff = [R::ZERO; 3];
        for term in self.terms() {
            let (half, factor) =
                (R::of(0.5 * term.exponent), R::of(2.0 * term.shear_modulus / term.exponent));
            for (t, strain) in kirchhoff.iter_mut().zip(strains) {
                *t += factor * (half * strain.ln_1p()).exp_m1();
            }
        }
        let mean = (kirchhoff[0] + kirchhoff[1] + kirchhoff[2]) * R::of(1.0 / 3.0);
        let mut stress = Symmetric::ZERO;
        for ((t, strain), direction) in kirchhoff.into_iter().zip(strains).zip(directions) {
            // λ² = λ̄²/q.
            let value = deformation.isochoric_factor * (t - mean) / (R::ONE + strain);
            stress = stress + Symmetric::dyad(direction) * value;
        }
        stress
    }

    fn shader_parameters(&self) -> Vec<f64> {
        let terms = self.terms().iter();
        let each = terms.flat_map(|term| [0.5 * term.exponent, 2.0 * term.shear_modulus / term.exponent]);
        std::iter::once(self.count as f64).chain(each).collect()
    }

    fn volumetric(&self) -> Volumetric {
        self.volumetric
    }

    fn shear(&self) -> f64 {
        self.terms().iter().map(|term| term.shear_modulus).sum()
    }
}
