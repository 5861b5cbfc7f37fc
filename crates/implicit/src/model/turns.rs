//! Rotations of nodes that follow a solid.

use nalgebra::Vector3;

/// A node that turns with the gradient of a solid.
#[derive(Clone, Debug, PartialEq)]
pub struct CarriedTurn {
    /// The node.
    pub node: u32,
    /// Nodes of the solid with their gradients g at rest [1/m], F = Σ x gᵀ: of a cell its mean shape
    /// gradients. They sum to 0.
    pub gradient: Vec<(u32, Vector3<f64>)>,
}
