//! A setup of participants and its state, brought from one common instant of all participants to the next.

mod observer;
mod restore;
mod setup;
mod state;

use std::sync::Arc;

use pliant_contact::pose::Leg;
use pliant_explicit::Wanted;
use pliant_mechanics::grip::Grip;
use pliant_mechanics::tensor::Vector;
use pliant_mechanics::{Energies, Model, StopFlag, fingerprint};

pub use self::observer::{Frame, Observer};
pub use self::setup::Setup;
pub use self::state::SimulationState;
use self::state::{Between, OwnState};
use crate::coupled_surfaces::{CoupledSurfaceNow, Meetings};
#[cfg(feature = "gpu")]
use crate::device::OnDevice;
use crate::failure::{Failure, FailureKind};
use crate::instant::Instant;
use crate::participant::Participant;
use crate::participant_setup::ParticipantSetup;
use crate::penalty::{Springs, TieNow};
use crate::schedule::steps_to;
use crate::solver::LoadStepProgress;
use crate::start::{Before, begin, go_on};

/// A setup under way. It owns all it needs, so it can be kept anywhere and moved to another thread. After a
/// failure it stays at the last good instant.
///
/// ```
/// use pliant_mechanics::Model;
/// use pliant_mechanics::law::{AnyLaw, NeoHookean, Volumetric};
/// use pliant_mechanics::load::Load;
/// use pliant_mechanics::model::{Cells, Material, Solid};
/// use pliant_sim::{ParticipantSetup, Simulation};
///
/// // One tetrahedron, one face held, falling under its own weight.
/// let mut model = Model::default();
/// let tet = model.add_body("tet", &[[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]]);
/// let law = AnyLaw::NeoHookean(NeoHookean { shear: 1000.0, volumetric: Volumetric::quadratic(10_000.0) });
/// let cells = Cells::tet4(vec![[0, 1, 2, 3]], &model.rest);
/// model.add_solid(Solid::new(tet, Material::elastic(law, 1000.0), cells));
/// model.fix("base", vec![0, 1, 2]);
/// model.loads.push(Load::gravity(tet, [0.0, 0.0, -9.81]));
///
/// let mut simulation = Simulation::new(ParticipantSetup::explicit("tet", model, 0.1)?)?;
/// let start = simulation.state()?;
/// simulation.run(0.1, |_| ())?;
/// let down = simulation.frame()?.displacements("tet").unwrap()[3][2];
/// assert!(down < 0.0);
/// simulation.restore(start)?;
/// assert_eq!(simulation.time(), 0.0);
/// # Ok::<(), pliant_sim::Failure>(())
/// ```
pub struct Simulation {
    setup: Arc<Setup>,
    participants: Vec<Box<dyn Participant>>,
    /// Steps of each participant between two common instants.
    ratios: Vec<u64>,
    /// First node of each participant, counted over all.
    first_nodes: Vec<u32>,
    /// Participants by their number of steps, fewest first.
    order: Vec<usize>,
    /// Steps of each since the last common instant.
    done: Vec<u64>,
    /// Hands on each participant.
    hands: Vec<Vec<Grip>>,
    springs: Springs,
    meetings: Meetings,
    /// Forces [N] on all nodes that [`push`](Self::push) gave; empty without any.
    pushed: Vec<Vector<f64>>,
    /// States at the common instant before the step, where participants touch each other.
    before: Vec<OwnState>,
    /// True if forces, energies and reactions belong to the instant.
    evaluated: bool,
    /// Ends long steps; the state before such a step is then kept.
    stop: Option<StopFlag>,
}

impl Simulation {
    /// Makes a simulation at the start of a setup.
    ///
    /// # Errors
    /// If a stepper can't be made, or the setup has no participants.
    pub fn new(setup: impl Into<Arc<Setup>>) -> Result<Self, Failure> {
        let setup = setup.into();
        let participants = setup.parts.iter().map(begin).collect::<Result<Vec<_>, _>>()?;
        if participants.is_empty() {
            return Err(Failure::input(&"the setup has no participants"));
        }
        Self::of(setup, participants, Between::default())
    }

