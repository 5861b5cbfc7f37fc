//! One cell at a time: its name in messages, its faces and edges, and the trilinear map of a hex. The map is
//! X(ξ) = Σ N_a(ξ) X_a. Its shape functions are N_a = (1 + ξ_a ξ)(1 + η_a η)(1 + ζ_a ζ) / 8 on [−1, 1]³.

use std::fmt;

use crate::{CellBlock, CellKind, Mesh, Vector3};

/// A cell of a mesh: the block of its kind and the place in that block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct CellId {
    /// Shape of the cell, which names its block.
    pub kind: CellKind,
    /// Index within the block, counted from 0.
    pub index: u32,
}

impl fmt::Display for CellId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.kind.name(), self.index)
    }
}

/// Local nodes of every edge.
pub(crate) const fn edges(kind: CellKind) -> &'static [[usize; 2]] {
    match kind {
        CellKind::Vertex => &[],
        CellKind::Line => &[[0, 1]],
        CellKind::Triangle => &[[0, 1], [1, 2], [2, 0]],
        CellKind::Quad => &[[0, 1], [1, 2], [2, 3], [3, 0]],
        CellKind::Tet => &[[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]],
        CellKind::Hex => {
            &[[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]]
        }
    }
}

/// Local nodes of every face of a volume cell, counter-clockwise seen from outside.
pub(crate) const fn faces(kind: CellKind) -> &'static [&'static [usize]] {
    match kind {
        CellKind::Tet => &[&[0, 2, 1], &[0, 1, 3], &[1, 2, 3], &[0, 3, 2]],
        CellKind::Hex => {
            &[&[0, 3, 2, 1], &[4, 5, 6, 7], &[0, 1, 5, 4], &[1, 2, 6, 5], &[2, 3, 7, 6], &[3, 0, 4, 7]]
        }
        _ => &[],
    }
}

/// Positions of a cell's nodes, gathered into `buffer`; `None` if a node does not exist or is not finite.
pub(crate) fn corners<'b>(
    points: &[Vector3],
    nodes: &[u32],
    buffer: &'b mut [Vector3; 8],
) -> Option<&'b [Vector3]> {
    for (corner, &node) in buffer.iter_mut().zip(nodes) {
        *corner = *points.get(node as usize).filter(|p| is_finite(p))?;
    }
    Some(&buffer[..nodes.len()])
}

/// True when no coordinate is infinite or not a number.
pub(crate) fn is_finite(point: &Vector3) -> bool {
    point.iter().all(|x| x.is_finite())
}

/// True when no node appears twice.
pub(crate) fn nodes_differ(nodes: &[u32]) -> bool {
    nodes.iter().enumerate().all(|(at, node)| !nodes[..at].contains(node))
}

/// The blocks that make up the body: the non-empty ones of the highest dimension in the mesh, in the
/// order of `CellKind`. A tetrahedral mesh that also lists its boundary triangles is a body of tets.
pub fn body_blocks(mesh: &Mesh) -> Vec<&CellBlock> {
    let dimension = mesh.blocks.iter().filter(|b| !b.is_empty()).map(|b| b.kind.dimension()).max();
    let mut blocks: Vec<&CellBlock> =
        mesh.blocks.iter().filter(|b| !b.is_empty() && Some(b.kind.dimension()) == dimension).collect();
    blocks.sort_by_key(|block| block.kind);
    blocks
}

/// Length of the diagonal of the box around all finite points [m]; 0 without any.
pub(crate) fn diagonal(points: &[Vector3]) -> f64 {
    finite_bounds(points).map_or(0.0, |(low, high)| (high - low).norm())
}

/// Corners of the box around all finite points.
pub(crate) fn finite_bounds(points: &[Vector3]) -> Option<(Vector3, Vector3)> {
    points.iter().filter(|p| is_finite(p)).fold(None, |bounds, p| {
        let (low, high) = bounds.unwrap_or((*p, *p));
        Some((low.inf(p), high.sup(p)))
    })
}

/// Natural coordinates (ξ, η, ζ) of the corners of a hex.
pub(crate) const HEX_CORNERS: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];

/// Shape functions N_a(ξ) of a hex.
pub(crate) fn hex_weights(xi: &Vector3) -> [f64; 8] {
    HEX_CORNERS.map(|c| (1.0 + c[0] * xi.x) * (1.0 + c[1] * xi.y) * (1.0 + c[2] * xi.z) / 8.0)
}

/// Gradients ∂N_a/∂ξ of the shape functions of a hex.
pub(crate) fn hex_local_gradients(xi: &Vector3) -> [Vector3; 8] {
    HEX_CORNERS.map(|c| {
        let (a, b, d) = (1.0 + c[0] * xi.x, 1.0 + c[1] * xi.y, 1.0 + c[2] * xi.z);
        Vector3::new(c[0] * b * d, a * c[1] * d, a * b * c[2]) / 8.0
    })
}

/// Tangents [∂X/∂ξ, ∂X/∂η, ∂X/∂ζ] [m] of the map of a hex, the columns of its Jacobian.
pub(crate) fn hex_tangents(corners: &[Vector3], local_gradients: &[Vector3; 8]) -> [Vector3; 3] {
    let mut tangents = [Vector3::zeros(); 3];
    for (x, gradient) in corners.iter().zip(local_gradients) {
        for (tangent, g) in tangents.iter_mut().zip(gradient.iter()) {
            *tangent += x * *g;
        }
    }
    tangents
}

/// Points of 2×2×2 Gauss quadrature on [−1, 1]³, each of weight 1.
pub(crate) fn hex_gauss_points() -> [Vector3; 8] {
    HEX_CORNERS.map(|c| Vector3::from(c) / 3f64.sqrt())
}
