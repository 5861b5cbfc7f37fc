//! Checks that a mesh is fine enough for pressure on a thin curved wall, and curved by normals of its
//! surface.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Vector3;

use crate::model::assembly::Assembly;

/// Distance of a node from the mean of its neighbours along the wall, as a part of its edges, that a regular
/// mesh may have.
const REGULAR: f64 = 0.05;

/// Doubtful properties of facets under pressure.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Resolution {
    /// Facets of irregular parts of the mesh with an edge above 2 √(R t). R is the radius of curvature along
    /// the edge and t the thickness. Displacements scatter there from node to node.
    pub coarse: usize,
    /// The one with the longest edge for its wall.
    pub worst: u32,
    /// Its edge [m].
    pub edge: f64,
    /// 2 √(R t) there [m].
    pub limit: f64,
    /// Facets of curved walls with normals that are estimated from the triangles.
    pub estimated: usize,
}

impl Assembly {
    /// Looks at facets under pressure.
    pub fn resolution(&self, cells: &[u32]) -> Resolution {
        let irregular = self.irregular_nodes(cells);
        let mut found = Resolution::default();
        let mut largest = 1.0;
        for &cell in cells {
            let facet = &self.facets[cell as usize];
            let normals = self.corner_normals[cell as usize].map(|normal| self.normals[normal as usize]);
            let (mut coarse, mut curved) = (false, false);
            for i in 0..3 {
                let j = (i + 1) % 3;
                let [a, b] = [i, j].map(|corner| self.place(facet.nodes[corner] as usize));
                let edge = (b - a).norm();
                let turn = (normals[j].direction - normals[i].direction).norm();
                curved |= turn > 1e-3;
                // h²/(4 R t) with R = h over the turn of the normal.
                let square = edge * turn / (4.0 * facet.thickness);
                coarse |= square > 1.0;
                if square > largest && facet.nodes.iter().any(|node| irregular.contains(node)) {
                    largest = square;
                    (found.worst, found.edge, found.limit) = (cell, edge, edge / square.sqrt());
                }
            }
            found.coarse += usize::from(coarse && facet.nodes.iter().any(|node| irregular.contains(node)));
            found.estimated += usize::from(curved && normals.iter().any(|normal| normal.estimated));
        }
        found
    }

    /// Nodes inside facets whose neighbours do not lie evenly round them.
    fn irregular_nodes(&self, cells: &[u32]) -> BTreeSet<u32> {
        let mut edges: BTreeMap<[u32; 2], usize> = BTreeMap::new();
        let mut normal: BTreeMap<u32, Vector3<f64>> = BTreeMap::new();
        for &cell in cells {
            let nodes = self.facets[cell as usize].nodes;
            for i in 0..3 {
                let (a, b) = (nodes[i], nodes[(i + 1) % 3]);
                *edges.entry([a.min(b), a.max(b)]).or_default() += 1;
                let corner_normal = self.corner_normals[cell as usize][i];
                normal.entry(a).or_insert(self.normals[corner_normal as usize].direction);
            }
        }
        let mut around: BTreeMap<u32, (Vector3<f64>, f64)> = BTreeMap::new();
        let mut border = BTreeSet::new();
        for (ends, count) in edges {
            if count == 1 {
                border.extend(ends);
            }
            for [a, b] in [ends, [ends[1], ends[0]]] {
                let edge = self.place(b as usize) - self.place(a as usize);
                let sums = around.entry(a).or_insert((Vector3::zeros(), 0.0));
                *sums = (sums.0 + edge, sums.1 + edge.norm());
            }
        }
        let uneven = |(node, (sum, length)): (&u32, &(Vector3<f64>, f64))| {
            let along = sum - normal[node] * sum.dot(&normal[node]);
            (!border.contains(node) && along.norm() > REGULAR * length).then_some(*node)
        };
        around.iter().filter_map(uneven).collect()
    }
}
