//! The contacts of a model by a barrier: their surfaces, and the pairs of them that may collide.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{Point3, Vector3};

use super::candidates::{ContactParameters, Group};
use super::collision_mesh::CollisionMesh;
use super::collisions::{NormalCollision, Stencil};
use super::configuration::Configuration;
use super::features::Features;
use super::law::{Barrier, Slip};
use crate::pose::{Leg, Stance};
use crate::shape::Near;
use crate::touch::{Contacts, Passage, With};

/// Settings of a barrier contact.
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
    /// Place of the node [m].
    pub place: [f64; 3],
    /// The gap [m], not above 0; none where an edge goes through a triangle.
    pub gap: Option<f64>,
}

/// The contacts of a model. They act only in steps ([`BarrierStep`](super::BarrierStep)).
#[derive(Clone, Debug)]
pub struct Barriers {
    pub(super) contacts: Arc<Contacts>,
    pub(super) groups: Vec<Group>,
    /// Nodes of the model.
    pub(super) nodes: usize,
    /// Nodes of rigid things, after those: their thing and their place [m] in its frame.
    pub(super) rigid_nodes: Vec<(u32, Vector3<f64>)>,
    /// State of nodes and rigid things when pairs were listed.
    pub(super) listed: Configuration,
    /// Motions [m] of all nodes for which pairs are listed or filtered.
    pub(super) motion: Vec<Vector3<f64>>,
    /// Distances [m] of nodes from the wall of each contact when they were listed.
    pub(super) wall_distances: Vec<Vec<f64>>,
    /// Ways of rigid things that are driven from outside, by their number.
    pub(super) legs: BTreeMap<u32, Leg>,
    /// Shifts [m] of rigid things off their trajectories, by their number, at the start and the end of the
    /// step.
    pub(super) shifts: Vec<(u32, [Vector3<f64>; 2])>,
}

