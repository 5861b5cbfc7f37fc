//! Contacts of a model in its equations: their forces are loads and their stiffness is added to that of the cells. The pattern of the matrix grows
//! with the pairs that may come near, and by more than those, so that it changes seldom. What pushes a tied node pushes those that it
//! follows.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::Vector3;
use pliant_contact::barrier::{BarrierSettings, Barriers, Matrix12, Meeting, NodeTouch};
use pliant_contact::lag::Lag;
use pliant_contact::pose::Leg;
use pliant_contact::touch::{Contact, Contacts, With};
use pliant_mechanics::Model;

use crate::error::SolveError;
use crate::followers::Followers;
use crate::sparse::{Equations, LowerMatrix};
use crate::state::State;

/// Pairs of nodes kept in the pattern at most, over those that are needed.
const ROOM: usize = 2;
/// How near pairs are, beyond the reach of their barrier and over its distance, that are taken into the pattern when it lacks some.
const SOON: f64 = 0.3;

/// Contacts by a barrier: surfaces never go into each other. Rigid things move as their courses say.
#[derive(Clone, Debug)]
pub struct Touching {
    /// Who touches whom.
    pub contacts: Arc<Contacts>,
    /// How each contact acts.
    pub settings: Vec<BarrierSettings>,
    /// Whether each state that is accepted is searched for edges that go through triangles, which would be an error of the program.
    pub check_crossings: bool,
}

impl Touching {
    /// The contacts at work, with nodes at rest where those of a model are.
    pub fn barriers(&self, model: &Model) -> Barriers {
        Barriers::new(Arc::clone(&self.contacts), &self.settings, &model.rest)
    }

    /// Whatever has no gap at a state: a run can't start there.
    pub fn meetings(&self, model: &Model, state: &State) -> Vec<Meeting> {
        self.barriers(model).meetings(&state.position, state.time)
    }
}

/// What contacts do at an instant.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TouchingNow {
    /// Forces on nodes [N], six numbers a node.
    pub forces: Vec<f64>,
    /// Force [N] of each contact on the second of the two that touch.
    pub totals: Vec<[f64; 3]>,
    /// Energy of the barriers [J].
    pub energy: f64,
    /// The least gap [m], where something touches.
    pub gap: Option<f64>,
    /// Nodes that touch something, increasing.
    pub nodes: Vec<NodeTouch>,
}

/// Contacts in the equations of a solver.
pub struct TouchingSystem {
    pub(crate) barriers: Barriers,
    /// How far rigid things have gone in the step, from 0 to 1.
    pub(crate) share: f64,
    /// Forces on nodes, six a node, and on the second side of each contact.
    forces: Vec<f64>,
    /// Those forces where the unknowns are: on the nodes that tied ones follow.
    pub(crate) given: Vec<f64>,
    totals: Vec<Vector3<f64>>,
    /// Of barriers and friction [J]; infinite where there is no gap.
    pub(crate) energy: f64,
    /// Nodes that touch something at the end of the last step, increasing.
    touches: Vec<NodeTouch>,
    /// How far tools whose force is limited are behind their trajectories.
    lags: Vec<Lag>,
    /// Pairs of nodes in the pattern beside those of cells, increasing.
    pub(crate) pairs: Vec<[u32; 2]>,
    pub(crate) check_crossings: bool,
    /// Step of unknowns [m] below which a step is found: it changes gaps by less than counts.
    pub(crate) close: f64,
}

/// A change of unknowns that counts for nothing, over the distance of the barrier.
const CLOSE: f64 = 1e-3;

impl TouchingSystem {
    pub(crate) fn new(touching: &Touching, model: &Model) -> Self {
        let nearest =
            touching.settings.iter().map(|settings| settings.distance).fold(f64::INFINITY, f64::min);
        let rigids = touching.contacts.rigids.iter().zip(0..);
        let limited = rigids.filter(|(rigid, _)| rigid.trajectory.limit().is_some());
        Self {
            lags: limited.map(|(_, number)| Lag::new(number)).collect(),
            barriers: touching.barriers(model),
            share: 1.0,
            forces: vec![0.0; 6 * model.rest.len()],
            given: vec![0.0; 6 * model.rest.len()],
            totals: vec![Vector3::zeros(); touching.settings.len()],
            energy: 0.0,
            touches: Vec::new(),
            pairs: Vec::new(),
            check_crossings: touching.check_crossings,
            close: CLOSE * nearest,
        }
    }

