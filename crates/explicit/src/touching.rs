//! Surfaces at rigid things in a step: nodes are predicted, and impulses found that keep them and points between them out of the things.
//! A point x = Σ cᵢ xᵢ of a triangle with normal n and gap g is a row: impulses cᵢ λ on its corners with λ ≥ 0, g ≥ 0 and λ g = 0, and against
//! its slip by at most μ λ. Projected Gauss–Seidel finds them; a last pass over nodes alone keeps these out of curved things, too.

use std::sync::Arc;

use nalgebra::Vector3;
use pliant_contact::shape::Near;
use pliant_contact::touch::{Contacts, Passage, lattice, parts_of};
use pliant_mechanics::tensor::{Vector, add};

/// Passes over all rows at most.
const PASSES: usize = 30;
/// The change of a gap in a pass, over the deepest one, at which impulses are found.
const FOUND: f64 = 1e-3;
/// Gaps, over the depth of the deepest point, up to which points take part.
const BAND: f64 = 8.0;
/// Part of the longest edge of a surface that a node may be away from a thing and still count as near, in addition to its way in the step.
const MARGIN: f64 = 0.1;

/// Where a node goes without contact.
pub(crate) struct Free {
    /// Its place [m] after the step.
    pub then: Vector<f64>,
    /// By how much a force moves each component over the step [m/N]; zero of those that are prescribed.
    pub mobility: Vector<f64>,
}

/// A node in a step.
#[derive(Clone, Copy, Debug)]
struct Node {
    now: Vector3<f64>,
    free: Vector3<f64>,
    then: Vector3<f64>,
    mobility: Vector3<f64>,
    /// Whether it may touch something, so that its prediction is known.
    near: bool,
}

impl Node {
    const NONE: Self = {
        let zero = Vector3::new(0.0, 0.0, 0.0);
        Self { now: zero, free: zero, then: zero, mobility: zero, near: false }
    };
}

/// What a contact is about, in numbers of nodes of [`Touching`].
struct Own {
    nodes: Vec<u32>,
    faces: Vec<[u32; 3]>,
    /// Points of each face.
    samples: Vec<[f64; 3]>,
    /// How far [m] a point of a face can be from its nearest corner.
    reach: f64,
    /// Distance [m] at which a node at rest still counts as near.
    margin: f64,
    passage: Passage,
}

/// A point that may touch a thing.
struct Row {
    contact: usize,
    corners: [u32; 3],
    weights: [f64; 3],
    normal: Vector3<f64>,
    /// The gap [m] as predicted, and the place [m] then.
    gap: f64,
    place: Vector3<f64>,
    /// Where the thing carries the point [m].
    carried: Vector3<f64>,
    mobility: Vector3<f64>,
    /// Impulse over the step along the normal [N], and across it.
    push: f64,
    drag: Vector3<f64>,
}

/// The contacts of a model, with the nodes that they are about.
pub(crate) struct Touching {
    contacts: Arc<Contacts>,
    numbers: Vec<u32>,
    nodes: Vec<Node>,
    own: Vec<Own>,
    /// Distances [m] of the nodes of a contact, by node.
    distances: Vec<f64>,
    rows: Vec<Row>,
    /// The force [N] of each contact on its body at the last evaluation.
    pub forces: Vec<Vector<f64>>,
}

impl Touching {
    /// Those of a model with these nodes at rest [m].
    pub fn new(contacts: Arc<Contacts>, rest: &[Vector<f64>]) -> Self {
        let mut numbers: Vec<u32> = contacts.contacts.iter().flat_map(|own| &own.nodes).copied().collect();
        numbers.sort_unstable();
        numbers.dedup();
        // Faces are of nodes that touch.
        let number = |node: &u32| numbers.partition_point(|known| known < node) as u32;
        let own = contacts.contacts.iter().map(|contact| {
            let place = |node: u32| Vector3::from(rest[node as usize]);
            let edges = contact.faces.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
            let longest = edges.map(|[a, b]| (place(a) - place(b)).norm()).fold(0.0, f64::max);
            let rigid = &contacts.rigids[contact.rigid];
            Own {
                nodes: contact.nodes.iter().map(number).collect(),
                faces: contact.faces.iter().map(|face| face.map(|node| number(&node))).collect(),
                samples: lattice(parts_of(longest, &rigid.shape)),
                reach: longest,
                margin: MARGIN * longest,
                passage: Passage::new(rigid, [0.0; 2]),
            }
        });
        let own = own.collect();
        Self {
            nodes: vec![Node::NONE; numbers.len()],
            distances: vec![0.0; numbers.len()],
            rows: Vec::new(),
            numbers,
            own,
            forces: vec![[0.0; 3]; contacts.contacts.len()],
            contacts,
        }
    }