    /// Makes a simulation that continues from a state of this setup.
    ///
    /// # Errors
    /// If a stepper can't be made, or the state is of another setup.
    pub fn resumed(setup: impl Into<Arc<Setup>>, state: SimulationState) -> Result<Self, Failure> {
        let setup = setup.into();
        state.check(&setup)?;
        let SimulationState(state, between) = state;
        let mut participants = Vec::new();
        for (part, remembered) in setup.parts.iter().zip(state) {
            participants.push(resume(part, remembered)?);
        }
        Self::of(setup, participants, between)
    }

    /// Makes a simulation that continues from a state of another setup, with displacements, velocities and
    /// the history of relaxing laws. `None` where this setup has other meshes, solvers or number types.
    ///
    /// # Errors
    /// If a stepper can't be made.
    pub fn continued(
        setup: impl Into<Arc<Setup>>,
        SimulationState(state, between): SimulationState,
        before: &Setup,
    ) -> Result<Option<Self>, Failure> {
        let setup = setup.into();
        let fits = between.fits(&setup);
        if state.is_empty() || [state.len(), before.parts.len()] != [setup.parts.len(); 2] || !fits {
            return Ok(None);
        }
        let mut participants = Vec::new();
        for ((part, remembered), before) in setup.parts.iter().zip(state).zip(&before.parts) {
            if !same_mesh(before, part) {
                return Ok(None);
            }
            let model = Some(&*before.model);
            let steps = remembered.steps().map(|(clock, step)| Before { clock, step, model });
            match go_on(part, remembered.snapshot, steps)? {
                Some(participant) => participants.push(participant),
                None => return Ok(None),
            }
        }
        Self::of(setup, participants, between).map(Some)
    }

    fn of(
        setup: Arc<Setup>,
        participants: Vec<Box<dyn Participant>>,
        between: Between,
    ) -> Result<Self, Failure> {
        let ratios = setup.ratios();
        let nodes = setup.parts.iter().map(|part| part.model.node_count() as u32);
        let first_nodes = nodes.scan(0, |next, nodes| Some(std::mem::replace(next, *next + nodes))).collect();
        let hands = vec![Vec::new(); participants.len()];
        let mut order: Vec<usize> = (0..participants.len()).collect();
        // Of the same steps, one whose equations are solved goes last; but its coupled nodes go before their
        // hosts.
        let solves = |part: usize| setup.parts[part].method.solves_steps();
        order.sort_by_key(|&part| (ratios[part], solves(part) == setup.coupled_surfaces.is_empty()));
        let done = vec![0; participants.len()];
        if !(setup.ties.is_empty() || setup.coupled_surfaces.is_empty()) {
            return Err(Failure::input(
                &"participants can be tied to each other or touch each other, but not both",
            ));
        }
        let springs = Springs::new(&setup.ties, &setup.parts, between.ties)?;
        let meetings =
            Meetings::new(&setup.coupled_surfaces, &setup.parts, &ratios, between.coupled_surfaces)?;
        let before = Vec::new();
        Ok(Self {
            setup,
            participants,
            ratios,
            first_nodes,
            order,
            done,
            hands,
            springs,
            meetings,
            pushed: Vec::new(),
            before,
            evaluated: false,
            stop: None,
        })
    }

    /// The setup of the participants.
    pub fn setup(&self) -> &Arc<Setup> {
        &self.setup
    }

    /// Time of the common instant [s].
    pub fn time(&self) -> f64 {
        self.participants[0].time()
    }

    /// Common instants since the start.
    pub fn steps(&self) -> u64 {
        self.participants[0].steps() / self.ratios[0]
    }

    /// Length [s] of the next step from one common instant to the next.
    pub fn step_length(&self) -> f64 {
        self.setup.step_from(self.time())
    }

    /// Steps to the next common instant; on a GPU takes as many steps as possible at once, up to `most`.
    /// Returns their number.
    ///
    /// # Errors
    /// If forces can't be found or a step can't be taken. The simulation stays at the last good instant.
    pub fn step(&mut self, most: u64) -> Result<u64, Failure> {
        self.evaluate(Wanted::Energies)?;
        let steps = self.stride().min(most.max(1));
        self.advance(steps, &mut |_| {})?;
        Ok(steps)
    }

