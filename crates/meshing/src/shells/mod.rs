//! A fine surface by few curved shells: cubic Bézier triangles ([`CurvedTriangle`]) whose vertices and normals are fitted to it.
//! A decimated surface starts; then, round by round, the shells that are too far off, either way, are halved at their longest edges, and
//! round them triangles are evened out and fitted again, while the others rest. What is reached is looked at more closely before it counts.
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
const START: usize = 100;

/// Rounds after the goal is reached, where distances can fall or triangles are poor.
const LAST_ROUNDS: usize = 4;

/// Rounds of refinement at most.
const MOST_ROUNDS: usize = 40;

/// No step of the fit leaves a triangle of a worse shape, unless it was worse before.
const LEAST_SHAPE: f64 = 0.65;

/// Among the last rounds those without a triangle worse than this come first.
const POOR: f64 = 0.6;

/// Part of the way to the goal after which distances are looked at closely.
const CLOSELY: f64 = 0.9;

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
    /// Looked at in each round.
    coarse: Detail,
    /// Looked at when all seems well.
    fine: Detail,
    diagonal: f64,
}

/// How closely distances are looked at.
struct Detail {
    /// Points of the target.
    samples: Vec<Sample>,
    /// Parts of an edge between places of the shells.
    parts: usize,
}

/// Shells in the making.
#[derive(Clone)]
struct Shells {
    mesh: TriangleMesh,
    normals: Vec<Vector3>,
    /// Points of borders, which stay there.
    on_border: Vec<bool>,
    /// Points that may move: those near what has changed. The others keep what was fitted.
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
        Ok(Self::refined(&Target::new(target), &mesh, goal, progress))
    }

    /// Fits the shells of given triangles to a surface, without changing which points they join.
    pub fn on(target: &TriangleMesh, triangles: &TriangleMesh) -> Self {
        let target = Target::new(target);
        let mut shells = Shells::new(triangles, &target);
        for point in 0..shells.mesh.points.len() as u32 {
            shells.place(point, &target);
        }
        let start = shells.distances(&target.fine, &target);
        shells.settle(start, 0.0, 12, &target);
        shells.finished(&target, 0, ShellGoal::Shells(triangles.len()))
    }

    fn refined(target: &Target, mesh: &TriangleMesh, goal: ShellGoal, progress: &dyn Fn(f64)) -> Self {
        let aim = match goal {
            ShellGoal::Error(error) => error * target.diagonal,
            ShellGoal::Shells(_) => 0.0,
        };
        let mut shells = Shells::new(mesh, target);
        shells.even_out(target, 10);
        let mut now = shells.distances(&target.coarse, target);
        let (mut rounds, mut closely, mut left) = (0, false, LAST_ROUNDS);
        let mut best: Option<(bool, f64, Shells)> = None;
        while rounds < MOST_ROUNDS {
            rounds += 1;
            now = shells.settle(now, aim, 4, target);
            let (far, count) = (now.far(), shells.mesh.len());
            let worst = far.iter().copied().fold(0.0, f64::max);
            let (part, bound, room) = match goal {
                ShellGoal::Error(_) => (aim / worst, aim, usize::MAX),
                ShellGoal::Shells(number) => {
                    ((count + 1) as f64 / number as f64, share(&far), number.saturating_sub(count) / 2)
                }
            };
            progress(part.min(1.0));
            if !closely && part >= CLOSELY {
                closely = true;
                now = shells.distances(&target.fine, target);
                shells.activate(shells.corners_of(&now.far(), bound));
                continue;
            }
            if part >= 1.0 {
                let poor = shells.worth_of_all().into_iter().any(|worth| worth < POOR);
                if best.as_ref().is_none_or(|(was_poor, least, _)| (poor, worst) < (*was_poor, *least)) {
                    best = Some((poor, worst, shells.clone()));
                }
                if left == 0 || worst <= aim && !poor {
                    break;
                }
                left -= 1;
            }
            shells.refine(&far, bound, room, target);
            shells.even_out(target, 3);
            now = shells.distances_after(&now, target);
        }
        best.map_or(shells, |(.., best)| best).finished(target, rounds, goal)
    }
}

/// The distance above which shells are halved on the way to a number of them: six tenths of the worst, or so many that there are a
/// twentieth more.
fn share(far: &[f64]) -> f64 {
    let mut sorted = far.to_vec();
    sorted.sort_unstable_by(|a, b| b.total_cmp(a));
    sorted[far.len() / 20].min(0.6 * sorted[0])
}

impl Target {
    fn new(mesh: &TriangleMesh) -> Self {
        let diagonal = mesh.diagonal();
        Self {
            reference: Reference::new(mesh),
            coarse: Detail { samples: distinct(samples(mesh, diagonal / 60.0)), parts: 8 },
            fine: Detail { samples: distinct(samples(mesh, diagonal / 300.0)), parts: 16 },
            diagonal,
        }
    }
}

/// Samples at the same place made one.
fn distinct(mut samples: Vec<Sample>) -> Vec<Sample> {
    let place = |sample: &Sample| <[f64; 3]>::from(sample.point).map(f64::to_bits);
    samples.sort_by_key(place);
    samples.dedup_by(|next, kept| {
        let same = place(next) == place(kept);
        kept.area += if same { next.area } else { 0.0 };
        same
    });
    samples
}

impl Shells {
    fn new(mesh: &TriangleMesh, target: &Target) -> Self {
        let (points, triangles) = mesh.compact();
        let mesh = TriangleMesh::new(points, triangles);
        Self {
            normals: mesh.points.iter().map(|x| target.reference.closest(x).1).collect(),
            on_border: (0..mesh.points.len() as u32).map(|n| !mesh.marked(n).is_empty()).collect(),
            active: vec![true; mesh.points.len()],
            mesh,
        }
    }

    /// Corners of the shells that are farther off than a bound.
    fn corners_of(&self, far: &[f64], bound: f64) -> Vec<u32> {
        let off = self.mesh.alive().filter(|&t| far[t as usize] > bound);
        off.flat_map(|t| self.mesh.triangles[t as usize]).collect()
    }

    /// Lets points and their neighbours move, and no others.
    fn activate(&mut self, points: Vec<u32>) {
        self.active = vec![false; self.mesh.points.len()];
        for point in points {
            self.active[point as usize] = true;
            self.mesh.neighbours(point).iter().for_each(|&n| self.active[n as usize] = true);
        }
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
            let scale = if aim > 0.0 { aim } else { share(&far) };
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
