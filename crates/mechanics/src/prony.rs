//! Viscoelasticity by Prony series on the second Piola–Kirchhoff stress, the isochoric and the volumetric part
//! each with a series of its own: S = (1 − Σ aᵢ) Φ + Σ hᵢ, with Φ the elastic stress of the law.
//!
//! Both updates have the form hᵢⁿ = dᵢ hᵢⁿ⁻¹ + gᵢ (Φⁿ − Φⁿ⁻¹):
//! *exact* for Φ linear in the step (Taylor, Pister and Goudreau 1970): d = e^(−Δt/τ), g = a (1 − d) τ/Δt;
//! *backward Euler* (thesis 5.57–5.61, there written with a − h): d = τ/(Δt + τ), g = a d.
//! A step of no time, d = 1 and g = a, is a jump: it loads the instantaneous law. So a history begins.
//! Leaves out: a thermodynamic derivation; for anisotropic finite strain the dissipation may be non-monotone.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Real;
use crate::lanes::{Lanes, Pack};
use crate::law::Split;
use crate::tensor::Symmetric;

/// Which part of the stress relaxes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Part {
    /// The change of shape (for an unsplit law: the term with the shear modulus).
    Isochoric,
    /// The change of volume.
    Volumetric,
}

impl std::fmt::Display for Part {
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
    pub part: Part,
    /// Fraction a of the instantaneous stress that relaxes; the weights of one part sum to less than 1.
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 1.0))]
    pub weight: f64,
    /// Relaxation time τ [s].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub time: f64,
}

/// How the history is advanced over a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum PronyUpdate {
    /// Exact for a stress that grows linearly in the step.
    #[default]
    Exact,
    /// First order, as in the thesis.
    BackwardEuler,
}

/// The series of both parts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Prony {
    /// Terms (a, τ) on the isochoric part.
    pub isochoric: Vec<(f64, f64)>,
    /// Terms (a, τ) on the volumetric part.
    pub volumetric: Vec<(f64, f64)>,
    /// How the history advances.
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
    /// Nothing of the stress would be left after relaxing.
    #[error(
        "the {part:?} weights sum to {sum}; they must sum to less than 1, or nothing is left to hold the tissue"
    )]
    Sum {
        /// The part.
        part: Part,
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
                Part::Isochoric => prony.isochoric.push((weight, time)),
                Part::Volumetric => prony.volumetric.push((weight, time)),
            }
        }
        for (part, series) in [(Part::Isochoric, &prony.isochoric), (Part::Volumetric, &prony.volumetric)] {
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
        let part = |elastic: Symmetric<f64>, series: &[(f64, f64)], history: &[Symmetric<f64>]| {
            let remaining = 1.0 - series.iter().map(|(weight, _)| weight).sum::<f64>();
            history.iter().skip(1).fold(elastic * remaining, |sum, h| sum + *h)
        };
        let (isochoric, volumetric) = history.split_at(self.isochoric_slots());
        part(elastic.isochoric, &self.isochoric, isochoric)
            + part(elastic.volumetric, &self.volumetric, volumetric)
    }

    /// The averaged pressure [Pa] at the instant the history belongs to.
    pub fn pressure(&self, elastic: f64, history: &[f64]) -> f64 {
        let remaining = 1.0 - self.volumetric.iter().map(|(weight, _)| weight).sum::<f64>();
        history.iter().skip(1).fold(elastic * remaining, |sum, h| sum + h)
    }

    /// Symmetric tensors of history per cell: for each part that relaxes, Φⁿ⁻¹ and one h per term.
    pub fn slots(&self) -> usize {
        self.isochoric_slots() + self.volumetric_slots()
    }

    /// Those of the isochoric part.
    pub fn isochoric_slots(&self) -> usize {
        if self.isochoric.is_empty() { 0 } else { 1 + self.isochoric.len() }
    }

    /// Those of the volumetric part.
    pub fn volumetric_slots(&self) -> usize {
        if self.volumetric.is_empty() { 0 } else { 1 + self.volumetric.len() }
    }
}

/// The coefficients of a series for one step size.
#[derive(Clone, Debug)]
pub struct Relaxation<R> {
    isochoric: Series<R>,
    volumetric: Series<R>,
}

