//! Static equilibria: Newton's method with load steps; displacement control and arc length (Crisfield 1981)
//! past limit points; a prescribed volume for balloons. A control finds the factor of the controlled loads as
//! one more unknown. Only tension holds nodes of membranes and bars crosswise. They get an artificial
//! stiffness on the diagonal, proportional to the largest residual on them (Levenberg 1944, Marquardt 1963).
//! This stiffness bounds their motion in an iteration and vanishes at equilibrium. Leaves out: branch
//! switching at bifurcations.

mod control;
mod held;

use std::sync::Arc;

use nalgebra::Vector3;
use pliant_linear::sparse::NONE;
use pliant_linear::{LinearSolver, dot};
use pliant_mechanics::model::{Cells, Solid};

pub use self::control::Control;
pub use self::held::check_held;
use crate::model::assembly::Assembly;
use crate::model::error::SolveError;
use crate::model::state::AssemblyState;
use crate::steps::descent::{Contacting, Limits, Vectors, descend};
use crate::steps::limits::within_limits;
use crate::steps::solver::{AssemblySolver, Attempted};
use crate::system::System;

/// Settings of the search for equilibria.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StaticSettings {
    /// Iterations of Newton's method at most in a load step.
    pub iterations: usize,
    /// Number of times that a failing load step is halved.
    pub halvings: usize,
    /// Residual allowed, as a part of the loads or the internal forces, whichever are larger.
    pub tolerance: f64,
    /// Residual allowed, as a part of the largest force on a node of an element: what round-off leaves.
    pub floor: f64,
    /// Largest rotation of a node in an iteration [rad].
    pub rotation_limit: f64,
    /// True if iterations that make the residual along them ten times as large are shortened. The first two
    /// are not shortened: thin shells overshoot there and then converge quadratically.
    pub line_search: bool,
    /// Solver of the linear equations.
    pub linear: LinearSolver,
}

impl Default for StaticSettings {
    fn default() -> Self {
        Self {
            iterations: 40,
            halvings: 8,
            tolerance: 1e-8,
            floor: 1e-7,
            rotation_limit: 0.7,
            line_search: true,
            linear: LinearSolver::Direct,
        }
    }
}

/// Growth of the residual along an increment above which it is shortened. With 1 the slit annulus takes a
/// fifth more iterations.
const GROWTH: f64 = 10.0;

/// Largest motion of a node of a membrane by its residual in an iteration, as a part of the extent of the
/// membranes.
const REACH: f64 = 0.1;

/// The least artificial stiffness of membranes, as a part of the largest stiffness of a cell.
const LEAST: f64 = 1e-12;

/// A load step that found its equilibrium.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Step {
    /// Time at its end.
    pub time: f64,
    /// Norm of the residual [N] before each iteration and at the end; moments are divided by the mean edge.
    pub residuals: Vec<f64>,
    /// Negative pivots of the last stiffness: above 0 the equilibrium is unstable. With conjugate gradients
    /// those that factors in their preconditioner show.
    pub negative_pivots: usize,
    /// Load steps that it took: 1, or more where it was halved.
    pub parts: usize,
}

/// A static solver.
pub struct Statics {
    system: System,
    settings: StaticSettings,
    /// Equations of the translations of nodes that only membranes and bars hold.
    slack: Vec<u32>,
    /// Largest motion of these nodes by a residual in an iteration [m], and their least artificial stiffness
    /// [N/m].
    reach: f64,
    least: f64,
    /// Attempts of the last call.
    attempts: Vec<Attempted>,
    /// Mean edge [m]: divides moments to compare them with forces.
    length: f64,
    /// Round-off in a residual, about ε E t |x| a node [N].
    round_off: f64,
    /// Increments of prescribed components still to come, six a node.
    pending: Vec<f64>,
    increment: Vec<f64>,
    residual: Vec<f64>,
    solution: Vec<f64>,
    /// Solution for the controlled loads, and its right-hand side.
    response: Vec<f64>,
    controlled: Vec<f64>,
    /// Gradient of the controlled quantity, six a node.
    gradient: Vec<f64>,
    /// The last step's translations, six a node: the direction in which arc length continues.
    direction: Vec<f64>,
    /// No step was taken so far: the state may be off the curves of prescribed components.
    fresh: bool,
}

/// An attempt that failed.
struct Attempt {
    error: SolveError,
    /// True if smaller load steps may help.
    retry: bool,
}

