//! Forces and stiffness of a model at a state: cells side by side, then added up in their order, so that the number of
//! threads changes no bit.

pub(crate) mod conditions;
pub(crate) mod contact;
mod equations;
mod facets;
pub(crate) mod followers;
mod gathering;
pub(crate) mod prescribed;
mod pressures;
pub(crate) mod samples;
mod solids;
mod turns;

use std::sync::Arc;
use std::time::{Duration, Instant};

use nalgebra::Vector3;
use pliant_contact::lag::Lag;
use pliant_mechanics::StopFlag;
use pliant_mechanics::load::{Load, LoadKind, Spread};
use pliant_mechanics::model::{Constraint, Motion};
use pulp::Arch;

pub use self::equations::bytes_of_factors;
use self::facets::ChunkResults;
use self::facets::Pressure;
use self::facets::corners_of;
use crate::curved::surface::CurvedSurface;
use crate::model::assembly::{Assembly, Spring};
use crate::model::error::SolveError;
use crate::model::state::State;
use crate::solid::relaxation::{History, Relaxation};
use crate::solid::{Response, Stars};
use crate::system::conditions::Conditions;
use crate::system::contact::TouchingSystem;
use crate::system::followers::Followers;
use crate::system::gathering::Corners;
use crate::system::prescribed::Gap;
use pliant_linear::lanes::PACK;
use pliant_linear::sparse::{Cell, Equations, LowerMatrix, NONE};
use pliant_linear::{DeviceTimes, LinearDevice, LinearReport, LinearSolver, Workspace};
use pliant_shells::EdgeRule;
use pliant_shells::facet_packs::FacetPack;

/// Cells of solids computed side by side before they are added up.
const CHUNK: usize = 256;

/// Facets per chunk. The next chunk is computed while the current one is assembled.
const FACETS: usize = 128 * PACK;

/// Time spent so far in the parts of a solver.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Phases {
    /// Forces and stiffness of the cells, and adding them up.
    pub cells: Duration,
    /// Contacts: what comes near, gaps, forces and stiffness, and what motions are free.
    pub contact: Duration,
    /// Factorisation, or inverting the blocks of the preconditioner.
    pub preparation: Duration,
    /// Solution of the linear equations.
    pub solution: Duration,
    /// How often the forces of the cells were found.
    pub evaluations: usize,
    /// Linear equations solved.
    pub solutions: usize,
    /// Iterations of conjugate gradients.
    pub iterations: usize,
    /// What a device took of preparation and solution, where one solves the equations.
    pub device: DeviceTimes,
    /// Solutions that single precision on the device could not find, and that the CPU finished.
    pub left_to_cpu: usize,
}

impl Phases {
    /// What was spent since an earlier time.
    #[must_use]
    pub fn since(&self, earlier: &Self) -> Self {
        let (now, then) = (self.device, earlier.device);
        Self {
            cells: self.cells - earlier.cells,
            contact: self.contact - earlier.contact,
            preparation: self.preparation - earlier.preparation,
            solution: self.solution - earlier.solution,
            evaluations: self.evaluations - earlier.evaluations,
            solutions: self.solutions - earlier.solutions,
            iterations: self.iterations - earlier.iterations,
            device: DeviceTimes {
                upload: now.upload - then.upload,
                iterations: now.iterations - then.iterations,
                read_back: now.read_back - then.read_back,
            },
            left_to_cpu: self.left_to_cpu - earlier.left_to_cpu,
        }
    }
}

