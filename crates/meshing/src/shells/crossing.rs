//! Crossings of shells with themselves or each other. Shells cross if, among small flat pieces of the curved
//! surface, an edge of one piece pierces another. No step of the fit makes flat triangles cross, nor curved
//! ones once normals stand. Curved shells that cross all the same are flattened and halved. At the end the
//! remaining ones are flattened as long as that helps, then repaired (`repair`). Leaves out: pieces that
//! share an edge.

use std::collections::BTreeMap;

use pliant_geometry::{CurvedTriangle, Vector3};
use rayon::prelude::*;
use rstar::{AABB, RTree, primitives::Rectangle};

use super::Shells;
use super::effort::Effort;
use super::measure::pieces;
use crate::report::hausdorff::lattice;
use crate::surface::crossings::crossing_groups;

/// Parts of an edge between the corners of pieces: during the fit, and at its end if the shells are few.
pub(super) const COARSE: usize = 4;
const FINE: usize = 8;

/// Most pieces that are tested with [`FINE`] parts of an edge.
const MOST_PIECES: usize = 200_000;

/// Steps to undo crossings after the fit, from little to the whole way.
const STEPS: usize = 5;

/// Shells that cross others or themselves.
#[derive(Clone, Debug, Default)]
pub(super) struct Crossing {
    /// Pairs of numbers of their triangles, smaller first, increasing. A shell that crosses itself is a pair
    /// with itself.
    pub(super) pairs: Vec<[u32; 2]>,
    /// A point where the first pair meets [m].
    pub(super) place: Option<Vector3>,
}

impl Crossing {
    /// Numbers of their triangles, increasing.
    pub(super) fn shells(&self) -> Vec<u32> {
        let mut shells = self.pairs.as_flattened().to_vec();
        shells.sort_unstable();
        shells.dedup();
        shells
    }
}

impl Shells {
    pub(super) fn crossing(&self) -> Crossing {
        self.crossing_of(self.mesh.alive().collect(), self.parts_in_the_end(), |_| true)
    }

    /// Parts of an edge in which all shells are tested in the end.
    pub(super) fn parts_in_the_end(&self) -> usize {
        if self.mesh.len() * FINE * FINE <= MOST_PIECES { FINE } else { COARSE }
    }

    /// Finds shells that cross among the moving shells and their surroundings, tested in pieces of `parts`
    /// parts of an edge.
    pub(super) fn crossing_near_moving(&self, parts: usize, effort: &mut Effort) -> Vec<u32> {
        let near = self.near(|shell| self.moves(shell));
        effort.search(near.len(), parts * parts);
        self.crossing_of(near, parts, |_| true).shells()
    }

    /// Number of crossing pairs with at least one moving shell, tested in pieces of `parts` parts of an edge.
    pub(super) fn crossing_with_moving(&self, parts: usize, effort: &mut Effort) -> usize {
        let moves = |shell: u32| self.moves(shell);
        let near = self.near(moves);
        effort.search(near.len(), parts * parts);
        self.crossing_of(near, parts, moves).pairs.len()
    }

    /// Some shells and those that may touch them.
    pub(super) fn near(&self, is_one: impl Fn(u32) -> bool) -> Vec<u32> {
        let alive: Vec<u32> = self.mesh.alive().collect();
        let boxed = |&t: &u32| {
            let patch = self.patch(t);
            let controls = patch.corners().iter().chain(patch.edge_points());
            let start = [patch.corners()[0]; 2];
            controls.fold(start, |[low, high], x| [low.inf(x), high.sup(x)])
        };
        // The middle control point lies outside the box of the others by less than a quarter of its size.
        let grown = |[low, high]: [Vector3; 2]| [low - 0.25 * (high - low), high + 0.25 * (high - low)];
        let boxes: Vec<[Vector3; 2]> = alive.par_iter().map(boxed).map(grown).collect();
        let ones: Vec<bool> = alive.iter().map(|&t| is_one(t)).collect();
        let tree = RTree::bulk_load(
            boxes
                .iter()
                .zip(&ones)
                .filter(|(_, is_one)| **is_one)
                .map(|([low, high], _)| Rectangle::from_corners((*low).into(), (*high).into()))
                .collect(),
        );
        let near = |[low, high]: &[Vector3; 2]| {
            let envelope: AABB<[f64; 3]> = AABB::from_corners((*low).into(), (*high).into());
            tree.locate_in_envelope_intersecting(envelope).next().is_some()
        };
        alive.iter().zip(&boxes).filter(|(_, corners)| near(corners)).map(|(&t, _)| t).collect()
    }

    fn crossing_of(
        &self,
        shells: Vec<u32>,
        parts: usize,
        is_looked_at: impl Fn(u32) -> bool + Sync,
    ) -> Crossing {
        let (points, pieces) = self.in_pieces(&shells, parts);
        let looked = |at: u32| is_looked_at(shells[at as usize]);
        let (pairs, place) = crossing_groups(&points, &pieces, parts * parts, looked);
        Crossing { pairs: pairs.into_iter().map(|pair| pair.map(|at| shells[at as usize])).collect(), place }
    }

    /// Divides the curved surface into flat pieces, one shell after the other. Neighbours share the points of
    /// their edge.
    fn in_pieces(&self, shells: &[u32], parts: usize) -> (Vec<Vector3>, Vec<[u32; 3]>) {
        let (places, pieces) = (lattice(parts), pieces(parts));
        let mut points = self.mesh.points.clone();
        let mut edges: BTreeMap<[u32; 2], u32> = BTreeMap::new();
        let mut triangles = Vec::with_capacity(shells.len() * pieces.len());
        for &t in shells {
            let nodes = self.mesh.triangles[t as usize];
            let patch = self.patch(t);
            let numbers: Vec<u32> =
                places.iter().map(|&w| numbered(&patch, nodes, w, parts, &mut points, &mut edges)).collect();
            triangles.extend(pieces.iter().map(|piece| piece.map(|k| numbers[k as usize])));
        }
        (points, triangles)
    }

    /// Turns normals of crossing shells towards the mean of their flat triangles, which do not cross. The
    /// turn grows in steps as long as shells cross, and a step stays if fewer cross.
    pub(super) fn uncross(&mut self, effort: &mut Effort) {
        if self.crossing_near_moving(COARSE, effort).is_empty() {
            return;
        }
        let pieces = self.parts_in_the_end().pow(2);
        let mut now = self.crossing();
        for step in 1..=STEPS {
            if now.pairs.is_empty() {
                return;
            }
            let mut tried = self.clone();
            let mut nodes: Vec<u32> =
                now.shells().iter().flat_map(|&t| self.mesh.triangles[t as usize]).collect();
            nodes.sort_unstable();
            nodes.dedup();
            let part = step as f64 / STEPS as f64;
            for &node in &nodes {
                let normal = self.normals[node as usize];
                let mean = self.mesh.point_normal(node);
                tried.normals[node as usize] = normal.lerp(&mean, part).try_normalize(0.0).unwrap_or(normal);
                tried.stand(node);
            }
            let then = tried.crossing();
            effort.search(self.mesh.len(), pieces);
            if then.shells().len() < now.shells().len() {
                (*self, now) = (tried, then);
            }
        }
    }
}

/// Returns the number of a place of a shell among the points. A new place is added.
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
