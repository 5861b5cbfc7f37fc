//! Shells, and solids whose equations are solved, as a participant.

use std::collections::VecDeque;
use std::fmt::Write;
use std::sync::Arc;

#[cfg(feature = "gpu")]
use nalgebra::UnitQuaternion;
use nalgebra::Vector3;
use pliant_contact::lag::Lag;
use pliant_contact::pose::Leg;
use pliant_contact::pressure::{faces, pressures};
use pliant_explicit::{Clock, NodeContact, Wanted};
#[cfg(feature = "gpu")]
use pliant_gpu::GpuShells;
use pliant_implicit::{
    Assembly, Attempted, BackwardEuler, DynamicSettings, Explicit, Forces, Phases, SolveError, Spring, State,
    Statics, TouchingNow, TouchingSystem,
};
#[cfg(feature = "gpu")]
use pliant_linear::LinearDevice;
use pliant_mechanics::count;
use pliant_mechanics::grip::{Grip, ROOM};
use pliant_mechanics::mapping::Mapping;
use pliant_mechanics::model::{Enclosed, Motion};
use pliant_mechanics::tensor::Vector;
use pliant_mechanics::{Energies, StopFlag, fingerprint};
use serde::{Deserialize, Serialize};

use crate::bodies::{ImplicitBodies, RunControl, Stop};
use crate::failure::{BlockedDriver, FailedLoadStep, Failure};
use crate::instant::{CellsNow, Effort, Instant};
use crate::kept::{ContactState, ImplicitState, Iterated, Kept, PlainState};
use crate::part::{self, Part};
use crate::participant::Participant;
use crate::solids::SolidCells;
use crate::solver::LoadStepProgress;
use crate::steps::Steps;
use pliant_geometry::words::{counted, number};

/// Stiffness of the firmest grip over that of the stiffest cell.
const FIRM: f64 = 10.0;

/// Iterations of Newton's method whose residuals are kept: the last ones.
const ITERATIONS_KEPT: usize = 10_000;

/// A run of shells, and of solids whose equations are solved.
pub(crate) struct Implicit {
    /// Bodies, and the constraints whose reactions are asked for.
    model: Arc<pliant_mechanics::Model>,
    bodies: Arc<ImplicitBodies>,
    method: SolverMethod,
    /// Steps of the whole run.
    steps: Steps,
    state: State,
    /// Whole steps done, and the time [s] they end at.
    done: u64,
    time: f64,
    /// Which components of each node are held or moved, six a node.
    prescribed: Vec<bool>,
    /// The constraint that has the reaction of each component: the first, where two prescribe the same.
    owners: Vec<[u32; 3]>,
    /// Force [N] and moment [N m] on each node from outside at the instant before, six a node, with its positions and rotations.
    before: Option<(Vec<f64>, State)>,
    /// The same forces at the instant that is evaluated.
    outside: Vec<f64>,
    energies: Energies,
    reactions: Vec<[f64; 3]>,
    /// What constraints of volume enclose.
    enclosed: Vec<Option<Enclosed>>,
    evaluated: bool,
    /// Whether the work to the instant is entered.
    entered: bool,
    effort: Effort,
    /// What was taken before the run was resumed.
    effort_before: Effort,
    /// Residuals of the last iterations.
    convergence: VecDeque<Iterated>,
    /// The path of a run by arc length so far.
    path: Path,
    grips: Vec<Grip>,
    springs: Vec<Spring>,
    /// What contacts do at the instant; `None` without contacts, and at the start before they are looked at.
    touching: Option<TouchingNow>,
    /// Displacements of the solids at the instant last evaluated; `None` without solids.
    solids: Option<pliant_explicit::State<f64>>,
    /// What takes explicit steps; `None`: the CPU. Forces at instants are found on the CPU, as are energies and reactions.
    #[cfg(feature = "gpu")]
    device: Option<ShellsOnDevice>,
}

/// Explicit shells on a GPU, and the forces [N] on their nodes from outside.
#[cfg(feature = "gpu")]
struct ShellsOnDevice {
    stepper: GpuShells,
    pushed: Vec<(u32, [f64; 3])>,
}

/// Most steps that a GPU takes before a run reports progress and can be stopped.
#[cfg(feature = "gpu")]
const STRIDE: u64 = 1024;

/// How far a run by arc length is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Path {
    /// Load factor at the step before.
    factor: f64,
    /// Its last change.
    change: f64,
    #[serde(deserialize_with = "count::read")]
    limit_points: u32,
    /// Why it ended before its last step.
    ended: Option<String>,
    /// Of a path that is kept, [where it goes on](Statics::direction).
    direction: Vec<f64>,
}

/// A solver, and the forces at an instant: an explicit one finds them anyway.
enum SolverMethod {
    Static(Box<Statics>, Forces),
    Implicit(Box<BackwardEuler>, Forces),
    Explicit(Box<Explicit>),
}

impl SolverMethod {
    /// The forces last found.
    fn forces(&self) -> &Forces {
        match self {
            Self::Static(_, forces) | Self::Implicit(_, forces) => forces,
            Self::Explicit(solver) => solver.forces(),
        }
    }

    /// Contacts; `None` without any.
    fn touching(&self) -> Option<&TouchingSystem> {
        match self {
            Self::Static(solver, _) => solver.touching(),
            Self::Implicit(solver, _) => solver.touching(),
            Self::Explicit(_) => None,
        }
    }

    fn touching_mut(&mut self) -> Option<&mut TouchingSystem> {
        match self {
            Self::Static(solver, _) => solver.touching_mut(),
            Self::Implicit(solver, _) => solver.touching_mut(),
            Self::Explicit(_) => None,
        }
    }

    /// The attempts of the last step, one after the other.
    fn attempts(&self) -> &[Attempted] {
        match self {
            Self::Static(solver, _) => solver.attempts(),
            Self::Implicit(solver, _) => solver.attempts(),
            Self::Explicit(_) => &[],
        }
    }

