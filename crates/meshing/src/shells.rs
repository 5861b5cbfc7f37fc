//! A fine surface by few curved shells: cubic Bézier triangles ([`CurvedTriangle`]) whose vertices and normals are fitted to it.
//! A decimated surface starts; then, round by round, triangles are evened out on the surface, vertices (along their normals) and normals
//! are fitted by Gauss–Newton to the signed distances at 21 places of each shell, the distances of both ways are measured, and the
//! shells that are too far off are halved at their longest edges. Large distances weigh more, so that the worst ones fall.
//! Leaves out: creases, as a vertex has one normal; edges that bend more than their end normals tell.

use std::fmt;

use nalgebra::Matrix3;
use pliant_geometry::{
    CellKind, CurvedTriangle, DataArray, EdgeRule, Mesh, Surface, SurfaceLocator, Vector3, boundary,
};
use rayon::prelude::*;
use serde::Serialize;

use crate::decimate::Fewer;
use crate::error::{MeshingError, require_positive};
use crate::hausdorff::{Hausdorff, Sample, lattice, samples, spread};
use crate::remesh::Reference;
use crate::triangles::{TriangleMesh, cross, shape};

/// Parts of an edge between the places of a shell at which it is fitted.
const FIT: usize = 5;

/// Parts of an edge of the flat triangles among which the nearest place of the shells is looked for.
const FACETS: usize = 8;

/// Parts of an edge between the places at which the last distances are measured.
const DENSE: usize = 16;

/// Shells to start from where an error is asked for.
const START: usize = 250;

/// Rounds aim at this part of the error asked for: what is measured between the places that they look at is a little more.
const AIM: f64 = 0.97;

/// Rounds of refinement at most.
const MOST_ROUNDS: usize = 40;

/// Triangles of a better shape than this are left alone by moves that would make them worse.
const GOOD_SHAPE: f64 = 0.75;

/// Largest turn of a normal in one step of the fit [rad].
const LARGEST_TURN: f64 = 0.3;

/// When the shells are good enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ShellGoal {
    /// When both ways no distance is above this part of the diagonal of the target's box.
    Error(f64),
    /// At this many shells.
    Shells(usize),
}

/// Curved shells fitted to a surface.
#[derive(Clone, Debug)]
pub struct FittedShells {
    /// Triangles with the unit normals of their nodes as point data `normal` and the largest distance of each shell [m], both ways, as
    /// cell data `distance`.
    pub mesh: Mesh,
    /// The curved surface in small flat triangles, with its distance from the target as point data `distance` [m].
    pub error_map: Mesh,
    /// What was measured.
    pub report: ShellReport,
}

/// How close shells are to their target, and of what shape.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ShellReport {
    /// Shells.
    pub shells: usize,
    /// Their vertices.
    pub nodes: usize,
    /// Least and mean shape of their flat triangles, 4 √3 A / Σ l²: 1 is equilateral.
    pub shape: [f64; 2],
    /// Distances from the curved shells to the target, and back [m].
    pub distances: Hausdorff,
    /// The same of the flat triangles of the vertices.
    pub flat: Hausdorff,
    /// Diagonal of the target's box [m].
    pub diagonal: f64,
    /// Rounds of refinement.
    pub rounds: usize,
    /// Whether the goal was reached.
    pub reached: bool,
}

impl fmt::Display for ShellReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "shells           {} with {} nodes, after {} rounds",
            self.shells, self.nodes, self.rounds
        )?;
        writeln!(
            f,
            "shape            {:.2} at least, {:.2} on average (1: equilateral)",
            self.shape[0], self.shape[1]
        )?;
        let [there, back] = self.distances.lines(self.diagonal, ["shells to target", "target to shells"]);
        writeln!(f, "{there}\n{back}")?;
        let [there, back] = self.flat.lines(self.diagonal, ["were they flat  ", "and back        "]);
        write!(f, "{there}\n{back}")
    }
}