    /// Steps until a time [s], the nearest instant to it; `look` sees each instant, the last one, too.
    ///
    /// # Errors
    /// If forces can't be found or a step can't be taken. The simulation stays at the last good instant.
    pub fn run(&mut self, until: f64, look: impl FnMut(&Frame<'_>)) -> Result<(), Failure> {
        struct Looking<F>(F);
        impl<F: FnMut(&Frame<'_>)> Observer for Looking<F> {
            fn see(&mut self, simulation: &Simulation, _last: bool) -> Result<(), Failure> {
                self.0(&Frame { simulation });
                Ok(())
            }
        }
        self.observe(until, &mut Looking(look))
    }

    /// Steps until a time [s], the nearest instant to it. The observer sees all instants that its strides do
    /// not pass, the first and the last ones, too.
    ///
    /// # Errors
    /// If forces can't be found, a step can't be taken, or the observer ends the run. The simulation stays at
    /// the last good instant.
    pub fn observe(&mut self, until: f64, observer: &mut dyn Observer) -> Result<(), Failure> {
        loop {
            let to_the_end = self.steps_until(until);
            let last = to_the_end == 0;
            self.evaluate(observer.wanted(self, last))?;
            observer.see(self, last)?;
            if last {
                return Ok(());
            }
            let steps = observer.stride(self).min(to_the_end).min(self.stride());
            match self.advance(steps, &mut |progress| observer.watch(progress)) {
                // Who asked for the stop says what becomes of the run.
                Err(failure) if failure.is_interrupted() => {
                    observer.stepped(self, false)?;
                    return Err(failure);
                }
                Err(failure) => {
                    observer.step_failed(self);
                    return Err(failure);
                }
                Ok(()) => {}
            }
            let last = self.steps_until(until) == 0;
            observer.stepped(self, last)?;
        }
    }

    /// Common steps from here to the instant nearest to a time [s]; 0 where it has passed, or the run has
    /// [ended](Self::ended).
    pub fn steps_until(&self, time: f64) -> u64 {
        let (now, step) = (self.time(), self.step_length());
        let is_last = now + 0.5 * step >= time || self.ended().is_some();
        if is_last { 0 } else { steps_to(time, now, step) }
    }

    /// Returns all readable values at the instant, whose forces are found. The next step starts from this
    /// instant.
    ///
    /// # Errors
    /// If forces can't be found.
    pub fn frame(&mut self) -> Result<Frame<'_>, Failure> {
        self.evaluate(Wanted::Everything)?;
        Ok(Frame { simulation: self })
    }

    /// Finds forces of all participants at the instant, and reads the wanted values back from devices. Does
    /// nothing where they are found.
    ///
    /// # Errors
    /// If the forces of a participant can't be found.
    pub fn evaluate(&mut self, wanted: Wanted) -> Result<(), Failure> {
        if !self.evaluated {
            if !self.meetings.is_empty() {
                self.before.clear();
                let parts = self.participants.iter().zip(&self.setup.parts);
                self.before.extend(parts.map(|(now, part)| OwnState {
                    snapshot: now.snapshot(),
                    clock: None,
                    step: part.steps.step,
                }));
            }
            if !(self.springs.is_empty() && self.meetings.is_empty()) {
                self.springs.meet(&self.participants);
                self.meetings.meet(&self.setup.parts, &mut self.participants);
                self.done.fill(0);
                for part in 0..self.participants.len() {
                    self.grip_part(part);
                }
            }
            self.participants.iter_mut().try_for_each(|participant| participant.evaluate(wanted))?;
            self.evaluated = true;
        }
        Ok(())
    }

    /// True if forces, energies and reactions belong to the instant.
    pub fn is_evaluated(&self) -> bool {
        self.evaluated
    }