    /// The relative residual that is allowed.
    fn tolerance(&self) -> f64 {
        match self {
            Self::Static(solver, _) => solver.settings().tolerance,
            Self::Implicit(solver, _) => solver.settings().tolerance,
            Self::Explicit(_) => f64::NAN,
        }
    }

    /// How far moved nodes whose force is limited are behind their motion.
    fn lags(&self) -> &[Lag] {
        match self {
            Self::Static(solver, _) => solver.lags(),
            Self::Implicit(solver, _) => solver.lags(),
            Self::Explicit(_) => &[],
        }
    }

    fn take_lags(&mut self, lags: Vec<Lag>) {
        match self {
            Self::Static(solver, _) => solver.take_lags(lags),
            Self::Implicit(solver, _) => solver.take_lags(lags),
            Self::Explicit(_) => {}
        }
    }

    /// Values of the older matrix whose factors precondition the next one, if there is one.
    fn factored(&self) -> Option<&[f64]> {
        match self {
            Self::Static(solver, _) => solver.factored(),
            Self::Implicit(solver, _) => solver.factored(),
            Self::Explicit(_) => None,
        }
    }

    fn precondition_with(&mut self, values: Vec<f64>) {
        match self {
            Self::Static(solver, _) => solver.precondition_with(values),
            Self::Implicit(solver, _) => solver.precondition_with(values),
            Self::Explicit(_) => {}
        }
    }

    fn take_contact_pairs(&mut self, pairs: Vec<[u32; 2]>) -> Result<(), SolveError> {
        match self {
            Self::Static(solver, _) => solver.take_contact_pairs(pairs),
            Self::Implicit(solver, _) => solver.take_contact_pairs(pairs),
            Self::Explicit(_) => Ok(()),
        }
    }

    /// Finds the forces at a state.
    fn evaluate(&mut self, state: &State) -> Result<(), SolveError> {
        match self {
            Self::Static(_, forces) | Self::Implicit(_, forces) => forces.evaluate(state),
            Self::Explicit(solver) => solver.evaluate(state),
        }
    }
}

impl Implicit {
    /// A participant at its start.
    ///
    /// # Errors
    /// If its solver can't be made.
    pub(crate) fn new(part: &Part, bodies: &Arc<ImplicitBodies>) -> Result<Self, Failure> {
        let (model, own) = (&bodies.model, &part.model);
        let forces = || Forces::new(model.clone());
        let method = match &part.method {
            part::Method::Static(_, settings) => Statics::new(model.clone(), *settings)
                .map(|solver| SolverMethod::Static(Box::new(solver), forces())),
            part::Method::Implicit(_, own) => {
                let settings = DynamicSettings { step: part.steps.step, ..own.settings };
                #[cfg(feature = "gpu")]
                let device = own.device.clone().map(|device| Arc::new(device) as Arc<dyn LinearDevice>);
                #[cfg(not(feature = "gpu"))]
                let device = None;
                BackwardEuler::on(device, model.clone(), settings)
                    .map(|solver| SolverMethod::Implicit(Box::new(solver), forces()))
            }
            part::Method::Explicit(_)
            | part::Method::QuasiStatic { .. }
            | part::Method::ExplicitShells(..) => Explicit::new(model.clone(), part.steps.step)
                .map(|solver| SolverMethod::Explicit(Box::new(solver))),
        };
        let prescribed = model.held_components();
        let mut state = bodies.start.clone();
        if !matches!(method, Ok(SolverMethod::Static(..))) {
            model.place_prescribed(&mut state);
        }
        #[cfg(feature = "gpu")]
        let device = match &part.method {
            part::Method::ExplicitShells(_, part::ShortSteps { device: Some(device) }) => {
                let mut stepper = GpuShells::new(device, model.clone(), part.steps.step)
                    .map_err(|error| Failure::device(&error, None))?;
                stepper.upload(&state);
                Some(ShellsOnDevice { stepper, pushed: Vec::new() })
            }
            _ => None,
        };
        Ok(Self {
            method: method.map_err(|error| failure(&error, own, bodies, 0.0))?,
            steps: part.steps.clone(),
            time: bodies.start.time,
            done: 0,
            state,
            outside: vec![0.0; prescribed.len()],
            prescribed,
            // Contradictions were reported when the model was built.
            owners: own.constrained_components().unwrap_or_default(),
            before: None,
            energies: Energies::default(),
            reactions: vec![[0.0; 3]; own.constraints.len()],
            enclosed: vec![None; own.constraints.len()],
            evaluated: false,
            entered: false,
            effort: Effort::default(),
            effort_before: Effort::default(),
            convergence: VecDeque::new(),
            path: Path::default(),
            grips: Vec::new(),
            springs: Vec::new(),
            touching: None,
            solids: (!own.solids.is_empty()).then(|| pliant_explicit::State::at_rest(own)),
            #[cfg(feature = "gpu")]
            device,
            model: Arc::clone(own),
            bodies: Arc::clone(bodies),
        })
    }

    /// One step on the CPU.
    fn advance_on_processor(&mut self) -> Result<(), Failure> {
        let number = self.done + 1;
        self.go(number).map_err(|error| {
            let failed = failure(&error, &self.model, &self.bodies, self.state.time);
            let step = self.method.attempts().last().filter(|_| failed.kind == "not-converged");
            let load_step = step.map(|last| Box::new(self.failed_step(number, last)));
            Failure { load_step, ..failed }
        })?;
        (self.done, self.time) = (number, self.state.time);
        self.touching = self.method.touching().map(TouchingSystem::now);
        (self.evaluated, self.entered) = (false, false);
        Ok(())
    }