/// Those of one part.
#[derive(Clone, Debug)]
pub struct Series<R> {
    /// 1 − Σ a.
    pub remaining: R,
    /// (d, g) per term.
    pub terms: Vec<(R, R)>,
}

impl<R: Real> Series<R> {
    fn new(terms: &[(f64, f64)], update: PronyUpdate, step: f64) -> Self {
        let mut series = Self {
            remaining: R::of(1.0 - terms.iter().map(|(weight, _)| weight).sum::<f64>()),
            terms: vec![(R::ZERO, R::ZERO); terms.len()],
        };
        series.set_step(terms, update, step);
        series
    }

    fn set_step(&mut self, terms: &[(f64, f64)], update: PronyUpdate, step: f64) {
        for ((decay, gain), &(weight, time)) in self.terms.iter_mut().zip(terms) {
            let (d, g) = match update {
                PronyUpdate::Exact if step == 0.0 => (1.0, weight),
                PronyUpdate::Exact => {
                    let x = step / time;
                    ((-x).exp(), weight * -(-x).exp_m1() / x)
                }
                PronyUpdate::BackwardEuler => {
                    let decay = time / (step + time);
                    (decay, weight * decay)
                }
            };
            (*decay, *gain) = (R::of(d), R::of(g));
        }
    }

    /// S of one part, and its history advanced in place; `history` is Φⁿ⁻¹ followed by one h per term, each with as many
    /// packs as S has components.
    #[inline(always)]
    fn advance<L: Lanes<R>, const C: usize>(
        &self,
        elastic: [L; C],
        history: &mut [Pack<R>],
        at: usize,
    ) -> [L; C] {
        let (history, _) = history.as_chunks_mut::<C>();
        let Some((previous, terms)) = history.split_first_mut() else {
            return elastic;
        };
        let (mut stress, mut change) = (elastic, elastic);
        for c in 0..C {
            change[c] -= L::load(&previous[c], at);
            elastic[c].store(&mut previous[c], at);
            stress[c] = elastic[c] * L::splat(self.remaining);
        }
        for (h, &(decay, gain)) in terms.iter_mut().zip(&self.terms) {
            let (decay, gain) = (L::splat(decay), L::splat(gain));
            for c in 0..C {
                let now = L::load(&h[c], at).mul_add(decay, change[c] * gain);
                now.store(&mut h[c], at);
                stress[c] += now;
            }
        }
        stress
    }

    fn slots(&self) -> usize {
        if self.terms.is_empty() { 0 } else { 1 + self.terms.len() }
    }
}

impl<R: Real> Relaxation<R> {
    /// Coefficients for steps of `step` seconds.
    pub fn new(prony: &Prony, step: f64) -> Self {
        Self {
            isochoric: Series::new(&prony.isochoric, prony.update, step),
            volumetric: Series::new(&prony.volumetric, prony.update, step),
        }
    }

    /// Those of the isochoric part.
    pub fn isochoric(&self) -> &Series<R> {
        &self.isochoric
    }

    /// Those of the volumetric part.
    pub fn volumetric(&self) -> &Series<R> {
        &self.volumetric
    }

    /// Takes on the coefficients of the same series for steps of `step` seconds.
    pub fn set_step(&mut self, prony: &Prony, step: f64) {
        self.isochoric.set_step(&prony.isochoric, prony.update, step);
        self.volumetric.set_step(&prony.volumetric, prony.update, step);
    }

    /// The isochoric stress [Pa] at the end of the step; `history` has [`Prony::isochoric_slots`] × 6 packs, of which the
    /// lanes from `at` on are advanced.
    #[inline(always)]
    pub fn advance_isochoric<L: Lanes<R>>(
        &self,
        elastic: Symmetric<L>,
        history: &mut [Pack<R>],
        at: usize,
    ) -> Symmetric<L> {
        Symmetric(self.isochoric.advance(elastic.0, history, at))
    }