    /// Advances by a number of common instants from an evaluated one, not more than the stride. `watch` gets
    /// the progress of load steps.
    ///
    /// # Errors
    /// If a step of a participant can't be taken.
    pub fn advance(&mut self, steps: u64, watch: &mut dyn FnMut(LoadStepProgress)) -> Result<(), Failure> {
        let before = self.can_stop_within().then(|| self.motion()).transpose()?;
        let result = self.pass(steps, watch);
        match (result, before) {
            (Err(failure), Some(before)) if failure.is_interrupted() => {
                self.go_back(before)?;
                (0..self.participants.len()).for_each(|part| {
                    self.grip_part(part);
                });
                Err(Failure::stopped(self.time()))
            }
            (result, _) => {
                self.evaluated &= result.is_err();
                result
            }
        }
    }

    /// Looks at a flag from now on within load steps, steps whose equations are solved, and common steps of
    /// participants. A step that the flag ends fails as [interrupted](Failure::is_interrupted). The
    /// simulation then stays at the instant before, with the same bits as if the step had never begun.
    pub fn stop_on(&mut self, flag: &StopFlag) {
        self.participants.iter_mut().for_each(|participant| participant.stop_on(flag));
        self.stop = Some(flag.clone());
    }

    /// True if a flag may end steps before their end.
    fn can_stop_within(&self) -> bool {
        // States on a device would be read back before each common step.
        let in_memory = self.participants.iter().all(|participant| participant.stride() == 1);
        let takes_long =
            |(part, ratio): (&ParticipantSetup, &u64)| part.method.takes_long() || (*ratio > 1 && in_memory);
        self.stop.is_some() && self.setup.parts.iter().zip(&self.ratios).any(takes_long)
    }

    /// Ends a common step of several steps of a participant where that was asked for.
    ///
    /// # Errors
    /// If so.
    fn heed_stop(&self) -> Result<(), Failure> {
        let is_asked = self.stop.as_ref().is_some_and(StopFlag::is_asked) && self.can_stop_within();
        if is_asked { Err(Failure::stopped(self.time())) } else { Ok(()) }
    }

    fn pass(&mut self, steps: u64, watch: &mut dyn FnMut(LoadStepProgress)) -> Result<(), Failure> {
        if !self.meetings.is_empty() {
            self.advance_in_contact(watch)
        } else if !self.springs.is_empty() {
            self.advance_tied(watch)
        } else {
            (0..self.participants.len()).try_for_each(|part| self.advance_apart(part, steps, watch))
        }
    }

    fn advance_apart(
        &mut self,
        part: usize,
        steps: u64,
        watch: &mut dyn FnMut(LoadStepProgress),
    ) -> Result<(), Failure> {
        let mut left = steps * self.ratios[part];
        loop {
            self.heed_stop()?;
            let participant = &mut self.participants[part];
            let now = left.min(participant.stride());
            participant.advance(now, watch)?;
            left -= now;
            if left == 0 {
                return Ok(());
            }
            participant.evaluate(Wanted::Energies)?;
        }
    }

    /// One common step of tied participants. The participant at the earliest time takes the next step; at
    /// equal times, the one with the longest step.
    fn advance_tied(&mut self, watch: &mut dyn FnMut(LoadStepProgress)) -> Result<(), Failure> {
        self.done.fill(0);
        while let Some(part) = self.hindmost() {
            self.heed_stop()?;
            // Forces of the first step are found where all meet; only equations are solved with ties as they
            // are then.
            let first = self.done[part] == 0;
            if !first {
                self.springs.settle(part, &self.setup.parts);
            }
            if !first || self.setup.parts[part].method.solves_steps() {
                self.grip_part(part);
            }
            let participant = &mut self.participants[part];
            if !first {
                participant.evaluate(Wanted::Energies)?;
            }
            participant.advance(1, watch)?;
            self.done[part] += 1;
            let ahead = ahead(&self.setup.parts, &self.done, part, 0);
            self.springs.after(part, &self.setup.parts, &self.participants, ahead);
        }
        (0..self.participants.len()).for_each(|part| self.springs.settle(part, &self.setup.parts));
        Ok(())
    }