    /// So many steps, from an evaluated instant. Where a facet is broken on the device, the CPU decides: it fails with the facet, or takes the
    /// step that only single precision cannot. The device then tries one step, and twice as many each time that it takes all.
    #[cfg(feature = "gpu")]
    fn advance_with_device(&mut self, steps: u64) -> Result<(), Failure> {
        let end = self.done + steps;
        let mut tried = steps;
        loop {
            let goal = end.min(self.done + tried);
            self.advance_on_device(goal - self.done)?;
            tried *= 2;
            if self.done < goal {
                self.evaluate(Wanted::Energies)?;
                self.advance_on_processor()?;
                if let Some(device) = &mut self.device {
                    device.stepper.upload(&self.state);
                }
                tried = 1;
            }
            if self.done == end {
                return Ok(());
            }
            self.evaluate(Wanted::Energies)?;
        }
    }

    /// So many steps on the device, from an evaluated instant, or those before a facet is broken there. It sums the work of forces from outside
    /// but for what those at the end do in the last step: they are found at the next evaluation, so the instant before is one step back, without
    /// forces.
    #[cfg(feature = "gpu")]
    fn advance_on_device(&mut self, steps: u64) -> Result<(), Failure> {
        let Some(ShellsOnDevice { stepper, pushed }) = &mut self.device else { return Ok(()) };
        let pull = |spring: &Spring| {
            let stretch = spring.anchor - self.state.position[spring.node as usize];
            (spring.node, (stretch * spring.stiffness).into())
        };
        let acting: Vec<_> = pushed.iter().copied().chain(self.springs.iter().map(pull)).collect();
        stepper.push(&acting);
        let moved = stepper
            .advance(&mut self.state, steps)
            .map_err(|error| Failure::device(&error, Some(self.time)))?;
        self.energies.external += moved.work;
        if let Some((forces, state)) = self.before.as_mut().filter(|_| moved.steps > 0) {
            forces.fill(0.0);
            state.clone_from(&self.state);
            for node in 0..state.position.len() {
                state.position[node] -= self.steps.step * state.velocity[node];
                let turn = UnitQuaternion::from_scaled_axis(-self.steps.step * state.spin[node]);
                state.rotation[node] = turn * state.rotation[node];
            }
        }
        self.done += moved.steps;
        self.time = self.state.time;
        (self.evaluated, self.entered) = (false, false);
        Ok(())
    }

    /// Finds the forces from outside: loads on free components, what holds or moves the others.
    fn find_outside(&mut self) {
        let forces = self.method.forces();
        let all = forces.loads().iter().zip(forces.internal()).zip(&self.prescribed);
        for (own, ((load, internal), held)) in self.outside.iter_mut().zip(all) {
            *own = if *held { *internal } else { *load };
        }
        for constraint in &self.model.constraints {
            let Motion::Mean { weights, .. } = &constraint.motion else { continue };
            let force = constraint.mean_force(|node| forces.resisting(node));
            for (&node, weight) in constraint.nodes.iter().zip(weights) {
                let own = self.outside[6 * node as usize..].iter_mut().zip(force);
                own.for_each(|(outside, force)| *outside += weight * force);
            }
        }
        for (index, enclosed) in self.enclosed.iter_mut().enumerate() {
            let Some((own, pressed)) = forces.enclosed(index, &self.state) else { continue };
            pressed.into_iter().for_each(|(component, force)| self.outside[component] += force);
            *enclosed = Some(own);
        }
    }

    /// Work of the forces from outside since the instant before [J], by the trapezoidal rule.
    fn work(&self) -> f64 {
        let Some((forces, state)) = &self.before else { return 0.0 };
        let node = |(node, (now, then)): (usize, (&[f64], &[f64]))| {
            let shift = self.state.position[node] - state.position[node];
            let turn = (self.state.rotation[node] * state.rotation[node].inverse()).scaled_axis();
            let mean = |first: usize| Vector3::from_fn(|c, _| 0.5 * (now[first + c] + then[first + c]));
            shift.dot(&mean(0)) + turn.dot(&mean(3))
        };
        self.outside.chunks_exact(6).zip(forces.chunks_exact(6)).enumerate().map(node).sum()
    }

    fn kinetic(&self) -> f64 {
        let model = &self.bodies.model;
        let node = |node: usize| {
            model.mass[node] * self.state.velocity[node].norm_squared()
                + model.rotary_inertia[node] * self.state.spin[node].norm_squared()
        };
        0.5 * (0..model.rest.len()).map(node).sum::<f64>()
    }

    fn find_energies(&mut self) {
        self.find_outside();
        let kinetic = self.kinetic();
        let stored = self.method.forces().strain_energy();
        let hourglass = self.method.forces().hourglass_energy();
        let external = match &self.before {
            Some(_) if self.entered => self.energies.external,
            Some(_) => self.energies.external + self.work(),
            // What is given at the start.
            None => kinetic + stored,
        };
        // Backward Euler takes energy like a damper; a static path has no inertia to compare with.
        let damping = match self.method {
            SolverMethod::Implicit(..) => external - kinetic - stored,
            _ => 0.0,
        };
        let internal = stored - hourglass;
        self.energies = Energies { kinetic, internal, damping, external, hourglass, ..Energies::default() };
        match &mut self.before {
            Some((forces, state)) => {
                std::mem::swap(forces, &mut self.outside);
                state.clone_from(&self.state);
            }
            None => self.before = Some((self.outside.clone(), self.state.clone())),
        }
    }

    fn find_reactions(&mut self) {
        let forces = self.method.forces();
        let [internal, loads] = [forces.internal(), forces.loads()];
        let constraints = self.model.constraints.iter().enumerate();
        for (reaction, (index, constraint)) in self.reactions.iter_mut().zip(constraints) {
            *reaction = constraint.mean_force(|node| forces.resisting(node));
            for &node in &constraint.nodes {
                for c in (0..3).filter(|&c| self.owners[node as usize][c] == index as u32) {
                    let at = 6 * node as usize + c;
                    reaction[c] += internal[at] - loads[at];
                }
            }
        }
    }

