//! Grips: springs between points of bodies and places in space, that come and go while a run goes on, as a hand takes hold of
//! tissue and lets it go. With the point x = Σ wᵢ (Xᵢ + uᵢ) and the place p, node i feels wᵢ k (p − x).

use serde::{Deserialize, Serialize};

use crate::Real;
use crate::model::Model;
use crate::tensor::{Vector, add, cast, scale, sub};

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
    /// Where the point is [m].
    pub fn point<R: Real>(&self, model: &Model, displacement: &[Vector<R>]) -> Vector<f64> {
        self.nodes.iter().fold([0.0; 3], |sum, &(node, weight)| {
            let place = add(model.rest[node as usize], cast(displacement[node as usize]));
            add(sum, scale(place, weight))
        })
    }

    /// The force on the body [N].
    pub fn force<R: Real>(&self, model: &Model, displacement: &[Vector<R>]) -> Vector<f64> {
        scale(sub(self.place, self.point(model, displacement)), self.stiffness)
    }

    /// The stiffness [N/m] up to which such a spring leaves explicit steps [s] of 0.9 of the critical time step stable. It adds at most
    /// k Σ wᵢ²/mᵢ to the squares of the angular frequencies (Weyl), whose limit is 4/Δt² and of which 0.81 are taken.
    pub fn stiffest(&self, model: &Model, step: f64) -> f64 {
        let mobility: f64 = self.nodes.iter().map(|&(node, w)| w * w / model.inertia(node as usize)).sum();
        ROOM * 4.0 / (step * step * mobility)
    }

    /// Adds its forces on the nodes [N].
    pub fn add_forces<R: Real>(&self, model: &Model, displacement: &[Vector<R>], to: &mut [Vector<f64>]) {
        let force = self.force(model, displacement);
        for &(node, weight) in &self.nodes {
            to[node as usize] = add(to[node as usize], scale(force, weight));
        }
    }
}
