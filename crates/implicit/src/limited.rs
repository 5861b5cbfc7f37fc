//! Tools that push with no more than a force, in steps of solvers of equations. Of the way against what it pushes a tool goes a part that falls from
//! 1 at half of its limit over 0 at the limit to −1 ([`Lag`]), as in explicit steps; but the force is that at the end of the step, so that long steps do not go beyond
//! the limit. The part is found by solving the step again: the force grows with it, so a root lies between −1 and 1.

use nalgebra::Vector3;
use pliant_contact::lag::Lag;

use crate::descent::Contacting;
use crate::error::SolveError;
use crate::state::State;

/// How often a step is solved again for the limits of forces.
const TRIES: usize = 12;
/// How far a part may be off: by this the force is off by half as much of its limit.
const FOUND: f64 = 0.02;

/// The part that a tool goes, as it is found.
struct Guess {
    limit: f64,
    /// The force [N] along which its way is shortened.
    ahead: Vector3<f64>,
    part: f64,
    /// Where the root is.
    between: [f64; 2],
    /// The last part, and what the force then asks for beyond it.
    last: Option<[f64; 2]>,
    /// How far [m] the tool would go against what it pushes.
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

/// Solves a step to a time [s] with tools whose force is limited; `solve` solves it from its start with tools at their assumed places.
pub(crate) fn within_limits<S: Contacting, T>(
    solver: &mut S,
    state: &mut State,
    time: f64,
    mut solve: impl FnMut(&mut S, &mut State) -> Result<T, SolveError>,
) -> Result<T, SolveError> {
    let Some(touching) = solver.system().touching.as_mut().filter(|touching| !touching.lags().is_empty())
    else {
        return solve(solver, state);
    };
    let mut guesses: Vec<Guess> =
        touching.lags().iter().map(|lag| Guess::new(lag.force(), touching.limit(lag))).collect();
    let start = state.clone();
    let pending = solver.vectors().pending.to_vec();
    let mut tried = 0;
    loop {
        if let Some(touching) = &mut solver.system().touching {
            touching.follow(
                [start.time, time],
                guesses.iter_mut().map(|guess| (guess.ahead, guess.part, &mut guess.into)),
            );
        }
        let solved = solve(solver, state)?;
        let Some(touching) = &mut solver.system().touching else { return Ok(solved) };
        let mut agree = true;
        for (guess, force) in guesses.iter_mut().zip(touching.bear_on()) {
            agree &= guess.take(force);
        }
        if agree || tried == TRIES {
            return Ok(solved);
        }
        tried += 1;
        state.clone_from(&start);
        solver.vectors().pending.copy_from_slice(&pending);
    }
}
