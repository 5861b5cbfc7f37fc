//! The coefficients of a Prony series ([`pliant_mechanics::prony`]) for one step size, and histories advanced
//! by them in lanes.

use pliant_mechanics::law::Split;
use pliant_mechanics::prony::{Prony, PronyUpdate};
use pliant_mechanics::tensor::Symmetric;

use crate::lanes::LaneNumber;
use crate::lanes::{Lanes, Pack};

/// The coefficients of a series for one step size.
#[derive(Clone, Debug)]
pub struct Relaxation<R> {
    isochoric: Series<R>,
    volumetric: Series<R>,
}

/// Coefficients of one part.
#[derive(Clone, Debug)]
pub struct Series<R> {
    /// 1 − Σ a.
    pub remaining: R,
    /// (d, g) per term.
    pub terms: Vec<(R, R)>,
}

impl<R: LaneNumber> Series<R> {
    fn new(terms: &[(f64, f64)], update: PronyUpdate, step: f64) -> Self {
        let mut series = Self {
            remaining: R::of(1.0 - terms.iter().map(|(weight, _)| weight).sum::<f64>()),
            terms: vec![(R::ZERO, R::ZERO); terms.len()],
        };
        series.set_step(terms, update, step);
        series
    }

    fn set_step(&mut self, terms: &[(f64, f64)], update: PronyUpdate, step: f64) {
        for ((decay, gain), &term) in self.terms.iter_mut().zip(terms) {
            let (d, g) = update.coefficients(term, step);
            (*decay, *gain) = (R::of(d), R::of(g));
        }
    }

    /// S of one part, and its history advanced in place; `history` is Φⁿ⁻¹ followed by one h per term, each
    /// with as many packs as S has components.
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

impl<R: LaneNumber> Relaxation<R> {
    /// Coefficients for steps of `step` seconds.
    pub fn new(prony: &Prony, step: f64) -> Self {
        Self {
            isochoric: Series::new(&prony.isochoric, prony.update, step),
            volumetric: Series::new(&prony.volumetric, prony.update, step),
        }
    }

    /// Returns the coefficients of the isochoric part.
    pub fn isochoric(&self) -> &Series<R> {
        &self.isochoric
    }

    /// Returns the coefficients of the volumetric part.
    pub fn volumetric(&self) -> &Series<R> {
        &self.volumetric
    }

    /// Sets the coefficients of the same series for steps of `step` seconds.
    pub fn set_step(&mut self, prony: &Prony, step: f64) {
        self.isochoric.set_step(&prony.isochoric, prony.update, step);
        self.volumetric.set_step(&prony.volumetric, prony.update, step);
    }

    /// The isochoric stress [Pa] at the end of the step; `history` has [`Prony::isochoric_slots`] × 6 packs,
    /// of which the lanes from `at` on are advanced.
    #[inline(always)]
    pub(crate) fn advance_isochoric<L: Lanes<R>>(
        &self,
        elastic: Symmetric<L>,
        history: &mut [Pack<R>],
        at: usize,
    ) -> Symmetric<L> {
        Symmetric(self.isochoric.advance(elastic.0, history, at))
    }

    /// The pressure [Pa] at the end of the step; `history` has [`Prony::volumetric_slots`] packs.
    #[inline(always)]
    pub(crate) fn advance_pressure<L: Lanes<R>>(&self, elastic: L, history: &mut [Pack<R>], at: usize) -> L {
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
    use pliant_mechanics::prony::{Part, PronyTerm};

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
}
