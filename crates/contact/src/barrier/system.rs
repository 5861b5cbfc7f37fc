//! The contacts of a model by a barrier: their energy, forces and stiffness at a state, friction over a step, and how far a step may go.
//!
//! A step goes from one time to another. The part of the way that rigid things have gone in it is its *time fraction*, from 0 to 1: on straight ways and shortest arcs
//! between their poses, and their growth in proportion. Friction of a step is that of the state where [`Barriers::lag`] was called last, with directions and normal forces
//! as they were there.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};

use super::candidates::{ContactParameters, Group};
use super::ccd::ADVANCES;
use super::collision_mesh::CollisionMesh;
use super::collisions::{FrictionCollision, NormalCollision, Stencil};
use super::distance::Nearest;
use super::features::Features;
use super::hessian::{Matrix12, bent, block, of_parallel, of_wall};
use super::intersections::intersections;
use super::law::{Barrier, Slip};
use crate::pose::{Leg, Stance};
use crate::shape::Near;
use crate::touch::{Contacts, Passage, With};

/// How often the motion of a rigid thing that turns is followed anew in a step.
const TURNS: usize = 40;
/// The step of differences of the normal of a wall, over the distance of the barrier.
const DIFFERENCE: f64 = 0.01;
/// Part of the way to a meeting that is gone where things turn.
const SHORTER: f64 = 0.9;

/// How a contact acts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BarrierSettings {
    /// The gap ĝ [m] below which surfaces push each other away, in addition to the distance that they keep.
    pub distance: f64,
    /// κ [Pa]: the pressure at a gap y ĝ is κ (2 (y − 1) ln y + (y − 1)²/y).
    pub stiffness: f64,
    /// The speed [m/s] below which friction lets bodies creep that should stick.
    pub creep_speed: f64,
}

/// Two primitives without a gap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Meeting {
    /// The contact, by its number.
    pub contact: u32,
    /// A node of the model that takes part.
    pub node: u32,
    /// Where it is [m].
    pub place: [f64; 3],
    /// The gap [m], not above 0; none where an edge goes through a triangle.
    pub gap: Option<f64>,
}

/// The contacts of a model.
#[derive(Clone, Debug)]
pub struct Barriers {
    contacts: Arc<Contacts>,
    groups: Vec<Group>,
    /// Nodes of the model.
    nodes: usize,
    /// Nodes of rigid things, after those: their thing and their place [m] in its frame.
    rigid_nodes: Vec<(u32, Vector3<f64>)>,
    /// Rigid things at the start and the end of the step, and now.
    stances: [Vec<Stance>; 3],
    /// Rigid things when pairs were listed.
    listed_stances: Vec<Stance>,
    /// Places [m] of all nodes now, at the start of the step, and when pairs were listed; motions [m].
    place: Vec<Vector3<f64>>,
    start: Vec<Vector3<f64>>,
    listed: Vec<Vector3<f64>>,
    motion: Vec<Vector3<f64>>,
    /// Distances [m] of nodes from the wall of each contact when they were listed.
    wall_distances: Vec<Vec<f64>>,
    /// Where rigid things go that are driven from outside, by their number.
    legs: BTreeMap<u32, Leg>,
    /// Rigid things beside their trajectories, by their number: how far [m] at the start and the end of the step.
    shifts: Vec<(u32, [Vector3<f64>; 2])>,
    normal_collisions: Vec<NormalCollision>,
    friction_collisions: Vec<FrictionCollision>,
    energy: [f64; 2],
    /// Whether collisions are those of the present places.
    is_current: bool,
}

