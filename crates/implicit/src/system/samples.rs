//! Surfaces of contacts on the curved surface of shells. Each facet is divided into n² flat triangles, n =
//! 2^level, whose corners are points of its patch. Points on an edge belong to both of its facets, so that
//! nothing opens. Points are numbered after the nodes of the model. Forces on them go to nodes by Jᵀ, with
//! moments. Leaves out: dJᵀ/dq f in the stiffness.

use std::collections::BTreeMap;

use nalgebra::{SMatrix, Vector3, Vector6};
use pliant_contact::barrier::{BarrierStep, Matrix12};
use pliant_contact::pairs::Surface;
use pliant_contact::touch::{Contact, Contacts, With};
use pliant_linear::sparse::{Equations, LowerMatrix};
use pliant_shells::{EdgeRule, Place};

use crate::curved::surface::CurvedSurface;
use crate::model::assembly::Assembly;
use crate::model::state::AssemblyState;
use crate::system::followers::Followers;

/// J of a point: its velocity over the velocity and the spin of a node.
pub(crate) type ByNode = SMatrix<f64, 3, 6>;

/// Points of contacts that are no nodes.
pub(crate) struct Samples {
    /// Nodes of the model.
    nodes: usize,
    surface: CurvedSurface,
    /// Places of the points on the surface, facet by facet.
    points: Vec<Place>,
    /// Positions [m] of nodes, then of the points; J of the points.
    pub(crate) places: Vec<Vector3<f64>>,
    jacobians: Vec<SMatrix<f64, 3, 18>>,
    /// Motions of nodes and points, six numbers each, of which translations count.
    pub(crate) motion: Vec<f64>,
    /// A state that is tried.
    tried: AssemblyState,
}

/// Numbers the points of facets as they are asked for.
struct Numbers {
    nodes: u32,
    points: Vec<Place>,
    /// By the lower and the higher node of an edge, and parts of it from the lower one.
    on_edges: BTreeMap<[u32; 4], u32>,
    /// By the facet, and parts of its area coordinates.
    within: BTreeMap<[u32; 4], u32>,
}

impl Numbers {
    /// The point of a facet with its nodes at parts of n, which add up to it.
    fn at(&mut self, facet: u32, nodes: [u32; 3], parts: [u32; 3], n: u32) -> u32 {
        let held: Vec<usize> = (0..3).filter(|&k| parts[k] > 0).collect();
        let next = self.nodes + self.points.len() as u32;
        let number = match held[..] {
            [corner] => return nodes[corner],
            [a, b] => {
                let (low, high) = if nodes[a] < nodes[b] { (a, b) } else { (b, a) };
                let common = gcd(parts[low], n);
                *self
                    .on_edges
                    .entry([nodes[low], nodes[high], parts[low] / common, n / common])
                    .or_insert(next)
            }
            _ => {
                let common = gcd(gcd(parts[0], parts[1]), n);
                let key = [facet, parts[0] / common, parts[1] / common, n / common];
                *self.within.entry(key).or_insert(next)
            }
        };
        if number == next {
            let weights = parts.map(|part| f64::from(part) / f64::from(n));
            self.points.push(Place { facet, weights });
        }
        number
    }
}

fn gcd(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { gcd(b, a % b) }
}

impl Samples {
    /// Makes the points for contacts of a model, each at its level, and contacts with surfaces of these
    /// points. `None` if all levels are 0.
    pub(crate) fn of(model: &Assembly, contacts: &Contacts, levels: &[u8]) -> Option<(Self, Contacts)> {
        if levels.iter().all(|&level| level == 0) {
            return None;
        }
        let sorted = |mut nodes: [u32; 3]| {
            nodes.sort_unstable();
            nodes
        };
        let facets: BTreeMap<[u32; 3], u32> =
            model.facets.iter().zip(0..).map(|(facet, number)| (sorted(facet.nodes), number)).collect();
        let mut numbers = Numbers {
            nodes: model.rest.len() as u32,
            points: Vec::new(),
            on_edges: BTreeMap::new(),
            within: BTreeMap::new(),
        };
        let mut divided = |surface: &Surface, level: u8| {
            let n = 1 << level;
            let mut faces = Vec::with_capacity(surface.faces.len() * (n * n) as usize);
            for face in &surface.faces {
                let Some(&facet) = facets.get(&sorted(*face)).filter(|_| level > 0) else {
                    faces.push(*face);
                    continue;
                };
                // The corners of the face may be in another order than in its facet.
                let corners = model.facets[facet as usize].nodes;
                let mut at = |i: u32, j: u32| {
                    let of_face = [n - i - j, i, j];
                    let parts = corners
                        .map(|node| face.iter().position(|&corner| corner == node).map_or(0, |k| of_face[k]));
                    numbers.at(facet, corners, parts, n)
                };
                for j in 0..n {
                    for i in 0..n - j {
                        faces.push([at(i, j), at(i + 1, j), at(i, j + 1)]);
                        if i + j + 1 < n {
                            faces.push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
                        }
                    }
                }
            }
            let mut nodes: Vec<u32> = surface.nodes.iter().chain(faces.iter().flatten()).copied().collect();
            nodes.sort_unstable();
            nodes.dedup();
            Surface { nodes, faces }
        };
        let of = |contact: &Contact, level: u8, divided: &mut dyn FnMut(&Surface, u8) -> Surface| {
            let with = match &contact.with {
                With::Body(other) => With::Body(divided(other, level)),
                same => same.clone(),
            };
            Contact { surface: divided(&contact.surface, level), with, ..contact.clone() }
        };
        let divided_contacts =
            contacts.contacts.iter().zip(levels).map(|(contact, &level)| of(contact, level, &mut divided));
        let sampled = Contacts { contacts: divided_contacts.collect(), ..contacts.clone() };
        let points = numbers.points;
        let state = AssemblyState::at_rest(model);
        let mut samples = Self {
            surface: CurvedSurface::new(model, EdgeRule::Arc),
            jacobians: vec![SMatrix::zeros(); points.len()],
            motion: vec![0.0; 6 * (model.rest.len() + points.len())],
            points,
            places: Vec::new(),
            tried: state.clone(),
            nodes: model.rest.len(),
        };
        samples.place(model, &state);
        Some((samples, sampled))
    }