/// A model's equations with the forces and the stiffness last found.
pub struct System {
    pub(crate) model: Arc<Assembly>,
    pub(crate) equations: Equations,
    pub(crate) matrix: LowerMatrix,
    /// Of each facet.
    places: Vec<Vec<u32>>,
    /// Facets with nodes that follow others.
    bound: Vec<bool>,
    /// Of the cells of each solid, and of its stars.
    solid_places: Vec<[Vec<Vec<u32>>; 2]>,
    /// Of the faces of each load that presses on solids.
    face_places: Vec<Vec<Vec<u32>>>,
    /// The averages of each solid that has some.
    stars: Vec<Option<Stars>>,
    /// How stresses relax in the step or at the instant.
    relaxation: Relaxation,
    /// None in a system of forces alone.
    workspace: Option<Workspace>,
    /// Internal forces and moments, six a node [N, N m].
    pub(crate) internal: Vec<f64>,
    /// Loads, without their controlled part.
    pub(crate) external: Vec<f64>,
    /// Loads for a factor of 1.
    pub(crate) controlled: Vec<f64>,
    /// What prescribed increments make of forces on free components: K_fc d_c.
    pub(crate) coupling: Vec<f64>,
    /// Springs that come and go between steps; their forces count as loads.
    held: Vec<Spring>,
    /// Forces [N] on nodes that come and go between steps.
    pushed: Vec<(u32, [f64; 3])>,
    /// Pressures on facets.
    pressure: Vec<Pressure>,
    /// The curved surface, if a load acts on it.
    surface: Option<CurvedSurface>,
    /// Whether the stiffness has the change of pressures on the curved surface, or that on the flat facets in its place, with which
    /// conjugate gradients converge more often and Newton's method slowly.
    pub(crate) exact_pressure: bool,
    /// Strain energy [J].
    pub(crate) energy: f64,
    /// What hourglass control holds of it [J].
    pub(crate) hourglass: f64,
    /// Largest force on a node of a cell [N].
    pub(crate) largest: f64,
    /// Of a chunk of facets that is found and of the one before, whose nodes take it up.
    results: [ChunkResults; 2],
    /// Of each chunk.
    corners: Vec<Corners>,
    /// Facets at rest.
    packs: Vec<FacetPack>,
    /// The instructions of the processor.
    arch: Arch,
    solid_results: Vec<Response>,
    pub(crate) phases: Phases,
    pub(crate) last_solution: LinearReport,
    /// Nodes that follow others; in a system of forces alone those of ties.
    followers: Option<Followers>,
    pub(crate) conditions: Conditions,
    solver: LinearSolver,
    /// What solves the equations in place of the CPU.
    device: Option<Arc<dyn LinearDevice>>,
    /// How far moved nodes whose force is limited are behind their motion, and volumes [m³] whose pressure is limited behind theirs, along the first axis, by
    /// their constraints; a system of forces alone has none.
    pub(crate) lags: Vec<Lag>,
    /// Contacts; a system of forces alone has none.
    pub(crate) touching: Option<Box<TouchingSystem>>,
    /// The stiffness at the start of a step that damps it; empty without such damping.
    pub(crate) damper: Vec<f64>,
    /// Ends steps under way, before the next solution.
    pub(crate) stop: StopFlag,
    /// Distances of prescribed components from their curves that are still to come in.
    gap: Option<Gap>,
}

impl System {
    pub(crate) fn new(model: Arc<Assembly>, solver: LinearSolver) -> Result<Self, SolveError> {
        Self::on(None, model, solver)
    }

    /// The same with a device that solves the equations.
    pub(crate) fn on(
        device: Option<Arc<dyn LinearDevice>>,
        model: Arc<Assembly>,
        solver: LinearSolver,
    ) -> Result<Self, SolveError> {
        if device.is_some() && !solver.suits_devices() {
            return Err(SolveError::Impossible(
                "a GPU solves equations by conjugate gradients with blocks or aggregates; take these, or the CPU",
            ));
        }
        let mut system = Self::forces_only(Arc::clone(&model));
        system.device = device;
        system.followers = Followers::of(&model, true);
        system.conditions = Conditions::of(&model, &system.equations, system.surface.as_ref());
        system.solver = solver;
        system.touching = model.touching.as_ref().map(|own| Box::new(TouchingSystem::new(own, &model)));
        system.lags = model.force_limits.keys().map(|&constraint| Lag::new(constraint as u32)).collect();
        system.coupling = vec![0.0; system.equations.count()];
        system.find_pattern()?;
        if model.stiffness_damping > 0.0 {
            system.damper = vec![0.0; system.matrix.value.len()];
        }
        Ok(system)
    }

    /// Takes nodes that follow others along with a motion, six components a node.
    pub(crate) fn follow(&self, motion: &mut [f64]) {
        if let Some(followers) = &self.followers {
            followers.follow(motion);
        }
    }

    /// Gives forces on tied nodes to those that they follow, six components a node.
    pub(crate) fn give_back(&self, forces: &mut [f64]) {
        if let Some(followers) = &self.followers {
            followers.give_back(forces);
        }
    }

    /// Keeps the stiffness as it is now for damping, if there is some.
    pub(crate) fn take_damper(&mut self) {
        let kept = self.damper.len();
        self.damper.copy_from_slice(&self.matrix.value[..kept]);
    }

