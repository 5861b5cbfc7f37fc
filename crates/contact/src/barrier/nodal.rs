//! Effect of barriers on single nodes: their forces along the normals, the least gaps, and their slip.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::step::BarrierStep;

/// A node of the model within the reach of a barrier.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NodeTouch {
    /// Its number.
    pub node: u32,
    /// The least gap [m] of what it takes part in.
    pub gap: f64,
    /// Sum of the forces [N] of barriers on it, without friction.
    pub push: [f64; 3],
    /// Slip [m] of the node since it came within the reach.
    pub slip: f64,
}

impl BarrierStep {
    /// Returns all nodes within the reach of a barrier at the state last evaluated, by increasing node.
    /// `before` holds the nodes at the start of the step. Their slip grows by the length of their way in the
    /// step along the surface that they touch. That way is the mean over all collisions of a node, weighted
    /// by force. `share` calls back with the nodes that a contact node stands for, and their shares: itself,
    /// or nodes around it.
    pub fn touches(
        &self,
        before: &[NodeTouch],
        share: impl Fn(u32, &mut dyn FnMut(u32, f64)),
    ) -> Vec<NodeTouch> {
        let mut sums: BTreeMap<u32, (f64, Vector3<f64>, [f64; 2])> = BTreeMap::new();
        for collision in self.normal_collisions() {
            let way = self.way(&collision.stencil);
            let (normal, _) = collision.pushes();
            let slip = (way - normal * normal.dot(&way)).norm();
            for (at, (node, c)) in collision.stencil.parts().enumerate() {
                if node as usize >= self.node_count() || c == 0.0 {
                    continue;
                }
                let push = collision.force_on(at);
                share(node, &mut |node, part| {
                    let sum = sums.entry(node).or_insert((f64::INFINITY, Vector3::zeros(), [0.0; 2]));
                    let load = part * c.abs() * collision.force;
                    sum.0 = sum.0.min(collision.gap);
                    sum.1 += push * part;
                    sum.2 = [sum.2[0] + load, sum.2[1] + load * slip];
                });
            }
        }
        let slid = |node: u32| {
            let found = before.binary_search_by_key(&node, |known| known.node);
            found.map_or(0.0, |at| before[at].slip)
        };
        let touch = |(node, (gap, push, [load, slips])): (u32, (f64, Vector3<f64>, [f64; 2]))| NodeTouch {
            node,
            gap,
            push: push.into(),
            slip: slid(node) + if load > 0.0 { slips / load } else { 0.0 },
        };
        sums.into_iter().map(touch).collect()
    }
}