    /// The pressure [Pa] at the end of the step; `history` has [`Prony::volumetric_slots`] packs.
    #[inline(always)]
    pub fn advance_pressure<L: Lanes<R>>(&self, elastic: L, history: &mut [Pack<R>], at: usize) -> L {
        self.volumetric.advance([elastic], history, at)[0]
    }

    /// The total stress [Pa] at the end of the step from the elastic one, and the history advanced to it.
    /// `history` has [`Prony::slots`] × 6 packs, all zero at rest; none gives the elastic stress.
    #[inline(always)]
    pub fn advance<L: Lanes<R>>(
        &self,
        elastic: Split<Symmetric<L>>,
        history: &mut [Pack<R>],
        at: usize,
    ) -> Symmetric<L> {
        let (isochoric, volumetric) = history.split_at_mut(history.len().min(6 * self.isochoric.slots()));
        Symmetric(self.isochoric.advance(elastic.isochoric.0, isochoric, at))
            + Symmetric(self.volumetric.advance(elastic.volumetric.0, volumetric, at))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(update: PronyUpdate) -> Prony {
        let term = PronyTerm { part: Part::Isochoric, weight: 0.5, time: 0.58 };
        Prony::new(&[term], update).unwrap()
    }

    fn relax(update: PronyUpdate, step: f64, time: f64) -> f64 {
        let prony = series(update);
        let relaxation = Relaxation::<f64>::new(&prony, step);
        let mut history = vec![Pack::ZERO; 6 * prony.slots()];
        let mut stress = 0.0;
        for n in 0..=(time / step).round() as usize {
            let elastic =
                Split { isochoric: Symmetric::IDENTITY * (n as f64 * step), volumetric: Symmetric::ZERO };
            stress = relaxation.advance(elastic, &mut history, 0).0[0];
        }
        stress
    }

    /// S of Φ = t: (1 − a) t + a τ (1 − e^(−t/τ)).
    fn truth(time: f64) -> f64 {
        0.5 * time + 0.5 * 0.58 * (1.0 - (-time / 0.58_f64).exp())
    }

    #[test]
    fn the_exact_update_is_exact_for_a_linear_stress_at_any_step() {
        for step in [0.001, 0.1, 1.0] {
            assert!((relax(PronyUpdate::Exact, step, 1.0) - truth(1.0)).abs() < 1e-12);
        }
    }

    /// S of Φ = 1 from t = 0 on: 1 − a (1 − e^(−t/τ)), for any number of steps.
    #[test]
    fn a_jump_loads_the_instantaneous_law() {
        let prony = series(PronyUpdate::Exact);
        for steps in [1, 4, 64] {
            let mut relaxation = Relaxation::<f64>::new(&prony, 0.0);
            let mut history = vec![Pack::ZERO; 6 * prony.slots()];
            let elastic = Split { isochoric: Symmetric::IDENTITY, volumetric: Symmetric::ZERO };
            assert_eq!(relaxation.advance(elastic, &mut history, 0).0[0], 1.0);
            relaxation.set_step(&prony, 0.5 / f64::from(steps));
            let stress = (0..steps).fold(0.0, |_, _| relaxation.advance(elastic, &mut history, 0).0[0]);
            assert!((stress - (0.5 + 0.5 * (-0.5 / 0.58_f64).exp())).abs() < 1e-14, "{steps}: {stress}");
        }
    }

    #[test]
    fn backward_euler_is_first_order() {
        let error = |step: f64| (relax(PronyUpdate::BackwardEuler, step, 1.0) - truth(1.0)).abs();
        let ratio = error(0.02) / error(0.01);
        assert!((ratio - 2.0).abs() < 0.05, "ratio {ratio}");
    }

    #[test]
    fn weights_that_leave_nothing_are_refused() {
        let term = |weight| PronyTerm { part: Part::Volumetric, weight, time: 1.0 };
        assert!(matches!(
            Prony::new(&[term(0.5), term(0.5)], PronyUpdate::Exact),
            Err(PronyError::Sum { .. })
        ));
        assert!(matches!(Prony::new(&[term(1.0)], PronyUpdate::Exact), Err(PronyError::Term { .. })));
        assert!(Prony::new(&[term(0.5), term(0.4)], PronyUpdate::Exact).is_ok());
    }
}