    /// Finds places and J at a state.
    pub(crate) fn place(&mut self, model: &Assembly, state: &AssemblyState) {
        self.places.clear();
        self.places.extend_from_slice(&state.position);
        let mut last = None;
        for (point, jacobian) in self.points.iter().zip(&mut self.jacobians) {
            let patch = match last.take() {
                Some((facet, patch)) if facet == point.facet => patch,
                _ => self.surface.patch(model, state, point.facet),
            };
            self.places.push(patch.point(point.weights));
            *jacobian = patch.jacobian(point.weights);
            last = Some((point.facet, patch));
        }
    }

    /// A node that moves a point, or the node itself.
    pub(crate) fn node_at(&self, model: &Assembly, number: u32) -> u32 {
        match self.point(number) {
            Some(at) => model.facets[self.points[at].facet as usize].nodes[0],
            None => number,
        }
    }

    /// Index of the point with a number; `None` if the number belongs to a node.
    fn point(&self, number: u32) -> Option<usize> {
        (number as usize).checked_sub(self.nodes)
    }

    /// Calls back with the nodes of a point and their area coordinates, or with the node itself.
    pub(crate) fn shares(&self, model: &Assembly, number: u32, mut found: impl FnMut(u32, f64)) {
        let Some(at) = self.point(number) else { return found(number, 1.0) };
        let Place { facet, weights } = self.points[at];
        let nodes = model.facets[facet as usize].nodes;
        nodes
            .into_iter()
            .zip(weights)
            .filter(|(_, weight)| *weight > 0.0)
            .for_each(|(node, weight)| found(node, weight));
    }

    /// Finds the motion of nodes and points along an increment, from a state with the places found last. The
    /// motion of a point is its way over a part of the increment, divided by that part.
    pub(crate) fn move_along(
        &mut self,
        model: &Assembly,
        state: &AssemblyState,
        increment: &[f64],
        part: f64,
    ) {
        self.tried.clone_from(state);
        self.tried.advance(increment, part);
        self.motion[..6 * self.nodes].copy_from_slice(increment);
        let mut last = None;
        for (at, point) in self.points.iter().enumerate() {
            let patch = match last.take() {
                Some((facet, patch)) if facet == point.facet => patch,
                _ => self.surface.patch(model, &self.tried, point.facet),
            };
            let way = (patch.point(point.weights) - self.places[self.nodes + at]) / part;
            self.motion[6 * (self.nodes + at)..][..3].copy_from_slice(way.as_slice());
            last = Some((point.facet, patch));
        }
    }

    /// Adds the forces on points, six numbers each from the first node on, to the forces on nodes by Jᵀ.
    pub(crate) fn give_back(&self, model: &Assembly, point_forces: &[f64], forces: &mut [f64]) {
        forces.copy_from_slice(&point_forces[..forces.len()]);
        for (at, point) in self.points.iter().enumerate() {
            let force =
                Vector3::from_column_slice(&point_forces[forces.len() + 6 * at..forces.len() + 6 * at + 3]);
            if force == Vector3::zeros() {
                continue;
            }
            let back = self.jacobians[at].tr_mul(&force);
            for (corner, &node) in model.facets[point.facet as usize].nodes.iter().enumerate() {
                let on_node = &mut forces[6 * node as usize..6 * node as usize + 6];
                on_node
                    .iter_mut()
                    .zip(back.fixed_rows::<6>(6 * corner).iter())
                    .for_each(|(entry, back)| *entry += back);
            }
        }
    }
}

