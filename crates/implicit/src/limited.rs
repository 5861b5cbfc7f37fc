//! Tools and moved nodes that push with no more than a force, in steps of solvers of equations. Of the way against what it pushes a tool goes a part that falls from
//! 1 at half of its limit over 0 at the limit to −1 ([`Lag`]), as in explicit steps; but the force is that at the end of the step, so that long steps do not go beyond
//! the limit. The part is found by solving the step again: the force grows with it, so a root lies between −1 and 1. Moved nodes of a constraint do the same
//! together: their force is its reaction, their way the mean of theirs.

use nalgebra::Vector3;
use pliant_contact::lag::Lag;

use crate::descent::{Contacting, Vectors};
use crate::state::State;
use crate::system::System;

/// How often a step is solved again for the limits of forces.
const TRIES: usize = 12;
/// How far a part may be off: by this the force is off by half as much of its limit.
const FOUND: f64 = 0.02;

/// The part that a tool or moved nodes go, as it is found.
struct Guess {
    limit: f64,
    /// The force [N] along which its way is shortened.
    ahead: Vector3<f64>,
    part: f64,
    /// Where the root is.
    between: [f64; 2],
    /// The last part, and what the force then asks for beyond it.
    last: Option<[f64; 2]>,
    /// How far [m] it would go against what it pushes.
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

/// Solves a step to a time [s] with tools and moved nodes whose force is limited; `solve` solves it from its start with these at their assumed
/// places.
pub(crate) fn within_limits<S: Contacting, T, E>(
    solver: &mut S,
    state: &mut State,
    time: f64,
    mut solve: impl FnMut(&mut S, &mut State) -> Result<T, E>,
) -> Result<T, E> {
    let mut guesses = solver.system().guesses();
    if guesses.is_empty() {
        return solve(solver, state);
    }
    let start = state.clone();
    let whole = solver.vectors().pending.to_vec();
    let mut tries = TRIES;
    loop {
        let Vectors { system, pending, .. } = solver.vectors();
        pending.copy_from_slice(&whole);
        system.hold_back([start.time, time], &mut guesses, pending);
        let solved = solve(solver, state)?;
        let mut agree = true;
        for (guess, force) in guesses.iter_mut().zip(solver.system().bear_on()) {
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
    /// What tools, and then moved nodes, whose force is limited are to go.
    fn guesses(&self) -> Vec<Guess> {
        let tools = self.touching.iter().flat_map(|own| own.lags().iter().map(|lag| (lag, own.limit(lag))));
        let nodes = self.lags.iter().map(|lag| (lag, self.model.force_limits[&lag.number()]));
        tools.chain(nodes).map(|(lag, limit)| Guess::new(lag.force(), limit)).collect()
    }

    /// Finds where they go between two times [s]; increments of prescribed components, six a node, are those without limits before.
    fn hold_back(&mut self, [from, to]: [f64; 2], guesses: &mut [Guess], pending: &mut [f64]) {
        let (tools, nodes) = guesses.split_at_mut(guesses.len() - self.lags.len());
        if let Some(touching) = &mut self.touching {
            let parts = tools.iter_mut().map(|guess| (guess.ahead, guess.part, &mut guess.into));
            touching.follow([from, to], parts);
        }
        for (lag, guess) in self.lags.iter_mut().zip(nodes) {
            let own = &self.model.constraints[lag.number()];
            let held = || (0..3).filter(|&c| own.components[c]);
            let mut way = Vector3::zeros();
            for at in own.nodes.iter().map(|&node| 6 * node as usize) {
                held().for_each(|c| way[c] += pending[at + c] / own.nodes.len() as f64);
            }
            guess.into = lag.go(guess.ahead, guess.part, way, to - from);
            let shift = lag.next() - lag.now();
            for at in own.nodes.iter().map(|&node| 6 * node as usize) {
                held().for_each(|c| pending[at + c] += shift[c]);
            }
        }
        self.follow(pending);
    }

    /// Gives each lag the force [N] with which its tool or its nodes push at the state last evaluated; these forces.
    fn bear_on(&mut self) -> Vec<Vector3<f64>> {
        let mut forces = self.touching.as_mut().map(|own| own.bear_on()).unwrap_or_default();
        for lag in &mut self.lags {
            let own = &self.model.constraints[lag.number()];
            let mut force = Vector3::zeros();
            for at in own.nodes.iter().map(|&node| 6 * node as usize) {
                let held = (0..3).filter(|&c| own.components[c]);
                held.for_each(|c| force[c] += self.internal[at + c] - self.external[at + c]);
            }
            lag.found(force);
            forces.push(force);
        }
        forces
    }
}
