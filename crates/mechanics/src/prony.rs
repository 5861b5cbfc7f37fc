//! Viscoelasticity by Prony series on the second Piola–Kirchhoff stress: S = (1 − Σ aᵢ) Φ + Σ hᵢ, with Φ the
//! elastic stress of the law. The isochoric and the volumetric part have a series each.
//!
//! Both updates have the form hᵢⁿ = dᵢ hᵢⁿ⁻¹ + gᵢ (Φⁿ − Φⁿ⁻¹). The *exact* update is for Φ linear in the step
//! (Taylor, Pister and Goudreau 1970): d = e^(−Δt/τ), g = a (1 − d) τ/Δt. The update by *backward Euler*
//! (thesis 5.57–5.61, there written with a − h) is: d = τ/(Δt + τ), g = a d. A step of no time, d = 1 and g =
//! a, is a jump: it loads the instantaneous law. A history begins with such a step. Leaves out: a
//! thermodynamic derivation. For anisotropic finite strain the dissipation may be non-monotone.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::law::Split;
use crate::tensor::Symmetric;

/// Part of the stress that relaxes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "Part")]
pub enum PronyPart {
    /// The change of shape (for an unsplit law: the term with the shear modulus).
    Isochoric,
    /// The change of volume.
    Volumetric,
}

impl std::fmt::Display for PronyPart {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Isochoric => "isochoric",
            Self::Volumetric => "volumetric",
        })
    }
}

/// One term of a Prony series.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct PronyTerm {
    /// The part of the stress that relaxes.
    pub part: PronyPart,
    /// Fraction a of the instantaneous stress that relaxes; the weights of one part sum to less than 1.
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 1.0))]
    pub weight: f64,
    /// Relaxation time τ [s].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub time: f64,
}

/// Method that advances the history over a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum PronyUpdate {
    /// Exact for a stress that grows linearly in the step.
    #[default]
    Exact,
    /// First order, as in the thesis.
    BackwardEuler,
}

impl PronyUpdate {
    /// d and g of a term (a, τ) for a step [s]: hⁿ = d hⁿ⁻¹ + g (Φⁿ − Φⁿ⁻¹).
    pub fn coefficients(self, (weight, time): (f64, f64), step: f64) -> (f64, f64) {
        match self {
            Self::Exact if step == 0.0 => (1.0, weight),
            Self::Exact => {
                let x = step / time;
                ((-x).exp(), weight * -(-x).exp_m1() / x)
            }
            Self::BackwardEuler => {
                let decay = time / (step + time);
                (decay, weight * decay)
            }
        }
    }
}

/// The series of both parts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Prony {
    /// Terms (a, τ) on the isochoric part.
    pub isochoric: Vec<(f64, f64)>,
    /// Terms (a, τ) on the volumetric part.
    pub volumetric: Vec<(f64, f64)>,
    /// Method that advances the history.
    pub update: PronyUpdate,
}

/// A Prony series that cannot be.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PronyError {
    /// A weight outside (0, 1) or a time not above 0.
    #[error(
        "term {index} has weight {weight} and time {time} s; weights lie between 0 and 1, times above 0 s"
    )]
    Term {
        /// Index in the list.
        index: usize,
        /// Its weight.
        weight: f64,
        /// Its relaxation time [s].
        time: f64,
    },
    /// No stress would be left after relaxing.
    #[error(
        "the {part:?} weights sum to {sum}; they must sum to less than 1, because the tissue needs some stress that stays"
    )]
    Sum {
        /// The part.
        part: PronyPart,
        /// Sum of its weights.
        sum: f64,
    },
}

impl Prony {
    /// Sorts the terms by part and checks them.
    pub fn new(terms: &[PronyTerm], update: PronyUpdate) -> Result<Self, PronyError> {
        let mut prony = Self { update, ..Self::default() };
        for (index, &PronyTerm { part, weight, time }) in terms.iter().enumerate() {
            if !(weight > 0.0 && weight < 1.0 && time > 0.0 && time.is_finite()) {
                return Err(PronyError::Term { index, weight, time });
            }
            match part {
                PronyPart::Isochoric => prony.isochoric.push((weight, time)),
                PronyPart::Volumetric => prony.volumetric.push((weight, time)),
            }
        }
        for (part, series) in
            [(PronyPart::Isochoric, &prony.isochoric), (PronyPart::Volumetric, &prony.volumetric)]
        {
            let sum: f64 = series.iter().map(|(weight, _)| weight).sum();
            if sum >= 1.0 {
                return Err(PronyError::Sum { part, sum });
            }
        }
        Ok(prony)
    }

    /// True if the law has no history.
    pub fn is_elastic(&self) -> bool {
        self.isochoric.is_empty() && self.volumetric.is_empty()
    }

    /// The total stress [Pa] at the instant the history belongs to: (1 − Σ aᵢ) Φ + Σ hᵢ of each part.
    pub fn stress(&self, elastic: Split<Symmetric<f64>>, history: &[Symmetric<f64>]) -> Symmetric<f64> {
        let Split { isochoric, volumetric } = self.remaining();
        elastic.isochoric * isochoric + elastic.volumetric * volumetric + self.lag(history.iter().copied())
    }

    /// 1 − Σ aᵢ of each part.
    pub fn remaining(&self) -> Split<f64> {
        let of = |series: &[(f64, f64)]| 1.0 - series.iter().map(|(weight, _)| weight).sum::<f64>();
        Split { isochoric: of(&self.isochoric), volumetric: of(&self.volumetric) }
    }

    /// Σ hᵢ [Pa] of both parts, from the tensors that a point remembers.
    pub fn lag(&self, history: impl Iterator<Item = Symmetric<f64>>) -> Symmetric<f64> {
        // Each part begins with Φⁿ⁻¹.
        let stresses = history.enumerate().filter(|(slot, _)| ![0, self.isochoric_slots()].contains(slot));
        stresses.fold(Symmetric::ZERO, |sum, (_, h)| sum + h)
    }

    /// The averaged pressure [Pa] at the instant the history belongs to.
    pub fn pressure(&self, elastic: f64, history: &[f64]) -> f64 {
        history.iter().skip(1).fold(elastic * self.remaining().volumetric, |sum, h| sum + h)
    }

    /// Symmetric tensors of history per cell: for each part that relaxes, Φⁿ⁻¹ and one h per term.
    pub fn slots(&self) -> usize {
        self.isochoric_slots() + self.volumetric_slots()
    }

    /// Tensors of history per evaluation point, where `averages` says that the pressure is averaged over
    /// cells and remembered there.
    pub fn point_slots(&self, averages: bool) -> usize {
        if averages { self.isochoric_slots() } else { self.slots() }
    }

    /// Symmetric tensors of history of the isochoric part.
    pub fn isochoric_slots(&self) -> usize {
        if self.isochoric.is_empty() { 0 } else { 1 + self.isochoric.len() }
    }

    /// Symmetric tensors of history of the volumetric part.
    pub fn volumetric_slots(&self) -> usize {
        if self.volumetric.is_empty() { 0 } else { 1 + self.volumetric.len() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_that_leave_nothing_are_refused() {
        let term = |weight| PronyTerm { part: PronyPart::Volumetric, weight, time: 1.0 };
        assert!(matches!(
            Prony::new(&[term(0.5), term(0.5)], PronyUpdate::Exact),
            Err(PronyError::Sum { .. })
        ));
        assert!(matches!(Prony::new(&[term(1.0)], PronyUpdate::Exact), Err(PronyError::Term { .. })));
        assert!(Prony::new(&[term(0.5), term(0.4)], PronyUpdate::Exact).is_ok());
    }
}
