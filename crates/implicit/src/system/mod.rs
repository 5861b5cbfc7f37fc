//! Forces and stiffness of a model at a state: cells side by side, then added up in their order, so that the number of
//! threads changes no bit.

pub(crate) mod conditions;
pub(crate) mod contact;
pub(crate) mod followers;
mod gathering;
pub(crate) mod prescribed;
pub(crate) mod samples;
mod turns;

use std::sync::Arc;
use std::time::{Duration, Instant};

use nalgebra::Vector3;
use pliant_contact::lag::Lag;
use pliant_mechanics::StopFlag;
use pliant_mechanics::load::{Face, Load, LoadKind, NO_NODE, Spread, face_areas};
use pliant_mechanics::mapping::{Configuration, Mapping};
use pliant_mechanics::model::{Constraint, Enclosed, Motion, Solid};
use pliant_mechanics::tensor::scale;
use pulp::Arch;
use rayon::prelude::*;

use crate::curved::mapping::CarriedPoints;
use crate::curved::surface::CurvedSurface;
use crate::model::assembly::{Assembly, Spring};
use crate::model::error::SolveError;
use crate::model::state::State;
use crate::model::turns::carried_turns;
use crate::solid::relaxation::{History, Relaxation};
use crate::solid::{Response, Stars};
use crate::system::conditions::{Conditions, add_gradient};
use crate::system::contact::TouchingSystem;
use crate::system::followers::Followers;
use crate::system::gathering::{ColumnSums, Corners, NodeSums};
use crate::system::prescribed::Gap;
use pliant_linear::lanes::PACK;
use pliant_linear::sparse::{Cell, Equations, LowerMatrix, NONE};
use pliant_linear::{
    DeviceTimes, Factors, LinearDevice, LinearError, LinearReport, LinearSolver, Workspace, ZERO_PIVOT,
};
use pliant_shells::Vector18;
use pliant_shells::facet_packs::{FacetPack, Work};
use pliant_shells::rotation::skew;
use pliant_shells::{Broken, Facet, Matrix18, symmetrise};
use pliant_shells::{EdgeRule, Patch};

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

/// Pressures on a facet [Pa], each fixed and controlled.
#[derive(Clone, Copy, Default, PartialEq)]
struct Pressure {
    lumped: [f64; 2],
    curved: [f64; 2],
}

/// What is found of the facets of a chunk.
#[derive(Default)]
struct ChunkResults {
    /// Apart from the rest: one thread looks at all of them.
    heads: Vec<FacetHead>,
    results: Vec<FacetResult>,
}

#[derive(Clone, Copy, Default)]
struct FacetHead {
    energy: f64,
    /// Largest force on a node [N].
    largest: f64,
    broken: Option<Broken>,
}

#[derive(Clone)]
struct FacetResult {
    force: Vector18,
    /// What the fixed and the controlled pressures make.
    loads: [Vector18; 2],
    tangent: Matrix18,
}

/// What facets are added to.
struct FacetSums {
    matrix: LowerMatrix,
    coupling: Vec<f64>,
    /// Internal forces, and fixed and controlled loads.
    forces: [Vec<f64>; 3],
}