impl From<SolveError> for Attempt {
    fn from(error: SolveError) -> Self {
        Self { error, retry: true }
    }
}

impl Statics {
    /// A solver for a model.
    ///
    /// # Errors
    /// If a part of the model is free to move as a rigid body.
    pub fn new(model: impl Into<Arc<Assembly>>, settings: StaticSettings) -> Result<Self, SolveError> {
        let model = model.into();
        check_held(&model)?;
        let system = System::new(Arc::clone(&model), settings.linear)?;
        let (components, free) = (6 * model.rest.len(), system.stiffness.equations.count());
        let (slack, extent) = slack(&model, &system);
        Ok(Self {
            settings,
            slack,
            reach: REACH * extent,
            least: LEAST * model.stiffest(),
            attempts: Vec::new(),
            length: model.mean_edge(),
            round_off: model.round_off(),
            pending: vec![0.0; components],
            increment: vec![0.0; components],
            gradient: vec![0.0; components],
            direction: vec![0.0; components],
            residual: vec![0.0; free],
            solution: vec![0.0; free],
            response: vec![0.0; free],
            controlled: vec![0.0; free],
            fresh: true,
            system,
        })
    }

    /// The translations [m] of the last step, six components a node: the next arc length follows them.
    pub fn direction(&self) -> &[f64] {
        &self.direction
    }

    /// Takes up the [direction](Self::direction) of another solver of the same model; without one, that in
    /// which the load grows.
    pub fn go_on_along(&mut self, direction: &[f64]) {
        self.direction.fill(0.0);
        self.direction[..direction.len()].copy_from_slice(direction);
    }

    /// Settings of its steps.
    pub fn settings(&self) -> &StaticSettings {
        &self.settings
    }

    /// Forces and moments on each node of the model from its elements, less its loads, at the last
    /// evaluation. On held components these are the reactions [N, N m], six a node.
    pub fn reactions(&self) -> impl Iterator<Item = [f64; 6]> {
        let nodes =
            self.system.forces.internal.chunks_exact(6).zip(self.system.forces.external.chunks_exact(6));
        nodes.map(|(internal, external)| [0, 1, 2, 3, 4, 5].map(|c| internal[c] - external[c]))
    }

    /// Displacements and rotations (six a node) by linear theory about a state: one solution with the loads
    /// and motions of a time. The stiffness is taken at the state under the loads of its time, so it does not
    /// depend on the size of the new loads.
    ///
    /// # Errors
    /// If the stiffness is singular or conjugate gradients fail.
    pub fn linear(&mut self, state: &AssemblyState, time: f64) -> Result<Vec<[f64; 6]>, SolveError> {
        self.begin(state, time);
        self.system.prescribed(state.time, time, &mut self.pending);
        self.system.begin_step(&state.history, time - state.time);
        self.system.evaluate(state, state.time, Some(&self.pending))?;
        self.system.evaluate(state, time, None)?;
        self.find_residual(state);
        self.system.prepare()?;
        self.system.solve(&self.residual, &mut self.solution)?;
        let mut displacements = self.pending.clone();
        self.system.spread(&self.solution, &mut displacements);
        Ok(displacements.chunks_exact(6).map(|c| [c[0], c[1], c[2], c[3], c[4], c[5]]).collect())
    }

    /// Begins a load step to a time [s]. In the first one comes in what the state is off its curves.
    fn begin(&mut self, state: &AssemblyState, until: f64) {
        if std::mem::take(&mut self.fresh) {
            self.system.catch_up(state, until);
        }
    }

    /// The equilibrium at a time. A load step that fails is halved.
    ///
    /// # Errors
    /// If a step fails as often as it may be halved; the state then is at the last equilibrium found on the
    /// way.
    pub fn solve(&mut self, state: &mut AssemblyState, until: f64) -> Result<Step, SolveError> {
        self.attempts.clear();
        let mut done = Step::default();
        let mut size = until - state.time;
        let mut halvings = 0;
        let mut broken = None;
        self.begin(state, until);
        self.system.begin_history(state);
        loop {
            let rest = until - state.time;
            let target = if size >= rest * (1.0 - 1e-12) { until } else { state.time + size };
            let before = state.clone();
            match self.newton(state, target, None) {
                Ok(step) => {
                    done = Step { parts: done.parts + 1, ..step };
                    if target == until {
                        return Ok(done);
                    }
                }
                Err(Attempt { error, retry }) => {
                    *state = before;
                    if !retry || error.is_final() || halvings == self.settings.halvings {
                        return Err(self.system.blocked_at(state, error.after(broken)));
                    }
                    broken = error.broken().or(broken);
                    halvings += 1;
                    size *= 0.5;
                }
            }
        }
    }