impl Barriers {
    /// For contacts, each with its settings, and nodes at rest [m]. The distance that surfaces keep is that of their
    /// [`Touch`](crate::touch::Touch).
    pub fn new(contacts: Arc<Contacts>, settings: &[BarrierSettings], rest: &[[f64; 3]]) -> Self {
        let mut places: Vec<Vector3<f64>> = rest.iter().map(|&x| x.into()).collect();
        let nodes = places.len();
        let mut rigid_nodes = Vec::new();
        let features: Vec<(Features, u32)> = (contacts.rigids.iter().zip(0..))
            .map(|(rigid, number)| {
                let features = if rigid.inside { Features::default() } else { Features::of(&rigid.shape) };
                let first = (nodes + rigid_nodes.len()) as u32;
                rigid_nodes.extend(features.points.iter().map(|&point| (number, point)));
                (features, first)
            })
            .collect();
        let stances: Vec<Stance> = contacts.rigids.iter().map(|rigid| rigid.stance(0.0, None)).collect();
        places.extend(
            rigid_nodes
                .iter()
                .map(|(thing, x)| (stances[*thing as usize].pose * nalgebra::Point3::from(*x)).coords),
        );
        let at = |node: u32| places[node as usize];
        let mut groups = Vec::new();
        for ((contact, settings), number) in contacts.contacts.iter().zip(settings).zip(0..) {
            let own = CollisionMesh::of_body(&contact.surface, at);
            let mut offset = contact.touch.offset;
            let (sides, wall, thing) = match &contact.with {
                With::Itself => (vec![own], None, None),
                With::Body(other) => (vec![own, CollisionMesh::of_body(other, at)], None, None),
                With::Rigid(rigid) => {
                    let (features, first) = &features[*rigid];
                    offset += features.offset;
                    let wall = (!features.is_all).then_some(*rigid as u32);
                    (vec![own, CollisionMesh::of_rigid(features, *first)], wall, Some(*rigid as u32))
                }
            };
            let parameters = ContactParameters {
                kept: offset,
                growth: 0.0,
                law: Barrier { distance: settings.distance },
                stiffness: settings.stiffness,
                friction: contact.touch.friction,
                creep_speed: settings.creep_speed,
                slip: Slip { creep: 0.0 },
            };
            groups.push(Group::new(number, sides, [wall, thing], parameters, &places));
        }
        Self {
            wall_distances: groups.iter().map(|group| vec![0.0; group.sides[0].points.len()]).collect(),
            groups,
            nodes,
            rigid_nodes,
            listed_stances: stances.clone(),
            stances: [stances.clone(), stances.clone(), stances],
            start: places.clone(),
            listed: places.clone(),
            motion: vec![Vector3::zeros(); places.len()],
            place: places,
            legs: BTreeMap::new(),
            shifts: Vec::new(),
            normal_collisions: Vec::new(),
            friction_collisions: Vec::new(),
            energy: [0.0; 2],
            is_current: false,
            contacts,
        }
    }

    /// Who touches whom.
    pub fn contacts(&self) -> &Contacts {
        &self.contacts
    }

    /// Of each contact the pairs that never touch, since they are in one place at rest.
    pub fn apart_counts(&self) -> Vec<usize> {
        self.groups.iter().map(Group::apart_count).collect()
    }

    /// Pairs that are watched.
    pub fn listed(&self) -> usize {
        self.groups.iter().map(Group::listed).sum()
    }

    /// Where rigid things go that are driven from outside, by their number; from the next step on.
    pub fn legs_mut(&mut self) -> &mut BTreeMap<u32, Leg> {
        &mut self.legs
    }

    /// The same to look at.
    pub fn legs(&self) -> &BTreeMap<u32, Leg> {
        &self.legs
    }

    /// Rigid things beside their trajectories, by their number, at the start and the end of a step [m]; from the next step on.
    pub fn shifts_mut(&mut self) -> &mut Vec<(u32, [Vector3<f64>; 2])> {
        &mut self.shifts
    }

    /// Begins a step between two times [s], with nodes at places [m], expected to go by a motion (six numbers a node, translations first).
    /// Friction is that of the start.
    pub fn begin(&mut self, position: &[Vector3<f64>], motion: &[f64], times: [f64; 2]) {
        let [from, to] = times;
        for (number, rigid) in self.contacts.rigids.iter().enumerate() {
            for (stance, time) in self.stances.iter_mut().zip([from, to, from]) {
                stance[number] = rigid.stance(time, self.legs.get(&(number as u32)));
            }
        }
        for (number, [before, after]) in &self.shifts {
            for (stance, shift) in self.stances.iter_mut().zip([before, after, before]) {
                stance[*number as usize].pose.translation.vector += shift;
            }
        }
        for group in &mut self.groups {
            let parameters = &mut group.parameters;
            parameters.slip = Slip { creep: parameters.creep_speed * (to - from) };
        }
        self.friction_collisions.clear();
        self.is_current = false;
        self.put(position, 0.0);
        self.start.copy_from_slice(&self.place);
        self.list(motion, 1.0, 0.0);
        self.act();
        self.lag();
    }

