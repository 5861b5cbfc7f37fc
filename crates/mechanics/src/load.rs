//! Loads: nodal forces and moments, tractions per reference area, pressure that follows the deformed surface,
//! gravity.

use crate::curve::{Curve, Shape};
use crate::mapping::{Configuration, Mapping, Weights};
use crate::tensor::{Vector, add, cross, scale, sub};

/// A face of three or four nodes, outward order.
pub type Face = [u32; 4];

/// The fourth entry of a triangular [`Face`].
pub const NO_NODE: u32 = u32::MAX;

/// A load with its curve over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Load {
    /// Its name in messages.
    pub name: String,
    /// Kind and size of the load.
    pub kind: LoadKind,
    /// Factor over time.
    pub curve: Curve,
    /// The carried surface that forces and pressures number their points in; `None`: the model's own nodes.
    pub surface: Option<usize>,
    /// True if a static solver finds the size of the load, as a control requires.
    pub controlled: bool,
}

/// Kinds of loads.
#[derive(Clone, Debug, PartialEq)]
pub enum LoadKind {
    /// A dead force [N] on each of some nodes (nodal forces and tractions become this).
    Forces(Vec<(u32, Vector<f64>)>),
    /// A moment [N m] on each of some nodes that have rotations, with axes that stay in space.
    Moments(Vec<(u32, Vector<f64>)>),
    /// Pressure [Pa] on shells, along the normal of each deformed facet.
    ShellPressure {
        /// Facets, numbered in the model.
        facets: Vec<u32>,
        /// Pressure [Pa], positive along the normal.
        pressure: f64,
        /// Distribution of the pressure to the nodes.
        spread: Spread,
    },
    /// Pressure [Pa] on faces, pushing against the outward normal of the deformed face.
    Pressure {
        /// The faces.
        faces: Vec<Face>,
        /// Pressure [Pa].
        pressure: f64,
    },
    /// Acceleration [m/s²] of one body.
    Gravity {
        /// The body.
        body: usize,
        /// Acceleration [m/s²].
        acceleration: Vector<f64>,
    },
}

/// Distribution of a pressure on a shell to its nodes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Spread {
    /// A third of p A n of the flat facet to each corner: for flat membranes.
    Lumped,
    /// ∫ p Jᵀ n dA over the curved surface, to forces and moments: for curved membranes.
    #[default]
    Curved,
}

impl LoadKind {
    /// Makes an equal force [N] on each of some nodes.
    pub fn force(nodes: impl IntoIterator<Item = u32>, force: impl Into<Vector<f64>>) -> Self {
        let force = force.into();
        Self::Forces(nodes.into_iter().map(|node| (node, force)).collect())
    }

    /// Makes an equal moment [N m] on each of some nodes.
    pub fn moment(nodes: impl IntoIterator<Item = u32>, moment: impl Into<Vector<f64>>) -> Self {
        let moment = moment.into();
        Self::Moments(nodes.into_iter().map(|node| (node, moment)).collect())
    }
}

impl Load {
    /// A load on the model's own nodes or faces.
    pub fn new(name: &str, kind: LoadKind, curve: Curve) -> Self {
        Self { name: name.into(), kind, curve, surface: None, controlled: false }
    }

    /// True if the load acts on shells only.
    pub fn is_for_shells(&self) -> bool {
        matches!(self.kind, LoadKind::Moments(_) | LoadKind::ShellPressure { .. })
    }

    /// The weight of a body under a constant acceleration [m/s²].
    pub fn gravity(body: usize, acceleration: Vector<f64>) -> Self {
        let kind = LoadKind::Gravity { body, acceleration };
        let curve = Curve { shape: Shape::Hold, from: 0.0, to: 0.0 };
        Self::new("gravity", kind, curve)
    }

    /// Adds the nodal forces [N] at a time. `points` are the points of the load's surface. Gravity is not
    /// added here, since it acts through the masses. Loads of shells are not added either; `pliant-implicit`
    /// applies them.
    pub fn add_forces<S: Configuration>(
        &self,
        time: f64,
        points: Option<&Weights>,
        state: &S,
        forces: &mut [Vector<f64>],
    ) {
        let factor = self.curve.value(time);
        if factor == 0.0 {
            return;
        }
        let position = |node: u32| match points {
            Some(points) => points.position(state, node as usize),
            None => state.position(node),
        };
        let mut to_node = |node: u32, force: Vector<f64>| {
            forces[node as usize] = add(forces[node as usize], force);
        };
        let mut apply = |node: u32, force: Vector<f64>| match points {
            Some(points) => {
                points.add_force(state, node as usize, force, &mut |node, force, _| to_node(node, force));
            }
            None => to_node(node, force),
        };
        match &self.kind {
            LoadKind::Forces(list) => {
                for &(node, force) in list {
                    apply(node, scale(force, factor));
                }
            }
            LoadKind::Pressure { faces, pressure } => {
                for face in faces {
                    for (node, area) in face_areas(face, position) {
                        apply(node, scale(area, -factor * pressure));
                    }
                }
            }
            LoadKind::Gravity { .. } | LoadKind::Moments(_) | LoadKind::ShellPressure { .. } => {}
        }
    }
}

/// Returns the part of a face's area vector [m²] that belongs to each of its nodes: ∫ N_a n dA. Exact for
/// flat triangles and for bilinear quads (2×2 Gauss points).
pub fn face_areas(
    face: &Face,
    position: impl Fn(u32) -> Vector<f64>,
) -> impl Iterator<Item = (u32, Vector<f64>)> {
    let corner_count = if face[3] == NO_NODE { 3 } else { 4 };
    let mut areas = [[0.0; 3]; 4];
    if corner_count == 3 {
        let [a, b, c] = [face[0], face[1], face[2]].map(&position);
        let third = scale(cross(sub(b, a), sub(c, a)), 1.0 / 6.0);
        areas[..3].fill(third);
    } else {
        let x = face.map(&position);
        const CORNERS: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        for point in CORNERS {
            let [xi, eta] = point.map(|p| p / 3.0_f64.sqrt());
            let (mut along_xi, mut along_eta) = ([0.0; 3], [0.0; 3]);
            for (node, c) in x.iter().zip(CORNERS) {
                along_xi = add(along_xi, scale(*node, c[0] * (1.0 + c[1] * eta) / 4.0));
                along_eta = add(along_eta, scale(*node, c[1] * (1.0 + c[0] * xi) / 4.0));
            }
            let normal = cross(along_xi, along_eta);
            for (area, c) in areas.iter_mut().zip(CORNERS) {
                *area = add(*area, scale(normal, (1.0 + c[0] * xi) * (1.0 + c[1] * eta) / 4.0));
            }
        }
    }
    let nodes = *face;
    (0..corner_count).map(move |k| (nodes[k], areas[k]))
}

#[cfg(test)]
mod tests {
    use super::*;

    const POINTS: [Vector<f64>; 4] = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

    #[test]
    fn a_quad_shares_its_area_equally_and_a_triangle_too() {
        let position = |node: u32| POINTS[node as usize];
        for (node, area) in face_areas(&[0, 1, 2, 3], position) {
            assert!((area[2] - 0.5).abs() < 1e-15, "node {node}: {area:?}");
        }
        let triangle: Vec<_> = face_areas(&[0, 1, 2, NO_NODE], position).collect();
        assert_eq!(triangle.len(), 3);
        assert!(triangle.iter().all(|(_, area)| (area[2] - 1.0 / 3.0).abs() < 1e-15));
    }
}
