//! The forces of loads and gravity on the nodes of a model at one instant.

use std::sync::Arc;

use pliant_mechanics::grip::Grip;
use pliant_mechanics::load::LoadKind;
use pliant_mechanics::mapping::Displaced;
use pliant_mechanics::model::Model;
use pliant_mechanics::tensor::{Vector, add};

use crate::Scalar;

/// Nodes whose forces are passed over together where nothing acts on them.
pub(crate) const BLOCK: usize = 128;

/// Forces applied to the nodes, found anew for each instant.
pub(crate) struct AppliedForces {
    model: Arc<Model>,
    /// Forces of loads [N], one per node.
    nodal: Vec<Vector<f64>>,
    /// Acceleration [m/s²] by gravity, one per body.
    gravity: Vec<Vector<f64>>,
    body_of: Vec<u16>,
    grips: Vec<Grip>,
    /// Forces [N] from outside that stay, one a node; empty for none.
    given: Vec<Vector<f64>>,
    /// Whether loads, grips or given forces act, on any node.
    loaded: bool,
    /// The blocks of nodes that forces were added to at this instant, and a mark of each block.
    added: Vec<u32>,
    pushed: Vec<bool>,
}

impl AppliedForces {
    pub(crate) fn new(model: Arc<Model>) -> Self {
        let mut body_of = vec![0; model.node_count()];
        for (index, body) in model.bodies.iter().enumerate() {
            body_of[body.nodes.start as usize..body.nodes.end as usize].fill(index as u16);
        }
        Self {
            nodal: vec![[0.0; 3]; model.node_count()],
            gravity: vec![[0.0; 3]; model.bodies.len()],
            loaded: !model.loads.is_empty(),
            added: Vec::new(),
            pushed: vec![false; model.node_count().div_ceil(BLOCK)],
            model,
            body_of,
            grips: Vec::new(),
            given: Vec::new(),
        }
    }

    /// Takes other grips.
    pub(crate) fn hold(&mut self, grips: &[Grip]) {
        self.grips.clear();
        self.grips.extend_from_slice(grips);
        self.see_whether_loaded();
    }

    /// Takes other forces [N] from outside that stay, one a node, or none.
    pub(crate) fn push(&mut self, forces: &[Vector<f64>]) {
        self.given.clear();
        self.given.extend_from_slice(forces);
        self.see_whether_loaded();
    }

    fn see_whether_loaded(&mut self) {
        self.nodal.fill([0.0; 3]);
        self.loaded = !(self.grips.is_empty() && self.given.is_empty() && self.model.loads.is_empty());
    }

    /// Whether any force acts on the block of a node.
    #[inline(always)]
    pub(crate) fn acts_at(&self, node: usize) -> bool {
        self.loaded || self.pushed[node / BLOCK]
    }

    /// Adds a force [N] on a node to those of the instant.
    pub(crate) fn add(&mut self, node: u32, force: Vector<f64>) {
        self.nodal[node as usize] = add(self.nodal[node as usize], force);
        let block = node as usize / BLOCK;
        if !std::mem::replace(&mut self.pushed[block], true) {
            self.added.push(block as u32);
        }
    }

    /// Finds the forces at a time [s] and in a deformed place.
    pub(crate) fn update<R: Scalar>(&mut self, time: f64, displacement: &[Vector<R>]) {
        for block in self.added.drain(..).map(|block| block as usize) {
            self.pushed[block] = false;
            let end = self.nodal.len().min((block + 1) * BLOCK);
            self.nodal[block * BLOCK..end].fill([0.0; 3]);
        }
        if !self.loaded {
            return;
        }
        self.nodal.fill([0.0; 3]);
        self.gravity.fill([0.0; 3]);
        let model = &self.model;
        let state = Displaced { rest: &model.rest, displacement, velocity: &[] };
        for load in &model.loads {
            if let LoadKind::Gravity { body, acceleration } = load.kind {
                let factor = load.curve.value(time);
                self.gravity[body] = add(self.gravity[body], acceleration.map(|a| a * factor));
            }
            let points = load.surface.map(|index| &model.surfaces[index].mapping);
            load.add_forces(time, points, &state, &mut self.nodal);
        }
        for grip in &self.grips {
            grip.add_forces(&state, &mut self.nodal);
        }
        for (own, given) in self.nodal.iter_mut().zip(&self.given) {
            *own = add(*own, *given);
        }
        model.give_back(&mut self.nodal);
    }

    /// The force [N] on a node.
    #[inline(always)]
    pub(crate) fn at<R: Scalar>(&self, node: usize) -> Vector<R> {
        let gravity = self.gravity[self.body_of[node] as usize];
        let mass = self.model.mass[node];
        let force = |c: usize| R::of(self.nodal[node][c] + mass * gravity[c]);
        [force(0), force(1), force(2)]
    }
}