/// The surface to be fitted.
struct Target {
    reference: Reference,
    /// Its points, measured in each round.
    points: Vec<Vector3>,
    /// Many more, measured at the end.
    dense: Vec<Sample>,
    diagonal: f64,
}

/// Shells in the making.
#[derive(Clone)]
struct Shells {
    mesh: TriangleMesh,
    normals: Vec<Vector3>,
    /// Points that may move along the target: those round shells that were too far off. The others keep what was fitted.
    active: Vec<bool>,
}

impl FittedShells {
    /// Fits shells to a surface. `progress` hears fractions from 0 to 1.
    pub fn new(target: &TriangleMesh, goal: ShellGoal, progress: &dyn Fn(f64)) -> Result<Self, MeshingError> {
        let start = match goal {
            ShellGoal::Error(error) => {
                require_positive("the error", error)?;
                START
            }
            ShellGoal::Shells(number) => {
                require_positive("the number of shells", number as f64)?;
                number.div_ceil(2)
            }
        };
        let mut mesh = target.clone();
        mesh.decimate(Fewer::Triangles(start))?;
        Ok(Self::refined(&Target::new(target), mesh, goal, progress))
    }

    /// Fits the shells of given triangles to a surface, without changing which points they join.
    pub fn on(target: &TriangleMesh, triangles: &TriangleMesh) -> Self {
        let target = Target::new(target);
        let mut shells = Shells::new(triangles.clone(), &target);
        for point in 0..shells.mesh.points.len() as u32 {
            shells.place(point, &target);
        }
        for _ in 0..12 {
            shells.fit(&target);
        }
        shells.finished(&target, 0, true)
    }

    fn refined(target: &Target, mesh: TriangleMesh, goal: ShellGoal, progress: &dyn Fn(f64)) -> Self {
        let mut shells = Shells::new(mesh, target);
        let mut best: Option<(f64, Shells)> = None;
        let (mut rounds, mut reached) = (0, false);
        while rounds < MOST_ROUNDS {
            rounds += 1;
            shells.even_out(target, if rounds == 1 { 10 } else { 4 });
            for _ in 0..4 {
                shells.fit(target);
            }
            let far = shells.distances(target);
            let count = shells.mesh.len();
            let worst = far.iter().copied().fold(0.0, f64::max);
            let ready = match goal {
                ShellGoal::Error(error) => worst <= AIM * error * target.diagonal,
                ShellGoal::Shells(number) => count + 1 >= number,
            };
            // Among those that are ready the closest counts; until then the last.
            if !ready || best.as_ref().is_none_or(|(least, _)| worst < *least) {
                best = Some((worst, shells.clone()));
            }
            reached = ready;
            let (bound, room) = match goal {
                _ if ready => break,
                ShellGoal::Error(error) => (AIM * error * target.diagonal, usize::MAX),
                ShellGoal::Shells(number) => (share(&far, count, worst), (number - count) / 2),
            };
            progress(match goal {
                ShellGoal::Error(error) => (error * target.diagonal / worst).min(1.0),
                ShellGoal::Shells(number) => count as f64 / number as f64,
            });
            if shells.refine(&far, bound, room, target) == 0 {
                break;
            }
        }
        let mut shells = best.map_or(shells, |(_, best)| best);
        shells.polish(target);
        let mut fitted = shells.finished(target, rounds, reached);
        if let ShellGoal::Error(error) = goal {
            // Both ways, which is more than what led the refinement.
            fitted.report.reached = fitted.report.distances.largest() <= error * target.diagonal;
        }
        fitted
    }
}

/// The distance above which shells are halved on the way to a number of them: six tenths of the worst, or so many that there are a
/// twentieth more.
fn share(far: &[f64], count: usize, worst: f64) -> f64 {
    let mut sorted = far.to_vec();
    sorted.sort_unstable_by(|a, b| b.total_cmp(a));
    sorted.get(count / 20).copied().unwrap_or(0.0).min(0.6 * worst)
}

impl Target {
    fn new(mesh: &TriangleMesh) -> Self {
        let reference = Reference::new(mesh);
        let diagonal = mesh.diagonal();
        Self { points: reference.points.clone(), dense: samples(mesh, diagonal / 300.0), reference, diagonal }
    }
}