    /// Drops friction until the next step begins: a state by itself has none.
    pub fn drop_friction(&mut self) {
        self.friction_collisions.clear();
    }

    /// Puts nodes at places [m], and rigid things where they are at a fraction of the step.
    fn put(&mut self, position: &[Vector3<f64>], time_fraction: f64) {
        let [from, to, now] = &mut self.stances;
        let mut is_current = self.is_current && self.place[..self.nodes] == *position;
        for ((now, from), to) in now.iter_mut().zip(from).zip(to) {
            let stance = if time_fraction == 1.0 { *to } else { Stance::between([from, to], time_fraction) };
            is_current &= *now == stance;
            *now = stance;
        }
        self.is_current = is_current;
        if is_current {
            return;
        }
        self.place[..self.nodes].copy_from_slice(position);
        for (place, (thing, x)) in self.place[self.nodes..].iter_mut().zip(&self.rigid_nodes) {
            *place = (now[*thing as usize].pose * nalgebra::Point3::from(*x)).coords;
        }
        for group in &mut self.groups {
            group.parameters.growth = group.thing.map_or(0.0, |thing| now[thing as usize].growth);
        }
    }

    /// Sets the motions of all nodes: so many parts of one (six numbers a node), and rigid things from the present fraction of time to another.
    fn set_motion(&mut self, motion: &[f64], part: f64, time_fraction: f64) {
        for (own, way) in self.motion.iter_mut().zip(motion.chunks_exact(6)) {
            *own = Vector3::new(way[0], way[1], way[2]) * part;
        }
        let [from, to, now] = &self.stances;
        let then = |thing: u32| Stance::between([&from[thing as usize], &to[thing as usize]], time_fraction);
        for (at, (thing, x)) in self.rigid_nodes.iter().enumerate() {
            let target = (then(*thing).pose * nalgebra::Point3::from(*x)).coords;
            self.motion[self.nodes + at] = target - self.place[self.nodes + at];
        }
        for group in &mut self.groups {
            group.rise = group.thing.map_or(0.0, |thing| then(thing).growth - now[thing as usize].growth);
        }
    }

    /// Lists pairs that may come near during a part of a motion. Rigid things move from this fraction of the step to its end. Returns the part of
    /// the motion for which the lists hold.
    fn list(&mut self, motion: &[f64], part: f64, time_fraction: f64) -> f64 {
        self.set_motion(motion, part, if time_fraction < 1.0 { 1.0 } else { time_fraction });
        self.list_motion()
    }

    /// Lists pairs for the motion that is set. Returns the part of it for which the lists hold.
    fn list_motion(&mut self) -> f64 {
        self.listed.copy_from_slice(&self.place);
        self.listed_stances.clone_from(&self.stances[2]);
        let Self { groups, place, motion, wall_distances, contacts, stances, .. } = self;
        let mut holds: f64 = 1.0;
        for (group, distances) in groups.iter_mut().zip(wall_distances) {
            holds = holds.min(group.list(place, motion));
            let Some(wall) = group.wall else { continue };
            let (rigid, stance) = (&contacts.rigids[wall as usize], &stances[2][wall as usize]);
            for (distance, &node) in distances.iter_mut().zip(&group.sides[0].points) {
                *distance = rigid.distance(stance, &place[node as usize]);
            }
        }
        holds
    }

    /// Takes the places of all nodes; whether no node has left its skin.
    fn lists_hold(&mut self) -> bool {
        let mut holds = true;
        for group in &mut self.groups {
            holds &= group.take(&self.place, &self.listed);
        }
        holds
    }

