//! A step in contact: collisions at a state, their energy and forces, and friction over the step.
//!
//! A step goes from one time to another. Its *time fraction*, from 0 to 1, is the part of their ways that
//! rigid things have gone in the step. These ways are straight, with the shortest arcs between poses and
//! growth in proportion. Friction of a step uses the directions and normal forces of the state where
//! [`BarrierStep::lag`] was called last.
//!
//! Types fix the order of calls. Only [`Barriers::begin`] makes a step, and it evaluates the start.
//! Collisions are therefore always available, and belong to the state last evaluated: a search for a
//! [fraction](BarrierStep::collision_free_fraction) leaves them unchanged.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use super::collisions::{FrictionCollision, NormalCollision, Stencil};
use super::configuration::Configuration;
use super::intersections::intersections;
use super::law::Slip;
use super::system::{Barriers, Meeting};
use crate::pose::{Leg, Stance};
use crate::touch::Contacts;

/// A step of the contacts of a model, and then the next one.
#[derive(Clone, Debug)]
pub struct BarrierStep {
    pub(super) barriers: Barriers,
    /// Rigid things at the start and the end of the step.
    pub(super) ends: [Vec<Stance>; 2],
    /// Places [m] of all nodes at the start of the step.
    start: Vec<Vector3<f64>>,
    /// The state last evaluated, and how far rigid things have gone there.
    pub(super) now: Configuration,
    pub(super) time_fraction: f64,
    /// State from which the search for a fraction starts.
    pub(super) tried: Configuration,
    pub(super) normal_collisions: Vec<NormalCollision>,
    pub(super) friction_collisions: Vec<FrictionCollision>,
    /// Energies of barriers and of friction [J].
    energy: [f64; 2],
    /// True if the same state need not be evaluated again. False after a search elsewhere, since lists set
    /// the order of sums.
    pub(super) is_current: bool,
}

impl Barriers {
    /// Begins the first step, as [`BarrierStep::begin_next`] does the others.
    pub fn begin(self, position: &[Vector3<f64>], motion: &[f64], times: [f64; 2]) -> BarrierStep {
        BarrierStep::first(self, position, motion, times)
    }

    /// Whatever has no gap at places [m] and a time [s]: pairs within the distance to keep, nodes in walls,
    /// and edges through triangles. With no regard to what came before.
    pub fn meetings(self, position: &[Vector3<f64>], time: f64) -> Vec<Meeting> {
        let none = vec![0.0; 6 * self.nodes];
        let step = self.begin(position, &none, [time; 2]);
        let Self { groups, nodes, wall_distances, .. } = &step.barriers;
        let mut meetings = Vec::new();
        let of = |contact: u32, at: &[u32], gap: Option<f64>| {
            let node = at.iter().copied().find(|node| (*node as usize) < *nodes)?;
            Some(Meeting { contact, node, place: position[node as usize].into(), gap })
        };
        for (group, distances) in groups.iter().zip(wall_distances) {
            group.too_close(&step.now.place, |at, gap| meetings.extend(of(group.number, &at, Some(gap))));
            if group.wall.is_some() {
                let distances = group.sides[0].points.iter().zip(distances);
                let gaps = distances.map(|(&node, distance)| (node, distance - group.parameters.kept));
                meetings.extend(
                    gaps.filter(|(_, gap)| *gap <= 0.0)
                        .filter_map(|(node, gap)| of(group.number, &[node], Some(gap))),
                );
            }
        }
        step.intersections(|contact, ends, corners| {
            meetings.extend(of(contact, &[ends[0], corners[0]], None))
        });
        meetings
    }
}

