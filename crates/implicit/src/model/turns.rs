//! Rotations of nodes that follow a solid.

use nalgebra::Vector3;
use pliant_mechanics::model::{Constraint, Motion};

use crate::model::assembly::Assembly;

/// A node that turns with the gradient of a solid.
#[derive(Clone, Debug, PartialEq)]
pub struct CarriedTurn {
    /// The node.
    pub node: u32,
    /// Nodes of the solid with their gradients g at rest [1/m], F = Σ x gᵀ: of a cell its mean shape gradients. They sum to 0.
    pub gradient: Vec<(u32, Vector3<f64>)>,
}

/// The nodes of a model that turn with a solid: not those of rigid parts, which turn with these.
pub(crate) fn carried_turns(model: &Assembly) -> impl Iterator<Item = &CarriedTurn> {
    let rigid = |constraint: &Constraint| matches!(constraint.motion, Motion::Rigid);
    let bound = move |node: u32| model.constraints.iter().any(|own| rigid(own) && own.nodes.contains(&node));
    model.turns.iter().filter(move |turn| !bound(turn.node))
}