    /// Whether no node leaves its skin in the motion that is set.
    fn lists_have_motion(&self) -> bool {
        self.groups.iter().all(|group| group.has(&self.place, &self.listed, &self.motion))
    }

    /// How far [m] a rigid thing has gone since pairs were listed.
    fn travel(&self, wall: u32) -> f64 {
        let (rigid, now) = (&self.contacts.rigids[wall as usize], self.stances[2][wall as usize]);
        let then = self.listed_stances[wall as usize];
        if then == now { 0.0 } else { Passage::new(rigid, [then, now]).travel_from(rigid, &then) }
    }

    /// Finds what acts, if that is not known; infinite energy if there is no gap somewhere.
    fn act(&mut self) {
        if std::mem::replace(&mut self.is_current, true) {
            return;
        }
        let mut normal_collisions = std::mem::take(&mut self.normal_collisions);
        normal_collisions.clear();
        if !self.lists_hold() {
            // A rigid thing turns on an arc, and a line search may stop on it outside of the lists.
            self.motion.fill(Vector3::zeros());
            self.list_motion();
        }
        let mut apart = true;
        for number in 0..self.groups.len() {
            apart = apart
                && self.groups[number].act(&self.place, &mut normal_collisions)
                && self.act_at_wall(number, &mut normal_collisions);
        }
        self.normal_collisions = normal_collisions;
        let energy: f64 = self.normal_collisions.iter().map(|collision| collision.energy).sum();
        self.energy[0] = if apart { energy } else { f64::INFINITY };
    }

    /// Adds what acts on nodes at the wall of a contact; false if one has no gap.
    fn act_at_wall(&self, number: usize, normal_collisions: &mut Vec<NormalCollision>) -> bool {
        let group = &self.groups[number];
        let Some(wall) = group.wall else { return true };
        let (rigid, stance) = (&self.contacts.rigids[wall as usize], &self.stances[2][wall as usize]);
        let (travel, parameters) = (self.travel(wall), group.parameters.of_wall());
        let reach = parameters.reach();
        let side = &group.sides[0];
        let points = side.points.iter().zip(&side.point_areas).zip(&self.wall_distances[number]);
        for ((&node, &area), then) in points {
            let place = &self.place[node as usize];
            let way = (place - self.listed[node as usize]).norm();
            if then - way - travel >= reach {
                continue;
            }
            let stencil = Stencil {
                nodes: [node; 4],
                coefficients: [1.0, 0.0, 0.0, 0.0],
                count: 1,
                contact: group.number,
                split: 1,
                in_order: true,
            };
            for (side, near) in (0..).zip(rigid.sides(stance, place)) {
                let Some(Near { distance, normal }) = near else { continue };
                let Some(collision) = parameters.collision(stencil, area, distance, normal) else { continue };
                if collision.gap <= 0.0 || collision.gap.is_nan() {
                    return false;
                }
                normal_collisions.push(NormalCollision { side, ..collision });
            }
        }
        true
    }

    /// Takes friction from the present state on.
    pub fn lag(&mut self) {
        let Self { groups, normal_collisions, friction_collisions, start, .. } = self;
        friction_collisions.clear();
        for collision in normal_collisions.iter() {
            let group = &groups[collision.stencil.contact as usize];
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
                wall: group.wall.filter(|_| collision.stencil.count == 1),
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
            self.groups[collision.stencil.contact as usize].parameters.friction * collision.pushes().1
        };
        let now = self.normal_collisions.iter().map(of);
        [self.friction_collisions.iter().map(|collision| collision.limit).sum(), now.sum()]
    }

    /// Finds the slip of all that friction holds.
    fn slide(&mut self) {
        let Self { groups, friction_collisions, place, stances, .. } = self;
        let [from, _, now] = stances;
        let mut energy = 0.0;
        for collision in friction_collisions.iter_mut() {
            let start = match collision.wall {
                Some(wall) => carried([&from[wall as usize], &now[wall as usize]], &collision.start),
                None => collision.start,
            };
            let way = collision.stencil.combine(|node| place[node as usize]) - start;
            collision.slip = way - collision.normal * collision.normal.dot(&way);
            let slip = groups[collision.stencil.contact as usize].parameters.slip;
            let length = collision.slip.norm();
            collision.stiffness = collision.limit * slip.force_over_slip(length);
            collision.along = collision.limit * slip.slope(length);
            energy += collision.limit * slip.energy(length);
        }
        self.energy[1] = energy;
    }

