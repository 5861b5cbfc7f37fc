//! Surfaces at rigid things in a step: nodes are predicted, they and points between them are corrected, and the forces that do it are found.
//! A point x = Σ cᵢ xᵢ of a triangle is corrected by forces cᵢ λ on its corners; points go one after another (Gauss–Seidel), nodes last.

use std::sync::Arc;

use nalgebra::Vector3;
use pliant_contact::touch::{Contacts, Passage, lattice, parts_of};
use pliant_mechanics::tensor::{Vector, add};

/// Passes over all points at most.
const PASSES: usize = 4;
/// Part of the longest edge of a surface within which its nodes are looked at, beside the way that they go.
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

/// What a contact is about, in numbers of nodes of [`Touching`].
struct Own {
    nodes: Vec<u32>,
    faces: Vec<[u32; 3]>,
    /// Points of each face.
    samples: Vec<[f64; 3]>,
    /// Faces that may touch in this step.
    near: Vec<u32>,
    /// How near [m] all are looked at.
    margin: f64,
}

/// The contacts of a model, with the nodes that they are about.
pub(crate) struct Touching {
    contacts: Arc<Contacts>,
    numbers: Vec<u32>,
    nodes: Vec<Node>,
    own: Vec<Own>,
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
            Own {
                nodes: contact.nodes.iter().map(number).collect(),
                faces: contact.faces.iter().map(|face| face.map(|node| number(&node))).collect(),
                samples: lattice(parts_of(longest, &contacts.rigids[contact.rigid].shape)),
                near: Vec::new(),
                margin: MARGIN * longest,
            }
        });
        let own = own.collect();
        let zero = Vector3::zeros();
        let node = Node { now: zero, free: zero, then: zero, mobility: zero, near: false };
        let forces = vec![[0.0; 3]; contacts.contacts.len()];
        Self { nodes: vec![node; numbers.len()], numbers, own, forces, contacts }
    }

    /// Finds the forces of contacts in the step between two times [s]. `now` is the place of a node [m] and about the way [m] it goes in the
    /// step.
    pub fn find(
        &mut self,
        times: [f64; 2],
        now: impl Fn(u32) -> (Vector<f64>, f64),
        free: impl Fn(u32) -> Free,
        mut push: impl FnMut(u32, Vector<f64>),
    ) {
        let Self { contacts, numbers, nodes, own, forces } = self;
        forces.fill([0.0; 3]);
        let mut farthest = 0.0_f64;
        for (node, &number) in nodes.iter_mut().zip(numbers.iter()) {
            let (place, way) = now(number);
            (node.now, node.near) = (place.into(), false);
            farthest = farthest.max(way);
        }
        let mut touched = false;
        for (contact, own) in contacts.contacts.iter().zip(own.iter_mut()) {
            let passage = Passage::new(&contacts.rigids[contact.rigid], times);
            // A way can double in a step.
            let room = contact.touch.offset + own.margin + passage.travel() + 2.0 * farthest;
            own.near.clear();
            for &node in &own.nodes {
                let node = &mut nodes[node as usize];
                node.near |= passage.distance(&node.now) < room;
                touched |= node.near;
            }
            if own.samples.is_empty() {
                continue;
            }
            for (index, face) in own.faces.iter().enumerate() {
                let corners = face.map(|node| nodes[node as usize].now);
                let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
                let reach = corners.iter().map(|corner| (corner - centre).norm()).fold(0.0, f64::max);
                if passage.distance(&centre) < room + reach {
                    own.near.push(index as u32);
                    face.iter().for_each(|&node| nodes[node as usize].near = true);
                    touched = true;
                }
            }
        }
        if !touched {
            return;
        }
        for (node, &number) in nodes.iter_mut().zip(numbers.iter()).filter(|(node, _)| node.near) {
            let Free { then, mobility } = free(number);
            (node.free, node.then, node.mobility) = (then.into(), then.into(), mobility.into());
        }
        for _ in 0..PASSES {
            let mut violated = false;
            for (index, contact) in contacts.contacts.iter().enumerate() {
                let passage = Passage::new(&contacts.rigids[contact.rigid], times);
                let Own { nodes: single, faces, samples, near, .. } = &own[index];
                let points = near
                    .iter()
                    .flat_map(|&face| samples.iter().map(move |weights| (faces[face as usize], *weights)));
                let single = single.iter().filter(|&&node| nodes[node as usize].near);
                let single: Vec<_> = single.map(|&node| ([node; 3], [1.0, 0.0, 0.0])).collect();
                for (corners, weights) in points.chain(single) {
                    let sum = |field: &dyn Fn(&Node) -> Vector3<f64>, power: i32| {
                        let corner = |k: usize| field(&nodes[corners[k] as usize]) * weights[k].powi(power);
                        (0..3).filter(|&k| weights[k] > 0.0).fold(Vector3::zeros(), |sum, k| sum + corner(k))
                    };
                    let (now, then) = (sum(&|node| node.now, 1), sum(&|node| node.then, 1));
                    let mobility = sum(&|node| node.mobility, 2);
                    let Some(place) = contact.touch.pass(&passage, &now, &then, &mobility) else { continue };
                    let moved = place - then;
                    violated |= moved.norm() > 1e-9 * (place - now).norm();
                    let force = moved.zip_map(&mobility, |moved, m| if m > 0.0 { moved / m } else { 0.0 });
                    forces[index] = add(forces[index], force.into());
                    for k in (0..3).filter(|&k| weights[k] > 0.0) {
                        let node = &mut nodes[corners[k] as usize];
                        node.then += node.mobility.component_mul(&force) * weights[k];
                    }
                }
            }
            if !violated {
                break;
            }
        }
        for (node, &number) in nodes.iter().zip(numbers.iter()).filter(|(node, _)| node.near) {
            let moved = node.then - node.free;
            if moved != Vector3::zeros() {
                let over = |c: usize| if node.mobility[c] > 0.0 { moved[c] / node.mobility[c] } else { 0.0 };
                push(number, [over(0), over(1), over(2)]);
            }
        }
    }
}
