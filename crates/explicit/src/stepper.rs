//! The central difference method in incremental form. With a = α Δt/2 the increment is Δuⁿ⁺¹ = ((1 − a) Δuⁿ +
//! Δt²/m (R − f)) / (1 + a), and uⁿ⁺¹ = uⁿ + Δuⁿ⁺¹. These are thesis 5.28–5.32 without the cancellation in
//! 2uⁿ − uⁿ⁻¹. Damping does not lower the stable step. If the step changes from Δt⁻ to Δt⁺, velocities
//! continue. Let h = (Δt⁻ + Δt⁺)/2 and a = α h/2. Then Δuⁿ⁺¹ = ((1 − a) Δt⁺/Δt⁻ Δuⁿ + Δt⁺ h/m (R − f)) / (1 +
//! a). Let v⁻ = Δuⁿ/Δt⁻ and v⁺ = Δuⁿ⁺¹/Δt⁺, so that h a = v⁺ − v⁻ with the acceleration a. The trapezoidal
//! rule gives the work of all forces, ½ m a (Δt⁻ v⁻ + Δt⁺ v⁺). It equals ½ m (v⁺² − v⁻²) + ⅛ (Δt⁺² − Δt⁻²) m
//! a². So the change adds ⅛ (Δt⁻² − Δt⁺²) Σ m|a|² to the kinetic energy. The book of energies enters this
//! energy besides the work. The velocity at the instant is v⁻ + ½ Δt⁻ a = v⁺ − ½ Δt⁺ a.
//!
//! A step has two halves. [`CentralDifference::evaluate`] finds forces, the coming increments, reactions and
//! energies at the current time. So all that an observer sees belongs to one instant.
//! [`CentralDifference::advance`] moves the nodes. Steps run on the current rayon pool; sums follow the order
//! of the nodes for any number of threads.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Translation3, Vector3};
use pliant_contact::pose::Stance;
use pliant_contact::touch::{Contacts, Rigid};
use pliant_mechanics::Energies;
use pliant_mechanics::grip::Grip;
use pliant_mechanics::mapping::weighted;
use pliant_mechanics::model::{Contradiction, Enclosed, FREE, Model};
use pliant_mechanics::tensor::{Vector, add};
use rayon::prelude::*;

use crate::applied::AppliedForces;
use crate::collective::{Collective, Predicted, enclosed};
use crate::contact::{ContactSolver, Free, NodeContact, Nodes, Posture};
use crate::damping_force::{DampingFactors, Past};
use crate::energies::{Sums, model_balance_floor};
use crate::forces::{Deformed, Found, InternalForces};
use crate::lanes::LaneNumber;
use crate::lanes::{Instructions, MissingInstructions, Processor};
use crate::node_pass::{Add, CHUNK, Held, NodePass, Pace, held};
use crate::recover::stored_at_start;
use crate::stability::Monitor;
use crate::state::State;
use crate::step_control::{Clock, Lengths, StepControl};
use crate::step_error::StepError;

/// Mass [kg] of a component that is held and of which the mass went elsewhere.
pub const NO_MASS: f64 = 1e-30;

/// Tasks that a thread takes at least: fewer take less time than waking another thread.
const LEAST_CHUNKS: usize = 5;

/// The results of an evaluated instant that a caller needs. A GPU reads back only these.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// Energies and reactions.
    Energies,
    /// Energies, reactions, displacements, increments and the history of relaxing laws.
    Everything,
}

/// Results at the instant a state stands at, whatever brought it there.
pub trait Observable<R> {
    /// Energies [J].
    fn energies(&self) -> &Energies;

    /// Force [N] that holds or moves the nodes of a constraint, summed.
    fn reaction(&self, constraint: usize) -> Vector<f64>;

    /// Volume and pressure of a constraint of volume; `None` of others.
    fn enclosed(&self, _constraint: usize) -> Option<Enclosed> {
        None
    }

    /// Force [N] by which constraints hold or move a node; zero along components that are free.
    fn nodal_reaction(&self, node: usize) -> Vector<f64>;

    /// Moment [N m] by which constraints hold or turn a node; zero of nodes that do not turn.
    fn nodal_reaction_moment(&self, _node: usize) -> Vector<f64> {
        [0.0; 3]
    }

    /// Velocity [m/s] of a node.
    fn velocity(&self, state: &State<R>, node: usize) -> Vector<f64>;

