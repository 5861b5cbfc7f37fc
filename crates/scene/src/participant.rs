//! A participant: bodies that one stepper advances together, with their state. Numbers of any precision come out as `f64`, so that the run
//! loop, outputs and the window know neither steppers nor number types.

use std::sync::Arc;
use std::time::Duration;

use pliant_explicit::recover::{CellFields, Recovery};
use pliant_explicit::stability::{Stability, cell_limit};
use pliant_explicit::{Clock, Scalar, State};
use pliant_gpu::{DeviceMapping, PointValue, Wanted};
use pliant_mechanics::grip::Grip;
use pliant_mechanics::{Energies, Model, fingerprint};

use crate::assemble::Built;
use crate::corotational::{Corotated, ShellSnapshot};
use crate::format::{Precision, RunTable};
use crate::output::FailureSummary;
use crate::plan::Plan;
use crate::scene::Scene;
use crate::solver::{
    Effort, Equilibria, LoadStepProgress, MappedPoint, Memory, Solver, on_device, on_processor,
};
use crate::world::Part;

/// A participant as outputs read it, at the instant last evaluated. Nodes and constraints are numbered in its model.
pub(crate) trait Instant {
    /// Time [s].
    fn time(&self) -> f64;

    /// Displacement [m] of a node.
    fn displacement(&self, node: usize) -> [f64; 3];

    /// Velocity [m/s] of a node.
    fn velocity(&self, node: usize) -> [f64; 3];

    /// Rotation vector [rad] of a node.
    fn rotation(&self, _node: usize) -> [f64; 3] {
        [0.0; 3]
    }

    /// Force [N] by which constraints hold or move a node; zero along components that are free.
    fn nodal_reaction(&self, node: usize) -> [f64; 3];

    /// Moment [N m] by which constraints hold or turn a node.
    fn nodal_reaction_moment(&self, node: usize) -> [f64; 3];

    /// Force [N] that holds or moves the nodes of a constraint, summed.
    fn reaction(&self, constraint: usize) -> [f64; 3];

    /// Energies [J].
    fn energies(&self) -> Energies;

    /// Finds the fields of cells of solids, where there are some; their stable steps, too, if these are wanted.
    fn cells(&self, _steps: bool) -> Option<Box<dyn CellsNow + '_>> {
        None
    }

    /// The state of shells, and of solids whose equations are solved.
    fn shells(&self) -> Option<&pliant_implicit::State> {
        None
    }

    /// Whether it is computed in single precision.
    fn is_single(&self) -> bool;
}

/// Finds fields of cells at an instant.
pub(crate) trait CellsNow: Sync {
    /// The fields of a cell of a solid, and its stable step [s] if it is wanted.
    fn at(&self, solid: usize, cell: usize) -> (CellFields, Option<f64>);
}

/// All of a participant that another run of the same bodies goes on from.
#[derive(Clone, Debug)]
pub(crate) enum Kept {
    /// In single precision.
    Single(State<f32>, Memory<f32>),
    /// In double precision.
    Double(State<f64>, Memory<f64>),
    /// Of shells, and of solids whose equations are solved.
    Shells(Box<ShellSnapshot>),
}

/// Bodies that one stepper advances together.
pub(crate) trait Participant: Instant + Send {
    /// Whole steps done.
    fn steps(&self) -> u64;

    /// Finds forces, and with them all that can be asked, at the instant.
    ///
    /// # Errors
    /// If forces can't be found there.
    fn evaluate(&mut self, wanted: Wanted) -> Result<(), FailureSummary>;

    /// Goes so many steps on from an evaluated instant, not more than its stride. `watch` hears how far it is, if that takes long.
    ///
    /// # Errors
    /// If a step can't be taken.
    fn advance(&mut self, steps: u64, watch: &mut dyn FnMut(LoadStepProgress)) -> Result<(), FailureSummary>;

    /// The most steps it takes in one go: more than one where the state lies on a device.
    fn stride(&self) -> u64 {
        1
    }

    /// Goes up to `steps` steps on without reading anything back, as many as take about `within`. How many; `None` of a state in
    /// ordinary memory.
    fn advance_without_read_back(
        &mut self,
        _steps: u64,
        _within: Duration,
    ) -> Option<Result<u64, FailureSummary>> {
        None
    }