    /// What holds the three components from one on.
    fn held(&self, first: usize) -> [f64; 3] {
        let forces = self.method.forces();
        let [internal, loads] = [forces.internal(), forces.loads()];
        [first, first + 1, first + 2]
            .map(|at| if self.prescribed[at] { internal[at] - loads[at] } else { 0.0 })
    }

    /// Puts a spring at each node of each grip. Together they pull with k (p − x̄), x̄ the mean of the nodes by their weights; within a step
    /// they keep the shape of what is held, so that a spring has a node of its own and the equations no entries more.
    fn put_springs(&mut self) {
        self.springs.clear();
        for grip in &self.grips {
            let place = |node: u32| self.state.position[node as usize];
            let pull = Vector3::from(grip.place) - Vector3::from(grip.position(&self.state, 0));
            self.springs.extend(grip.nodes.iter().map(|&(node, weight)| Spring {
                node,
                anchor: place(node) + pull,
                stiffness: weight * grip.stiffness,
            }));
        }
        match &mut self.method {
            SolverMethod::Static(solver, forces) => {
                solver.hold(&self.springs);
                forces.hold(&self.springs);
            }
            SolverMethod::Implicit(solver, forces) => {
                solver.hold(&self.springs);
                forces.hold(&self.springs);
            }
            SolverMethod::Explicit(solver) => solver.hold(&self.springs),
        }
    }

    /// One step of the method, to the time of its number.
    fn go(&mut self, number: u64) -> Result<(), SolveError> {
        match self.method {
            SolverMethod::Explicit(_) => self.go_explicitly(),
            SolverMethod::Implicit(..) => self.go_implicitly(number),
            SolverMethod::Static(..) => self.go_statically(number),
        }
    }

    fn go_explicitly(&mut self) -> Result<(), SolveError> {
        let SolverMethod::Explicit(solver) = &mut self.method else { return Ok(()) };
        if self.evaluated {
            solver.go(&mut self.state);
            return Ok(());
        }
        solver.advance(&mut self.state)
    }

    fn go_implicitly(&mut self, number: u64) -> Result<(), SolveError> {
        let SolverMethod::Implicit(solver, _) = &mut self.method else { return Ok(()) };
        let result = solver.advance(&mut self.state);
        let phases = solver.phases();
        self.note_attempts(number);
        let step = result?;
        self.effort.halved += u64::from(step.parts > 1);
        self.effort.unconverged += u64::from(!step.converged);
        self.effort.linear_residual = step.linear.residual;
        self.effort.residual = if step.residuals.len() > 1 { step.residuals.last().copied() } else { None };
        self.effort.take(phases, &self.effort_before);
        Ok(())
    }

    /// The report of a step of a number that came to no end, by its last attempt.
    fn failed_step(&self, number: u64, last: &Attempted) -> FailedLoadStep {
        let relative = |residual: &f64| residual / last.allowed * self.method.tolerance();
        let residual = last.residuals.last().map(relative).filter(|residual| residual.is_finite());
        FailedLoadStep { number, of: self.steps.number, iterations: last.iterations(), residual }
    }

    /// Keeps the iterations of the attempts of a step, those that failed, too.
    fn note_attempts(&mut self, number: u64) {
        for (attempt, tried) in self.method.attempts().iter().enumerate() {
            self.effort.newton_iterations += tried.iterations() as u64;
            // The residual of a single iteration is not checked.
            let is_checked = tried.residuals.len() > 1 || !tried.found;
            let checked = tried.residuals.iter().enumerate().filter(|_| is_checked);
            let iterated = |(iteration, &residual)| Iterated {
                step: number,
                attempt: attempt + 1,
                time: tried.time,
                iteration,
                residual,
                allowed: tried.allowed,
                found: tried.found,
            };
            keep(&mut self.convergence, checked.map(iterated));
        }
    }

    fn go_statically(&mut self, number: u64) -> Result<(), SolveError> {
        let until = self.steps.end_of(number);
        let control = self.bodies.control.map(|control| part_of(control, number, self.steps.number));
        let SolverMethod::Static(solver, _) = &mut self.method else { return Ok(()) };
        let result = match control {
            Some(control) => solver.control(&mut self.state, control, until),
            None => solver.solve(&mut self.state, until),
        };
        let phases = solver.phases();
        self.note_attempts(number);
        let step = result?;
        self.effort.halved += u64::from(step.parts > 1);
        self.effort.take(phases, &self.effort_before);
        if step.negative_pivots > 0 {
            self.effort.unstable_from.get_or_insert(until);
        }
        if let Some(RunControl::ArcLength { stop, .. }) = self.bodies.control {
            self.path.go_on(self.state.load_factor);
            self.path.ended = self.path.end(&stop, &self.state, &self.bodies.model);
        }
        Ok(())
    }
}

/// Keeps iterations, and of all the last ones.
fn keep(all: &mut VecDeque<Iterated>, more: impl Iterator<Item = Iterated>) {
    all.extend(more);
    all.drain(..all.len().saturating_sub(ITERATIONS_KEPT));
}

impl Path {
    /// Whether it is one of so many nodes.
    pub(crate) fn fits(&self, nodes: usize) -> bool {
        self.direction.is_empty() || self.direction.len() == 6 * nodes
    }

    /// Takes the load factor of the next equilibrium.
    fn go_on(&mut self, factor: f64) {
        let change = factor - self.factor;
        self.limit_points += u32::from(change * self.change < 0.0);
        (self.factor, self.change) = (factor, change);
    }

    /// Why it ends here, if it does.
    fn end(&self, stop: &Stop, state: &State, model: &Assembly) -> Option<String> {
        let limit = number(stop.load_factor.unwrap_or(f64::INFINITY));
        if stop.load_factor.is_some_and(|limit| self.factor.abs() >= limit) {
            return Some(format!("the load factor is {}, at least {limit} in size", number(self.factor)));
        }
        if let Some((node, component, by)) = stop.displacement {
            let moved = state.displacement(model, node as usize)[component];
            if moved * by.signum() >= by.abs() {
                return Some(format!("the node of `displacement` has moved by {} m", number(moved)));
            }
        }
        let passed = stop.limit_points.is_some_and(|limit| self.limit_points >= limit);
        passed.then(|| format!("{} passed", counted(self.limit_points as usize, "limit point")))
    }
}

