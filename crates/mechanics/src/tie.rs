//! Ties: nodes that follow others, x = J x_nodes. Examples are the nodes of a vessel inside an organ, or of a
//! wall whose mesh does not match the surface below it. Tied nodes have no equations. Their forces and masses
//! go to the nodes that they follow, f += Jᵀ f and m += Jᵀ m, by the same rows. A node does not follow along
//! components that a constraint holds or moves; forces there are the reaction.

use crate::mapping::Weights;
use crate::tensor::Vector;

/// Nodes that follow others.
#[derive(Clone, Debug)]
pub struct Tie {
    /// Its name.
    pub name: String,
    /// The nodes that follow.
    pub nodes: Vec<u32>,
    /// Weights of the followed nodes for each tied node, in their order. Each row sums to 1.
    pub mapping: Weights,
    /// The components of each that a constraint holds or moves; see
    /// [`Model::prescribe_tied`](crate::Model::prescribe_tied).
    pub held: Vec<[bool; 3]>,
}

impl Tie {
    /// Each node with what it follows.
    pub fn rows(&self) -> impl Iterator<Item = (u32, impl Iterator<Item = (u32, f64)> + '_)> + '_ {
        self.nodes.iter().enumerate().map(|(point, &node)| (node, self.mapping.row(point)))
    }

    /// Each node with what moves it along each component: the nodes that it follows, and itself where it is
    /// held.
    pub fn component_rows(
        &self,
    ) -> impl Iterator<Item = (u32, impl Iterator<Item = (u32, Vector<f64>)> + '_)> + '_ {
        self.rows().zip(&self.held).map(|((node, row), held)| {
            let followed =
                row.map(|(other, weight)| (other, held.map(|held| if held { 0.0 } else { weight })));
            let on_itself = held.map(|held| f64::from(u8::from(held)));
            (node, followed.chain((on_itself != [0.0; 3]).then_some((node, on_itself))))
        })
    }
}

/// Reasons why nodes cannot follow others.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TieError {
    /// The node follows others by another tie.
    #[error("node {node} of `{body}` is tied already, by `{other}`")]
    Twice {
        /// The node, numbered in its body.
        node: u32,
        /// The body.
        body: String,
        /// The other tie.
        other: String,
    },
    /// A followed node follows others, or itself.
    #[error(
        "node {node} of `{body}` would follow nodes that follow others by `{other}`: ties cannot form chains or circles"
    )]
    Chain {
        /// The node, numbered in its body.
        node: u32,
        /// The body.
        body: String,
        /// The tie of what it would follow.
        other: String,
    },
}
