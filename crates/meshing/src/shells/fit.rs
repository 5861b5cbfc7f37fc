//! Fit of shells to a surface: Gauss–Newton for the places and normals of the vertices. It minimises
//! distances at places of the shells and at points of the target. Distances count with a high power, so that
//! the largest falls. Each vertex goes only as far as the sum of the powers round it falls. Its triangles
//! must keep their shape and the normals stand on them. Vertices of a border stay in place; only their
//! normals turn.

use nalgebra::Matrix3;
use pliant_geometry::{ControlWeights, CurvedTriangle, EDGES, Vector3};
use rayon::prelude::*;

use super::crossing::COARSE;
use super::effort::{Effort, ROW};
use super::measure::Landing;
use super::solve::{POWER, Row, ShellBlock, UNKNOWNS, solve};
use super::target::Target;
use super::{LEAST_SHAPE, Shells};
use crate::report::hausdorff::lattice;

/// Parts of an edge between the places of a shell at which it is fitted.
const PARTS: usize = 5;

/// Points of the target count from this part of the requested distance.
const CLOSE: f64 = 0.3;

/// Largest number of points of the target that all count at one shell. If there are more, only the farthest
/// counts in each of [`BINS`]² parts of the shell.
const MOST_BACK: usize = 128;
const BINS: f64 = 11.0;

/// Largest turn of a normal in one step [rad], and largest move over the mean length of edges.
const LARGEST_TURN: f64 = 0.3;
const LARGEST_WAY: f64 = 0.2;

/// Factors, try by try, on steps of vertices that make things worse, and whether the whole step may then be
/// taken if it is better.
const TRIES: [(f64, bool); 8] = [
    (0.4, false),
    (0.4, false),
    (0.4, false),
    (0.0, false),
    (0.0, true),
    (0.0, true),
    (0.0, true),
    (0.0, true),
];

/// Normals that need not stand on their triangles are not turned below this cosine, either.
const LEAST_ALONG: f64 = 0.2;

/// Shells that crossed before a step, flat and curved, if computed.
type Crossed = [Option<Vec<u32>>; 2];

/// A shell that moves, and the points of the target that count at it.
struct Moving {
    shell: u32,
    back: Vec<Landing>,
}

impl Moving {
    fn new(shell: u32, mut back: Vec<Landing>) -> Self {
        if back.len() > MOST_BACK {
            let bin = |landing: &Landing| landing.place.map(|w| (BINS * w) as i32);
            back.sort_by(|a, b| bin(a).cmp(&bin(b)).then(b.off.total_cmp(&a.off)));
            back.dedup_by_key(|landing| bin(landing));
        }
        Self { shell, back }
    }
}

impl Shells {
    /// One step for the active vertices; distances are compared with `scale` [m].
    pub(super) fn fit(&mut self, target: &Target, landings: &[Landing], scale: f64, effort: &mut Effort) {
        let sizes = self.sizes();
        let moving = self.moving_with(landings, scale);
        let summed = |moving: &Moving| {
            let patch = self.patch(moving.shell);
            let rows = self.rows(moving, &patch, target, &sizes);
            let power = rows.iter().map(|row| (row.off / scale).powi(POWER)).sum::<f64>();
            let nodes = self.mesh.triangles[moving.shell as usize];
            (ShellBlock::new(nodes, rows.into_iter(), scale), (patch, power))
        };
        let (blocks, mut sums): (Vec<_>, Vec<_>) = moving.par_iter().map(summed).unzip();
        let count: usize = moving.iter().map(probes).sum();
        effort.search(count, ROW);
        let before = self.powers_round(&moving, &sums);
        let step = solve(&blocks, self.mesh.points.len());
        let (worth, upright) = (self.worth_of_all(), self.upright_of_all());
        let mut crossed = Crossed::default();
        let mut parts: Vec<f64> = self.active.iter().map(|&active| f64::from(u8::from(active))).collect();
        for (reduction, is_last) in TRIES {
            let tried = self.stepped(&step, &sizes, &parts);
            sums = tried.sums_again(&moving, sums, target, scale, effort);
            let after = tried.powers_round(&moving, &sums);
            let (now, stands) = (tried.worth_of_all(), tried.upright_of_all());
            let is_worse = |v: &usize| {
                parts[*v] > 0.0
                    && (after[*v].total_cmp(&before[*v]).is_gt() || now[*v] < worth[*v].min(LEAST_SHAPE))
            };
            let mut worse: Vec<usize> = (0..parts.len()).filter(is_worse).collect();
            let tilts =
                |v: &usize| self.tilts(upright[*v], stands[*v]) || tried.creased[*v] && !self.creased[*v];
            let mut tilted: Vec<usize> = (0..parts.len()).filter(tilts).collect();
            tilted.extend(tried.newly_crossed(self, &mut crossed, effort));
            let falls = || after.iter().sum::<f64>() < before.iter().sum::<f64>();
            if tilted.is_empty() && (worse.is_empty() || is_last && falls()) {
                *self = tried;
                return;
            }
            worse.extend(&tilted);
            worse.extend(tilted.iter().flat_map(|&v| self.mesh.neighbours(v as u32)).map(|v| v as usize));
            worse.sort_unstable();
            worse.dedup();
            worse.into_iter().for_each(|v| parts[v] *= reduction);
        }
    }

