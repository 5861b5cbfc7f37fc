//! A step in contact: Newton's method on the energy of a step. Each iteration is filtered so that nothing
//! goes into anything else (Li et al. 2020, algorithm 1). The energy has cells, inertia, barriers and lagged
//! friction. The work of loads along an iteration is subtracted by the trapezoidal rule, which is exact for
//! loads that do not follow.
//!
//! * Rigid things and prescribed components go their whole way at once, as far as the filter lets them. The
//!   equations take account of the rest of the way. Until the whole way is made, energy may grow.
//! * If the stiffness is not positive definite, the Newton direction is unusable. Its diagonal is then raised
//!   until it is (Levenberg 1944).
//! * A step is found where the residual is below its tolerance. It is also found by an unfiltered Newton step
//!   with fresh factors that moves every node by less than the tolerance. The default tolerance is the
//!   distance that counts for a gap, and then the residual must not be far above its own tolerance. That step
//!   is still made.
//! * A full Newton step that is hardly shorter than the one before is made longer while the energy falls.
//! * In time, no Newton step takes a node further than a mean edge: longer steps are nearly always halved.
//! * Friction is then updated at the state found, while its size changes by more than a tenth.

use pliant_linear::dot;

use crate::model::error::SolveError;
use crate::model::state::AssemblyState;
use crate::steps::solver::AssemblySolver;
use crate::system::System;

/// Part of every gap that an iteration keeps, twice over, and that the guess keeps.
const KEEP: [f64; 2] = [0.1, 0.5];
/// Number of times that an iteration is halved.
const HALVINGS: usize = 16;
/// Additions to the diagonal, relative to it: the first one, the growth factor, and their number.
const RAISED: (f64, f64, usize) = (1e-5, 10.0, 8);
/// Relative change of the held friction above which the friction is updated.
const LAGGED: f64 = 0.1;
/// Residual over its tolerance below which the size of a Newton step can show that a step is found.
const LOOSE: f64 = 100.0;
/// Ratio of a Newton step to the previous one above which the step is made longer.
const SLOW: f64 = 0.6;
/// Number of times that a step is doubled at most.
const DOUBLINGS: usize = 3;
/// Round-off of an energy, over the sizes of its parts.
const ROUND_OFF: f64 = 1e-12;

/// Methods of a solver that steps in contact need.
pub(crate) trait Contacting: AssemblySolver {
    /// True if steps have inertia.
    const INERTIA: bool;

    /// The vectors of an iteration.
    fn vectors(&mut self) -> Vectors<'_>;

    /// Finds forces, and the stiffness if it is wanted, at a state.
    fn evaluate(&mut self, state: &AssemblyState, time: f64, tangent: bool) -> Result<(), SolveError>;

    /// Finds the residual at the state last evaluated. Returns its norm and its tolerance.
    fn find_residual(&mut self, state: &AssemblyState) -> (f64, f64);

    /// The energy [J] of inertia and damping at the state last evaluated.
    fn potential(&mut self) -> f64;

    /// Adds all stiffness beyond cells and contacts.
    fn complete(&mut self);

    /// The part of the increment that may be made, for other reasons than contact.
    fn part(&self) -> f64;

    /// True if a residual along the increment, before and after it, makes up for an energy that has not
    /// fallen.
    fn accepts(&self, before: f64, after: f64) -> bool;

    /// The node with the largest residual.
    fn worst(&self) -> u32;
}

/// Vectors of an iteration.
pub(crate) struct Vectors<'a> {
    pub system: &'a mut System,
    /// Increments of prescribed components still to come, six a node.
    pub pending: &'a mut [f64],
    pub increment: &'a mut [f64],
    pub residual: &'a mut [f64],
    pub solution: &'a mut [f64],
}

/// Limits of the search for a step.
pub(crate) struct Limits {
    pub iterations: usize,
    /// Number of times that friction is updated.
    pub lags: usize,
    /// A Newton step [m] that is the last one, whatever the residual.
    pub close: Option<f64>,
    /// True if a state is good enough when iterations run out or the energy does not fall any more.
    pub accept: bool,
    /// Farthest distance [m] that an iteration takes nodes once all prescribed motion is complete. Forces at
    /// a state say nothing about states further away, and pairs need not be listed so far.
    pub farthest: f64,
}

