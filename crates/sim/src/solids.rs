//! Solids in large strain as a participant: central differences on the CPU or a GPU, or dynamic relaxation.

use std::sync::Arc;

use pliant_contact::lag::Lag;
use pliant_contact::pose::Leg;
use pliant_explicit::recover::{CellFields, Recovery};
use pliant_explicit::stability::{Stability, cell_limit, cell_limits};
use pliant_explicit::{Clock, NodeContact, Scalar, State, Wanted};
#[cfg(feature = "gpu")]
use pliant_gpu::GpuStepper;
use pliant_mechanics::StopFlag;
use pliant_mechanics::grip::Grip;
use pliant_mechanics::mapping::{Displaced, Mapping};
use pliant_mechanics::model::Enclosed;
use pliant_mechanics::tensor::Vector;
use pliant_mechanics::{Energies, Model, fingerprint};

use crate::failure::Failure;
use crate::instant::{CellsNow, Instant};
use crate::part::Part;
use crate::participant::Participant;
use crate::reals::{Reals, RealsMut};
use crate::snapshot::Snapshot;
use crate::solver::{Equilibria, LoadStepProgress, Memory, Solver, on_cpu};

/// The number types that solids in large strain are computed in.
pub(crate) trait Numeric: Scalar {
    /// A state with its memory, kept.
    fn into_snapshot(state: State<Self>, memory: Memory<Self>) -> Snapshot;

    /// Reads a state and its memory from a snapshot; `None` for another number type.
    fn of_snapshot(snapshot: &Snapshot) -> Option<(&State<Self>, &Memory<Self>)>;

    /// Vectors of nodes as they are shown.
    fn reals(values: &[Vector<Self>]) -> Reals<'_>;

    /// The vector of vectors of nodes.
    fn reals_mut(values: &mut Vec<Vector<Self>>) -> RealsMut<'_>;

    /// The stepper of a participant, from a state on.
    ///
    /// # Errors
    /// If it can't be made.
    fn solver(part: &Part, state: &State<Self>) -> Result<Box<dyn Solver<Self>>, Failure>;

    /// The GPU's stepper with its state; `None` of solids on the CPU.
    #[cfg(feature = "gpu")]
    fn on_device(_solids: &mut Solids<Self>) -> Option<(&mut GpuStepper, &mut State<f32>)> {
        None
    }
}

impl Numeric for f32 {
    fn into_snapshot(state: State<f32>, memory: Memory<f32>) -> Snapshot {
        Snapshot::Single(state, memory)
    }

    fn reals(values: &[Vector<f32>]) -> Reals<'_> {
        Reals::Single(values)
    }

    fn reals_mut(values: &mut Vec<Vector<f32>>) -> RealsMut<'_> {
        RealsMut::Single(values)
    }

    fn of_snapshot(snapshot: &Snapshot) -> Option<(&State<f32>, &Memory<f32>)> {
        if let Snapshot::Single(state, memory) = snapshot { Some((state, memory)) } else { None }
    }

    #[cfg_attr(
        not(feature = "gpu"),
        expect(unused_variables, reason = "only a GPU takes up a state when it is made")
    )]
    fn solver(part: &Part, state: &State<f32>) -> Result<Box<dyn Solver<f32>>, Failure> {
        #[cfg(feature = "gpu")]
        if let Some(solver) = crate::device::on_device(part, state) {
            return solver;
        }
        on_cpu(part)
    }

    #[cfg(feature = "gpu")]
    fn on_device(solids: &mut Solids<f32>) -> Option<(&mut GpuStepper, &mut State<f32>)> {
        Some((solids.solver.on_device()?, &mut solids.state))
    }
}

impl Numeric for f64 {
    fn into_snapshot(state: State<f64>, memory: Memory<f64>) -> Snapshot {
        Snapshot::Double(state, memory)
    }

    fn reals(values: &[Vector<f64>]) -> Reals<'_> {
        Reals::Double(values)
    }

    fn reals_mut(values: &mut Vec<Vector<f64>>) -> RealsMut<'_> {
        RealsMut::Double(values)
    }

    fn of_snapshot(snapshot: &Snapshot) -> Option<(&State<f64>, &Memory<f64>)> {
        if let Snapshot::Double(state, memory) = snapshot { Some((state, memory)) } else { None }
    }

    fn solver(part: &Part, _state: &State<f64>) -> Result<Box<dyn Solver<f64>>, Failure> {
        on_cpu(part)
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

impl<R: Numeric> Solids<R> {
    /// Makes the participant from a state.
    ///
    /// # Errors
    /// If the stepper can't be made.
    pub(crate) fn new(part: &Part, state: State<R>) -> Result<Self, Failure> {
        if let Some(load) = part.model.loads.iter().find(|load| load.is_for_shells()) {
            return Err(Failure::input(&format_args!(
                "`{}` is a load of shells, and solids don't take it",
                load.name
            )));
        }
        let solver = R::solver(part, &state)?;
        Ok(Self { model: Arc::clone(&part.model), step: part.steps.step, state, solver })
    }

    /// Places of the nodes.
    fn nodes(&self) -> Displaced<'_, R> {
        Displaced { rest: &self.model.rest, displacement: &self.state.displacement, velocity: &[] }
    }

    /// Takes up the memory of a restart. After a run with other steps, `steps` has their clock and their
    /// length [s].
    pub(crate) fn resume(&mut self, memory: Memory<R>, steps: Option<(Clock, f64)>) {
        if let Some((clock, step)) = steps {
            self.solver.go_on(&clock, step, &self.state);
        }
        self.solver.resume(memory);
    }
}

impl<R: Numeric> Instant for Solids<R> {
    fn time(&self) -> f64 {
        self.state.time
    }

