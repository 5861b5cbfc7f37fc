//! Constraints: prescribed motions, springs, means, rigid parts and volumes.

use crate::curve::Curve;
use crate::load::{Face, face_areas};
use crate::tensor::{Vector, add, cross, dot, scale, sub};

/// A prescribed motion of some nodes.
#[derive(Clone, Debug)]
pub struct Constraint {
    /// Its name.
    pub name: String,
    /// The nodes.
    pub nodes: Vec<u32>,
    /// Components that the constraint prescribes: x, y and z, and the rotations about them, where nodes have
    /// rotations.
    pub components: [bool; 6],
    /// Prescribed motion.
    pub motion: Motion,
}

impl Constraint {
    /// Returns the force λ [N] that holds a mean, with w λ on each node. It is found from the resisting
    /// forces [N] of the nodes by least squares, exact in equilibrium. Zero for other motions.
    pub fn mean_force(&self, resisting: impl Fn(u32) -> Vector<f64>) -> Vector<f64> {
        let Motion::Mean { weights, .. } = &self.motion else { return [0.0; 3] };
        let squared: f64 = weights.iter().map(|w| w * w).sum();
        let sum = self.nodes.iter().zip(weights).fold([0.0; 3], |sum, (&node, &w)| {
            let force = resisting(node);
            [0, 1, 2].map(|c| if self.components[c] { sum[c] + w * force[c] } else { 0.0 })
        });
        scale(sum, 1.0 / squared)
    }

    /// Returns the forces [N] that hold a mean or an enclosed volume, node by node. They are found from the
    /// resisting forces [N] of the nodes at some places [m], by least squares over the free components. Exact
    /// in equilibrium. Empty for other motions; facets of shells do not count.
    pub fn borne(
        &self,
        place: impl Fn(u32) -> Vector<f64>,
        resisting: impl Fn(u32) -> Vector<f64>,
        is_free: impl Fn(u32, usize) -> bool,
    ) -> Vec<Vector<f64>> {
        match &self.motion {
            Motion::Mean { weights, .. } => {
                let force = self.mean_force(resisting);
                weights.iter().map(|&weight| scale(force, weight)).collect()
            }
            Motion::Volume { enclosure, .. } => {
                let mut gradient = vec![[0.0; 3]; self.nodes.len()];
                enclosure.add_gradient(|at| place(self.nodes[at as usize]), &mut gradient);
                for (g, &node) in gradient.iter_mut().zip(&self.nodes) {
                    *g = [0, 1, 2].map(|c| if is_free(node, c) { g[c] } else { 0.0 });
                }
                let along = gradient.iter().zip(&self.nodes).map(|(g, &node)| dot(*g, resisting(node)));
                let pressure = along.sum::<f64>() / gradient.iter().map(|g| dot(*g, *g)).sum::<f64>();
                gradient.into_iter().map(|g| scale(g, pressure)).collect()
            }
            _ => Vec::new(),
        }
    }

    /// Displacement [m] that the nodes of a mean lack at a time [s], on average; zero for other constraints.
    /// `displacement` gives the displacement of a node [m].
    pub fn missing_mean(&self, time: f64, displacement: impl Fn(u32) -> Vector<f64>) -> Vector<f64> {
        let Motion::Mean { weights, by, curve } = &self.motion else { return [0.0; 3] };
        let add_node = |sum, (&node, &weight): (&u32, &f64)| add(sum, scale(displacement(node), weight));
        let mean = self.nodes.iter().zip(weights).fold([0.0; 3], add_node);
        let missing = sub(scale(*by, curve.value(time)), mean);
        [0, 1, 2].map(|c| if self.components[c] { missing[c] } else { 0.0 })
    }

    /// The amplitudes of each node's motion.
    pub(super) fn amplitudes(&self) -> impl Iterator<Item = Amplitudes> + '_ {
        (0..self.nodes.len()).map(|index| self.motion.amplitudes(index))
    }
}

/// Vectors that the two factors of a motion multiply. Only rotations have two; for other motions the second
/// is zero.
pub type Amplitudes = [Vector<f64>; 2];