impl BarrierStep {
    /// The first step of contacts.
    pub(super) fn first(
        barriers: Barriers,
        position: &[Vector3<f64>],
        motion: &[f64],
        times: [f64; 2],
    ) -> Self {
        let now = barriers.listed.clone();
        let mut step = Self {
            ends: [now.stances.clone(), now.stances.clone()],
            start: now.place.clone(),
            tried: now.clone(),
            now,
            time_fraction: 0.0,
            normal_collisions: Vec::new(),
            friction_collisions: Vec::new(),
            energy: [0.0; 2],
            is_current: false,
            barriers,
        };
        step.begin_next(position, motion, times);
        step
    }

    /// Begins the next step between two times [s], with nodes at places [m], expected to go by a motion (six
    /// numbers a node, translations first). Friction is taken from the start.
    pub fn begin_next(&mut self, position: &[Vector3<f64>], motion: &[f64], times: [f64; 2]) {
        let Self { barriers, ends, .. } = self;
        for (stances, time) in ends.iter_mut().zip(times) {
            for ((stance, rigid), number) in stances.iter_mut().zip(&barriers.contacts.rigids).zip(0..) {
                *stance = rigid.stance(time, barriers.legs.get(&number));
            }
        }
        for (number, shifts) in &barriers.shifts {
            for (stances, shift) in ends.iter_mut().zip(shifts) {
                stances[*number as usize].pose.translation.vector += shift;
            }
        }
        let [from, to] = times;
        for group in &mut barriers.groups {
            let parameters = &mut group.parameters;
            parameters.slip = Slip { creep: parameters.creep_speed * (to - from) };
        }
        self.friction_collisions.clear();
        self.is_current = false;
        self.put(position, 0.0);
        self.start.copy_from_slice(&self.now.place);
        self.barriers.set_motion(&self.now, motion, 1.0, &self.ends, 1.0);
        self.barriers.list(&self.now);
        self.find_collisions();
        self.lag();
    }

    /// Drops friction until the next step begins: a state by itself has none.
    pub fn drop_friction(&mut self) {
        self.friction_collisions.clear();
    }

    /// Puts nodes at places [m], and rigid things where they are at a fraction of the step.
    fn put(&mut self, position: &[Vector3<f64>], time_fraction: f64) {
        let Self { barriers, ends, now, .. } = self;
        self.time_fraction = time_fraction;
        self.is_current &= now.move_things(ends, time_fraction) & (now.place[..barriers.nodes] == *position);
        if !self.is_current {
            now.place_nodes(position, &barriers.rigid_nodes);
            barriers.grow(&now.stances);
        }
    }

    /// Finds the collisions, if they are not known; infinite energy if there is no gap somewhere.
    fn find_collisions(&mut self) {
        if std::mem::replace(&mut self.is_current, true) {
            return;
        }
        self.normal_collisions.clear();
        let apart = self.barriers.find_collisions(&self.now, &mut self.normal_collisions);
        let energy: f64 = self.normal_collisions.iter().map(|collision| collision.energy).sum();
        self.energy[0] = if apart { energy } else { f64::INFINITY };
    }

    /// Takes friction from the state last evaluated on.
    pub fn lag(&mut self) {
        let Self { barriers, normal_collisions, friction_collisions, start, .. } = self;
        friction_collisions.clear();
        for collision in normal_collisions.iter() {
            let group = &barriers.groups[collision.stencil.contact as usize];
            let (normal, force) = collision.pushes();
            let limit = group.parameters.friction * force;
            if limit <= 0.0 {
                continue;
            }
            friction_collisions.push(FrictionCollision {
                stencil: collision.stencil,
                normal,
                limit,
                start: collision.stencil.combine(|node| start[node as usize]),
                wall: group.wall_of(&collision.stencil),
                slip: Vector3::zeros(),
                stiffness: 0.0,
                along: 0.0,
            });
        }
        self.slide();
    }

    /// Σ μ λ [N] of the friction that is held, and of what would be held now.
    pub fn friction_limits(&self) -> [f64; 2] {
        let of = |collision: &NormalCollision| {
            self.barriers.groups[collision.stencil.contact as usize].parameters.friction
                * collision.pushes().1
        };
        let now = self.normal_collisions.iter().map(of);
        [self.friction_collisions.iter().map(|collision| collision.limit).sum(), now.sum()]
    }

