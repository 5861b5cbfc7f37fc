//! The central difference method on a device; the stepper of `pliant-explicit` has its formulas.

mod forces;
mod going;
mod results;
mod stage;

use std::sync::Arc;
use std::time::{Duration, Instant as Clock};

use pliant_contact::touch::Contacts;
use pliant_explicit::stability::Monitor;
use pliant_explicit::{
    DampingFactors, Lengths, Observable, State, StepControl, StepError, Wanted, model_balance_floor,
};
use pliant_mechanics::Energies;
use pliant_mechanics::grip::Grip;
use pliant_mechanics::mapping::weighted;
use pliant_mechanics::model::{FREE, Model};
use pliant_mechanics::tensor::Vector;

use self::forces::Forces;
use self::results::Readings;
use self::stage::{Interval, Progress, Stage};
use crate::blocks::NodeBlocks;
use crate::contacts::processor_only;
use crate::kernel::Memory;
use crate::mapping::{DeviceMapping, PointValue};
use crate::nodes::{DeviceNodes, NodeKernels, OF_NODE, fours};
use crate::run::{Instants, StepFailure, flags};
use crate::transfer::{Four, Transfer};
use crate::{Design, Device, GpuError};

/// Steps a state of one model by one step size, in single precision, on a device. The current state is on the
/// device. Of the state that is passed in, a call changes the clock, the energies and the record of the
/// critical time step. Other parts change only if the call reads them back.
///
/// The first state that is passed in is uploaded; [`upload`](Self::upload) uploads another one.
pub struct GpuStepper {
    device: Device,
    model: Arc<Model>,
    design: Design,
    owners: Vec<[u32; 3]>,
    control: StepControl,
    /// Lengths of the steps before and after the last evaluated instant.
    lengths: Lengths,
    /// True if the highest modes are dissipated.
    dissipates: bool,
    balance_floor: f64,
    forces: Forces,
    nodes: DeviceNodes,
    kernels: NodeKernels,
    instants: Instants,
    transfer: Transfer,
    /// Length of a step [s] that relaxing laws are set to.
    relaxing: Option<f64>,
    stage: Stage,
    interval: Interval,
    /// Time an instant takes [s], once known.
    pace: Option<f64>,
    readings: Readings,
}

impl Observable<f32> for GpuStepper {
    fn energies(&self) -> &Energies {
        &self.readings.energies
    }

    fn reaction(&self, constraint: usize) -> Vector<f64> {
        self.readings.reactions[constraint]
    }

    fn nodal_reaction(&self, node: usize) -> Vector<f64> {
        let Ok(hold) = self.nodes.held.binary_search(&(node as u32)) else { return [0.0; 3] };
        let force = self.readings.held_reactions[hold];
        [0, 1, 2].map(|c| if self.owners[node][c] == FREE { 0.0 } else { f64::from(force[c]) })
    }

    fn contact_forces(&self) -> Vec<Vector<f64>> {
        let of_contact = |&[x, y, z, _]: &Four| [x, y, z].map(|f| -f64::from(f));
        self.readings.contact_forces.iter().map(of_contact).collect()
    }

    /// Belongs to the last instant of which everything was wanted.
    fn velocity(&self, state: &State<f32>, node: usize) -> Vector<f64> {
        let by_increments = |node: u32| {
            let (before, after) = (state.increment[node as usize], self.readings.next[node as usize]);
            [0, 1, 2].map(|c| self.lengths.velocity(before[c].into(), after[c].into()))
        };
        let alone = by_increments(node as u32);
        if self.forces.ties.is_none() {
            return alone;
        }
        let followed = weighted(self.model.resolved(&[(node as u32, 1.0)]), by_increments);
        [0, 1, 2].map(|c| if self.owners[node][c] == FREE { followed[c] } else { alone[c] })
    }
}

impl GpuStepper {
    /// A stepper for steps of `step` seconds, of a design or [`Design::usual`].
    ///
    /// # Errors
    /// If constraints contradict each other, or the device can't take the model.
    pub fn new(
        device: &Device,
        model: impl Into<Arc<Model>>,
        step: f64,
        design: Option<Design>,
    ) -> Result<Self, GpuError> {
        Self::with(device, model.into(), None, step, design)
    }

    /// A stepper of bodies that touch rigid things, each other or themselves; else as [`new`](Self::new).
    ///
    /// # Errors
    /// As [`new`](Self::new), and if something of the contacts, or of contact in the design, runs
    /// [on the CPU only](processor_only).
    pub fn with_contacts(
        device: &Device,
        model: impl Into<Arc<Model>>,
        contacts: Arc<Contacts>,
        step: f64,
        design: Option<Design>,
    ) -> Result<Self, GpuError> {
        if let Some(what) = processor_only(&contacts) {
            return Err(GpuError::Unsupported { what });
        }
        Self::with(device, model.into(), Some(contacts), step, design)
    }

