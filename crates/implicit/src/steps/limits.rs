//! Limits on the force of tools and moved nodes, in steps of solvers of equations. A tool goes only a part of
//! its way against what it pushes ([`Lag`]). The part falls from 1 at half of the force limit over 0 at the
//! limit to −1, as in explicit steps. The force is taken at the end of the step, so that long steps do not
//! exceed the limit. The part is found by solving the step again: the force grows with the part, so a root
//! lies between −1 and 1. Moved nodes of a constraint do the same together: their force is its reaction, and
//! their way is their mean way.
//!
//! The pressure in a volume rises no further than its limit. The step is solved with the volume prescribed,
//! or with the limit as a load, whichever holds.

use nalgebra::Vector3;
use pliant_contact::lag::Lag;

use crate::model::assembly::Assembly;
use crate::model::error::SolveError;
use crate::model::state::AssemblyState;
use crate::steps::descent::{Contacting, Vectors};
use crate::system::System;

/// Number of times that a step is solved again for the limits of forces.
const TRIES: usize = 12;
/// Tolerance of a part. The force is then off by half as much, relative to its limit.
const FOUND: f64 = 0.02;

/// Initial relative tolerance of a pressure or a volume beyond its limit, since a step ends with a residual.
/// It grows tenfold each time that the other quantity was prescribed in vain.
const BEYOND: f64 = 1e-6;
/// Number of times that the solver may switch between prescribed volume and pressure.
const CHANGES: i32 = 3;

/// The part that a tool or moved nodes go, as it is found.
struct Guess {
    limit: f64,
    /// The force [N] along which its way is shortened.
    ahead: Vector3<f64>,
    part: f64,
    /// Interval that contains the root.
    between: [f64; 2],
    /// The last part, and the difference between the part that its force asks for and this part.
    last: Option<[f64; 2]>,
    /// Distance [m] that it would go against what it pushes.
    into: f64,
}

impl Guess {
    fn new(force: Vector3<f64>, limit: f64) -> Self {
        let part = Lag::part(force.norm(), limit);
        Self { limit, ahead: force, part, between: [-1.0, 1.0], last: None, into: 0.0 }
    }

    /// Takes the force [N] that a part led to; whether it agrees with it.
    fn take(&mut self, force: Vector3<f64>) -> bool {
        if self.ahead == Vector3::zeros() {
            // Nothing was felt before: it went its whole way.
            (self.ahead, self.part) = (force, 1.0);
        } else if self.into == 0.0 {
            return true;
        }
        let [low, high] = &mut self.between;
        let beyond = Lag::part(force.dot(&self.ahead) / self.ahead.norm().max(f64::MIN_POSITIVE), self.limit)
            - self.part;
        if beyond.abs() <= FOUND {
            return true;
        }
        *(if beyond > 0.0 { &mut *low } else { &mut *high }) = self.part;
        let (low, high) = (*low, *high);
        let next = match self.last.replace([self.part, beyond]) {
            Some([part, then]) if then != beyond => self.part - beyond * (self.part - part) / (beyond - then),
            // The force hardly changes, to begin with.
            _ => self.part + beyond,
        };
        self.part = if next > low && next < high { next } else { 0.5 * (low + high) };
        false
    }
}

/// A volume whose pressure is limited.
struct Valve {
    constraint: usize,
    /// The limit [Pa].
    limit: f64,
    /// The pressure [Pa] that is prescribed in place of the volume.
    given: Option<f64>,
    /// Number of switches between prescribed volume and pressure.
    changes: i32,
    /// The pressure [Pa] in the volume, where it was above the limit.
    pressure: Option<f64>,
    /// Excess [m³] of the volume over its curve at the limit.
    ahead: Option<f64>,
}

impl Valve {
    /// Takes a pressure [Pa], the growth that the volume still needs, and the volume at rest [m³]. Returns
    /// true if the prescribed quantity holds.
    fn take(&mut self, [pressure, gap, rest]: [f64; 3]) -> bool {
        let beyond = BEYOND * 10.0_f64.powi(self.changes);
        let holds = match self.given {
            None => pressure.abs() <= self.limit * (1.0 + beyond),
            Some(given) => -gap * given.signum() <= beyond * rest.abs(),
        };
        if !holds {
            match self.given.take() {
                Some(_) => self.ahead = Some(gap.abs()),
                None => {
                    self.pressure = Some(pressure);
                    self.given = Some(self.limit.copysign(pressure));
                }
            }
            self.changes += 1;
        }
        holds
    }