/// Start of an iteration.
struct Before {
    state: AssemblyState,
    time_fraction: f64,
    energy: f64,
    /// Sum of the sizes of the parts of the energy [J].
    size: f64,
    loads: Vec<f64>,
    along: f64,
}

/// Data that one iteration of a step leaves to the next.
struct Descent<'a> {
    limits: &'a Limits,
    time: f64,
    before: Before,
    /// Addition to the diagonal, relative to it.
    raised: f64,
    /// Number of times that friction was updated.
    lags: usize,
    /// The largest translation [m] of the previous Newton step.
    previous: f64,
}

/// Plan of an iteration.
struct Aim {
    /// True if all prescribed motion is complete.
    complete: bool,
    /// True if the step is found with this iteration.
    last: bool,
    /// True if an increment made in full is made longer.
    expands: bool,
    /// The part of the increment to begin with.
    part: f64,
}

impl Aim {
    /// True if the stiffness at the end of the increment is found at once: the next iteration nearly always
    /// needs it.
    fn goes_on(&self) -> bool {
        self.complete && !self.last && !self.expands
    }
}

/// Finds the state at the end of a step, or takes what iterations reach. Returns true if the step is found.
/// Residuals go to `found` with their tolerances.
pub(crate) fn descend(
    solver: &mut impl Contacting,
    state: &mut AssemblyState,
    time: f64,
    guess: Option<&[f64]>,
    limits: &Limits,
    found: &mut dyn FnMut(f64, f64),
) -> Result<bool, SolveError> {
    begin(solver, state, [state.time, time], guess);
    // Whether forces and stiffness of the state are known.
    let mut known = match guess {
        Some(guess) => start_from(solver, state, time, guess)?,
        None => false,
    };
    let mut descent = Descent::new(limits, time, state);
    for iteration in 0..=limits.iterations {
        if !std::mem::take(&mut known) {
            solver.evaluate(state, time, true)?;
        }
        let (norm, allowed) = solver.find_residual(state);
        found(norm, allowed);
        let complete = is_complete(solver);
        if complete && iteration > 0 && norm <= allowed {
            if descent.lag(solver) {
                continue;
            }
            return check(solver, time).map(|()| true);
        }
        if iteration == limits.iterations || !norm.is_finite() {
            // A single iteration is not checked, but what moves by itself must have come to its end.
            let single = limits.iterations == 1;
            return if complete && (single || limits.accept) && norm.is_finite() {
                check(solver, time).map(|()| single)
            } else {
                Err(not_found(solver, time, iteration))
            };
        }
        let is_small = norm <= LOOSE * allowed;
        let aim = descent.aim(solver, state, iteration, [complete, is_small])?;
        match descent.search(solver, state, &aim)? {
            Some(first) if !aim.last => {
                if aim.expands && first {
                    descent.expand(solver, state)?;
                }
                known = aim.goes_on();
            }
            Some(_) if descent.lag(solver) => {}
            Some(_) => return check(solver, time).map(|()| true),
            None => return descent.end_uphill(solver, state, &aim, iteration + 1),
        }
    }
    Ok(true)
}

impl<'a> Descent<'a> {
    fn new(limits: &'a Limits, time: f64, state: &AssemblyState) -> Self {
        let before = Before {
            state: state.clone(),
            time_fraction: 0.0,
            energy: 0.0,
            size: 0.0,
            loads: vec![0.0; 6 * state.position.len()],
            along: 0.0,
        };
        Self { limits, time, before, raised: 0.0, lags: 0, previous: f64::INFINITY }
    }

    /// Takes friction anew where it may and its size has changed; whether it has.
    fn lag(&mut self, solver: &mut impl Contacting) -> bool {
        let anew = self.lags < self.limits.lags && lag(solver);
        self.lags += usize::from(anew);
        anew
    }

