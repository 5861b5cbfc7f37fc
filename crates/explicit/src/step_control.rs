//! Steps against the largest stable one: watches the limit, cuts steps into parts, and keeps the clock.

use pliant_mechanics::count;
use pliant_mechanics::model::Model;
use serde::{Deserialize, Serialize};

use crate::critical_step::limit_about;
use crate::damping_force::{damped, undamped};
use crate::forces::{Deformed, InternalForces};
use crate::lanes::LaneNumber;
use crate::stability::{CHANGE, CHECK_EVERY, Monitor, OnUnstable, StepLimit};
use crate::state::State;
use crate::step_error::StepError;
use crate::substeps::{REJOIN_AFTER, RESERVE, substeps};

/// Lengths of the (sub)steps at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lengths {
    /// Length Δt⁻ of the (sub)step before [s].
    pub before: f64,
    /// Length Δt⁺ of the (sub)step to come [s].
    pub next: f64,
}

impl Lengths {
    /// Δt⁺/Δt⁻; exactly 1 where they are equal.
    pub fn ratio(self) -> f64 {
        self.next / self.before
    }

    /// h = (Δt⁻ + Δt⁺)/2 [s].
    pub fn mean(self) -> f64 {
        0.5 * (self.before + self.next)
    }

    /// The part Δt⁺/(2 h) of a force that moves a node in the first step; the rest is in the increment before
    /// that step.
    pub(crate) fn first_part(self) -> f64 {
        0.5 * self.next / self.mean()
    }

    /// The velocity [m/s] at the instant, v⁻ + ½ Δt⁻ a, from the increments [m] before and after it.
    pub fn velocity(self, before: f64, after: f64) -> f64 {
        (before * self.ratio() + after / self.ratio()) / (2.0 * self.mean())
    }

    /// The energy [J] that the change of the length adds, from ⅛ Δt⁻² Σ m|a|² [J].
    pub fn change_energy(self, error: f64) -> f64 {
        if self.next == self.before { 0.0 } else { (1.0 - self.ratio() * self.ratio()) * error }
    }
}

/// Data to continue a run with steps of another length.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Clock {
    /// Time [s] from which whole steps are counted …
    pub since: f64,
    /// … and those done before.
    #[serde(deserialize_with = "count::read")]
    pub steps: u64,
    /// Length of the (sub)step that led to the state's instant [s].
    pub before: f64,
}

/// Whole steps of one length, cut where the limit asks for it.
pub struct StepControl {
    step: f64,
    /// Time [s] and number from which whole steps are counted.
    since: (f64, u64),
    /// The length [s] of the (sub)step before, where it was no part of such a step.
    before: Option<f64>,
    monitor: Option<Monitor>,
    /// Parts of the step to come.
    substeps: u32,
}

impl StepControl {
    /// Steps of `step` seconds, not watched.
    pub fn new(step: f64) -> Self {
        Self { step, since: (0.0, 0), before: None, monitor: None, substeps: 1 }
    }

    /// Returns the clock with which another control continues from a state.
    pub fn clock<R>(&self, state: &State<R>) -> Clock {
        let (since, steps) = self.since;
        Clock { since, steps, before: self.lengths(state).before }
    }

    /// Continues from a state where another control, with steps of length `step` [s], has stood. Steps of the
    /// same length are counted on.
    pub fn go_on<R>(&mut self, clock: &Clock, step: f64, state: &State<R>) {
        self.since = if step == self.step { (clock.since, clock.steps) } else { (state.time, state.steps) };
        self.before = Some(clock.before);
    }

    /// Watches the limit from now on.
    pub fn watch(&mut self, monitor: Monitor) {
        self.monitor = Some(monitor);
    }

    /// Passes over a check that is due, if it would leave the steps as they are.
    pub fn pass<R>(&self, state: &mut State<R>, deformed: &Deformed) -> bool {
        let (Some(monitor), Some(look)) = (&self.monitor, state.stability.last) else { return false };
        let (step, parts) = self.parts(state);
        let rejoins = state.steps >= state.stability.needed_at.saturating_add(REJOIN_AFTER)
            && substeps(step, look.limit, parts) != Some(parts);
        let plain = state.stability.foresight.covers(state.steps, deformed, step, parts)
            && !monitor.doubts(state, look.limit, step, parts)
            && !rejoins;
        if plain {
            state.stability.pass(*deformed, state.steps);
        }
        plain
    }

    /// The length [s] of a whole step.
    pub fn step(&self) -> f64 {
        self.step
    }

    /// The step [s] as it was halved, and the parts of it that the step to come has.
    fn parts<R>(&self, state: &State<R>) -> (f64, u32) {
        let halves = 1 << state.stability.halvings;
        (self.step / f64::from(halves), (self.substeps / halves).max(1))
    }

    /// Parts of the step to come.
    pub fn substeps(&self) -> u32 {
        self.substeps
    }

    /// Keeps, for the step to come, the parts of the one before.
    pub fn keep<R>(&mut self, state: &State<R>) {
        self.substeps = state.stability.substeps;
    }

    /// The (sub)step before the state's instant and the one to come.
    pub fn lengths<R>(&self, state: &State<R>) -> Lengths {
        let part = |parts: u32| self.step / f64::from(parts);
        let before = self.before.unwrap_or_else(|| part(state.stability.substeps));
        Lengths { before, next: part(self.substeps) }
    }