    /// A system that has forces, but no stiffness.
    pub(crate) fn forces_only(model: Arc<Assembly>) -> Self {
        let nodes = model.rest.len();
        let mut free = vec![false; 6 * nodes];
        for &node in model.facets.iter().flat_map(|facet| &facet.nodes) {
            free[6 * node as usize..6 * node as usize + 3].fill(true);
        }
        for (node, turns) in model.turning().into_iter().enumerate() {
            free[6 * node + 3..6 * node + 6].fill(turns);
        }
        for &node in model.solid_cells().flatten() {
            free[6 * node as usize..6 * node as usize + 3].fill(true);
        }
        for constraint in &model.constraints {
            if let Motion::Rigid = constraint.motion {
                let nodes = constraint.nodes.iter().map(|&node| 6 * node as usize);
                nodes.for_each(|at| free[at..at + 6].fill(false));
                free[6 * constraint.nodes[0] as usize..][..6].fill(true);
            }
            for &node in constraint.nodes.iter().filter(|_| !constraint.motion.is_collective()) {
                for (c, &held) in constraint.components.iter().enumerate() {
                    free[6 * node as usize + c] &= !held;
                }
            }
        }
        for &node in model.ties.iter().flat_map(|tie| &tie.nodes) {
            free[6 * node as usize..6 * node as usize + 3].fill(false);
        }
        for turn in model.carried_turns() {
            free[6 * turn.node as usize + 3..6 * turn.node as usize + 6].fill(false);
        }
        let arch = Arch::new();
        Self {
            followers: Followers::of(&model, false),
            conditions: Conditions::default(),
            equations: Equations::new(&free),
            matrix: LowerMatrix::default(),
            places: Vec::new(),
            bound: Vec::new(),
            solid_places: Vec::new(),
            face_places: Vec::new(),
            stars: model.solids.iter().map(Stars::of).collect(),
            relaxation: Relaxation::of(&model),
            solid_results: vec![Response::none(); CHUNK],
            workspace: None,
            internal: vec![0.0; 6 * nodes],
            external: vec![0.0; 6 * nodes],
            controlled: vec![0.0; 6 * nodes],
            coupling: Vec::new(),
            held: Vec::new(),
            pushed: Vec::new(),
            pressure: vec![Pressure::default(); model.facets.len()],
            exact_pressure: true,
            surface: needs_surface(&model).then(|| CurvedSurface::new(&model, EdgeRule::Arc)),
            energy: 0.0,
            hourglass: 0.0,
            largest: 0.0,
            // The second only where there is a second chunk.
            results: [0, FACETS]
                .map(|first| ChunkResults::new(FACETS.min(model.facets.len().saturating_sub(first)))),
            corners: model.facets.chunks(FACETS).map(corners_of).collect(),
            packs: FacetPack::all(arch, &model.facets, |node| model.place(node as usize)),
            arch,
            phases: Phases::default(),
            last_solution: LinearReport::default(),
            solver: LinearSolver::Direct,
            device: None,
            lags: Vec::new(),
            touching: None,
            damper: Vec::new(),
            stop: StopFlag::default(),
            gap: None,
            model,
        }
    }

    /// Takes hold of nodes: these springs and no others act from the next evaluation on, beside those of the model. Their forces are
    /// loads.
    pub(crate) fn hold(&mut self, springs: &[Spring]) {
        self.held.clear();
        self.held.extend_from_slice(springs);
    }

    /// Takes forces [N] on nodes: they and no others act from the next evaluation on.
    pub(crate) fn push(&mut self, forces: &[(u32, [f64; 3])]) {
        self.pushed.clear();
        self.pushed.extend_from_slice(forces);
    }

    /// Whether any law relaxes.
    pub(crate) fn relaxes(&self) -> bool {
        self.relaxation.is_there()
    }

    /// Evaluates ends of a step [s] from the instant of a history on, from now on.
    pub(crate) fn begin_step(&mut self, history: &History, step: f64) {
        self.relaxation.begin(&self.model, history, step);
    }

    /// Evaluates the instant of a history itself, from now on.
    pub(crate) fn stand(&mut self, history: &History) {
        self.relaxation.stand(&self.model, history);
    }