    /// Force [N] of each contact on the thing that its nodes touch.
    fn contact_forces(&self) -> Vec<Vector<f64>> {
        Vec::new()
    }

    /// Moment [N m] about the origin of the force of each contact on the rigid thing that its nodes touch;
    /// `None` where it is not found.
    fn contact_moments(&self) -> Option<Vec<Vector<f64>>> {
        None
    }

    /// The nodes that may touch something, increasing, with what contacts do to them.
    fn contact_nodes(&self, _state: &State<R>) -> Vec<NodeContact> {
        Vec::new()
    }
}

/// Number type of [`CentralDifference`], with the functions compiled for it here and not again where a model
/// is stepped.
pub trait SteppedIn: LaneNumber {
    /// Runs [`CentralDifference::new`].
    #[doc(hidden)]
    fn stepper(model: Arc<Model>, step: f64) -> Result<CentralDifference<Self>, Contradiction>;

    /// Runs [`CentralDifference::evaluate`].
    #[doc(hidden)]
    fn evaluate(stepper: &mut CentralDifference<Self>, state: &mut State<Self>) -> Result<(), StepError>;

    /// Runs [`CentralDifference::advance`].
    #[doc(hidden)]
    fn advance(stepper: &mut CentralDifference<Self>, state: &mut State<Self>);

    /// Runs [`Observable::contact_nodes`].
    #[doc(hidden)]
    fn contact_nodes(stepper: &CentralDifference<Self>, state: &State<Self>) -> Vec<NodeContact>;
}

macro_rules! stepped_in {
    ($number:ty) => {
        impl SteppedIn for $number {
            fn stepper(model: Arc<Model>, step: f64) -> Result<CentralDifference<Self>, Contradiction> {
                CentralDifference::of_model(model, step)
            }

            fn evaluate(
                stepper: &mut CentralDifference<Self>,
                state: &mut State<Self>,
            ) -> Result<(), StepError> {
                stepper.find_forces(state)
            }

            fn advance(stepper: &mut CentralDifference<Self>, state: &mut State<Self>) {
                stepper.move_nodes(state);
            }

            fn contact_nodes(stepper: &CentralDifference<Self>, state: &State<Self>) -> Vec<NodeContact> {
                stepper.contact.as_ref().map_or_else(Vec::new, |contact| contact.nodal(state))
            }
        }
    };
}

stepped_in!(f32);
stepped_in!(f64);

/// Steps a state of one model by one step size. Holds constants in its number type and scratch, nothing that
/// a restart would lose.
pub struct CentralDifference<R> {
    model: Arc<Model>,
    control: StepControl,
    lengths: Lengths,
    /// Length of a step [s] that relaxing laws are set to.
    relaxing: f64,
    forces: InternalForces<R>,
    owners: Vec<[u32; 3]>,
    /// The nodes of which a component has an owner, increasing.
    held: Vec<Held>,
    /// Mass of each component [kg].
    mass: Vec<Vector<R>>,
    /// α of each component [1/s].
    damping: Vec<Vector<R>>,
    applied: AppliedForces<R>,
    /// Nodes that are bound to each other.
    collectives: Vec<Collective>,
    /// Contacts with rigid things.
    contact: Option<ContactSolver<R>>,
    /// True if the highest modes are dissipated.
    dissipates: bool,
    processor: Processor,
    /// Factors on the amplitudes of each constraint now and after the step.
    factors: Vec<[[f64; 2]; 2]>,
    next: Vec<Vector<R>>,
    reaction: Vec<Vector<R>>,
    /// Internal forces [N], where they damp.
    internal: Vec<Vector<R>>,
    sums: Vec<Sums>,
    energies: Energies,
    balance_floor: f64,
}

/// Results at the last evaluation.
impl<R: SteppedIn> Observable<R> for CentralDifference<R> {
    fn energies(&self) -> &Energies {
        &self.energies
    }

    fn reaction(&self, constraint: usize) -> Vector<f64> {
        match self.collectives.iter().find(|collective| collective.constraint == constraint) {
            Some(collective) => collective.force,
            None => sum_owned(&self.model, &self.owners, constraint, &self.reaction),
        }
    }

    fn enclosed(&self, constraint: usize) -> Option<Enclosed> {
        enclosed(&self.model, &self.collectives, constraint)
    }