    /// Finds the slip of all that friction holds.
    fn slide(&mut self) {
        let Self {
            barriers,
            ends: [from, _],
            now: Configuration { place, stances },
            friction_collisions,
            ..
        } = self;
        let mut energy = 0.0;
        for collision in friction_collisions.iter_mut() {
            let start = carried(collision.wall, [from, stances], &collision.start);
            let way = collision.stencil.combine(|node| place[node as usize]) - start;
            collision.slip = way - collision.normal * collision.normal.dot(&way);
            let slip = barriers.groups[collision.stencil.contact as usize].parameters.slip;
            let length = collision.slip.norm();
            collision.stiffness = collision.limit * slip.force_over_slip(length);
            collision.along = collision.limit * slip.slope(length);
            energy += collision.limit * slip.energy(length);
        }
        self.energy[1] = energy;
    }

    /// Returns the change [m] over the step of the way between both primitives of a stencil: Σ c x less Σ c x
    /// at the start. A wall carries the start along.
    pub(super) fn way(&self, stencil: &Stencil) -> Vector3<f64> {
        let start = stencil.combine(|node| self.start[node as usize]);
        let wall = self.barriers.groups[stencil.contact as usize].wall_of(stencil);
        let start = carried(wall, [&self.ends[0], &self.now.stances], &start);
        stencil.combine(|node| self.now.place[node as usize]) - start
    }

    /// Returns the energy [J], with friction, for nodes at places [m] and rigid things at a fraction of the
    /// step. Infinite if a gap is zero or less.
    pub fn evaluate(&mut self, position: &[Vector3<f64>], time_fraction: f64) -> f64 {
        self.put(position, time_fraction);
        self.find_collisions();
        self.slide();
        self.energy[0] + self.energy[1]
    }

    /// The energy [J] of the barriers at the state last evaluated.
    pub fn barrier_energy(&self) -> f64 {
        self.energy[0]
    }

    /// Returns the normal collisions at the state last evaluated.
    pub fn normal_collisions(&self) -> &[NormalCollision] {
        &self.normal_collisions
    }

    /// Returns the frictional collisions.
    pub fn friction_collisions(&self) -> &[FrictionCollision] {
        &self.friction_collisions
    }

    /// The least gap [m] at the state last evaluated; none where nothing is within the reach of the barrier.
    pub fn least_gap(&self) -> Option<f64> {
        self.normal_collisions.iter().map(|collision| collision.gap).reduce(f64::min)
    }

    /// Adds the forces [N] at the state last evaluated to the forces of nodes, six numbers a node. Sets the
    /// forces of each contact on its second side.
    pub fn add_forces(&self, forces: &mut [f64], totals: &mut [Vector3<f64>]) {
        totals.fill(Vector3::zeros());
        self.for_each_force(|stencil, at, node, force| {
            let total = &mut totals[stencil.contact as usize];
            if stencil.count == 1 {
                *total -= force;
            } else if stencil.is_second(at) {
                *total += force;
            }
            if let Some(sums) = forces.get_mut(6 * node as usize..6 * node as usize + 3) {
                sums.iter_mut().zip(force.iter()).for_each(|(sum, force)| *sum += force);
            }
        });
    }

    /// Sets the moments [N m] about the origin of the forces of each contact on its second side at the state
    /// last evaluated. Forces act where the nodes of the first side are.
    pub fn find_moments(&self, moments: &mut [Vector3<f64>]) {
        let places = &self.now.place[..self.barriers.nodes];
        moments.fill(Vector3::zeros());
        self.for_each_force(|stencil, at, node, force| {
            let is_first = stencil.count == 1 || !stencil.is_second(at);
            if let Some(place) = places.get(node as usize).filter(|_| is_first) {
                moments[stencil.contact as usize] -= place.cross(&force);
            }
        });
    }