impl Shells {
    fn new(mesh: TriangleMesh, target: &Target) -> Self {
        let (points, triangles) = mesh.compact();
        let normals = points.iter().map(|x| target.reference.closest(x).1).collect();
        Self { active: vec![true; points.len()], mesh: TriangleMesh::new(points, triangles), normals }
    }

    /// Puts a point on the target, or on its border, with the normal there.
    fn place(&mut self, point: u32, target: &Target) {
        let here = self.mesh.points[point as usize];
        let on_border = !self.mesh.marked(point).is_empty();
        let place = if on_border {
            target.reference.closest_on_lines(&here)
        } else {
            target.reference.closest(&here).0
        };
        self.mesh.points[point as usize] = place;
        let normal = target.reference.closest(&place).1;
        if normal != Vector3::zeros() {
            self.normals[point as usize] = normal;
        }
    }

    fn patch(&self, triangle: u32) -> CurvedTriangle {
        let nodes = self.mesh.triangles[triangle as usize];
        let [p, n] = [&self.mesh.points, &self.normals].map(|of| nodes.map(|node| of[node as usize]));
        CurvedTriangle::new(p, n, [false; 6], EdgeRule::Arc)
    }

    /// Flips edges and moves points along the target to better shapes.
    fn even_out(&mut self, target: &Target, times: usize) {
        for _ in 0..times {
            for [a, b] in self.mesh.edges() {
                let Some(new) = self.mesh.flipped(a, b) else { continue };
                let [Some(s), Some(t)] = self.mesh.sides(a, b) else { continue };
                let active = new.as_flattened().iter().all(|&n| self.active[n as usize]);
                if active && self.mesh.flip_is_sound([s, t], new, 1.1) {
                    self.mesh.flip(a, b, new);
                }
            }
            for point in (0..self.mesh.points.len() as u32)
                .filter(|&point| self.active[point as usize])
                .collect::<Vec<_>>()
            {
                self.move_along(point, target);
            }
        }
    }

    /// Moves a point towards evener triangles, as long as no triangle there gets a worse shape than the worst, and where shapes are
    /// poor to the best of some places around.
    fn move_along(&mut self, point: u32, target: &Target) {
        let Some(aim) = self.mesh.evener(point, &target.reference) else { return };
        let here = self.mesh.points[point as usize];
        let own = self.mesh.worst_round(point, &here);
        let line = !self.mesh.marked(point).is_empty();
        let project = |x: Vector3| {
            if line { target.reference.closest_on_lines(&x) } else { target.reference.closest(&x).0 }
        };
        let mut aims = vec![project(here + 0.4 * (aim - here)), aim];
        if own < GOOD_SHAPE {
            let around = self.mesh.neighbours(point);
            let lengths = around.iter().map(|&n| (self.mesh.points[n as usize] - here).norm());
            let size = 0.15 * lengths.fold(f64::INFINITY, f64::min);
            let normal = self.mesh.point_normal(point);
            let first =
                normal.cross(&(aim - here)).try_normalize(0.0).unwrap_or_else(|| normal.cross(&Vector3::x()));
            let second = normal.cross(&first);
            let around = |k: usize| (k as f64 * std::f64::consts::FRAC_PI_4).sin_cos();
            aims.extend((0..8).map(|k| project(here + size * (around(k).1 * first + around(k).0 * second))));
        }
        let best = aims
            .into_iter()
            .filter(|aim| self.keeps_its_side(point, aim))
            .map(|aim| (self.mesh.worst_round(point, &aim), aim))
            .max_by(|a, b| {
                a.0.min(GOOD_SHAPE).total_cmp(&b.0.min(GOOD_SHAPE)).then(std::cmp::Ordering::Greater)
            });
        if let Some((shape, aim)) = best
            && shape >= own.min(GOOD_SHAPE)
        {
            self.mesh.points[point as usize] = aim;
            self.place(point, target);
        }
    }

