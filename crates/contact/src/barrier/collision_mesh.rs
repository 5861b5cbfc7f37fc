//! A collision mesh: the primitives of a side of a contact, with the areas that they stand for.

use nalgebra::Vector3;
use pliant_geometry::Vector3 as Point;

use super::features::Features;
use crate::pairs::Surface;
use crate::tree::{Bounds, Tree};

/// Points, edges and triangles of one side of a contact. Numbers of nodes of rigid things follow the nodes of
/// the model.
#[derive(Clone, Debug, Default)]
pub(super) struct CollisionMesh {
    /// Nodes, increasing.
    pub points: Vec<u32>,
    /// Edges by their ends.
    pub edges: Vec<[u32; 2]>,
    /// Triangles by their corners.
    pub faces: Vec<[u32; 3]>,
    /// Areas at rest [m²]: a node and an edge have a third of the areas of their triangles.
    pub(super) point_areas: Vec<f64>,
    pub(super) edge_areas: Vec<f64>,
    pub(super) face_areas: Vec<f64>,
    /// Squares of the lengths of edges at rest [m²].
    pub(super) squares: Vec<f64>,
    /// True if the side is a rigid thing.
    pub(super) is_rigid: bool,
    pub(super) face_tree: Tree,
    pub(super) edge_tree: Tree,
    /// Boxes of faces and edges with the margins of their nodes, when they were last taken.
    pub(super) face_boxes: Vec<Bounds>,
    pub(super) edge_boxes: Vec<Bounds>,
}

impl CollisionMesh {
    /// Makes the collision mesh of a surface of a body from the places at rest [m].
    pub(super) fn of_body(surface: &Surface, place: impl Fn(u32) -> Point) -> Self {
        let faces = surface.faces.clone();
        let mut edges: Vec<[u32; 2]> = faces
            .iter()
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
            .map(|[a, b]| [a.min(b), a.max(b)])
            .collect();
        edges.sort_unstable();
        edges.dedup();
        let points = surface.nodes.clone();
        let mut side = Self {
            point_areas: vec![0.0; points.len()],
            edge_areas: vec![0.0; edges.len()],
            face_areas: Vec::with_capacity(faces.len()),
            squares: edges.iter().map(|&[a, b]| (place(a) - place(b)).norm_squared()).collect(),
            face_tree: Tree::new(faces.len(), |face| Bounds::of(faces[face as usize].map(&place))),
            edge_tree: Tree::new(edges.len(), |edge| Bounds::of(edges[edge as usize].map(&place))),
            face_boxes: Vec::with_capacity(faces.len()),
            edge_boxes: Vec::with_capacity(edges.len()),
            points,
            edges,
            faces,
            is_rigid: false,
        };
        for &[a, b, c] in &side.faces {
            let [x, y, z] = [a, b, c].map(&place);
            let area = 0.5 * (y - x).cross(&(z - x)).norm();
            side.face_areas.push(area);
            for node in [a, b, c] {
                // Triangles and edges are of nodes and edges of the side.
                side.point_areas[side.points.partition_point(|&known| known < node)] += area / 3.0;
            }
            for [from, to] in [[a, b], [b, c], [c, a]] {
                let ends = [from.min(to), from.max(to)];
                side.edge_areas[side.edges.partition_point(|&known| known < ends)] += area / 3.0;
            }
        }
        side
    }

    /// Corners and edges of a rigid thing, numbered from a node on.
    pub(super) fn of_rigid(features: &Features, first: u32) -> Self {
        let edges: Vec<[u32; 2]> = features.edges.iter().map(|ends| ends.map(|end| first + end)).collect();
        let nothing = |_| Bounds::of([Vector3::zeros()]);
        Self {
            points: (first..first + features.points.len() as u32).collect(),
            edge_tree: Tree::new(edges.len(), nothing),
            squares: features
                .edges
                .iter()
                .map(|ends| {
                    let [a, b] = ends.map(|end| features.points[end as usize]);
                    (b - a).norm_squared()
                })
                .collect(),
            edges,
            is_rigid: true,
            ..Self::default()
        }
    }

    /// Takes new places [m] of the nodes.
    pub(super) fn refit(&mut self, place: impl Fn(u32) -> Vector3<f64>, skin: impl Fn(u32) -> f64) {
        let Self { faces, edges, face_tree, edge_tree, face_boxes, edge_boxes, .. } = self;
        face_boxes.clear();
        face_boxes.extend(faces.iter().map(|&corners| around(corners, &place, &skin)));
        edge_boxes.clear();
        edge_boxes.extend(edges.iter().map(|&ends| around(ends, &place, &skin)));
        face_tree.refit(|face| face_boxes[face as usize]);
        edge_tree.refit(|edge| edge_boxes[edge as usize]);
    }

    /// The mean length of its edges [m]; zero without any.
    pub(super) fn mean_edge(&self, place: impl Fn(u32) -> Vector3<f64>) -> f64 {
        let length = |&[a, b]: &[u32; 2]| (place(a) - place(b)).norm();
        let sum: f64 = self.edges.iter().map(length).sum();
        if self.edges.is_empty() { 0.0 } else { sum / self.edges.len() as f64 }
    }
}

/// The box around nodes, each with its margin [m].
pub(super) fn around<const N: usize>(
    nodes: [u32; N],
    place: &impl Fn(u32) -> Vector3<f64>,
    skin: &impl Fn(u32) -> f64,
) -> Bounds {
    let margin = nodes.iter().map(|&node| skin(node)).fold(0.0, f64::max);
    Bounds::of(nodes.map(place)).grown(margin)
}