    /// One common step of participants that touch each other, taken until the forces on both sides agree.
    fn advance_in_contact(&mut self, watch: &mut dyn FnMut(LoadStepProgress)) -> Result<(), Failure> {
        for pass in 0.. {
            self.done.fill(0);
            let before = std::mem::take(&mut self.before);
            // Forces of a host were found with coupled nodes where they were expected.
            let back =
                self.put_back(&before, |simulation, part| pass > 0 || simulation.meetings.is_host(part));
            self.before = before;
            back?;
            while let Some(part) = self.hindmost() {
                self.heed_stop()?;
                // Who has not gone back has found the forces of the first step where all met.
                if pass > 0 || self.done[part] > 0 || self.meetings.is_host(part) {
                    self.grip_part(part);
                    self.participants[part].evaluate(Wanted::Energies)?;
                }
                self.participants[part].advance(1, watch)?;
                self.done[part] += 1;
                self.meetings.after(part, &self.setup.parts, &mut self.participants);
            }
            if self.meetings.settle(pass, &self.setup.parts, &self.participants) {
                break;
            }
        }
        Ok(())
    }

    /// The participant that is farthest from the next common instant.
    fn hindmost(&self) -> Option<usize> {
        let left = self.order.iter().copied().filter(|&part| self.done[part] < self.ratios[part]);
        left.min_by_key(|&part| {
            // In parts of the common step; the first one of several.
            let whole: u64 = 1 << 40;
            self.done[part] * whole / self.ratios[part]
        })
    }

    /// Lets hands and ties take hold of a participant for its next step; false if it knows no grips.
    fn grip_part(&mut self, part: usize) -> bool {
        let mut grips = self.hands[part].clone();
        let ahead = ahead(&self.setup.parts, &self.done, part, 1);
        self.springs.before(part, &self.participants, ahead);
        self.springs.add_to(part, &mut grips);
        self.meetings.add_to(part, &mut grips);
        self.participants[part].grip(&grips)
    }

    /// Drives a tool or a jaw of a participant.
    pub(crate) fn lead_part(&mut self, part: usize, rigid: usize, leg: Leg) {
        self.participants[part].drive(rigid, leg);
        // A step in contact begins at the instant before forces were found.
        if self.evaluated
            && let Some(before) = self.before.get_mut(part)
        {
            before.snapshot.drive(rigid, leg);
        }
    }

    /// The ties between participants at the instant last evaluated.
    pub fn ties(&self) -> impl Iterator<Item = TieNow<'_>> {
        self.springs.now()
    }

    /// The contacts between participants where they met last.
    pub fn coupled_surfaces(&self) -> impl Iterator<Item = CoupledSurfaceNow> {
        self.meetings.now()
    }

    /// The most common instants that it passes in one go: more than one where the state lies on a GPU.
    pub fn stride(&self) -> u64 {
        let of = self.participants.iter().zip(&self.ratios);
        of.map(|(participant, ratio)| participant.stride() / ratio).min().unwrap_or(1).max(1)
    }

    /// Returns the state, at any instant. A simulation that continues from it finds the forces of its instant
    /// again, with the same bits where they were found. Hands and forces of [`push`](Self::push) are not part
    /// of the state. A tool that was driven after the forces were found begins its way in that step.
    ///
    /// # Errors
    /// If a device fails.
    pub fn state(&mut self) -> Result<SimulationState, Failure> {
        let mut state = self.motion()?;
        state
            .0
            .iter_mut()
            .zip(&self.participants)
            .for_each(|(remembered, now)| now.add_log(&mut remembered.snapshot));
        Ok(state)
    }

    /// The state without what participants note of their iterations.
    fn motion(&mut self) -> Result<SimulationState, Failure> {
        self.bring_back()?;
        Ok(self.snapshot())
    }

    /// Returns the state in ordinary memory, without the participants' notes of their iterations. For a GPU
    /// this is the state last read back.
    pub fn snapshot(&self) -> SimulationState {
        let parts = self.setup.parts.iter().zip(&self.participants).enumerate();
        let states = parts.map(|(index, (part, now))| {
            let snapshot = self.met().map_or_else(|| now.snapshot(), |met| met[index].snapshot.clone());
            OwnState { clock: now.clock(), snapshot, step: part.steps.step }
        });
        SimulationState(states.collect(), self.between())
    }

    /// The states at the instant before its forces were found, where participants touch each other and forces
    /// are found.
    fn met(&self) -> Option<&[OwnState]> {
        (self.evaluated && !self.meetings.is_empty()).then_some(&self.before[..])
    }

    fn between(&self) -> Between {
        Between { ties: self.springs.memory().clone(), coupled_surfaces: self.meetings.memory().clone() }
    }

    fn bring_back(&mut self) -> Result<(), Failure> {
        self.participants.iter_mut().try_for_each(|participant| participant.bring_back())
    }

    /// The participants as observers read them, in the order of the setup, at the instant last evaluated.
    pub fn instants(&self) -> impl Iterator<Item = &dyn Instant> {
        self.participants.iter().map(|participant| participant.as_ref() as &dyn Instant)
    }

    /// Energies of all participants together [J]; the worst of their balances.
    pub fn energies(&self) -> Energies {
        Energies::total(self.instants().map(|now| now.energies()))
    }

    /// Reason why it is at its end before its last step.
    pub fn ended(&self) -> Option<&str> {
        self.participants.iter().find_map(|participant| participant.ended())
    }

    /// Returns true, after a step that failed, if a state was found on the way that is worth showing. Its
    /// forces are then found.
    pub fn keeps_what_it_found(&mut self) -> bool {
        let [only] = &mut self.participants[..] else { return false };
        self.evaluated = only.keeps_what_it_found() && only.evaluate(Wanted::Everything).is_ok();
        self.evaluated
    }

    /// A fingerprint of the motion: the same bits have the same one.
    pub fn fingerprint(&self) -> u64 {
        match &self.participants[..] {
            [only] => only.fingerprint(),
            several => fingerprint(&several.iter().map(|one| one.fingerprint()).collect::<Vec<_>>()),
        }
    }
}