    fn keeps_its_side(&self, point: u32, aim: &Vector3) -> bool {
        self.mesh.star[point as usize].iter().all(|&t| {
            let nodes = self.mesh.triangles[t as usize];
            let x = self.mesh.corners(t);
            let new = cross([0, 1, 2].map(|k| if nodes[k] == point { *aim } else { x[k] }));
            new.dot(&cross(x)) > 0.3 * new.norm() * cross(x).norm()
        })
    }

    /// One step of Gauss–Newton; taken only as far as the sum of the fourth powers of the distances falls.
    fn fit(&mut self, target: &Target) {
        let rows = self.rows(target);
        let before: f64 = rows.iter().map(|row| row.off.powi(4)).sum();
        let (system, sizes) = self.system(&rows);
        let step = solve(&rows, &system, self.mesh.points.len());
        for part in [1.0, 0.5, 0.25] {
            let tried = self.stepped(&step, &sizes, part);
            if tried.rows(target).iter().map(|row| row.off.powi(4)).sum::<f64>() < before {
                *self = tried;
                return;
            }
        }
    }

    /// Signed distances at the places of all shells, with their derivatives with respect to the offset of each vertex along its normal
    /// and two turns of the normal, in lengths.
    fn rows(&self, target: &Target) -> Vec<Row> {
        let places = lattice(FIT);
        let sizes = self.sizes();
        let triangles: Vec<u32> = self.mesh.alive().collect();
        let of = |&t: &u32| {
            let (patch, nodes) = (self.patch(t), self.mesh.triangles[t as usize]);
            let frames = nodes.map(|n| frame(&self.normals[n as usize]));
            let row = |&place: &[f64; 3]| {
                let x = patch.point(place);
                let (foot, normal) = target.reference.closest(&x);
                let by = patch.derivatives(CurvedTriangle::weights(place));
                let mut slope = [0.0; 9];
                for corner in 0..3 {
                    let [by_place, by_normal] = by[corner].map(|by: Matrix3<f64>| by.tr_mul(&normal));
                    let [first, second, along] = frames[corner];
                    let size = sizes[nodes[corner] as usize];
                    slope[3 * corner] = by_place.dot(&along);
                    slope[3 * corner + 1] = by_normal.dot(&first) / size;
                    slope[3 * corner + 2] = by_normal.dot(&second) / size;
                }
                Row { nodes, slope, off: (x - foot).dot(&normal) }
            };
            places.iter().map(row).collect::<Vec<_>>()
        };
        triangles.par_iter().flat_map_iter(of).collect()
    }

    /// Mean length of the edges at each point [m].
    fn sizes(&self) -> Vec<f64> {
        let of = |(point, x): (u32, &Vector3)| {
            let around = self.mesh.neighbours(point);
            let sum: f64 = around.iter().map(|&n| (self.mesh.points[n as usize] - x).norm()).sum();
            sum / around.len().max(1) as f64
        };
        (0..).zip(&self.mesh.points).map(of).collect()
    }

    /// Weights of the rows, and the sizes that turn lengths into angles.
    fn system(&self, rows: &[Row]) -> (Vec<f64>, Vec<f64>) {
        let mean = rows.iter().map(|row| row.off * row.off).sum::<f64>() / rows.len().max(1) as f64;
        let weight = |row: &Row| (row.off * row.off / mean.max(f64::MIN_POSITIVE)).clamp(0.25, 25.0);
        (rows.iter().map(weight).collect(), self.sizes())
    }

    fn stepped(&self, step: &[[f64; 3]], sizes: &[f64], part: f64) -> Self {
        let mut next = self.clone();
        for (point, ([offset, first, second], size)) in step.iter().zip(sizes).enumerate() {
            let [u, v, n] = frame(&self.normals[point]);
            let turn = (u * *first + v * *second) * (part / size.max(f64::MIN_POSITIVE));
            let turn = turn * (LARGEST_TURN / turn.norm()).min(1.0);
            let turned = (n + turn).normalize();
            next.mesh.points[point] += n * (part * offset).clamp(-0.2 * size, 0.2 * size);
            let sound = self.mesh.star[point].iter().all(|&t| self.mesh.normal(t).dot(&turned) > 0.2);
            if sound {
                next.normals[point] = turned;
            }
        }
        next
    }

