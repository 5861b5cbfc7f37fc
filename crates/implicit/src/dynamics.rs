//! Motion in time: backward Euler, whose step is the minimum of elastic energy, loads and Σ m |u − h v|²/(2h²) (the same for rotation
//! vectors of the step with the rotary inertia); the backward differentiation formula of second order (Gear 1971; for unequal steps
//! Hairer, Nørsett and Wanner 1993, III.5), which is the same step from a point further on; and explicit central differences. Rayleigh
//! damping: α M + β K, with K of the start of the step.
//!
//! With r = h/h₋ of the steps now and before, a = r²/(1 + 2r), h* = h (1 + r)/(1 + 2r):
//! x = x₀ + a (x₀ − x₋) + h* v, v = v₀ + a (v₀ − v₋) + h* f/m; backward Euler is a = 0, h* = h. Rotations are rotation vectors from the
//! start of the step.
//! Leaves out: gyroscopic moments (the lumped inertia of a node is the same about every axis) and step control by accuracy.

use std::sync::Arc;

use nalgebra::Vector3;
use pliant_contact::lag::Lag;
use pliant_mechanics::StopFlag;
use pliant_mechanics::model::Solid;
use rayon::prelude::*;

use crate::assembly::{Assembly, Spring};
use crate::descent::{Contacting, Limits, Vectors, descend};
use crate::error::SolveError;
use crate::forces::Forces;
use crate::limited::within_limits;
use crate::solid::highest_frequency_squared;
use crate::state::{NODES, State};
use crate::statics::Attempted;
use crate::system::{Phases, System};
use crate::touching::TouchingSystem;
use pliant_linear::{LinearDevice, LinearReport, LinearSolver, dot};
use pliant_shells::rotation::{exponential, logarithm, spin_to_vector};

/// How an implicit step goes on in time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Integrator {
    /// Of first order: a vibration of angular frequency ω is damped by about ω h/2 of critical.
    #[default]
    BackwardEuler,
    /// Of second order, by differences of two steps: damped by about (ω h)³/4 of critical. The first step, and one after a step that
    /// was halved, is one of backward Euler.
    Bdf2,
}

/// How an implicit step is solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DynamicSettings {
    /// Length of a step [s].
    pub step: f64,
    /// How it goes on in time.
    pub integrator: Integrator,
    /// Iterations of Newton's method at the most. With 1 each step is one linear solution and nothing is checked: for real time.
    pub iterations: usize,
    /// Residual allowed, as a part of loads, internal or inertial forces, whichever are larger.
    pub tolerance: f64,
    /// Speed [m/s] of all nodes below which a Newton step in contact is the last one; if not given, it must move nothing by more than
    /// counts for a gap.
    pub speed_tolerance: Option<f64>,
    /// Whether a step whose iterations run out takes what they have reached instead of being halved: bounded time, accuracy unchecked
    /// ([`DynamicStep::converged`] tells). In contact such a state has no intersection.
    pub accept_unconverged: bool,
    /// How often a step that fails is halved.
    pub halvings: usize,
    /// Solver of the linear equations.
    pub linear: LinearSolver,
    /// Whether what conjugate gradients have reached when their iterations run out is taken as it is: bounded time, accuracy unchecked
    /// (`DynamicStep::linear` tells the residual).
    pub accept_stalled: bool,
}

impl DynamicSettings {
    /// Steps of a length [s], solved to 1e-6 with factors.
    pub fn new(step: f64) -> Self {
        Self {
            step,
            integrator: Integrator::default(),
            iterations: 20,
            tolerance: 1e-6,
            speed_tolerance: None,
            accept_unconverged: false,
            halvings: 6,
            linear: LinearSolver::Direct,
            accept_stalled: false,
        }
    }

    /// One linear solution a step.
    #[must_use]
    pub fn real_time(self, linear: LinearSolver) -> Self {
        Self { iterations: 1, linear, ..self }
    }
}

/// A step that was made.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DynamicStep {
    /// Residual over the largest of loads, internal and inertial forces, before each iteration and, but for a single one, at the end.
    pub residuals: Vec<f64>,
    /// What the last linear solution took.
    pub linear: LinearReport,
    /// Steps that it took: 1, or more where it was halved.
    pub parts: usize,
    /// Whether residuals of all parts have come below the tolerance, or were not asked for.
    pub converged: bool,
}

/// The implicit solver.
pub struct BackwardEuler {
    system: System,
    settings: DynamicSettings,
    length: f64,
    /// Mass-proportional damping [1/s] of each node.
    damping: Vec<f64>,
    round_off: f64,
    pending: Vec<f64>,
    /// Translations and rotation vectors since the start of the step, six a node.
    moved: Vec<f64>,
    increment: Vec<f64>,
    residual: Vec<f64>,
    solution: Vec<f64>,
    /// The product of the damping stiffness with the motion.
    product: Vec<f64>,
    start: State,
    /// Where the state was a whole step before, for differences of second order; none after a start or a step that was halved.
    previous: Option<Box<State>>,
    differences: Differences,
    /// No step was taken so far: the state may be off the curves of prescribed components.
    fresh: bool,
    attempts: Vec<Attempted>,
}

/// The equation of a step: positions are `shift` further on plus `step` times the new velocities, these `rate` further on plus `step`
/// times accelerations.
#[derive(Clone, Debug, Default)]
struct Differences {
    /// h* [s].
    step: f64,
    /// a (x₀ − x₋) and the same of rotation vectors, six a node; empty for none.
    shift: Vec<f64>,
    /// a (v₀ − v₋) and the same of spins; empty for none.
    rate: Vec<f64>,
}

impl Differences {
    /// Three numbers of a vector that may be empty.
    fn part(of: &[f64], at: usize) -> Vector3<f64> {
        of.get(at..at + 3).map_or_else(Vector3::zeros, Vector3::from_column_slice)
    }