    /// Finds forces and energy at a state.
    pub(crate) fn evaluate(&mut self, state: &State, followers: Option<&Followers>) {
        self.energy = self.barriers.evaluate(&state.position, self.share);
        self.forces.fill(0.0);
        if self.energy.is_finite() {
            self.barriers.add_forces(&mut self.forces, &mut self.totals);
        }
        self.given.copy_from_slice(&self.forces);
        if let Some(followers) = followers {
            followers.give_back(&mut self.given);
        }
    }

    /// What acts at the state last evaluated.
    pub fn now(&self) -> TouchingNow {
        TouchingNow {
            forces: self.forces.clone(),
            totals: self.totals.iter().map(|&total| total.into()).collect(),
            energy: self.barriers.barrier_energy(),
            gap: self.barriers.least_gap(),
            nodes: self.touches.clone(),
        }
    }

    /// [`now`](Self::now) at a state that no step led to: without friction.
    pub fn at(&mut self, state: &State) -> TouchingNow {
        let still = vec![0.0; self.forces.len()];
        let shifts = self.lags.iter().map(|lag| (lag.rigid() as u32, [lag.now(); 2]));
        *self.barriers.shifts_mut() = shifts.collect();
        self.barriers.begin(&state.position, &still, [state.time; 2]);
        self.share = 1.0;
        self.evaluate(state, None);
        self.touches = self.barriers.touches(&self.touches);
        self.now()
    }

    /// Ends a step at the state last evaluated, a time [s]: nodes have slid in it, and tools are where they lag.
    pub(crate) fn end_step(&mut self, time: f64) {
        self.touches = self.barriers.touches(&self.touches);
        self.lags.iter_mut().for_each(|lag| lag.advance(time));
    }

    /// Goes on where another one stood: with nodes that touch something, increasing, and the lags of tools.
    pub fn go_on_from(&mut self, touches: Vec<NodeTouch>, lags: Vec<Lag>) {
        (self.touches, self.lags) = (touches, lags);
    }

    /// The contacts at the state last evaluated.
    pub fn barriers(&self) -> &Barriers {
        &self.barriers
    }

    /// How far tools whose force is limited are behind their trajectories.
    pub fn lags(&self) -> &[Lag] {
        &self.lags
    }

    /// The force [N] that the tool of a lag pushes with at most.
    pub(crate) fn limit(&self, lag: &Lag) -> f64 {
        self.barriers.contacts().rigids[lag.rigid()].trajectory.limit().unwrap_or(f64::INFINITY)
    }

    /// Finds where tools whose force is limited go between two times [s]: each a part of its way along a force [N]; how long [m] the whole of
    /// that is.
    pub(crate) fn follow<'a>(
        &mut self,
        [from, to]: [f64; 2],
        parts: impl Iterator<Item = (Vector3<f64>, f64, &'a mut f64)>,
    ) {
        let mut lags = std::mem::take(&mut self.lags);
        self.barriers.shifts_mut().clear();
        for (lag, (ahead, part, into)) in lags.iter_mut().zip(parts) {
            let number = lag.rigid() as u32;
            let leg = self.barriers.legs().get(&number);
            let rigid = &self.barriers.contacts().rigids[lag.rigid()];
            let place = |time| rigid.posture(time, leg).0.translation.vector;
            *into = lag.go(ahead, part, place(to) - place(from), to - from);
            self.barriers.shifts_mut().push((number, [lag.now(), lag.next()]));
        }
        self.lags = lags;
    }

    /// Gives each lag the force [N] with which its tool pushes at the state last evaluated; these forces.
    pub(crate) fn bear_on(&mut self) -> Vec<Vector3<f64>> {
        let Contacts { rigids, contacts, .. } = self.barriers.contacts();
        let force = |lag: &mut Lag| {
            let tool = rigids[lag.rigid()].tool();
            let on = |(contact, force): (&Contact, &Vector3<f64>)| {
                let of_tool = matches!(contact.with, With::Rigid(rigid) if rigids[rigid].tool() == tool);
                of_tool.then_some(*force)
            };
            let force = -contacts.iter().zip(&self.totals).filter_map(on).sum::<Vector3<f64>>();
            lag.found(force);
            force
        };
        self.lags.iter_mut().map(force).collect()
    }