    /// How far [m] the first primitive of a stencil has gone from the second in the step: Σ c x less that of its start, which a wall carries along.
    pub(super) fn way(&self, stencil: &Stencil) -> Vector3<f64> {
        let start = stencil.combine(|node| self.start[node as usize]);
        let wall = self.groups[stencil.contact as usize].wall.filter(|_| stencil.count == 1);
        let start = match wall.map(|wall| wall as usize) {
            Some(wall) => carried([&self.stances[0][wall], &self.stances[2][wall]], &start),
            None => start,
        };
        stencil.combine(|node| self.place[node as usize]) - start
    }

    /// The energy [J] with nodes at places [m] and rigid things at a fraction of the step, that of friction with it; infinite if there is no gap
    /// somewhere.
    pub fn evaluate(&mut self, position: &[Vector3<f64>], time_fraction: f64) -> f64 {
        self.put(position, time_fraction);
        self.act();
        self.slide();
        self.energy[0] + self.energy[1]
    }

    /// The energy [J] of the barriers at the state last evaluated.
    pub fn barrier_energy(&self) -> f64 {
        self.energy[0]
    }

    /// What acts at the state last evaluated.
    pub fn normal_collisions(&self) -> &[NormalCollision] {
        &self.normal_collisions
    }

    /// What friction holds.
    pub fn friction_collisions(&self) -> &[FrictionCollision] {
        &self.friction_collisions
    }

    /// The least gap [m] at the state last evaluated; none where nothing is within the reach of the barrier.
    pub fn least_gap(&self) -> Option<f64> {
        self.normal_collisions.iter().map(|collision| collision.gap).reduce(f64::min)
    }

    /// Adds the forces [N] at the state last evaluated to those of nodes, six numbers a node, and sets those of each contact on its second
    /// side.
    pub fn add_forces(&self, forces: &mut [f64], totals: &mut [Vector3<f64>]) {
        totals.fill(Vector3::zeros());
        let mut add = |stencil: &Stencil, force_on: &dyn Fn(usize) -> Vector3<f64>| {
            let total = &mut totals[stencil.contact as usize];
            for (at, (node, _)) in stencil.parts().enumerate() {
                let force = force_on(at);
                if stencil.count == 1 {
                    *total -= force;
                } else if stencil.is_second(at) {
                    *total += force;
                }
                if let Some(own) = forces.get_mut(6 * node as usize..6 * node as usize + 3) {
                    own.iter_mut().zip(force.iter()).for_each(|(own, force)| *own += force);
                }
            }
        };
        self.normal_collisions
            .iter()
            .for_each(|collision| add(&collision.stencil, &|at| collision.force_on(at)));
        self.friction_collisions
            .iter()
            .for_each(|collision| add(&collision.stencil, &|at| collision.force_on(at)));
    }

    /// Sets the moments [N m] about the origin of the forces of each contact on its second side at the state last evaluated, whose nodes are at these
    /// places [m]. Forces act where the nodes of the first side are.
    pub fn find_moments(&self, places: &[Vector3<f64>], moments: &mut [Vector3<f64>]) {
        moments.fill(Vector3::zeros());
        let mut add = |stencil: &Stencil, force_on: &dyn Fn(usize) -> Vector3<f64>| {
            let moment = &mut moments[stencil.contact as usize];
            for (at, (node, _)) in stencil.parts().enumerate() {
                if let Some(place) =
                    places.get(node as usize).filter(|_| stencil.count == 1 || !stencil.is_second(at))
                {
                    *moment -= place.cross(&force_on(at));
                }
            }
        };
        self.normal_collisions
            .iter()
            .for_each(|collision| add(&collision.stencil, &|at| collision.force_on(at)));
        self.friction_collisions
            .iter()
            .for_each(|collision| add(&collision.stencil, &|at| collision.force_on(at)));
    }

