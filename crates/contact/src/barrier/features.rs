//! The corners and edges of rigid shapes: what faces and edges of a body could go into between their nodes.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use crate::shape::Shape;

/// Corners and edges of a shape in its own frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Features {
    /// Places [m].
    pub points: Vec<Vector3<f64>>,
    /// Edges between them.
    pub edges: Vec<[u32; 2]>,
    /// Distance [m] of the surface from the features: the radius of round shapes.
    pub offset: f64,
    /// True if the features are the whole shape. Distances of nodes are then distances from the features.
    pub is_all: bool,
}

impl Features {
    /// Returns the features of a shape that bodies are outside of. A sphere is a point and a capsule an edge,
    /// with their radius. Other shapes are their corners and edges; a round one has the 32 flat sides that it
    /// is drawn with. Edges between sides in one plane are left out.
    pub fn of(shape: &Shape) -> Self {
        match *shape {
            Shape::Sphere { radius } => {
                Self { points: vec![Vector3::zeros()], edges: Vec::new(), offset: radius, is_all: true }
            }
            Shape::Capsule { radius, length } => {
                let points = [-0.5, 0.5].map(|part| Vector3::z() * (part * length)).to_vec();
                Self { points, edges: vec![[0, 1]], offset: radius, is_all: true }
            }
            Shape::HalfSpace => Self::default(),
            Shape::Cylinder { .. }
            | Shape::Cuboid { .. }
            | Shape::Cone { .. }
            | Shape::Revolved(_)
            | Shape::Grid(_) => Self::sharp(&shape.surface(0.0)),
        }
    }

    /// The edges at which sides of a surface meet at an angle, and their ends.
    fn sharp((points, triangles): &(Vec<Vector3<f64>>, Vec<[u32; 3]>)) -> Self {
        // Corners that stand for one place are one.
        let bits = |x: &Vector3<f64>| [x.x, x.y, x.z].map(|c| (c + 0.0).to_bits());
        let mut first = BTreeMap::new();
        let merged: Vec<u32> =
            points.iter().zip(0..).map(|(x, number)| *first.entry(bits(x)).or_insert(number)).collect();
        let mut sides = BTreeMap::<[u32; 2], Vec<Vector3<f64>>>::new();
        for corners in triangles {
            let nodes = corners.map(|corner| merged[corner as usize]);
            let [a, b, c] = nodes.map(|node| points[node as usize]);
            let Some(normal) = (b - a).cross(&(c - a)).try_normalize(0.0) else { continue };
            for [from, to] in [[0, 1], [1, 2], [2, 0]].map(|ends| ends.map(|k: usize| nodes[k])) {
                sides.entry([from.min(to), from.max(to)]).or_default().push(normal);
            }
        }
        let flat = |normals: &[Vector3<f64>]| matches!(normals, [a, b] if a.dot(b) > 1.0 - FLAT);
        let edges: Vec<[u32; 2]> =
            sides.into_iter().filter(|(_, normals)| !flat(normals)).map(|(ends, _)| ends).collect();
        let mut used: Vec<u32> = edges.iter().flatten().copied().collect();
        used.sort_unstable();
        used.dedup();
        // Ends are among those that are used.
        let place = |node: u32| used.partition_point(|&known| known < node) as u32;
        Self {
            edges: edges.iter().map(|ends| ends.map(place)).collect(),
            points: used.iter().map(|&node| points[node as usize]).collect(),
            offset: 0.0,
            is_all: false,
        }
    }
}

/// One minus the cosine of the angle between normals of sides that are in one plane.
const FLAT: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn features_are_corners_and_sharp_edges() {
        let count = |shape: Shape| {
            let features = Features::of(&shape);
            [features.points.len(), features.edges.len()]
        };
        assert_eq!(count(Shape::Sphere { radius: 1.0 }), [1, 0]);
        assert_eq!(count(Shape::Capsule { radius: 1.0, length: 2.0 }), [2, 1]);
        assert_eq!(count(Shape::HalfSpace), [0, 0]);
        assert_eq!(count(Shape::Cuboid { size: [1.0, 2.0, 3.0] }), [8, 12]);
        // Two rims, and the lines between the sides; the base and the lines to the tip.
        assert_eq!(count(Shape::Cylinder { radius: 1.0, length: 2.0 }), [64, 96]);
        assert_eq!(count(Shape::Cone { radius: 1.0, height: 2.0 }), [33, 64]);
    }
}