impl Effort {
    /// Takes what a solver has spent since it was made, in addition to what was spent before.
    fn take(&mut self, phases: Phases, before: &Self) {
        self.solutions = before.solutions + phases.solutions as u64;
        self.linear_iterations = before.linear_iterations + phases.iterations as u64;
        self.left_to_cpu = before.left_to_cpu + phases.left_to_cpu as u64;
        self.seconds_cells = before.seconds_cells + phases.cells.as_secs_f64();
        self.seconds_contact = before.seconds_contact + phases.contact.as_secs_f64();
        self.seconds_factors = before.seconds_factors + phases.preparation.as_secs_f64();
        self.seconds_solution = before.seconds_solution + phases.solution.as_secs_f64();
    }
}

/// What the load step of a number (counted from 1) prescribes.
fn part_of(control: RunControl, number: u64, of: u64) -> pliant_implicit::Control {
    match control {
        RunControl::Displacement { node, component, by } => {
            pliant_implicit::Control::Displacement { node, component, by: by / of as f64 }
        }
        RunControl::ArcLength { length, .. } => pliant_implicit::Control::ArcLength { length },
        RunControl::Volume { from, to } => {
            pliant_implicit::Control::Volume { volume: from + (to - from) * number as f64 / of as f64 }
        }
    }
}

impl Implicit {
    /// Goes on from where a run of the same bodies stood.
    ///
    /// # Errors
    /// If its equations are too many.
    pub(crate) fn resume(&mut self, remembered: ImplicitState) -> Result<(), Failure> {
        let ImplicitState {
            done,
            time,
            state,
            before,
            previous,
            energies,
            effort,
            convergence,
            contact,
            legs,
            path,
            lags,
            factored,
            entered,
        } = remembered;
        self.method.take_lags(lags);
        (self.done, self.time) = (done, time);
        self.convergence = convergence;
        self.state = state.state();
        #[cfg(feature = "gpu")]
        if let Some(device) = &mut self.device {
            device.stepper.upload(&self.state);
        }
        if let SolverMethod::Implicit(solver, _) = &mut self.method {
            solver.go_on_from(previous.map(|previous| previous.state()));
        }
        if let SolverMethod::Static(solver, _) = &mut self.method {
            solver.go_on_along(&path.direction);
        }
        self.path = path;
        self.before = before.map(|(forces, state)| (forces, state.state()));
        self.energies = energies;
        (self.effort, self.effort_before) = (effort.clone(), effort);
        (self.evaluated, self.entered) = (false, entered);
        if let Some(own) = self.method.touching_mut() {
            *own.legs_mut() = legs.into_iter().collect();
        }
        if let Some(ContactState { forces, totals, moments, energy, touches, pairs, lags }) = contact {
            let gap = touches.iter().map(|own| own.gap).reduce(f64::min);
            if let Some(own) = self.method.touching_mut() {
                own.go_on_from(touches.clone(), lags);
            }
            self.touching = Some(TouchingNow { forces, totals, moments, energy, gap, nodes: touches });
            let taken = self.method.take_contact_pairs(pairs);
            taken.map_err(|error| failure(&error, &self.model, &self.bodies, self.time))?;
        }
        if let Some(values) = factored {
            self.method.precondition_with(values);
        }
        Ok(())
    }

    fn snapshot(&self) -> ImplicitState {
        let previous = match &self.method {
            SolverMethod::Implicit(solver, _) => solver.previous().map(PlainState::of),
            _ => None,
        };
        ImplicitState {
            done: self.done,
            time: self.time,
            state: PlainState::of(&self.state),
            before: self.before.as_ref().map(|(forces, state)| (forces.clone(), PlainState::of(state))),
            previous,
            energies: self.energies,
            effort: self.effort.clone(),
            convergence: VecDeque::new(),
            contact: self.touching.as_ref().zip(self.method.touching()).map(|(now, own)| ContactState {
                forces: now.forces.clone(),
                totals: now.totals.clone(),
                moments: now.moments.clone(),
                energy: now.energy,
                touches: now.nodes.clone(),
                pairs: own.pairs().to_vec(),
                lags: own.lags().to_vec(),
            }),
            legs: (self.method.touching().into_iter())
                .flat_map(|own| own.legs().iter().map(|(&rigid, &leg)| (rigid, leg)))
                .collect(),
            path: Path {
                direction: match &self.method {
                    SolverMethod::Static(solver, _) if self.bodies.control.is_some() => {
                        solver.direction().to_vec()
                    }
                    _ => Vec::new(),
                },
                ..self.path.clone()
            },
            lags: self.method.lags().to_vec(),
            factored: self.method.factored().map(<[f64]>::to_vec),
            entered: self.entered,
        }
    }
}

impl Instant for Implicit {
    fn time(&self) -> f64 {
        self.time
    }

    fn displacement(&self, node: usize) -> [f64; 3] {
        (self.state.position[node] - self.bodies.model.place(node)).into()
    }

    fn velocity(&self, node: usize) -> [f64; 3] {
        self.state.velocity[node].into()
    }

    fn rotation(&self, node: usize) -> [f64; 3] {
        self.state.rotation[node].scaled_axis().into()
    }

    fn nodal_reaction(&self, node: usize) -> [f64; 3] {
        self.held(6 * node)
    }

    fn nodal_reaction_moment(&self, node: usize) -> [f64; 3] {
        self.held(6 * node + 3)
    }

    fn reaction(&self, constraint: usize) -> [f64; 3] {
        self.reactions[constraint]
    }

    fn enclosed(&self, constraint: usize) -> Option<Enclosed> {
        self.enclosed[constraint]
    }

    fn contact_forces(&self) -> Vec<[f64; 3]> {
        self.touching.as_ref().map(|now| now.totals.clone()).unwrap_or_default()
    }