    /// A step under a control to a time [s]. A step that fails is split into two halves, `halvings` times at
    /// most.
    fn halved(
        &mut self,
        state: &mut AssemblyState,
        control: Control,
        until: f64,
        halvings: usize,
    ) -> Result<Step, Attempt> {
        let before = state.clone();
        match self.newton(state, until, Some(control)) {
            Ok(step) => {
                for (direction, (now, then)) in
                    self.direction.chunks_exact_mut(6).zip(state.position.iter().zip(&before.position))
                {
                    direction[..3].copy_from_slice((now - then).as_slice());
                }
                Ok(Step { parts: 1, ..step })
            }
            Err(Attempt { retry: true, error: larger }) if halvings > 0 && !larger.is_final() => {
                *state = before;
                let [first, second] = self.halves(control, state);
                let middle = state.time.midpoint(until);
                let explained =
                    |Attempt { error, retry }| Attempt { error: error.after(larger.broken()), retry };
                let parts = self.halved(state, first, middle, halvings - 1).map_err(explained)?.parts;
                let step = self.halved(state, second, until, halvings - 1).map_err(explained)?;
                Ok(Step { parts: parts + step.parts, ..step })
            }
            Err(attempt) => Err(attempt),
        }
    }

    /// Newton's method from a state, kept with the other attempts.
    fn newton(
        &mut self,
        state: &mut AssemblyState,
        time: f64,
        control: Option<Control>,
    ) -> Result<Step, Attempt> {
        self.attempts.push(Attempted { time, ..Attempted::default() });
        let result = self.iterate(state, time, control);
        if let Some(attempt) = self.attempts.last_mut() {
            (attempt.found, attempt.load_factor) = (result.is_ok(), state.load_factor);
        }
        result
    }

    fn iterate(
        &mut self,
        state: &mut AssemblyState,
        time: f64,
        control: Option<Control>,
    ) -> Result<Step, Attempt> {
        let start = state.clone();
        self.system.prescribed(state.time, time, &mut self.pending);
        self.system.begin_step(&start.history, time - start.time);
        if self.system.contact.is_some() {
            let step = self.iterate_in_contact(state, time, control)?;
            self.system.end_step(Some(&start), state, time - start.time);
            return Ok(step);
        }
        let mut residuals = Vec::new();
        let negative_pivots = within_limits(self, state, time, |solver, state| {
            solver.iterate_without_contact(state, time, control, &mut residuals)
        })?;
        self.system.end_step(Some(&start), state, time - start.time);
        state.time = time;
        Ok(Step { time, residuals, negative_pivots, parts: 0 })
    }

    /// [`iterate`](Self::iterate) without contact; the negative pivots of the last stiffness.
    fn iterate_without_contact(
        &mut self,
        state: &mut AssemblyState,
        time: f64,
        control: Option<Control>,
        residuals: &mut Vec<f64>,
    ) -> Result<usize, Attempt> {
        let failed = |error| Attempt { error, retry: true };
        let start = state.clone();
        let mut negative_pivots = 0;
        for iteration in 0..=self.settings.iterations {
            self.system.evaluate(state, time, Some(&self.pending)).map_err(failed)?;
            let (norm, allowed) = self.find_residual(state);
            residuals.push(norm);
            if let Some(attempt) = self.attempts.last_mut() {
                attempt.residuals.push(norm);
                attempt.allowed = allowed;
            }
            let gap = control.map_or(0.0, |control| self.constraint(control, state, &start));
            let complete = self.pending.iter().all(|&p| p == 0.0) && self.system.conditions.are_closed();
            let controlled = gap.abs() <= self.allowed_gap(control);
            if iteration > 0 && complete && controlled && norm <= allowed {
                return Ok(negative_pivots);
            }
            if !norm.is_finite() || iteration == self.settings.iterations {
                break;
            }
            negative_pivots = match self.find_direction() {
                Err(error) if self.system.gives_way(&error) => {
                    let tangent = Some(&self.pending[..]);
                    self.system.evaluate(state, time, tangent).map_err(failed)?;
                    self.find_residual(state);
                    let pivots = self.find_direction();
                    self.system.facets.exact_pressure = true;
                    pivots.map_err(failed)?
                }
                found => found.map_err(failed)?,
            };
            let factor = match control {
                Some(control) => self.controlled_factor(control, gap, iteration == 0)?,
                None => 0.0,
            };
            self.increment.copy_from_slice(&self.pending);
            self.system.spread(&self.solution, &mut self.increment);
            let part = self.allowed_part();
            self.system.advance(state, &self.increment, part);
            state.load_factor += part * factor;
            self.pending.iter_mut().for_each(|p| *p *= 1.0 - part);
            if self.settings.line_search && iteration > 1 && control.is_none() && part == 1.0 {
                self.shorten(state, time)?;
            }
        }
        let (node, residuals) = (self.worst_node(), std::mem::take(residuals));
        Err(failed(SolveError::NotConverged { time, node, residuals, broken: None }))
    }