    pub(super) fn worth_of_all(&self) -> Vec<f64> {
        (0..).zip(&self.mesh.points).map(|(v, x)| self.worth_round(v, x)).collect()
    }

    fn upright_of_all(&self) -> Vec<f64> {
        (0..).zip(&self.mesh.points).map(|(v, x)| self.upright_round(v, x)).collect()
    }

    /// Moving corners of shells that cross others and did not before: flat triangles, and once normals stand
    /// also curved ones.
    fn newly_crossed(&self, before: &Self, crossed: &mut Crossed, effort: &mut Effort) -> Vec<usize> {
        let mut nodes = Vec::new();
        for (parts, old) in [1, COARSE].into_iter().zip(crossed).take(if self.strict { 2 } else { 1 }) {
            let now = self.crossing_near_moving(parts, effort);
            if !now.is_empty() {
                let old = old.get_or_insert_with(|| before.crossing_near_moving(parts, effort));
                let fresh = now.into_iter().filter(|shell| old.binary_search(shell).is_err());
                nodes.extend(fresh.flat_map(|t| self.mesh.triangles[t as usize]).map(|n| n as usize));
            }
        }
        nodes.retain(|&n| self.active[n]);
        nodes
    }

    /// Sums of the powers of the distances of the shells round each vertex.
    fn powers_round(&self, moving: &[Moving], sums: &[(CurvedTriangle, f64)]) -> Vec<f64> {
        let mut round = vec![0.0; self.mesh.points.len()];
        for (moving, (_, sum)) in moving.iter().zip(sums) {
            self.mesh.triangles[moving.shell as usize].iter().for_each(|&n| round[n as usize] += sum);
        }
        round
    }

    /// The shells that move, with the points of the target that are not close to them already.
    fn moving_with(&self, landings: &[Landing], scale: f64) -> Vec<Moving> {
        let shells: Vec<u32> = self.mesh.alive().filter(|&t| self.moves(t)).collect();
        let mut back = vec![Vec::new(); self.mesh.triangles.len()];
        for landing in landings.iter().filter(|landing| landing.off > CLOSE * scale) {
            back[landing.shell as usize].push(*landing);
        }
        let of = |shell: u32| Moving::new(shell, std::mem::take(&mut back[shell as usize]));
        shells.into_iter().map(of).collect()
    }

    /// Sums the powers of distances after a step. Shells that have not changed keep their sums.
    fn sums_again(
        &self,
        moving: &[Moving],
        before: Vec<(CurvedTriangle, f64)>,
        target: &Target,
        scale: f64,
        effort: &mut Effort,
    ) -> Vec<(CurvedTriangle, f64)> {
        let again = |(moving, (old, sum)): (&Moving, (CurvedTriangle, f64))| {
            let patch = self.patch(moving.shell);
            if patch.corners() == old.corners() && patch.edge_points() == old.edge_points() {
                return ((patch, sum), 0);
            }
            let there = lattice(PARTS).into_iter().map(|place| off(&patch, place, target).1);
            let back = moving.back.iter().map(|landing| off_along(&patch, landing).1);
            let sum = there.chain(back).map(|off| (off / scale).powi(POWER)).sum::<f64>();
            ((patch, sum), probes(moving))
        };
        let (sums, counts): (Vec<_>, Vec<usize>) =
            moving.par_iter().zip(before.into_par_iter()).map(again).unzip();
        effort.search(counts.into_iter().sum(), 1);
        sums
    }