/// Nodes that move the points of contacts: a node itself, the nodes that a tied node follows, or the nodes
/// around a point on a curved surface.
#[derive(Clone, Copy)]
pub(crate) struct Movers<'a> {
    pub model: &'a Assembly,
    pub followers: Option<&'a Followers>,
    pub samples: Option<&'a Samples>,
}

impl Movers<'_> {
    /// Calls back with the nodes that move a point, and its J by each.
    fn of(self, number: u32, mut found: impl FnMut(u32, ByNode)) {
        if let Some((samples, at)) = self.samples.and_then(|samples| Some((samples, samples.point(number)?)))
        {
            let nodes = self.model.facets[samples.points[at].facet as usize].nodes;
            for (corner, node) in nodes.into_iter().enumerate() {
                let by = samples.jacobians[at].fixed_columns::<6>(6 * corner).into_owned();
                // Points on an edge have nothing of the node across.
                if by != ByNode::zeros() {
                    found(node, by);
                }
            }
            return;
        }
        movers_of(number, self.followers, |node, weight| {
            let mut by = ByNode::zeros();
            by.fixed_columns_mut::<3>(0).fill_diagonal(weight);
            found(node, by);
        });
    }

    /// Calls back with each pair of the nodes that move these, the lower number first.
    pub(crate) fn each_pair(self, numbers: &[u32], mut found: impl FnMut([u32; 2])) {
        for (at, &a) in numbers.iter().enumerate() {
            for &b in &numbers[..at] {
                self.nodes(a, &mut |a| {
                    self.nodes(b, &mut |b| {
                        if a != b {
                            found([a.min(b), a.max(b)]);
                        }
                    });
                });
            }
        }
    }

    fn nodes(self, number: u32, found: &mut dyn FnMut(u32)) {
        match self.samples.filter(|samples| samples.point(number).is_some()) {
            Some(_) => self.of(number, |node, _| found(node)),
            None => movers_of(number, self.followers, |node, _| found(node)),
        }
    }

    /// Adds the stiffness to a matrix whose pattern couples translations and rotations. It adds the forces
    /// from the remaining ways of rigid things and of prescribed nodes to the coupling.
    pub(crate) fn add_stiffness(
        self,
        step: &BarrierStep,
        equations: &Equations,
        matrix: &mut LowerMatrix,
        moved: &[f64],
        coupling: &mut [f64],
    ) {
        let mut movers: Vec<(u32, usize, ByNode)> = Vec::new();
        step.stiffness(|stencil, block, mut ways| {
            let count = usize::from(stencil.count);
            movers.clear();
            for at in
                (0..count).filter(|&at| (stencil.nodes[at] as usize) < step.node_count() && acts(block, at))
            {
                self.of(stencil.nodes[at], |node, by| movers.push((node, at, by)));
            }
            let part = |row: usize, column: usize| block.fixed_view::<3, 3>(3 * row, 3 * column);
            for (row_node, row, by_row) in &movers {
                for (column_node, column, by_column) in &movers {
                    if row_node >= column_node {
                        let entries = by_row.transpose() * part(*row, *column) * by_column;
                        matrix
                            .add_node_block(equations, [*row_node, *column_node], 6, |i, j| entries[(i, j)]);
                    }
                }
            }
            // The rest of the way of prescribed nodes counts like the way of rigid things.
            for (node, at, by) in &movers {
                ways[*at] += by * Vector6::from_column_slice(&moved[6 * *node as usize..][..6]);
            }
            if ways == [Vector3::zeros(); 4] {
                return;
            }
            for (node, row, by) in &movers {
                let pull: Vector3<f64> = (0..count).map(|column| part(*row, column) * ways[column]).sum();
                for (c, value) in by.tr_mul(&pull).iter().enumerate() {
                    let equation = equations.number[6 * *node as usize + c];
                    if let Some(coupling) = coupling.get_mut(equation as usize) {
                        *coupling += value;
                    }
                }
            }
        });
    }
}

/// Calls back with the nodes that move a node, and their weights: itself, or those that it is tied to.
pub(crate) fn movers_of(node: u32, followers: Option<&Followers>, mut found: impl FnMut(u32, f64)) {
    match followers.filter(|followers| followers.follows(node)) {
        None => found(node, 1.0),
        Some(followers) => followers.weights(node).for_each(|(node, weight)| found(node, weight)),
    }
}

/// True if a node has a non-zero part in a stiffness that is never negative.
pub(crate) fn acts(block: &Matrix12, at: usize) -> bool {
    (3 * at..3 * at + 3).any(|k| block[(k, k)] != 0.0)
}

#[cfg(test)]
mod tests;
