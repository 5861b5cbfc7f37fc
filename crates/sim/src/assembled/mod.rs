//! Shells, and solids whose equations are solved, as a participant.

#[cfg(feature = "gpu")]
mod device;
mod failures;
mod instant;
mod method;
mod participant;
#[cfg(test)]
mod tests;

use std::collections::VecDeque;
use std::sync::Arc;

use nalgebra::Vector3;
#[cfg(feature = "gpu")]
use pliant_gpu::GpuShells;
use pliant_implicit::{
    AssemblySolver, AssemblyState, Attempted, BackwardEuler, ContactNow, ContactSystem, DynamicSettings,
    ExplicitShells, Forces, Phases, SolveError, Spring, Statics,
};
#[cfg(feature = "gpu")]
use pliant_linear::LinearDevice;
use pliant_mechanics::Energies;
use pliant_mechanics::grip::Grip;
use pliant_mechanics::mapping::Mapping;
use pliant_mechanics::model::{Enclosed, Motion};

#[cfg(feature = "gpu")]
use self::device::{STRIDE, ShellsOnDevice};
use self::failures::failure;
use self::method::SolverMethod;
use crate::bodies::{ImplicitBodies, RunControl};
use crate::failure::{FailedLoadStep, Failure, FailureKind};
use crate::instant::Effort;
use crate::participant_setup::{self, ParticipantSetup};
use crate::path::{Path, part_of};
use crate::snapshot::{ContactState, ImplicitState, Iterated, PlainState};
use crate::steps::Steps;

/// Stiffness of the firmest grip over the stiffness of the stiffest cell.
const FIRM: f64 = 10.0;

/// Iterations of Newton's method whose residuals are kept: the last ones.
const ITERATIONS_KEPT: usize = 10_000;

/// A run of shells, and of solids whose equations are solved.
pub(crate) struct Assembled {
    /// Bodies, and the constraints whose reactions are asked for.
    model: Arc<pliant_mechanics::Model>,
    bodies: Arc<ImplicitBodies>,
    method: SolverMethod,
    /// Steps of the whole run.
    steps: Steps,
    state: AssemblyState,
    /// Whole steps done, and the time [s] they end at.
    done: u64,
    time: f64,
    /// Components of each node, six a node, that are held or moved.
    prescribed: Vec<bool>,
    /// The constraint that has the reaction of each component: the first, where two prescribe the same.
    owners: Vec<[u32; 3]>,
    /// Force [N] and moment [N m] on each node from outside at the instant before, six a node, with its
    /// positions and rotations.
    before: Option<(Vec<f64>, AssemblyState)>,
    /// The external forces and moments at the instant that is evaluated.
    outside: Vec<f64>,
    energies: Energies,
    reactions: Vec<[f64; 3]>,
    /// Volumes that constraints of volume enclose.
    enclosed: Vec<Option<Enclosed>>,
    evaluated: bool,
    /// True if the work to the instant is added up.
    entered: bool,
    effort: Effort,
    /// Effort before the run was resumed.
    effort_before: Effort,
    /// Residuals of the last iterations.
    convergence: VecDeque<Iterated>,
    /// The path of a run by arc length so far.
    path: Path,
    grips: Vec<Grip>,
    springs: Vec<Spring>,
    /// Forces and states of contacts at the instant; `None` without contacts, and at the start before
    /// contacts are evaluated.
    contact: Option<ContactNow>,
    /// Displacements of the solids at the instant last evaluated; `None` without solids.
    solids: Option<pliant_explicit::State<f64>>,
    /// The GPU that takes explicit steps; `None`: the CPU. The CPU finds forces, energies and reactions at
    /// instants.
    #[cfg(feature = "gpu")]
    device: Option<ShellsOnDevice>,
}