    /// Finds the increment and how much of it may be made, and keeps what the iteration starts from.
    fn aim(
        &mut self,
        solver: &mut impl Contacting,
        state: &AssemblyState,
        iteration: usize,
        [complete, is_small]: [bool; 2],
    ) -> Result<Aim, SolveError> {
        let (limits, before) = (self.limits, &mut self.before);
        let (largest, is_newton) = find_direction(solver, &mut self.raised)?;
        let is_close = match limits.close {
            Some(close) => largest <= close,
            None => largest <= close(solver) && is_small,
        };
        let last = complete && is_newton && is_close;
        let Vectors { system, pending, increment, residual, solution } = solver.vectors();
        increment.copy_from_slice(pending);
        system.spread(solution, increment);
        before.along = dot(solution, residual);
        before.state.clone_from(state);
        before.loads.copy_from_slice(&own_loads(system));
        before.time_fraction = time_fraction(system);
        let farthest = if complete && largest > limits.farthest { limits.farthest / largest } else { 1.0 };
        let part = solver.part().min(farthest);
        let Vectors { system, increment, .. } = solver.vectors();
        let part = match &mut system.contact {
            Some(contact) => contact.collision_free_fraction(state, increment, [KEEP[0], part]),
            None => part,
        };
        (before.energy, before.size) = energy(solver);
        let is_slow = is_newton && largest > SLOW * std::mem::replace(&mut self.previous, largest);
        let expands = is_slow && complete && part == 1.0 && iteration > 1;
        Ok(Aim { complete, last, expands, part })
    }

    /// Goes along the increment, in halves until the energy has fallen: whether the first try was it; none if
    /// it does not fall.
    fn search(
        &self,
        solver: &mut impl Contacting,
        state: &mut AssemblyState,
        aim: &Aim,
    ) -> Result<Option<bool>, SolveError> {
        let (before, time) = (&self.before, self.time);
        let mut part = aim.part;
        let mut broken = None;
        for halving in 0..=HALVINGS {
            state.clone_from(&before.state);
            let Vectors { system, increment, .. } = solver.vectors();
            system.advance(state, increment, part);
            let gone = if before.time_fraction + part * (1.0 - before.time_fraction) >= 1.0 || part == 1.0 {
                1.0
            } else {
                before.time_fraction + part * (1.0 - before.time_fraction)
            };
            put(solver, gone);
            match solver.evaluate(state, time, aim.goes_on()) {
                Ok(()) if energy(solver).0.is_finite() => {
                    let fallen = energy(solver).0 - part * work(solver, &before.loads) - before.energy;
                    let accepted = !aim.complete || fallen <= ROUND_OFF * before.size || {
                        solver.find_residual(state);
                        let Vectors { residual, solution, .. } = solver.vectors();
                        let after = dot(solution, residual);
                        solver.accepts(before.along, after)
                    };
                    if accepted {
                        let Vectors { pending, .. } = solver.vectors();
                        pending.iter_mut().for_each(|p| *p *= 1.0 - part);
                        return Ok(Some(halving == 0));
                    }
                }
                Ok(()) => broken = None,
                Err(error @ SolveError::Broken { .. }) => broken = Some(error),
                Err(error) => return Err(error),
            }
            part *= 0.5;
            let Vectors { system, increment, .. } = solver.vectors();
            if let Some(contact) = system.contact.as_mut().filter(|contact| contact.is_curved()) {
                contact.time_fraction = before.time_fraction;
                part = contact.collision_free_fraction(&before.state, increment, [KEEP[0], part]);
            }
        }
        broken.map_or(Ok(None), Err)
    }

    /// Follows an increment that was made in full further, while the energy falls and nothing is in the way.
    /// It goes two, four and eight times as far.
    fn expand(&mut self, solver: &mut impl Contacting, state: &mut AssemblyState) -> Result<(), SolveError> {
        let (before, time) = (&mut self.before, self.time);
        for doubling in 0..DOUBLINGS {
            before.state.clone_from(state);
            (before.energy, before.size) = energy(solver);
            before.loads.copy_from_slice(&own_loads(solver.system()));
            let Vectors { system, increment, .. } = solver.vectors();
            if doubling > 0 {
                increment.iter_mut().for_each(|way| *way *= 2.0);
            }
            let Some(contact) = &mut system.contact else { return Ok(()) };
            let part = contact.collision_free_fraction(state, increment, [KEEP[0], 1.0]);
            let falls = part == 1.0 && {
                system.advance(state, increment, 1.0);
                match solver.evaluate(state, time, false) {
                    Ok(()) => energy(solver).0 - work(solver, &before.loads) < before.energy,
                    Err(SolveError::Broken { .. }) => false,
                    Err(error) => return Err(error),
                }
            };
            if !falls {
                state.clone_from(&before.state);
                return Ok(());
            }
        }
        Ok(())
    }