/// Hands on points. Nodes are counted over the models of all participants.
impl Simulation {
    /// The participant of a node, and the node's number there.
    pub fn locate(&self, node: u32) -> (usize, u32) {
        // The first node of the first participant is 0.
        let part = self.first_nodes.partition_point(|&first| first <= node) - 1;
        (part, node - self.first_nodes[part])
    }

    /// Number, over all participants, of a node of one participant.
    pub fn node(&self, part: usize, node: u32) -> u32 {
        self.first_nodes[part] + node
    }

    /// The place of a node at rest [m].
    pub fn rest(&self, node: u32) -> [f64; 3] {
        let (part, node) = self.locate(node);
        self.setup.parts[part].model.rest[node as usize]
    }

    /// Takes hold of points: these grips and no others act from the next evaluation on. False where a stepper
    /// knows none, or where a grip holds nodes of several participants.
    pub fn grip(&mut self, grips: &[Grip]) -> bool {
        let mut of_parts = vec![Vec::new(); self.participants.len()];
        for grip in grips {
            let Some((part, local)) = self.local_grip(grip) else { return false };
            of_parts[part].push(local);
        }
        self.hands = of_parts;
        let mut held = true;
        for part in 0..self.participants.len() {
            held &= self.grip_part(part);
        }
        held
    }

    /// Pushes nodes with forces [N], one a node, counted over the models of all participants. Only these
    /// forces act from the next evaluation on, until they are replaced. An empty slice ends them. Their work
    /// is external.
    ///
    /// # Errors
    /// If there are not as many forces as nodes, a force is not finite, or a stepper takes none, as on a GPU.
    /// No force is then replaced.
    pub fn push(&mut self, forces: &[Vector<f64>]) -> Result<(), Failure> {
        let nodes: usize = self.setup.parts.iter().map(|part| part.model.node_count()).sum();
        if !forces.is_empty() && forces.len() != nodes {
            let given = forces.len();
            return Err(Failure::input(&format_args!(
                "{given} forces were given for {nodes} nodes: give one force for each node of all bodies, or none"
            )));
        }
        if let Some(node) = forces.iter().position(|force| !force.iter().all(|f| f.is_finite())) {
            return Err(Failure::input(&format_args!("the force on node {node} is not finite")));
        }
        if !forces.is_empty() && !self.setup.parts.iter().all(|part| part.method.takes_forces()) {
            let remedy =
                "forces on nodes act on the CPU only: choose `device = \"cpu\"`, or hold nodes by grips";
            return Err(Failure::new(FailureKind::Device, remedy.to_owned(), Some(self.time())));
        }
        self.pushed.clear();
        self.pushed.extend_from_slice(forces);
        (0..self.participants.len()).for_each(|part| self.push_part(part));
        Ok(())
    }