    /// Error at a time [s] if neither the volume nor the limit holds, in a step with inertia or without.
    fn snaps(&self, model: &Assembly, time: f64, inertia: bool) -> SolveError {
        let volume = &model.constraints[self.constraint];
        let (constraint, node) = (volume.name.clone(), volume.nodes[0]);
        let Self { limit, pressure, ahead, .. } = *self;
        SolveError::Snaps { time, constraint, node, limit, pressure, ahead, inertia }
    }

    /// Lag of the volume behind its prescribed value [m³]; 0 if the limit does not hold it back.
    fn lag(&self, gap: f64) -> f64 {
        match self.given {
            Some(given) if gap * given > 0.0 => -gap,
            _ => 0.0,
        }
    }
}

/// Solves a step to a time [s] with tools and moved nodes whose force is limited, and volumes whose pressure
/// is; `solve` solves it from its start with these at their assumed places.
pub(crate) fn within_limits<S: Contacting, T, E: From<SolveError>>(
    solver: &mut S,
    state: &mut AssemblyState,
    time: f64,
    mut solve: impl FnMut(&mut S, &mut AssemblyState) -> Result<T, E>,
) -> Result<T, E> {
    let mut guesses = solver.system_mut().guesses();
    let mut valves = solver.system_mut().valves();
    if guesses.is_empty() && valves.is_empty() {
        return solve(solver, state);
    }
    let start = state.clone();
    let whole = solver.vectors().pending.to_vec();
    let mut tries = TRIES;
    loop {
        let Vectors { system, pending, .. } = solver.vectors();
        pending.copy_from_slice(&whole);
        system.hold_back([start.time, time], &mut guesses, pending);
        valves.iter().for_each(|valve| system.conditions.give_pressure(valve.constraint, valve.given));
        let solved = solve(solver, state)?;
        if !valves.is_empty() && solver.system_mut().contact.is_some() {
            // The last motion of a step in contact was made without finding the residual after it.
            solver.find_residual(state);
        }
        let unkept = solver.system_mut().unkept(&mut valves);
        let mut agree = unkept.is_none();
        if let Some(valve) = unkept.filter(|valve| valve.changes > CHANGES || tries == 0) {
            return Err(valve.snaps(&solver.system_mut().model, time, S::INERTIA).into());
        }
        for (guess, force) in guesses.iter_mut().zip(solver.system_mut().bear_on()) {
            agree &= guess.take(force);
        }
        if agree || tries == 0 {
            return Ok(solved);
        }
        tries -= 1;
        state.clone_from(&start);
    }
}

impl System {
    /// First guesses for the tools, and then the moved nodes, whose force is limited.
    fn guesses(&self) -> Vec<Guess> {
        let tools = self
            .contact
            .iter()
            .flat_map(|contact| contact.lags().iter().map(|lag| (lag, contact.limit(lag))));
        let nodes = self.lags.iter().filter(|lag| !encloses(&self.model, lag));
        let nodes = nodes.map(|lag| (lag, self.model.force_limits[&lag.number()]));
        tools.chain(nodes).map(|(lag, limit)| Guess::new(lag.force(), limit)).collect()
    }

    /// Volumes whose pressure is limited: those that lag have it as a load.
    fn valves(&self) -> Vec<Valve> {
        let enclosing = self.lags.iter().filter(|lag| encloses(&self.model, lag));
        enclosing
            .map(|lag| {
                let (constraint, behind) = (lag.number(), -lag.now().x);
                let limit = self.model.force_limits[&constraint];
                let given = (behind != 0.0).then(|| limit.copysign(behind));
                Valve { constraint, limit, given, changes: 0, pressure: None, ahead: None }
            })
            .collect()
    }