/// Prescribed motion over time.
#[derive(Clone, Debug)]
pub enum Motion {
    /// They stay where they are at rest.
    Fixed,
    /// Displacement [m] × curve.
    Displacement(Vector<f64>, Curve),
    /// Displacements [m], one per node of the constraint in their order, × curve.
    Displacements(Vec<Vector<f64>>, Curve),
    /// Displacements [m], one per node, with a rotation vector [rad] that turns each node about its own
    /// place, × curve. With all three rotations prescribed a node turns by exp(curve · vector) exactly, about
    /// any axis by any angle. With fewer, only those components of its spin are prescribed. Constraints with
    /// different curves on the same node about different axes do not commute.
    Turn {
        /// The displacements [m].
        by: Vec<Vector<f64>>,
        /// The rotation vector [rad].
        turn: Vector<f64>,
        /// Their curve over time.
        curve: Curve,
    },
    /// Velocity [m/s] × curve; the displacement is its integral.
    Velocity(Vector<f64>, Curve),
    /// Rotation about an axis by an angle × curve, each node on its circle; see [`Motion::rotation`].
    Rotation {
        /// k × r and k × (k × r) [m] of each node of the constraint, in their order: k is the axis, r the arm
        /// from it.
        arms: Vec<Amplitudes>,
        /// The angle [rad].
        angle: f64,
        /// Its curve over time.
        curve: Curve,
    },
    /// The mean of their displacements is a displacement [m] × curve, with weights that sum to 1. Each node
    /// by itself is free, as under a plate that tilts.
    Mean {
        /// Weights, one for each node of the constraint.
        weights: Vec<f64>,
        /// Displacement [m].
        by: Vector<f64>,
        /// Its curve over time.
        curve: Curve,
    },
    /// Together they move as a rigid body, free in space.
    Rigid,
    /// The volume that faces enclose grows from its rest value by a volume [m³] × curve; a uniform pressure
    /// on the faces acts as the force.
    Volume {
        /// Surface that encloses the volume.
        enclosure: Enclosure,
        /// The growth [m³].
        by: f64,
        /// Its curve over time.
        curve: Curve,
    },
}

/// A closed surface, made of faces of solids and membranes or of facets of shells.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Enclosure {
    /// Faces, numbered by the nodes of their constraint; normals point out of the enclosed volume.
    pub faces: Vec<Face>,
    /// Facets of shells, numbered in the model; normals outwards, too.
    pub facets: Vec<u32>,
}

impl Enclosure {
    /// The volume [m³] within the faces and its gradient [m²], which is added to one entry a node; `place`
    /// gives the places [m] of nodes. Facets of shells do not count here.
    pub fn add_gradient(&self, place: impl Fn(u32) -> Vector<f64>, gradient: &mut [Vector<f64>]) -> f64 {
        let mut sum = 0.0;
        for (node, area) in self.faces.iter().flat_map(|face| face_areas(face, &place)) {
            gradient[node as usize] = add(gradient[node as usize], area);
            sum += dot(place(node), area);
        }
        sum / 3.0
    }
}

/// Largest number of corrections of a volume: six are enough for a ball that grows eightfold.
pub(super) const CORRECTIONS: usize = 50;

/// A volume that is off by no more, over itself, is where it should be.
pub(super) const FILLED: f64 = 1e-12;

/// Moves the components of a state along the gradient of an enclosed volume until that is `wanted` [m³]
/// (Newton's method). `volume` finds the volume [m³] and its gradient; `advance` moves the state by a
/// multiple of the gradient.
pub fn fill<S: ?Sized>(
    state: &mut S,
    wanted: f64,
    gradient: &mut [f64],
    volume: impl Fn(&S, &mut [f64]) -> f64,
    advance: impl Fn(&mut S, &[f64], f64),
) {
    for _ in 0..CORRECTIONS {
        let missing = wanted - volume(state, gradient);
        let squared: f64 = gradient.iter().map(|g| g * g).sum();
        if missing.abs() <= FILLED * wanted.abs() || squared == 0.0 {
            break;
        }
        advance(state, gradient, missing / squared);
    }
}

/// Volume and pressure of a constraint of volume at an instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Enclosed {
    /// The volume [m³].
    pub volume: f64,
    /// The pressure within [Pa], above that outside.
    pub pressure: f64,
}

impl Motion {
    /// True if the motion binds nodes to each other and prescribes no node by itself.
    pub fn is_collective(&self) -> bool {
        matches!(self, Self::Mean { .. } | Self::Rigid | Self::Volume { .. })
    }

    /// True if the motion fills a volume.
    pub fn encloses(&self) -> bool {
        matches!(self, Self::Volume { .. })
    }

    /// Rotation of nodes about an axis through a centre [m], by an angle [rad] × curve. Rodrigues' formula
    /// gives u = sin θ k × r + (1 − cos θ) k × (k × r). The axis need not be of unit length, nor zero.
    pub fn rotation(
        axis: Vector<f64>,
        centre: Vector<f64>,
        angle: f64,
        curve: Curve,
        rest: impl Iterator<Item = Vector<f64>>,
    ) -> Self {
        let axis = scale(axis, 1.0 / dot(axis, axis).sqrt());
        let arm = |place: Vector<f64>| {
            let across = cross(axis, sub(place, centre));
            [across, cross(axis, across)]
        };
        Self::Rotation { arms: rest.map(arm).collect(), angle, curve }
    }

    /// Makes a displacement [m] and a rotation vector [rad] for each of `nodes` nodes, × curve.
    pub fn turn(by: Vector<f64>, turn: Vector<f64>, nodes: usize, curve: Curve) -> Self {
        Self::Turn { by: vec![by; nodes], turn, curve }
    }

