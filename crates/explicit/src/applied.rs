//! The forces of loads and gravity on the nodes of a model at one instant. Weights stay as they are until an
//! acceleration changes.

use std::ops::Range;
use std::sync::Arc;

use pliant_mechanics::grip::Grip;
use pliant_mechanics::load::{Load, LoadKind};
use pliant_mechanics::mapping::Displaced;
use pliant_mechanics::model::Model;
use pliant_mechanics::tensor::{Vector, add, scale};
use rayon::prelude::*;

use crate::lanes::LaneNumber;

/// Nodes whose forces are passed over together where nothing acts on them.
pub(crate) const BLOCK: usize = 128;

/// Nodes that a thread weighs at least.
const WEIGHED: usize = 4096;

/// Forces applied to the nodes, found anew for each instant.
pub(crate) struct AppliedForces<R> {
    model: Arc<Model>,
    /// Forces of loads [N], one per node.
    nodal: Vec<Vector<f64>>,
    /// Acceleration [m/s²] by gravity, one per body.
    gravity: Vec<Vector<f64>>,
    /// Weights [N], one per node; empty without gravity.
    weight: Vec<Vector<R>>,
    /// The accelerations that they were found with.
    weighed: Vec<Vector<f64>>,
    body_of: Vec<u16>,
    grips: Vec<Grip>,
    /// Forces [N] from outside that stay, one a node; empty for none.
    given: Vec<Vector<f64>>,
    /// True if more than gravity acts: other loads, grips or given forces.
    loaded: bool,
    /// The blocks of nodes that forces were added to at this instant, and a mark of each block.
    added: Vec<u32>,
    pushed: Vec<bool>,
}

fn is_gravity(load: &Load) -> bool {
    matches!(load.kind, LoadKind::Gravity { .. })
}

impl<R: LaneNumber> AppliedForces<R> {
    pub(crate) fn new(model: Arc<Model>) -> Self {
        let weighs = model.loads.iter().any(is_gravity);
        let mut body_of = vec![0; model.node_count()];
        for (index, body) in model.bodies.iter().enumerate() {
            body_of[body.nodes.start as usize..body.nodes.end as usize].fill(index as u16);
        }
        let mut applied = Self {
            nodal: vec![[0.0; 3]; model.node_count()],
            gravity: vec![[0.0; 3]; model.bodies.len()],
            weight: vec![[R::ZERO; 3]; if weighs { model.node_count() } else { 0 }],
            weighed: vec![[0.0; 3]; model.bodies.len()],
            loaded: false,
            added: Vec::new(),
            pushed: vec![false; model.node_count().div_ceil(BLOCK)],
            model,
            body_of,
            grips: Vec::new(),
            given: Vec::new(),
        };
        applied.see_whether_loaded();
        applied
    }

    /// Replaces the grips.
    pub(crate) fn grip(&mut self, grips: &[Grip]) {
        self.grips.clear();
        self.grips.extend_from_slice(grips);
        self.see_whether_loaded();
    }

    /// Replaces the lasting forces [N] from outside, one per node, or none.
    pub(crate) fn push(&mut self, forces: &[Vector<f64>]) {
        self.given.clear();
        self.given.extend_from_slice(forces);
        self.see_whether_loaded();
    }

    fn see_whether_loaded(&mut self) {
        self.nodal.fill([0.0; 3]);
        let falls_only = self.model.loads.iter().all(is_gravity);
        self.loaded = !(self.grips.is_empty() && self.given.is_empty() && falls_only);
    }

    /// Writes the forces [N] on a block of nodes, if any act.
    #[inline(always)]
    pub(crate) fn act_at(&self, nodes: Range<usize>, to: &mut [Vector<R>]) -> bool {
        if self.loaded || self.pushed[nodes.start / BLOCK] {
            to.iter_mut().zip(nodes).for_each(|(to, node)| *to = self.at(node));
            return true;
        }
        match self.weight.get(nodes) {
            Some(weights) => to[..weights.len()].copy_from_slice(weights),
            None => return false,
        }
        true
    }

    /// Adds a force [N] on a node to the forces of the instant.
    pub(crate) fn add(&mut self, node: u32, force: Vector<f64>) {
        self.nodal[node as usize] = add(self.nodal[node as usize], force);
        let block = node as usize / BLOCK;
        if !std::mem::replace(&mut self.pushed[block], true) {
            self.added.push(block as u32);
        }
    }