    /// The largest distance of each shell, by the number of its triangle, both ways.
    fn distances(&self, target: &Target) -> Vec<f64> {
        let mut far = vec![0.0; self.mesh.triangles.len()];
        let places = lattice(FACETS);
        let triangles: Vec<u32> = self.mesh.alive().collect();
        let forward: Vec<f64> = triangles
            .par_iter()
            .map(|&t| {
                let patch = self.patch(t);
                let off = |&w: &[f64; 3]| {
                    let x = patch.point(w);
                    (target.reference.closest(&x).0 - x).norm()
                };
                places.iter().map(off).fold(0.0, f64::max)
            })
            .collect();
        triangles.iter().zip(forward).for_each(|(&t, off)| far[t as usize] = off);
        let nearest = Nearest::new(self);
        let back: Vec<(u32, f64)> = target.points.par_iter().map(|point| nearest.distance(point)).collect();
        for (t, off) in back {
            far[t as usize] = off.max(far[t as usize]);
        }
        far
    }

    /// Halves the shells that are farther off than a bound at their longest edges, the worst first, up to a number. Returns how many.
    fn refine(&mut self, far: &[f64], bound: f64, room: usize, target: &Target) -> usize {
        let mut order: Vec<u32> = self.mesh.alive().filter(|&t| far[t as usize] > bound).collect();
        order.sort_by(|&a, &b| far[b as usize].total_cmp(&far[a as usize]));
        let mut touched = vec![false; far.len()];
        let mut halved = 0;
        let mut changed: Vec<u32> = order.iter().flat_map(|&t| self.mesh.triangles[t as usize]).collect();
        for t in order {
            if halved == room {
                break;
            }
            let nodes = self.mesh.triangles[t as usize];
            let length = |k: &usize| (self.mesh.corners(t)[*k] - self.mesh.corners(t)[(k + 1) % 3]).norm();
            let longest = [0, 1, 2].into_iter().max_by(|a, b| length(a).total_cmp(&length(b))).unwrap_or(0);
            let [a, b] = [nodes[longest], nodes[(longest + 1) % 3]];
            let sides = self.mesh.sides(a, b);
            if sides.iter().flatten().any(|&s| touched[s as usize]) {
                continue;
            }
            sides.iter().flatten().for_each(|&s| touched[s as usize] = true);
            let patch = self.patch(t);
            let mut place = [0.0; 3];
            (place[longest], place[(longest + 1) % 3]) = (0.5, 0.5);
            let fresh = self.mesh.split(a, b, patch.point(place));
            self.normals.push(patch.normal(place));
            touched.resize(self.mesh.triangles.len(), true);
            self.place(fresh, target);
            changed.push(fresh);
            halved += 1;
        }
        self.active = vec![false; self.mesh.points.len()];
        for point in changed {
            self.active[point as usize] = true;
            self.mesh.neighbours(point).iter().for_each(|&n| self.active[n as usize] = true);
        }
        halved
    }

    /// Fits on while the worst distance falls.
    fn polish(&mut self, target: &Target) {
        let worst = |shells: &Self| shells.distances(target).into_iter().fold(0.0, f64::max);
        let mut least = worst(self);
        let mut next = self.clone();
        for _ in 0..6 {
            for _ in 0..3 {
                next.fit(target);
            }
            let now = worst(&next);
            if now < least {
                (least, *self) = (now, next.clone());
            }
        }
    }