    /// Returns the time [s] over which relaxing laws come to the state's instant. It is zero at the start,
    /// where loads came at once, and where forces were found before.
    pub fn relaxing<R: LaneNumber>(&self, state: &State<R>) -> f64 {
        if state.is_at_start() || state.evaluated { 0.0 } else { self.lengths(state).before }
    }

    /// True if a check of the limit is due: the first one, `CHECK_EVERY` steps after the last, or where the
    /// deformation differs.
    pub fn is_due<R>(&self, state: &State<R>, deformed: &Deformed) -> bool {
        let seen = &state.stability;
        self.monitor.is_some()
            && (seen.checks == 0
                || !state.evaluated
                    && (state.steps >= seen.checked_at.saturating_add(CHECK_EVERY)
                        || deformed.differs(&seen.deformed, CHANGE)))
    }

    /// Returns the number of steps, at least one, that pass over no check of the limit. The deformation is
    /// assumed to change as it did within the last `steps` steps. Only half of the steps to its next check
    /// are counted, so that a faster change is not missed either.
    pub fn steps_to_check<R>(
        &self,
        state: &State<R>,
        now: &Deformed,
        (before, steps): (&Deformed, u64),
    ) -> u64 {
        if self.monitor.is_none() {
            return u64::MAX;
        }
        let seen = &state.stability;
        let counted = seen.checked_at.saturating_add(CHECK_EVERY).saturating_sub(state.steps);
        let left = (CHANGE / now.change(&seen.deformed)).ln();
        let rate = now.change(before).ln() / steps.max(1) as f64;
        let deformed = if rate > 0.0 { (0.5 * left / rate) as u64 } else { u64::MAX };
        counted.min(deformed).max(1)
    }

    /// Looks at the limit of a state in single precision, as a GPU steps it.
    pub fn look(&mut self, model: &Model, owners: &[[u32; 3]], state: &mut State<f32>, deformed: &Deformed) {
        self.look_with(model, owners, None, state, deformed);
    }

    /// Looks at the limit as [`look`](Self::look) does, with the `forces` of the state, which are kept.
    pub(crate) fn look_with<R: LaneNumber>(
        &mut self,
        model: &Model,
        owners: &[[u32; 3]],
        forces: Option<&mut InternalForces<R>>,
        state: &mut State<R>,
        deformed: &Deformed,
    ) {
        let (step, parts) = self.parts(state);
        let Some(monitor) = &mut self.monitor else { return };
        monitor.refer_to(state);
        if let Some((mut limit, solid, cell)) = monitor.limit(model, &state.displacement, &state.reference) {
            if monitor.doubts(state, limit, step, parts) {
                limit = take_as_reference(model, owners, forces, state, step / RESERVE);
            }
            let look = StepLimit { time: state.time, limit, solid, cell };
            state.stability.note(look, *deformed, state.steps);
        }
    }

    /// Chooses the parts of the step that begins now, from the last look.
    ///
    /// # Errors
    /// If the step is above the limit and must not be cut, or not as finely as needed.
    pub fn choose<R>(&mut self, model: &Model, state: &mut State<R>) -> Result<(), StepError> {
        let (Some(monitor), Some(look)) = (&self.monitor, state.stability.last) else { return Ok(()) };
        let below = || Err(StepError::below_limit(model, &look, self.step, state.time));
        match monitor.on_unstable() {
            OnUnstable::Report => {}
            OnUnstable::Stop if look.limit < self.step => return below(),
            OnUnstable::Stop => {}
            OnUnstable::Substep => {
                let (step, now) = self.parts(state);
                let Some(mut parts) = substeps(step, look.limit, now) else { return below() };
                let seen = &mut state.stability;
                if parts >= now {
                    seen.needed_at = state.steps;
                } else if state.steps < seen.needed_at.saturating_add(REJOIN_AFTER) {
                    parts = now;
                }
                self.substeps = parts << seen.halvings;
            }
        }
        Ok(())
    }

    /// Notes that a whole step begins, once.
    pub fn note<R>(&self, state: &mut State<R>) {
        if state.evaluated {
            return;
        }
        let (Some(_), Some(look)) = (&self.monitor, state.stability.last) else { return };
        state.stability.steps_below += u64::from(look.limit < self.step);
        state.stability.note_substeps(self.substeps, state.time);
    }

    /// Moves the clock of a state on by the (sub)step to come.
    pub fn count<R>(&mut self, state: &mut State<R>) {
        let known = state.stability.extrapolation.is_some();
        state.stability.extrapolation = Some(if known { self.lengths(state).ratio() } else { 0.0 });
        self.before = None;
        state.evaluated = false;
        state.stability.substeps = self.substeps;
        state.stability.done += 1;
        if state.stability.done == self.substeps {
            state.stability.done = 0;
            state.steps += 1;
        }
        let part = f64::from(state.stability.done) / f64::from(self.substeps);
        let (since, steps) = self.since;
        state.time = since + ((state.steps - steps) as f64 + part) * self.step;
    }
}

/// Finds the critical time step [s] of a state, at least whether it is `enough`, and makes it the reference
/// of what follows.
fn take_as_reference<R: LaneNumber>(
    model: &Model,
    owners: &[[u32; 3]],
    forces: Option<&mut InternalForces<R>>,
    state: &mut State<R>,
    enough: f64,
) -> f64 {
    let damping = model.stiffness_damping;
    let enough = undamped(enough, damping);
    let limit = limit_about(model, owners, forces, &state.displacement, enough);
    state.reference.clone_from(&state.displacement);
    state.stability.reference = Some((limit, state.steps));
    state.stability.critical_steps += 1;
    damped(limit, damping)
}
