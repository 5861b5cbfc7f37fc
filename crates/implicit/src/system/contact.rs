//! Contacts of a model in its equations. Their forces are loads, and their stiffness is added to the
//! stiffness of the cells. The pattern of the matrix grows with the pairs that may come near, and by more
//! than those, so that it changes seldom. Forces on a tied node act on the nodes that it follows. Forces on a
//! point of the curved surface of a shell act on the nodes that move the point.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use nalgebra::Vector3;
use pliant_contact::barrier::{BarrierStep, Barriers, Meeting, NodeTouch};
use pliant_contact::lag::Lag;
use pliant_contact::pose::Leg;
use pliant_contact::touch::{Contact, Contacts, Rigid, With};
use pliant_linear::sparse::{Equations, LowerMatrix};

use crate::model::assembly::Assembly;
use crate::model::contact::ContactModel;
use crate::model::error::SolveError;
use crate::model::state::AssemblyState;
use crate::system::followers::Followers;
use crate::system::samples::{Movers, Samples, acts, movers_of};

/// Pairs of nodes kept in the pattern at most, over those that are needed.
const ROOM: usize = 2;
/// Number of times that an increment is shortened because points of curved surfaces collide on their way.
const SHORTENED: usize = 60;
/// Part of the collision-free fraction that is tried next.
const SHORTER: f64 = 0.9;
/// Distance of pairs that enter the pattern when it lacks some, beyond the reach of their barrier and
/// relative to its distance.
const SOON: f64 = 0.3;

/// Makes the contacts at work, with nodes at their rest positions in the model, and the points of contacts
/// that are no nodes.
fn made(contact: &ContactModel, model: &Assembly) -> (Barriers, Option<Samples>) {
    match Samples::of(model, &contact.contacts, &contact.levels) {
        None => (Barriers::new(Arc::clone(&contact.contacts), &contact.settings, &model.rest), None),
        Some((samples, contacts)) => {
            let rest: Vec<[f64; 3]> = samples.places.iter().map(|&place| place.into()).collect();
            (Barriers::new(Arc::new(contacts), &contact.settings, &rest), Some(samples))
        }
    }
}

/// Number of pairs of each contact that never touch, because they are in one place at rest.
pub fn apart_counts(contact: &ContactModel, model: &Assembly) -> Vec<usize> {
    made(contact, model).0.apart_counts()
}

/// Whatever has no gap at a state: a run can't start there.
pub fn meetings(contact: &ContactModel, model: &Assembly, state: &AssemblyState) -> Vec<Meeting> {
    let (barriers, samples) = made(contact, model);
    let Some(mut samples) = samples else { return barriers.meetings(&state.position, state.time) };
    samples.place(model, state);
    let met = barriers.meetings(&samples.places, state.time);
    met.into_iter().map(|one| Meeting { node: samples.node_at(model, one.node), ..one }).collect()
}

/// State of contacts at an instant.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContactNow {
    /// Forces on nodes [N], six numbers a node.
    pub forces: Vec<f64>,
    /// Force [N] of each contact on the second of the two that touch.
    pub totals: Vec<[f64; 3]>,
    /// Their moments about the origin [N m].
    pub moments: Vec<[f64; 3]>,
    /// Energy of the barriers [J].
    pub energy: f64,
    /// The least gap [m], where something touches.
    pub gap: Option<f64>,
    /// Nodes that touch something, increasing.
    pub nodes: Vec<NodeTouch>,
}