    /// Where rigid things go that are driven from outside, by their number.
    pub fn legs(&self) -> &BTreeMap<u32, Leg> {
        self.barriers.legs()
    }

    /// The same to change.
    pub fn legs_mut(&mut self) -> &mut BTreeMap<u32, Leg> {
        self.barriers.legs_mut()
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
        let mut lacks = false;
        self.barriers.acting(|nodes| {
            each_pair(nodes, followers, |pair| lacks = lacks || !matrix.couples(equations, pair));
        });
        if !lacks {
            return false;
        }
        let mut needed = Vec::new();
        self.barriers.acting(|nodes| each_pair(nodes, followers, |pair| needed.push(pair)));
        self.barriers.near(SOON, |nodes| each_pair(nodes, followers, |pair| needed.push(pair)));
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

    /// Adds the stiffness to a matrix, and what the ways of rigid things yet to come make of it to the coupling.
    pub(crate) fn add_stiffness(
        &self,
        equations: &Equations,
        matrix: &mut LowerMatrix,
        followers: Option<&Followers>,
        moved: &[f64],
        coupling: &mut [f64],
    ) {
        let nodes = self.barriers.node_count();
        // Nodes that move those of a row: their number, its place in the row, and their weight.
        let mut movers: Vec<(u32, usize, f64)> = Vec::new();
        self.barriers.stiffness(self.share, |stencil, block, mut ways| {
            let own = |at: usize| stencil.nodes[at] as usize;
            let count = usize::from(stencil.count);
            movers.clear();
            for at in (0..count).filter(|&at| own(at) < nodes && acts(block, at)) {
                movers_of(stencil.nodes[at], followers, |node, weight| movers.push((node, at, weight)));
            }
            for &(row_node, row, w) in &movers {
                for &(column_node, column, v) in &movers {
                    if row_node >= column_node {
                        let entry = |i, j| w * v * block[(3 * row + i, 3 * column + j)];
                        matrix.add_node_block(equations, [row_node, column_node], entry);
                    }
                }
            }
            // The way that nodes which are moved have yet to go counts as that of rigid things.
            for (at, way) in ways.iter_mut().enumerate().take(count).filter(|(at, _)| own(*at) < nodes) {
                *way += Vector3::from_column_slice(&moved[6 * own(at)..6 * own(at) + 3]);
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
                    if let Some(own) = coupling.get_mut(equation as usize) {
                        *own += weight * pull[i];
                    }
                }
            }
        });
    }

    /// The least gap, if edges go through triangles at the state last evaluated.
    pub(crate) fn check(&self, time: f64) -> Result<(), SolveError> {
        if !self.check_crossings {
            return Ok(());
        }
        let (mut count, mut first) = (0, None);
        self.barriers.crossings(|contact, ends, corners| {
            count += 1;
            first.get_or_insert((contact, ends, corners));
        });
        match first {
            Some((contact, edge, triangle)) => {
                Err(SolveError::Crossed { time, count, contact, edge, triangle })
            }
            None => Ok(()),
        }
    }
}

/// Calls back with each pair of the nodes that move these, the lower number first.
fn each_pair(nodes: &[u32], followers: Option<&Followers>, mut found: impl FnMut([u32; 2])) {
    for (at, &a) in nodes.iter().enumerate() {
        for &b in &nodes[..at] {
            movers_of(a, followers, |a, _| {
                movers_of(b, followers, |b, _| {
                    if a != b {
                        found([a.min(b), a.max(b)]);
                    }
                });
            });
        }
    }
}

/// Calls back with the nodes that move a node, and their weights: itself, or those that it is tied to.
fn movers_of(node: u32, followers: Option<&Followers>, mut found: impl FnMut(u32, f64)) {
    match followers.filter(|followers| followers.follows(node)) {
        None => found(node, 1.0),
        Some(followers) => followers.weights(node).for_each(|(node, weight)| found(node, weight)),
    }
}

/// Whether the part of a node in a stiffness that is never negative is not zero.
fn acts(block: &Matrix12, at: usize) -> bool {
    (3 * at..3 * at + 3).any(|k| block[(k, k)] != 0.0)
}
