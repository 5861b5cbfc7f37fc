//! A fine surface by few curved shells: cubic Bézier triangles ([`CurvedTriangle`]) whose vertices and normals are fitted to it.
//! A decimated surface starts; then, round by round, triangles are evened out on the surface, vertices (along their normals) and normals
//! are fitted by Gauss–Newton to the signed distances at 21 places of each shell, the distances of both ways are measured, and the
//! shells that are too far off are halved at their longest edges. Large distances weigh more, so that the worst ones fall.
//! Leaves out: creases, as a vertex has one normal; edges that bend more than their end normals tell.

mod fit;
mod measure;
mod refine;

use std::fmt;

use pliant_geometry::{CurvedTriangle, EdgeRule, Mesh, Vector3};
use serde::Serialize;

use crate::decimate::Fewer;
use crate::error::{MeshingError, require_positive};
use crate::hausdorff::{Hausdorff, Sample, samples};
use crate::remesh::Reference;
use crate::triangles::TriangleMesh;
use measure::Distances;

/// Shells to start from where an error is asked for.
const START: usize = 250;

/// Rounds of refinement at most.
const MOST_ROUNDS: usize = 40;

/// No move leaves a triangle of a worse shape, unless it was worse before.
const LEAST_SHAPE: f64 = 0.62;

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
    /// Points of it, measured in each round.
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
    /// Points that may move: those near what has changed. The others keep what was fitted.
    active: Vec<bool>,
    /// Points of borders, which stay there.
    on_border: Vec<bool>,
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
        let start = shells.distances(&target, &target.points);
        shells.settle(start, 0.0, 12, &target);
        shells.finished(&target, 0, true)
    }

    fn refined(target: &Target, mesh: TriangleMesh, goal: ShellGoal, progress: &dyn Fn(f64)) -> Self {
        let mut shells = Shells::new(mesh, target);
        let aim = match goal {
            ShellGoal::Error(error) => error * target.diagonal,
            ShellGoal::Shells(_) => 0.0,
        };
        shells.even_out(target, 10);
        let mut now = shells.distances(target, &target.points);
        let (mut rounds, mut reached) = (0, false);
        while rounds < MOST_ROUNDS {
            rounds += 1;
            let t1 = std::time::Instant::now();
            now = shells.settle(now, aim, 4, target);
            let (far, count) = (now.far(), shells.mesh.len());
            let worst = far.iter().copied().fold(0.0, f64::max);
            if std::env::var("DBG").is_ok() {
                let mut f: Vec<f64> = far.clone(); f.sort_by(|a, b| b.total_cmp(a));
                println!("round {rounds}: {count} shells, worst {:.3}% 5th {:.3} 20th {:.3}, over {} active {} settle {:?} points {}", 100.0*worst/target.diagonal, 100.0*f[4]/target.diagonal, 100.0*f[19]/target.diagonal, f.iter().filter(|x| **x > aim).count(), shells.active.iter().filter(|a| **a).count(), t1.elapsed(), now.landings.len());
            }
            reached = match goal {
                ShellGoal::Error(_) => worst <= aim,
                ShellGoal::Shells(number) => count + 1 >= number,
            };
            if reached {
                break;
            }
            let (bound, room) = match goal {
                ShellGoal::Error(_) => (aim, usize::MAX),
                ShellGoal::Shells(number) => (share(&far, count), (number - count) / 2),
            };
            progress(match goal {
                ShellGoal::Error(_) => (aim / worst).min(1.0),
                ShellGoal::Shells(number) => count as f64 / number as f64,
            });
            if shells.refine(&far, bound, room, target) == 0 {
                break;
            }
            shells.even_out(target, 3);
            now = shells.distances_after(&now, target);
        }
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
fn share(far: &[f64], count: usize) -> f64 {
    let mut sorted = far.to_vec();
    sorted.sort_unstable_by(|a, b| b.total_cmp(a));
    sorted[count / 20].min(0.6 * sorted[0])
}

impl Target {
    fn new(mesh: &TriangleMesh) -> Self {
        let reference = Reference::new(mesh);
        let diagonal = mesh.diagonal();
        let points = spaced(mesh, diagonal / 60.0);
        Self { points, dense: samples(mesh, diagonal / 300.0), reference, diagonal }
    }
}

/// Points of a surface no farther apart than `spacing` [m], each once.
fn spaced(mesh: &TriangleMesh, spacing: f64) -> Vec<Vector3> {
    let mut points: Vec<[f64; 3]> = samples(mesh, spacing).iter().map(|s| s.point.into()).collect();
    points.sort_unstable_by(|a, b| a.iter().zip(b).map(|(a, b)| a.total_cmp(b)).find(|o| o.is_ne()).unwrap_or(std::cmp::Ordering::Equal));
    points.dedup();
    points.into_iter().map(Vector3::from).collect()
}

impl Shells {
    fn new(mesh: TriangleMesh, target: &Target) -> Self {
        let (points, triangles) = mesh.compact();
        let normals = points.iter().map(|x| target.reference.closest(x).1).collect();
        let mut shells = Self { active: vec![true; points.len()], on_border: vec![], mesh: TriangleMesh::new(points, triangles), normals };
        shells.find_border();
        shells
    }

    fn find_border(&mut self) {
        self.on_border = (0..self.mesh.points.len() as u32).map(|n| !self.mesh.marked(n).is_empty()).collect();
    }

    fn patch(&self, triangle: u32) -> CurvedTriangle {
        let nodes = self.mesh.triangles[triangle as usize];
        let [p, n] = [&self.mesh.points, &self.normals].map(|of| nodes.map(|node| of[node as usize]));
        CurvedTriangle::new(p, n, [false; 6], EdgeRule::Arc)
    }

    /// Whether a corner of a shell may move.
    fn moves(&self, shell: u32) -> bool {
        self.mesh.triangles[shell as usize].iter().any(|&n| self.active[n as usize])
    }

    /// Fits until all distances are within `aim` [m], or they fall no more.
    fn settle(&mut self, mut now: Distances, aim: f64, times: usize, target: &Target) -> Distances {
        for _ in 0..times {
            let far = now.far();
            if far.iter().all(|&off| off <= aim) {
                break;
            }
            let scale = if aim > 0.0 { aim } else { share(&far, self.mesh.len()) };
            let mut next = self.clone();
            for _ in 0..2 {
                next.fit(target, &now.landings, scale);
            }
            let then = next.distances_after(&now, target);
            let sum = |far: &[f64]| far.iter().map(|off| (off / scale).powi(8)).sum::<f64>();
            if sum(&then.far()) > 0.98 * sum(&far) {
                break;
            }
            (*self, now) = (next, then);
        }
        now
    }
}
