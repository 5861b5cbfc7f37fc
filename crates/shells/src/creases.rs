//! Normals of nodes, and edges of the curved surface that stay straight.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use pliant_geometry::EDGES;

use crate::facet::Facet;

/// Cosine of the angle between a nodal normal and a facet beyond which edges are straight: 60°.
const LEANING: f64 = 0.5;

/// A normal that a node carries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Normal {
    /// The node.
    pub node: u32,
    /// Unit vector at rest.
    pub direction: Vector3<f64>,
    /// True if it is the mean of its triangles, not given.
    pub estimated: bool,
}

/// The facets at each edge, lower node first, and which of their edges 12, 23, 31 it is.
pub fn sides(facets: &[Facet]) -> BTreeMap<[u32; 2], Vec<(usize, usize)>> {
    let mut sides: BTreeMap<[u32; 2], Vec<(usize, usize)>> = BTreeMap::new();
    for (number, facet) in facets.iter().enumerate() {
        for i in 0..3 {
            let (a, b) = (facet.nodes[i], facet.nodes[(i + 1) % 3]);
            sides.entry([a.min(b), a.max(b)]).or_default().push((number, i));
        }
    }
    sides
}

/// Flags of control points that lie on the straight edge. They lie there at creases, whose sides have
/// different normals. They also do where a normal leans so far from a facet at the edge that a curve along it
/// would fold.
pub fn straight_edges(
    facets: &[Facet],
    corner_normals: &[[u32; 3]],
    normals: &[Normal],
    rest: &[[f64; 3]],
) -> Vec<[bool; 6]> {
    let mut straight = vec![[false; 6]; facets.len()];
    for sides in sides(facets).values() {
        let normal = |facet: usize, node: u32| {
            let corner = facets[facet].nodes.iter().position(|&n| n == node);
            corner.map(|corner| corner_normals[facet][corner])
        };
        let leans = |facet: usize, normal: Option<u32>| {
            let [a, b, c] = facets[facet].nodes.map(|node| Vector3::from(rest[node as usize]));
            let across = (b - a).cross(&(c - a)).normalize();
            normal.is_some_and(|normal| normals[normal as usize].direction.dot(&across) < LEANING)
        };
        for &(facet, i) in sides {
            for (k, [start, _]) in EDGES.into_iter().enumerate().filter(|(k, _)| k / 2 == i) {
                let node = facets[facet].nodes[start];
                let here = normal(facet, node);
                straight[facet][k] =
                    sides.iter().any(|&(other, _)| normal(other, node) != here || leans(other, here));
            }
        }
    }
    straight
}