    /// The mapping that finds points, from their places at rest [m], nodes and weights, on the device of the state; `None` of a state in
    /// ordinary memory.
    fn map(
        &self,
        _points: &mut dyn Iterator<Item = MappedPoint>,
    ) -> Option<Result<DeviceMapping, FailureSummary>> {
        None
    }

    /// Brings points on the device to the instant.
    fn apply(&self, _mapping: &DeviceMapping, _value: PointValue) {}

    /// Takes hold of points: these grips and no others act from the next evaluation on. False of a stepper that knows none.
    fn hold(&mut self, grips: &[Grip]) -> bool;

    /// The stiffness [N/m] up to which a grip leaves steps stable; infinite where they are stable with any.
    fn stiffest(&self, _grip: &Grip) -> f64 {
        f64::INFINITY
    }

    /// The point of a grip now [m], and its force on the body [N].
    fn pulled(&self, grip: &Grip) -> [[f64; 3]; 2];

    /// Energy [J] above which the balance of energies is judged; infinite where it never is.
    fn balance_floor(&self) -> f64;

    /// The largest energy so far [J].
    fn largest_energy(&self) -> f64 {
        0.0
    }

    /// What was seen of the critical time step.
    fn stability(&self) -> Stability {
        Stability::default()
    }

    /// Brings the state back to ordinary memory, whole.
    ///
    /// # Errors
    /// If a device fails.
    fn bring_back(&mut self) -> Result<(), FailureSummary> {
        Ok(())
    }

    /// The state and what a restart needs beside it, after [`advance`](Self::advance).
    fn kept(&self) -> Kept;

    /// The same as bytes of a checkpoint.
    ///
    /// # Errors
    /// If it can't be encoded.
    fn encode(&self) -> postcard::Result<Vec<u8>>;

    /// How its steps are counted, of a stepper whose increments tell velocities.
    fn clock(&self) -> Option<Clock> {
        None
    }

    /// A fingerprint of the motion: the same bits have the same one.
    fn fingerprint(&self) -> u64;

    /// How good its equilibria are; `None` of a participant that finds none by dynamic relaxation.
    fn equilibria(&self) -> Option<Equilibria> {
        None
    }

    /// Why it is at its end before the time of the scene is over.
    fn ended(&self) -> Option<&str> {
        None
    }

    /// After a step that failed: whether the state found on the way is worth showing; the time is then that of it.
    fn keeps_what_it_found(&mut self) -> bool {
        false
    }

    /// Residuals of its last iterations, as a table; `None` of a participant that solves no equations.
    fn convergence(&self) -> Option<String> {
        None
    }

    /// Cost of its equations; `None` of a participant that solves none.
    fn effort(&self) -> Option<Effort> {
        None
    }
}

/// The number types that solids in large strain are computed in.
pub(crate) trait Numeric: Scalar {
    /// A state with its memory, kept.
    fn keep(state: State<Self>, memory: Memory<Self>) -> Kept;

    /// The stepper that a scene asks for, from a state on.
    ///
    /// # Errors
    /// If it can't be made.
    fn solver(
        run: &RunTable,
        built: &Built,
        plan: &Plan,
        state: &State<Self>,
    ) -> Result<Box<dyn Solver<Self>>, FailureSummary>;
}

impl Numeric for f32 {
    fn keep(state: State<f32>, memory: Memory<f32>) -> Kept {
        Kept::Single(state, memory)
    }

    fn solver(
        run: &RunTable,
        built: &Built,
        plan: &Plan,
        state: &State<f32>,
    ) -> Result<Box<dyn Solver<f32>>, FailureSummary> {
        match &plan.target.device {
            Some(device) => on_device(run, built, plan, device, state),
            None => on_processor(run, built, plan),
        }
    }
}

impl Numeric for f64 {
    fn keep(state: State<f64>, memory: Memory<f64>) -> Kept {
        Kept::Double(state, memory)
    }

    fn solver(
        run: &RunTable,
        built: &Built,
        plan: &Plan,
        _state: &State<f64>,
    ) -> Result<Box<dyn Solver<f64>>, FailureSummary> {
        on_processor(run, built, plan)
    }
}

/// Solids in large strain, with the stepper that advances them.
pub(crate) struct Solids<R> {
    model: Arc<Model>,
    /// Length of a step [s].
    step: f64,
    state: State<R>,
    solver: Box<dyn Solver<R>>,
}