    /// Calls back with each force [N] of a collision on a node: stencil, place of the node in it, node,
    /// force.
    fn for_each_force(&self, mut found: impl FnMut(&Stencil, usize, u32, Vector3<f64>)) {
        let mut each = |stencil: &Stencil, force_on: &dyn Fn(usize) -> Vector3<f64>| {
            for (at, (node, _)) in stencil.parts().enumerate() {
                found(stencil, at, node, force_on(at));
            }
        };
        for collision in &self.normal_collisions {
            each(&collision.stencil, &|at| collision.force_on(at));
        }
        for collision in &self.friction_collisions {
            each(&collision.stencil, &|at| collision.force_on(at));
        }
    }

    /// Calls back with the nodes of the model of each pair that acts or is held.
    pub fn acting(&self, mut found: impl FnMut(&[u32])) {
        let stencils = self
            .normal_collisions
            .iter()
            .map(|collision| &collision.stencil)
            .chain(self.friction_collisions.iter().map(|collision| &collision.stencil));
        stencils
            .filter(|stencil| stencil.count > 1)
            .for_each(|stencil| found(&self.barriers.nodes_of_model(&stencil.nodes)));
    }

    /// Calls back with the nodes of the model of each pair that may act soon. Such a pair is within the reach
    /// plus `distances` times the distance of its barrier.
    pub fn near(&mut self, distances: f64, mut found: impl FnMut(&[u32])) {
        let Self { barriers, now, .. } = self;
        // A search for a fraction may have left lists elsewhere.
        barriers.grow(&now.stances);
        barriers.relist(now);
        for group in &barriers.groups {
            let margin = distances * group.parameters.law.distance;
            group.pairs(&now.place, margin, |nodes| found(&barriers.nodes_of_model(nodes)));
        }
    }

    /// Nodes of the model.
    pub fn node_count(&self) -> usize {
        self.barriers.nodes
    }

    /// The contacts with their surfaces and rigid things.
    pub fn contacts(&self) -> &Contacts {
        &self.barriers.contacts
    }

    /// Returns the ways of rigid things that are driven from outside, by their number; changes act from the
    /// next step on.
    pub fn legs_mut(&mut self) -> &mut BTreeMap<u32, Leg> {
        &mut self.barriers.legs
    }

    /// Returns the same ways read-only.
    pub fn legs(&self) -> &BTreeMap<u32, Leg> {
        &self.barriers.legs
    }

    /// Shifts [m] of rigid things off their trajectories, by their number, at the start and the end of a
    /// step. Changes act from the next step on.
    pub fn shifts_mut(&mut self) -> &mut Vec<(u32, [Vector3<f64>; 2])> {
        &mut self.barriers.shifts
    }

    /// Calls back with each edge that goes through a triangle at the state last evaluated, by its contact,
    /// ends and corners. Without the lists that contacts go by.
    pub fn intersections(&self, mut found: impl FnMut(u32, [u32; 2], [u32; 3])) {
        let place = |node: u32| self.now.place[node as usize];
        for group in &self.barriers.groups {
            let (first, second) = (&group.sides[0], group.sides.last().unwrap_or(&group.sides[0]));
            intersections([first, second], &place, |ends, corners| found(group.number, ends, corners));
            if group.sides.len() > 1 {
                intersections([second, first], &place, |ends, corners| found(group.number, ends, corners));
            }
        }
    }
}

/// A point [m] that moves with a wall, if there is one, between two stances of rigid things.
pub(super) fn carried(wall: Option<u32>, [from, now]: [&[Stance]; 2], point: &Vector3<f64>) -> Vector3<f64> {
    let Some(wall) = wall.map(|wall| wall as usize) else { return *point };
    (now[wall].pose * from[wall].pose.inverse() * Point3::from(*point)).coords
}
