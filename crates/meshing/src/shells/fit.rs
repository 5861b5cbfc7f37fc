//! Fit of shells to a surface: Gauss–Newton for the places and normals of the vertices, with respect to the distances at places of the
//! shells and at points of the target. Distances count with a high power, so that the largest falls; each vertex goes only as far as
//! the sum of the powers round it falls, its triangles keep their shape and the normals stand on them. Vertices of a border stay in place, only their normals turn.

use nalgebra::Matrix3;
use pliant_geometry::{CurvedTriangle, Vector3};
use rayon::prelude::*;

use super::effort::{Effort, ROW};
use super::measure::Landing;
use super::{LEAST_SHAPE, Shells, Target};
use crate::hausdorff::lattice;

/// Parts of an edge between the places of a shell at which it is fitted.
const PARTS: usize = 5;

/// The power of distances whose sum is made small.
const POWER: i32 = 6;

/// Points of the target count from this part of the distance asked for.
const CLOSE: f64 = 0.3;

/// Unknowns of a vertex: ways along two tangents and the normal, two turns of the normal; all in lengths.
const UNKNOWNS: usize = 5;

/// Largest turn of a normal in one step [rad], and way over the mean length of edges.
const LARGEST_TURN: f64 = 0.3;
const LARGEST_WAY: f64 = 0.2;

/// What steps of vertices that make things worse are reduced by, try by try, and whether the whole may then be taken if it is better.
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

/// Where a distance is taken: at a place of a shell, from the target or from one point of it along a direction.
struct Probe {
    shell: u32,
    place: [f64; 3],
    from: Option<(Vector3, Vector3)>,
}

/// One distance and its derivatives.
struct Row {
    nodes: [u32; 3],
    slope: [[f64; UNKNOWNS]; 3],
    off: f64,
}