    /// Calls back with the stiffness [N/m] of each collision, never negative: its stencil, three rows and columns a node, and the ways [m] that the
    /// rigid things among its nodes have yet to go in the step from a fraction of time on; of one node at a wall the way from the wall. That of barriers
    /// is κ A b″ ∇d ∇dᵀ and the positive part of κ A b′ ∂²d/∂x²; that of friction is exact.
    pub fn stiffness(&self, time_fraction: f64, mut add: impl FnMut(&Stencil, &Matrix12, [Vector3<f64>; 4])) {
        let [from, to, now] = &self.stances;
        let goes_on = time_fraction < 1.0 && from != to;
        let left = |stencil: &Stencil, wall: Option<u32>, outward: Vector3<f64>| {
            let mut ways = [Vector3::zeros(); 4];
            if !goes_on {
                return ways;
            }
            let rises = |thing: u32| to[thing as usize].growth - now[thing as usize].growth;
            if let Some(wall) = wall.filter(|_| stencil.count == 1) {
                let place = self.place[stencil.nodes[0] as usize];
                let carried = to[wall as usize].pose * now[wall as usize].pose.inverse();
                ways[0] = place - (carried * nalgebra::Point3::from(place)).coords - outward * rises(wall);
                return ways;
            }
            // What is left of the rise counts as a way of all nodes of the thing, along the normal by which their distance falls.
            let own = |node: u32| self.rigid_node(node);
            let sum: f64 = stencil.parts().filter_map(|(node, c)| own(node).map(|_| c)).sum();
            for (way, (node, _)) in ways.iter_mut().zip(stencil.parts()) {
                if let Some((thing, x)) = own(node) {
                    let target = (to[*thing as usize].pose * nalgebra::Point3::from(*x)).coords;
                    *way = target - self.place[node as usize] - outward * (rises(*thing) * sum);
                }
            }
            ways
        };
        for collision in &self.normal_collisions {
            let wall = self.groups[collision.stencil.contact as usize].wall;
            let is_inside = wall.is_some_and(|wall| self.contacts.rigids[wall as usize].inside);
            let outward = if is_inside { -collision.normal } else { collision.normal };
            add(&collision.stencil, &self.stiffness_of(collision), left(&collision.stencil, wall, outward));
        }
        for collision in &self.friction_collisions {
            let across = block(&collision.stencil.coefficients, &collision.stiffness());
            add(&collision.stencil, &across, left(&collision.stencil, collision.wall, Vector3::zeros()));
        }
    }

    /// A node of a rigid thing: the thing and its place [m] in its frame.
    fn rigid_node(&self, node: u32) -> Option<&(u32, Vector3<f64>)> {
        (node as usize).checked_sub(self.nodes).map(|at| &self.rigid_nodes[at])
    }

    /// The stiffness [N/m] of the barrier of a collision.
    fn stiffness_of(&self, collision: &NormalCollision) -> Matrix12 {
        let group = &self.groups[collision.stencil.contact as usize];
        let Stencil { nodes, coefficients, .. } = collision.stencil;
        let along = collision.normal * collision.normal.transpose() * collision.stiffness;
        let Some(region) = collision.region else {
            let curved =
                group.wall.map(|wall| self.curved_wall(wall, collision, group.parameters.law.distance));
            return block(&coefficients, &(along + curved.unwrap_or_default() * collision.force));
        };
        let points = nodes.map(|node| self.place[node as usize]);
        let near = Nearest { distance: collision.distance, coefficients, normal: collision.normal, region };
        match &collision.mollified {
            Some(with) => of_parallel(&points, &near, collision.stiffness, with),
            None => block(&coefficients, &along) + bent(&points, &near) * collision.force,
        }
    }

