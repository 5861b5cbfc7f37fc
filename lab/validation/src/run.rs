//! Running a model in a test: failures panic. Tests that read the explicit stepper's own state, errors and
//! cut steps step it themselves; equilibria come from a simulation.

use pliant_explicit::critical_step::assembled;
use pliant_explicit::stability::{Monitor, OnUnstable};
use pliant_explicit::{CentralDifference, Scalar, State, StepError};
use pliant_mechanics::Model;
use pliant_reproduce::Equilibrium;

/// Steps a model from rest to a time [s], both ends included. `observe` sees every instant once its forces,
/// reactions and energies are known. Returns the last instant.
///
/// # Errors
/// If a step fails.
///
/// # Panics
/// If constraints contradict each other.
pub fn run<R: Scalar>(
    model: &Model,
    step: f64,
    until: f64,
    observe: impl FnMut(&CentralDifference<R>, &State<R>),
) -> Result<(CentralDifference<R>, State<R>), StepError> {
    run_on(stepper(model, step), State::at_rest(model), until, observe)
}

/// Steps a state to a time [s], both ends included.
///
/// # Errors
/// If a step fails.
pub fn run_on<R: Scalar>(
    mut stepper: CentralDifference<R>,
    mut state: State<R>,
    until: f64,
    mut observe: impl FnMut(&CentralDifference<R>, &State<R>),
) -> Result<(CentralDifference<R>, State<R>), StepError> {
    loop {
        stepper.evaluate(&mut state)?;
        observe(&stepper, &state);
        if state.time >= until {
            return Ok((stepper, state));
        }
        stepper.advance(&mut state);
    }
}

fn stepper<R: Scalar>(model: &Model, step: f64) -> CentralDifference<R> {
    CentralDifference::new(model.clone(), step).unwrap_or_else(|error| panic!("{error}"))
}

/// Runs like [`run`], with a monitor of the stable step whose limit at rest is the true one.
///
/// # Errors
/// If a step fails.
///
/// # Panics
/// If constraints contradict each other.
pub fn run_watched<R: Scalar>(
    model: &Model,
    step: f64,
    on_unstable: OnUnstable,
    until: f64,
    observe: impl FnMut(&CentralDifference<R>, &State<R>),
) -> Result<(CentralDifference<R>, State<R>), StepError> {
    run_on(watched(model, step, on_unstable), State::at_rest(model), until, observe)
}

/// A stepper with a monitor whose limit at rest is the true one.
///
/// # Panics
/// If constraints contradict each other.
pub fn watched<R: Scalar>(model: &Model, step: f64, on_unstable: OnUnstable) -> CentralDifference<R> {
    let limit = assembled(model).unwrap_or_else(|error| panic!("{error}")).step;
    stepper(model, step).watched(Monitor::new(model, limit, on_unstable))
}

/// See [`pliant_reproduce::settle`].
///
/// # Panics
/// If a step fails or the model still moves.
pub fn settle(model: &Model, step: f64, until: f64) -> Equilibrium {
    pliant_reproduce::settle(model, step, until).unwrap_or_else(|error| panic!("{error}"))
}

/// See [`pliant_reproduce::relax`].
///
/// # Panics
/// If there is no equilibrium.
pub fn relax(model: &Model) -> Equilibrium {
    pliant_reproduce::relax(model).unwrap_or_else(|error| panic!("{error}"))
}