impl Shells {
    /// One step for the active vertices; distances are compared with `scale` [m].
    pub(super) fn fit(&mut self, target: &Target, landings: &[Landing], scale: f64, effort: &mut Effort) {
        let sizes = self.sizes();
        let probes = self.probes(landings, scale);
        let rows: Vec<Row> = probes.par_iter().map(|probe| self.row(probe, target, &sizes)).collect();
        let offs = rows.iter().map(|row| row.off).collect::<Vec<_>>();
        let before = self.powers_round(&probes, &offs, scale);
        effort.search(rows.len(), ROW);
        let step = self.solve(&rows, scale);
        let (worth, upright) = (self.worth_of_all(), self.upright_of_all());
        let mut parts: Vec<f64> = self.active.iter().map(|&active| f64::from(u8::from(active))).collect();
        for (reduction, is_last) in TRIES {
            let tried = self.stepped(&step, &sizes, &parts);
            let offs: Vec<f64> = probes.par_iter().map(|probe| tried.off(probe, target).1).collect();
            let after = tried.powers_round(&probes, &offs, scale);
            effort.search(probes.len(), 1);
            let (now, stands) = (tried.worth_of_all(), tried.upright_of_all());
            let is_worse = |v: &usize| {
                parts[*v] > 0.0 && (after[*v] > before[*v] || now[*v] < worth[*v].min(LEAST_SHAPE))
            };
            let mut worse: Vec<usize> = (0..parts.len()).filter(is_worse).collect();
            let tilts =
                |v: &usize| self.tilts(upright[*v], stands[*v]) || tried.creased[*v] && !self.creased[*v];
            let tilted: Vec<usize> = (0..parts.len()).filter(tilts).collect();
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

    /// Sums of the powers of the distances of the shells round each vertex.
    fn powers_round(&self, probes: &[Probe], offs: &[f64], scale: f64) -> Vec<f64> {
        let mut sums = vec![0.0; self.mesh.triangles.len()];
        for (probe, off) in probes.iter().zip(offs) {
            sums[probe.shell as usize] += (off / scale).powi(POWER);
        }
        self.mesh.star.iter().map(|star| star.iter().map(|&t| sums[t as usize]).sum()).collect()
    }

    /// Places of the shells that move, and of those that are not close to points of the target already.
    fn probes(&self, landings: &[Landing], scale: f64) -> Vec<Probe> {
        let places = lattice(PARTS);
        let moving: Vec<u32> = self.mesh.alive().filter(|&t| self.moves(t)).collect();
        let there = moving
            .iter()
            .flat_map(|&shell| places.iter().map(move |&place| Probe { shell, place, from: None }));
        let far = landings.iter().filter(|landing| landing.off > CLOSE * scale && self.moves(landing.shell));
        let back = far.map(|landing| Probe {
            shell: landing.shell,
            place: landing.place,
            from: Some((landing.point, landing.along)),
        });
        there.chain(back).collect()
    }

    /// The direction of the distance at a probe, and the distance [m].
    fn off(&self, probe: &Probe, target: &Target) -> (Vector3, f64) {
        let x = self.patch(probe.shell).point(probe.place);
        match probe.from {
            Some((point, along)) => {
                let off = (x - point).dot(&along);
                (off.signum() * along, off.abs())
            }
            None => {
                let (foot, normal) = target.reference.closest(&x);
                let off = (x - foot).norm();
                (if off > 1e-9 * target.diagonal { (x - foot) / off } else { normal }, off)
            }
        }
    }

    fn row(&self, probe: &Probe, target: &Target, sizes: &[f64]) -> Row {
        let (along, off) = self.off(probe, target);
        let nodes = self.mesh.triangles[probe.shell as usize];
        let by = self.patch(probe.shell).derivatives(CurvedTriangle::weights(probe.place));
        let mut slope = [[0.0; UNKNOWNS]; 3];
        for (corner, node) in
            nodes.into_iter().map(|n| n as usize).enumerate().filter(|(_, n)| self.active[*n])
        {
            let [by_place, by_normal] = by[corner].map(|by: Matrix3<f64>| by.tr_mul(&along));
            let [u, v, n] = frame(&self.normals[node]);
            let ways = if self.on_border[node] { [0.0; 3] } else { [u, v, n].map(|way| by_place.dot(&way)) };
            slope[corner][..3].copy_from_slice(&ways);
            if self.creased[node] {
                continue;
            }
            slope[corner][3] = by_normal.dot(&u) / sizes[node];
            slope[corner][4] = by_normal.dot(&v) / sizes[node];
        }
        Row { nodes, slope, off }
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
        let moved = |point: &usize| parts[*point] > 0.0;
        for (point, (x, size)) in step.iter().zip(sizes).enumerate().filter(|(point, _)| moved(point)) {
            let [u, v, n] = frame(&self.normals[point]);
            let way = (x[0] * u + x[1] * v + x[2] * n) * parts[point];
            let turn = (x[3] * u + x[4] * v) * (parts[point] / size);
            next.mesh.points[point] += way * (LARGEST_WAY * size / way.norm()).min(1.0);
            let turned = (n + turn * (LARGEST_TURN / turn.norm()).min(1.0)).normalize();
            let along = self.mesh.star[point].iter().all(|&t| self.mesh.normal(t).dot(&turned) > LEAST_ALONG);
            if !self.creased[point] && (self.strict || along) {
                next.normals[point] = turned;
            }
        }
        next.stand_all();
        next
    }

    /// The damped least-squares step (Jᵀ W J + D) δ = −Jᵀ W r by conjugate gradients, with weights that make the sum of squares one of
    /// powers.
    fn solve(&self, rows: &[Row], scale: f64) -> Vec<[f64; UNKNOWNS]> {
        const STEPS: usize = 60;
        let points = self.mesh.points.len();
        let weights: Vec<f64> =
            rows.iter().map(|row| (row.off / scale).clamp(0.2, 3.0).powi(POWER - 2)).collect();
        let transposed = |values: &[f64]| {
            let mut sum = vec![0.0; UNKNOWNS * points];
            for (row, value) in rows.iter().zip(values) {
                for (node, slope) in row.nodes.iter().zip(&row.slope) {
                    let first = UNKNOWNS * *node as usize;
                    sum[first..first + UNKNOWNS]
                        .iter_mut()
                        .zip(slope)
                        .for_each(|(s, slope)| *s += slope * value);
                }
            }
            sum
        };
        let mut diagonal = vec![[0.0; UNKNOWNS]; points];
        for (row, weight) in rows.iter().zip(&weights) {
            for (node, slope) in row.nodes.iter().zip(&row.slope) {
                diagonal[*node as usize].iter_mut().zip(slope).for_each(|(d, s)| *d += weight * s * s);
            }
        }
        let damping: Vec<f64> = diagonal
            .iter()
            .flat_map(|d| {
                let whole = d.iter().sum::<f64>().max(f64::MIN_POSITIVE);
                [0.1 * whole, 0.1 * whole, 0.01 * whole, 0.01 * whole, 0.01 * whole]
            })
            .collect();
        let diagonal: Vec<f64> =
            diagonal.into_iter().flatten().zip(&damping).map(|(d, more)| d + more).collect();
        let apply = |x: &[f64]| {
            let along = |(row, weight): (&Row, &f64)| {
                let of = |(node, slope): (&u32, &[f64; UNKNOWNS])| {
                    let first = UNKNOWNS * *node as usize;
                    slope.iter().zip(&x[first..first + UNKNOWNS]).map(|(s, x)| s * x).sum::<f64>()
                };
                weight * row.nodes.iter().zip(&row.slope).map(of).sum::<f64>()
            };
            let mut y = transposed(&rows.iter().zip(&weights).map(along).collect::<Vec<_>>());
            y.iter_mut().zip(x).zip(&damping).for_each(|((y, x), d)| *y += d * x);
            y
        };
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let scaled = |r: &[f64]| r.iter().zip(&diagonal).map(|(r, d)| r / d).collect::<Vec<_>>();
        let mut x = vec![0.0; UNKNOWNS * points];
        let mut r = transposed(&rows.iter().zip(&weights).map(|(row, w)| -w * row.off).collect::<Vec<_>>());
        let mut z = scaled(&r);
        let mut p = z.clone();
        let mut rz = dot(&r, &z);
        let first = rz;
        for _ in 0..STEPS {
            if rz <= 1e-6 * first {
                break;
            }
            let y = apply(&p);
            let part = rz / dot(&p, &y);
            x.iter_mut().zip(&p).for_each(|(x, p)| *x += part * p);
            r.iter_mut().zip(&y).for_each(|(r, y)| *r -= part * y);
            z = scaled(&r);
            let next = dot(&r, &z);
            p.iter_mut().zip(&z).for_each(|(p, z)| *p = z + next / rz * *p);
            rz = next;
        }
        x.chunks_exact(UNKNOWNS).map(|x| std::array::from_fn(|k| x[k])).collect()
    }
}

/// Two unit tangents and the normal itself.
pub(super) fn frame(normal: &Vector3) -> [Vector3; 3] {
    let axis = if normal.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
    let first = normal.cross(&axis).try_normalize(0.0).unwrap_or_else(Vector3::y);
    [first, normal.cross(&first), *normal]
}