    /// Ends a step [s]: the history of a state is advanced from the state before, or from rest.
    pub(crate) fn end_step(&mut self, before: Option<&State>, state: &mut State, step: f64) {
        if let Some(before) = before {
            let time = before.time + step;
            self.lags.iter_mut().for_each(|lag| lag.advance(time));
            if let Some(touching) = &mut self.touching {
                touching.end_step(time);
            }
        }
        if !self.relaxes() {
            return;
        }
        let mut history = std::mem::take(&mut state.history);
        let place = |state: &State, node: u32| self.model.displacement(&state.position, node);
        let from = |node: u32| before.map_or([0.0; 3], |before| place(before, node));
        self.relaxation.end(&self.model, from, |node| place(state, node), step, &mut history);
        state.history = history;
    }

    /// Begins the history of a state, if it has not begun: how it is strained loads the instantaneous laws.
    pub(crate) fn begin_history(&mut self, state: &mut State) {
        if !state.history.begun {
            self.end_step(None, state, 0.0);
        }
    }

    /// Forces at a state and time; with a tangent also the stiffness, and what prescribed increments (six a node) make of it.
    pub(crate) fn evaluate(
        &mut self,
        state: &State,
        time: f64,
        tangent: Option<&[f64]>,
    ) -> Result<(), SolveError> {
        if let Some(touching) = &mut self.touching {
            touching.evaluate(state, self.followers.as_ref());
            if tangent.is_some() {
                self.make_room()?;
            }
        }
        let start = Instant::now();
        let mut of_contact = Duration::ZERO;
        if let Some(followers) = &mut self.followers {
            followers.turn(state);
        }
        let model = Arc::clone(&self.model);
        self.conditions.find_gaps(&model, &self.equations, self.surface.as_ref(), state, time);
        self.nodal_loads(state, time);
        self.internal.fill(0.0);
        (self.energy, self.hourglass) = (0.0, 0.0);
        self.largest = 0.0;
        if tangent.is_some() {
            self.matrix.clear();
            self.coupling.fill(0.0);
            if let Some(workspace) = &mut self.workspace {
                workspace.place(&state.position);
            }
        }
        // Within the threads' pool, so that no part waits for another thread to take it up.
        rayon::scope(|_| self.evaluate_facets(state, tangent))?;
        self.evaluate_solids(state, tangent)?;
        if let Some(moved) = tangent {
            self.press_faces(state, time, moved);
        }
        for spring in &model.springs {
            let at = 6 * spring.node as usize;
            let stretch = state.position[spring.node as usize] - spring.anchor;
            self.energy += 0.5 * spring.stiffness * stretch.norm_squared();
            for c in 0..3 {
                self.internal[at + c] += spring.stiffness * stretch[c];
            }
        }
        for spring in &self.held {
            let at = 6 * spring.node as usize;
            let stretch = state.position[spring.node as usize] - spring.anchor;
            for c in 0..3 {
                self.external[at + c] -= spring.stiffness * stretch[c];
            }
        }
        for (node, force) in &self.pushed {
            let own = &mut self.external[6 * *node as usize..];
            own.iter_mut().zip(force).for_each(|(own, force)| *own += force);
        }
        if tangent.is_some() {
            let held = std::mem::take(&mut self.held);
            model.springs.iter().chain(&held).for_each(|spring| self.add_spring(spring));
            self.held = held;
        }
        if let Some(followers) = &self.followers {
            if tangent.is_some() {
                let moment = |node: u32| {
                    let at = |c: usize| 6 * node as usize + 3 + c;
                    let of = |forces: &[f64]| Vector3::from_fn(|c, _| forces[at(c)]);
                    of(&self.internal) - of(&self.external) - of(&self.controlled) * state.load_factor
                };
                followers.add_turns(&self.equations, &mut self.matrix, moment, |_| 0.0);
            }
            for forces in [&mut self.internal, &mut self.external, &mut self.controlled] {
                followers.give_moments_back(forces);
            }
        }
        if let (Some(followers), true) = (&self.followers, tangent.is_some()) {
            let force =
                |at: usize| self.internal[at] - self.external[at] - state.load_factor * self.controlled[at];
            followers.add_parts(
                &self.equations,
                &mut self.matrix,
                |node| (0.0, Vector3::from_fn(|c, _| force(6 * node as usize + c))),
                |_| 0.0,
            );
        }
        if let Some(followers) = &self.followers {
            for forces in [&mut self.internal, &mut self.external, &mut self.controlled] {
                followers.give_back(forces);
            }
        }
        if let Some(touching) = &mut self.touching {
            self.external.iter_mut().zip(&touching.given).for_each(|(load, force)| *load += force);
            if let Some(moved) = tangent {
                let begun = Instant::now();
                let followers = self.followers.as_ref();
                touching.add_stiffness(
                    &self.equations,
                    &mut self.matrix,
                    followers,
                    moved,
                    &mut self.coupling,
                );
                of_contact = begun.elapsed();
                touching.spent += of_contact;
            }
            self.phases.contact = touching.spent;
        }
        if let Some(moved) = tangent {
            self.press_enclosures(state, moved);
        }
        if tangent.is_some() && !self.matrix.mirror.is_empty() {
            self.turn_moments(state.load_factor);
        }
        self.conditions.press(&self.equations, &mut self.external);
        self.phases.cells += start.elapsed() - of_contact;
        self.phases.evaluations += 1;
        Ok(())
    }

