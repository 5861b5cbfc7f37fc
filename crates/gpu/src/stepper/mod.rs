//! The central difference method on a device; the stepper of `pliant-explicit` has its formulas.

mod going;
mod results;

use std::sync::Arc;
use std::time::{Duration, Instant as Clock};

use pliant_contact::touch::Contacts;
use pliant_explicit::recover::stored_at_start;
use pliant_explicit::stability::{Monitor, Stability};
use pliant_explicit::{
    DampingFactors, Deformed, Lengths, Observable, State, StepControl, StepError, Wanted, model_balance_floor,
};
use pliant_mechanics::Energies;
use pliant_mechanics::grip::Grip;
use pliant_mechanics::mapping::weighted;
use pliant_mechanics::model::{FREE, Model};
use pliant_mechanics::tensor::Vector;

use crate::blocks::NodeBlocks;
use crate::contacts::{DeviceContacts, processor_only};
use crate::grips::DeviceGrips;
use crate::kernel::{Kernel, Memory};
use crate::loads::DeviceLoads;
use crate::mapping::{DeviceMapping, PointValue};
use crate::nodes::{DeviceNodes, NodeKernels, OF_NODE, fours};
use crate::paths::Paths;
use crate::run::{Instants, StepFailure, flags, table_constants};
use crate::solids::DeviceSolid;
use crate::ties::DeviceTies;
use crate::transfer::Four;
use crate::transfer::Transfer;
use crate::{Design, Device, GpuError};

/// Most steps between two evaluated instants, with energies, deformation of the cells and checks.
const EVALUATE_EVERY: u64 = 100;

/// Evaluations are more frequent where the deformation changes by more than this factor from one to the next.
const CALM: f64 = 1.02;

/// Where a state was when it was evaluated.
#[derive(Clone, Copy)]
struct Origin {
    side: usize,
    steps: u64,
    time: f64,
    stability: Stability,
}

/// Steps a state of one model by one step size, in single precision, on a device. The current state is on the device: of the
/// state that is passed in, a call changes the clock, the energies, the record of the critical time step, and what it is asked to read back.
///
/// The first state that is passed in is uploaded; [`upload`](Self::upload) uploads another one.
pub struct GpuStepper {
    device: Device,
    model: Arc<Model>,
    design: Design,
    owners: Vec<[u32; 3]>,
    control: StepControl,
    lengths: Lengths,
    /// Whether the highest modes are dissipated.
    dissipates: bool,
    balance_floor: f64,
    solids: Vec<DeviceSolid>,
    paths: Paths,
    nodes: DeviceNodes,
    kernels: NodeKernels,
    loads: Option<DeviceLoads>,
    grips: DeviceGrips,
    ties: Option<DeviceTies>,
    contacts: Option<DeviceContacts>,
    instants: Instants,
    transfer: Transfer,
    /// Length of a step [s] that relaxing laws are set to.
    relaxing: Option<f64>,
    /// Which side of arrays with two is now.
    side: usize,
    /// Whether a state was taken up, and whether candidates for contact are listed.
    loaded: bool,
    listed: bool,
    /// Whether its instant is evaluated.
    evaluated: bool,
    /// The last evaluated instant, the instants since then and the length of their steps [s].
    origin: Option<Origin>,
    since: u32,
    /// Whether the work of the instants since then is entered.
    entered: bool,
    /// How far cells were deformed at the last look, and steps to the next one: those after which energies are to be known, and those to the
    /// next check of the critical time step.
    deformed: Deformed,
    stride: u64,
    to_check: u64,
    /// Time an instant takes [s], once known.
    pace: Option<f64>,
    energies: Energies,
    /// Of each constraint, and of each node that is held.
    reactions: Vec<Vector<f64>>,
    held_reactions: Vec<Four>,
    /// The force [N] of each contact on its surface.
    contact_forces: Vec<Four>,
    /// Which held nodes each constraint moves, and which of their components.
    owned: Vec<Vec<(u32, [bool; 3])>>,
    next: Vec<Vector<f32>>,
}

impl Observable<f32> for GpuStepper {
    fn energies(&self) -> &Energies {
        &self.energies
    }

    fn reaction(&self, constraint: usize) -> Vector<f64> {
        self.reactions[constraint]
    }

