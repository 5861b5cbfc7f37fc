//! Grips: springs between points of bodies and places in space. They come and go during a run, as a hand
//! takes hold of tissue and lets it go. With the point x = Σ wᵢ (Xᵢ + uᵢ) and the place p, node i feels wᵢ k
//! (p − x).

use serde::{Deserialize, Serialize};

use crate::mapping::{Configuration, Mapping, weighted};
use crate::model::Model;
use crate::tensor::{Vector, add, scale, sub};

/// A spring between a point of a body and a place.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Grip {
    /// Nodes of the point, and their weights, which sum to 1.
    pub nodes: Vec<(u32, f64)>,
    /// The place [m].
    pub place: Vector<f64>,
    /// Stiffness [N/m].
    pub stiffness: f64,
}

/// Part of the room between a step of 0.9 of the critical time step and the limit that a grip may take.
pub const ROOM: f64 = 0.15;

impl Grip {
    /// Nodes and weights of its point.
    fn weights(&self) -> impl Iterator<Item = (u32, f64)> + '_ {
        self.nodes.iter().copied()
    }

    /// The force on the body [N].
    pub fn force(&self, state: &impl Configuration) -> Vector<f64> {
        scale(sub(self.place, self.position(state, 0)), self.stiffness)
    }

    /// Returns the stiffness [N/m] up to which such a spring leaves explicit steps [s] of 0.9 of the critical
    /// time step stable. It adds at most k Σ wᵢ²/mᵢ to the squares of the angular frequencies (Weyl). Their
    /// limit is 4/Δt², of which 0.81 are taken.
    pub fn stiffest<S: Configuration>(&self, state: &S, model: &Model, step: f64) -> f64 {
        let inertia = |node: u32| [model.inertia(node as usize), 0.0];
        let mobility = self.mobility(state, 0, [1.0, 0.0, 0.0], &inertia);
        ROOM * 4.0 / (step * step * mobility)
    }

    /// Adds its forces on the nodes [N].
    pub fn add_forces(&self, state: &impl Configuration, to: &mut [Vector<f64>]) {
        self.add_force(state, 0, self.force(state), &mut |node, force, _| {
            to[node as usize] = add(to[node as usize], force);
        });
    }
}

impl<S: Configuration> Mapping<S> for Grip {
    fn position(&self, state: &S, _: usize) -> Vector<f64> {
        weighted(self.weights(), |node| state.position(node))
    }

    fn velocity(&self, state: &S, _: usize) -> Vector<f64> {
        weighted(self.weights(), |node| state.velocity(node))
    }

    fn add_force(
        &self,
        _: &S,
        _: usize,
        force: Vector<f64>,
        add: &mut dyn FnMut(u32, Vector<f64>, Vector<f64>),
    ) {
        self.weights().for_each(|(node, weight)| add(node, scale(force, weight), [0.0; 3]));
    }
}
