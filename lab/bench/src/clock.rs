//! Timing of steps.

use std::sync::Arc;
use std::time::Instant;

use pliant_explicit::{CentralDifference, Instructions, MissingInstructions, Scalar, State, StepError};
use pliant_gpu::{Design, Device, GpuError, GpuStepper, StepFailure};
use pliant_mechanics::Model;
use pliant_mechanics::model::Contradiction;

/// A model that can be timed.
pub trait Timed {
    /// Error of a step.
    type Error;

    /// Duration of the warm-up [s]: steps are taken until a batch takes a quarter of this time.
    const WARM_UP: f64;

    /// Takes some steps, at least one; returns the wall time of one [s].
    ///
    /// # Errors
    /// If a step fails.
    fn seconds_per_step(&mut self, steps: usize) -> Result<f64, Self::Error>;

    /// The number of steps that take `seconds` of wall time, found by stepping, which also warms
    /// up.
    ///
    /// # Errors
    /// If a step fails.
    fn steps_within(&mut self, seconds: f64) -> Result<usize, Self::Error> {
        let mut steps = 1;
        loop {
            let each = self.seconds_per_step(steps)?;
            let enough = (seconds / each.max(f64::MIN_POSITIVE)).ceil();
            if each * steps as f64 >= 0.25 * seconds {
                return Ok((enough as usize).max(1));
            }
            // Steps grow towards the quarter by at most a factor of four, since the first steps are slow.
            steps = (0.3 * enough).min(4.0 * steps as f64).ceil() as usize;
        }
    }
}

/// A model under the clock: a stepper and the state that it steps.
pub struct Clocked<R> {
    stepper: CentralDifference<R>,
    state: State<R>,
}

impl<R: Scalar> Clocked<R> {
    /// A state of a model, to be advanced by steps of `step` seconds.
    ///
    /// # Errors
    /// If constraints contradict each other.
    pub fn new(model: impl Into<Arc<Model>>, step: f64, state: State<R>) -> Result<Self, Contradiction> {
        Ok(Self { stepper: CentralDifference::new(model, step)?.dissipating(), state })
    }

    /// Uses the lanes of given instructions instead of the widest.
    ///
    /// # Errors
    /// If the CPU does not have them.
    pub fn in_lanes(self, instructions: Instructions) -> Result<Self, MissingInstructions> {
        Ok(Self { stepper: self.stepper.in_lanes(instructions)?, ..self })
    }
}

/// Steps run on the current rayon pool.
impl<R: Scalar> Timed for Clocked<R> {
    type Error = StepError;
    const WARM_UP: f64 = 0.0;

    fn seconds_per_step(&mut self, steps: usize) -> Result<f64, StepError> {
        let steps = steps.max(1);
        let started = Instant::now();
        for _ in 0..steps {
            self.stepper.evaluate(&mut self.state)?;
            self.stepper.advance(&mut self.state);
        }
        Ok(started.elapsed().as_secs_f64() / steps as f64)
    }
}

/// A timed model on a GPU.
pub struct ClockedOnDevice {
    device: Device,
    stepper: GpuStepper,
    state: State<f32>,
}

impl ClockedOnDevice {
    /// A state of a model, to be advanced by steps of `step` seconds.
    ///
    /// # Errors
    /// If the device can't take the model.
    pub fn new(
        device: &Device,
        model: impl Into<Arc<Model>>,
        step: f64,
        design: Design,
        state: State<f32>,
    ) -> Result<Self, GpuError> {
        let mut stepper = GpuStepper::new(device, model, step, Some(design))?;
        stepper.upload(&state);
        Ok(Self { device: device.clone(), stepper, state })
    }
}

/// The stepper's occasional read-backs are part of the cost of steps.
impl Timed for ClockedOnDevice {
    type Error = StepFailure;
    const WARM_UP: f64 = 2.0;

    fn seconds_per_step(&mut self, steps: usize) -> Result<f64, StepFailure> {
        let steps = steps.max(1);
        let started = Instant::now();
        self.stepper.advance(&mut self.state, steps as u64)?;
        self.device.wait()?;
        Ok(started.elapsed().as_secs_f64() / steps as f64)
    }
}

/// The middle of repeats and how far they lie apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// The median, of an even number the upper one; not a number without values.
    pub median: f64,
    /// The smallest.
    pub least: f64,
    /// The largest.
    pub most: f64,
}

impl Spread {
    /// Returns the spread of some values.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let mut values: Vec<f64> = values.into_iter().collect();
        values.sort_unstable_by(f64::total_cmp);
        let at = |place: usize| values.get(place).copied().unwrap_or(f64::NAN);
        Self { median: at(values.len() / 2), least: at(0), most: at(values.len().saturating_sub(1)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spread_does_not_depend_on_the_order() {
        let spread = Spread::of([3.0, 1.0, 9.0, 2.0, 4.0]);
        assert_eq!(spread, Spread { median: 3.0, least: 1.0, most: 9.0 });
        assert!(Spread::of([]).median.is_nan());
    }
}