/// Contacts in the equations of a solver.
pub struct ContactSystem {
    model: Arc<Assembly>,
    /// The step of the barriers.
    pub(crate) step: BarrierStep,
    /// Points of contacts that are no nodes, and forces on nodes and them, six each; `None` where surfaces
    /// are flat.
    samples: Option<(Samples, Vec<f64>)>,
    /// Fraction of their way in the step that rigid things have gone, from 0 to 1.
    pub(crate) time_fraction: f64,
    /// Time spent so far.
    pub(crate) spent: Duration,
    /// Forces on nodes, six a node, and on the second side of each contact.
    forces: Vec<f64>,
    /// Contact forces at the unknowns: on the nodes that tied ones follow.
    pub(crate) given: Vec<f64>,
    totals: Vec<Vector3<f64>>,
    moments: Vec<Vector3<f64>>,
    /// Energy of barriers and friction [J]; infinite where there is no gap.
    pub(crate) energy: f64,
    /// Nodes that touch something at the end of the last step, increasing.
    touches: Vec<NodeTouch>,
    /// Lags of tools whose force is limited behind their trajectories.
    lags: Vec<Lag>,
    /// Pairs of nodes in the pattern besides the pairs of cells, increasing.
    pub(crate) pairs: Vec<[u32; 2]>,
    pub(crate) check_intersections: bool,
    /// Step of unknowns [m] below which a step is found: it changes gaps by less than counts.
    pub(crate) close: f64,
}

/// A change of unknowns that counts for nothing, over the distance of the barrier.
const CLOSE: f64 = 1e-3;

impl ContactSystem {
    pub(crate) fn new(contact: &ContactModel, model: &Arc<Assembly>) -> Self {
        let nearest = contact.settings.iter().map(|settings| settings.distance).fold(f64::INFINITY, f64::min);
        let rigids = contact.contacts.rigids.iter().zip(0..);
        let limited = rigids.filter(|(rigid, _)| rigid.trajectory.limit().is_some());
        let (barriers, samples) = made(contact, model);
        let places = match &samples {
            Some(samples) => samples.places.clone(),
            None => model.rest.iter().map(|&place| place.into()).collect(),
        };
        // A step of no length at rest, because a step needs a state.
        let step = barriers.begin(&places, &vec![0.0; 6 * places.len()], [0.0; 2]);
        let samples = samples.map(|samples| {
            let forces = vec![0.0; 6 * samples.places.len()];
            (samples, forces)
        });
        Self {
            model: Arc::clone(model),
            samples,
            lags: limited.map(|(_, number)| Lag::new(number)).collect(),
            step,
            time_fraction: 1.0,
            spent: Duration::ZERO,
            forces: vec![0.0; 6 * model.rest.len()],
            given: vec![0.0; 6 * model.rest.len()],
            totals: vec![Vector3::zeros(); contact.settings.len()],
            moments: vec![Vector3::zeros(); contact.settings.len()],
            energy: 0.0,
            touches: Vec::new(),
            pairs: Vec::new(),
            check_intersections: contact.check_intersections,
            close: CLOSE * nearest,
        }
    }

    /// Begins a step between two times [s] at a state, expected to go by a motion, six numbers a node.
    /// Friction is taken from the start.
    pub(crate) fn begin(&mut self, state: &AssemblyState, motion: &[f64], times: [f64; 2]) {
        let begun = Instant::now();
        match &mut self.samples {
            None => self.step.begin_next(&state.position, motion, times),
            Some((samples, _)) => {
                samples.place(&self.model, state);
                samples.move_along(&self.model, state, motion, 1.0);
                self.step.begin_next(&samples.places, &samples.motion, times);
            }
        }
        self.time_fraction = 0.0;
        self.spent += begun.elapsed();
    }

    /// The largest fraction of an increment (six numbers a node), at most `most`, that keeps at least
    /// `keep`/2 of every gap. Points of curved surfaces move to their ends on straight lines. If these lines
    /// are free of collisions, nothing has gone through anything.
    pub(crate) fn collision_free_fraction(
        &mut self,
        state: &AssemblyState,
        increment: &[f64],
        keep_and_most: [f64; 2],
    ) -> f64 {
        let begun = Instant::now();
        let part = self.free_part(state, increment, keep_and_most);
        self.spent += begun.elapsed();
        part
    }