    /// Takes pressures and volumes at the residual last found, and the lags of volumes. Returns the valve
    /// with the most switches among those whose prescribed quantity does not hold.
    fn unkept<'v>(&mut self, valves: &'v mut [Valve]) -> Option<&'v Valve> {
        let lags = self.lags.iter_mut().filter(|lag| encloses(&self.model, lag));
        let mut unkept: Option<&Valve> = None;
        for (lag, valve) in lags.zip(valves) {
            let Some(found) = self.conditions.enclosed(valve.constraint) else { continue };
            lag.stand(Vector3::x() * valve.lag(found[1]));
            if !valve.take(found) && unkept.is_none_or(|other| valve.changes > other.changes) {
                unkept = Some(valve);
            }
        }
        unkept
    }

    /// Finds where they go between two times [s]; increments of prescribed components, six a node, are those
    /// without limits before.
    fn hold_back(&mut self, [from, to]: [f64; 2], guesses: &mut [Guess], pending: &mut [f64]) {
        let moving = self.lags.iter().filter(|lag| !encloses(&self.model, lag)).count();
        let (tools, nodes) = guesses.split_at_mut(guesses.len() - moving);
        if let Some(contact) = &mut self.contact {
            let parts = tools.iter_mut().map(|guess| (guess.ahead, guess.part, &mut guess.into));
            contact.follow([from, to], parts);
        }
        let lags = self.lags.iter_mut().filter(|lag| !encloses(&self.model, lag));
        for (lag, guess) in lags.zip(nodes) {
            let constraint = &self.model.constraints[lag.number()];
            let held = || (0..3).filter(|&c| constraint.components[c]);
            let mut way = Vector3::zeros();
            for at in constraint.nodes.iter().map(|&node| 6 * node as usize) {
                held().for_each(|c| way[c] += pending[at + c] / constraint.nodes.len() as f64);
            }
            guess.into = lag.go(guess.ahead, guess.part, way, to - from);
            let shift = lag.next() - lag.now();
            for at in constraint.nodes.iter().map(|&node| 6 * node as usize) {
                held().for_each(|c| pending[at + c] += shift[c]);
            }
        }
        self.follow(pending);
    }

    /// Gives each lag the force [N] with which its tool or its nodes push at the state last evaluated; these
    /// forces.
    fn bear_on(&mut self) -> Vec<Vector3<f64>> {
        let mut forces = self.contact.as_mut().map(|contact| contact.bear_on()).unwrap_or_default();
        for lag in self.lags.iter_mut().filter(|lag| !encloses(&self.model, lag)) {
            let constraint = &self.model.constraints[lag.number()];
            let mut force = Vector3::zeros();
            for at in constraint.nodes.iter().map(|&node| 6 * node as usize) {
                let held = (0..3).filter(|&c| constraint.components[c]);
                held.for_each(|c| force[c] += self.forces.internal[at + c] - self.forces.external[at + c]);
            }
            lag.found(force);
            forces.push(force);
        }
        forces
    }
}

/// True if a lag belongs to a volume.
fn encloses(model: &Assembly, lag: &Lag) -> bool {
    model.constraints[lag.number()].motion.encloses()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A step that begins at the limit, and whose volume then takes too much: the numbers of both come one
    /// after the other.
    #[test]
    fn a_valve_tells_what_it_found_and_no_more() {
        let mut model = Assembly::new("ball", [Vector3::zeros()]);
        model.model_mut().fix("air", vec![0]);
        let mut valve = Valve {
            constraint: 0,
            limit: 500.0,
            given: Some(-500.0),
            changes: 0,
            pressure: None,
            ahead: None,
        };
        let message = |valve: &Valve, inertia| valve.snaps(&model, 0.5, inertia).to_string();
        assert!(!valve.take([-500.0, 1e-6, 1e-3]));
        let start = "neither the volume of `air` nor its `pressure-limit` of 5.0000e2 Pa can be kept at t = 0.500000: ";
        let ahead = "at the limit the volume is 1.0e-6 m³ beyond its curve. The surface snaps through; try ";
        let advice = "smaller steps or a higher `pressure-limit`";
        assert_eq!(message(&valve, true), format!("{start}{ahead}{advice}"));
        assert!(!valve.take([-600.0, 0.0, 1e-3]));
        let pressure = "the volume needs -6.0000e2 Pa, and ";
        assert_eq!(
            message(&valve, false),
            format!("{start}{pressure}{ahead}the solver `implicit`, {advice}")
        );
    }
}