    /// [`iterate`](Self::iterate) in contact.
    fn iterate_in_contact(
        &mut self,
        state: &mut AssemblyState,
        time: f64,
        control: Option<Control>,
    ) -> Result<Step, Attempt> {
        if control.is_some() {
            let error = SolveError::Impossible(
                "a controlled load cannot be combined with contact; prescribe the load, or leave the contact \
                 out",
            );
            return Err(Attempt { error, retry: false });
        }
        let mut residuals = Vec::new();
        let mut last = 0.0;
        let limits = Limits {
            iterations: self.settings.iterations,
            lags: LAGS,
            close: None,
            accept: false,
            farthest: f64::INFINITY,
        };
        let result = within_limits(self, state, time, |solver, state| {
            descend(solver, state, time, None, &limits, &mut |norm, allowed| {
                residuals.push(norm);
                last = allowed;
            })
        });
        if let Some(attempt) = self.attempts.last_mut() {
            (attempt.residuals, attempt.allowed) = (residuals.clone(), last);
        }
        match result {
            Ok(_) => {
                state.time = time;
                Ok(Step { time, residuals, negative_pivots: 0, parts: 0 })
            }
            Err(SolveError::NotConverged { time, node, broken, .. }) => Err(Attempt {
                error: SolveError::NotConverged { time, node, residuals, broken },
                retry: true,
            }),
            Err(error) => Err(Attempt { retry: true, error }),
        }
    }

    /// Solves for the residual; the negative pivots of the stiffness.
    fn find_direction(&mut self) -> Result<usize, SolveError> {
        self.stiffen_slack();
        let negative_pivots = self.system.prepare()?;
        self.system.solve(&self.residual, &mut self.solution)?;
        Ok(negative_pivots)
    }

    /// Finds loads less internal forces on the free components. Returns the norm and its tolerance [N].
    fn find_residual(&mut self, state: &AssemblyState) -> (f64, f64) {
        let system = &mut self.system;
        for (load, controlled) in system.forces.external.iter_mut().zip(&system.forces.controlled) {
            *load += state.load_factor * controlled;
        }
        let arm = self.length;
        let norm = |values: &mut dyn Iterator<Item = (usize, f64)>| {
            values.map(|(c, v)| if c % 6 < 3 { v * v } else { v * v / (arm * arm) }).sum::<f64>().sqrt()
        };
        let external = norm(&mut system.forces.external.iter().copied().enumerate());
        let internal = norm(&mut system.forces.internal.iter().copied().enumerate());
        for (&component, residual) in system.stiffness.equations.component.iter().zip(&mut self.residual) {
            *residual =
                system.forces.external[component as usize] - system.forces.internal[component as usize];
        }
        system.conditions.relieve(&mut self.residual);
        let free = norm(
            &mut system
                .stiffness
                .equations
                .component
                .iter()
                .map(|&c| c as usize)
                .zip(self.residual.iter().copied()),
        );
        for (residual, coupling) in self.residual.iter_mut().zip(&system.stiffness.coupling) {
            *residual -= coupling;
        }
        let StaticSettings { tolerance, floor, .. } = self.settings;
        let allowed = tolerance * external.max(internal) + floor * system.forces.largest + self.round_off;
        (free, allowed)
    }