    fn finished(mut self, target: &Target, rounds: usize, reached: bool) -> FittedShells {
        let (points, triangles) = self.mesh.compact();
        self.normals = self
            .mesh
            .star
            .iter()
            .zip(&self.normals)
            .filter(|(s, _)| !s.is_empty())
            .map(|(_, n)| *n)
            .collect();
        self.mesh = TriangleMesh::new(points, triangles);
        let far = self.distances(target);
        let (error_map, forward) = self.picture(target);
        let nearest = Nearest::new(&self);
        let back: Vec<f64> =
            target.dense.par_iter().map(|sample| nearest.distance(&sample.point).1).collect();
        let shapes: Vec<f64> = self.mesh.alive().map(|t| shape(self.mesh.corners(t))).collect();
        let flat = {
            let locator = crate::hausdorff::locator(&self.mesh);
            let own = samples(&self.mesh, target.diagonal / 200.0);
            let off: Vec<f64> =
                own.par_iter().map(|s| (target.reference.closest(&s.point).0 - s.point).norm()).collect();
            let back: Vec<f64> =
                target.dense.par_iter().map(|s| crate::hausdorff::distance(&locator, &s.point)).collect();
            Hausdorff::of(spread(&own, &off), spread(&target.dense, &back))
        };
        let mut mesh = self.mesh.to_mesh();
        let normals = self.normals.iter().flat_map(|n| [n.x, n.y, n.z]).collect();
        mesh.point_data.insert("normal".into(), DataArray { components: 3, values: normals });
        mesh.block_mut(CellKind::Triangle).data.insert("distance".into(), DataArray::scalar(far));
        let report = ShellReport {
            shells: shapes.len(),
            nodes: self.mesh.points.len(),
            shape: [
                shapes.iter().copied().fold(f64::INFINITY, f64::min),
                shapes.iter().sum::<f64>() / shapes.len().max(1) as f64,
            ],
            distances: Hausdorff::of(forward, spread(&target.dense, &back)),
            flat,
            diagonal: target.diagonal,
            rounds,
            reached,
        };
        FittedShells { mesh, error_map, report }
    }

    /// The curved surface in small triangles with its distances, and the spread of these.
    fn picture(&self, target: &Target) -> (Mesh, (f64, f64)) {
        let (places, pieces) = (lattice(DENSE), pieces(DENSE));
        let triangles: Vec<u32> = self.mesh.alive().collect();
        let of = |&t: &u32| {
            let patch = self.patch(t);
            let area = self.mesh.area(t) / places.len() as f64;
            let place = |&w: &[f64; 3]| {
                let point = patch.point(w);
                (Sample { point, area }, (target.reference.closest(&point).0 - point).norm())
            };
            places.iter().map(place).collect::<Vec<_>>()
        };
        let all: Vec<(Sample, f64)> = triangles.par_iter().flat_map_iter(of).collect();
        let (samples, far): (Vec<Sample>, Vec<f64>) = all.into_iter().unzip();
        let mut mesh = Mesh { points: samples.iter().map(|s| s.point).collect(), ..Mesh::default() };
        let corners = (0..triangles.len()).flat_map(|t| {
            let places = places.len();
            pieces.iter().flatten().map(move |&k| (t * places) as u32 + k)
        });
        mesh.block_mut(CellKind::Triangle).nodes = corners.collect();
        let found = spread(&samples, &far);
        mesh.point_data.insert("distance".into(), DataArray::scalar(far));
        (mesh, found)
    }
}