    fn contact_moments(&self) -> Option<Vec<[f64; 3]>> {
        Some(self.touching.as_ref().map(|now| now.moments.clone()).unwrap_or_default())
    }

    fn contact_nodes(&self) -> Vec<NodeContact> {
        let (Some(now), Some(touching)) = (&self.touching, &self.bodies.model.touching) else {
            return Vec::new();
        };
        let numbers = touching.contacts.nodes();
        let touch = |node: u32| {
            let found = now.nodes.binary_search_by_key(&node, |own| own.node);
            found.ok().map(|at| &now.nodes[at])
        };
        let pushes: Vec<Vector3<f64>> = numbers
            .iter()
            .map(|&node| touch(node).map_or_else(Vector3::zeros, |own| own.push.into()))
            .collect();
        let places: Vec<Vector3<f64>> =
            numbers.iter().map(|&node| self.state.position[node as usize]).collect();
        let pressures = pressures(&faces(&touching.contacts, &numbers), &pushes, &places);
        let own = |(node, pressure): (u32, Option<f64>)| {
            let (at, own) = (6 * node as usize, touch(node));
            NodeContact {
                node,
                force: [0, 1, 2].map(|c| now.forces[at + c]),
                pressure,
                gap: own.map(|own| own.gap),
                slip: own.map(|own| own.slip),
            }
        };
        numbers.into_iter().zip(pressures).map(own).collect()
    }

    fn leg(&self, rigid: usize) -> Option<&Leg> {
        self.method.touching()?.legs().get(&(rigid as u32))
    }

    fn lag(&self, rigid: usize) -> Option<&Lag> {
        self.method.touching()?.lags().iter().find(|lag| lag.number() == rigid)
    }

    fn lag_of_constraint(&self, constraint: usize) -> Option<&Lag> {
        self.method.lags().iter().find(|lag| lag.number() == constraint)
    }

    fn energies(&self) -> Energies {
        self.energies
    }

    fn cells(&self) -> Option<Box<dyn CellsNow + '_>> {
        Some(Box::new(SolidCells::new(&self.model, self.solids.as_ref()?)))
    }

    fn shells(&self) -> Option<&State> {
        Some(&self.state)
    }

    fn is_single(&self) -> bool {
        false
    }

    fn steps(&self) -> u64 {
        self.done
    }

    /// The balance is not judged.
    fn balance_floor(&self) -> f64 {
        f64::INFINITY
    }

    fn effort(&self) -> Option<Effort> {
        (!matches!(self.method, SolverMethod::Explicit(_))).then(|| self.effort.clone())
    }

    fn convergence(&self) -> Option<String> {
        let mut table = String::from("step,attempt,time,iteration,residual,allowed,found\n");
        for Iterated { step, attempt, time, iteration, residual, allowed, found } in &self.convergence {
            let found = u8::from(*found);
            // Writing to a String cannot fail.
            let _ = writeln!(table, "{step},{attempt},{time},{iteration},{residual:e},{allowed:e},{found}");
        }
        (!self.convergence.is_empty()).then_some(table)
    }

    fn least_gap(&self) -> Option<f64> {
        self.touching.as_ref()?.gap
    }

    fn ended(&self) -> Option<&str> {
        self.path.ended.as_deref()
    }
}

impl Participant for Implicit {
    fn evaluate(&mut self, _wanted: Wanted) -> Result<(), Failure> {
        if self.evaluated {
            return Ok(());
        }
        self.put_springs();
        if self.touching.is_none() {
            self.touching = self.method.touching_mut().map(|own| own.at(&self.state));
        }
        if let (Some(now), SolverMethod::Static(_, forces) | SolverMethod::Implicit(_, forces)) =
            (&self.touching, &mut self.method)
        {
            forces.touch(&now.forces);
        }
        let found = self.method.evaluate(&self.state);
        found.map_err(|error| failure(&error, &self.model, &self.bodies, self.time))?;
        self.find_energies();
        self.find_reactions();
        if let Some(solids) = &mut self.solids {
            let places = self.bodies.model.places();
            for (own, (now, rest)) in
                solids.displacement.iter_mut().zip(self.state.position.iter().zip(places))
            {
                *own = (now - rest).into();
            }
            for ((own, solid), tensors) in
                solids.history.iter_mut().zip(&self.model.solids).zip(&self.state.history.tensors)
            {
                let slots = tensors.len() / solid.cells.len();
                for (cell, tensors) in tensors.chunks_exact(slots.max(1)).enumerate() {
                    own.set_cell(cell, tensors);
                }
            }
        }
        (self.evaluated, self.entered) = (true, true);
        Ok(())
    }

    fn advance(&mut self, steps: u64, _watch: &mut dyn FnMut(LoadStepProgress)) -> Result<(), Failure> {
        debug_assert!(steps <= self.stride(), "{steps} steps in one go");
        self.put_springs();
        #[cfg(feature = "gpu")]
        if self.device.is_some() {
            return self.advance_with_device(steps);
        }
        self.advance_on_processor()
    }

    /// A grip pulls by where its nodes are at each step.
    #[cfg(feature = "gpu")]
    fn stride(&self) -> u64 {
        if self.device.is_some() && self.grips.is_empty() { STRIDE } else { 1 }
    }

    fn hold(&mut self, grips: &[Grip]) -> bool {
        self.grips.clear();
        self.grips.extend_from_slice(grips);
        self.evaluated = false;
        true
    }

    fn push(&mut self, forces: &[Vector<f64>]) {
        let acting = (0..).zip(forces.iter().copied()).filter(|(_, force)| *force != [0.0; 3]);
        let acting: Vec<_> = acting.collect();
        match &mut self.method {
            SolverMethod::Static(solver, forces) => {
                solver.push(&acting);
                forces.push(&acting);
            }
            SolverMethod::Implicit(solver, forces) => {
                solver.push(&acting);
                forces.push(&acting);
            }
            SolverMethod::Explicit(solver) => solver.push(&acting),
        }
        #[cfg(feature = "gpu")]
        if let Some(device) = &mut self.device {
            device.pushed = acting;
        }
        self.evaluated = false;
    }