    /// For a step [s] from a state on, with the state before where there is one.
    fn set(&mut self, h: f64, start: &State, previous: Option<&State>) {
        self.step = h;
        self.shift.clear();
        self.rate.clear();
        let Some(before) = previous else { return };
        let ratio = h / (start.time - before.time);
        let weight = ratio * ratio / (1.0 + 2.0 * ratio);
        self.step = h * (1.0 + ratio) / (1.0 + 2.0 * ratio);
        for node in 0..start.position.len() {
            let turn = logarithm(&(start.rotation[node] * before.rotation[node].inverse()));
            let moved = [start.position[node] - before.position[node], turn];
            let faster = [start.velocity[node] - before.velocity[node], start.spin[node] - before.spin[node]];
            for (sum, parts) in [(&mut self.shift, moved), (&mut self.rate, faster)] {
                parts.iter().for_each(|part| sum.extend_from_slice((weight * part).as_slice()));
            }
        }
    }
}

/// What inertia and mass-proportional damping resist with in a step.
struct Momentum<'a> {
    model: &'a Assembly,
    differences: &'a Differences,
    start: &'a State,
    moved: &'a [f64],
    damping: &'a [f64],
}

impl Momentum<'_> {
    /// Force [N] on a node (from component 0 on) or moment [N m] (from 3 on).
    fn of(&self, node: usize, first: usize) -> Vector3<f64> {
        let at = 6 * node + first;
        let Differences { step: h, shift, rate } = self.differences;
        let vector = Vector3::from_column_slice(&self.moved[at..at + 3]);
        let moved = vector - Differences::part(shift, at);
        let (mass, before) = if first == 0 {
            (self.model.mass[node], self.start.velocity[node])
        } else {
            (self.model.rotary_inertia[node], self.start.spin[node])
        };
        let before = before + Differences::part(rate, at);
        let momentum = (mass / (h * h)) * (moved - *h * before) + (self.damping[node] * mass / h) * moved;
        if first == 0 { momentum } else { spin_to_vector(&vector).tr_mul(&momentum) }
    }
}

impl BackwardEuler {
    /// A solver for a model.
    ///
    /// # Errors
    /// If the equations are too many for the solver chosen.
    pub fn new(model: impl Into<Arc<Assembly>>, settings: DynamicSettings) -> Result<Self, SolveError> {
        Self::on(None, model, settings)
    }

    /// The same with a device, if one is given, that solves the equations by conjugate gradients with blocks or aggregates. Their tolerance
    /// holds in double precision.
    ///
    /// # Errors
    /// As [`new`](Self::new), and if the device fails or has no room, or another linear solver is set.
    pub fn on(
        device: Option<Arc<dyn LinearDevice>>,
        model: impl Into<Arc<Assembly>>,
        settings: DynamicSettings,
    ) -> Result<Self, SolveError> {
        let model = model.into();
        let system = System::on(device, Arc::clone(&model), settings.linear)?;
        let (all, free) = (6 * model.rest.len(), system.equations.count());
        Ok(Self {
            settings,
            length: model.mean_edge(),
            damping: model.damping(),
            round_off: model.round_off(),
            pending: vec![0.0; all],
            moved: vec![0.0; all],
            increment: vec![0.0; all],
            residual: vec![0.0; free],
            solution: vec![0.0; free],
            product: vec![0.0; free],
            start: State::at_rest(&model),
            previous: None,
            differences: Differences::default(),
            attempts: Vec::new(),
            fresh: true,
            system,
        })
    }

    /// Time spent in the parts of the solver so far.
    pub fn phases(&self) -> Phases {
        self.system.phases
    }

    /// Contacts, at the state of the last step; `None` without any.
    pub fn touching(&self) -> Option<&TouchingSystem> {
        self.system.touching.as_deref()
    }

    /// The same to change.
    pub fn touching_mut(&mut self) -> Option<&mut TouchingSystem> {
        self.system.touching.as_deref_mut()
    }

    /// Takes a pattern of the equations with [`pairs`](TouchingSystem::pairs) of nodes that contacts added where another solver stood: so this one goes on with
    /// the same bits.
    ///
    /// # Errors
    /// If the equations are too many for the solver chosen.
    pub fn take_contact_pairs(&mut self, pairs: Vec<[u32; 2]>) -> Result<(), SolveError> {
        self.system.take_pairs(pairs)
    }

    /// Values of the older matrix whose factors precondition the next one, if there is one: without them another solver takes other iterations.
    pub fn factored(&self) -> Option<&[f64]> {
        self.system.factored()
    }

    /// Takes the [factors](Self::factored) of another solver with the same [pairs](Self::take_contact_pairs): to continue with the same bits.
    pub fn precondition_with(&mut self, values: Vec<f64>) {
        self.system.precondition_with(values);
    }

    /// Looks at a flag from now on, before each solution, and stops where it asks.
    pub fn stop_on(&mut self, flag: &StopFlag) {
        self.system.stop = flag.clone();
    }

    /// How far moved nodes whose force is limited are behind their motion, and volumes [m³] whose pressure is limited behind theirs, along the first axis, by
    /// their constraints.
    pub fn lags(&self) -> &[Lag] {
        &self.system.lags
    }

    /// Takes the lags of another solver, whose run this one continues.
    pub fn take_lags(&mut self, lags: Vec<Lag>) {
        self.system.lags = lags;
    }

    /// Takes hold of nodes, as [`Forces::hold`](crate::Forces::hold).
    pub fn hold(&mut self, springs: &[Spring]) {
        self.system.hold(springs);
    }

    /// Takes forces [N] on nodes, as [`Forces::push`](crate::Forces::push).
    pub fn push(&mut self, forces: &[(u32, [f64; 3])]) {
        self.system.push(forces);
    }

    /// How its steps are solved.
    pub fn settings(&self) -> &DynamicSettings {
        &self.settings
    }

    /// The attempts of the last step, one after the other. Their residuals are relative, as those of [`DynamicStep`].
    pub fn attempts(&self) -> &[Attempted] {
        &self.attempts
    }

    /// Where the state was a step before, if the next step takes differences with it.
    pub fn previous(&self) -> Option<&State> {
        self.previous.as_deref()
    }

    /// Takes differences with a state a step before, as another solver would have: to go on where that one stood.
    pub fn go_on_from(&mut self, previous: Option<State>) {
        self.previous = previous.map(Box::new);
    }