    fn free_part(&mut self, state: &AssemblyState, increment: &[f64], [keep, most]: [f64; 2]) -> f64 {
        let Some((samples, _)) = &mut self.samples else {
            return self.step.collision_free_fraction(
                &state.position,
                increment,
                self.time_fraction,
                [keep, most],
            );
        };
        samples.place(&self.model, state);
        let mut part = most;
        for _ in 0..SHORTENED {
            if part == 0.0 {
                break;
            }
            samples.move_along(&self.model, state, increment, part);
            let free = self.step.collision_free_fraction(
                &samples.places,
                &samples.motion,
                self.time_fraction,
                [keep, part],
            );
            if free >= part {
                return part;
            }
            part = (SHORTER * free).max(0.5 * part);
        }
        0.0
    }

    /// True if points move on other paths than nodes. A fraction of an increment that is free then says
    /// nothing about smaller fractions.
    pub(crate) fn is_curved(&self) -> bool {
        self.samples.is_some()
    }

    /// Finds forces and energy at a state.
    pub(crate) fn evaluate(&mut self, state: &AssemblyState, followers: Option<&Followers>) {
        let begun = Instant::now();
        self.forces.fill(0.0);
        match &mut self.samples {
            None => {
                self.energy = self.step.evaluate(&state.position, self.time_fraction);
                if self.energy.is_finite() {
                    self.step.add_forces(&mut self.forces, &mut self.totals);
                    self.step.find_moments(&mut self.moments);
                }
            }
            Some((samples, point_forces)) => {
                samples.place(&self.model, state);
                self.energy = self.step.evaluate(&samples.places, self.time_fraction);
                point_forces.fill(0.0);
                if self.energy.is_finite() {
                    self.step.add_forces(point_forces, &mut self.totals);
                    self.step.find_moments(&mut self.moments);
                }
                samples.give_back(&self.model, point_forces, &mut self.forces);
            }
        }
        self.given.copy_from_slice(&self.forces);
        if let Some(followers) = followers {
            followers.give_back(&mut self.given);
        }
        self.spent += begun.elapsed();
    }

    /// State of the contacts at the state last evaluated.
    pub fn now(&self) -> ContactNow {
        ContactNow {
            forces: self.forces.clone(),
            totals: self.totals.iter().map(|&total| total.into()).collect(),
            moments: self.moments.iter().map(|&moment| moment.into()).collect(),
            energy: self.step.barrier_energy(),
            gap: self.step.least_gap(),
            nodes: self.touches.clone(),
        }
    }

    /// [`now`](Self::now) at a state that no step led to: without friction.
    pub fn at(&mut self, state: &AssemblyState) -> ContactNow {
        self.stand(state);
        self.evaluate(state, None);
        self.touches = self.touched();
        self.now()
    }

    /// Evaluates a state by itself from now on, without friction.
    pub(crate) fn stand(&mut self, state: &AssemblyState) {
        let still = vec![0.0; self.forces.len()];
        let shifts = self.lags.iter().map(|lag| (lag.number() as u32, [lag.now(); 2]));
        *self.step.shifts_mut() = shifts.collect();
        self.begin(state, &still, [state.time; 2]);
        self.step.drop_friction();
        self.time_fraction = 1.0;
    }

    /// Ends a step at the state last evaluated, a time [s]: nodes have slid in it, and tools are where they
    /// lag.
    pub(crate) fn end_step(&mut self, time: f64) {
        self.touches = self.touched();
        self.lags.iter_mut().for_each(|lag| lag.advance(time));
    }

    /// Nodes that touch something at the state last evaluated; what touches between them is shared out.
    fn touched(&self) -> Vec<NodeTouch> {
        let share = |number: u32, found: &mut dyn FnMut(u32, f64)| match &self.samples {
            Some((samples, _)) => samples.shares(&self.model, number, found),
            None => found(number, 1.0),
        };
        self.step.touches(&self.touches, share)
    }

    /// Continues from another solver, with nodes that touch something, increasing, and the lags of tools.
    pub fn go_on_from(&mut self, touches: Vec<NodeTouch>, lags: Vec<Lag>) {
        (self.touches, self.lags) = (touches, lags);
    }

    /// The step of the contacts, at the state last evaluated.
    pub fn step(&self) -> &BarrierStep {
        &self.step
    }