    /// Adds the artificial stiffness of membranes.
    fn stiffen_slack(&mut self) {
        let force = |&equation: &u32| self.residual[equation as usize].abs();
        let largest = self.slack.iter().map(force).fold(0.0, f64::max);
        let stiffness = (largest / self.reach).max(self.least);
        for &equation in &self.slack {
            self.system.stiffness.matrix.add_diagonal(equation as usize, stiffness);
        }
    }

    fn worst_node(&self) -> u32 {
        let system = &self.system;
        let size = |(&component, &residual): (&u32, &f64)| {
            (if component % 6 < 3 { residual.abs() } else { residual.abs() / self.length }, component / 6)
        };
        let residuals = system.stiffness.equations.component.iter().zip(&self.residual).map(size);
        residuals.fold((f64::NEG_INFINITY, 0), |worst, next| if next.0 > worst.0 { next } else { worst }).1
    }

    /// The part of the increment that turns no node by more than the limit.
    fn allowed_part(&self) -> f64 {
        let turn = |c: &[f64]| Vector3::new(c[3], c[4], c[5]).norm();
        let largest = self.increment.chunks_exact(6).map(turn).fold(0.0, f64::max);
        (self.settings.rotation_limit / largest).min(1.0)
    }

    /// Halves the last increment up to three times while the residual along it, |Δ·r|, is far above what it
    /// was.
    fn shorten(&mut self, state: &mut AssemblyState, time: f64) -> Result<(), Attempt> {
        let before = dot(&self.solution, &self.residual).abs();
        let mut left = 1.0;
        for _ in 0..3 {
            let now = match self.system.evaluate(state, time, None) {
                Ok(()) => {
                    self.find_residual(state);
                    dot(&self.solution, &self.residual).abs()
                }
                Err(SolveError::Broken { .. }) => f64::INFINITY,
                Err(error) => return Err(Attempt { error, retry: true }),
            };
            if now <= GROWTH * before {
                break;
            }
            left *= 0.5;
            self.system.advance(state, &self.increment, -left);
        }
        Ok(())
    }
}

/// Number of times that a load step updates its friction.
const LAGS: usize = 20;

impl AssemblySolver for Statics {
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

impl Contacting for Statics {
    const INERTIA: bool = false;

    fn vectors(&mut self) -> Vectors<'_> {
        let Self { system, pending, increment, residual, solution, .. } = self;
        Vectors { system, pending, increment, residual, solution }
    }

    fn evaluate(&mut self, state: &AssemblyState, time: f64, tangent: bool) -> Result<(), SolveError> {
        self.system.evaluate(state, time, tangent.then_some(&self.pending[..]))
    }

    fn find_residual(&mut self, state: &AssemblyState) -> (f64, f64) {
        Self::find_residual(self, state)
    }

    fn potential(&mut self) -> f64 {
        0.0
    }

    fn complete(&mut self) {
        self.stiffen_slack();
    }

    fn part(&self) -> f64 {
        self.allowed_part()
    }

    fn accepts(&self, before: f64, after: f64) -> bool {
        after.abs() <= before.abs()
    }

    fn worst(&self) -> u32 {
        self.worst_node()
    }
}

/// Translational equations of the nodes that belong to membranes and bars only, and the extent of these nodes
/// [m].
fn slack(model: &Assembly, system: &System) -> (Vec<u32>, f64) {
    let mut slack = vec![false; model.rest.len()];
    let bends = |solid: &Solid| !matches!(solid.cells, Cells::Membrane(..) | Cells::Bar(..));
    for bending in [false, true] {
        let mut mark = |nodes: &[u32]| nodes.iter().for_each(|&node| slack[node as usize] = !bending);
        let facets = model.facets.iter().filter(|facet| facet.bends() == bending);
        facets.for_each(|facet| mark(&facet.nodes));
        for solid in model.solids.iter().filter(|solid| bends(solid) == bending) {
            (0..solid.cells.len()).for_each(|cell| mark(solid.cells.nodes(cell)));
        }
    }
    let nodes: Vec<usize> = (0..slack.len()).filter(|&node| slack[node]).collect();
    let (mut low, mut high) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    for &node in &nodes {
        (low, high) = (low.inf(&model.place(node)), high.sup(&model.place(node)));
    }
    let equations =
        nodes.iter().flat_map(|node| (0..3).map(move |c| system.stiffness.equations.number[6 * node + c]));
    (equations.filter(|&equation| equation != NONE).collect(), (high - low).norm())
}