    /// Ends a step whose energy does not fall any more, because of round-off or an unusable direction.
    fn end_uphill(
        &self,
        solver: &mut impl Contacting,
        state: &mut AssemblyState,
        aim: &Aim,
        iterations: usize,
    ) -> Result<bool, SolveError> {
        let (before, time) = (&self.before, self.time);
        state.clone_from(&before.state);
        put(solver, before.time_fraction);
        solver.evaluate(state, time, false)?;
        if aim.complete && (aim.last || before.along.abs() <= ROUND_OFF * before.size) {
            return check(solver, time).map(|()| true);
        }
        if !aim.complete {
            return Err(not_found(solver, time, iterations));
        }
        if self.limits.accept {
            return check(solver, time).map(|()| false);
        }
        Err(SolveError::Uphill { time, node: solver.worst(), iterations })
    }
}

/// Gives the contacts the step and the motion expected in it.
fn begin(solver: &mut impl Contacting, state: &AssemblyState, times: [f64; 2], guess: Option<&[f64]>) {
    let Vectors { system, pending, increment, .. } = solver.vectors();
    match guess {
        Some(guess) => increment.copy_from_slice(guess),
        None => increment.fill(0.0),
    }
    for (entry, &pending) in increment.iter_mut().zip(pending.iter()) {
        if pending != 0.0 {
            *entry = pending;
        }
    }
    system.follow(increment);
    if let Some(contact) = &mut system.contact {
        contact.begin(state, increment, times);
    }
}

/// Goes to where the previous motion leads, as far as the filter lets it and cells can follow. The energy
/// there is not compared, because it is seldom less. Without this start the motion begins from rest, takes
/// more iterations and stops short. Returns true if the state moved; forces and stiffness are then known
/// there.
fn start_from(
    solver: &mut impl Contacting,
    state: &mut AssemblyState,
    time: f64,
    guess: &[f64],
) -> Result<bool, SolveError> {
    let here = state.clone();
    let Vectors { system, pending, increment, .. } = solver.vectors();
    increment.copy_from_slice(guess);
    for ((entry, &pending), number) in
        increment.iter_mut().zip(pending.iter()).zip(&system.stiffness.equations.number)
    {
        if *number == pliant_linear::sparse::NONE {
            *entry = pending;
        }
    }
    system.follow(increment);
    let Some(contact) = &mut system.contact else { return Ok(false) };
    let part = contact.collision_free_fraction(state, increment, [KEEP[1], 1.0]);
    system.advance(state, increment, part);
    put(solver, part);
    let Vectors { pending, .. } = solver.vectors();
    let whole = pending.to_vec();
    pending.iter_mut().for_each(|p| *p *= 1.0 - part);
    let possible = match solver.evaluate(state, time, true) {
        Ok(()) => energy(solver).0.is_finite(),
        Err(SolveError::Broken { .. }) => false,
        Err(error) => return Err(error),
    };
    if !possible {
        solver.vectors().pending.copy_from_slice(&whole);
        *state = here;
        put(solver, 0.0);
    }
    Ok(possible)
}

/// Sets how far rigid things have gone.
fn put(solver: &mut impl Contacting, time_fraction: f64) {
    if let Some(contact) = &mut solver.system_mut().contact {
        contact.time_fraction = time_fraction;
    }
}

fn time_fraction(system: &System) -> f64 {
    system.contact.as_ref().map_or(1.0, |contact| contact.time_fraction)
}

fn close(solver: &impl Contacting) -> f64 {
    solver.system().contact.as_ref().map_or(0.0, |contact| contact.close)
}

/// True if all prescribed motion is complete.
fn is_complete(solver: &mut impl Contacting) -> bool {
    let Vectors { system, pending, .. } = solver.vectors();
    time_fraction(system) == 1.0 && pending.iter().all(|&p| p == 0.0) && system.conditions.are_closed()
}