    fn drive(&mut self, rigid: usize, leg: Leg) {
        if let Some(own) = self.method.touching_mut() {
            own.legs_mut().insert(rigid as u32, leg);
        }
    }

    /// Explicit steps of 0.9 of the stable step stay stable up to it, as those of solids do. Implicit ones are stable with any, and
    /// their equations stay well conditioned.
    fn stiffest(&self, grip: &Grip) -> f64 {
        if !matches!(self.method, SolverMethod::Explicit(_)) {
            return FIRM * self.bodies.model.stiffest();
        }
        let mass = |&(node, weight): &(u32, f64)| self.bodies.model.mass[node as usize] / weight;
        let lightest = grip.nodes.iter().map(mass).fold(f64::INFINITY, f64::min);
        ROOM * 4.0 * lightest / (self.steps.step * self.steps.step)
    }

    fn last_velocity(&self, node: usize) -> [f64; 3] {
        self.state.velocity[node].into()
    }

    fn pulled(&self, grip: &Grip) -> [[f64; 3]; 2] {
        [grip.position(&self.state, 0), grip.force(&self.state)]
    }

    /// What was spent since then counts.
    fn goes_back_to(&self, kept: &Kept) -> bool {
        // What is touched at the start is not known before contacts are looked at.
        matches!(kept, Kept::Implicit(state) if state.contact.is_some() || self.method.touching().is_none())
    }

    fn go_back(&mut self, kept: &Kept, _steps: Option<(Clock, f64)>) -> Result<(), Failure> {
        let Kept::Implicit(state) = kept else { return Ok(()) };
        let spent = (self.effort.clone(), self.effort_before.clone());
        let convergence = std::mem::take(&mut self.convergence);
        self.resume((**state).clone())?;
        (self.effort, self.effort_before) = spent;
        self.convergence = convergence;
        Ok(())
    }

    fn stop_on(&mut self, flag: &StopFlag) {
        match &mut self.method {
            SolverMethod::Static(solver, _) => solver.stop_on(flag),
            SolverMethod::Implicit(solver, _) => solver.stop_on(flag),
            SolverMethod::Explicit(_) => {}
        }
    }

    fn kept(&self) -> Kept {
        Kept::Implicit(Box::new(self.snapshot()))
    }

    fn add_log(&self, kept: &mut Kept) {
        if let Kept::Implicit(state) = kept {
            state.convergence.clone_from(&self.convergence);
        }
    }

    fn cut_log(&mut self) {
        let done = self.done;
        self.convergence.retain(|row| row.step <= done);
    }

    fn fingerprint(&self) -> u64 {
        let bits = |numbers: &[f64]| -> Vec<u64> { numbers.iter().map(|x| x.to_bits()).collect() };
        let positions = self.state.position.iter().flat_map(|x| bits(x.as_slice()));
        let rotations = self.state.rotation.iter().flat_map(|q| bits(q.coords.as_slice()));
        fingerprint(&(positions.collect::<Vec<_>>(), rotations.collect::<Vec<_>>()))
    }

    /// A static state stands at the last equilibrium found, which may lie within the step that failed.
    fn keeps_what_it_found(&mut self) -> bool {
        let is_static = matches!(self.method, SolverMethod::Static(..));
        if is_static && self.state.time > self.time {
            self.time = self.state.time;
            // Contacts without friction: that of the part of the step that was found is not known.
            self.touching = None;
            (self.evaluated, self.entered) = (false, false);
        }
        is_static
    }
}

/// The report of a step that failed after a time.
fn failure(
    error: &SolveError,
    model: &pliant_mechanics::Model,
    bodies: &ImplicitBodies,
    time: f64,
) -> Failure {
    let body_of = |node: u32| model.bodies.iter().find(|body| body.nodes.contains(&node));
    let (kind, node, cell) = match error {
        SolveError::NotConverged { node, .. } => ("not-converged", Some(*node), None),
        SolveError::Uphill { node, .. } => ("not-converged", Some(*node), None),
        SolveError::Snaps { .. } | SolveError::Stalled { .. } => ("not-converged", None, None),
        SolveError::Blocked { .. } => ("blocked", None, None),
        SolveError::Crossed { edge, .. } => ("intersecting", Some(edge[0]), None),
        SolveError::Singular { node, .. } | SolveError::FreeBody { node, .. } => {
            ("singular", Some(*node), None)
        }
        SolveError::Indefinite { .. } => ("unstable", None, None),
        SolveError::Broken { cell, .. } => ("inverted", None, bodies.cell(*cell)),
        SolveError::Stopped => return Failure::stopped(time),
        SolveError::Device(_) => ("device", None, None),
        SolveError::OutOfMemory(_) => ("memory", None, None),
        SolveError::Open(_) | SolveError::Impossible(_) => ("input", None, None),
    };
    let owner = match error {
        SolveError::Snaps { node, .. } => body_of(*node),
        _ => node.and_then(body_of),
    };
    let own_node = node.zip(owner).map(|(node, body)| node - body.nodes.start);
    let body = owner.map(|body| body.name.clone()).or_else(|| Some(model.bodies[cell?.0].name.clone()));
    let place = body.as_ref().map(|name| format!(" in `{name}`")).unwrap_or_default();
    let of_body =
        |cell| bodies.cell(cell).filter(|(owner, _)| body.as_ref() == Some(&model.bodies[*owner].name));
    let told = numbered(error, own_node, |cell| of_body(cell).map(|(_, cell)| cell));
    let slack = node.or_else(|| Some(bodies.model.facets.get(error.broken()?.0)?.nodes[0]));
    let hint = match slack.is_some_and(|node| bodies.is_slack(node)) {
        true => {
            "; a membrane resists bending and compression across by nothing: hold it on all sides, give it `pre-tension`, or take \
             an element with bending"
        }
        false => "",
    };
    let message =
        format!("after t = {} s{place}: {told}{hint}; what was written before stays readable", number(time));
    let element = cell.map(|(_, cell)| cell);
    let blocked = match error {
        SolveError::Blocked { driver: Some((driver, force)), part, gap, .. } => {
            Some(Box::new(BlockedDriver { driver: driver.clone(), force: *force, part: *part, gap: *gap }))
        }
        _ => None,
    };
    let body = body.map(String::into_boxed_str);
    Failure { body, element, node: own_node, blocked, ..Failure::new(kind, message, Some(time)) }
}