    fn with(
        device: &Device,
        model: Arc<Model>,
        contacts: Option<Arc<Contacts>>,
        step: f64,
        design: Option<Design>,
    ) -> Result<Self, GpuError> {
        let owners = model.constrained_components()?;
        if let Some(constraint) = model.collective() {
            let what = format!("the constraint `{}`, which binds nodes to each other,", constraint.name);
            return Err(GpuError::Unsupported { what });
        }
        let memory = Memory::new(device);
        let design = design.unwrap_or(Design::usual(device.adapter().kind));
        if contacts.is_some() && design == Design::Blocks {
            return Err(GpuError::NoContact { design: design.to_string() });
        }
        if !model.ties.is_empty() && design == Design::Blocks {
            return Err(GpuError::NoTies { design: design.to_string() });
        }
        let of = (&model, contacts);
        device.fill(|| memory.bytes(), || Self::on_device(device, &memory, of, step, design, owners))
    }

    fn on_device(
        device: &Device,
        memory: &Memory<'_>,
        (model, contacts): (&Arc<Model>, Option<Arc<Contacts>>),
        step: f64,
        design: Design,
        owners: Vec<[u32; 3]>,
    ) -> Result<Self, GpuError> {
        let cut = match design {
            Design::Blocks => NodeBlocks::of_solids(device, model)?,
            _ => vec![],
        };
        let blocks = (design == Design::Blocks).then(|| cut.iter().map(NodeBlocks::len).sum());
        let nodes = DeviceNodes::new(memory, model, &owners, blocks)?;
        let instants = Instants::new(memory, device, model, contacts.clone())?;
        let forces = Forces::new((memory, device), (model, contacts), (&nodes, &instants), design, cut)?;
        let contacts = forces.contacts.as_ref().map_or(0, |of_device| of_device.contacts.contacts.len());
        Ok(Self {
            device: device.clone(),
            model: Arc::clone(model),
            design,
            control: StepControl::new(step),
            lengths: Lengths { before: step, next: step },
            dissipates: false,
            balance_floor: model_balance_floor::<f32>(model),
            kernels: forces.node_kernels(device, model, (&nodes, &instants))?,
            forces,
            instants,
            transfer: Transfer::default(),
            relaxing: None,
            stage: Stage::Empty,
            interval: Interval::default(),
            pace: None,
            readings: Readings::new(model, &owners, &nodes, contacts),
            nodes,
            owners,
        })
    }

    /// Monitors the critical time step with a monitor of the same model.
    #[must_use]
    pub fn watched(mut self, monitor: Monitor) -> Self {
        self.control.watch(monitor);
        self
    }

    /// [Dissipates](pliant_explicit::DISSIPATION) the highest modes.
    #[must_use]
    pub fn dissipating(mut self) -> Self {
        self.dissipates = true;
        self
    }

    /// Factors of the damping forces after a step of `before` [s].
    fn damping_factors(&self, state: &State<f32>, before: f64) -> DampingFactors {
        state.stability.damping_factors(self.dissipates, self.model.stiffness_damping, before)
    }

    /// Returns the clock with which another stepper continues from a state of this one.
    pub fn clock(&self, state: &State<f32>) -> pliant_explicit::Clock {
        self.control.clock(state)
    }

    /// Continues from a state where another stepper, with steps of length `step` [s], has stood, with the
    /// velocities there.
    pub fn go_on(&mut self, clock: &pliant_explicit::Clock, step: f64, state: &State<f32>) {
        self.control.go_on(clock, step, state);
    }

    /// The length [s] of a whole step.
    pub fn step(&self) -> f64 {
        self.control.step()
    }

    /// Energy [J] above which the balance is judged.
    pub fn balance_floor(&self) -> f64 {
        self.balance_floor
    }

    /// Returns the design, the path of forces from cells to nodes.
    pub fn design(&self) -> Design {
        self.design
    }