impl Assembled {
    /// A participant at its start.
    ///
    /// # Errors
    /// If its solver can't be made.
    pub(crate) fn new(part: &ParticipantSetup, bodies: &Arc<ImplicitBodies>) -> Result<Self, Failure> {
        let (model, part_model) = (&bodies.model, &part.model);
        let forces = || Forces::new(model.clone());
        let method = match &part.method {
            participant_setup::Method::Static(_, settings) => Statics::new(model.clone(), *settings)
                .map(|solver| SolverMethod::Static(Box::new(solver), forces())),
            participant_setup::Method::Implicit(_, dynamics) => {
                let settings = DynamicSettings { step: part.steps.step, ..dynamics.settings };
                #[cfg(feature = "gpu")]
                let device = dynamics.device.clone().map(|device| Arc::new(device) as Arc<dyn LinearDevice>);
                #[cfg(not(feature = "gpu"))]
                let device = None;
                BackwardEuler::on(device, model.clone(), settings)
                    .map(|solver| SolverMethod::Implicit(Box::new(solver), forces()))
            }
            participant_setup::Method::Explicit(_)
            | participant_setup::Method::QuasiStatic { .. }
            | participant_setup::Method::ExplicitShells(..) => {
                ExplicitShells::new(model.clone(), part.steps.step)
                    .map(|solver| SolverMethod::Explicit(Box::new(solver)))
            }
        };
        let prescribed = model.held_components();
        let mut state = bodies.start.clone();
        if !matches!(method, Ok(SolverMethod::Static(..))) {
            model.place_prescribed(&mut state);
        }
        #[cfg(feature = "gpu")]
        let device = match &part.method {
            participant_setup::Method::ExplicitShells(
                _,
                participant_setup::ShortSteps { device: Some(device) },
            ) => {
                let mut stepper = GpuShells::new(device, model.clone(), part.steps.step)
                    .map_err(|error| Failure::device(&error, None))?;
                stepper.upload(&state);
                Some(ShellsOnDevice { stepper, pushed: Vec::new() })
            }
            _ => None,
        };
        Ok(Self {
            method: method.map_err(|error| failure(&error, part_model, bodies, 0.0))?,
            steps: part.steps.clone(),
            time: bodies.start.time,
            done: 0,
            state,
            outside: vec![0.0; prescribed.len()],
            prescribed,
            // Contradictions were reported when the model was built.
            owners: part_model.constrained_components().unwrap_or_default(),
            before: None,
            energies: Energies::default(),
            reactions: vec![[0.0; 3]; part_model.constraints.len()],
            enclosed: vec![None; part_model.constraints.len()],
            evaluated: false,
            entered: false,
            effort: Effort::default(),
            effort_before: Effort::default(),
            convergence: VecDeque::new(),
            path: Path::default(),
            grips: Vec::new(),
            springs: Vec::new(),
            contact: None,
            solids: (!part_model.solids.is_empty()).then(|| pliant_explicit::State::at_rest(part_model)),
            #[cfg(feature = "gpu")]
            device,
            model: Arc::clone(part_model),
            bodies: Arc::clone(bodies),
        })
    }

    /// One step on the CPU.
    fn advance_on_processor(&mut self) -> Result<(), Failure> {
        let number = self.done + 1;
        self.go(number).map_err(|error| {
            let failed = failure(&error, &self.model, &self.bodies, self.state.time);
            let step = self.method.attempts().last().filter(|_| failed.kind == FailureKind::NotConverged);
            let load_step = step.map(|last| Box::new(self.failed_step(number, last)));
            Failure { load_step, ..failed }
        })?;
        (self.done, self.time) = (number, self.state.time);
        self.contact = self.method.contact().map(ContactSystem::now);
        (self.evaluated, self.entered) = (false, false);
        Ok(())
    }