    /// Vectors that the factors multiply: the displacement [m], the velocity [m/s] or the arms [m] of the
    /// constraint's node at `index`.
    pub fn amplitudes(&self, index: usize) -> Amplitudes {
        let one = |amplitude| [amplitude, [0.0; 3]];
        match self {
            Self::Fixed | Self::Rigid | Self::Volume { .. } => one([0.0; 3]),
            Self::Displacement(by, _) | Self::Mean { by, .. } => one(*by),
            Self::Displacements(by, _) | Self::Turn { by, .. } => one(by[index]),
            Self::Velocity(velocity, _) => one(*velocity),
            Self::Rotation { arms, .. } => arms[index],
        }
    }

    /// Displacement over amplitudes at a time [s].
    pub fn factors(&self, time: f64) -> [f64; 2] {
        self.factors_of_part(time, 1.0)
    }

    /// Displacement over amplitudes where a part, from 0 to 1, of the way to where it is at a time [s] is
    /// gone.
    pub(super) fn factors_of_part(&self, time: f64, part: f64) -> [f64; 2] {
        match self {
            Self::Fixed | Self::Rigid => [0.0; 2],
            Self::Displacement(_, curve)
            | Self::Displacements(_, curve)
            | Self::Turn { curve, .. }
            | Self::Mean { curve, .. }
            | Self::Volume { curve, .. } => [part * curve.value(time), 0.0],
            Self::Velocity(_, curve) => [part * curve.integral(time), 0.0],
            Self::Rotation { angle, curve, .. } => {
                let angle = part * angle * curve.value(time);
                // 1 − cos θ without cancellation.
                [angle.sin(), 2.0 * (0.5 * angle).sin().powi(2)]
            }
        }
    }

    /// Displacement [m] of the constraint's node at `index`, a part, from 0 to 1, of the way to where it is
    /// at a time [s].
    pub fn displacement(&self, index: usize, time: f64, part: f64) -> Vector<f64> {
        let (amplitudes, factors) = (self.amplitudes(index), self.factors_of_part(time, part));
        [0, 1, 2].map(|c| placed(component(&amplitudes, c), factors))
    }

    /// Displacement [m] and rotation vector [rad] of the constraint's node at `index` at a time [s].
    pub fn place(&self, index: usize, time: f64) -> [f64; 6] {
        let [x, y, z] = self.displacement(index, time, 1.0);
        let turn = match self {
            Self::Turn { turn, curve, .. } => scale(*turn, curve.value(time)),
            _ => [0.0; 3],
        };
        [x, y, z, turn[0], turn[1], turn[2]]
    }

    /// Increment of the constraint's node at `index` between two times [s]: its displacement [m] and its
    /// rotation vector [rad].
    pub fn increment(&self, index: usize, from: f64, to: f64) -> [f64; 6] {
        let shift = match self {
            Self::Fixed | Self::Rigid | Self::Volume { .. } => [0.0; 3],
            // The difference of the factors first: it is exact to more digits than the difference of places.
            Self::Displacement(_, curve)
            | Self::Displacements(_, curve)
            | Self::Turn { curve, .. }
            | Self::Mean { curve, .. } => {
                scale(self.amplitudes(index)[0], curve.value(to) - curve.value(from))
            }
            Self::Velocity(..) | Self::Rotation { .. } => {
                sub(self.displacement(index, to, 1.0), self.displacement(index, from, 1.0))
            }
        };
        let spin = match self {
            Self::Turn { turn, curve, .. } => scale(*turn, curve.value(to) - curve.value(from)),
            _ => [0.0; 3],
        };
        [shift[0], shift[1], shift[2], spin[0], spin[1], spin[2]]
    }

    /// True if two motions of the same amplitudes are the same at all times.
    pub(super) fn follows(&self, other: &Self) -> bool {
        let curve = |motion: &Self| match motion {
            Self::Fixed | Self::Rigid => None,
            Self::Displacement(_, curve)
            | Self::Displacements(_, curve)
            | Self::Turn { curve, .. }
            | Self::Mean { curve, .. }
            | Self::Volume { curve, .. } => Some((0, 0.0, curve.clone())),
            Self::Velocity(_, curve) => Some((1, 0.0, curve.clone())),
            Self::Rotation { angle, curve, .. } => Some((2, *angle, curve.clone())),
        };
        curve(self) == curve(other)
    }
}

impl Motion {
    /// True if two motions turn nodes in the same way at all times.
    pub(super) fn turns_as(&self, other: &Self) -> bool {
        let curve = |motion: &Self| match motion {
            Self::Turn { turn, curve, .. } if *turn != [0.0; 3] => Some((*turn, curve.clone())),
            _ => None,
        };
        curve(self) == curve(other)
    }
}

/// The amplitudes of a component.
#[inline(always)]
pub fn component([first, second]: &Amplitudes, c: usize) -> [f64; 2] {
    [first[c], second[c]]
}

/// A component of a displacement [m] from its amplitudes and factors.
#[inline(always)]
pub fn placed(amplitudes: [f64; 2], factors: [f64; 2]) -> f64 {
    amplitudes[0] * factors[0] + amplitudes[1] * factors[1]
}
