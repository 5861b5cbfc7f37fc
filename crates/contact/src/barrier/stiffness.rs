//! The stiffness of the collisions of a step.

use nalgebra::{Matrix3, Point3, Vector3};

use super::collisions::{NormalCollision, Stencil};
use super::distance::Nearest;
use super::hessian::{Matrix12, bent, block, of_parallel, of_wall};
use super::step::{BarrierStep, carried};

/// The step of differences of the normal of a wall, over the distance of the barrier.
const DIFFERENCE: f64 = 0.01;

impl BarrierStep {
    /// Calls back with the stiffness [N/m] of each collision, never negative: its stencil and three rows and
    /// columns a node. The last argument has the ways [m] that the rigid things among its nodes have yet to
    /// go in the step. For a node at a wall this is the way of the node relative to the wall. Barriers
    /// contribute κ A b″ ∇d ∇dᵀ and the positive part of κ A b′ ∂²d/∂x². The stiffness of friction is exact.
    pub fn stiffness(&self, mut add: impl FnMut(&Stencil, &Matrix12, [Vector3<f64>; 4])) {
        let ([from, to], now) = (&self.ends, &self.now.stances);
        let goes_on = self.time_fraction < 1.0 && from != to;
        let left = |stencil: &Stencil, wall: Option<u32>, outward: Vector3<f64>| {
            let mut ways = [Vector3::zeros(); 4];
            if !goes_on {
                return ways;
            }
            let rises = |thing: u32| to[thing as usize].growth - now[thing as usize].growth;
            if let Some(wall) = wall.filter(|_| stencil.count == 1) {
                let place = self.now.place[stencil.nodes[0] as usize];
                ways[0] = place - carried(Some(wall), [now, to], &place) - outward * rises(wall);
                return ways;
            }
            // The rest of the rise counts as a way of all nodes of the thing, along the normal by which their
            // distance falls.
            let rigid_node = |node: u32| self.barriers.rigid_node(node);
            let sum: f64 = stencil.parts().filter_map(|(node, c)| rigid_node(node).map(|_| c)).sum();
            for (way, (node, _)) in ways.iter_mut().zip(stencil.parts()) {
                if let Some((thing, x)) = rigid_node(node) {
                    let target = (to[*thing as usize].pose * Point3::from(*x)).coords;
                    *way = target - self.now.place[node as usize] - outward * (rises(*thing) * sum);
                }
            }
            ways
        };
        for collision in &self.normal_collisions {
            let wall = self.barriers.groups[collision.stencil.contact as usize].wall;
            let is_inside = wall.is_some_and(|wall| self.barriers.contacts.rigids[wall as usize].inside);
            let outward = if is_inside { -collision.normal } else { collision.normal };
            add(&collision.stencil, &self.stiffness_of(collision), left(&collision.stencil, wall, outward));
        }
        for collision in &self.friction_collisions {
            let across = block(&collision.stencil.coefficients, &collision.stiffness());
            add(&collision.stencil, &across, left(&collision.stencil, collision.wall, Vector3::zeros()));
        }
    }

    /// The stiffness [N/m] of the barrier of a collision.
    fn stiffness_of(&self, collision: &NormalCollision) -> Matrix12 {
        let group = &self.barriers.groups[collision.stencil.contact as usize];
        let Stencil { nodes, coefficients, .. } = collision.stencil;
        let along = collision.normal * collision.normal.transpose() * collision.stiffness;
        let Some(region) = collision.region else {
            let curved =
                group.wall.map(|wall| self.curved_wall(wall, collision, group.parameters.law.distance));
            return block(&coefficients, &(along + curved.unwrap_or_default() * collision.force));
        };
        let points = nodes.map(|node| self.now.place[node as usize]);
        let near = Nearest { distance: collision.distance, coefficients, normal: collision.normal, region };
        match &collision.mollified {
            Some(with) => of_parallel(&points, &near, collision.stiffness, with),
            None => block(&coefficients, &along) + bent(&points, &near) * collision.force,
        }
    }

    /// Returns the positive part [1/m] of −∂²d/∂x² of a collision at a wall. Uses differences over a part of
    /// the distance [m] of its barrier.
    fn curved_wall(&self, wall: u32, collision: &NormalCollision, distance: f64) -> Matrix3<f64> {
        let (rigid, stance) =
            (&self.barriers.contacts.rigids[wall as usize], &self.now.stances[wall as usize]);
        let h = DIFFERENCE * distance;
        let normals = [0, 1, 2].map(|axis| {
            [h, -h].map(|by| {
                let mut place = self.now.place[collision.stencil.nodes[0] as usize];
                place[axis] += by;
                rigid.sides(stance, &place)[usize::from(collision.side)]
                    .map_or(collision.normal, |side| side.normal)
            })
        });
        of_wall(normals, h)
    }
}