impl Barriers {
    /// Makes the barriers of contacts, each with its settings, and nodes at rest [m]. Surfaces keep the
    /// distance of their [`Touch`](crate::touch::Touch).
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
            rigid_nodes.iter().map(|(thing, x)| (stances[*thing as usize].pose * Point3::from(*x)).coords),
        );
        let at = |node: u32| places[node as usize];
        let mut groups = Vec::new();
        for ((contact, settings), number) in contacts.contacts.iter().zip(settings).zip(0..) {
            let mesh = CollisionMesh::of_body(&contact.surface, at);
            let mut offset = contact.touch.offset;
            let (sides, wall, thing) = match &contact.with {
                With::Itself => (vec![mesh], None, None),
                With::Body(other) => (vec![mesh, CollisionMesh::of_body(other, at)], None, None),
                With::Rigid(rigid) => {
                    let (features, first) = &features[*rigid];
                    offset += features.offset;
                    let wall = (!features.is_all).then_some(*rigid as u32);
                    (vec![mesh, CollisionMesh::of_rigid(features, *first)], wall, Some(*rigid as u32))
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
            motion: vec![Vector3::zeros(); places.len()],
            listed: Configuration { place: places, stances },
            legs: BTreeMap::new(),
            shifts: Vec::new(),
            contacts,
        }
    }

    /// Returns, for each contact, the number of pairs that never touch because they coincide at rest.
    pub fn apart_counts(&self) -> Vec<usize> {
        self.groups.iter().map(Group::apart_count).collect()
    }

    /// Lets surfaces be as large as rigid things are now.
    pub(super) fn grow(&mut self, now: &[Stance]) {
        for group in &mut self.groups {
            group.parameters.growth = group.thing.map_or(0.0, |thing| now[thing as usize].growth);
        }
    }

    /// Sets the motions of all nodes. Nodes of the model go a part of one motion (six numbers a node). Rigid
    /// things go from their present place to a fraction of the step between both ends.
    pub(super) fn set_motion(
        &mut self,
        now: &Configuration,
        motion: &[f64],
        part: f64,
        [from, to]: &[Vec<Stance>; 2],
        time_fraction: f64,
    ) {
        for (moved, way) in self.motion.iter_mut().zip(motion.chunks_exact(6)) {
            *moved = Vector3::new(way[0], way[1], way[2]) * part;
        }
        let then = |thing: u32| Stance::between([&from[thing as usize], &to[thing as usize]], time_fraction);
        for (node, (thing, x)) in (self.nodes..).zip(&self.rigid_nodes) {
            let target = (then(*thing).pose * Point3::from(*x)).coords;
            self.motion[node] = target - now.place[node];
        }
        for group in &mut self.groups {
            group.rise =
                group.thing.map_or(0.0, |thing| then(thing).growth - now.stances[thing as usize].growth);
        }
    }

    /// Lists pairs that may come near in the motion that is set. Returns the part of it for which the lists
    /// hold.
    pub(super) fn list(&mut self, now: &Configuration) -> f64 {
        self.listed.clone_from(now);
        let Self { groups, motion, wall_distances, contacts, .. } = self;
        let mut holds: f64 = 1.0;
        for (group, distances) in groups.iter_mut().zip(wall_distances) {
            holds = holds.min(group.list(&now.place, motion));
            let Some(wall) = group.wall else { continue };
            let (rigid, stance) = (&contacts.rigids[wall as usize], &now.stances[wall as usize]);
            for (distance, &node) in distances.iter_mut().zip(&group.sides[0].points) {
                *distance = rigid.distance(stance, &now.place[node as usize]);
            }
        }
        holds
    }

    /// Takes the places of all nodes; whether no node has left its skin.
    pub(super) fn lists_hold(&mut self, now: &Configuration) -> bool {
        let mut holds = true;
        for group in &mut self.groups {
            holds &= group.take(&now.place, &self.listed.place);
        }
        holds
    }

    /// Takes the places of all nodes, and lists pairs anew if one has left its skin.
    pub(super) fn relist(&mut self, now: &Configuration) {
        if !self.lists_hold(now) {
            // A rigid thing turns on an arc, and a line search may stop on it outside of the lists.
            self.motion.fill(Vector3::zeros());
            self.list(now);
        }
    }

    /// True if no node leaves its skin in the motion that is set.
    pub(super) fn lists_have_motion(&self, now: &Configuration) -> bool {
        self.groups.iter().all(|group| group.has(&now.place, &self.listed.place, &self.motion))
    }

    /// Returns the way [m] that a rigid thing has gone since pairs were listed.
    pub(super) fn travel(&self, wall: u32, now: &Configuration) -> f64 {
        let rigid = &self.contacts.rigids[wall as usize];
        let [then, now] = [&self.listed, now].map(|configuration| configuration.stances[wall as usize]);
        if then == now { 0.0 } else { Passage::new(rigid, [then, now]).travel_from(rigid, &then) }
    }

    /// Adds the collisions of a configuration; false if there is no gap somewhere.
    pub(super) fn find_collisions(
        &mut self,
        now: &Configuration,
        collisions: &mut Vec<NormalCollision>,
    ) -> bool {
        self.relist(now);
        self.groups.iter().zip(&self.wall_distances).all(|(group, distances)| {
            group.find_collisions(&now.place, collisions)
                && self.find_collisions_at_wall(group, distances, now, collisions)
        })
    }

    /// Adds the collisions of nodes with the wall of a contact, with their distances [m] when pairs were
    /// listed. Returns false if one has no gap.
    fn find_collisions_at_wall(
        &self,
        group: &Group,
        distances: &[f64],
        now: &Configuration,
        collisions: &mut Vec<NormalCollision>,
    ) -> bool {
        let Some(wall) = group.wall else { return true };
        let (rigid, stance) = (&self.contacts.rigids[wall as usize], &now.stances[wall as usize]);
        let (travel, parameters) = (self.travel(wall, now), group.parameters.of_wall());
        let reach = parameters.reach();
        let side = &group.sides[0];
        let points = side.points.iter().zip(&side.point_areas).zip(distances);
        for ((&node, &area), then) in points {
            let place = &now.place[node as usize];
            let way = (place - self.listed.place[node as usize]).norm();
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
                collisions.push(NormalCollision { side, ..collision });
            }
        }
        true
    }

    /// A node of a rigid thing: the thing and its place [m] in its frame.
    pub(super) fn rigid_node(&self, node: u32) -> Option<&(u32, Vector3<f64>)> {
        (node as usize).checked_sub(self.nodes).map(|at| &self.rigid_nodes[at])
    }

    /// Returns the nodes that belong to the model.
    pub(super) fn nodes_of_model(&self, nodes: &[u32]) -> Vec<u32> {
        nodes.iter().copied().filter(|&node| (node as usize) < self.nodes).collect()
    }
}