/// An error with the numbers that a node and a cell have in their body.
fn numbered(
    error: &SolveError,
    own_node: Option<u32>,
    own_cell: impl Fn(usize) -> Option<u32>,
) -> SolveError {
    let mut own = error.clone();
    if let SolveError::NotConverged { node, .. }
    | SolveError::Singular { node, .. }
    | SolveError::Uphill { node, .. }
    | SolveError::FreeBody { node, .. } = &mut own
    {
        *node = own_node.unwrap_or(*node);
    }
    match &mut own {
        SolveError::Broken { cell, .. } => *cell = own_cell(*cell).map_or(*cell, |cell| cell as usize),
        SolveError::NotConverged { broken, .. } => {
            *broken = broken.and_then(|(cell, why)| Some((own_cell(cell)? as usize, why)));
        }
        _ => {}
    }
    own
}

#[cfg(test)]
mod tests {
    #[cfg(feature = "gpu")]
    use pliant_gpu::Device;
    use pliant_implicit::Shell;
    use pliant_shells::element::Elasticity;
    use pliant_shells::element::Wall;

    use super::*;
    use crate::part::ShortSteps;
    use crate::{Method, Steps};

    /// A strip of two facets, clamped at two of its four nodes, in explicit steps of a part of the stable one.
    fn strip(steps: ShortSteps, of_stable: f64) -> Implicit {
        let corner = |i: u32| Vector3::new(f64::from(i / 2) * 0.1, f64::from(i % 2) * 0.1, 0.0);
        let mut model = Assembly::new("strip", (0..4).map(corner));
        let material = Wall { elastic: Elasticity { young: 1e6, poisson: 0.3 }, density: 1000.0 };
        model.add_shell(&Shell::new("strip", vec![[0, 2, 3], [0, 3, 1]], 0.002, material)).unwrap();
        model.model_mut().fix("clamp", vec![0, 1]);
        let part = Part::implicit("strip", model, 0.1, 0.01);
        let Method::Implicit(bodies, _) = &part.method else { panic!("an implicit part") };
        let step = of_stable * Explicit::stable_step(&bodies.model);
        let part = Part {
            method: Method::ExplicitShells(Arc::clone(bodies), steps),
            steps: Steps::within(0.1, step),
            ..part.clone()
        };
        Implicit::new(&part, bodies).unwrap()
    }

    /// Explicit steps cost little but their forces, which whoever looks at an instant and the step from there on share.
    #[test]
    fn explicit_shells_find_their_forces_once_a_step() {
        let mut shells = strip(ShortSteps::default(), 0.9);
        for _ in 0..50 {
            // The loop of a run, and somebody who looks.
            shells.evaluate(Wanted::Energies).unwrap();
            shells.evaluate(Wanted::Energies).unwrap();
            shells.advance(1, &mut |_| ()).unwrap();
        }
        let SolverMethod::Explicit(solver) = &shells.method else { panic!("an explicit solver") };
        assert_eq!(solver.phases().evaluations, 50);
    }

    /// Nodes that are turned by nearly 2 rad, at which facets fold over: single precision takes some for more. At rest they turn back, as
    /// on the CPU; those that spin on fail with the words of the CPU.
    #[cfg(feature = "gpu")]
    #[test]
    fn a_facet_at_the_edge_of_folding_over_goes_on_or_fails_on_a_device_as_on_the_processor() {
        let Some(device) = pliant_testing::found_or_skipped(Device::open(None)) else { return };
        // The state after so many steps, and whether the first one was not the device's.
        let run = |device: Option<&Device>, angle: f64, turn: f64| {
            let mut shells = strip(ShortSteps { device: device.cloned() }, 0.05);
            for node in 2..4 {
                shells.state.rotation[node] = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), angle);
                shells.state.spin[node] = Vector3::x() * (turn / shells.steps.step);
            }
            let stops = shells.device.as_mut().is_some_and(|own| {
                own.stepper.upload(&shells.state);
                let moved = own.stepper.advance(&mut shells.state.clone(), 1).unwrap();
                own.stepper.upload(&shells.state);
                moved.broken
            });
            let stride = shells.stride().min(20);
            let mut go = || {
                while shells.done < 20 {
                    shells.evaluate(Wanted::Energies)?;
                    shells.advance(stride, &mut |_| ())?;
                }
                shells.evaluate(Wanted::Energies)
            };
            let told = go().map_err(|failure| (failure.kind, failure.element, failure.time, failure.message));
            (told, shells.state, stops)
        };
        let mut stopped = 0;
        for short in [1e-9, 3e-8, 6e-8, 1.2e-7] {
            for turn in [0.0, 0.1] {
                let (expected, exact, _) = run(None, 2.0 - short, turn);
                let (told, state, stops) = run(Some(&device), 2.0 - short, turn);
                assert_eq!((&told, told.is_ok()), (&expected, turn == 0.0), "2 − {short:e}");
                let off = state.rotation.iter().zip(&exact.rotation).map(|(a, b)| a.angle_to(b));
                let off = off.fold(0.0, f64::max);
                assert!(off < 1e-5, "2 − {short:e}: {off:e}");
                stopped += u32::from(stops);
            }
        }
        assert!(stopped > 0, "single precision is never at the edge");
    }
}