    /// Finds the forces at a time [s] and in a deformed place.
    pub(crate) fn update(&mut self, time: f64, displacement: &[Vector<R>]) {
        for block in self.added.drain(..).map(|block| block as usize) {
            self.pushed[block] = false;
            let end = self.nodal.len().min((block + 1) * BLOCK);
            self.nodal[block * BLOCK..end].fill([0.0; 3]);
        }
        self.weigh(time);
        if !self.loaded {
            return;
        }
        self.nodal.fill([0.0; 3]);
        let model = &self.model;
        let state = Displaced { rest: &model.rest, displacement, velocity: &[] };
        for load in &model.loads {
            let points = load.surface.map(|index| &model.surfaces[index].mapping);
            load.add_forces(time, points, &state, &mut self.nodal);
        }
        for grip in &self.grips {
            grip.add_forces(&state, &mut self.nodal);
        }
        for (force, given) in self.nodal.iter_mut().zip(&self.given) {
            *force = add(*force, *given);
        }
        model.give_back(&mut self.nodal);
    }

    /// Finds the accelerations at a time [s], and weights where they are needed and differ.
    fn weigh(&mut self, time: f64) {
        self.gravity.fill([0.0; 3]);
        for load in &self.model.loads {
            if let LoadKind::Gravity { body, acceleration } = load.kind {
                let now = scale(acceleration, load.curve.value(time));
                self.gravity[body] = add(self.gravity[body], now);
            }
        }
        if !self.loaded && self.weighed != self.gravity {
            self.weighed.clone_from(&self.gravity);
            let nodes = self.weight.par_iter_mut().zip(&self.model.mass).zip(&self.body_of);
            nodes.with_min_len(WEIGHED).for_each(|((weight, &mass), &body)| {
                *weight = scale(self.gravity[usize::from(body)], mass).map(R::of);
            });
        }
    }

    /// The force [N] on a node.
    #[inline(always)]
    pub(crate) fn at<N: LaneNumber>(&self, node: usize) -> Vector<N> {
        let gravity = self.gravity[self.body_of[node] as usize];
        let mass = self.model.mass[node];
        let force = |c: usize| N::of(self.nodal[node][c] + mass * gravity[c]);
        [force(0), force(1), force(2)]
    }
}

#[cfg(test)]
mod tests {
    use pliant_mechanics::curve::{Curve, Shape};
    use pliant_mechanics::model::Body;

    use super::*;

    /// Two bodies that fall at times of their own, over instants, while a force comes and goes: blocks have
    /// what their nodes have.
    #[test]
    fn forces_of_a_block_are_those_of_its_nodes() {
        let mut model = Model::default();
        let count = BLOCK + 40;
        model.rest = vec![[0.0; 3]; count];
        model.mass = (0..count).map(|node| 0.1 + node as f64).collect();
        for (number, nodes) in [0..50, 50..count as u32].into_iter().enumerate() {
            model.bodies.push(Body { name: number.to_string(), nodes, shared: vec![], damping: 0.0 });
            let kind = LoadKind::Gravity { body: number, acceleration: [1.0, 0.0, -9.81] };
            let curve = Curve { shape: Shape::Ramp, from: 0.0, to: 1.0 + number as f64 };
            model.loads.push(Load { name: String::new(), kind, curve, surface: None, controlled: false });
        }
        let mut applied = AppliedForces::<f32>::new(Arc::new(model));
        for step in 0..12 {
            match step {
                3 => applied.push(&vec![[0.5, 0.0, 0.1]; count]),
                5 => applied.push(&[]),
                _ => {}
            }
            applied.update(0.25 * f64::from(step), &vec![[0.0; 3]; count]);
            if step == 7 {
                applied.add(BLOCK as u32 + 3, [1.0, 2.0, 3.0]);
            }
            for nodes in [0..BLOCK, BLOCK..count] {
                let mut found = [[0.0; 3]; BLOCK];
                assert!(applied.act_at(nodes.clone(), &mut found));
                let expected: Vec<Vector<f32>> = nodes.map(|node| applied.at(node)).collect();
                assert_eq!(found[..expected.len()], expected[..], "{step}");
            }
        }
    }
}