    /// Makes one step.
    ///
    /// # Errors
    /// If it fails as often as it may be halved; the state then is at the last part of it that was made.
    pub fn advance(&mut self, state: &mut State) -> Result<DynamicStep, SolveError> {
        self.attempts.clear();
        let until = state.time + self.settings.step;
        let mut size = self.settings.step;
        let (mut parts, mut halvings, mut converged) = (0, 0, true);
        // Of a state that was moved in between nothing is known of the step before.
        let previous = self.previous.take().filter(|before| before.time < state.time);
        if std::mem::take(&mut self.fresh) {
            self.system.catch_up(state, until);
        }
        self.system.begin_history(state);
        loop {
            let rest = until - state.time;
            let last = size >= rest * (1.0 - 1e-9);
            self.start.clone_from(state);
            let h = if last { rest } else { size };
            self.differences.set(h, &self.start, previous.as_deref().filter(|_| halvings == 0));
            match self.newton(state, h) {
                Ok(step) => {
                    parts += 1;
                    converged &= step.converged;
                    if last {
                        state.time = until;
                        if self.settings.integrator == Integrator::Bdf2 && parts == 1 {
                            let mut kept = previous.unwrap_or_default();
                            kept.as_mut().clone_from(&self.start);
                            self.previous = Some(kept);
                        }
                        return Ok(DynamicStep { parts, converged, ..step });
                    }
                }
                Err(error) => {
                    state.clone_from(&self.start);
                    if halvings == self.settings.halvings || error.is_final() {
                        return Err(self.system.blocked_at(state, error));
                    }
                    halvings += 1;
                    size *= 0.5;
                }
            }
        }
    }

    /// Newton's method for a step of a length [s], kept with the other attempts.
    fn newton(&mut self, state: &mut State, h: f64) -> Result<DynamicStep, SolveError> {
        let time = state.time + h;
        let allowed = self.settings.tolerance;
        self.attempts.push(Attempted { time, allowed, ..Attempted::default() });
        self.system.prescribed(state.time, time, &mut self.pending);
        self.system.begin_step(&state.history, h);
        let converged = if self.system.touching.is_some() {
            self.newton_in_contact(state, h)?
        } else {
            within_limits(self, state, time, |solver, state| solver.newton_without_contact(state, h))?
        };
        self.end(state, time);
        let linear = self.system.last_solution;
        let residuals = self.attempts.last_mut().map(|attempt| {
            attempt.found = converged;
            attempt.residuals.clone()
        });
        Ok(DynamicStep { residuals: residuals.unwrap_or_default(), linear, parts: 0, converged })
    }

    /// Keeps residuals of the attempt under way.
    fn note(&mut self, residuals: &[f64]) {
        if let Some(attempt) = self.attempts.last_mut() {
            attempt.residuals.extend_from_slice(residuals);
        }
    }

    /// [`newton`](Self::newton) without contact; whether the residual has come below the tolerance, or was not asked for.
    fn newton_without_contact(&mut self, state: &mut State, h: f64) -> Result<bool, SolveError> {
        let time = state.time + h;
        self.moved.fill(0.0);
        let mut converged = true;
        for iteration in 0..=self.settings.iterations {
            if iteration == 1 && self.settings.iterations == 1 {
                if !self.system.lags.is_empty() {
                    self.system.evaluate(state, time, None)?;
                    self.find_residual(state);
                }
                break;
            }
            self.system.evaluate(state, time, Some(&self.pending))?;
            if iteration == 0 {
                self.system.take_damper();
            }
            let (norm, scale) = self.find_residual(state);
            self.note(&[if scale > 0.0 { norm / scale } else { 0.0 }]);
            let moving = self.pending.iter().any(|&p| p != 0.0) || !self.system.conditions.are_closed();
            if iteration > 0 && !moving && norm <= self.settings.tolerance * scale + self.round_off {
                break;
            }
            if iteration == self.settings.iterations
                && norm.is_finite()
                && !moving
                && self.settings.accept_unconverged
            {
                converged = false;
                break;
            }
            if iteration == self.settings.iterations || !norm.is_finite() {
                let node = self.worst_node();
                let residuals = self.attempts.last().map(|attempt| attempt.residuals.clone());
                let residuals = residuals.unwrap_or_default();
                return Err(SolveError::NotConverged { time, node, residuals, broken: None });
            }
            // The motion goes on, to begin with.
            let going_on = if iteration == 0 { h } else { 0.0 };
            match self.find_direction(going_on) {
                Err(error) if self.system.gives_way(&error) => {
                    let tangent = Some(&self.pending[..]);
                    self.system.evaluate(state, time, tangent)?;
                    self.find_residual(state);
                    let found = self.find_direction(going_on);
                    self.system.exact_pressure = true;
                    found?;
                }
                found => found?,
            }
            self.increment.copy_from_slice(&self.pending);
            self.system.spread(&self.solution, &mut self.increment);
            self.pending.fill(0.0);
            self.system.advance(state, &self.increment, 1.0);
            self.find_motion(state);
        }
        Ok(converged)
    }

    /// [`newton`](Self::newton) in contact, from the motion of before; the result as without.
    fn newton_in_contact(&mut self, state: &mut State, h: f64) -> Result<bool, SolveError> {
        let time = state.time + h;
        self.moved.fill(0.0);
        if !self.system.damper.is_empty() {
            // Without friction, which the step has yet to find.
            if let Some(touching) = &mut self.system.touching {
                touching.stand(state);
            }
            self.system.evaluate(state, time, Some(&self.pending))?;
            self.system.take_damper();
        }
        let rates = state.velocity.iter().zip(&state.spin);
        let guess: Vec<f64> =
            rates.flat_map(|(v, w)| [v, w].map(|rate| rate * h)).flat_map(|x| [x.x, x.y, x.z]).collect();
        let limits = Limits {
            iterations: self.settings.iterations,
            lags: LAGS,
            close: self.settings.speed_tolerance.map(|speed| speed * h),
            accept: self.settings.accept_unconverged,
            farthest: self.length,
        };
        let tolerance = self.settings.tolerance;
        let mut residuals = Vec::new();
        let result = within_limits(self, state, time, |solver, state| {
            descend(solver, state, time, Some(&guess), &limits, &mut |norm, allowed| {
                residuals.push(if allowed > 0.0 { norm / allowed * tolerance } else { 0.0 });
            })
        });
        self.note(&residuals);
        let converged = result.map_err(|error| match error {
            SolveError::NotConverged { time, node, broken, .. } => {
                SolveError::NotConverged { time, node, residuals, broken }
            }
            error => error,
        })?;
        self.find_motion(state);
        Ok(converged)
    }