    fn nodal_reaction(&self, node: usize) -> Vector<f64> {
        owned_only(&self.owners[node], self.reaction[node])
    }

    fn contact_forces(&self) -> Vec<Vector<f64>> {
        let on_nodes = self.contact.iter().flat_map(|contact| &contact.forces);
        on_nodes.map(|force| force.map(|f| -f)).collect()
    }

    fn contact_moments(&self) -> Option<Vec<Vector<f64>>> {
        let on_nodes = self.contact.iter().flat_map(|contact| &contact.moments);
        Some(on_nodes.map(|moment| moment.map(|m| -m)).collect())
    }

    fn contact_nodes(&self, state: &State<R>) -> Vec<NodeContact> {
        R::contact_nodes(self, state)
    }

    fn velocity(&self, state: &State<R>, node: usize) -> Vector<f64> {
        let velocity = |node: u32| {
            let (before, after) = (state.increment[node as usize], self.next[node as usize]);
            [0, 1, 2].map(|c| self.lengths.velocity(before[c].to_f64(), after[c].to_f64()))
        };
        let alone = velocity(node as u32);
        if self.model.ties.is_empty() {
            return alone;
        }
        let followed = weighted(self.model.resolved(&[(node as u32, 1.0)]), velocity);
        [0, 1, 2].map(|c| if self.owners[node][c] == FREE { followed[c] } else { alone[c] })
    }
}

/// A force [N] on the components of a node that have an owner.
pub(crate) fn owned_only<R: LaneNumber>(owner: &[u32; 3], force: Vector<R>) -> Vector<f64> {
    [0, 1, 2].map(|c| if owner[c] == FREE { 0.0 } else { force[c].to_f64() })
}

/// The sum of forces over the components that a constraint owns.
pub(crate) fn sum_owned<R: LaneNumber>(
    model: &Model,
    owners: &[[u32; 3]],
    constraint: usize,
    forces: &[Vector<R>],
) -> Vector<f64> {
    let mut sum = [0.0; 3];
    for &node in &model.constraints[constraint].nodes {
        for (component, sum) in sum.iter_mut().enumerate() {
            if owners[node as usize][component] == constraint as u32 {
                *sum += forces[node as usize][component].to_f64();
            }
        }
    }
    sum
}

impl<R: SteppedIn> CentralDifference<R> {
    /// A stepper for steps of `step` seconds.
    ///
    /// # Errors
    /// If constraints contradict each other.
    pub fn new(model: impl Into<Arc<Model>>, step: f64) -> Result<Self, Contradiction> {
        R::stepper(model.into(), step)
    }

    fn of_model(model: Arc<Model>, step: f64) -> Result<Self, Contradiction> {
        let nodes = model.node_count();
        let mut damping = vec![[R::ZERO; 3]; nodes];
        for body in &model.bodies {
            damping[body.nodes.start as usize..body.nodes.end as usize].fill([R::of(body.damping); 3]);
        }
        let owners = model.constrained_components()?;
        let follows = model.followers();
        let applied = AppliedForces::new(Arc::clone(&model));
        Ok(Self {
            control: StepControl::new(step),
            lengths: Lengths { before: step, next: step },
            relaxing: step,
            forces: InternalForces::new(&model, step),
            held: held(&owners, &model.amplitudes(&owners)),
            // Nodes that follow others have no mass, and no force but where they are held: there next to no
            // mass moves with them.
            mass: (0..nodes)
                .map(|node| {
                    let without = owners[node].map(|owner| if owner == FREE { 1.0 } else { NO_MASS });
                    (if follows[node] { without } else { [model.inertia(node); 3] }).map(R::of)
                })
                .collect(),
            owners,
            damping,
            applied,
            collectives: Collective::of_model(&model),
            contact: None,
            dissipates: false,
            processor: Processor::detect(),
            factors: vec![[[0.0; 2]; 2]; model.constraints.len()],
            next: vec![[R::ZERO; 3]; nodes],
            reaction: vec![[R::ZERO; 3]; nodes],
            internal: vec![[R::ZERO; 3]; nodes],
            sums: vec![Sums::default(); nodes.div_ceil(CHUNK)],
            energies: Energies::default(),
            balance_floor: model_balance_floor::<R>(&model),
            model,
        })
    }

    /// Watches the largest stable step with a monitor of the same model.
    #[must_use]
    pub fn watched(mut self, monitor: Monitor) -> Self {
        self.control.watch(monitor);
        self
    }

