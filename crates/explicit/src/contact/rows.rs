//! Rows: pairs of points that may touch, with their impulses, and rows of single nodes.

use nalgebra::Vector3;
use pliant_contact::touch::{Contacts, PASSES, SIDES};

use super::Node;

/// Part of its gap by which its nodes can move before a row is looked at again; the rest is round-off.
const IDLE: f64 = 0.999;
/// The change of an impulse, over itself, at which it stays as it is until its nodes move.
const SETTLED: f64 = 1e-9;

/// Marks the absence of a row.
pub(super) const NONE: u32 = u32::MAX;

/// A pair of points that may touch.
pub(super) struct Row {
    pub contact: usize,
    pub nodes: [u32; 4],
    pub weights: [f64; 4],
    /// Number of nodes that take part.
    pub count: usize,
    pub normal: Vector3<f64>,
    /// The gap [m] as predicted, and Σ cᵢ xᵢ [m] then.
    pub gap: f64,
    pub place: Vector3<f64>,
    /// Σ cᵢ xᵢ [m] of no slip.
    pub carried: Vector3<f64>,
    pub mobility: Vector3<f64>,
    /// Impulse over the step along the normal [N], and across it.
    pub push: f64,
    pub drag: Vector3<f64>,
    /// 1 if the impulse acts on the first surface of the contact, −1 if on the second.
    pub sign: f64,
    /// Next row on the same node, for a row on a single node.
    pub next: u32,
    /// Σ |cᵢ| sᵢ [m] of the ways sᵢ of its nodes up to which its impulse stays as it is.
    pub idle_to: f64,
}

impl Row {
    pub fn new<const N: usize>(contact: usize, nodes: [u32; N], weights: [f64; N]) -> Self {
        let zero = Vector3::zeros();
        let (normal, place, carried, mobility, drag) = (zero, zero, zero, zero, zero);
        let at = |k: usize| k.min(N - 1);
        let nodes = std::array::from_fn(|k| nodes[at(k)]);
        let weights = std::array::from_fn(|k| weights[at(k)]);
        Self {
            contact,
            nodes,
            weights,
            count: N,
            normal,
            gap: 0.0,
            place,
            carried,
            mobility,
            push: 0.0,
            drag,
            sign: 1.0,
            next: NONE,
            idle_to: f64::NEG_INFINITY,
        }
    }

    /// The nodes that take part, with their weights.
    pub fn parts(&self) -> impl Iterator<Item = (usize, f64)> {
        self.nodes.iter().zip(&self.weights).take(self.count).map(|(&node, &weight)| (node as usize, weight))
    }

    /// Finds its impulse with the others as they are. How far it moves its point [m].
    pub fn push_apart(&mut self, nodes: &mut [Node], contacts: &Contacts) -> f64 {
        match self.count {
            1 => self.push_parts::<1>(nodes, contacts),
            2 => self.push_parts::<2>(nodes, contacts),
            3 => self.push_parts::<3>(nodes, contacts),
            _ => self.push_parts::<4>(nodes, contacts),
        }
    }

    /// [`push_apart`](Self::push_apart) for `N` nodes: loops of a length known to the compiler take less
    /// time.
    fn push_parts<const N: usize>(&mut self, nodes: &mut [Node], contacts: &Contacts) -> f64 {
        let parts: [(usize, f64); N] = std::array::from_fn(|k| (self.nodes[k] as usize, self.weights[k]));
        let way = |nodes: &[Node]| -> f64 {
            parts.iter().map(|&(node, weight)| weight.abs() * nodes[node].way).sum()
        };
        if self.idle_to >= 0.0 && way(nodes) <= self.idle_to {
            return 0.0;
        }
        let friction = contacts.contacts[self.contact].touch.friction;
        let along = self.mobility.component_mul(&self.normal).dot(&self.normal);
        if along <= 0.0 {
            return 0.0;
        }
        let mut place = Vector3::zeros();
        for (node, weight) in parts {
            place += nodes[node].then * weight;
        }
        let gap = self.gap + self.normal.dot(&(place - self.place));
        let before = self.push;
        self.push = (before - gap / along).max(0.0);
        let mut more = self.normal * (self.push - before);
        if friction > 0.0 && (self.push > 0.0 || before > 0.0) {
            let slip = place + self.mobility.component_mul(&more) - self.carried;
            let slip = slip - self.normal * self.normal.dot(&slip);
            let across = self.mobility.component_mul(&slip).dot(&slip) / slip.norm_squared();
            let wanted = if across > 0.0 { self.drag - slip / across } else { self.drag };
            let limit = friction * self.push;
            let size = wanted.norm();
            let drag = if size > limit { wanted * (limit / size) } else { wanted };
            more += drag - self.drag;
            self.drag = drag;
        }
        for (node, weight) in parts {
            nodes[node].go(nodes[node].mobility.component_mul(&more) * weight);
        }
        let is_found = more.norm_squared() <= SETTLED * SETTLED * self.push * self.push;
        let room = if self.push == 0.0 { IDLE * gap } else { 0.0 };
        self.idle_to = if is_found { way(nodes) + room } else { f64::NEG_INFINITY };
        self.mobility.component_mul(&more).norm()
    }

    /// Takes places and mobilities after the step; returns Σ cᵢ xᵢ [m] before the step.
    pub fn place(&mut self, places: &[Vector3<f64>], nodes: &[Node]) -> Vector3<f64> {
        let mut now = Vector3::zeros();
        let (mut place, mut mobility) = (Vector3::zeros(), Vector3::zeros());
        for (node, weight) in self.parts() {
            now += places[node] * weight;
            let node = &nodes[node];
            place += node.then * weight;
            mobility += node.mobility * (weight * weight);
        }
        (self.place, self.mobility) = (place, mobility);
        now
    }
}

/// Returns a row of a contact on a single node, either one without an impulse or a new one; `None` if the
/// node has the most rows allowed.
pub(super) fn idle(rows: &mut Vec<Row>, node: &mut Node, new: Row) -> Option<u32> {
    let (mut next, mut last, mut count) = (node.first, NONE, 0);
    while let Some(row) = rows.get(next as usize) {
        let is_own = row.contact == new.contact;
        if is_own && row.push == 0.0 {
            return Some(next);
        }
        count += usize::from(is_own);
        (last, next) = (next, row.next);
    }
    (count < SIDES).then(|| {
        let number = rows.len() as u32;
        rows.push(new);
        *rows.get_mut(last as usize).map_or(&mut node.first, |row| &mut row.next) = number;
        number
    })
}

/// Takes back the impulses of a contact on a single node. Returns the last such row, if there are any.
pub(super) fn take_back(rows: &mut [Row], node: &mut Node, contact: usize) -> Option<u32> {
    let (mut next, mut last) = (node.first, None);
    while let Some(row) = rows.get_mut(next as usize) {
        if row.contact == contact && row.push > 0.0 {
            node.go(-node.mobility.component_mul(&(row.normal * row.push + row.drag)));
            (row.push, row.drag) = (0.0, Vector3::zeros());
            last = Some(next);
        }
        next = row.next;
    }
    last
}

/// Impulses of the rows of a node alone, until they move it by no more than a length [m].
pub(super) fn push_alone(rows: &mut [Row], nodes: &mut [Node], number: u32, found: f64, contacts: &Contacts) {
    for _ in 0..PASSES {
        let (mut moved, mut next) = (0.0_f64, nodes[number as usize].first);
        while let Some(row) = rows.get_mut(next as usize) {
            moved = moved.max(row.push_apart(nodes, contacts));
            next = row.next;
        }
        if moved <= found {
            break;
        }
    }
}