    /// Ends a step: velocities and spins of the motion in it.
    fn end(&mut self, state: &mut State, time: f64) {
        self.system.end_step(Some(&self.start), state, time - self.start.time);
        let Differences { step, shift, .. } = &self.differences;
        for (node, moved) in self.moved.chunks_exact(6).enumerate() {
            let rate = |first: usize| {
                (Differences::part(moved, first) - Differences::part(shift, 6 * node + first)) / *step
            };
            (state.velocity[node], state.spin[node]) = (rate(0), rate(3));
        }
        state.time = time;
    }

    /// Solves for the residual, from a motion that goes on for a time [s].
    fn find_direction(&mut self, going_on: f64) -> Result<(), SolveError> {
        self.add_inertia();
        self.system.prepare()?;
        for (guess, &component) in self.solution.iter_mut().zip(&self.system.equations.component) {
            let (node, c) = (component as usize / 6, component as usize % 6);
            let rate = if c < 3 { self.start.velocity[node][c] } else { self.start.spin[node][c - 3] };
            *guess = going_on * rate;
        }
        match self.system.solve_from(&self.residual, &mut self.solution) {
            Err(SolveError::Stalled { .. }) if self.settings.accept_stalled => Ok(()),
            result => result,
        }
    }

    /// Translations and rotation vectors since the start of the step.
    fn find_motion(&mut self, state: &State) {
        let Self { moved, start, .. } = self;
        moved.par_chunks_exact_mut(6).enumerate().with_min_len(NODES).for_each(|(node, moved)| {
            moved[..3].copy_from_slice((state.position[node] - start.position[node]).as_slice());
            let turn = state.rotation[node] * start.rotation[node].inverse();
            moved[3..].copy_from_slice(logarithm(&turn).as_slice());
        });
    }

    /// Loads less internal, inertial and damping forces on the free components; its norm and that of the largest of them.
    fn find_residual(&mut self, state: &State) -> (f64, f64) {
        let model = Arc::clone(&self.system.model);
        let Self { system, differences, start, moved, damping, .. } = self;
        let momentum = Momentum { model: &model, differences, start, moved, damping };
        let Differences { step: h, shift, .. } = &*differences;
        let h = *h;
        let arm = 1.0 / (self.length * self.length);
        let (mut loads, mut resistance, mut inertia) = (0.0, 0.0, 0.0);
        for node in 0..model.rest.len() {
            let at = 6 * node;
            let part = |from: &[f64], first: usize| {
                Vector3::new(from[at + first], from[at + first + 1], from[at + first + 2])
            };
            for first in [0, 3] {
                let weight = if first == 0 { 1.0 } else { arm };
                let load =
                    part(&system.external, first) + state.load_factor * part(&system.controlled, first);
                let internal = part(&system.internal, first);
                let momentum = momentum.of(node, first);
                loads += weight * load.norm_squared();
                resistance += weight * internal.norm_squared();
                inertia += weight * momentum.norm_squared();
                let sum = load - internal - momentum;
                for c in 0..3 {
                    let equation = system.equations.number[at + first + c];
                    if equation != pliant_linear::sparse::NONE {
                        self.residual[equation as usize] = sum[c];
                    }
                }
            }
        }
        if !system.damper.is_empty() {
            system.gather(moved, &mut self.solution);
            if !shift.is_empty() {
                let shifted = system.equations.component.iter().map(|&component| shift[component as usize]);
                self.solution.iter_mut().zip(shifted).for_each(|(moved, shift)| *moved -= shift);
            }
            system.matrix.multiply_values(&system.damper, &self.solution, &mut self.product);
            let factor = model.stiffness_damping / h;
            self.residual.iter_mut().zip(&self.product).for_each(|(r, p)| *r -= factor * p);
        }
        let [force, moment] = [0, 3].map(|first| {
            let momentum = &momentum;
            move |node: u32| momentum.of(node as usize, first)
        });
        system.give_inertia_back(force, moment, &mut self.residual);
        system.conditions.relieve(&mut self.residual);
        let mut norm = 0.0;
        for (&component, residual) in system.equations.component.iter().zip(&self.residual) {
            norm += residual * residual * if component % 6 < 3 { 1.0 } else { arm };
        }
        self.residual.iter_mut().zip(&system.coupling).for_each(|(r, c)| *r -= c);
        (norm.sqrt(), f64::max(loads, f64::max(resistance, inertia)).sqrt())
    }

    /// K + (1/h*² + α/h*) M + β/h* K.
    fn add_inertia(&mut self) {
        let (model, h) = (Arc::clone(&self.system.model), self.differences.step);
        let factor = model.stiffness_damping / h;
        self.system.matrix.value.iter_mut().zip(&self.system.damper).for_each(|(k, d)| *k += factor * d);
        let Self { system, differences, start, moved, damping, .. } = self;
        let momentum = Momentum { model: &model, differences, start, moved, damping };
        let rate = |node: u32| 1.0 / (h * h) + damping[node as usize] / h;
        let components = &system.equations.component;
        system.matrix.add_to_each_diagonal(|equation| {
            let (node, component) = (components[equation] / 6, components[equation] % 6);
            let masses = if component < 3 { &model.mass } else { &model.rotary_inertia };
            rate(node) * masses[node as usize]
        });
        system.add_bound_masses(
            |node| (rate(node) * model.mass[node as usize], momentum.of(node as usize, 0)),
            |node| rate(node) * model.rotary_inertia[node as usize],
            |node| momentum.of(node as usize, 3),
        );
    }

    fn worst_node(&self) -> u32 {
        let all = self.system.equations.component.iter().zip(&self.residual);
        let largest = all.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        largest.map_or(0, |(component, _)| component / 6)
    }
}