    /// [Dissipates](crate::DISSIPATION) the highest modes. Without it, angular momentum of a free body is
    /// exact and energies are kept to round-off.
    #[must_use]
    pub fn dissipating(mut self) -> Self {
        self.dissipates = true;
        self
    }

    /// True if internal forces of earlier instants damp.
    fn damps_by_forces(&self) -> bool {
        self.dissipates || self.model.stiffness_damping > 0.0
    }

    fn damping_factors(&self, state: &State<R>) -> DampingFactors {
        state.stability.damping_factors(self.dissipates, self.model.stiffness_damping, self.lengths.before)
    }

    /// Lets nodes touch rigid things.
    #[must_use]
    pub fn with_contacts(mut self, contacts: Arc<Contacts>) -> Self {
        self.contact = Some(ContactSolver::new(contacts, &self.model.rest));
        self
    }

    /// Leads the coupled nodes of contacts ([`Contacts::coupled_nodes`]) from one place [m] to another
    /// between two times [s]. Their speed is constant, also beyond these times.
    ///
    /// # Panics
    /// If there are not as many ways as coupled nodes.
    pub fn lead_coupled_surfaces(&mut self, times: [f64; 2], ways: &[[Vector<f64>; 2]]) {
        if let Some(contact) = &mut self.contact {
            contact.lead(times, ways);
        }
    }

    /// Impulses [N s] of contacts on each coupled node since it was led, over the steps that have ended.
    pub fn coupled_impulses(&self) -> &[Vector<f64>] {
        self.contact.as_ref().map_or(&[], ContactSolver::impulses)
    }

    /// Returns the clock with which another stepper continues from a state of this one.
    pub fn clock(&self, state: &State<R>) -> Clock {
        self.control.clock(state)
    }

    /// Continues from a state where another stepper, with steps of length `step` [s], has stood, with the
    /// velocities there.
    pub fn go_on(&mut self, clock: &Clock, step: f64, state: &State<R>) {
        self.control.go_on(clock, step, state);
    }

    /// Replaces the grips: only these act from the next evaluation on. Their work is external.
    pub fn grip(&mut self, grips: &[Grip]) {
        self.applied.grip(grips);
    }

    /// Replaces the forces [N] from outside, one per node, or none. They act from the next evaluation on
    /// until they are replaced. Their work is external.
    pub fn push(&mut self, forces: &[Vector<f64>]) {
        self.applied.push(forces);
    }

    /// Runs in the lanes of certain instructions instead of the widest.
    ///
    /// # Errors
    /// If the processor does not have them.
    pub fn in_lanes(mut self, instructions: Instructions) -> Result<Self, MissingInstructions> {
        self.processor = Processor::with(instructions)?;
        self.forces.set_processor(self.processor);
        Ok(self)
    }

    /// The length [s] of a whole step.
    pub fn step(&self) -> f64 {
        self.control.step()
    }

    /// Finds forces, coming increments, reactions and energies at the current time. Forces that were found
    /// before, also by another stepper, are found again.
    ///
    /// # Errors
    /// If the state is not finite, a cell is inverted, or the energies do not balance. Also if the step is
    /// above the limit and must not be cut.
    pub fn evaluate(&mut self, state: &mut State<R>) -> Result<(), StepError> {
        R::evaluate(self, state)
    }

    fn find_forces(&mut self, state: &mut State<R>) -> Result<(), StepError> {
        self.control.keep(state);
        if self.damps_by_forces() {
            state.keep_forces();
        }
        self.lengths = self.control.lengths(state);
        let relaxing = self.control.relaxing(state);
        if self.relaxing != relaxing {
            self.relaxing = relaxing;
            self.forces.set_step(&self.model, self.relaxing);
        }
        let found = self.forces.evaluate(&state.displacement, &mut state.history);
        let below = match found.inverted {
            None if state.is_between_steps() => self.watch(state, &found.deformed),
            _ => Ok(()),
        };
        self.lengths = self.control.lengths(state);
        self.applied.update(state.time, &state.displacement);
        self.set_factors(state.time);
        if state.is_at_start() {
            let stored = stored_at_start(&self.model, state, found.hourglass);
            self.start(state, stored);
            if self.touch(state, self.lengths.first_part()) {
                self.start(state, stored);
            }
            if self.bind(state) {
                self.start(state, stored);
            }
        } else {
            self.touch(state, 1.0);
            self.bind(state);
        }
        self.pass_over_nodes(state);
        let sums = self.sums.iter().fold(Sums::default(), Sums::merge);
        self.check_state(state, &sums, &found)?;
        self.settle_energies(state, &sums, found.hourglass)?;
        below
    }