    /// Finds the forces from outside: loads on free components, what holds or moves the others.
    fn find_outside(&mut self) {
        let forces = self.method.forces();
        let components = forces.loads().iter().zip(forces.internal()).zip(&self.prescribed);
        for (outside, ((load, internal), held)) in self.outside.iter_mut().zip(components) {
            *outside = if *held { *internal } else { *load };
        }
        for constraint in &self.model.constraints {
            let Motion::Mean { weights, .. } = &constraint.motion else { continue };
            let force = constraint.mean_force(|node| forces.resisting(node));
            for (&node, weight) in constraint.nodes.iter().zip(weights) {
                let at_node = self.outside[6 * node as usize..].iter_mut().zip(force);
                at_node.for_each(|(outside, force)| *outside += weight * force);
            }
        }
        for (index, enclosed) in self.enclosed.iter_mut().enumerate() {
            let Some((measured, pressed)) = forces.enclosed(index, &self.state) else { continue };
            pressed.into_iter().for_each(|(component, force)| self.outside[component] += force);
            *enclosed = Some(measured);
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
            // At the start: the given energy.
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

    /// Returns the holding forces of the three components from one on.
    fn held(&self, first: usize) -> [f64; 3] {
        let forces = self.method.forces();
        let [internal, loads] = [forces.internal(), forces.loads()];
        [first, first + 1, first + 2]
            .map(|at| if self.prescribed[at] { internal[at] - loads[at] } else { 0.0 })
    }

    /// Puts a spring at each node of each grip. Together the springs pull with k (p − x̄), x̄ the mean of the
    /// nodes by their weights. Within a step the springs keep the shape of the gripped nodes. So each spring
    /// acts on a single node, and the equations have no more entries.
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
        self.method.act(|forces| forces.grip(&self.springs), |solver| solver.grip(&self.springs));
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
        let tolerance = self.method.equations().map_or(f64::NAN, |solver| solver.tolerance());
        let relative = |residual: &f64| residual / last.allowed * tolerance;
        let residual = last.residuals.last().map(relative).filter(|residual| residual.is_finite());
        FailedLoadStep { number, of: self.steps.number, iterations: last.iterations(), residual }
    }

    /// Keeps the iterations of all attempts of a step, also of failed ones.
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
fn keep(kept: &mut VecDeque<Iterated>, more: impl Iterator<Item = Iterated>) {
    kept.extend(more);
    kept.drain(..kept.len().saturating_sub(ITERATIONS_KEPT));
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

impl Assembled {
    /// Continues from the state of a run of the same bodies.
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
        if let Some(solver) = self.method.equations_mut() {
            solver.take_lags(lags);
        }
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
        if let Some(system) = self.method.contact_mut() {
            *system.legs_mut() = legs.into_iter().collect();
        }
        if let Some(ContactState { forces, totals, moments, energy, touches, pairs, lags }) = contact {
            let gap = touches.iter().map(|touched| touched.gap).reduce(f64::min);
            if let Some(system) = self.method.contact_mut() {
                system.go_on_from(touches.clone(), lags);
            }
            self.contact = Some(ContactNow { forces, totals, moments, energy, gap, nodes: touches });
            let taken = self.method.equations_mut().map_or(Ok(()), |solver| solver.take_contact_pairs(pairs));
            taken.map_err(|error| failure(&error, &self.model, &self.bodies, self.time))?;
        }
        if let (Some(values), Some(solver)) = (factored, self.method.equations_mut()) {
            solver.precondition_with(values);
        }
        Ok(())
    }

    fn implicit_state(&self) -> ImplicitState {
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
            contact: self.contact.as_ref().zip(self.method.contact()).map(|(now, system)| ContactState {
                forces: now.forces.clone(),
                totals: now.totals.clone(),
                moments: now.moments.clone(),
                energy: now.energy,
                touches: now.nodes.clone(),
                pairs: system.pairs().to_vec(),
                lags: system.lags().to_vec(),
            }),
            legs: (self.method.contact().into_iter())
                .flat_map(|system| system.legs().iter().map(|(&rigid, &leg)| (rigid, leg)))
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
            factored: self.method.equations().and_then(|solver| solver.factored()).map(<[f64]>::to_vec),
            entered: self.entered,
        }
    }
}