/// The small triangles between the places of a lattice.
fn pieces(n: usize) -> Vec<[u32; 3]> {
    // Row i of the lattice has n − i + 1 places.
    let at = |i: usize, j: usize| ((i * (2 * n + 3 - i)) / 2 + j) as u32;
    let mut found = Vec::with_capacity(n * n);
    for i in 0..n {
        for j in 0..n - i {
            found.push([at(i, j), at(i + 1, j), at(i, j + 1)]);
            if j + 1 < n - i {
                found.push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
    found
}

/// One signed distance and its derivatives.
struct Row {
    nodes: [u32; 3],
    slope: [f64; 9],
    off: f64,
}

/// Two unit tangents and the normal itself.
fn frame(normal: &Vector3) -> [Vector3; 3] {
    let axis = if normal.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
    let first = normal.cross(&axis).try_normalize(0.0).unwrap_or_else(Vector3::y);
    [first, normal.cross(&first), *normal]
}

/// The least-squares step (Jᵀ W J + μ D) δ = −Jᵀ W r by conjugate gradients, with D the diagonal and μ = 0.01.
fn solve(rows: &[Row], weights: &[f64], points: usize) -> Vec<[f64; 3]> {
    const DAMPING: f64 = 0.01;
    const STEPS: usize = 80;
    let transposed = |values: &[f64]| {
        let mut sum = vec![0.0; 3 * points];
        for (row, value) in rows.iter().zip(values) {
            for (k, slope) in row.slope.iter().enumerate() {
                sum[3 * row.nodes[k / 3] as usize + k % 3] += slope * value;
            }
        }
        sum
    };
    let mut diagonal = vec![0.0; 3 * points];
    for (row, weight) in rows.iter().zip(weights) {
        for (k, slope) in row.slope.iter().enumerate() {
            diagonal[3 * row.nodes[k / 3] as usize + k % 3] += weight * slope * slope;
        }
    }
    let floor = 1e-6 * diagonal.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    diagonal.iter_mut().for_each(|d| *d = d.max(floor));
    let apply = |x: &[f64]| {
        let along = |(row, weight): (&Row, &f64)| {
            let sum: f64 =
                row.slope.iter().enumerate().map(|(k, s)| s * x[3 * row.nodes[k / 3] as usize + k % 3]).sum();
            weight * sum
        };
        let mut y = transposed(&rows.iter().zip(weights).map(along).collect::<Vec<_>>());
        y.iter_mut().zip(x).zip(&diagonal).for_each(|((y, x), d)| *y += DAMPING * d * x);
        y
    };
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let scaled = |r: &[f64]| r.iter().zip(&diagonal).map(|(r, d)| r / d).collect::<Vec<_>>();
    let mut x = vec![0.0; 3 * points];
    let mut r = transposed(&rows.iter().zip(weights).map(|(row, w)| -w * row.off).collect::<Vec<_>>());
    let mut z = scaled(&r);
    let mut p = z.clone();
    let mut rz = dot(&r, &z);
    let first = rz;
    for _ in 0..STEPS {
        if rz <= 1e-12 * first {
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
    x.chunks_exact(3).map(|x| [x[0], x[1], x[2]]).collect()
}

/// Finds the nearest place of all shells, from small flat triangles on.
struct Nearest {
    patches: Vec<CurvedTriangle>,
    triangles: Vec<u32>,
    locator: SurfaceLocator,
    places: Vec<[f64; 3]>,
}

impl Nearest {
    fn new(shells: &Shells) -> Self {
        let (places, pieces) = (lattice(FACETS), pieces(FACETS));
        let triangles: Vec<u32> = shells.mesh.alive().collect();
        let patches: Vec<CurvedTriangle> = triangles.iter().map(|&t| shells.patch(t)).collect();
        let mut mesh = Mesh {
            points: patches.iter().flat_map(|patch| places.iter().map(|&w| patch.point(w))).collect(),
            ..Mesh::default()
        };
        let count = places.len();
        mesh.block_mut(CellKind::Triangle).nodes = (0..patches.len())
            .flat_map(|t| pieces.iter().flatten().map(move |&k| (t * count) as u32 + k))
            .collect();
        let surface: Surface = boundary(&mesh);
        let faces: Vec<u32> = (0..surface.faces.len() as u32).collect();
        Self { patches, triangles, locator: SurfaceLocator::new(&surface, &faces, &mesh.points), places }
    }

    /// The number of the nearest shell's triangle, and the distance to it [m].
    fn distance(&self, point: &Vector3) -> (u32, f64) {
        let Some(at) = self.locator.closest(point) else { return (0, f64::INFINITY) };
        let count = self.places.len();
        let shell = at.nodes[0] as usize / count;
        let corners = at.nodes.map(|node| self.places[node as usize % count]);
        let start = [0, 1, 2].map(|k| (0..3).map(|c| at.weights[c] * corners[c][k]).sum());
        (self.triangles[shell], self.patches[shell].closest(point, start).1)
    }
}