    /// Lags of tools whose force is limited behind their trajectories.
    pub fn lags(&self) -> &[Lag] {
        &self.lags
    }

    /// The force [N] that the tool of a lag pushes with at most.
    pub(crate) fn limit(&self, lag: &Lag) -> f64 {
        self.step.contacts().rigids[lag.number()].trajectory.limit().unwrap_or(f64::INFINITY)
    }

    /// Finds the motion of tools whose force is limited between two times [s]. Each tool goes a part of its
    /// way along a force [N]. Sets the length [m] of the whole way along it.
    pub(crate) fn follow<'a>(
        &mut self,
        [from, to]: [f64; 2],
        parts: impl Iterator<Item = (Vector3<f64>, f64, &'a mut f64)>,
    ) {
        let mut lags = std::mem::take(&mut self.lags);
        self.step.shifts_mut().clear();
        for (lag, (ahead, part, into)) in lags.iter_mut().zip(parts) {
            let number = lag.number() as u32;
            let leg = self.step.legs().get(&number);
            let rigid = &self.step.contacts().rigids[lag.number()];
            let place = |time| rigid.posture(time, leg).0.translation.vector;
            *into = lag.go(ahead, part, place(to) - place(from), to - from);
            self.step.shifts_mut().push((number, [lag.now(), lag.next()]));
        }
        self.lags = lags;
    }

    /// Gives each lag the force [N] with which its tool pushes at the state last evaluated; these forces.
    pub(crate) fn bear_on(&mut self) -> Vec<Vector3<f64>> {
        let rigids = &self.step.contacts().rigids;
        let forces: Vec<_> = self.lags.iter().map(|lag| self.push(rigids[lag.number()].tool())).collect();
        self.lags.iter_mut().zip(&forces).for_each(|(lag, force)| lag.found(*force));
        forces
    }

    /// The force [N] with which a tool pushes at the state last evaluated.
    fn push(&self, tool: &str) -> Vector3<f64> {
        let Contacts { rigids, contacts, .. } = self.step.contacts();
        let on = |(contact, force): (&Contact, &Vector3<f64>)| {
            let of_tool = matches!(contact.with, With::Rigid(rigid) if rigids[rigid].tool() == tool);
            of_tool.then_some(*force)
        };
        -contacts.iter().zip(&self.totals).filter_map(on).sum::<Vector3<f64>>()
    }

    /// Tools and obstacles that move between two times [s], with the size of the force [N] with which they
    /// push at the state last evaluated.
    pub(crate) fn pushing(&self, [from, to]: [f64; 2]) -> impl Iterator<Item = (String, f64)> {
        let moves = move |(rigid, number): (&Rigid, u32)| {
            let leg = self.step.legs().get(&number);
            let goes = rigid.stance(from, leg) != rigid.stance(to, leg);
            goes.then(|| (rigid.tool().to_owned(), self.push(rigid.tool()).norm()))
        };
        self.step.contacts().rigids.iter().zip(0..).filter_map(moves)
    }

    /// Motions of rigid things that are driven from outside, by their number.
    pub fn legs(&self) -> &BTreeMap<u32, Leg> {
        self.step.legs()
    }

    /// Mutable motions of rigid things that are driven from outside.
    pub fn legs_mut(&mut self) -> &mut BTreeMap<u32, Leg> {
        self.step.legs_mut()
    }

    /// Pairs of nodes that contacts added to the pattern of the equations, increasing.
    pub fn pairs(&self) -> &[[u32; 2]] {
        &self.pairs
    }

    /// Takes up the pairs of nodes that may act soon if the pattern lacks one that acts; whether it does.
    pub(crate) fn grow(
        &mut self,
        equations: &Equations,
        matrix: &LowerMatrix,
        followers: Option<&Followers>,
    ) -> bool {
        let begun = Instant::now();
        let grows = self.takes_more(equations, matrix, followers);
        self.spent += begun.elapsed();
        grows
    }