    /// Uploads a state, between two instants or at the first one.
    pub fn upload(&mut self, state: &State<f32>) {
        let queue = &self.device.queue;
        let velocity = |node: usize| {
            let v = self.model.initial_velocity.get(node).copied().unwrap_or_default();
            [0, 1, 2].map(|c| if self.owners[node][c] == FREE { v[c] as f32 } else { 0.0 })
        };
        // The start makes increments of velocities.
        let of_node = |node: usize| {
            let increment = if state.is_at_start() { velocity(node) } else { state.increment[node] };
            let [last, before] = [0, 1].map(|k| state.forces[k].get(node).copied().unwrap_or_default());
            [increment, last, before]
        };
        let increment = fours((0..self.nodes.count).flat_map(of_node));
        let displacement = fours(state.displacement.iter().copied());
        let side = self.stage.side();
        self.stage = Stage::Uploaded { side };
        queue.write_buffer(&self.nodes.displacement[side], 0, bytemuck::cast_slice(&displacement));
        queue.write_buffer(&self.nodes.increment[side], 0, bytemuck::cast_slice(&increment));
        for (solid, history) in self.forces.solids.iter().zip(&state.history) {
            solid.upload(&self.device, history);
        }
        self.forces.paths.clear(&self.device);
        self.instants.forget(&self.device);
    }

    /// Finds forces, coming increments, reactions and energies at the state's instant.
    ///
    /// # Errors
    /// If the state is not finite, a cell is inverted, or the energies do not balance. Also if the step is
    /// above the limit and must not be cut, or the device fails.
    pub fn evaluate(&mut self, state: &mut State<f32>, wanted: Wanted) -> Result<(), StepFailure> {
        self.evaluated(state)?;
        if wanted == Wanted::Everything {
            self.bring_back(state)?;
        }
        Ok(())
    }

    /// Evaluates the state's instant where that is not done yet.
    fn evaluated(&mut self, state: &mut State<f32>) -> Result<Progress, StepFailure> {
        if self.dissipates || self.model.stiffness_damping > 0.0 {
            state.keep_forces();
        }
        match self.stage {
            Stage::Evaluated(progress) if progress.instants == 0 => return Ok(progress),
            Stage::Empty => self.upload(state),
            _ => {}
        }
        self.evaluate_anew(state)
    }

    fn evaluate_anew(&mut self, state: &mut State<f32>) -> Result<Progress, StepFailure> {
        self.control.keep(state);
        self.lengths = self.control.lengths(state);
        self.relax(self.control.relaxing(state));
        self.instants.forget_deformation(&self.device);
        if let Stage::Uploaded { side } = self.stage {
            self.list(side)?;
            self.stage = Stage::Listed { side };
        }
        let starts = if state.is_at_start() { flags::STARTS } else { 0 };
        let mut results = self.evaluate_listed(state, flags::MEASURES | starts, true)?;
        self.check(state, &results)?;
        self.enter_passed(state, &results, self.lengths.before);
        let below = if state.is_between_steps() { self.watch(state, &results.deformed)? } else { Ok(()) };
        let passed = (&self.interval.deformed, self.stage.steps(state));
        let to_check = self.control.steps_to_check(state, &results.deformed, passed);
        self.interval.adapt(results.deformed, to_check);
        let shock = results.error;
        if self.lengths != self.control.lengths(state) {
            self.lengths = self.control.lengths(state);
            results = self.evaluate_listed(state, flags::MEASURES, false)?;
        }
        if !results.sums.is_finite() {
            return Err(self.fail(state, self.stage.instants()));
        }
        self.settle(state, &results, shock);
        let progress = Progress::new(state, self.stage.side());
        self.stage = Stage::Evaluated(progress);
        if state.work.has_lost_balance() {
            return Err(self.unbalanced(state));
        }
        below?;
        Ok(progress)
    }

    /// The end of a run that has lost its balance of energies.
    fn unbalanced(&mut self, state: &mut State<f32>) -> StepFailure {
        if let Err(failure) = self.bring_back(state) {
            return failure;
        }
        let Readings { energies, next, .. } = &self.readings;
        let square = |u: &Vector<f32>| u.iter().map(|&x| f64::from(x) * f64::from(x)).sum::<f64>();
        let fastest = (0..).zip(next).max_by(|(_, a), (_, b)| square(a).total_cmp(&square(b)));
        let fastest = fastest.map_or(0, |(node, _)| node);
        StepError::unbalanced(&self.model, fastest, energies.balance, state.time).into()
    }

    /// Advances by `steps` whole steps; an instant that is not evaluated yet is evaluated first.
    ///
    /// # Errors
    /// See [`Self::evaluate`], at any of the instants; the state then stands at the instant of the error.
    pub fn advance(&mut self, state: &mut State<f32>, steps: u64) -> Result<(), StepFailure> {
        let mut left = steps;
        while left > 0 {
            let progress = self.evaluated(state)?;
            // While energies are off balance, every step is evaluated.
            let stride = if state.work.is_off_balance() { 1 } else { left.min(self.interval.steps()) };
            self.go(state, progress, stride)?;
            left -= stride;
        }
        Ok(())
    }

