//! Running a model, as a test does it: what fails, panics.

use pliant_explicit::critical_step::assembled;
use pliant_explicit::stability::{Monitor, OnUnstable};
use pliant_explicit::{CentralDifference, DynamicRelaxation, Scalar, State, StepError};
use pliant_mechanics::Model;
use pliant_reproduce::{CaseError, Equilibrium, run_on};

/// See [`pliant_reproduce::run`].
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
    pliant_reproduce::run(model, step, until, observe).map_err(|error| match error {
        CaseError::Step(error) => error,
        other => panic!("{other}"),
    })
}

/// The same with a monitor of the stable step, whose limit at rest is the true one.
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
    let stepper = CentralDifference::new(model.clone(), step).unwrap_or_else(|error| panic!("{error}"));
    stepper.watched(Monitor::new(model, limit, on_unstable))
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
pub fn relax(model: &Model) -> (DynamicRelaxation<f64>, State<f64>) {
    pliant_reproduce::relax(model).unwrap_or_else(|error| panic!("{error}"))
}
