//! Collisions at the present state: normal collisions of pairs within the reach of the barrier, and
//! frictional collisions.

use nalgebra::{Matrix3, Vector3};

use super::distance::Region;

/// Round-off of the length of a normal.
const UNIT: f64 = 1e-12;

/// Nodes of a collision and their coefficients: four, or one at a wall.
#[derive(Clone, Copy, Debug)]
pub struct Stencil {
    /// The nodes; numbers of nodes of rigid things follow the nodes of the model.
    pub nodes: [u32; 4],
    /// Their coefficients c: Σ c x is the way from the second to the first.
    pub coefficients: [f64; 4],
    /// Number of nodes.
    pub count: u8,
    /// The contact, by its number.
    pub contact: u32,
    /// The nodes from this one on are of the other primitive.
    pub split: u8,
    /// True if the first primitive is of the first side of the contact.
    pub in_order: bool,
}

impl Stencil {
    /// Nodes with their coefficients.
    pub fn parts(&self) -> impl Iterator<Item = (u32, f64)> + '_ {
        let count = usize::from(self.count);
        self.nodes[..count].iter().copied().zip(self.coefficients[..count].iter().copied())
    }

    /// Σ c x over vectors of the nodes.
    pub(crate) fn combine(&self, of: impl Fn(u32) -> Vector3<f64>) -> Vector3<f64> {
        self.parts().map(|(node, c)| of(node) * c).sum()
    }

    /// True if the node at an index of the stencil is of the second side of the contact.
    pub(crate) fn is_second(&self, at: usize) -> bool {
        (at < usize::from(self.split)) != self.in_order
    }
}

/// A pair within the reach of the barrier.
#[derive(Clone, Copy, Debug)]
pub struct NormalCollision {
    /// Its nodes.
    pub stencil: Stencil,
    /// The gradient of the distance by the first: the direction from the second to it.
    pub normal: Vector3<f64>,
    /// The distance [m] of its sides.
    pub distance: f64,
    /// The gap [m], above 0: the distance without what the pair keeps.
    pub gap: f64,
    /// Its energy [J].
    pub energy: f64,
    /// The force [N] along the normal that keeps its sides apart.
    pub force: f64,
    /// Growth of the force per approach [N/m].
    pub stiffness: f64,
    /// Nearest parts of the primitives; `None` at a wall.
    pub region: Option<Region>,
    /// Number of the smooth side, at a wall.
    pub side: u8,
    /// Mollifier of nearly parallel edges.
    pub mollified: Option<Mollified>,
}

impl NormalCollision {
    /// Unit direction of the push, and the force [N] along it.
    pub fn pushes(&self) -> (Vector3<f64>, f64) {
        let length = self.normal.norm();
        // Only rounded corners of sampled walls have another one.
        match (length - 1.0).abs() < UNIT || length == 0.0 {
            true => (self.normal, self.force),
            false => (self.normal / length, self.force * length),
        }
    }

    /// The force [N] on a node, by its place in the stencil.
    pub(crate) fn force_on(&self, at: usize) -> Vector3<f64> {
        let push = self.normal * (self.force * self.stencil.coefficients[at]);
        self.mollified.map_or(push, |with| push - with.gradient[at] * with.energy)
    }
}

/// Mollifier m of edges that are nearly parallel, with their energy and force without it.
#[derive(Clone, Copy, Debug)]
pub struct Mollified {
    /// Its threshold [m⁴].
    pub threshold: f64,
    /// ∂m/∂xᵢ [1/m] of the four points.
    pub gradient: [Vector3<f64>; 4],
    /// The energy [J] without it.
    pub energy: f64,
    /// The force [N] without it.
    pub force: f64,
}

/// A pair with friction. Its normal force, direction and coefficients are from the last call of
/// [`lag`](super::BarrierStep::lag).
#[derive(Clone, Copy, Debug)]
pub struct FrictionCollision {
    /// Its nodes.
    pub stencil: Stencil,
    /// The direction across which it slips.
    pub normal: Vector3<f64>,
    /// The largest force μ λ [N].
    pub limit: f64,
    /// Σ c x [m] at the start of the step, carried along by a wall.
    pub start: Vector3<f64>,
    /// The wall, if it is one: a rigid thing by its number.
    pub wall: Option<u32>,
    /// The slip [m] at the state last evaluated.
    pub slip: Vector3<f64>,
    /// μ λ f₁/|u| [N/m] there.
    pub stiffness: f64,
    /// μ λ f₁' [N/m] there.
    pub along: f64,
}

impl FrictionCollision {
    /// The force [N] on a node, by its place in the stencil.
    pub(crate) fn force_on(&self, at: usize) -> Vector3<f64> {
        self.slip * (-self.stiffness * self.stencil.coefficients[at])
    }

    /// The stiffness [N/m] of a slip: the second derivative of its energy, never negative.
    pub fn stiffness(&self) -> Matrix3<f64> {
        let across = (Matrix3::identity() - self.normal * self.normal.transpose()) * self.stiffness;
        match self.slip.try_normalize(0.0) {
            Some(along) => across + along * along.transpose() * (self.along - self.stiffness),
            None => across,
        }
    }
}