    /// Advances by up to `steps` whole steps, as many as take about `within`, and waits for them. Nothing is
    /// read back, unless bodies touch each other. Returns the number of steps. After a failure the device
    /// stops, and the next evaluation reports it. The first instant is evaluated if it is not evaluated yet.
    ///
    /// # Errors
    /// As [`Self::evaluate`] at the first instant, and if the device fails.
    pub fn advance_without_read_back(
        &mut self,
        state: &mut State<f32>,
        steps: u64,
        within: Duration,
    ) -> Result<u64, StepFailure> {
        let progress = match self.stage {
            Stage::Evaluated(progress) if !progress.entered => progress,
            _ => self.evaluated(state)?,
        };
        let pace = self.pace.map_or(f64::INFINITY, |pace| pace * f64::from(self.control.substeps()));
        let steps = steps.min((within.as_secs_f64() / pace) as u64).max(1);
        let begun = Clock::now();
        if let Some(last) = self.go(state, progress, steps)? {
            self.device.wait_for(last)?;
        }
        let taken = self.stage.instants() - progress.instants;
        self.pace = Some(begun.elapsed().as_secs_f64() / f64::from(taken.max(1)));
        Ok(steps)
    }

    /// Replaces the grips: only these act from the next evaluation on. Their work is external.
    ///
    /// # Errors
    /// If there are too many for the device.
    pub fn grip(&mut self, grips: &[Grip]) -> Result<(), GpuError> {
        let held = &mut self.forces.grips;
        self.nodes.mark(&self.device, &held.nodes, false);
        let numbers = held.take(&self.model, grips);
        self.nodes.mark(&self.device, &held.nodes, true);
        self.instants.grip(&self.device, &numbers)
    }

    /// Makes the kernel that finds points on the device as combinations of nodes. `points` has their places
    /// at rest [m] and the nodes and weights of each.
    ///
    /// # Errors
    /// If there are too many for the device.
    pub fn map(
        &self,
        points: impl Iterator<Item = (Vector<f64>, Vec<(u32, f64)>)>,
    ) -> Result<DeviceMapping, GpuError> {
        DeviceMapping::new(&self.device, &self.nodes.displacement, points)
    }

    /// Brings points to the instant at which the steps taken so far end. Nothing comes back.
    pub fn apply(&self, mapping: &DeviceMapping, value: PointValue) {
        mapping.apply(value, self.stage.side());
    }

    /// Brings displacements, increments and what relaxing laws remember back to the state, and enters its
    /// energies.
    ///
    /// # Errors
    /// If the device fails, or a step since the last evaluation could not be taken.
    pub fn bring_back(&mut self, state: &mut State<f32>) -> Result<(), StepFailure> {
        let Stage::Evaluated(progress) = self.stage else { return Ok(()) };
        if progress.instants > 0 {
            let results = self.results()?;
            self.check(state, &results)?;
            self.enter_passed(state, &results, self.lengths.next);
        }
        Ok(self.bring_arrays_back(state)?)
    }

    fn bring_arrays_back(&mut self, state: &mut State<f32>) -> Result<(), GpuError> {
        let (count, device, transfer) = (self.nodes.count, &self.device, &mut self.transfer);
        let three = |four: &Four| [four[0], four[1], four[2]];
        let mut read = |buffer: &wgpu::Buffer, each: usize, to: &mut dyn FnMut(usize, &[Four])| {
            transfer.read::<Four>(device, buffer, each * count, |fours| {
                fours.chunks_exact(each).enumerate().for_each(|(node, values)| to(node, values));
            })
        };
        let side = self.stage.side();
        read(&self.nodes.displacement[side], 1, &mut |node, values| {
            state.displacement[node] = three(&values[0])
        })?;
        read(&self.nodes.next[side], OF_NODE, &mut |node, values| {
            self.readings.next[node] = three(&values[0])
        })?;
        read(&self.nodes.increment[side], OF_NODE, &mut |node, values| {
            state.increment[node] = three(&values[0]);
            for (forces, value) in state.forces.iter_mut().zip(&values[1..]) {
                if let Some(force) = forces.get_mut(node) {
                    *force = three(value);
                }
            }
        })?;
        for (solid, history) in self.forces.solids.iter().zip(&mut state.history) {
            solid.bring_back(&mut self.transfer, &self.device, history)?;
        }
        Ok(())
    }
}