/// Bytes that the factors of a model's equations take, without what contacts couple: found by the order of elimination, without numbers.
///
/// # Errors
/// If there are more equations than can be numbered, or the order has no room.
pub fn bytes_of_factors(model: &Arc<Assembly>) -> Result<u64, SolveError> {
    let matrix = System::forces_only(Arc::clone(model)).pattern();
    Factors::bytes(&matrix).map_err(linear_error)
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

    /// Nodes of a cell, those that follow others replaced by these, and how many components each has.
    fn expanded(&self, nodes: &[u32], turns: bool) -> (Vec<u32>, usize) {
        let expanded = self.followers.as_ref().and_then(|followers| followers.expanded(nodes, turns));
        expanded.unwrap_or_else(|| (nodes.to_vec(), if turns { 6 } else { 3 }))
    }

    /// The pattern of the matrix, with the pairs of nodes that contacts couple.
    fn pattern(&self) -> LowerMatrix {
        let model = &self.model;
        let facets = model.facets.iter().map(|facet| &facet.nodes[..]);
        let stars = self.stars.iter().flatten().flat_map(|stars| stars.nodes.iter().map(Vec::as_slice));
        let pairs = self.touching.as_ref().map_or(&[][..], |touching| touching.pairs());
        // Contacts on curved surfaces couple rotations, too.
        let is_curved = self.touching.as_ref().is_some_and(|touching| touching.is_curved());
        let (pairs, turning) = if is_curved { (&[][..], pairs) } else { (pairs, &[][..]) };
        let turning = turning.iter().map(|pair| &pair[..]);
        let Some(followers) = &self.followers else {
            let cells = facets.chain(model.solid_cells()).chain(stars).chain(turning);
            return LowerMatrix::new(&self.equations, cells, pairs);
        };
        let solids = model.solid_cells().chain(stars).map(|nodes| self.expanded(nodes, false));
        let turns = followers.turning_nodes().map(|nodes| self.expanded(&nodes, false));
        let shells = facets.map(|nodes| self.expanded(nodes, true));
        let expanded: Vec<(Vec<u32>, usize)> = shells.chain(solids).chain(turns).collect();
        let cells = expanded.iter().map(|(nodes, _)| nodes.as_slice()).chain(turning);
        LowerMatrix::new(&self.equations, cells, pairs)
    }

    /// Finds the pattern of the matrix and the places of cells in it.
    fn find_pattern(&mut self) -> Result<(), SolveError> {
        let mut matrix = self.pattern();
        if self.solver == LinearSolver::Unsymmetric {
            matrix.keep_mirror();
        }
        let system = self;
        let model = Arc::clone(&system.model);
        let placed = |nodes: &[u32], turns: bool| {
            let (nodes, components) = system.expanded(nodes, turns);
            matrix.places(&system.equations, &nodes, components)
        };
        let of_facets = model.facets.iter().map(|facet| placed(&facet.nodes, true)).collect();
        let is_bound = |facet: &Facet| {
            system
                .followers
                .as_ref()
                .is_some_and(|followers| followers.expanded(&facet.nodes, true).is_some())
        };
        let bound = model.facets.iter().map(is_bound).collect();
        let places = |nodes: &[u32]| placed(nodes, false);
        let of_solid = |(solid, stars): (&Solid, &Option<Stars>)| {
            let cells = (0..solid.cells.len()).map(|cell| places(solid.cells.nodes(cell)));
            let stars = stars.iter().flat_map(|stars| &stars.nodes).map(|nodes| places(nodes));
            [cells.collect(), stars.collect()]
        };
        let of_load = |(_, faces, _): (&Load, &Vec<Face>, f64)| {
            faces.iter().map(|face| places(corners(face))).collect()
        };
        let of_faces = pressing(&model).map(of_load).collect();
        let of_solids = model.solids.iter().zip(&system.stars).map(of_solid).collect();
        (system.places, system.bound) = (of_facets, bound);
        (system.face_places, system.solid_places) = (of_faces, of_solids);
        let (device, before) = (system.device.as_ref(), system.workspace.as_mut());
        let workspace = Workspace::new(system.solver, device, &system.equations, &matrix, before);
        system.workspace = Some(workspace.map_err(linear_error)?);
        system.matrix = matrix;
        Ok(())
    }

    /// Makes room in the pattern for the contacts that act or soon may.
    pub(crate) fn make_room(&mut self) -> Result<(), SolveError> {
        let Some(touching) = &mut self.touching else { return Ok(()) };
        if !touching.grow(&self.equations, &self.matrix, self.followers.as_ref()) {
            return Ok(());
        }
        self.set_pattern()
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

    /// Values of the older matrix whose factors precondition the next one, if there is one.
    pub(crate) fn factored(&self) -> Option<&[f64]> {
        self.workspace.as_ref()?.factored()
    }

    /// Takes the factors of a matrix with these values as preconditioner of the next one.
    pub(crate) fn precondition_with(&mut self, values: Vec<f64>) {
        if let Some(workspace) = &mut self.workspace {
            workspace.precondition_with(values, &mut self.matrix);
        }
    }

    /// Takes a pattern with these pairs of nodes for contacts.
    pub(crate) fn take_pairs(&mut self, pairs: Vec<[u32; 2]>) -> Result<(), SolveError> {
        match &mut self.touching {
            Some(touching) if touching.pairs != pairs => touching.pairs = pairs,
            _ => return Ok(()),
        }
        self.set_pattern()
    }

    /// Takes a pattern with the pairs of nodes that contacts have.
    fn set_pattern(&mut self) -> Result<(), SolveError> {
        let older = std::mem::take(&mut self.matrix);
        self.find_pattern()?;
        if !self.damper.is_empty() {
            self.damper = self.matrix.carried(&older, &self.damper);
        }
        Ok(())
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
        for turn in carried_turns(&model) {
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

    /// Subtracts S(m)/2 for the moments m on nodes, whose axes stay in space: their covariant derivative.
    fn turn_moments(&mut self, factor: f64) {
        for node in 0..self.model.rest.len() {
            let at = 6 * node + 3;
            let moment = Vector3::from_fn(|c, _| self.external[at + c] + factor * self.controlled[at + c]);
            if moment == Vector3::zeros() {
                continue;
            }
            let half = skew(&moment) * 0.5;
            let equation = |c: usize| self.equations.number[at + c];
            for (row, column) in [(0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1)] {
                if equation(row) != NONE && equation(column) != NONE {
                    self.matrix.add_entry(equation(row), equation(column), -half[(row, column)]);
                }
            }
        }
    }

    /// Loads on nodes, and pressures on facets.
    fn nodal_loads(&mut self, state: &State, time: f64) {
        let model = Arc::clone(&self.model);
        self.external.fill(0.0);
        self.controlled.fill(0.0);
        self.pressure.fill(Pressure::default());
        for load in &model.loads {
            let factor = load.curve.value(time);
            let target = if load.controlled { &mut self.controlled } else { &mut self.external };
            let mut add = |node: u32, first: usize, force: [f64; 3]| {
                for c in 0..3 {
                    target[6 * node as usize + first + c] += factor * force[c];
                }
            };
            let points =
                load.surface.map(|surface| CarriedPoints::new(&model, self.surface.as_ref(), surface));
            let mut apply = |at: u32, force: [f64; 3]| match points {
                None => add(at, 0, force),
                Some(points) => points.add_force(state, at as usize, force, &mut |node, force, moment| {
                    add(node, 0, force);
                    add(node, 3, moment);
                }),
            };
            match &load.kind {
                LoadKind::Forces(forces) => forces.iter().for_each(|&(at, force)| apply(at, force)),
                LoadKind::Pressure { faces, pressure } => {
                    let position = |at: u32| match points {
                        None => Configuration::position(state, at),
                        Some(points) => points.position(state, at as usize),
                    };
                    for face in faces {
                        for (at, area) in face_areas(face, position) {
                            apply(at, scale(area, -*pressure));
                        }
                    }
                }
                LoadKind::Moments(moments) => moments.iter().for_each(|&(node, moment)| add(node, 3, moment)),
                LoadKind::Gravity { body, acceleration } => {
                    for node in model.bodies[*body].nodes.clone() {
                        add(node, 0, scale(*acceleration, model.mass[node as usize]));
                    }
                }
                LoadKind::ShellPressure { facets, pressure, spread } => {
                    for &facet in facets {
                        let own = &mut self.pressure[facet as usize];
                        let own = match spread {
                            Spread::Lumped => &mut own.lumped,
                            Spread::Curved => &mut own.curved,
                        };
                        own[usize::from(load.controlled)] += factor * pressure;
                    }
                }
            }
        }
    }

    fn evaluate_facets(&mut self, state: &State, moved: Option<&[f64]>) -> Result<(), SolveError> {
        let [mut now, mut next] = std::mem::take(&mut self.results);
        let found = self.evaluate_chunks(state, moved, [&mut now, &mut next]);
        self.results = [now, next];
        found
    }

    /// The nodes of a chunk of facets take it up while the next one is found, so that threads seldom wait for each other.
    fn evaluate_chunks(
        &mut self,
        state: &State,
        moved: Option<&[f64]>,
        [mut now, mut next]: [&mut ChunkResults; 2],
    ) -> Result<(), SolveError> {
        let symmetric = self.matrix.mirror.is_empty();
        let tangent = moved.is_some();
        let wanted = Wanted { tangent, symmetric, exact_pressure: self.exact_pressure };
        let coupled = moved.filter(|moved| moved.iter().any(|&by| by != 0.0));
        let count = self.model.facets.len();
        self.find_facets(0, state, wanted, now);
        for first in (0..count).step_by(FACETS) {
            let heads = &now.heads[..FACETS.min(count - first)];
            if let Some((cell, why)) =
                (first..).zip(heads).find_map(|(cell, head)| Some((cell, head.broken?)))
            {
                return Err(SolveError::Broken { cell, why });
            }
            for head in heads {
                self.energy += head.energy;
                self.largest = self.largest.max(head.largest);
            }
            let mut sums = self.lend_sums();
            rayon::join(
                || self.gather_facets(first / FACETS, &now.results, tangent, coupled, &mut sums),
                || self.find_facets(first + FACETS, state, wanted, next),
            );
            self.take_back(sums);
            self.add_bound_facets(first, &now.results, moved);
            std::mem::swap(&mut now, &mut next);
        }
        Ok(())
    }

    fn lend_sums(&mut self) -> FacetSums {
        let forces = [&mut self.internal, &mut self.external, &mut self.controlled];
        FacetSums {
            matrix: std::mem::take(&mut self.matrix),
            coupling: std::mem::take(&mut self.coupling),
            forces: forces.map(std::mem::take),
        }
    }

    fn take_back(&mut self, FacetSums { matrix, coupling, forces }: FacetSums) {
        (self.matrix, self.coupling) = (matrix, coupling);
        [self.internal, self.external, self.controlled] = forces;
    }

    /// Finds forces of the facets from one on, at most a chunk, and their stiffness if it is wanted.
    fn find_facets(&self, first: usize, state: &State, wanted: Wanted, found: &mut ChunkResults) {
        let facets = self.model.facets.get(first..).unwrap_or_default();
        let heads = found.heads.par_chunks_mut(PACK).zip(found.results.par_chunks_mut(PACK));
        let packs = heads.zip(facets.par_chunks(PACK)).enumerate().with_min_len(2);
        packs.for_each_init(Work::new, |work, (at, ((heads, results), facets))| {
            let from = first + at * PACK;
            for (lane, facet) in facets.iter().enumerate() {
                let (x, rotation) = state.corners(facet.nodes);
                work.put(lane, &x, &rotation);
            }
            work.find(self.arch, &self.packs[from / PACK], facets.len(), wanted.tangent);
            take(work, wanted, heads, results);
            for ((number, facet), (head, result)) in (from..).zip(facets).zip(heads.iter().zip(results)) {
                let pressure = self.pressure[number];
                if pressure != Pressure::default() && head.broken.is_none() {
                    let patch = || {
                        self.surface.as_ref().map(|surface| surface.patch(&self.model, state, number as u32))
                    };
                    let (x, _) = state.corners(facet.nodes);
                    result.press(&x, pressure, patch, state.load_factor, wanted);
                }
            }
        });
    }

    /// Adds forces of a chunk of facets and, if it is wanted, the stiffness of those whose nodes follow no others; with what it makes of
    /// prescribed motions.
    fn gather_facets(
        &self,
        chunk: usize,
        results: &[FacetResult],
        tangent: bool,
        moved: Option<&[f64]>,
        FacetSums { matrix, coupling, forces }: &mut FacetSums,
    ) {
        let stiffness = tangent.then(|| {
            let (values, column_start) = matrix.values();
            ColumnSums { first: 0, coupling, values, column_start }
        });
        let forces = forces.each_mut().map(|own| &mut own[..]);
        let (first, equations) = (chunk * FACETS, &self.equations);
        let (facets, pressure) = (&self.model.facets[first..], &self.pressure[first..]);
        let (places, bound) = (&self.places, &self.bound);
        let take = |node: u32, corners: &[u32], sums: &mut NodeSums<'_>| {
            for &corner in corners {
                let (at, corner) = (corner as usize / 3, corner as usize % 3);
                let (result, facet) = (&results[at], &facets[at]);
                result.add_forces(
                    corner,
                    pressure[at] != Pressure::default(),
                    node - sums.first,
                    &mut sums.forces,
                );
                let Some(sums) = sums.stiffness.as_mut().filter(|_| !bound[first + at]) else { continue };
                let entries = result.tangent.as_slice();
                let cell = Cell { nodes: &facet.nodes, components: 6, places: &places[first + at], entries };
                sums.values.add(equations, &cell, corner);
                if let Some(moved) = moved {
                    result.couple(facet, corner, moved, equations, sums);
                }
            }
        };
        self.corners[chunk].visit(equations, NodeSums { first: 0, forces, stiffness }, &take);
    }

    /// Adds the stiffness of those facets of a chunk whose nodes follow others.
    fn add_bound_facets(&mut self, first: usize, results: &[FacetResult], moved: Option<&[f64]>) {
        let model = Arc::clone(&self.model);
        let Some(moved) = moved else { return };
        for (number, result) in (first..model.facets.len()).zip(results) {
            if !self.bound[number] {
                continue;
            }
            let nodes = &model.facets[number].nodes;
            let Some(followers) = &self.followers else { continue };
            let Some(expanded) = followers.expanded(nodes, true) else { continue };
            let whole = followers.condensed(nodes, 6, &expanded, result.tangent.as_slice());
            let places = std::mem::take(&mut self.places[number]);
            self.add_block(&expanded.0, expanded.1, &places, &whole, moved);
            self.places[number] = places;
        }
    }

    fn evaluate_solids(&mut self, state: &State, moved: Option<&[f64]>) -> Result<(), SolveError> {
        let model = Arc::clone(&self.model);
        let displacement = |node: u32| model.displacement(&state.position, node);
        let mut results = std::mem::take(&mut self.solid_results);
        let mut all_stars = std::mem::take(&mut self.stars);
        let relaxation = std::mem::take(&mut self.relaxation);
        self.energy += relaxation.work(&state.history);
        let mut first_cell = model.facets.len();
        let mut broken = None;
        for (index, (solid, stars)) in model.solids.iter().zip(&mut all_stars).enumerate() {
            let count = solid.cells.len();
            if let Some(stars) = stars {
                self.energy += stars.find(solid, displacement);
            }
            for first in (0..count).step_by(CHUNK) {
                let last = (first + CHUNK).min(count);
                results[..last - first].par_iter_mut().with_min_len(16).enumerate().for_each(
                    |(at, result)| {
                        let pressure = stars.as_ref().map(|stars| stars.pressure(first + at));
                        let lag = relaxation.of_cell(index, solid, first + at);
                        result.fill(solid, first + at, pressure, lag, displacement, moved.is_some());
                    },
                );
                broken = (first..last).zip(&results).find_map(|(cell, result)| Some((cell, result.broken?)));
                if broken.is_some() {
                    break;
                }
                for (cell, result) in (first..last).zip(&results) {
                    self.energy += result.energy;
                    self.hourglass += result.hourglass;
                    self.add_forces(solid.cells.nodes(cell), &result.force);
                    if let Some(moved) = moved {
                        self.add_stiffness(solid.cells.nodes(cell), [index, 0, cell], &result.tangent, moved);
                    }
                }
            }
            if let (Some(stars), Some(moved), None) = (stars, moved, broken) {
                for (star, nodes) in stars.nodes.iter().enumerate() {
                    let tangent = &mut results[0].tangent;
                    stars.stiffness(star, solid, displacement, tangent);
                    self.add_stiffness(nodes, [index, 1, star], tangent, moved);
                }
            }
            if broken.is_some() {
                break;
            }
            first_cell += count;
        }
        (self.solid_results, self.stars, self.relaxation) = (results, all_stars, relaxation);
        broken.map_or(Ok(()), |(cell, why)| Err(SolveError::Broken { cell: first_cell + cell, why }))
    }

    /// Adds how pressures on faces of solids change with their nodes, its symmetric part unless both halves are kept: all of it where
    /// the faces close or end at held nodes.
    fn press_faces(&mut self, state: &State, time: f64, moved: &[f64]) {
        let model = Arc::clone(&self.model);
        for (number, (load, faces, pressure)) in pressing(&model).enumerate() {
            let places = std::mem::take(&mut self.face_places[number]);
            let factor = if load.controlled { state.load_factor } else { 1.0 } * load.curve.value(time);
            for (face, places) in faces.iter().zip(&places) {
                self.press_face(face, places, factor * pressure, state, moved);
            }
            self.face_places[number] = places;
        }
    }

    /// The same for one face, at its places.
    fn press_face(&mut self, face: &Face, places: &[u32], pressure: f64, state: &State, moved: &[f64]) {
        let nodes = corners(face);
        let symmetric = self.matrix.mirror.is_empty();
        let tangent = pressure_change(face, nodes.len(), state, pressure, symmetric);
        self.add_at(nodes, places, &tangent, moved);
    }

    /// Adds how the pressures in enclosures change with their nodes.
    fn press_enclosures(&mut self, state: &State, moved: &[f64]) {
        if self.conditions.is_empty() {
            return;
        }
        let model = Arc::clone(&self.model);
        let conditions = std::mem::take(&mut self.conditions);
        let resisting =
            |at: usize| self.internal[at] - self.external[at] - state.load_factor * self.controlled[at];
        let all = conditions.pressures(&model, &self.equations, resisting);
        let symmetric = self.matrix.mirror.is_empty();
        for (own, enclosure, pressure) in all {
            for face in &enclosure.faces {
                let face = face.map(|at| if at == NO_NODE { at } else { own.nodes[at as usize] });
                let places = self.matrix.places(&self.equations, corners(&face), 3);
                self.press_face(&face, &places, -pressure, state, moved);
            }
            for &facet in &enclosure.facets {
                let Some(surface) = &self.surface else { break };
                let patch = surface.patch(&model, state, facet);
                let mut tangent = patch.pressure_change() * -pressure;
                if symmetric {
                    symmetrise(&mut tangent);
                } else {
                    // The covariant derivative of the moments.
                    let forces = patch.pressure_forces() * pressure;
                    for first in [3, 9, 15] {
                        let moment = Vector3::new(forces[first], forces[first + 1], forces[first + 2]);
                        let mut own = tangent.fixed_view_mut::<3, 3>(first, first);
                        own -= skew(&moment) * 0.5;
                    }
                }
                let places = std::mem::take(&mut self.places[facet as usize]);
                self.add_block(&model.facets[facet as usize].nodes, 6, &places, tangent.as_slice(), moved);
                self.places[facet as usize] = places;
            }
        }
        self.conditions = conditions;
    }

    /// What a constraint of volume encloses at the state last evaluated, with the pressure that balances what its nodes resist with, and the
    /// forces of that, component by component; `None` of other constraints.
    pub(crate) fn enclosed(&self, constraint: usize, state: &State) -> Option<(Enclosed, Vec<(usize, f64)>)> {
        let own = &self.model.constraints[constraint];
        let Motion::Volume { enclosure, .. } = &own.motion else { return None };
        let mut all: Vec<(usize, f64)> = Vec::new();
        let surface = self.surface.as_ref();
        let volume = add_gradient(&self.model, surface, own, enclosure, state, &mut |component, value| {
            if self.equations.number[component] != NONE {
                all.push((component, value));
            }
        });
        // Entries of one component together.
        all.sort_by_key(|&(component, _)| component);
        all.dedup_by(|next, own| {
            let same = next.0 == own.0;
            own.1 += if same { next.1 } else { 0.0 };
            same
        });
        let along = |&(at, g): &(usize, f64)| g * (self.internal[at] - self.external[at]);
        let squared: f64 = all.iter().map(|(_, g)| g * g).sum();
        let pressure = all.iter().map(along).sum::<f64>() / squared;
        all.iter_mut().for_each(|(_, g)| *g *= pressure);
        Some((Enclosed { volume, pressure }, all))
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

    /// Adds a stiffness of translations; its place is that of a solid, of its cells (0) or stars (1), by number.
    fn add_stiffness(
        &mut self,
        nodes: &[u32],
        [solid, kind, at]: [usize; 3],
        tangent: &[f64],
        moved: &[f64],
    ) {
        let places = std::mem::take(&mut self.solid_places[solid][kind][at]);
        self.add_at(nodes, &places, tangent, moved);
        self.solid_places[solid][kind][at] = places;
    }

    /// Adds a stiffness of translations at its places.
    fn add_at(&mut self, nodes: &[u32], places: &[u32], tangent: &[f64], moved: &[f64]) {
        let expanded = self.followers.as_ref().and_then(|followers| followers.expanded(nodes, false));
        match (expanded, &self.followers) {
            (Some(own), Some(followers)) => {
                let whole = followers.condensed(nodes, 3, &own, tangent);
                self.add_block(&own.0, own.1, places, &whole, moved);
            }
            _ => self.add_block(nodes, 3, places, tangent, moved),
        }
    }

    /// Adds a stiffness of the first components of nodes at its places, and what prescribed increments make of it.
    fn add_block(
        &mut self,
        nodes: &[u32],
        components: usize,
        places: &[u32],
        tangent: &[f64],
        moved: &[f64],
    ) {
        self.matrix.add(&self.equations, &Cell { nodes, components, places, entries: tangent });
        let component = |i: usize| 6 * nodes[i / components] as usize + i % components;
        let size = components * nodes.len();
        for (column, entries) in tangent.chunks_exact(size).enumerate() {
            let by = moved[component(column)];
            if by == 0.0 {
                continue;
            }
            for (row, entry) in entries.iter().enumerate() {
                let equation = self.equations.number[component(row)];
                if equation != NONE {
                    self.coupling[equation as usize] += entry * by;
                }
            }
        }
    }

    /// Takes the matrix as it now is for the coming solutions; returns its negative pivots.
    pub(crate) fn prepare(&mut self) -> Result<usize, SolveError> {
        if self.stop.is_asked() {
            return Err(SolveError::Stopped);
        }
        let start = Instant::now();
        self.conditions.pin(&mut self.matrix);
        let Some(workspace) = &mut self.workspace else { return Ok(0) };
        let pivots = workspace.prepare(&self.matrix).map_err(linear_error)?;
        self.phases.preparation += start.elapsed();
        if pivots.smallest < ZERO_PIVOT {
            let component = self.equations.component[pivots.weakest] as usize;
            const NAMES: [&str; 6] =
                ["x", "y", "z", "rotation about x", "rotation about y", "rotation about z"];
            return Err(SolveError::Singular {
                node: (component / 6) as u32,
                component: NAMES[component % 6],
                pivot: pivots.smallest,
            });
        }
        if self.conditions.has_rows() {
            let mut conditions = std::mem::take(&mut self.conditions);
            let prepared = conditions.prepare(|right, solution| self.solve_pinned(right, solution));
            self.conditions = conditions;
            prepared?;
        }
        Ok(pivots.negative)
    }

    /// Whether a matrix that is indefinite may be so for the change of pressures on the curved surface: it is left out from now on.
    pub(crate) fn gives_way(&mut self, error: &SolveError) -> bool {
        let pressed = self.pressure.iter().any(|pressure| pressure.curved != [0.0; 2]);
        let gives_way = matches!(error, SolveError::Indefinite { .. }) && pressed && self.exact_pressure;
        self.exact_pressure &= !gives_way;
        gives_way
    }

    /// Solves with the matrix prepared.
    pub(crate) fn solve(&mut self, right: &[f64], solution: &mut [f64]) -> Result<(), SolveError> {
        solution.fill(0.0);
        self.solve_from(right, solution)
    }

    /// The same with means and volumes that stay as they are.
    pub(crate) fn respond(&mut self, right: &[f64], solution: &mut [f64]) -> Result<(), SolveError> {
        solution.fill(0.0);
        self.solve_pinned(right, solution)?;
        self.conditions.correct(solution, false);
        Ok(())
    }

    /// Solves with the matrix prepared; conjugate gradients start from a multiple of the solution given, and leave what they reached there if
    /// iterations run out.
    pub(crate) fn solve_from(&mut self, right: &[f64], solution: &mut [f64]) -> Result<(), SolveError> {
        let result = self.solve_pinned(right, solution);
        self.conditions.correct(solution, true);
        result
    }

    /// Solves with the matrix as it is, with the springs that hold means and volumes.
    fn solve_pinned(&mut self, right: &[f64], solution: &mut [f64]) -> Result<(), SolveError> {
        let start = Instant::now();
        let Some(workspace) = &mut self.workspace else { return Ok(()) };
        let result = workspace.solve(&self.matrix, right, solution);
        if let Ok(report) | Err(LinearError::Stalled(report)) = &result {
            self.last_solution = *report;
        }
        (self.phases.device, self.phases.left_to_cpu) = workspace.of_device();
        self.phases.solution += start.elapsed();
        self.phases.solutions += 1;
        self.phases.iterations += self.last_solution.iterations;
        result.map(|_| ()).map_err(linear_error)
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

/// The pressures on faces of solids. How those on carried surfaces change with the state is left out of the stiffness.
fn pressing(model: &Assembly) -> impl Iterator<Item = (&Load, &Vec<Face>, f64)> {
    model.loads.iter().filter_map(|load| match &load.kind {
        LoadKind::Pressure { faces, pressure } if load.surface.is_none() => Some((load, faces, *pressure)),
        _ => None,
    })
}

/// The corners of facets by nodes.
fn corners_of(facets: &[Facet]) -> Corners {
    Corners::of(facets.iter().map(|facet| facet.nodes))
}

/// The nodes of a face of a solid.
fn corners(face: &Face) -> &[u32] {
    if face[3] == NO_NODE { &face[..3] } else { face }
}

fn linear_error(error: LinearError) -> SolveError {
    match error {
        LinearError::TooLarge => SolveError::Impossible(
            "the equations are too many for the direct solver; use conjugate gradients",
        ),
        LinearError::OutOfMemory(needed) => SolveError::OutOfMemory(needed),
        LinearError::Device(error) => SolveError::Device(error),
        LinearError::NotFinite => SolveError::Impossible("the stiffness is not finite; use smaller steps"),
        LinearError::Indefinite(iterations) => SolveError::Indefinite { iterations },
        LinearError::Stalled(LinearReport { iterations, residual }) => {
            SolveError::Stalled { iterations, residual }
        }
    }
}

/// The derivative of p ∫ N_a n dA of a face by the places of its nodes, column by column: what the pressure pushes against the
/// outward normal; its symmetric part alone if that is wanted. By differences, exact: the areas are of second order in each place.
fn pressure_change(face: &Face, count: usize, state: &State, pressure: f64, symmetric: bool) -> Vec<f64> {
    let size = 3 * count;
    let mut tangent = vec![0.0; size * size];
    let place = |node: u32| -> [f64; 3] { state.position[node as usize].into() };
    let [first, second] = [face[0], face[2]].map(|node| state.position[node as usize]);
    let h = 0.1 * (second - first).norm();
    for (b, &moved) in face[..count].iter().enumerate() {
        for k in 0..3 {
            let areas = |by: f64| {
                let shifted = |node: u32| {
                    let mut at = place(node);
                    at[k] += if node == moved { by } else { 0.0 };
                    at
                };
                face_areas(face, shifted).collect::<Vec<_>>()
            };
            for (a, (ahead, behind)) in areas(h).into_iter().zip(areas(-h)).enumerate() {
                for i in 0..3 {
                    tangent[(3 * b + k) * size + 3 * a + i] =
                        pressure * (ahead.1[i] - behind.1[i]) / (2.0 * h);
                }
            }
        }
    }
    for (i, j) in (0..size).flat_map(|j| (0..j).map(move |i| (i, j))).filter(|_| symmetric) {
        let mean = 0.5 * (tangent[j * size + i] + tangent[i * size + j]);
        (tangent[j * size + i], tangent[i * size + j]) = (mean, mean);
    }
    tangent
}

/// A third of the area times the normal on each corner, as six numbers a node [m²].
fn flat_forces([a, b, c]: &[Vector3<f64>; 3]) -> Vector18 {
    let third = (b - a).cross(&(c - a)) / 6.0;
    Vector18::from_fn(|i, _| if i % 6 < 3 { third[i % 6] } else { 0.0 })
}

/// What is wanted of facets.
#[derive(Clone, Copy)]
struct Wanted {
    /// Whether their stiffness, too.
    tangent: bool,
    /// Whether only the symmetric part of it.
    symmetric: bool,
    /// Whether the change of pressures on the curved surface is that of the flat facets.
    exact_pressure: bool,
}

impl ChunkResults {
    /// With room for some facets.
    fn new(facets: usize) -> Self {
        Self { heads: vec![FacetHead::default(); facets], results: vec![FacetResult::none(); facets] }
    }
}

impl FacetResult {
    fn none() -> Self {
        let loads = [Vector18::zeros(); 2];
        let (force, tangent) = (Vector18::zeros(), Matrix18::zeros());
        Self { force, loads, tangent }
    }

    /// Adds what a corner is given to the sums of a node, a number of nodes after the first.
    fn add_forces(
        &self,
        corner: usize,
        pressed: bool,
        node: u32,
        [internal, fixed, controlled]: &mut [&mut [f64]; 3],
    ) {
        let (from, to) = (6 * corner, 6 * node as usize);
        let add = |sums: &mut [f64], forces: &Vector18| {
            let forces = &forces.as_slice()[from..from + 6];
            sums[to..to + 6].iter_mut().zip(forces).for_each(|(sum, force)| *sum += force);
        };
        add(internal, &self.force);
        if pressed {
            add(fixed, &self.loads[0]);
            add(controlled, &self.loads[1]);
        }
    }

    /// Adds what prescribed increments, six a node, make of the forces on a corner.
    fn couple(
        &self,
        facet: &Facet,
        corner: usize,
        moved: &[f64],
        equations: &Equations,
        ColumnSums { first, coupling, .. }: &mut ColumnSums<'_>,
    ) {
        let rows = &equations.number[6 * facet.nodes[corner] as usize..][..6];
        for (j, column) in self.tangent.column_iter().enumerate() {
            let by = moved[6 * facet.nodes[j / 6] as usize + j % 6];
            if by == 0.0 {
                continue;
            }
            for (c, &row) in rows.iter().enumerate().filter(|(_, row)| **row != NONE) {
                coupling[row as usize - *first] += column[6 * corner + c] * by;
            }
        }
    }

    /// Takes up the pressures.
    fn press(
        &mut self,
        x: &[Vector3<f64>; 3],
        Pressure { lumped, curved }: Pressure,
        patch: impl Fn() -> Option<Patch>,
        factor: f64,
        wanted: Wanted,
    ) {
        let whole = |[fixed, controlled]: [f64; 2]| fixed + factor * controlled;
        let flat = flat_forces(x);
        self.loads = lumped.map(|pressure| flat * pressure);
        let mut follows = whole(lumped);
        if let Some(patch) = (curved != [0.0; 2]).then(patch).flatten() {
            let forces = patch.pressure_forces();
            for (load, pressure) in self.loads.iter_mut().zip(curved) {
                *load += forces * pressure;
            }
            if wanted.tangent && wanted.exact_pressure {
                let mut change = patch.pressure_change() * whole(curved);
                if wanted.symmetric {
                    symmetrise(&mut change);
                }
                self.tangent -= change;
            } else {
                follows += whole(curved);
            }
        }
        if wanted.tangent && follows != 0.0 {
            follow(&mut self.tangent, x, follows, wanted.symmetric);
        }
    }
}

/// Takes what was found of each lane.
fn take(work: &Work, wanted: Wanted, heads: &mut [FacetHead], results: &mut [FacetResult]) {
    for (lane, (head, result)) in heads.iter_mut().zip(results).enumerate() {
        let energy;
        (energy, result.force) = work.force(lane);
        let forces = result.force.iter().enumerate().filter(|(i, _)| i % 6 < 3);
        let largest = forces.fold(0.0, |largest: f64, (_, force)| largest.max(force.abs()));
        *head = FacetHead { energy, largest, broken: work.broken(lane) };
        if wanted.tangent {
            work.take_tangent(lane, &mut result.tangent);
        }
    }
}

/// Takes from a stiffness how p A n/3 changes with the corners, or the symmetric part of that.
fn follow(k: &mut Matrix18, x: &[Vector3<f64>; 3], pressure: f64, symmetric: bool) {
    let opposite = [0, 1, 2].map(|j| (x[(j + 2) % 3] - x[(j + 1) % 3]) * (pressure / 6.0));
    for (i, j) in (0..3).flat_map(|j| (0..3).map(move |i| (i, j))) {
        // Of a block S(a) and its mirror S(b)ᵀ = −S(b) the mean.
        let own = if symmetric { (opposite[j] - opposite[i]) * 0.5 } else { opposite[j] };
        let mut block = k.fixed_view_mut::<3, 3>(6 * i, 6 * j);
        block -= skew(&own);
    }
}