    /// Adds the stiffness of a spring.
    fn add_spring(&mut self, spring: &Spring) {
        let own = self.followers.as_ref().and_then(|own| own.spring(spring.node, spring.stiffness));
        if let Some(((nodes, components), stiffness)) = own {
            let places = self.matrix.places(&self.equations, &nodes, components);
            let cell = Cell { nodes: &nodes, components, places: &places, entries: &stiffness };
            self.matrix.add(&self.equations, &cell);
            return;
        }
        for &equation in &self.equations.number[6 * spring.node as usize..][..3] {
            if equation != NONE {
                self.matrix.add_diagonal(equation as usize, spring.stiffness);
            }
        }
    }

    /// An error of a step that began at a state; where the step is blocked, with what drives it there, its force and the gap.
    pub(crate) fn blocked_at(&mut self, state: &State, error: SolveError) -> SolveError {
        let SolveError::Blocked { time, part, iterations, .. } = error else { return error };
        self.stand(&state.history);
        if let Some(touching) = &mut self.touching {
            touching.stand(state);
        }
        if self.evaluate(state, state.time, None).is_err() {
            return error;
        }
        let gap = self.touching.as_ref().and_then(|own| own.barriers.least_gap()).unwrap_or(f64::INFINITY);
        let driver = self.hardest_driver([state.time, time]);
        if driver.is_none() && self.conditions.are_closed() {
            // Nothing is driven: loads press what does not come to rest.
            return SolveError::NotConverged { time, node: 0, residuals: Vec::new(), broken: None };
        }
        SolveError::Blocked { time, driver, part, gap, iterations }
    }

    /// Of tools and constraints that move between two times [s] the one that pushes hardest, with its force [N] at the state last evaluated.
    fn hardest_driver(&self, [from, to]: [f64; 2]) -> Option<(String, f64)> {
        let resisting = |at: usize| self.internal[at] - self.external[at];
        let held = |own: &Constraint| {
            let goes = |index: usize| own.motion.increment(index, from, to) != [0.0; 6];
            if matches!(own.motion, Motion::Fixed) || !(0..own.nodes.len()).any(goes) {
                return None;
            }
            let along = |c: usize| own.nodes.iter().map(|&node| resisting(6 * node as usize + c)).sum();
            let force = Vector3::from_fn(|c, _| if own.components[c] { along(c) } else { 0.0 });
            Some((own.name.clone(), force.norm()))
        };
        let constraints = self.model.constraints.iter().filter_map(|own| match &own.motion {
            Motion::Mean { by, curve, .. } => {
                let goes = *by != [0.0; 3] && curve.value(from) != curve.value(to);
                let force = own.mean_force(|node| [0, 1, 2].map(|c| resisting(6 * node as usize + c)));
                goes.then(|| (own.name.clone(), Vector3::from(force).norm()))
            }
            motion if motion.is_collective() => None,
            _ => held(own),
        });
        let tools = self.touching.iter().flat_map(|own| own.pushing([from, to]));
        constraints.chain(tools).fold(None, |hardest: Option<(String, f64)>, next| match hardest {
            Some(own) if own.1 >= next.1 => Some(own),
            _ => Some(next),
        })
    }

    fn add_forces(&mut self, nodes: &[u32], forces: &[f64]) {
        for (&node, force) in nodes.iter().zip(forces.chunks_exact(3)) {
            for (own, force) in self.internal[6 * node as usize..].iter_mut().zip(force) {
                *own += force;
                self.largest = self.largest.max(force.abs());
            }
        }
    }

