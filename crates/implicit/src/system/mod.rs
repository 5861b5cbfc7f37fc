//! Forces and stiffness of a model at a state. Cells are found side by side, then added up in their order, so
//! that the number of threads changes no bit.

mod blocked;
pub(crate) mod conditions;
pub(crate) mod contact;
mod equations;
mod facets;
pub(crate) mod followers;
mod gathering;
mod loads;
mod nodal_forces;
pub(crate) mod prescribed;
pub(crate) mod samples;
mod solids;
mod stiffness;
mod turns;

use std::sync::Arc;
use std::time::{Duration, Instant};

use nalgebra::Vector3;
use pliant_contact::lag::Lag;
use pliant_linear::lanes::PACK;
use pliant_linear::sparse::{Equations, NONE};
use pliant_linear::{DeviceTimes, LinearDevice, LinearSolver};
use pliant_mechanics::StopFlag;
use pliant_mechanics::model::Motion;

pub use self::equations::bytes_of_factors;
use self::facets::Facets;
use self::nodal_forces::NodalForces;
use self::solids::Solids;
use self::stiffness::Stiffness;
use crate::model::assembly::{Assembly, Spring};
use crate::model::error::SolveError;
use crate::model::state::AssemblyState;
use crate::solid::relaxation::History;
use crate::system::conditions::Conditions;
use crate::system::contact::ContactSystem;
use crate::system::followers::Followers;
use crate::system::prescribed::Gap;

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
    /// Number of times that the forces of the cells were found.
    pub evaluations: usize,
    /// Linear equations solved.
    pub solutions: usize,
    /// Iterations of conjugate gradients.
    pub iterations: usize,
    /// Times of preparation and solution on a device, where one solves the equations.
    pub device: DeviceTimes,
    /// Solutions that single precision on the device could not find, and that the CPU finished.
    pub left_to_cpu: usize,
}

impl Phases {
    /// Times and counts since an earlier state.
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
    pub(crate) facets: Facets,
    solids: Solids,
    pub(crate) forces: NodalForces,
    pub(crate) stiffness: Stiffness,
    /// Nodes that follow others; in a system of forces alone only tied nodes.
    followers: Option<Followers>,
    pub(crate) conditions: Conditions,
    /// Lags of moved nodes whose force is limited, behind their motion, and of volumes [m³] whose pressure is
    /// limited, along the first axis. The order is by constraints; a system of forces alone has no lags.
    pub(crate) lags: Vec<Lag>,
    /// Contacts; a system of forces alone has none.
    pub(crate) contact: Option<Box<ContactSystem>>,
    /// Distances of prescribed components from their curves that are still to come in.
    gap: Option<Gap>,
    pub(crate) phases: Phases,
    /// Ends steps under way, before the next solution.
    pub(crate) stop: StopFlag,
}

/// Sums that cells are added to.
struct Sums<'a> {
    forces: &'a mut NodalForces,
    stiffness: &'a mut Stiffness,
    followers: Option<&'a Followers>,
}

impl Sums<'_> {
    /// Adds a stiffness of translations at its places.
    fn add_stiffness(&mut self, nodes: &[u32], places: &[u32], tangent: &[f64], moved: &[f64]) {
        self.stiffness.add_cell(self.followers, nodes, places, tangent, moved);
    }
}

impl System {
    pub(crate) fn new(model: Arc<Assembly>, solver: LinearSolver) -> Result<Self, SolveError> {
        Self::on(None, model, solver)
    }