    /// Looks at the limit where one is due, and chooses the parts of the step to come.
    fn watch(&mut self, state: &mut State<R>, deformed: &Deformed) -> Result<(), StepError> {
        if self.control.is_due(state, deformed) && !self.control.pass(state, deformed) {
            self.control.look_with(&self.model, &self.owners, Some(&mut self.forces), state, deformed);
        }
        let below = self.control.choose(&self.model, state);
        self.control.note(state);
        below
    }

    /// Moves to the next instant, at the end of the step or of its part. [`evaluate`](Self::evaluate) has to
    /// run first.
    pub fn advance(&mut self, state: &mut State<R>) {
        R::advance(self, state);
    }

    fn move_nodes(&mut self, state: &mut State<R>) {
        std::mem::swap(&mut state.increment, &mut self.next);
        let chunks = state.displacement.par_chunks_mut(CHUNK).zip(state.increment.par_chunks(CHUNK));
        chunks.enumerate().with_min_len(self.least_chunks()).for_each(|(task, (displacement, increment))| {
            let first = task * CHUNK;
            self.processor.run(Add { increment, to: displacement });
            for held in self.held_in(first..first + displacement.len()) {
                for (c, constraint) in held.components() {
                    let then = held.place(c, self.factors[constraint][1]);
                    displacement[held.node as usize - first][c] = R::of(then);
                }
            }
        });
        self.model.follow(&mut state.displacement);
        if let Some(contact) = &mut self.contact {
            contact.slide(&mut state.slip);
            state.gripped.append(&mut contact.taken);
            contact.press_coupled_surfaces(self.lengths.next);
        }
        if self.damps_by_forces() {
            let [last, before] = &mut state.forces;
            std::mem::swap(before, last);
            std::mem::swap(last, &mut self.internal);
        }
        state.work.advance();
        self.control.count(state);
        state.lags.iter_mut().for_each(|lag| lag.advance(state.time));
    }

    /// Returns the nodes of a range of which a component has an owner.
    #[inline(always)]
    fn held_in(&self, nodes: Range<usize>) -> &[Held] {
        let before = |end: usize| self.held.partition_point(|held| (held.node as usize) < end);
        &self.held[before(nodes.start)..before(nodes.end)]
    }

    /// Energy [J] above which the balance is judged.
    pub fn balance_floor(&self) -> f64 {
        self.balance_floor
    }

    fn set_factors(&mut self, time: f64) {
        for (factors, constraint) in self.factors.iter_mut().zip(&self.model.constraints) {
            *factors = [time, time + self.lengths.next].map(|t| constraint.motion.factors(t));
        }
    }

    /// u⁻¹ = u⁰ − Δt v⁰ + ½ Δt² a⁰ with a⁰ = (R − f)/m − α v⁰: the increment before the first step. A
    /// prescribed component has no velocity of its own.
    fn start(&self, state: &mut State<R>, stored: f64) {
        let dt = self.lengths.before;
        let half = 0.5 * dt * dt;
        let mut shock = 0.0;
        let mut kinetic = 0.0;
        for (node, increment) in state.increment.iter_mut().enumerate() {
            let applied: Vector<R> = self.applied.at(node);
            let internal = self.forces.at(node);
            let (m, alpha) = (self.mass[node][0].to_f64(), self.damping[node][0].to_f64());
            let velocity = self.model.initial_velocity.get(node).copied().unwrap_or_default();
            for c in 0..3 {
                if self.owners[node][c] != FREE {
                    increment[c] = R::ZERO;
                    continue;
                }
                let acceleration = (applied[c] - internal[c]).to_f64() / m - alpha * velocity[c];
                increment[c] = R::of(dt * velocity[c] - half * acceleration);
                shock += 0.5 * m * (half * acceleration / dt).powi(2);
                kinetic += 0.5 * m * velocity[c] * velocity[c];
            }
        }
        state.work.begin(kinetic, stored, shock);
    }