    /// Finds the forces of contacts in the step between two times [s]. `now` is the place of a node [m] and about the way [m] it goes in the
    /// step.
    pub fn find(
        &mut self,
        times: [f64; 2],
        now: impl Fn(u32) -> (Vector<f64>, f64),
        free: impl Fn(u32) -> Free,
    ) {
        self.forces.fill([0.0; 3]);
        let mut farthest = 0.0_f64;
        for (node, &number) in self.nodes.iter_mut().zip(&self.numbers) {
            let (place, way) = now(number);
            (node.now, node.near) = (place.into(), false);
            farthest = farthest.max(way);
        }
        self.find_rows(times, farthest, free);
        if self.rows.is_empty() {
            return;
        }
        self.sweep();
        self.solve();
        self.lift();
    }

    /// The force [N] on each node that touches something.
    pub fn nodal_forces(&self) -> impl Iterator<Item = (u32, Vector<f64>)> {
        let touching = |(node, _): &(&Node, &u32)| node.near && node.then != node.free;
        let nodes = self.nodes.iter().zip(&self.numbers).filter(touching);
        nodes.map(|(node, &number)| (number, over(&(node.then - node.free), &node.mobility).into()))
    }

    /// Rows of all points that may touch in the step.
    fn find_rows(&mut self, times: [f64; 2], farthest: f64, free: impl Fn(u32) -> Free) {
        let Self { contacts, numbers, nodes, own, distances, rows, .. } = self;
        rows.clear();
        let blank = |contact, corners, weights| {
            let zero = Vector3::zeros();
            let (normal, place, carried, mobility, drag) = (zero, zero, zero, zero, zero);
            Row { contact, corners, weights, normal, gap: 0.0, place, carried, mobility, push: 0.0, drag }
        };
        for (index, (contact, own)) in contacts.contacts.iter().zip(own.iter_mut()).enumerate() {
            let rigid = &contacts.rigids[contact.rigid];
            own.passage = Passage::new(rigid, times);
            // A way can double in a step.
            let room = contact.touch.offset + own.margin + own.passage.travel(rigid) + 2.0 * farthest;
            let mut nearest = f64::INFINITY;
            for &node in &own.nodes {
                let distance = own.passage.near(rigid, &nodes[node as usize].now).distance;
                distances[node as usize] = distance;
                nearest = nearest.min(distance);
                if distance < room {
                    nodes[node as usize].near = true;
                    rows.push(blank(index, [node; 3], [1.0, 0.0, 0.0]));
                }
            }
            if own.samples.is_empty() || nearest > room + own.reach {
                continue;
            }
            for &face in &own.faces {
                let corners = face.map(|node| nodes[node as usize].now);
                let around = (corners[0] - corners[1]).norm().max((corners[0] - corners[2]).norm());
                let least = face.iter().map(|&node| distances[node as usize]).fold(f64::INFINITY, f64::min);
                if least < room + around {
                    face.iter().for_each(|&node| nodes[node as usize].near = true);
                    rows.extend(own.samples.iter().map(|&weights| blank(index, face, weights)));
                }
            }
        }
        for (node, &number) in nodes.iter_mut().zip(numbers.iter()).filter(|(node, _)| node.near) {
            let Free { then, mobility } = free(number);
            (node.free, node.then, node.mobility) = (then.into(), then.into(), mobility.into());
        }
    }

    /// Takes nodes along that a fast thing would pass over.
    fn sweep(&mut self) {
        for ((contact, own), force) in self.contacts.contacts.iter().zip(&self.own).zip(&mut self.forces) {
            if own.passage.is_fast() {
                let rigid = &self.contacts.rigids[contact.rigid];
                for &node in &own.nodes {
                    let node = &mut self.nodes[node as usize];
                    let Node { now, then, mobility, near, .. } = *node;
                    let place = near.then(|| contact.touch.pass(rigid, &own.passage, &now, &then, &mobility));
                    if let Some(place) = place.flatten() {
                        node.then = place;
                        *force = add(*force, over(&(place - then), &mobility).into());
                    }
                }
            }
        }
    }

