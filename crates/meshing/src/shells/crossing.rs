//! Where shells pass through themselves or each other: small flat pieces of the curved surface, of which an edge of one pierces the other.
//! Such shells are halved while the fit goes on; what is left goes back towards the target and is
//! flattened, as long as that helps.
//! Leaves out: pieces that share an edge.

use std::collections::BTreeMap;

use pliant_geometry::{CurvedTriangle, Vector3};

use super::measure::pieces;
use super::{Shells, Target};
use crate::crossings::crossings;
use crate::hausdorff::lattice;

/// Parts of an edge between the corners of pieces, with many shells and with few.
const PARTS: [usize; 2] = [4, 8];

/// Pieces at most that are looked at with the more parts.
const MOST_PIECES: usize = 200_000;

/// Steps to undo crossings after the fit, from little to the whole way.
const STEPS: usize = 5;

/// Shells that cross others or themselves.
#[derive(Clone, Debug, Default)]
pub(super) struct Crossing {
    /// Numbers of their triangles, increasing.
    pub(super) shells: Vec<u32>,
    /// A point where two of them meet [m].
    pub(super) place: Option<Vector3>,
}

impl Shells {
    pub(super) fn crossing(&self) -> Crossing {
        let alive: Vec<u32> = self.mesh.alive().collect();
        let few = alive.len() * PARTS[1] * PARTS[1] <= MOST_PIECES;
        let (points, triangles) = self.in_pieces(&alive, PARTS[usize::from(few)]);
        let each = triangles.len() / alive.len().max(1);
        let (pairs, place) = crossings(&points, &triangles);
        let mut shells: Vec<u32> =
            pairs.as_flattened().iter().map(|&piece| alive[piece as usize / each]).collect();
        shells.sort_unstable();
        shells.dedup();
        Crossing { shells, place }
    }

    /// The curved surface in flat pieces, those of a shell one after the other. Neighbours share the points of their edge.
    fn in_pieces(&self, shells: &[u32], parts: usize) -> (Vec<Vector3>, Vec<[u32; 3]>) {
        let (places, pieces) = (lattice(parts), pieces(parts));
        let mut points = self.mesh.points.clone();
        let mut edges: BTreeMap<[u32; 2], u32> = BTreeMap::new();
        let mut triangles = Vec::with_capacity(shells.len() * pieces.len());
        for &t in shells {
            let nodes = self.mesh.triangles[t as usize];
            let patch = self.patch(t);
            let own: Vec<u32> =
                places.iter().map(|&w| numbered(&patch, nodes, w, parts, &mut points, &mut edges)).collect();
            triangles.extend(pieces.iter().map(|piece| piece.map(|k| own[k as usize])));
        }
        (points, triangles)
    }

    /// Moves vertices of shells that cross towards the target and their normals to the mean of their triangles, as far as it takes and as
    /// long as fewer cross.
    pub(super) fn uncross(&mut self, target: &Target) {
        let mut now = self.crossing();
        for step in 1..=STEPS {
            if now.shells.is_empty() {
                return;
            }
            let mut tried = self.clone();
            let mut nodes: Vec<u32> =
                now.shells.iter().flat_map(|&t| self.mesh.triangles[t as usize]).collect();
            nodes.sort_unstable();
            nodes.dedup();
            let part = step as f64 / STEPS as f64;
            for &node in &nodes {
                let (here, own) = (self.mesh.points[node as usize], self.normals[node as usize]);
                tried.place(node, target);
                if !self.on_border[node as usize] {
                    tried.mesh.points[node as usize] = here.lerp(&tried.mesh.points[node as usize], part);
                }
                let mean = self.mesh.point_normal(node);
                tried.normals[node as usize] = own.lerp(&mean, part).try_normalize(0.0).unwrap_or(own);
            }
            // Triangles have turned under the neighbours of what has moved, too.
            tried.require_upright();
            let then = tried.crossing();
            if then.shells.len() < now.shells.len() {
                (*self, now) = (tried, then);
            }
        }
    }
}

/// The number of a place of a shell among the points, which it joins if it is new.
fn numbered(
    patch: &CurvedTriangle,
    nodes: [u32; 3],
    weights: [f64; 3],
    parts: usize,
    points: &mut Vec<Vector3>,
    edges: &mut BTreeMap<[u32; 2], u32>,
) -> u32 {
    let counts = weights.map(|w| (w * parts as f64).round() as u32);
    if let Some(corner) = counts.iter().position(|&count| count == parts as u32) {
        return nodes[corner];
    }
    let Some(opposite) = counts.iter().position(|&count| count == 0) else {
        points.push(patch.point(weights));
        return points.len() as u32 - 1;
    };
    let ends = [(opposite + 1) % 3, (opposite + 2) % 3];
    let [low, high] = if nodes[ends[0]] < nodes[ends[1]] { ends } else { [ends[1], ends[0]] };
    let first = *edges.entry([nodes[low], nodes[high]]).or_insert_with(|| {
        let first = points.len() as u32;
        for k in 1..parts {
            let mut at = [0.0; 3];
            at[high] = k as f64 / parts as f64;
            at[low] = 1.0 - at[high];
            points.push(patch.point(at));
        }
        first
    });
    first + counts[high] - 1
}