    /// Predicts the motion of a node from the forces found.
    fn predicted(&self, state: &State<R>, node: u32) -> Predicted {
        let at = node as usize;
        let [next, mean] = [self.lengths.next, self.lengths.mean()];
        let step_squared = next * mean;
        let (m, a) = (self.mass[at][0].to_f64(), 0.5 * mean * self.damping[at][0].to_f64());
        let (external, internal): (Vector<f64>, _) = (self.applied.at(at), self.forces.at(at));
        let mut lost = [[R::ZERO; 3]];
        if self.damps_by_forces() {
            Past::of(&state.forces, self.damping_factors(state)).from(at).damp(&[internal], &mut lost);
        }
        let inertia = m * (1.0 + a);
        let place = [0, 1, 2].map(|c| {
            let before = state.increment[at][c].to_f64() * self.lengths.ratio();
            let force = external[c] - internal[c].to_f64() - lost[0][c].to_f64();
            state.displacement[at][c].to_f64() + ((1.0 - a) * before * m + step_squared * force) / inertia
        });
        let now = state.displacement[at].map(|u| u.to_f64());
        let held = self.owners[at].map(|owner| owner != FREE);
        Predicted { now, displacement: place, mobility: step_squared / inertia, held }
    }

    /// Adds the forces of contacts, from where nodes would go without them; of their mobility this part
    /// counts. Whether there are contacts.
    fn touch(&mut self, state: &mut State<R>, part: f64) -> bool {
        let Some(mut contact) = self.contact.take() else { return false };
        let mut gripped = std::mem::take(&mut state.gripped);
        let mut lags = std::mem::take(&mut state.lags);
        let rest = |node: u32| self.model.rest[node as usize];
        let now = Nodes {
            displacement: &state.displacement,
            increment: &state.increment,
            ratio: self.lengths.ratio(),
            processor: self.processor,
        };
        let free = |node: u32| {
            let Predicted { mut displacement, mobility, .. } = self.predicted(state, node);
            let mut moves = [part * mobility; 3];
            for held in self.held_in(node as usize..node as usize + 1) {
                for (c, constraint) in held.components() {
                    (displacement[c], moves[c]) = (held.place(c, self.factors[constraint][1]), 0.0);
                }
            }
            Free { then: add(rest(node), displacement), mobility: moves }
        };
        let times = [state.time, state.time + self.lengths.next];
        contact.lag(&mut lags, times, |rigid| state.leg(rigid));
        let postures = |number: usize, rigid: &Rigid| {
            let leg = state.leg(number);
            let lag = lags.iter().find(|lag| lag.number() == number);
            let ways = lag.map_or([Vector3::zeros(); 2], |lag| [lag.now(), lag.next()]);
            let stance = |k: usize| {
                let Stance { pose, growth } = rigid.stance(times[k], leg);
                Stance { pose: Translation3::from(ways[k]) * pose, growth }
            };
            Posture { stances: [stance(0), stance(1)], opening: rigid.posture(times[1], leg).1 }
        };
        contact.find(postures, &now, times, free, &mut gripped);
        contact.nodal_forces().for_each(|(node, force)| self.applied.add(node, force));
        contact.bear_on(&mut lags);
        (state.gripped, state.lags) = (gripped, lags);
        self.contact = Some(contact);
        true
    }

    /// Adds the forces of collective constraints, from where their nodes would go without them.
    fn bind(&mut self, state: &State<R>) -> bool {
        let mut collectives = std::mem::take(&mut self.collectives);
        let at_start = state.is_at_start();
        for collective in &mut collectives {
            let then = self.factors[collective.constraint][1][0];
            collective.enclosed.pressure = 0.0;
            let predicted = |node: u32| {
                let mut prediction = self.predicted(state, node);
                if at_start {
                    prediction.mobility =
                        0.5 * self.lengths.next.powi(2) / self.mass[node as usize][0].to_f64();
                }
                if prediction.held == [false; 3] {
                    return prediction;
                }
                if let Ok(at) = self.held.binary_search_by_key(&node, |held| held.node) {
                    for (c, constraint) in self.held[at].components() {
                        prediction.displacement[c] = self.held[at].place(c, self.factors[constraint][1]);
                    }
                }
                prediction
            };
            collective.find(&self.model, predicted, then);
            for (node, force) in collective.forces(&self.model) {
                self.applied.add(node, force);
            }
        }
        self.collectives = collectives;
        !self.collectives.is_empty()
    }

