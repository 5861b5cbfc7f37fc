//! Everything that changes, as arrays over the nodes. A clone is a snapshot.

use nalgebra::{UnitQuaternion, Vector3};
use pliant_mechanics::Model;
use pliant_shells::rotation::exponential;
use rayon::prelude::*;

use crate::solid::relaxation::History;

/// Nodes that a thread takes at least.
pub(crate) const NODES: usize = 1024;

/// Current state of a model: positions, rotations, velocities and time.
#[derive(Debug, Default, PartialEq)]
pub struct AssemblyState {
    /// Time [s], or the curve parameter of a static load.
    pub time: f64,
    /// Factor of controlled loads.
    pub load_factor: f64,
    /// Positions [m].
    pub position: Vec<Vector3<f64>>,
    /// Rotations from rest.
    pub rotation: Vec<UnitQuaternion<f64>>,
    /// Velocities [m/s].
    pub velocity: Vec<Vector3<f64>>,
    /// Spins [rad/s].
    pub spin: Vec<Vector3<f64>>,
    /// Memory of relaxing laws.
    pub history: History,
}

impl Clone for AssemblyState {
    fn clone(&self) -> Self {
        Self {
            time: self.time,
            load_factor: self.load_factor,
            position: self.position.clone(),
            rotation: self.rotation.clone(),
            velocity: self.velocity.clone(),
            spin: self.spin.clone(),
            history: self.history.clone(),
        }
    }

    /// Into the arrays that are there: solvers do so in every step.
    fn clone_from(&mut self, source: &Self) {
        let Self { time, load_factor, position, rotation, velocity, spin, history } = source;
        (self.time, self.load_factor) = (*time, *load_factor);
        self.position.clone_from(position);
        self.rotation.clone_from(rotation);
        self.velocity.clone_from(velocity);
        self.spin.clone_from(spin);
        self.history.copy_from(history);
    }
}

impl AssemblyState {
    /// At rest, where nothing is strained. To start elsewhere, change positions and rotations.
    pub fn at_rest(model: &Model) -> Self {
        let nodes = model.rest.len();
        Self {
            time: 0.0,
            load_factor: 0.0,
            position: model.rest.iter().map(|&place| Vector3::from(place)).collect(),
            rotation: vec![UnitQuaternion::identity(); nodes],
            velocity: vec![Vector3::zeros(); nodes],
            spin: vec![Vector3::zeros(); nodes],
            history: History::at_rest(model),
        }
    }

    /// Moves and turns all nodes by a part of (translation, spin) increments, six a node.
    pub(crate) fn advance(&mut self, increment: &[f64], part: f64) {
        let nodes = self.position.par_iter_mut().zip(&mut self.rotation).zip(increment.par_chunks_exact(6));
        nodes.with_min_len(NODES).for_each(|((position, rotation), d)| {
            *position += Vector3::new(d[0], d[1], d[2]) * part;
            let spin = Vector3::new(d[3], d[4], d[5]) * part;
            if spin != Vector3::zeros() {
                *rotation = exponential(&spin) * *rotation;
            }
        });
    }

    /// The nodes of a facet: positions and rotations.
    pub(crate) fn corners(&self, nodes: [u32; 3]) -> ([Vector3<f64>; 3], [UnitQuaternion<f64>; 3]) {
        (nodes.map(|node| self.position[node as usize]), nodes.map(|node| self.rotation[node as usize]))
    }
}