    /// Impulses of all rows, by projected Gauss–Seidel.
    fn solve(&mut self) {
        let Self { contacts, nodes, own, rows, forces, .. } = self;
        let mut deepest = 0.0_f64;
        rows.retain_mut(|row| {
            let contact = &contacts.contacts[row.contact];
            let own = &own[row.contact];
            let mut now = Vector3::zeros();
            for (&corner, &weight) in row.corners.iter().zip(&row.weights) {
                let node = &nodes[corner as usize];
                row.place += node.then * weight;
                now += node.now * weight;
                row.mobility += node.mobility * (weight * weight);
            }
            let Near { distance, normal } = own.passage.near(&contacts.rigids[contact.rigid], &row.place);
            (row.normal, row.gap) = (normal, distance - contact.touch.offset);
            row.carried = own.passage.carry(&now);
            deepest = deepest.max(-row.gap);
            row.gap < own.margin
        });
        if deepest <= 0.0 {
            return;
        }
        // No impulse moves a point farther than a few times the deepest one.
        rows.retain(|row| row.gap < BAND * deepest);
        for _ in 0..PASSES {
            let mut change = 0.0_f64;
            for row in rows.iter_mut() {
                let mut place = Vector3::zeros();
                for (&corner, &weight) in row.corners.iter().zip(&row.weights) {
                    place += nodes[corner as usize].then * weight;
                }
                let along = row.mobility.component_mul(&row.normal).dot(&row.normal);
                if along <= 0.0 {
                    continue;
                }
                let gap = row.gap + row.normal.dot(&(place - row.place));
                let before = row.push;
                row.push = (before - gap / along).max(0.0);
                let mut more = row.normal * (row.push - before);
                let friction = contacts.contacts[row.contact].touch.friction;
                if friction > 0.0 && (row.push > 0.0 || before > 0.0) {
                    let slip = place + row.mobility.component_mul(&more) - row.carried;
                    let slip = slip - row.normal * row.normal.dot(&slip);
                    let across = row.mobility.component_mul(&slip).dot(&slip) / slip.norm_squared();
                    let wanted = if across > 0.0 { row.drag - slip / across } else { row.drag };
                    let limit = friction * row.push;
                    let size = wanted.norm();
                    let drag = if size > limit { wanted * (limit / size) } else { wanted };
                    more += drag - row.drag;
                    row.drag = drag;
                }
                if more != Vector3::zeros() {
                    change = change.max(row.mobility.component_mul(&more).norm());
                    for (&corner, &weight) in row.corners.iter().zip(&row.weights) {
                        let node = &mut nodes[corner as usize];
                        node.then += node.mobility.component_mul(&more) * weight;
                    }
                }
            }
            if change < FOUND * deepest {
                break;
            }
        }
        for row in rows.iter() {
            forces[row.contact] = add(forces[row.contact], (row.normal * row.push + row.drag).into());
        }
    }

    /// Lifts nodes that are still in a thing.
    fn lift(&mut self) {
        for ((contact, own), force) in self.contacts.contacts.iter().zip(&self.own).zip(&mut self.forces) {
            let rigid = &self.contacts.rigids[contact.rigid];
            for &node in &own.nodes {
                let node = &mut self.nodes[node as usize];
                if !node.near {
                    continue;
                }
                let Near { distance, normal } = own.passage.near(rigid, &node.then);
                let along = node.mobility.component_mul(&normal);
                let gap = distance - contact.touch.offset;
                if gap < 0.0 && along.dot(&normal) > 0.0 {
                    let push = -gap / along.dot(&normal);
                    node.then += along * push;
                    *force = add(*force, (normal * push).into());
                }
            }
        }
    }
}

/// The force [N] of a way [m] over a mobility [m/N].
fn over(moved: &Vector3<f64>, mobility: &Vector3<f64>) -> Vector3<f64> {
    moved.zip_map(mobility, |moved, m| if m > 0.0 { moved / m } else { 0.0 })
}