    /// Makes a system with a device that solves the equations.
    pub(crate) fn on(
        device: Option<Arc<dyn LinearDevice>>,
        model: Arc<Assembly>,
        solver: LinearSolver,
    ) -> Result<Self, SolveError> {
        if device.is_some() && !solver.suits_devices() {
            return Err(SolveError::Impossible(
                "a GPU solves equations only by conjugate gradients with blocks or aggregates; use one of \
                 the two, or the CPU",
            ));
        }
        let mut system = Self::forces_only(Arc::clone(&model));
        let equations = &system.stiffness.equations;
        system.followers = Followers::of(&model, true);
        system.conditions = Conditions::of(&model, equations, system.facets.surface.as_ref());
        system.contact =
            model.contact.as_ref().map(|contacts| Box::new(ContactSystem::new(contacts, &model)));
        system.lags = model.force_limits.keys().map(|&constraint| Lag::new(constraint as u32)).collect();
        system.stiffness.coupling = vec![0.0; equations.count()];
        (system.stiffness.solver, system.stiffness.device) = (solver, device);
        system.find_pattern()?;
        if model.stiffness_damping > 0.0 {
            system.stiffness.damper = vec![0.0; system.stiffness.matrix.value.len()];
        }
        Ok(system)
    }

    /// A system that has forces, but no stiffness.
    pub(crate) fn forces_only(model: Arc<Assembly>) -> Self {
        Self {
            facets: Facets::new(&model),
            solids: Solids::new(&model),
            forces: NodalForces::new(model.rest.len()),
            stiffness: Stiffness::new(Equations::new(&free_components(&model))),
            followers: Followers::of(&model, false),
            conditions: Conditions::default(),
            lags: Vec::new(),
            contact: None,
            gap: None,
            phases: Phases::default(),
            stop: StopFlag::default(),
            model,
        }
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

    /// Takes hold of nodes: from the next evaluation on only these springs act, besides the springs of the
    /// model. Their forces are loads.
    pub(crate) fn grip(&mut self, springs: &[Spring]) {
        self.forces.grip(springs);
    }

    /// Takes forces [N] on nodes: they and no others act from the next evaluation on.
    pub(crate) fn push(&mut self, forces: &[(u32, [f64; 3])]) {
        self.forces.push(forces);
    }

    /// True if any law relaxes.
    pub(crate) fn relaxes(&self) -> bool {
        self.solids.relaxation.is_there()
    }

    /// Evaluates ends of a step [s] from the instant of a history on, from now on.
    pub(crate) fn begin_step(&mut self, history: &History, step: f64) {
        self.solids.relaxation.begin(&self.model, history, step);
    }

    /// Evaluates the instant of a history itself, from now on.
    pub(crate) fn stand(&mut self, history: &History) {
        self.solids.relaxation.stand(&self.model, history);
    }

    /// Ends a step [s]: the history of a state is advanced from the state before, or from rest.
    pub(crate) fn end_step(&mut self, before: Option<&AssemblyState>, state: &mut AssemblyState, step: f64) {
        if let Some(before) = before {
            let time = before.time + step;
            self.lags.iter_mut().for_each(|lag| lag.advance(time));
            if let Some(contact) = &mut self.contact {
                contact.end_step(time);
            }
        }
        if !self.relaxes() {
            return;
        }
        let mut history = std::mem::take(&mut state.history);
        let place = |state: &AssemblyState, node: u32| self.model.displacement(&state.position, node);
        let from = |node: u32| before.map_or([0.0; 3], |before| place(before, node));
        self.solids.relaxation.end(&self.model, from, |node| place(state, node), step, &mut history);
        state.history = history;
    }

    /// Begins the history of a state, if it has not begun: how it is strained loads the instantaneous laws.
    pub(crate) fn begin_history(&mut self, state: &mut AssemblyState) {
        if !state.history.begun {
            self.end_step(None, state, 0.0);
        }
    }

    /// Finds forces at a state and time. With a tangent it also finds the stiffness, and its product with
    /// prescribed increments (six a node).
    pub(crate) fn evaluate(
        &mut self,
        state: &AssemblyState,
        time: f64,
        tangent: Option<&[f64]>,
    ) -> Result<(), SolveError> {
        self.find_contacts(state, tangent.is_some())?;
        let start = Instant::now();
        self.begin_sums(state, time, tangent.is_some());
        self.add_cells(state, time, tangent)?;
        self.add_springs(state, tangent.is_some());
        self.give_to_followed(state.load_factor, tangent.is_some());
        let of_contact = self.add_contacts(tangent);
        if let Some(moved) = tangent {
            self.press_enclosures(state, moved);
        }
        let Self { forces, stiffness, conditions, phases, .. } = self;
        if tangent.is_some() && !stiffness.is_symmetric() {
            stiffness.turn_moments(forces, state.load_factor);
        }
        conditions.press(&stiffness.equations, &mut forces.external);
        phases.cells += start.elapsed() - of_contact;
        phases.evaluations += 1;
        Ok(())
    }

    /// Finds forces of contacts, and makes room for their stiffness if it is wanted.
    fn find_contacts(&mut self, state: &AssemblyState, tangent: bool) -> Result<(), SolveError> {
        let Some(contact) = &mut self.contact else { return Ok(()) };
        contact.evaluate(state, self.followers.as_ref());
        if tangent { self.make_room() } else { Ok(()) }
    }

    /// Takes what depends on the state alone, and begins sums with the loads.
    fn begin_sums(&mut self, state: &AssemblyState, time: f64, tangent: bool) {
        if let Some(followers) = &mut self.followers {
            followers.turn(state);
        }
        let Self { model, facets, forces, stiffness, conditions, .. } = self;
        conditions.find_gaps(model, &stiffness.equations, facets.surface.as_ref(), state, time);
        forces.clear();
        if tangent {
            stiffness.clear(&state.position);
        }
        self.find_loads(state, time);
    }

    /// Adds facets, solids and what presses on their faces.
    fn add_cells(
        &mut self,
        state: &AssemblyState,
        time: f64,
        tangent: Option<&[f64]>,
    ) -> Result<(), SolveError> {
        let Self { model, facets, solids, forces, stiffness, followers, .. } = self;
        let mut sums = Sums { forces, stiffness, followers: followers.as_ref() };
        // Within the threads' pool, so that no part waits for another thread to take it up.
        rayon::scope(|_| facets.add(model, state, tangent, &mut sums))?;
        solids.add(model, state, tangent, &mut sums)?;
        if let Some(moved) = tangent {
            solids.add_faces(model, state, time, moved, &mut sums);
        }
        Ok(())
    }

    /// Adds springs, and forces that come and go.
    fn add_springs(&mut self, state: &AssemblyState, tangent: bool) {
        let Self { model, forces, stiffness, followers, .. } = self;
        forces.add_springs(&model.springs, state);
        if tangent {
            let springs = model.springs.iter().chain(forces.held());
            springs.for_each(|spring| stiffness.add_spring(followers.as_ref(), spring));
        }
    }

    /// Carries forces on nodes that follow others to the followed nodes.
    fn give_to_followed(&mut self, load_factor: f64, tangent: bool) {
        let Self { forces, stiffness, followers, .. } = self;
        let Some(followers) = followers else { return };
        let Stiffness { equations, matrix, .. } = stiffness;
        if tangent {
            let moment =
                |node: u32| Vector3::from_fn(|c, _| forces.resisting(6 * node as usize + 3 + c, load_factor));
            followers.add_turns(equations, matrix, moment, |_| 0.0);
        }
        forces.kinds().into_iter().for_each(|components| followers.give_moments_back(components));
        if tangent {
            let force =
                |node: u32| Vector3::from_fn(|c, _| forces.resisting(6 * node as usize + c, load_factor));
            followers.add_parts(equations, matrix, |node| (0.0, force(node)), |_| 0.0);
        }
        forces.kinds().into_iter().for_each(|components| followers.give_back(components));
    }

    /// Adds contacts; the time that their stiffness took.
    fn add_contacts(&mut self, tangent: Option<&[f64]>) -> Duration {
        let Self { forces, stiffness, followers, contact, phases, .. } = self;
        let Some(contact) = contact else { return Duration::ZERO };
        let mut spent = Duration::ZERO;
        forces.external.iter_mut().zip(&contact.given).for_each(|(load, force)| *load += force);
        if let Some(moved) = tangent {
            let begun = Instant::now();
            let Stiffness { equations, matrix, coupling, .. } = stiffness;
            contact.add_stiffness(equations, matrix, followers.as_ref(), moved, coupling);
            spent = begun.elapsed();
            contact.spent += spent;
        }
        phases.contact = contact.spent;
        spent
    }

    /// True if an indefinite matrix may come from the change of pressures on the curved surface. This change
    /// is then left out until the solver turns `exact_pressure` on again.
    pub(crate) fn gives_way(&mut self, error: &SolveError) -> bool {
        let facets = &mut self.facets;
        let indefinite = matches!(error, SolveError::Indefinite { .. });
        let gives_way = indefinite && facets.are_pressed() && facets.exact_pressure;
        facets.exact_pressure &= !gives_way;
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

    /// Brings prescribed components that are off their curves back to them between the time of a state and
    /// another one [s].
    pub(crate) fn catch_up(&mut self, state: &AssemblyState, until: f64) {
        let lag = |number: usize| {
            let found = self.lags.iter().find(|lag| lag.number() == number);
            found.map_or_else(Vector3::zeros, Lag::now)
        };
        self.gap = Gap::of(&self.model, state, until, lag);
    }

    /// A vector of equations spread over all components; the others stay as they are.
    pub(crate) fn spread(&self, equations: &[f64], components: &mut [f64]) {
        for (&component, &value) in self.stiffness.equations.component.iter().zip(equations) {
            components[component as usize] = value;
        }
        self.follow(components);
    }

    /// Moves a state by a part of an increment, six components a node.
    pub(crate) fn advance(&self, state: &mut AssemblyState, increment: &[f64], part: f64) {
        state.advance(increment, part);
        if let Some(followers) = &self.followers {
            followers.place(&self.model, state);
        }
    }

    /// Adds the inertia of rigid parts and of nodes that turn with a solid to the stiffness. `of` gives the
    /// mass rate [kg/s²] of a node and its force [N]; `rotary` the rate [N m] of its rotary inertia; `moment`
    /// its moment [N m].
    pub(crate) fn add_bound_masses(
        &mut self,
        of: impl Fn(u32) -> (f64, Vector3<f64>),
        rotary: impl Fn(u32) -> f64,
        moment: impl Fn(u32) -> Vector3<f64>,
    ) {
        if let Some(followers) = &self.followers {
            let Stiffness { equations, matrix, .. } = &mut self.stiffness;
            followers.add_parts(equations, matrix, of, &rotary);
            followers.add_turns(equations, matrix, moment, rotary);
        }
    }

    /// Takes inertia from a residual: forces [N] and moments [N m] on nodes of rigid parts, and moments on
    /// nodes that turn with a solid.
    pub(crate) fn give_inertia_back(
        &self,
        force: impl Fn(u32) -> Vector3<f64>,
        moment: impl Fn(u32) -> Vector3<f64>,
        residual: &mut [f64],
    ) {
        let Some(followers) = &self.followers else { return };
        followers.pull(force, moment, |component, force| {
            let equation = self.stiffness.equations.number[component];
            if equation != NONE {
                residual[equation as usize] -= force;
            }
        });
    }

    /// The values of the free components.
    pub(crate) fn gather(&self, components: &[f64], equations: &mut [f64]) {
        for (&component, value) in self.stiffness.equations.component.iter().zip(equations) {
            *value = components[component as usize];
        }
    }
}

/// Flags of components that have an equation, six a node.
fn free_components(model: &Assembly) -> Vec<bool> {
    let mut free = vec![false; 6 * model.rest.len()];
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
    free
}
