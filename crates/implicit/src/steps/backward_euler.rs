//! Motion in time by three integrators. Backward Euler minimises elastic energy, loads and Σ m |u − h
//! v|²/(2h²) in a step. Rotation vectors of the step have the same term with the rotary inertia. The backward
//! differentiation formula of second order takes the same step from an extrapolated point (Gear 1971; for
//! unequal steps Hairer, Nørsett and Wanner 1993, III.5). Explicit central differences are the third.
//! Rayleigh damping: α M + β K, with K of the start of the step.
//!
//! Let r = h/h₋ for the present and the previous step, a = r²/(1 + 2r), and h* = h (1 + r)/(1 + 2r). Then x =
//! x₀ + a (x₀ − x₋) + h* v and v = v₀ + a (v₀ − v₋) + h* f/m. Backward Euler has a = 0, h* = h. Rotations are
//! rotation vectors from the start of the step. Leaves out: gyroscopic moments (the lumped inertia of a node
//! is the same about every axis) and step control by accuracy.

use std::sync::Arc;

use nalgebra::Vector3;
use pliant_linear::{LinearDevice, LinearReport, LinearSolver, dot};
use pliant_shells::rotation::{logarithm, spin_to_vector};
use rayon::prelude::*;

use crate::model::assembly::Assembly;
use crate::model::error::SolveError;
use crate::model::state::{AssemblyState, NODES};
use crate::steps::descent::{Contacting, Limits, Vectors, descend};
use crate::steps::limits::within_limits;
use crate::steps::solver::{AssemblySolver, Attempted};
use crate::system::System;

/// Time integrator of an implicit step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Integrator {
    /// First order: a vibration of angular frequency ω is damped by about ω h/2 of critical.
    #[default]
    BackwardEuler,
    /// Second order, by differences of two steps: a vibration is damped by about (ω h)³/4 of critical. The
    /// first step, and a step after a halved one, use backward Euler.
    Bdf2,
}

/// Settings of implicit steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DynamicSettings {
    /// Length of a step [s].
    pub step: f64,
    /// Time integrator.
    pub integrator: Integrator,
    /// Iterations of Newton's method at the most. With 1 each step is one linear solution and nothing is
    /// checked: for real time.
    pub iterations: usize,
    /// Residual allowed, as a part of loads, internal or inertial forces, whichever are larger.
    pub tolerance: f64,
    /// Speed [m/s] of all nodes below which a Newton step in contact is the last one. If not given, the last
    /// Newton step must move every node by less than counts for a gap.
    pub speed_tolerance: Option<f64>,
    /// True if a step takes what its iterations have reached when they run out, instead of being halved. Time
    /// is then bounded and accuracy unchecked; [`DynamicStep::converged`] is false. In contact such a state
    /// has no intersection.
    pub accept_unconverged: bool,
    /// Number of times that a failing step is halved.
    pub halvings: usize,
    /// Solver of the linear equations.
    pub linear: LinearSolver,
    /// True if conjugate gradients return what they have reached when their iterations run out. Time is then
    /// bounded and accuracy unchecked; `DynamicStep::linear` holds the residual.
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
    /// Residual over the largest of loads, internal and inertial forces, before each iteration and, but for a
    /// single one, at the end.
    pub residuals: Vec<f64>,
    /// Report on the last linear solution.
    pub linear: LinearReport,
    /// Steps that it took: 1, or more where it was halved.
    pub parts: usize,
    /// True if the residuals of all parts came below the tolerance, or no check was wanted.
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
    start: AssemblyState,
    /// State a whole step before, for differences of second order. `None` after a start or a step that was
    /// halved.
    previous: Option<Box<AssemblyState>>,
    differences: Differences,
    /// No step was taken so far: the state may be off the curves of prescribed components.
    fresh: bool,
    attempts: Vec<Attempted>,
}