    fn takes_more(
        &mut self,
        equations: &Equations,
        matrix: &LowerMatrix,
        followers: Option<&Followers>,
    ) -> bool {
        let mut lacks = false;
        let movers = Movers {
            model: &self.model,
            followers,
            samples: self.samples.as_ref().map(|sampled| &sampled.0),
        };
        self.step.acting(|nodes| {
            movers.each_pair(nodes, |pair| lacks = lacks || !matrix.couples(equations, pair));
        });
        if !lacks {
            return false;
        }
        let mut needed = Vec::new();
        self.step.acting(|nodes| movers.each_pair(nodes, |pair| needed.push(pair)));
        self.step.near(SOON, |nodes| movers.each_pair(nodes, |pair| needed.push(pair)));
        needed.sort_unstable();
        needed.dedup();
        if self.pairs.len() > ROOM * needed.len() {
            self.pairs = needed;
        } else {
            self.pairs.extend(needed);
            self.pairs.sort_unstable();
            self.pairs.dedup();
        }
        true
    }

    /// Adds the stiffness to a matrix, and what the ways of rigid things yet to come make of it to the
    /// coupling.
    pub(crate) fn add_stiffness(
        &self,
        equations: &Equations,
        matrix: &mut LowerMatrix,
        followers: Option<&Followers>,
        moved: &[f64],
        coupling: &mut [f64],
    ) {
        if let Some((samples, _)) = &self.samples {
            let movers = Movers { model: &self.model, followers, samples: Some(samples) };
            return movers.add_stiffness(&self.step, equations, matrix, moved, coupling);
        }
        let nodes = self.step.node_count();
        // Nodes that move a collision's nodes: their number, place in the stencil, and weight.
        let mut movers: Vec<(u32, usize, f64)> = Vec::new();
        self.step.stiffness(|stencil, block, mut ways| {
            let node_at = |at: usize| stencil.nodes[at] as usize;
            let count = usize::from(stencil.count);
            movers.clear();
            for at in (0..count).filter(|&at| node_at(at) < nodes && acts(block, at)) {
                movers_of(stencil.nodes[at], followers, |node, weight| movers.push((node, at, weight)));
            }
            for &(row_node, row, w) in &movers {
                for &(column_node, column, v) in &movers {
                    if row_node >= column_node {
                        let entry = |i, j| w * v * block[(3 * row + i, 3 * column + j)];
                        matrix.add_node_block(equations, [row_node, column_node], 3, entry);
                    }
                }
            }
            // The rest of the way of prescribed nodes counts like the way of rigid things.
            for (at, way) in ways.iter_mut().enumerate().take(count).filter(|(at, _)| node_at(*at) < nodes) {
                *way += Vector3::from_column_slice(&moved[6 * node_at(at)..6 * node_at(at) + 3]);
            }
            if ways == [Vector3::zeros(); 4] {
                return;
            }
            for &(node, row, weight) in &movers {
                let pull: Vector3<f64> = (0..count)
                    .map(|column| block.fixed_view::<3, 3>(3 * row, 3 * column) * ways[column])
                    .sum();
                for i in 0..3 {
                    let equation = equations.number[6 * node as usize + i];
                    if let Some(entry) = coupling.get_mut(equation as usize) {
                        *entry += weight * pull[i];
                    }
                }
            }
        });
    }

    /// The least gap, if edges go through triangles at the state last evaluated.
    pub(crate) fn check(&self, time: f64) -> Result<(), SolveError> {
        if !self.check_intersections {
            return Ok(());
        }
        let (mut count, mut first) = (0, None);
        self.step.intersections(|contact, ends, corners| {
            count += 1;
            let node = |number: u32| match &self.samples {
                Some((samples, _)) => samples.node_at(&self.model, number),
                None => number,
            };
            first.get_or_insert_with(|| (contact, ends.map(node), corners.map(node)));
        });
        match first {
            Some((contact, edge, triangle)) => {
                Err(SolveError::Crossed { time, count, contact, edge, triangle })
            }
            None => Ok(()),
        }
    }
}