    /// The positive part [1/m] of −∂²d/∂x² of a collision at a wall, by differences over a part of the distance [m] of its barrier.
    fn curved_wall(&self, wall: u32, collision: &NormalCollision, distance: f64) -> Matrix3<f64> {
        let (rigid, stance) = (&self.contacts.rigids[wall as usize], &self.stances[2][wall as usize]);
        let h = DIFFERENCE * distance;
        let normals = [0, 1, 2].map(|axis| {
            [h, -h].map(|by| {
                let mut place = self.place[collision.stencil.nodes[0] as usize];
                place[axis] += by;
                rigid.sides(stance, &place)[usize::from(collision.side)]
                    .map_or(collision.normal, |side| side.normal)
            })
        });
        of_wall(normals, h)
    }

    /// Calls back with the nodes of the model of each pair that acts or is held.
    pub fn acting(&self, mut found: impl FnMut(&[u32])) {
        let stencils = self
            .normal_collisions
            .iter()
            .map(|collision| &collision.stencil)
            .chain(self.friction_collisions.iter().map(|collision| &collision.stencil));
        stencils.filter(|stencil| stencil.count > 1).for_each(|stencil| found(&self.own(&stencil.nodes)));
    }

    /// Calls back with the nodes of the model of each pair that may act soon: within so many distances of its barrier more than the reach.
    pub fn near(&self, distances: f64, mut found: impl FnMut(&[u32])) {
        for group in &self.groups {
            let margin = distances * group.parameters.law.distance;
            group.pairs(&self.place, margin, |nodes| found(&self.own(nodes)));
        }
    }

    /// Those nodes that are of the model.
    fn own(&self, nodes: &[u32]) -> Vec<u32> {
        nodes.iter().copied().filter(|&node| (node as usize) < self.nodes).collect()
    }

    /// Nodes of the model.
    pub fn node_count(&self) -> usize {
        self.nodes
    }

    /// The part of a motion (six numbers a node), of so much of it at most, from places [m] at a fraction of the step that leaves at least half of a
    /// part of every gap, while rigid things go the same part of the way that is left to them. Pairs are listed anew if need be.
    pub fn collision_free_fraction(
        &mut self,
        position: &[Vector3<f64>],
        motion: &[f64],
        time_fraction: f64,
        [keep, most]: [f64; 2],
    ) -> f64 {
        self.put(position, time_fraction);
        self.set_motion(motion, most, 1.0);
        let mut part = most;
        if !self.lists_hold() || !self.lists_have_motion() {
            part *= self.list(motion, most, time_fraction);
        }
        let [from, to, _] = &self.stances;
        let turns = time_fraction < 1.0
            && from.iter().zip(to).any(|(from, to)| from.pose.rotation != to.pose.rotation);
        for _ in 0..TURNS {
            // Things that turn do not move on a straight way: the way to where they really come is searched.
            self.set_motion(motion, part, time_fraction + part * (1.0 - time_fraction));
            if turns && !self.lists_have_motion() {
                part *= SHORTER;
                continue;
            }
            let gone = self.filtered(keep, time_fraction, part);
            part *= gone;
            if !turns || gone == 1.0 || part == 0.0 {
                return part;
            }
            part *= SHORTER;
        }
        0.0
    }

    /// The part of the motion that is set which leaves at least half of a part of every gap.
    fn filtered(&mut self, keep: f64, time_fraction: f64, part: f64) -> f64 {
        let mut most = 1.0;
        for number in 0..self.groups.len() {
            most = self.groups[number].collision_free_fraction(&self.place, &self.motion, keep, most);
            let Some(wall) = self.groups[number].wall else { continue };
            most = self.collision_free_fraction_at_wall(number, wall, [keep, time_fraction, part], most);
        }
        most
    }