/// The equation of a step: positions are `shift` further on plus `step` times the new velocities, these
/// `rate` further on plus `step` times accelerations.
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
    fn set(&mut self, h: f64, start: &AssemblyState, previous: Option<&AssemblyState>) {
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

/// Resistance of inertia and mass-proportional damping in a step.
struct Momentum<'a> {
    model: &'a Assembly,
    differences: &'a Differences,
    start: &'a AssemblyState,
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

    /// Makes a solver with a device, if one is given, that solves the equations by conjugate gradients with
    /// blocks or aggregates. Their tolerance holds in double precision.
    ///
    /// # Errors
    /// Like [`new`](Self::new), and if the device fails or has no room, or another linear solver is set.
    pub fn on(
        device: Option<Arc<dyn LinearDevice>>,
        model: impl Into<Arc<Assembly>>,
        settings: DynamicSettings,
    ) -> Result<Self, SolveError> {
        let model = model.into();
        let system = System::on(device, Arc::clone(&model), settings.linear)?;
        let (components, free) = (6 * model.rest.len(), system.stiffness.equations.count());
        Ok(Self {
            settings,
            length: model.mean_edge(),
            damping: model.damping(),
            round_off: model.round_off(),
            pending: vec![0.0; components],
            moved: vec![0.0; components],
            increment: vec![0.0; components],
            residual: vec![0.0; free],
            solution: vec![0.0; free],
            product: vec![0.0; free],
            start: AssemblyState::at_rest(&model),
            previous: None,
            differences: Differences::default(),
            attempts: Vec::new(),
            fresh: true,
            system,
        })
    }

    /// Settings of its steps.
    pub fn settings(&self) -> &DynamicSettings {
        &self.settings
    }

    /// State a step before, if the next step takes differences with it.
    pub fn previous(&self) -> Option<&AssemblyState> {
        self.previous.as_deref()
    }

    /// Takes the state a step before from another solver, so that this solver continues where that one
    /// stopped.
    pub fn go_on_from(&mut self, previous: Option<AssemblyState>) {
        self.previous = previous.map(Box::new);
    }

    /// Makes one step.
    ///
    /// # Errors
    /// If it fails as often as it may be halved; the state then is at the last part of it that was made.
    pub fn advance(&mut self, state: &mut AssemblyState) -> Result<DynamicStep, SolveError> {
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
    fn newton(&mut self, state: &mut AssemblyState, h: f64) -> Result<DynamicStep, SolveError> {
        let time = state.time + h;
        let allowed = self.settings.tolerance;
        self.attempts.push(Attempted { time, allowed, ..Attempted::default() });
        self.system.prescribed(state.time, time, &mut self.pending);
        self.system.begin_step(&state.history, h);
        let converged = if self.system.contact.is_some() {
            self.newton_in_contact(state, h)?
        } else {
            within_limits(self, state, time, |solver, state| solver.newton_without_contact(state, h))?
        };
        self.end(state, time);
        let linear = self.system.stiffness.last_solution;
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

    /// [`newton`](Self::newton) without contact; whether the residual has come below the tolerance, or was
    /// not asked for.
    fn newton_without_contact(&mut self, state: &mut AssemblyState, h: f64) -> Result<bool, SolveError> {
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
                self.system.stiffness.take_damper();
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
            // The motion continues, to begin with.
            let going_on = if iteration == 0 { h } else { 0.0 };
            match self.find_direction(going_on) {
                Err(error) if self.system.gives_way(&error) => {
                    let tangent = Some(&self.pending[..]);
                    self.system.evaluate(state, time, tangent)?;
                    self.find_residual(state);
                    let found = self.find_direction(going_on);
                    self.system.facets.exact_pressure = true;
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
    fn newton_in_contact(&mut self, state: &mut AssemblyState, h: f64) -> Result<bool, SolveError> {
        let time = state.time + h;
        self.moved.fill(0.0);
        if !self.system.stiffness.damper.is_empty() {
            // Without friction, which the step has yet to find.
            if let Some(contact) = &mut self.system.contact {
                contact.stand(state);
            }
            self.system.evaluate(state, time, Some(&self.pending))?;
            self.system.stiffness.take_damper();
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
    fn end(&mut self, state: &mut AssemblyState, time: f64) {
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

    /// Solves for the residual, starting from a motion that continues for a time [s].
    fn find_direction(&mut self, going_on: f64) -> Result<(), SolveError> {
        self.add_inertia();
        self.system.prepare()?;
        for (guess, &component) in self.solution.iter_mut().zip(&self.system.stiffness.equations.component) {
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
    fn find_motion(&mut self, state: &AssemblyState) {
        let Self { moved, start, .. } = self;
        moved.par_chunks_exact_mut(6).enumerate().with_min_len(NODES).for_each(|(node, moved)| {
            moved[..3].copy_from_slice((state.position[node] - start.position[node]).as_slice());
            let turn = state.rotation[node] * start.rotation[node].inverse();
            moved[3..].copy_from_slice(logarithm(&turn).as_slice());
        });
    }

    /// Finds loads less internal, inertial and damping forces on the free components. Returns the norm of
    /// this residual, and the largest norm among loads, internal and inertial forces.
    fn find_residual(&mut self, state: &AssemblyState) -> (f64, f64) {
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
                let load = part(&system.forces.external, first)
                    + state.load_factor * part(&system.forces.controlled, first);
                let internal = part(&system.forces.internal, first);
                let momentum = momentum.of(node, first);
                loads += weight * load.norm_squared();
                resistance += weight * internal.norm_squared();
                inertia += weight * momentum.norm_squared();
                let sum = load - internal - momentum;
                for c in 0..3 {
                    let equation = system.stiffness.equations.number[at + first + c];
                    if equation != pliant_linear::sparse::NONE {
                        self.residual[equation as usize] = sum[c];
                    }
                }
            }
        }
        if !system.stiffness.damper.is_empty() {
            system.gather(moved, &mut self.solution);
            if !shift.is_empty() {
                let shifted =
                    system.stiffness.equations.component.iter().map(|&component| shift[component as usize]);
                self.solution.iter_mut().zip(shifted).for_each(|(moved, shift)| *moved -= shift);
            }
            system.stiffness.matrix.multiply_values(
                &system.stiffness.damper,
                &self.solution,
                &mut self.product,
            );
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
        for (&component, residual) in system.stiffness.equations.component.iter().zip(&self.residual) {
            norm += residual * residual * if component % 6 < 3 { 1.0 } else { arm };
        }
        self.residual.iter_mut().zip(&system.stiffness.coupling).for_each(|(r, c)| *r -= c);
        (norm.sqrt(), f64::max(loads, f64::max(resistance, inertia)).sqrt())
    }

    /// K + (1/h*² + α/h*) M + β/h* K.
    fn add_inertia(&mut self) {
        let (model, h) = (Arc::clone(&self.system.model), self.differences.step);
        let factor = model.stiffness_damping / h;
        self.system
            .stiffness
            .matrix
            .value
            .iter_mut()
            .zip(&self.system.stiffness.damper)
            .for_each(|(k, d)| *k += factor * d);
        let Self { system, differences, start, moved, damping, .. } = self;
        let momentum = Momentum { model: &model, differences, start, moved, damping };
        let rate = |node: u32| 1.0 / (h * h) + damping[node as usize] / h;
        let components = &system.stiffness.equations.component;
        system.stiffness.matrix.add_to_each_diagonal(|equation| {
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
        let residuals = self.system.stiffness.equations.component.iter().zip(&self.residual);
        let largest = residuals.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        largest.map_or(0, |(component, _)| component / 6)
    }
}

/// Number of times that a step updates its friction.
const LAGS: usize = 1;

impl AssemblySolver for BackwardEuler {
    fn system(&self) -> &System {
        &self.system
    }

    fn system_mut(&mut self) -> &mut System {
        &mut self.system
    }

    fn attempts(&self) -> &[Attempted] {
        &self.attempts
    }

    fn tolerance(&self) -> f64 {
        self.settings.tolerance
    }
}

impl Contacting for BackwardEuler {
    const INERTIA: bool = true;

    fn vectors(&mut self) -> Vectors<'_> {
        let Self { system, pending, increment, residual, solution, .. } = self;
        Vectors { system, pending, increment, residual, solution }
    }

    fn evaluate(&mut self, state: &AssemblyState, time: f64, tangent: bool) -> Result<(), SolveError> {
        self.find_motion(state);
        self.system.evaluate(state, time, tangent.then_some(&self.pending[..]))
    }

    fn find_residual(&mut self, state: &AssemblyState) -> (f64, f64) {
        let (norm, scale) = Self::find_residual(self, state);
        (norm, self.settings.tolerance * scale + self.round_off)
    }

    /// Energy Σ m |u − s − h v|²/(2 h²) + α m |u − s|²/(2 h), with the same terms for rotation vectors, and β
    /// (u − s)ᵀ K (u − s)/(2 h).
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
        if !self.system.stiffness.damper.is_empty() {
            let mut moved = vec![0.0; self.product.len()];
            self.system.gather(&self.moved, &mut moved);
            let shift =
                |component: &u32| self.differences.shift.get(*component as usize).copied().unwrap_or(0.0);
            let components = &self.system.stiffness.equations.component;
            moved.iter_mut().zip(components).for_each(|(moved, component)| *moved -= shift(component));
            self.system.stiffness.matrix.multiply_values(
                &self.system.stiffness.damper,
                &moved,
                &mut self.product,
            );
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