impl<R: Numeric> Instant for Solids<R> {
    fn time(&self) -> f64 {
        self.state.time
    }

    fn displacement(&self, node: usize) -> [f64; 3] {
        self.state.displacement[node].map(R::to_f64)
    }

    fn velocity(&self, node: usize) -> [f64; 3] {
        self.solver.observable().velocity(&self.state, node)
    }

    fn nodal_reaction(&self, node: usize) -> [f64; 3] {
        self.solver.observable().nodal_reaction(node)
    }

    fn nodal_reaction_moment(&self, node: usize) -> [f64; 3] {
        self.solver.observable().nodal_reaction_moment(node)
    }

    fn reaction(&self, constraint: usize) -> [f64; 3] {
        self.solver.observable().reaction(constraint)
    }

    fn energies(&self) -> Energies {
        *self.solver.observable().energies()
    }

    fn cells(&self, steps: bool) -> Option<Box<dyn CellsNow + '_>> {
        Some(Box::new(SolidCells::new(&self.model, &self.state, steps)))
    }

    fn is_single(&self) -> bool {
        R::PRECISION == "single"
    }
}

/// Fields of the cells of solids at a state.
pub(crate) struct SolidCells<'a, R> {
    recovery: Recovery<'a, R>,
    model: &'a Model,
    displacement: &'a [[R; 3]],
    /// Whether stable steps are wanted, which cost far more than the rest.
    steps: bool,
}

impl<'a, R: Scalar> SolidCells<'a, R> {
    pub(crate) fn new(model: &'a Model, state: &'a State<R>, steps: bool) -> Self {
        Self { recovery: Recovery::new(model, state), model, displacement: &state.displacement, steps }
    }
}

impl<R: Scalar> CellsNow for SolidCells<'_, R> {
    fn at(&self, solid: usize, cell: usize) -> (CellFields, Option<f64>) {
        let step = self.steps.then(|| cell_limit(self.model, solid, cell, self.displacement));
        (self.recovery.cell(solid, cell), step)
    }
}

impl<R: Numeric> Participant for Solids<R> {
    fn steps(&self) -> u64 {
        self.state.steps
    }

    fn evaluate(&mut self, wanted: Wanted) -> Result<(), FailureSummary> {
        self.solver.evaluate(&mut self.state, wanted)
    }

    fn advance(&mut self, steps: u64, watch: &mut dyn FnMut(LoadStepProgress)) -> Result<(), FailureSummary> {
        self.solver.advance(&mut self.state, steps, watch)
    }

    fn stride(&self) -> u64 {
        self.solver.stride()
    }

    fn advance_without_read_back(
        &mut self,
        steps: u64,
        within: Duration,
    ) -> Option<Result<u64, FailureSummary>> {
        self.solver.advance_without_read_back(&mut self.state, steps, within)
    }

    fn map(
        &self,
        points: &mut dyn Iterator<Item = MappedPoint>,
    ) -> Option<Result<DeviceMapping, FailureSummary>> {
        self.solver.map(points)
    }

    fn apply(&self, mapping: &DeviceMapping, value: PointValue) {
        self.solver.apply(mapping, value);
    }

    fn hold(&mut self, grips: &[Grip]) -> bool {
        self.solver.hold(grips)
    }

    fn stiffest(&self, grip: &Grip) -> f64 {
        grip.stiffest(&self.model, self.step)
    }

    fn pulled(&self, grip: &Grip) -> [[f64; 3]; 2] {
        let displacement = &self.state.displacement;
        [grip.point(&self.model, displacement), grip.force(&self.model, displacement)]
    }

    fn balance_floor(&self) -> f64 {
        self.solver.balance_floor()
    }

    fn largest_energy(&self) -> f64 {
        self.state.work.largest
    }

    fn stability(&self) -> Stability {
        self.state.stability
    }

    fn bring_back(&mut self) -> Result<(), FailureSummary> {
        self.solver.bring_back(&mut self.state)
    }

    fn kept(&self) -> Kept {
        R::keep(self.state.clone(), self.solver.memory())
    }

    fn encode(&self) -> postcard::Result<Vec<u8>> {
        postcard::to_stdvec(&(&self.state, self.solver.memory()))
    }