    /// Tasks over nodes that a thread takes at least: one where threads have just shared the cells, so that
    /// they are awake.
    fn least_chunks(&self) -> usize {
        if self.forces.is_shared() { 1 } else { LEAST_CHUNKS }
    }

    fn pass_over_nodes(&mut self, state: &State<R>) {
        let mut next = std::mem::take(&mut self.next);
        let mut reaction = std::mem::take(&mut self.reaction);
        let mut sums = std::mem::take(&mut self.sums);
        let mut internal = std::mem::take(&mut self.internal);
        let past = self.damps_by_forces().then(|| Past::of(&state.forces, self.damping_factors(state)));
        let (increment, pace) = (state.increment.par_chunks(CHUNK), Pace::new(self.lengths));
        let found = internal.par_chunks_mut(CHUNK).zip(&mut sums);
        (next.par_chunks_mut(CHUNK).zip(reaction.par_chunks_mut(CHUNK)).zip(increment).zip(found))
            .enumerate()
            .with_min_len(self.least_chunks())
            .for_each(|(task, (((next, reaction), before), (internal, sums)))| {
                let first = task * CHUNK;
                *sums = self.processor.run(NodePass {
                    first,
                    pace,
                    forces: &self.forces,
                    applied: &self.applied,
                    mass: &self.mass,
                    damping: &self.damping,
                    held: self.held_in(first..first + before.len()),
                    factors: &self.factors,
                    before,
                    next,
                    reaction,
                    past: past.map(|past| past.from(first)),
                    internal,
                });
            });
        (self.next, self.reaction, self.internal, self.sums) = (next, reaction, internal, sums);
    }

    fn check_state(&self, state: &State<R>, sums: &Sums, found: &Found) -> Result<(), StepError> {
        let finite = sums.is_finite();
        // An inverted cell comes first: its forces are meaningless, often not finite, so that it is the
        // cause.
        if let Some((solid, cell, determinant)) = found.inverted
            && (finite || determinant.is_finite())
        {
            return Err(StepError::inverted(&self.model, solid, cell, determinant, state.time));
        }
        if !finite {
            let lost = |u: &Vector<R>| u.iter().any(|x| !x.to_f64().is_finite());
            let node = (state.displacement.iter().position(lost)).or_else(|| self.next.iter().position(lost));
            return Err(StepError::not_finite(&self.model, node.unwrap_or(0) as u32, state.time));
        }
        if let Some(cell) = found.folded {
            return Err(StepError::folded(&self.model, cell, state));
        }
        Ok(())
    }

    fn settle_energies(
        &mut self,
        state: &mut State<R>,
        sums: &Sums,
        hourglass: f64,
    ) -> Result<(), StepError> {
        let before = (!state.is_at_start()).then_some(self.lengths.before);
        let again = std::mem::replace(&mut state.evaluated, true);
        let change = self.change_energy(state);
        self.energies = state.work.settle(sums, hourglass, change, before, self.balance_floor, again);
        if state.work.has_lost_balance() {
            let (fastest, balance) = (self.fastest_node(), self.energies.balance);
            return Err(StepError::unbalanced(&self.model, fastest, balance, state.time));
        }
        Ok(())
    }

    /// The energy [J] that a change of the step length adds at the instant.
    fn change_energy(&self, state: &State<R>) -> f64 {
        if self.lengths.next == self.lengths.before {
            return 0.0;
        }
        let per_step_squared = 1.0 / (self.lengths.next * self.lengths.mean());
        let nodes = self.mass.iter().zip(&state.increment).zip(&self.next);
        let error = nodes.map(|((mass, before), next)| {
            let square = |c: usize| {
                let change = next[c].to_f64() - before[c].to_f64() * self.lengths.ratio();
                (0.5 * self.lengths.before * change * per_step_squared).powi(2)
            };
            (0..3).map(|c| 0.5 * mass[c].to_f64() * square(c)).sum::<f64>()
        });
        self.lengths.change_energy(error.sum())
    }

    fn fastest_node(&self) -> u32 {
        let speed = |u: &Vector<R>| u.iter().map(|x| x.to_f64() * x.to_f64()).sum::<f64>();
        let fastest = self.next.iter().enumerate().max_by(|(_, a), (_, b)| speed(a).total_cmp(&speed(b)));
        fastest.map_or(0, |(node, _)| node as u32)
    }
}