/// Loads but for the forces of contacts, six a node.
fn own_loads(system: &System) -> Vec<f64> {
    match &system.contact {
        Some(contact) => {
            system.forces.external.iter().zip(&contact.given).map(|(load, force)| load - force).collect()
        }
        None => system.forces.external.clone(),
    }
}

/// Work [J] of loads along the whole increment, by the mean of those before and those now.
fn work(solver: &mut impl Contacting, before: &[f64]) -> f64 {
    let now = own_loads(solver.system());
    let Vectors { increment, .. } = solver.vectors();
    let mean = before.iter().zip(&now).map(|(a, b)| 0.5 * (a + b));
    mean.zip(increment.iter()).map(|(load, way)| load * way).sum()
}

/// The energy [J] at the state last evaluated, without loads, and the sum of the sizes of its parts.
fn energy(solver: &mut impl Contacting) -> (f64, f64) {
    let potential = solver.potential();
    let system = solver.system_mut();
    let contact = system.contact.as_ref().map_or(0.0, |contact| contact.energy);
    let parts = [system.forces.energy, contact, potential];
    (parts.iter().sum(), parts.iter().map(|part| part.abs()).sum())
}

/// Solves for the residual with a stiffness that is positive definite. Returns its largest translation [m],
/// and true if the diagonal is unchanged. With a raised diagonal the size of the step does not show the
/// distance to the solution.
fn find_direction(solver: &mut impl Contacting, raised: &mut f64) -> Result<(f64, bool), SolveError> {
    solver.complete();
    let diagonal: Vec<f64> = (0..solver.system().stiffness.equations.count())
        .map(|k| solver.system().stiffness.matrix.diagonal(k).abs())
        .collect();
    let (first, growth, times) = RAISED;
    let mut added = 0.0;
    for _ in 0..=times {
        let system = solver.system_mut();
        let by = *raised - added;
        if by > 0.0 {
            system.stiffness.matrix.add_to_each_diagonal(|k| by * diagonal[k]);
            added = *raised;
        }
        let definite = match system.prepare() {
            Ok(negative) => negative == 0,
            Err(SolveError::Singular { .. } | SolveError::Indefinite { .. }) => false,
            Err(error) => return Err(error),
        };
        if definite {
            let Vectors { system, residual, solution, .. } = solver.vectors();
            match system.solve(residual, solution) {
                Ok(()) => {
                    let components = system.stiffness.equations.component.iter().zip(solution.iter());
                    let ways =
                        components.filter(|(component, _)| **component % 6 < 3).map(|(_, way)| way.abs());
                    *raised = if added > first { added / growth } else { 0.0 };
                    return Ok((ways.fold(0.0, f64::max), added == 0.0));
                }
                Err(SolveError::Indefinite { .. }) => {}
                Err(error) => return Err(error),
            }
        }
        *raised = (growth * added).max(first);
    }
    Err(SolveError::Impossible(
        "the stiffness in contact is not positive definite, even with a raised diagonal; take smaller steps",
    ))
}

/// Takes friction anew if its size has changed by more than counts; whether it has.
fn lag(solver: &mut impl Contacting) -> bool {
    let Some(contact) = &mut solver.system_mut().contact else { return false };
    let [held, now] = contact.step.friction_limits();
    let changed = (now - held).abs() > LAGGED * held.max(now);
    if changed {
        contact.step.lag();
    }
    changed
}

/// Searches the state found for intersections, if that is wanted.
fn check(solver: &mut impl Contacting, time: f64) -> Result<(), SolveError> {
    solver.system().contact.as_ref().map_or(Ok(()), |contact| contact.check(time))
}

/// Error of a step that was not found.
fn not_found(solver: &mut impl Contacting, time: f64, iterations: usize) -> SolveError {
    let blocked = !is_complete(solver);
    if let (true, Some(contact)) = (blocked, &solver.system().contact) {
        return SolveError::Blocked {
            time,
            driver: None,
            part: contact.time_fraction,
            gap: f64::INFINITY,
            iterations,
        };
    }
    SolveError::NotConverged { time, node: solver.worst(), residuals: Vec::new(), broken: None }
}