/// How often a step takes friction anew.
const LAGS: usize = 1;

impl Contacting for BackwardEuler {
    const INERTIA: bool = true;

    fn system(&mut self) -> &mut System {
        &mut self.system
    }

    fn vectors(&mut self) -> Vectors<'_> {
        let Self { system, pending, increment, residual, solution, .. } = self;
        Vectors { system, pending, increment, residual, solution }
    }

    fn evaluate(&mut self, state: &State, time: f64, tangent: bool) -> Result<(), SolveError> {
        self.find_motion(state);
        self.system.evaluate(state, time, tangent.then_some(&self.pending[..]))
    }

    fn find_residual(&mut self, state: &State) -> (f64, f64) {
        let (norm, scale) = Self::find_residual(self, state);
        (norm, self.settings.tolerance * scale + self.round_off)
    }

    /// Σ m |u − s − h v|²/(2 h²) + α m |u − s|²/(2 h), the same of rotation vectors, and β (u − s)ᵀ K (u − s)/(2 h).
    fn potential(&mut self) -> f64 {
        let model = Arc::clone(&self.system.model);
        let Differences { step: h, shift, rate } = &self.differences;
        let mut sum = 0.0;
        for (node, moved) in self.moved.chunks_exact(6).enumerate() {
            for (first, mass, before) in [
                (0, model.mass[node], self.start.velocity[node]),
                (3, model.rotary_inertia[node], self.start.spin[node]),
            ] {
                let moved = Differences::part(moved, first) - Differences::part(shift, 6 * node + first);
                let before = before + Differences::part(rate, 6 * node + first);
                sum += 0.5 * mass / (h * h) * (moved - *h * before).norm_squared();
                sum += 0.5 * self.damping[node] * mass / h * moved.norm_squared();
            }
        }
        if !self.system.damper.is_empty() {
            let mut moved = vec![0.0; self.product.len()];
            self.system.gather(&self.moved, &mut moved);
            let shift =
                |component: &u32| self.differences.shift.get(*component as usize).copied().unwrap_or(0.0);
            let components = &self.system.equations.component;
            moved.iter_mut().zip(components).for_each(|(moved, component)| *moved -= shift(component));
            self.system.matrix.multiply_values(&self.system.damper, &moved, &mut self.product);
            sum += 0.5 * model.stiffness_damping / h * dot(&moved, &self.product);
        }
        sum
    }

    fn complete(&mut self) {
        self.add_inertia();
    }

    fn part(&self) -> f64 {
        1.0
    }

    fn accepts(&self, _before: f64, _after: f64) -> bool {
        false
    }

    fn worst(&self) -> u32 {
        self.worst_node()
    }
}

/// Explicit central differences: velocities stand half a step before positions.
pub struct Explicit {
    forces: Forces,
    step: f64,
    /// Mass-proportional damping [1/s] of each node.
    damping: Vec<f64>,
    pending: Vec<f64>,
    /// No step was taken so far: the state may be off the curves of prescribed components.
    fresh: bool,
}

impl Explicit {
    /// The longest stable step [s] about rest: 2/√(ω² + max k/m) of the stiffest element and the stiffest springs on a node, a lower bound
    /// of the model's.
    pub fn stable_step(model: &Assembly) -> f64 {
        let shells = model.facets.iter().map(|facet| facet.highest_frequency_squared());
        let of_solid = |solid: &Solid| {
            let cells = (0..solid.cells.len()).map(|cell| highest_frequency_squared(solid, cell));
            cells.fold(0.0, f64::max)
        };
        let solids = model.solids.iter().map(of_solid);
        let highest = shells.chain(solids).fold(0.0, f64::max);
        let mut springs = vec![0.0; model.rest.len()];
        for spring in &model.springs {
            springs[spring.node as usize] += spring.stiffness;
        }
        let held = springs.iter().zip(&model.mass).filter(|(_, mass)| **mass > 0.0);
        2.0 / (highest + held.map(|(stiffness, mass)| stiffness / mass).fold(0.0, f64::max)).sqrt()
    }

    /// A solver with steps of a length [s]. Pressures change the stable step, and are not looked at.
    ///
    /// # Errors
    /// If the step is longer than is stable, or damping is proportional to stiffness.
    pub fn new(model: impl Into<Arc<Assembly>>, step: f64) -> Result<Self, SolveError> {
        let model = model.into();
        if !(step > 0.0 && step <= Self::stable_step(&model)) {
            return Err(SolveError::Impossible(
                "the step is longer than the stable one (`Explicit::stable_step`); shorten it or use the implicit solver",
            ));
        }
        if model.collective().is_some() {
            return Err(SolveError::Impossible(
                "explicit shells have no mean, no rigid part and no volume; use the implicit solver",
            ));
        }
        if !model.turns.is_empty() {
            return Err(SolveError::Impossible(
                "rotations of explicit shells follow no solid; use the implicit solver",
            ));
        }
        if model.stiffness_damping > 0.0 {
            return Err(SolveError::Impossible(
                "damping by stiffness needs the implicit solver; damp by mass instead",
            ));
        }
        Ok(Self {
            pending: vec![0.0; 6 * model.rest.len()],
            damping: model.damping(),
            forces: Forces::new(model),
            step,
            fresh: true,
        })
    }

    /// Makes one step: [`evaluate`](Self::evaluate), then [`go`](Self::go).
    ///
    /// # Errors
    /// If an element collapses or folds over.
    pub fn advance(&mut self, state: &mut State) -> Result<(), SolveError> {
        self.evaluate(state)?;
        self.go(state);
        Ok(())
    }

    /// The first half of a step: the forces at a state, for whoever wants to look at them before it moves.
    ///
    /// # Errors
    /// If an element collapses or folds over.
    pub fn evaluate(&mut self, state: &State) -> Result<(), SolveError> {
        self.forces.evaluate(state)
    }

    /// Takes hold of nodes, as [`Forces::hold`].
    pub fn hold(&mut self, springs: &[Spring]) {
        self.forces.hold(springs);
    }

    /// Takes forces [N] on nodes, as [`Forces::push`].
    pub fn push(&mut self, forces: &[(u32, [f64; 3])]) {
        self.forces.push(forces);
    }