    /// Whether a matrix that is indefinite may be so for the change of pressures on the curved surface: it is left out from now on.
    pub(crate) fn gives_way(&mut self, error: &SolveError) -> bool {
        let pressed = self.pressure.iter().any(|pressure| pressure.curved != [0.0; 2]);
        let gives_way = matches!(error, SolveError::Indefinite { .. }) && pressed && self.exact_pressure;
        self.exact_pressure &= !gives_way;
        gives_way
    }

    /// Increments of constrained components between two times, six a node.
    pub(crate) fn prescribed(&self, from: f64, to: f64, increments: &mut [f64]) {
        increments.fill(0.0);
        for constraint in &self.model.constraints {
            let moving = !matches!(constraint.motion, Motion::Fixed) && !constraint.motion.is_collective();
            for (index, &node) in constraint.nodes.iter().enumerate().filter(|_| moving) {
                let by = constraint.motion.increment(index, from, to);
                for c in (0..6).filter(|&c| constraint.components[c]) {
                    increments[6 * node as usize + c] = by[c];
                }
            }
        }
        if let Some(gap) = &self.gap {
            gap.add(from, to, increments);
        }
        self.follow(increments);
    }

    /// Brings prescribed components that are off their curves back to them between the time of a state and another one [s].
    pub(crate) fn catch_up(&mut self, state: &State, until: f64) {
        let lag = |number: usize| {
            let own = self.lags.iter().find(|lag| lag.number() == number);
            own.map_or_else(Vector3::zeros, Lag::now)
        };
        self.gap = Gap::of(&self.model, state, until, lag);
    }

    /// A vector of equations spread over all components; the others stay as they are.
    pub(crate) fn spread(&self, equations: &[f64], components: &mut [f64]) {
        for (&component, &value) in self.equations.component.iter().zip(equations) {
            components[component as usize] = value;
        }
        self.follow(components);
    }

    /// Moves a state by a part of an increment, six components a node.
    pub(crate) fn advance(&self, state: &mut State, increment: &[f64], part: f64) {
        state.advance(increment, part);
        if let Some(followers) = &self.followers {
            followers.place(&self.model, state);
        }
    }

    /// Adds to the stiffness what masses of rigid parts and of nodes that turn with a solid resist with: the rate [kg/s²] of each node and its
    /// force [N], the rate [N m] of its rotary inertia and its moment [N m].
    pub(crate) fn add_bound_masses(
        &mut self,
        of: impl Fn(u32) -> (f64, Vector3<f64>),
        rotary: impl Fn(u32) -> f64,
        moment: impl Fn(u32) -> Vector3<f64>,
    ) {
        if let Some(followers) = &self.followers {
            followers.add_parts(&self.equations, &mut self.matrix, of, &rotary);
            followers.add_turns(&self.equations, &mut self.matrix, moment, rotary);
        }
    }

    /// Takes forces [N] and moments [N m] of inertia on nodes of rigid parts, and moments on nodes that turn with a solid, from a residual.
    pub(crate) fn give_inertia_back(
        &self,
        force: impl Fn(u32) -> Vector3<f64>,
        moment: impl Fn(u32) -> Vector3<f64>,
        residual: &mut [f64],
    ) {
        let Some(followers) = &self.followers else { return };
        followers.pull(force, moment, |component, force| {
            let equation = self.equations.number[component];
            if equation != NONE {
                residual[equation as usize] -= force;
            }
        });
    }

    /// The values of the free components.
    pub(crate) fn gather(&self, components: &[f64], equations: &mut [f64]) {
        for (&component, value) in self.equations.component.iter().zip(equations) {
            *value = components[component as usize];
        }
    }
}

/// Whether something acts on the curved surface of shells.
fn needs_surface(model: &Assembly) -> bool {
    let loads = |load: &Load| {
        let curved = matches!(load.kind, LoadKind::ShellPressure { spread: Spread::Curved, .. });
        curved || load.surface.is_some_and(|surface| model.carried.contains_key(&surface))
    };
    let encloses = |own: &Constraint| matches!(&own.motion, Motion::Volume { enclosure, .. } if !enclosure.facets.is_empty());
    model.loads.iter().any(loads) || model.constraints.iter().any(encloses)
}
