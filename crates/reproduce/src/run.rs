//! Running a model from rest, through its history or to its equilibrium.

use pliant_explicit::{
    CentralDifference, DynamicRelaxation, Observable, RelaxationSettings, Scalar, State, StepError,
};
use pliant_mechanics::Model;
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::tensor::{Vector, dot};

use crate::CaseError;

/// Steps a model from rest to a time [s], both ends included. `observe` sees every instant once its forces, reactions
/// and energies are known. Returns the last instant.
///
/// # Errors
/// If a step fails or constraints contradict each other.
pub fn run<R: Scalar>(
    model: &Model,
    step: f64,
    until: f64,
    observe: impl FnMut(&CentralDifference<R>, &State<R>),
) -> Result<(CentralDifference<R>, State<R>), CaseError> {
    Ok(run_on(CentralDifference::new(model.clone(), step)?, State::at_rest(model), until, observe)?)
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

/// A state that has come to rest.
pub struct Equilibrium {
    /// The stepper, for its reactions.
    pub stepper: CentralDifference<f64>,
    /// The state.
    pub state: State<f64>,
    /// The largest displacement of a node [m].
    pub largest: f64,
}

/// Applies the loads and motions of a damped model within `until` seconds and checks that it has come to rest. At its
/// largest final speed, no node may move by more than 1e-7 of the largest displacement in a tenth of a second. The
/// slowest overdamped vibration of these models decays at least by e in this time.
///
/// # Errors
/// If a step fails or the model still moves.
pub fn settle(model: &Model, step: f64, until: f64) -> Result<Equilibrium, CaseError> {
    let (stepper, state) = run(model, step, until, |_, _| ())?;
    let length = |v: Vector<f64>| dot(v, v).sqrt();
    let largest = state.displacement.iter().map(|&u| length(u)).fold(0.0, f64::max);
    let speed =
        (0..model.node_count()).map(|node| length(stepper.velocity(&state, node))).fold(0.0, f64::max);
    let creep = 0.1 * speed / largest;
    if creep < 1e-7 {
        Ok(Equilibrium { stepper, state, largest })
    } else {
        Err(CaseError::Moving { until, creep })
    }
}

/// The equilibrium at 1 s, computed in one load step by dynamic relaxation to a residual of 1e-8 of the largest
/// force.
///
/// # Errors
/// If none exists.
pub fn relax(model: &Model) -> Result<(DynamicRelaxation<f64>, State<f64>), CaseError> {
    let settings = RelaxationSettings { tolerance: 1e-8, ..RelaxationSettings::default() };
    let mut solver = DynamicRelaxation::new(model.clone(), settings)?;
    let mut state = State::at_rest(model);
    solver.solve(&mut state, 1.0)?;
    Ok((solver, state))
}

/// From 0 at the start to 1 at a time [s], with a continuous velocity.
pub fn smooth_step(to: f64) -> Curve {
    Curve { shape: Shape::SmoothStep, from: 0.0, to }
}