    fn displacement(&self, node: usize) -> [f64; 3] {
        self.state.displacement[node].map(R::to_f64)
    }

    fn displacements(&self) -> Option<Reals<'_>> {
        Some(R::reals(&self.state.displacement))
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

    fn enclosed(&self, constraint: usize) -> Option<Enclosed> {
        self.solver.observable().enclosed(constraint)
    }

    fn contact_forces(&self) -> Vec<[f64; 3]> {
        self.solver.observable().contact_forces()
    }

    fn contact_moments(&self) -> Option<Vec<[f64; 3]>> {
        self.solver.observable().contact_moments()
    }

    fn contact_nodes(&self) -> Vec<NodeContact> {
        self.solver.observable().contact_nodes(&self.state)
    }

    fn leg(&self, rigid: usize) -> Option<&Leg> {
        self.state.leg(rigid)
    }

    fn lag(&self, rigid: usize) -> Option<&Lag> {
        self.state.lag(rigid)
    }

    fn energies(&self) -> Energies {
        *self.solver.observable().energies()
    }

    fn cells(&self) -> Option<Box<dyn CellsNow + '_>> {
        Some(Box::new(SolidCells::new(&self.model, &self.state)))
    }

    fn is_single(&self) -> bool {
        R::PRECISION == "single"
    }

    fn steps(&self) -> u64 {
        self.state.steps
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

    fn equilibria(&self) -> Option<Equilibria> {
        self.solver.equilibria()
    }
}

/// Fields of the cells of solids at a state.
pub(crate) struct SolidCells<'a, R> {
    recovery: Recovery<'a, R>,
    model: &'a Model,
    displacement: &'a [[R; 3]],
}

impl<'a, R: Scalar> SolidCells<'a, R> {
    pub(crate) fn new(model: &'a Model, state: &'a State<R>) -> Self {
        Self { recovery: Recovery::new(model, state), model, displacement: &state.displacement }
    }
}

impl<R: Scalar> CellsNow for SolidCells<'_, R> {
    fn at(&self, solid: usize, cell: usize, step: bool) -> CellFields {
        let stable_step = step.then(|| cell_limit(self.model, solid, cell, self.displacement));
        CellFields { stable_step, ..self.recovery.cell(solid, cell) }
    }

    fn numbers(
        &self,
        solid: usize,
        steps: bool,
        width: usize,
        of: &(dyn Fn(&CellFields, &mut [f64]) + Sync),
    ) -> Vec<f64> {
        if !steps {
            return self.recovery.numbers(solid, width, |_, fields, to| of(fields, to));
        }
        let steps = cell_limits(self.model, solid, self.displacement);
        self.recovery.numbers(solid, width, |cell, fields, to| {
            of(&CellFields { stable_step: Some(steps[cell]), ..*fields }, to);
        })
    }
}

impl<R: Numeric> Participant for Solids<R> {
    fn evaluate(&mut self, wanted: Wanted) -> Result<(), Failure> {
        self.solver.evaluate(&mut self.state, wanted)
    }

    fn advance(&mut self, steps: u64, watch: &mut dyn FnMut(LoadStepProgress)) -> Result<(), Failure> {
        self.solver.advance(&mut self.state, steps, watch)
    }

    fn stride(&self) -> u64 {
        self.solver.stride()
    }

    #[cfg(feature = "gpu")]
    fn on_device(&mut self) -> Option<(&mut GpuStepper, &mut State<f32>)> {
        R::on_device(self)
    }

    fn grip(&mut self, grips: &[Grip]) -> bool {
        self.solver.grip(grips)
    }

    fn push(&mut self, forces: &[Vector<f64>]) {
        self.solver.push(forces);
    }

    fn drive(&mut self, rigid: usize, leg: Leg) {
        self.state.drive(rigid, leg);
    }

    fn stiffest(&self, grip: &Grip) -> f64 {
        grip.stiffest(&self.nodes(), &self.model, self.step)
    }

    fn last_velocity(&self, node: usize) -> [f64; 3] {
        let length = self.solver.clock(&self.state).map_or(self.step, |clock| clock.before);
        self.state.increment[node].map(|moved| moved.to_f64() / length)
    }

    fn pulled(&self, grip: &Grip) -> [[f64; 3]; 2] {
        let nodes = self.nodes();
        [grip.position(&nodes, 0), grip.force(&nodes)]
    }

    fn lead_coupled_surfaces(&mut self, times: [f64; 2], ways: &[[Vector<f64>; 2]]) {
        self.solver.lead_coupled_surfaces(times, ways);
    }

    fn coupled_impulses(&self) -> &[Vector<f64>] {
        self.solver.coupled_impulses()
    }

    fn displacements_mut(&mut self) -> Option<RealsMut<'_>> {
        Some(R::reals_mut(&mut self.state.displacement))
    }

    fn goes_back_to(&self, snapshot: &Snapshot) -> bool {
        R::of_snapshot(snapshot).is_some() && self.solver.goes_back()
    }

    fn go_back(&mut self, snapshot: &Snapshot, steps: Option<(Clock, f64)>) -> Result<(), Failure> {
        let Some((state, memory)) = R::of_snapshot(snapshot) else { return Ok(()) };
        // The vector keeps its address.
        let mut displacement = std::mem::take(&mut self.state.displacement);
        displacement.copy_from_slice(&state.displacement);
        self.state = State { displacement, ..state.clone() };
        self.resume(memory.clone(), steps);
        Ok(())
    }

    fn stop_on(&mut self, flag: &StopFlag) {
        self.solver.stop_on(flag);
    }

    fn bring_back(&mut self) -> Result<(), Failure> {
        self.solver.bring_back(&mut self.state)
    }

    fn snapshot(&self) -> Snapshot {
        R::into_snapshot(self.state.clone(), self.solver.memory())
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
}