    /// Gives a participant what its nodes are pushed with.
    fn push_part(&mut self, part: usize) {
        let first = (self.first_nodes[part] as usize).min(self.pushed.len());
        let end = (first + self.setup.parts[part].model.node_count()).min(self.pushed.len());
        self.participants[part].push(&self.pushed[first..end]);
    }

    /// The forces [N] that [`push`](Self::push) gave, one a node; none without any.
    pub fn pushed(&self) -> &[Vector<f64>] {
        &self.pushed
    }

    /// The stiffness [N/m] up to which a grip leaves steps stable; infinite where steps are stable with any.
    pub fn stiffest(&self, grip: &Grip) -> f64 {
        self.local_grip(grip).map_or(0.0, |(part, local)| self.participants[part].stiffest(&local))
    }

    /// The point of a grip now [m], and its force on the body [N].
    pub fn pulled(&self, grip: &Grip) -> [[f64; 3]; 2] {
        let pulled = self.local_grip(grip).map(|(part, local)| self.participants[part].pulled(&local));
        pulled.unwrap_or([grip.place, [0.0; 3]])
    }

    /// The participant of a grip, and the grip with the numbers of the nodes there; `None` where it holds
    /// nodes of several.
    fn local_grip(&self, grip: &Grip) -> Option<(usize, Grip)> {
        let (part, _) = self.locate(grip.nodes.first().map_or(0, |&(node, _)| node));
        let nodes = grip.nodes.iter().map(|&(node, weight)| {
            let (owner, node) = self.locate(node);
            (owner == part).then_some((node, weight))
        });
        let nodes: Vec<_> = nodes.collect::<Option<_>>()?;
        Some((part, Grip { nodes: self.setup.parts[part].model.resolved(&nodes), ..grip.clone() }))
    }
}

#[cfg(feature = "gpu")]
impl Simulation {
    /// Steps without read-backs and points on the GPU, where all bodies go together on one; `None` on the
    /// CPU.
    pub fn on_device(&mut self) -> Option<OnDevice<'_>> {
        let [only] = &mut self.participants[..] else { return None };
        let (stepper, state) = only.on_device()?;
        Some(OnDevice { stepper, state, evaluated: &mut self.evaluated })
    }
}

/// Makes a participant that continues from a state of its part.
fn resume(part: &ParticipantSetup, remembered: OwnState) -> Result<Box<dyn Participant>, Failure> {
    let steps = remembered.steps().map(|(clock, step)| Before { clock, step, model: None });
    go_on(part, remembered.snapshot, steps)?.ok_or_else(|| Failure::input(&"the state is of another model"))
}

/// Keeps displacements of a participant at the addresses where another one of the same meshes had its
/// displacements.
fn take_place_of(participant: &mut Box<dyn Participant>, before: &mut Box<dyn Participant>) {
    if let (Some(here), Some(there)) = (participant.displacements_mut(), before.displacements_mut()) {
        here.take_place_of(there);
    }
}

/// Time [s] that others, each by its index, are ahead of a participant after a number of further steps.
fn ahead<'a>(
    parts: &'a [ParticipantSetup],
    done: &'a [u64],
    part: usize,
    more: u64,
) -> impl Fn(usize) -> f64 + 'a {
    let at = move |part: usize, more: u64| (done[part] + more) as f64 * parts[part].steps.step;
    move |other| at(other, 0) - at(part, more)
}

/// True if two participants have the same nodes and cells.
fn same_mesh(a: &ParticipantSetup, b: &ParticipantSetup) -> bool {
    let shells = |part: &ParticipantSetup| part.method.bodies().map(|bodies| bodies.model.rest.len());
    a.model.rest == b.model.rest && shells(a) == shells(b) && meshes(&a.model) == meshes(&b.model)
}

/// Fingerprints of the meshes of a model.
fn meshes(model: &Model) -> Vec<(String, u64)> {
    model.fingerprints().into_iter().filter(|(part, _)| part.starts_with("mesh of")).collect()
}