    /// The forces last evaluated.
    pub fn forces(&self) -> &Forces {
        &self.forces
    }

    /// Time spent in the parts of the solver so far.
    pub fn phases(&self) -> Phases {
        self.forces.system.phases
    }

    /// The second half of a step: moves the state on with the forces that were evaluated at it.
    pub fn go(&mut self, state: &mut State) {
        let (h, model) = (self.step, Arc::clone(&self.forces.system.model));
        if std::mem::take(&mut self.fresh) {
            self.forces.system.catch_up(state, state.time + h);
        }
        let system = &self.forces.system;
        system.prescribed(state.time, state.time + h, &mut self.pending);
        for (node, damping) in self.damping.iter().enumerate() {
            if model.mass[node] == 0.0 {
                continue;
            }
            // (1 + αh/2) v⁺ = (1 − αh/2) v + h f/m.
            let half = 0.5 * damping * h;
            let (kept, gained) = ((1.0 - half) / (1.0 + half), h / (1.0 + half));
            let velocity = |first: usize, now: Vector3<f64>, mass: f64| {
                Vector3::from_fn(|c, _| {
                    let at = 6 * node + first + c;
                    if system.equations.number[at] == pliant_linear::sparse::NONE {
                        return self.pending[at] / h;
                    }
                    kept * now[c] + gained * (system.external[at] - system.internal[at]) / mass
                })
            };
            let (v, w) = (
                velocity(0, state.velocity[node], model.mass[node]),
                velocity(3, state.spin[node], model.rotary_inertia[node]),
            );
            (state.velocity[node], state.spin[node]) = (v, w);
            state.position[node] += h * v;
            state.rotation[node] = exponential(&(h * w)) * state.rotation[node];
        }
        state.time += h;
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::{Shell, StaticSettings, Statics};
    use pliant_linear::Preconditioner;
    use pliant_mechanics::curve::{Curve, Shape};
    use pliant_mechanics::load::{Load, LoadKind};
    use pliant_mechanics::model::{Constraint, Motion};
    use pliant_shells::element::Elasticity;
    use pliant_shells::element::Wall;

    const LENGTH: f64 = 1.0;
    const THIN: f64 = 0.01;

    /// A strip of 16 × 2 cells, 1 × 0.1 m; E = 1 MPa, ν = 0.
    fn strip(thickness: f64) -> Assembly {
        let points = (0..51_u32)
            .map(|i| Vector3::new(f64::from(i % 17) / 16.0 * LENGTH, f64::from(i / 17) * 0.05, 0.0));
        let cell = |i: u32| {
            let a = i % 16 + 17 * (i / 16);
            [[a, a + 1, a + 18], [a, a + 18, a + 17]]
        };
        let material = Wall { elastic: Elasticity { young: 1e6, poisson: 0.0 }, density: 1000.0 };
        let mut model = Assembly::new("shell", points);
        let cells = (0..32).flat_map(cell).collect();
        model.add_shell(&Shell::new("strip", cells, thickness, material)).unwrap();
        model
    }

    fn clamped(thickness: f64) -> Assembly {
        let mut model = strip(thickness);
        let nodes = vec![0, 17, 34];
        model.model_mut().constraints.push(Constraint {
            name: "clamp".into(),
            nodes,
            components: [true; 6],
            motion: Motion::Fixed,
        });
        model
    }

    fn weigh(model: &mut Assembly, g: f64) {
        let kind = LoadKind::Gravity { body: 0, acceleration: [0.0, 0.0, -g] };
        let curve = Curve { shape: Shape::Hold, from: 0.0, to: 1.0 };
        model.model_mut().loads.push(Load::new("weight", kind, curve));
    }

    /// First bending frequency of a cantilever, 1.8751² √(E I/(ρ A L⁴)) [rad/s].
    fn first_frequency(thickness: f64) -> f64 {
        1.8751_f64.powi(2) * (1e6 * thickness * thickness / (12.0 * 1000.0)).sqrt() / LENGTH.powi(2)
    }

    /// Period of the tip after a small push, from its zero crossings.
    fn period(mut advance: impl FnMut(&mut State), model: &Assembly, step: f64) -> f64 {
        let mut state = State::at_rest(model);
        for (v, x) in state.velocity.iter_mut().zip(model.places()) {
            v.z = 1e-3 * x.x * x.x;
        }
        let mut crossings = Vec::new();
        let mut last = 0.0;
        while crossings.len() < 3 {
            advance(&mut state);
            let now = state.position[16].z;
            if last != 0.0 && (now < 0.0) != (last < 0.0) {
                crossings.push(state.time - step * now / (now - last));
            }
            last = now;
        }
        crossings[2] - crossings[0]
    }

    /// Euler's cantilever to 1 %: explicit, and implicit with 400 steps a period.
    #[test]
    fn a_cantilever_vibrates_at_its_first_frequency() {
        let model = clamped(0.03);
        let exact = TAU / first_frequency(0.03);
        let step = 0.9 * Explicit::stable_step(&model);
        let mut explicit = Explicit::new(model.clone(), step).unwrap();
        let found = period(|state| explicit.advance(state).unwrap(), &model, step);
        println!("period {found:.4} s, exact {exact:.4} s, explicit step {step:.1e} s");
        assert!((found / exact - 1.0).abs() < 0.01, "{found} {exact}");
        let step = exact / 400.0;
        let mut implicit = BackwardEuler::new(model.clone(), DynamicSettings::new(step)).unwrap();
        let found = period(|state| drop(implicit.advance(state).unwrap()), &model, step);
        assert!((found / exact - 1.0).abs() < 0.01, "{found} {exact}");
    }

    /// A free strip on equal springs for its masses goes to and fro as one body, at 1 Hz: what each integrator makes of it, after a
    /// number of steps a period.
    fn bobbing(integrator: Integrator, steps: u32, periods: u32) -> State {
        let mut model = strip(THIN);
        for node in 0..model.rest.len() {
            let stiffness = TAU * TAU * model.mass[node];
            model.springs.push(crate::Spring { node: node as u32, anchor: model.place(node), stiffness });
        }
        let settings =
            DynamicSettings { integrator, tolerance: 1e-10, ..DynamicSettings::new(1.0 / f64::from(steps)) };
        let mut solver = BackwardEuler::new(model.clone(), settings).unwrap();
        let mut state = State::at_rest(&model);
        state.position.iter_mut().for_each(|x| x.z = 0.1);
        for _ in 0..steps * periods {
            solver.advance(&mut state).unwrap();
        }
        state
    }

    /// Half the step, a quarter of the error (and half of it by backward Euler).
    #[test]
    fn differences_of_two_steps_are_of_second_order() {
        for (integrator, order) in [(Integrator::BackwardEuler, 1.0), (Integrator::Bdf2, 2.0)] {
            let off = [100, 200].map(|steps| {
                let state = bobbing(integrator, steps, 1);
                // In phase space, over the amplitude.
                ((state.position[7].z / 0.1 - 1.0).powi(2) + (state.velocity[7].z / (0.1 * TAU)).powi(2))
                    .sqrt()
            });
            let found = (off[0] / off[1]).log2();
            println!("{integrator:?}: off by {:.1e} and {:.1e}, order {found:.2}", off[0], off[1]);
            assert!((found - order).abs() < 0.2, "{integrator:?}: order {found}");
        }
    }

    /// Part of critical damping at 1 Hz in steps of 10, 20 and 40 ms: ω h/2 of backward Euler less terms of third order, 3 to 11 %;
    /// (ω h)³/4 of differences of two steps, 0.006 to 0.4 %.
    #[test]
    fn each_integrator_damps_as_is_told() {
        for step in [0.01, 0.02, 0.04] {
            let steps = (1.0_f64 / step) as u32;
            let damping = |integrator, periods: u32| {
                let at = |periods| {
                    let state = bobbing(integrator, steps, periods);
                    state.position[7].z.hypot(state.velocity[7].z / TAU)
                };
                // From the first period on, after the step of backward Euler at the start.
                (at(1) / at(1 + periods)).ln() / (TAU * f64::from(periods))
            };
            let [first, second] = [damping(Integrator::BackwardEuler, 1), damping(Integrator::Bdf2, 4)];
            println!("h = {step}: {:.2} % and {:.4} % of critical", 100.0 * first, 100.0 * second);
            let angle = TAU * step;
            assert!((first / (0.5 * angle) - 1.0).abs() < 0.1, "{first}");
            assert!((second / (0.25 * angle.powi(3)) - 1.0).abs() < 0.2, "{second}");
        }
    }

    /// A strip that falls about its clamp by more than a right angle: half the step, a quarter of the error; a step halved on the way,
    /// and one taken up by another solver, keep to it.
    #[test]
    fn large_motion_is_of_second_order_and_goes_on_elsewhere() {
        let mut model = clamped(THIN);
        weigh(&mut model, 2.0);
        let tip = |steps: u32, elsewhere: bool| {
            let settings = DynamicSettings {
                integrator: Integrator::Bdf2,
                tolerance: 1e-10,
                ..DynamicSettings::new(0.8 / f64::from(steps))
            };
            let mut solver = BackwardEuler::new(model.clone(), settings).unwrap();
            let mut state = State::at_rest(&model);
            for step in 0..steps {
                if elsewhere && step == steps / 2 {
                    let previous = solver.previous().cloned();
                    assert!(previous.is_some());
                    solver = BackwardEuler::new(model.clone(), settings).unwrap();
                    solver.go_on_from(previous);
                }
                solver.advance(&mut state).unwrap();
            }
            state.position[16]
        };
        let exact = tip(640, false);
        let [coarse, fine] = [40, 80].map(|steps| (tip(steps, false) - exact).norm());
        println!("at {exact:?}: off by {coarse:.2e} and {fine:.2e}");
        assert!(exact.z < -0.3 && coarse / fine > 3.0 && coarse / fine < 5.5, "{exact} {coarse} {fine}");
        assert_eq!(tip(40, false), tip(40, true));
    }

    #[test]
    fn explicit_steps_that_are_too_long_are_refused() {
        let model = clamped(THIN);
        let stable = Explicit::stable_step(&model);
        assert!(Explicit::new(model.clone(), stable).is_ok());
        assert!(matches!(Explicit::new(model.clone(), 1.01 * stable), Err(SolveError::Impossible(_))));
    }

    /// A spring a hundred times as stiff as the strip sets the step, and 2000 steps of it stay bounded.
    #[test]
    fn springs_shorten_the_stable_step() {
        let mut model = clamped(THIN);
        let free = Explicit::stable_step(&model);
        let node = 16;
        let stiffness = 100.0 * 4.0 / (free * free) * model.mass[node];
        model.springs.push(crate::Spring { node: node as u32, anchor: model.place(node), stiffness });
        let step = Explicit::stable_step(&model);
        assert!(step < 0.1 * free && step > 0.09 * free, "{step:e} {free:e}");
        let mut state = State::at_rest(&model);
        state.velocity[node].z = 1e-3;
        let mut solver = Explicit::new(model.clone(), step).unwrap();
        for _ in 0..2000 {
            solver.advance(&mut state).unwrap();
        }
        // What it starts with, kept within the strip and the spring: 1e-3 m/s over the frequency of the spring, and some.
        let off = (state.position[node] - model.place(node)).norm();
        assert!(off < 1e-3 * free, "{off:e}");
    }

    /// Energy of explicit steps oscillates within 1 % in free vibration at large rotation.
    #[test]
    fn explicit_motion_keeps_its_energy() {
        let model = clamped(THIN);
        let mut state = State::at_rest(&model);
        for (v, x) in state.velocity.iter_mut().zip(model.places()) {
            v.z = 1.5 * x.x * x.x;
        }
        let kinetic = |state: &State| -> f64 {
            let nodes = 0..model.rest.len();
            nodes
                .map(|i| {
                    0.5 * model.mass[i] * state.velocity[i].norm_squared()
                        + 0.5 * model.rotary_inertia[i] * state.spin[i].norm_squared()
                })
                .sum()
        };
        let mut solver = Explicit::new(model.clone(), 0.5 * Explicit::stable_step(&model)).unwrap();
        let first = kinetic(&state);
        let mut largest = 0.0_f64;
        for _ in 0..3000 {
            let before = kinetic(&state);
            solver.advance(&mut state).unwrap();
            let energy = 0.5 * (before + kinetic(&state)) + solver.forces().strain_energy();
            largest = largest.max((energy / first - 1.0).abs());
        }
        println!("energy off by {largest:.1e}, tip at {}", state.position[16]);
        assert!(largest < 0.01, "{largest}");
    }

    /// A free strip keeps its momentum and its moment of momentum in implicit steps, to the tolerance of the solution.
    #[test]
    fn a_free_body_keeps_its_momentum() {
        let model = strip(THIN);
        let mut state = State::at_rest(&model);
        for (v, x) in state.velocity.iter_mut().zip(model.places()) {
            *v = Vector3::new(0.1, 0.2 * x.x, 0.5 * x.x * x.x);
        }
        let momentum = |state: &State| {
            let nodes = 0..model.rest.len();
            nodes.fold((Vector3::zeros(), Vector3::zeros()), |(p, l), i| {
                let own = model.mass[i] * state.velocity[i];
                (p + own, l + state.position[i].cross(&own) + model.rotary_inertia[i] * state.spin[i])
            })
        };
        let settings = DynamicSettings { tolerance: 1e-10, ..DynamicSettings::new(2e-3) };
        let mut solver = BackwardEuler::new(model.clone(), settings).unwrap();
        let first = momentum(&state);
        for _ in 0..20 {
            solver.advance(&mut state).unwrap();
        }
        let last = momentum(&state);
        assert!((last.0 - first.0).norm() < 1e-7 * first.0.norm(), "{}", last.0 - first.0);
        // Backward Euler takes x × v of the end: of second order in the step.
        assert!((last.1 - first.1).norm() < 2e-2 * first.1.norm(), "{} {}", last.1, first.1);
    }

    /// Damped, a sagging strip comes to rest where the static solver puts it; all linear solvers go the same way.
    #[test]
    fn damped_motion_ends_in_the_static_equilibrium() {
        let mut model = clamped(THIN);
        weigh(&mut model, 0.5);
        let mut rest = State::at_rest(&model);
        Statics::new(model.clone(), StaticSettings::default()).unwrap().solve(&mut rest, 1.0).unwrap();
        assert!(rest.position[16].z < -0.2, "{}", rest.position[16]);
        // About critical.
        model.model_mut().bodies[0].damping = 2.0 * first_frequency(THIN);
        model.model_mut().stiffness_damping = 0.01;
        let iterative = |preconditioner| LinearSolver::ConjugateGradients {
            tolerance: 1e-8,
            iterations: 5000,
            preconditioner,
        };
        for linear in [
            LinearSolver::Direct,
            iterative(Preconditioner::BlockJacobi),
            iterative(Preconditioner::LaggedFactors { renew_after: 10 }),
        ] {
            let settings = DynamicSettings { linear, ..DynamicSettings::new(1.0) };
            let mut solver = BackwardEuler::new(model.clone(), settings).unwrap();
            let mut state = State::at_rest(&model);
            for _ in 0..60 {
                solver.advance(&mut state).unwrap();
            }
            let off = (state.position[16] - rest.position[16]).norm();
            assert!(off < 1e-5, "{linear:?}: {off:e}");
        }
    }

    /// One linear solution a step follows the converged motion to 2 % of the sag in small steps.
    #[test]
    fn real_time_steps_follow_the_converged_motion() {
        let mut model = clamped(THIN);
        weigh(&mut model, 0.5);
        model.model_mut().bodies[0].damping = 1.0;
        let run = |settings: DynamicSettings| {
            let mut solver = BackwardEuler::new(model.clone(), settings).unwrap();
            let mut state = State::at_rest(&model);
            for _ in 0..100 {
                solver.advance(&mut state).unwrap();
            }
            state.position[16]
        };
        let settings = DynamicSettings::new(0.01);
        let (converged, quick) = (run(settings), run(settings.real_time(LinearSolver::Direct)));
        assert!((converged - quick).norm() < 0.02 * converged.z.abs(), "{converged} {quick}");
    }

    /// Two triangles that fly apart, each damped as its body says: backward Euler slows the one down by 1/(1 + α h) a step, central
    /// differences by (1 − α h/2)/(1 + α h/2), and leave the other alone.
    #[test]
    fn bodies_are_damped_each_by_itself() {
        let triangle =
            |x: f64| [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|[a, b]| Vector3::new(x + a, b, 0.0));
        let mut model = Assembly::new("free", triangle(0.0));
        model.add_body("slow", triangle(5.0));
        for (name, first) in [("free", 0), ("slow", 3)] {
            let material = Wall { elastic: Elasticity { young: 1e3, poisson: 0.3 }, density: 1000.0 };
            model.add_shell(&Shell::new(name, vec![[first, first + 1, first + 2]], 0.1, material)).unwrap();
        }
        let alpha = 2.0;
        model.model_mut().bodies[1].damping = alpha;
        let flying = || {
            let mut state = State::at_rest(&model);
            state.velocity.fill(Vector3::new(0.0, 0.0, 0.5));
            state
        };
        let slowed = |state: &State, ratio: f64| {
            assert!((state.velocity[0].z - 0.5).abs() < 1e-9, "{}", state.velocity[0]);
            assert!((state.velocity[4].z / 0.5 - ratio.powi(10)).abs() < 1e-9, "{}", state.velocity[4]);
        };
        let (mut state, h) = (flying(), 0.05);
        let mut solver = BackwardEuler::new(model.clone(), DynamicSettings::new(h)).unwrap();
        (0..10).for_each(|_| drop(solver.advance(&mut state).unwrap()));
        slowed(&state, 1.0 / (1.0 + alpha * h));
        let (mut state, h) = (flying(), 0.5 * Explicit::stable_step(&model));
        let mut solver = Explicit::new(model.clone(), h).unwrap();
        (0..10).for_each(|_| solver.advance(&mut state).unwrap());
        slowed(&state, (1.0 - 0.5 * alpha * h) / (1.0 + 0.5 * alpha * h));
    }
}