    /// [`filtered`](Self::filtered) of nodes at a wall: no node comes nearer to it than both go.
    fn collision_free_fraction_at_wall(
        &self,
        number: usize,
        wall: u32,
        [keep, time_fraction, part]: [f64; 3],
        most: f64,
    ) -> f64 {
        let group = &self.groups[number];
        let rigid = &self.contacts.rigids[wall as usize];
        let [from, to, now] = [0, 1, 2].map(|k| self.stances[k][wall as usize]);
        let target = Stance::between([&from, &to], time_fraction + part * (1.0 - time_fraction));
        let travel =
            if target == now { 0.0 } else { Passage::new(rigid, [now, target]).travel_from(rigid, &now) };
        let since = self.travel(wall);
        let mut most: f64 = most;
        for (&node, then) in group.sides[0].points.iter().zip(&self.wall_distances[number]) {
            let (place, motion) = (self.place[node as usize], self.motion[node as usize]);
            let offset = group.parameters.kept;
            let bound = then - (place - self.listed[node as usize]).norm() - since - offset;
            let way = motion.norm() + travel;
            if bound * (1.0 - keep) > way * most {
                continue;
            }
            let gap_at = |part: f64| {
                let stance = if target == now { now } else { Stance::between([&now, &target], part) };
                rigid.distance(&stance, &(place + motion * part)) - offset
            };
            // A plane that turns has no largest way: it is followed where the node is.
            let way = if way.is_finite() { way } else { motion.norm() + self.swing(wall, &target, &place) };
            let start = gap_at(0.0);
            let (mut gone, mut gap) = (0.0, start);
            if start <= 0.0 {
                return 0.0;
            }
            for _ in 0..ADVANCES {
                if gap <= keep * start || gone >= most {
                    break;
                }
                gone += (gap - 0.5 * keep * start) / way;
                gap = gap_at(gone.min(1.0));
            }
            most = most.min(gone);
        }
        most
    }

    /// How far [m] a thing that turns goes at most where a node is, from its present pose to another.
    fn swing(&self, wall: u32, target: &Stance, place: &Vector3<f64>) -> f64 {
        let now = &self.stances[2][wall as usize];
        let [from, to] = [&now.pose, &target.pose].map(|pose| pose.translation.vector);
        let shift = (to - from).norm();
        let arm = (place - from).norm() + shift;
        let turn = now.pose.rotation.angle_to(&target.pose.rotation);
        shift + turn * arm + (target.growth - now.growth).abs()
    }

    /// Whatever has no gap at places [m] and a time [s]: pairs within the distance to keep, nodes in walls, and edges through triangles. With
    /// no regard to what came before.
    pub fn meetings(&mut self, position: &[Vector3<f64>], time: f64) -> Vec<Meeting> {
        let none = vec![0.0; 6 * self.nodes];
        self.begin(position, &none, [time; 2]);
        let mut all = Vec::new();
        let nodes = self.nodes;
        let of = |contact: u32, at: &[u32], gap: Option<f64>| {
            let node = at.iter().copied().find(|&node| (node as usize) < nodes)?;
            Some(Meeting { contact, node, place: position[node as usize].into(), gap })
        };
        for (number, group) in self.groups.iter().enumerate() {
            group.too_close(&self.place, |at, gap| all.extend(of(group.number, &at, Some(gap))));
            if group.wall.is_some() {
                let distances = group.sides[0].points.iter().zip(&self.wall_distances[number]);
                let gaps = distances.map(|(&node, distance)| (node, distance - group.parameters.kept));
                all.extend(
                    gaps.filter(|(_, gap)| *gap <= 0.0)
                        .filter_map(|(node, gap)| of(group.number, &[node], Some(gap))),
                );
            }
        }
        self.intersections(|contact, ends, corners| all.extend(of(contact, &[ends[0], corners[0]], None)));
        all
    }

    /// Calls back with each edge that goes through a triangle at the state last evaluated, by its contact, ends and corners. Without the lists
    /// that contacts go by.
    pub fn intersections(&self, mut found: impl FnMut(u32, [u32; 2], [u32; 3])) {
        let place = |node: u32| self.place[node as usize];
        for group in &self.groups {
            let (first, second) = (&group.sides[0], group.sides.last().unwrap_or(&group.sides[0]));
            intersections([first, second], &place, |ends, corners| found(group.number, ends, corners));
            if group.sides.len() > 1 {
                intersections([second, first], &place, |ends, corners| found(group.number, ends, corners));
            }
        }
    }
}

/// Where a point [m] that goes along with a rigid thing is after it has gone from one stance to another.
fn carried([from, now]: [&Stance; 2], point: &Vector3<f64>) -> Vector3<f64> {
    (now.pose * from.pose.inverse() * nalgebra::Point3::from(*point)).coords
}
