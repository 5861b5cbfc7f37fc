//! The steps of a participant.

use pliant_explicit::critical_step::{CriticalStep, ElementBound, assembled, element_bound};
use pliant_mechanics::Model;
use pliant_mechanics::model::Contradiction;

/// Fraction of the critical time step of the assembled model that an automatic step takes.
pub const SAFETY: f64 = 0.9;

/// Steps from the start on.
#[derive(Clone, Debug, PartialEq)]
pub struct Steps {
    /// Length of a step [s]. Of unequal load steps the mean.
    pub step: f64,
    /// Number of steps: for the numbers of load steps, and the parts of a load that is controlled.
    pub number: u64,
    /// Times [s] at which load steps end, if they are not equal.
    pub ends: Option<Vec<f64>>,
}

impl Steps {
    /// Makes equal steps of a duration [s], each as long as `longest` [s] or shorter.
    pub fn within(duration: f64, longest: f64) -> Self {
        let number = (duration / longest - 1e-9).ceil().max(1.0);
        Self { step: duration / number, number: number as u64, ends: None }
    }

    /// Makes their number a multiple of a common one, within the same duration [s].
    pub fn meet(&mut self, common: u64, duration: f64) {
        if !self.number.is_multiple_of(common) {
            self.number = common * self.number.div_ceil(common);
            self.step = duration / self.number as f64;
        }
    }

    /// The end [s] of the step of a number, counted from 1.
    pub fn end_of(&self, number: u64) -> f64 {
        let given_end = self.ends.as_ref().and_then(|ends| ends.get(number as usize - 1));
        given_end.copied().unwrap_or(number as f64 * self.step)
    }

    /// The number, counted from 1, of the step that begins at a time [s].
    pub fn number_from(&self, time: f64) -> u64 {
        match &self.ends {
            Some(ends) => ends.partition_point(|&end| end <= time) as u64 + 1,
            None => (time / self.step).round() as u64 + 1,
        }
    }

    /// The length [s] of the step that begins at a time [s]; at the end, of the last one.
    pub fn step_from(&self, time: f64) -> f64 {
        let Some(ends) = &self.ends else { return self.step };
        let number = self.number_from(time).min(ends.len() as u64);
        let before = if number > 1 { self.end_of(number - 1) } else { 0.0 };
        self.end_of(number) - before
    }
}

/// The critical time step of the solids of a model at rest.
#[derive(Clone, Debug)]
pub struct Critical {
    /// The smallest element bound.
    pub bound: ElementBound,
    /// Critical step of the assembled model.
    pub assembled: CriticalStep,
}

impl Critical {
    /// Computes the critical steps of a model; `None` without cells.
    ///
    /// # Errors
    /// If constraints contradict one another.
    pub fn of(model: &Model) -> Result<Option<Self>, Contradiction> {
        let Some(bound) = element_bound(model) else { return Ok(None) };
        Ok(Some(Self { bound, assembled: assembled(model)? }))
    }

    /// The automatic step [s]: [`SAFETY`] of the critical one. If every node is held there is no limit, and
    /// the element bound replaces it.
    pub fn automatic(&self) -> f64 {
        let limit = self.assembled.step;
        SAFETY * if limit.is_finite() { limit } else { self.bound.step }
    }
}