    fn nodal_reaction(&self, node: usize) -> Vector<f64> {
        let Ok(hold) = self.nodes.held.binary_search(&(node as u32)) else { return [0.0; 3] };
        let force = self.held_reactions[hold];
        [0, 1, 2].map(|c| if self.owners[node][c] == FREE { 0.0 } else { f64::from(force[c]) })
    }

    fn contact_forces(&self) -> Vec<Vector<f64>> {
        self.contact_forces.iter().map(|&[x, y, z, _]| [x, y, z].map(|f| -f64::from(f))).collect()
    }

    /// Belongs to the last instant of which everything was wanted.
    fn velocity(&self, state: &State<f32>, node: usize) -> Vector<f64> {
        let own = |node: u32| {
            let (before, after) = (state.increment[node as usize], self.next[node as usize]);
            [0, 1, 2].map(|c| self.lengths.velocity(before[c].into(), after[c].into()))
        };
        let alone = own(node as u32);
        if self.ties.is_none() {
            return alone;
        }
        let followed = weighted(self.model.resolved(&[(node as u32, 1.0)]), own);
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
    /// As [`new`](Self::new), and if something of the contacts, or of contact in the design, runs [on the CPU only](processor_only).
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
            let what = format!("the constraint `{}`, which binds nodes to each other", constraint.name);
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
        let constants = table_constants(model);
        let loads = if model.loads.is_empty() {
            None
        } else {
            Some(DeviceLoads::new(memory, device, &instants.bound, model, &nodes.displacement, &constants)?)
        };
        let paths = Paths::new(design, memory, device, model, &nodes, loads.as_ref(), cut)?;
        let solids = (model.solids.iter().enumerate())
            .map(|solid| DeviceSolid::new(memory, device, &instants.bound, solid, &paths))
            .collect::<Result<Vec<_>, _>>()?;
        let gather = (paths.node_snippet.as_str(), &paths.nodes);
        let touching = contacts.map(|contacts| {
            let (of, with) = ((model.as_ref(), &contacts), (memory, device));
            DeviceContacts::new(with, &instants.bound, of, &nodes, gather, loads.as_ref(), &constants)
        });
        let contacts = touching.transpose()?;
        let forces = contacts.as_ref().map(|contacts| &contacts.forces);
        let kernels = nodes.kernels(device, &instants.bound, gather, loads.as_ref(), forces, &constants)?;
        let grips = DeviceGrips::new(device, &instants.bound, &nodes.displacement)?;
        let ties = nodes.followers.as_ref().zip(paths.giving.as_ref()).map(|(followers, giving)| {
            DeviceTies::new(device, &instants.bound, followers, giving, &nodes.displacement)
        });
        let control = StepControl::new(step);
        Ok(Self {
            device: device.clone(),
            model: Arc::clone(model),
            design,
            control,
            lengths: Lengths { before: step, next: step },
            dissipates: false,
            balance_floor: model_balance_floor::<f32>(model),
            solids,
            paths,
            kernels,
            loads,
            grips,
            ties: ties.transpose()?,
            contact_forces: vec![
                Four::default();
                contacts.as_ref().map_or(0, |own| own.contacts.contacts.len())
            ],
            contacts,
            instants,
            transfer: Transfer::default(),
            relaxing: None,
            side: 0,
            loaded: false,
            listed: false,
            evaluated: false,
            origin: None,
            since: 0,
            entered: true,
            deformed: Deformed::default(),
            stride: 1,
            to_check: 1,
            pace: None,
            energies: Energies::default(),
            reactions: vec![[0.0; 3]; model.constraints.len()],
            held_reactions: vec![Four::default(); nodes.held.len()],
            owned: owned(model, &owners, &nodes.held),
            next: vec![[0.0; 3]; nodes.count],
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

    /// How another stepper goes on from a state of this one.
    pub fn clock(&self, state: &State<f32>) -> pliant_explicit::Clock {
        self.control.clock(state)
    }

    /// Goes on where another stepper, with steps of length `step` [s], has stood at a state: with the velocities there.
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

    /// How forces come from cells to nodes.
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
        queue.write_buffer(&self.nodes.displacement[self.side], 0, bytemuck::cast_slice(&displacement));
        queue.write_buffer(&self.nodes.increment[self.side], 0, bytemuck::cast_slice(&increment));
        for (solid, history) in self.solids.iter().zip(&state.history) {
            solid.upload(&self.device, history);
        }
        self.paths.clear(&self.device);
        self.instants.forget(&self.device);
        self.entered = true;
        (self.loaded, self.evaluated, self.origin, self.since) = (true, false, None, 0);
        self.listed = false;
    }

    /// Forces, coming increments, reactions and energies at the state's instant.
    ///
    /// # Errors
    /// If the state is not finite, a cell is inverted, the energies do not balance, the step is above the limit and
    /// must not be cut, or the device fails.
    pub fn evaluate(&mut self, state: &mut State<f32>, wanted: Wanted) -> Result<(), StepFailure> {
        if self.dissipates || self.model.stiffness_damping > 0.0 {
            state.keep_forces();
        }
        if !self.loaded {
            self.upload(state);
        }
        if !self.evaluated {
            self.evaluate_anew(state)?;
        }
        if wanted == Wanted::Everything {
            self.bring_back(state)?;
        }
        Ok(())
    }

    fn evaluate_anew(&mut self, state: &mut State<f32>) -> Result<(), StepFailure> {
        self.control.keep(state);
        self.lengths = self.control.lengths(state);
        self.relax(self.control.relaxing(state));
        self.instants.forget_deformation(&self.device);
        let starts = if state.is_at_start() { flags::STARTS } else { 0 };
        if !self.listed {
            self.list()?;
        }
        let mut results = self.evaluate_listed(state, flags::MEASURES | starts, true)?;
        self.check(state, &results)?;
        self.enter_passed(state, &results, self.lengths.before);
        let below = if state.is_between_steps() { self.watch(state, &results.deformed)? } else { Ok(()) };
        let calm = !results.deformed.differs(&self.deformed, CALM);
        self.stride = if calm { (2 * self.stride).min(EVALUATE_EVERY) } else { (self.stride / 2).max(1) };
        let passed = self.origin.map_or(1, |origin| state.steps - origin.steps);
        self.to_check = self.control.steps_to_check(state, &results.deformed, (&self.deformed, passed));
        self.deformed = results.deformed;
        let shock = results.error;
        if self.lengths != self.control.lengths(state) {
            self.lengths = self.control.lengths(state);
            results = self.evaluate_listed(state, flags::MEASURES, false)?;
        }
        if !results.sums.is_finite() {
            return Err(self.fail(state, self.since));
        }
        let at_start = state.is_at_start();
        if at_start {
            let stored = stored_at_start(&self.model, state, results.hourglass);
            state.work.begin(self.kinetic_at_start(), stored, shock);
        }
        let before = (!at_start).then_some(self.lengths.before);
        let again = std::mem::replace(&mut state.evaluated, true);
        let change = self.lengths.change_energy(results.error);
        self.energies =
            state.work.settle(&results.sums, results.hourglass, change, before, self.balance_floor, again);
        self.enter_reactions(&results.reactions);
        self.contact_forces.clone_from(&results.contact_forces);
        (self.evaluated, self.since) = (true, 0);
        self.origin = Some(Origin {
            side: self.side,
            steps: state.steps,
            time: state.time,
            stability: state.stability,
        });
        if state.work.has_lost_balance() {
            self.bring_back(state)?;
            let square = |u: &Vector<f32>| u.iter().map(|&x| f64::from(x) * f64::from(x)).sum::<f64>();
            let fastest = (0..).zip(&self.next).max_by(|(_, a), (_, b)| square(a).total_cmp(&square(b)));
            let fastest = fastest.map_or(0, |(node, _)| node);
            return Err(StepError::unbalanced(&self.model, fastest, self.energies.balance, state.time).into());
        }
        Ok(below?)
    }

    /// Goes `steps` whole steps on; an instant that is not evaluated yet is so first.
    ///
    /// # Errors
    /// As [`Self::evaluate`], at any of them; the state then stands at the instant of the error.
    pub fn advance(&mut self, state: &mut State<f32>, steps: u64) -> Result<(), StepFailure> {
        let mut left = steps;
        while left > 0 {
            self.evaluate(state, Wanted::Energies)?;
            // While energies are off balance, every step is evaluated.
            let stride =
                if state.work.is_off_balance() { 1 } else { left.min(self.stride).min(self.to_check) };
            self.go(state, stride)?;
            left -= stride;
        }
        Ok(())
    }

    /// Goes up to `steps` whole steps on, as many as take about `within`, and waits for them without any read-back, unless bodies touch each other.
    /// Returns how many. After a failure the device stops, and the next evaluation reports it. The first instant is
    /// evaluated where that is not done yet.
    ///
    /// # Errors
    /// As [`Self::evaluate`] at the first instant, and if the device fails.
    pub fn advance_without_read_back(
        &mut self,
        state: &mut State<f32>,
        steps: u64,
        within: Duration,
    ) -> Result<u64, StepFailure> {
        // Where work was entered since the last look, sums would enter it again.
        if !self.evaluated && self.entered {
            self.evaluate(state, Wanted::Energies)?;
        }
        let pace = self.pace.map_or(f64::INFINITY, |pace| pace * f64::from(self.control.substeps()));
        let steps = steps.min((within.as_secs_f64() / pace) as u64).max(1);
        let (begun, before) = (Clock::now(), self.since);
        if let Some(last) = self.go(state, steps)? {
            self.device.wait_for(last)?;
        }
        self.pace = Some(begun.elapsed().as_secs_f64() / f64::from((self.since - before).max(1)));
        Ok(steps)
    }

    /// Takes hold of points: these grips and no others act from the next evaluation on. Their work is external.
    ///
    /// # Errors
    /// If there are too many for the device.
    pub fn grip(&mut self, grips: &[Grip]) -> Result<(), GpuError> {
        self.nodes.mark(&self.device, &self.grips.nodes, false);
        let numbers = self.grips.take(&self.model, grips);
        self.nodes.mark(&self.device, &self.grips.nodes, true);
        self.instants.grip(&self.device, &numbers)
    }

    /// What finds points on the device that are combinations of nodes, from their places at rest [m] and the nodes and weights of each.
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
        mapping.apply(value, self.side);
    }

    /// Brings displacements, increments and what relaxing laws remember back to the state, and enters its energies.
    ///
    /// # Errors
    /// If the device fails, or a step since the last look could not be taken.
    pub fn bring_back(&mut self, state: &mut State<f32>) -> Result<(), StepFailure> {
        if !self.loaded || (!self.evaluated && self.origin.is_none()) {
            return Ok(());
        }
        if !self.evaluated && self.since > 0 {
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
                fours.chunks_exact(each).enumerate().for_each(|(node, own)| to(node, own));
            })
        };
        let side = self.side;
        read(&self.nodes.displacement[side], 1, &mut |node, own| state.displacement[node] = three(&own[0]))?;
        read(&self.nodes.next[side], OF_NODE, &mut |node, own| self.next[node] = three(&own[0]))?;
        read(&self.nodes.increment[side], OF_NODE, &mut |node, own| {
            state.increment[node] = three(&own[0]);
            for (forces, own) in state.forces.iter_mut().zip(&own[1..]) {
                if let Some(force) = forces.get_mut(node) {
                    *force = three(own);
                }
            }
        })?;
        for (solid, history) in self.solids.iter().zip(&mut state.history) {
            solid.bring_back(&mut self.transfer, &self.device, history)?;
        }
        Ok(())
    }
}

/// For each constraint the places in `held` of its nodes, and the components it owns.
fn owned(model: &Model, owners: &[[u32; 3]], held: &[u32]) -> Vec<Vec<(u32, [bool; 3])>> {
    let of_node = |index: u32, node: u32| {
        let owns = owners[node as usize].map(|owner| owner == index);
        held.binary_search(&node).ok().map(|hold| (hold as u32, owns))
    };
    (0..)
        .zip(&model.constraints)
        .map(|(index, constraint)| constraint.nodes.iter().filter_map(|&node| of_node(index, node)).collect())
        .collect()
}

/// What finds the forces at an instant, in order.
fn force_kernels<'a>(
    loads: &'a Option<DeviceLoads>,
    grips: &'a DeviceGrips,
    solids: &'a [DeviceSolid],
    ties: &'a Option<DeviceTies>,
) -> impl Iterator<Item = &'a Kernel> {
    let pressure = loads.iter().filter_map(|loads| loads.pressure.as_ref());
    let give = ties.iter().map(|ties| &ties.give);
    pressure.chain(grips.kernel()).chain(solids.iter().flat_map(DeviceSolid::kernels)).chain(give)
}