    /// The distances of a shell and their derivatives.
    fn rows(&self, moving: &Moving, patch: &CurvedTriangle, target: &Target, sizes: &[f64]) -> Vec<Row> {
        let edges: [[Matrix3<f64>; 2]; 6] = std::array::from_fn(|k| patch.edge_derivative(k).into());
        let nodes = self.mesh.triangles[moving.shell as usize].map(|n| n as usize);
        let row = |place: [f64; 3], (along, off): (Vector3, f64)| {
            let by = slopes(&edges, CurvedTriangle::weights(place), &along);
            let mut slope = [0.0; 3 * UNKNOWNS];
            let corners = slope.chunks_exact_mut(UNKNOWNS).zip(nodes).zip(by);
            for ((slope, node), [by_place, by_normal]) in corners.filter(|((_, node), _)| self.active[*node])
            {
                let [u, v, n] = frame(&self.normals[node]);
                if !self.on_border[node] {
                    slope[..3].copy_from_slice(&[u, v, n].map(|way| by_place.dot(&way)));
                }
                if !self.creased[node] {
                    slope[3..].copy_from_slice(&[u, v].map(|way| by_normal.dot(&way) / sizes[node]));
                }
            }
            Row { slope, off }
        };
        let there = lattice(PARTS).into_iter().map(|place| row(place, off(patch, place, target)));
        let back = moving.back.iter().map(|landing| row(landing.place, off_along(patch, landing)));
        there.chain(back).collect()
    }

    /// Mean length of the edges at each point [m].
    fn sizes(&self) -> Vec<f64> {
        let of = |(point, x): (u32, &Vector3)| {
            let around = self.mesh.neighbours(point);
            let sum: f64 = around.iter().map(|&n| (self.mesh.points[n as usize] - x).norm()).sum();
            (sum / around.len().max(1) as f64).max(f64::MIN_POSITIVE)
        };
        (0..).zip(&self.mesh.points).map(of).collect()
    }

    fn stepped(&self, step: &[[f64; UNKNOWNS]], sizes: &[f64], parts: &[f64]) -> Self {
        let mut next = self.clone();
        let moved = |point: &usize| parts[*point] > 0.0 && step[*point].iter().all(|x| x.is_finite());
        for (point, (x, size)) in step.iter().zip(sizes).enumerate().filter(|(point, _)| moved(point)) {
            let [u, v, n] = frame(&self.normals[point]);
            let way = (x[0] * u + x[1] * v + x[2] * n) * parts[point];
            let turn = (x[3] * u + x[4] * v) * (parts[point] / size);
            next.mesh.points[point] += way * (LARGEST_WAY * size / way.norm()).min(1.0);
            let turned = (n + turn * (LARGEST_TURN / turn.norm()).min(1.0)).try_normalize(0.0).unwrap_or(n);
            let along = self.mesh.star[point].iter().all(|&t| self.mesh.normal(t).dot(&turned) > LEAST_ALONG);
            if !self.creased[point] && (self.strict || along) {
                next.normals[point] = turned;
            }
        }
        next.stand_all();
        next
    }
}

/// Distances that count at a shell.
fn probes(moving: &Moving) -> usize {
    (PARTS + 1) * (PARTS + 2) / 2 + moving.back.len()
}

/// The direction of the distance of a place of a shell from the target, and the distance [m].
fn off(patch: &CurvedTriangle, place: [f64; 3], target: &Target) -> (Vector3, f64) {
    let x = patch.point(place);
    let (foot, normal) = target.foot(&x, &patch.facet_normal(), patch.size());
    let off = (x - foot).norm();
    (if off > 1e-9 * target.diagonal { (x - foot) / off } else { normal }, off)
}

/// Returns the direction and the distance [m] for one point of the target, along a direction that stays.
fn off_along(patch: &CurvedTriangle, landing: &Landing) -> (Vector3, f64) {
    let off = (patch.point(landing.place) - landing.point).dot(&landing.along);
    (off.signum() * landing.along, off.abs())
}

/// Derivatives of a place along a direction by each corner and by each normal, from the derivatives of the
/// edges' control points.
fn slopes(
    edges: &[[Matrix3<f64>; 2]; 6],
    (corner, edge): ControlWeights,
    along: &Vector3,
) -> [[Vector3; 2]; 3] {
    let mut by = corner.map(|w| [w * along, Vector3::zeros()]);
    for (([start, end], [by_edge, by_normal]), w) in EDGES.into_iter().zip(edges).zip(edge) {
        let forth = w * by_edge.tr_mul(along);
        by[start][0] += w * along - forth;
        by[end][0] += forth;
        by[start][1] += w * by_normal.tr_mul(along);
    }
    by
}

/// Two unit tangents and the normal itself.
pub(super) fn frame(normal: &Vector3) -> [Vector3; 3] {
    let axis = if normal.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
    let first = normal.cross(&axis).try_normalize(0.0).unwrap_or_else(Vector3::y);
    [first, normal.cross(&first), *normal]
}