    fn clock(&self) -> Option<Clock> {
        self.solver.clock(&self.state)
    }

    fn fingerprint(&self) -> u64 {
        let bits = |vectors: &[[R; 3]]| -> Vec<u64> {
            vectors.iter().flatten().map(|x| x.to_f64().to_bits()).collect()
        };
        fingerprint(&(bits(&self.state.displacement), bits(&self.state.increment)))
    }

    fn equilibria(&self) -> Option<Equilibria> {
        self.solver.equilibria()
    }
}

/// The participant that a scene asks for: at its start, or where a checkpoint of it was.
///
/// # Errors
/// If its stepper can't be made.
pub(crate) fn participant(part: &Part, kept: Option<Kept>) -> Result<Box<dyn Participant>, FailureSummary> {
    let Part { scene, built, plan, .. } = part;
    match kept {
        Some(kept) => participant_from(part, kept, None)?
            .ok_or_else(|| FailureSummary::input(&"the state is one of another model")),
        None => match (&built.corotational, plan.target.precision) {
            (Some(part), _) => Ok(Box::new(Corotated::new(&scene.run, built, part, plan)?)),
            (None, Precision::Single) => solids::<f32>(scene, built, plan, State::at_rest(&built.model)),
            (None, Precision::Double) => solids::<f64>(scene, built, plan, State::at_rest(&built.model)),
        },
    }
}

/// The participant that goes on from a state of another run of the same mesh; of explicit steps with their clock, length [s] and model.
/// `None` where this scene has another solver or precision.
///
/// # Errors
/// If its stepper can't be made.
pub(crate) fn participant_from(
    part: &Part,
    kept: Kept,
    steps: Option<(Clock, f64, &Built)>,
) -> Result<Option<Box<dyn Participant>>, FailureSummary> {
    let Part { scene, built, plan, .. } = part;
    match (kept, &built.corotational, plan.target.precision) {
        (Kept::Shells(remembered), Some(part), _) if remembered.fits(built.model.node_count()) => {
            let mut participant = Corotated::new(&scene.run, built, part, plan)?;
            participant.resume(*remembered);
            Ok(Some(Box::new(participant)))
        }
        (Kept::Single(state, memory), None, Precision::Single) => {
            solids_from(scene, built, plan, state, memory, steps)
        }
        (Kept::Double(state, memory), None, Precision::Double) => {
            solids_from(scene, built, plan, state, memory, steps)
        }
        _ => Ok(None),
    }
}

fn solids<R: Numeric>(
    scene: &Scene,
    built: &Built,
    plan: &Plan,
    state: State<R>,
) -> Result<Box<dyn Participant>, FailureSummary> {
    let solver = R::solver(&scene.run, built, plan, &state)?;
    Ok(Box::new(Solids { model: Arc::clone(&built.model), step: plan.step, state, solver }))
}

fn solids_from<R: Numeric>(
    scene: &Scene,
    built: &Built,
    plan: &Plan,
    mut state: State<R>,
    memory: Memory<R>,
    steps: Option<(Clock, f64, &Built)>,
) -> Result<Option<Box<dyn Participant>>, FailureSummary> {
    if !fits(&state, &memory, &built.model) {
        return Ok(None);
    }
    if let Some((clock, _, before)) = &steps
        && before.model.fingerprints() != built.model.fingerprints()
    {
        state.change_model(&before.model, &built.model, clock.before);
    }
    let mut solver = R::solver(&scene.run, built, plan, &state)?;
    if let Some((clock, step, _)) = steps {
        solver.go_on(&clock, step, &state);
    }
    solver.resume(memory);
    Ok(Some(Box::new(Solids { model: Arc::clone(&built.model), step: plan.step, state, solver })))
}

/// Whether a state and its memory have the sizes of a model's.
pub(crate) fn fits<R: Numeric>(state: &State<R>, memory: &Memory<R>, model: &Model) -> bool {
    let rest = State::<R>::at_rest(model);
    let sizes = |state: &State<R>| {
        let history = state.history.iter().map(|h| (h.cells.len(), h.pressures.len()));
        let nodes = [&state.displacement, &state.increment, &state.reference].map(Vec::len);
        (nodes, history.collect::<Vec<_>>())
    };
    sizes(state) == sizes(&rest) && state.stability.fits(model) && memory.fits(model.node_count())
}
