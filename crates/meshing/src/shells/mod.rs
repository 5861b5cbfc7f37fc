//! A fine surface by few curved shells: cubic Bézier triangles ([`CurvedTriangle`]) whose vertices and
//! normals are fitted to it. The fit starts from a decimated surface. Round by round, shells that are too far
//! off, either way, are halved at their longest edges. The triangles round them are evened out and fitted
//! again, while the others rest. Before a goal counts as reached, it is measured more closely. Normals stand
//! within 60° of their triangles and shells do not pass through each other: where they would, they are
//! halved, too. A requested number of shells comes nearer by exchange (`exchange`): some collapse where the
//! surface is flat, and others are halved elsewhere. Crossings at the end are repaired (`repair`), and shells
//! that still cross become flat (`flatten`). Where a fit fails, it starts again from finer triangles. Where
//! even flat triangles cross, it starts from some that never did (`start`). The work is bounded, by a count
//! that is the same on every machine; the closest shells by then are the result. Sharp edges of the surface
//! stay (`sharp`). Where flat triangles are nearer than curved ones, they are flat. Leaves out: edges that
//! bend more than their end normals show.

mod crossing;
mod effort;
mod exchange;
mod fit;
mod flatten;
mod measure;
mod part;
mod refine;
mod repair;
mod report;
mod sharp;
mod solve;
mod start;
mod target;
#[cfg(test)]
mod tests;
mod upright;

use pliant_geometry::{CurvedTriangle, EdgeRule, Mesh, Vector3};

use crate::error::{MeshingError, require_positive};
use crate::surface::triangles::TriangleMesh;
use effort::Effort;
use measure::Distances;
pub use report::{Flaw, ShellReport};
use start::{Starts, UNCROSSED};
use target::Target;

/// Rounds after the requested error is reached, if distances can fall or triangles are poor.
const LAST_ROUNDS: usize = 4;

/// Most rounds of refinement.
const MOST_ROUNDS: usize = 40;

/// No step of the fit leaves a triangle of a worse shape, unless it was worse before.
const LEAST_SHAPE: f64 = 0.65;

/// Among the last rounds, those without a triangle of a worse shape come first.
const POOR: f64 = 0.6;

/// Part of the way to the goal after which distances are measured closely.
const CLOSELY: f64 = 0.9;

/// Part of the way to the goal after which normals stand on their triangles.
const UPRIGHT_FROM: f64 = 0.7;

/// Part of the work allowed after which normals stand on their triangles, even if the goal is farther.
const UPRIGHT_AFTER: f64 = 0.6;

/// Additional rounds in which shells that cross or have a crease are mended.
const MENDING_ROUNDS: usize = 4;

/// Shells with creases or crossings are halved down to edges of this part of the diagonal, or of the
/// requested error.
const LEAST_EDGE: f64 = 1e-3;

/// Limits after which a fit is given up if there are finer triangles to start from. It has used more than
/// this part of the work allowed and has not come [`UPRIGHT_FROM`] of the way. Nor has it come nearer by this
/// factor in this many rounds.
const GIVEN_UP: f64 = 0.5;
const NEARER: f64 = 1.05;
const STUCK: usize = 3;

/// Least part of the work allowed that a second fit has.
const AGAIN: f64 = 0.5;

/// Least shape of shells that keep sharp edges. If one is slimmer, shells without sharp edges are fitted,
/// too. They are the result unless their distance is larger by more than the factor below. Rims of images
/// have more corners than few shells can follow.
const SLIM: f64 = 0.3;
const MUCH: f64 = 2.0;

/// Least part of the work allowed that is left for the exchange of shells.
const EXCHANGE: f64 = 0.25;

/// Number of shells that are fitted once a round; fewer are fitted up to four times.
const MANY: usize = 3000;

/// Condition that ends a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ShellGoal {
    /// Largest distance, both ways, as a part of the diagonal of the target's box.
    Error(f64),
    /// Number of shells, or one fewer, as close as the work allowed makes them.
    Shells(usize),
}

/// Curved shells fitted to a surface.
#[derive(Clone, Debug)]
pub struct FittedShells {
    /// Triangles with their data. Point data `normal` holds the unit normals of the nodes, cell data
    /// `distance` the largest distance of each shell [m], both ways. Where some shells are as flat as their
    /// triangles, cell data `flat` is 1 there and 0 elsewhere.
    pub mesh: Mesh,
    /// The curved surface in small flat triangles, with its distance from the target as point data `distance`
    /// [m].
    pub error_map: Mesh,
    /// The measurements.
    pub report: ShellReport,
}

/// Shells during a fit.
#[derive(Clone)]
struct Shells {
    mesh: TriangleMesh,
    normals: Vec<Vector3>,
    /// Points of borders, which stay there.
    on_border: Vec<bool>,
    /// Points that may move: those near changes. The others keep their fit.
    active: Vec<bool>,
    /// True if normals must stand on their triangles. On the way to the goal, while triangles are large, they
    /// need not: points that are held back then do not find their places.
    strict: bool,
    /// Points where no normal stands on all triangles, and points of sharp edges.
    creased: Vec<bool>,
    /// Points of sharp edges of the target, which stay there.
    sharp: Vec<bool>,
    /// True for each shell that is as flat as its triangle, by the numbers of the triangles; empty without
    /// flat shells.
    flat: Vec<bool>,
}

/// Progress of a fit.
#[derive(Clone, Copy, Debug)]
pub struct FitProgress {
    /// Fraction from 0 to 1 of the way to the goal or of the work allowed, whichever is more.
    pub part: f64,
    /// Round of refinement.
    pub round: usize,
    /// Shells so far.
    pub shells: usize,
    /// Largest distance of the shells as a part of the diagonal.
    pub off: f64,
}

impl FittedShells {
    /// Fits shells to a surface. `progress` hears the progress.
    pub fn new(
        target: &TriangleMesh,
        goal: ShellGoal,
        progress: &dyn Fn(FitProgress),
    ) -> Result<Self, MeshingError> {
        let most = match goal {
            ShellGoal::Error(error) => {
                require_positive("the error", error)?;
                Effort::MOST
            }
            ShellGoal::Shells(number) => {
                require_positive("the number of shells", number as f64)?;
                Effort::MOST_TO_A_NUMBER
            }
        };
        Ok(Self::within(target, goal, Effort::new(most), UNCROSSED, progress))
    }

    /// Fits shells with a limit on the work of each of two attempts. In the first attempt, collapses may make
    /// triangles cross while there are more than `uncrossed`.
    fn within(
        surface: &TriangleMesh,
        goal: ShellGoal,
        effort: Effort,
        uncrossed: usize,
        progress: &dyn Fn(FitProgress),
    ) -> Self {
        let fit = |surface: &TriangleMesh| Self::of_lines(surface, goal, effort, uncrossed, progress);
        let Some(sharp) = sharp::with_sharp_edges(surface, goal).map(|marked| fit(&marked)) else {
            return fit(surface).fitted;
        };
        let report = &sharp.fitted.report;
        let (is_slim, off) = (report.shape[0] < SLIM, report.distances.largest());
        if !report.fails() && !is_slim {
            return sharp.fitted;
        }
        let smooth = fit(surface);
        let is_near = smooth.fitted.report.distances.largest() <= MUCH * off;
        match is_slim && !smooth.fitted.report.fails() && is_near {
            true => smooth.fitted,
            false => sharp.better(smooth).fitted,
        }
    }

    /// Fits shells to a surface whose creases are marked.
    fn of_lines(
        surface: &TriangleMesh,
        goal: ShellGoal,
        effort: Effort,
        uncrossed: usize,
        progress: &dyn Fn(FitProgress),
    ) -> Found {
        let target = Target::new(surface);
        let job = Job { target: &target, goal, progress };
        let attempt = |uncrossed: usize| {
            job.flattened(job.attempt(&Starts::new(surface, goal, &target, uncrossed), effort))
        };
        let first = attempt(uncrossed);
        if first.fitted.report.crossings.count == 0 || surface.len() <= uncrossed {
            return first;
        }
        first.better(attempt(usize::MAX))
    }

    /// Fits the shells of given triangles to a surface. The triangles keep their points.
    pub fn on(target: &TriangleMesh, triangles: &TriangleMesh) -> Self {
        let target = Target::new(target);
        let mut shells = Shells::new(triangles, &target);
        for point in 0..shells.mesh.points.len() as u32 {
            shells.place(point, &target);
        }
        shells.require_upright();
        let start = shells.distances(&target.fine, &target);
        shells.settle(start, 0.0, 12, &target, &mut Effort::new(usize::MAX));
        shells.finished(&target, 0, ShellGoal::Shells(triangles.len()), false)
    }
}

/// Shells that were found, and their report.
struct Found {
    shells: Shells,
    fitted: FittedShells,
}

impl Found {
    /// Returns the result that crosses less, reaches its goal, or is closer.
    fn better(self, other: Self) -> Self {
        if other.fitted.report.rank() < self.fitted.report.rank() { other } else { self }
    }
}

/// Target and goal of a fit, and the listener to its progress.
#[derive(Clone, Copy)]
struct Job<'t> {
    target: &'t Target,
    goal: ShellGoal,
    progress: &'t dyn Fn(FitProgress),
}

impl Job<'_> {
    /// Fits from few triangles. If that fails, it fits from finer ones. If shells still cross, it takes the
    /// shells that the fit started from.
    fn attempt(&self, starts: &Starts, effort: Effort) -> Found {
        let fit = |mesh, effort, is_last| Fit::new(self.target, mesh, self.goal, effort, is_last);
        if starts.is_lost {
            return fit(&starts.first, effort, true).unfitted();
        }
        let (mut found, effort) = fit(&starts.first, effort, starts.finer.is_none()).run(self.progress);
        let last = starts.finer.as_ref().unwrap_or(&starts.first);
        if found.fitted.report.fails() && starts.finer.is_some() {
            found = found.better(fit(last, effort.with_left(AGAIN), true).run(self.progress).0);
        }
        if found.fitted.report.crossings.count > 0 {
            found = found.better(fit(last, effort, true).unfitted());
        }
        found
    }

    /// Makes shells flat where they cross. If the fit fails, or the flat triangles are nearer as a whole,
    /// shells become flat where that is nearer, too.
    fn flattened(&self, found: Found) -> Found {
        let FittedShells { report, .. } = &found.fitted;
        let is_nearer = !report.reached || report.flat.largest() < report.distances.largest();
        let found = if is_nearer { self.flat_where_nearer(found) } else { found };
        let FittedShells { report, .. } = &found.fitted;
        if report.crossings.count == 0 {
            return found;
        }
        let mut shells = found.shells.clone();
        shells.flatten();
        let fitted = shells.finished(self.target, report.rounds, self.goal, report.stopped);
        found.better(Found { shells, fitted })
    }
}

impl Job<'_> {
    /// Flattens shells that are farther off than the requested error, or than most, where that is nearer.
    fn flat_where_nearer(&self, found: Found) -> Found {
        let mut shells = found.shells.clone();
        let report = &found.fitted.report;
        if !shells.flatten_nearer(self.target, |far| match self.goal {
            ShellGoal::Error(error) => error * self.target.diagonal,
            ShellGoal::Shells(_) => share(far),
        }) {
            return found;
        }
        let fitted = shells.finished(self.target, report.rounds, self.goal, report.stopped);
        found.better(Found { shells, fitted })
    }
}

/// State of a fit.
struct Fit<'t> {
    target: &'t Target,
    goal: ShellGoal,
    /// The requested distance [m]; 0 if a number of shells is requested.
    aim: f64,
    shells: Shells,
    rounds: usize,
    effort: Effort,
    /// True if distances are measured closely.
    closely: bool,
    best: Option<(Rank, Shells)>,
    /// The largest part of the goal so far, and the round that reached it.
    nearest: (f64, usize),
    /// Rounds that are left once the goal is reached, and rounds that are left for mending.
    left: usize,
    mending: usize,
    /// True if nothing else is tried after a failure.
    is_last: bool,
}

/// Reason for the end of a fit.
#[derive(Clone, Copy, PartialEq, Eq)]
enum End {
    /// More rounds do not help.
    Done,
    /// The fit comes no nearer, and another one can.
    GivenUp,
    /// No rounds are left, or no work allowed is left.
    Spent,
}

/// Rank of shells; the least is best. True if the goal is missed, number of shells that cross or have
/// creases, true if triangles are poor, and the quantity to minimise.
type Rank = (bool, usize, bool, f64);

impl<'t> Fit<'t> {
    fn new(target: &'t Target, mesh: &TriangleMesh, goal: ShellGoal, effort: Effort, is_last: bool) -> Self {
        let aim = match goal {
            ShellGoal::Error(error) => error * target.diagonal,
            ShellGoal::Shells(_) => 0.0,
        };
        let mut shells = Shells::new(mesh, target);
        shells.place_border(target);
        Self {
            target,
            goal,
            aim,
            shells,
            rounds: 0,
            effort,
            closely: false,
            best: None,
            nearest: (0.0, 0),
            left: LAST_ROUNDS,
            mending: MENDING_ROUNDS,
            is_last,
        }
    }

    /// The shells of the initial triangles, which do not cross, with the normals of the target.
    fn unfitted(mut self) -> Found {
        self.shells.require_upright();
        self.shells.uncross(&mut self.effort);
        self.shells.crease_crossing();
        let fitted = self.shells.finished(self.target, 0, self.goal, false);
        Found { shells: self.shells, fitted }
    }

    /// Fits as long as that helps. Returns the shells, and the work done so far.
    fn run(mut self, progress: &dyn Fn(FitProgress)) -> (Found, Effort) {
        let target = self.target;
        self.shells.even_out(target, 10, &mut self.effort);
        let mut now = self.shells.distances(&target.coarse, target);
        while self.rounds < MOST_ROUNDS && !self.effort.is_spent() {
            self.rounds += 1;
            let times = if self.shells.moving() > MANY { 1 } else { 4 };
            now = self.shells.settle(now, self.aim, times, target, &mut self.effort);
            let far = now.far();
            let (part, bound, room) = self.bounds(&far);
            progress(self.progress(&far, part));
            if self.is_stuck(part) {
                return self.end(End::GivenUp, progress);
            }
            if let Some(anew) = self.measured_anew(part, bound) {
                now = anew;
                continue;
            }
            let Some(flawed) = self.flawed(&far, part) else { return self.end(End::Done, progress) };
            let mut wanted = far;
            for shell in flawed {
                wanted[shell as usize] = 2.0 * wanted[shell as usize].max(bound);
            }
            for shell in self.shells.mesh.alive().filter(|&shell| !self.is_long(shell)) {
                wanted[shell as usize] = 0.0;
            }
            if self.shells.refine(&wanted, bound, room, target) == 0 && part < 1.0 {
                return self.end(End::Done, progress);
            }
            self.shells.even_out(target, 3, &mut self.effort);
            if self.shells.strict {
                self.shells.uncross(&mut self.effort);
            }
            now = self.shells.distances_after(&now, target, &mut self.effort);
        }
        self.end(End::Spent, progress)
    }

    /// True if the fit is to be given up because it comes no nearer. Records the part of the goal that is
    /// reached.
    fn is_stuck(&mut self, part: f64) -> bool {
        if part > NEARER * self.nearest.0 {
            self.nearest = (part, self.rounds);
        }
        let (nearest, nearest_in) = self.nearest;
        let stays = nearest < UPRIGHT_FROM && self.rounds >= nearest_in + STUCK;
        !self.is_last && stays && self.effort.part() > GIVEN_UP
    }

    /// Makes normals stand on their triangles, or measures distances closely, once the fit is far enough.
    /// Returns the new distances.
    fn measured_anew(&mut self, part: f64, bound: f64) -> Option<Distances> {
        let target = self.target;
        let detail = if !self.shells.strict && (part >= UPRIGHT_FROM || self.effort.part() >= UPRIGHT_AFTER) {
            // Earlier shells may cross.
            self.best = None;
            self.shells.require_upright();
            self.shells.uncross(&mut self.effort);
            &target.coarse
        } else if !self.closely && part >= CLOSELY {
            self.closely = true;
            &target.fine
        } else {
            return None;
        };
        let now = self.shells.distances(detail, target);
        self.effort.search(detail.samples.len(), effort::LANDING);
        self.shells.activate(self.shells.corners_of(&now.far(), bound));
        Some(now)
    }

    /// Keeps the shells if they are the best so far. Returns the shells to be halved because of a flaw;
    /// `None` if no further round helps.
    fn flawed(&mut self, far: &[f64], part: f64) -> Option<Vec<u32>> {
        let [creased, crossing] = if self.shells.strict { self.flaws() } else { Default::default() };
        let rank = self.rank(far, part, creased.len() + crossing.len());
        // Halving shells with a crease helps where a fold is wide enough for smaller shells, and not where it
        // is sharp.
        let fewer = self.best.as_ref().is_none_or(|(best, _)| best.0 || rank.1 < best.1);
        let mut flawed = crossing;
        flawed.extend(creased.into_iter().filter(|_| fewer && part >= 1.0));
        if self.best.as_ref().is_none_or(|(best, _)| rank < *best) {
            self.best = Some((rank, self.shells.clone()));
        }
        if part < 1.0 {
            return Some(flawed);
        }
        let mends = !flawed.is_empty() && self.mending > 0;
        // A requested number of shells comes nearer by exchange.
        let is_near = match self.goal {
            ShellGoal::Error(_) => !rank.2 && rank.3 <= self.aim,
            ShellGoal::Shells(_) => true,
        };
        if !mends && (self.left == 0 || is_near) {
            return None;
        }
        flawed.retain(|_| mends);
        *(if mends { &mut self.mending } else { &mut self.left }) -= 1;
        Some(flawed)
    }

    /// Returns the best shells so far, exchanged and repaired unless the fit is given up, and the work done.
    fn end(mut self, end: End, progress: &dyn Fn(FitProgress)) -> (Found, Effort) {
        let target = self.target;
        let mut shells = self.best.map_or(self.shells, |(_, best)| best);
        shells.require_upright();
        shells.activate((0..shells.mesh.points.len() as u32).collect());
        shells.uncross(&mut self.effort);
        if end != End::GivenUp {
            if let ShellGoal::Shells(number) = self.goal {
                self.effort = self.effort.with_left(EXCHANGE);
                let (rounds, diagonal) = (self.rounds, target.diagonal);
                shells.exchange(number, target, &mut self.effort, |off| {
                    progress(FitProgress { part: 1.0, round: rounds, shells: number, off: off / diagonal });
                });
            }
            shells.repair(target);
            shells.crease_crossing();
        }
        let fitted = shells.finished(target, self.rounds, self.goal, end != End::Done);
        (Found { shells, fitted }, self.effort)
    }

    /// Part of the goal that is reached, distance above which shells are halved [m], and number of shells
    /// that may be halved.
    fn bounds(&self, far: &[f64]) -> (f64, f64, usize) {
        let count = self.shells.mesh.len();
        match self.goal {
            ShellGoal::Error(_) => (self.aim / worst(far), self.aim, usize::MAX),
            ShellGoal::Shells(number) => {
                ((count + 1) as f64 / number as f64, share(far), number.saturating_sub(count) / 2)
            }
        }
    }

    fn progress(&self, far: &[f64], part: f64) -> FitProgress {
        FitProgress {
            part: part.max(self.effort.part()).min(1.0),
            round: self.rounds,
            shells: self.shells.mesh.len(),
            off: worst(far) / self.target.diagonal,
        }
    }

    fn rank(&self, far: &[f64], part: f64, flaws: usize) -> Rank {
        let reached = part >= 1.0;
        let poor = reached && self.shells.worth_of_all().into_iter().any(|worth| worth < POOR);
        match self.goal {
            ShellGoal::Shells(_) if !reached => (true, 0, false, -part),
            _ => (!reached, if reached { flaws } else { 0 }, poor, worst(far)),
        }
    }

    /// Shells with a crease, and shells that cross.
    fn flaws(&self) -> [Vec<u32>; 2] {
        let mesh = &self.shells.mesh;
        let folds = |n: &u32| self.shells.creased[*n as usize] && !self.shells.sharp[*n as usize];
        let creased = |t: &u32| mesh.triangles[*t as usize].iter().any(folds);
        [mesh.alive().filter(creased).collect(), self.shells.crossing().shells()]
    }

    /// True if halving a shell may mend it.
    fn is_long(&self, shell: u32) -> bool {
        let x = self.shells.mesh.corners(shell);
        let longest = (0..3).map(|k| (x[(k + 1) % 3] - x[k]).norm()).fold(0.0, f64::max);
        longest > self.aim.max(LEAST_EDGE * self.target.diagonal)
    }
}

fn worst(far: &[f64]) -> f64 {
    far.iter().copied().fold(0.0, f64::max)
}

/// The distance above which shells are halved on the way to a requested number. It is six tenths of the
/// worst, or less if that halves fewer than a twentieth of the shells.
fn share(far: &[f64]) -> f64 {
    let mut sorted = far.to_vec();
    sorted.sort_unstable_by(|a, b| b.total_cmp(a));
    sorted[far.len() / 20].min(0.6 * sorted[0])
}

impl Shells {
    fn new(mesh: &TriangleMesh, target: &Target) -> Self {
        let mesh = mesh.compacted();
        let mut sharp = vec![false; mesh.points.len()];
        mesh.creases().flatten().for_each(|node| sharp[node as usize] = true);
        let normal = |(point, x): (u32, &Vector3)| {
            let facing = mesh.point_normal(point);
            let (_, normal) = target.foot(x, &facing, 0.1 * target.diagonal);
            if normal == Vector3::zeros() { facing } else { normal }
        };
        Self {
            normals: (0..).zip(&mesh.points).map(normal).collect(),
            on_border: (0..mesh.points.len() as u32).map(|n| !mesh.marked(n).is_empty()).collect(),
            active: vec![true; mesh.points.len()],
            strict: false,
            creased: sharp.clone(),
            sharp,
            flat: Vec::new(),
            mesh,
        }
    }

    /// Some of the shells, numbered anew, and the numbers of their points, increasing.
    fn part(&self, shells: &[u32]) -> (Self, Vec<u32>) {
        let corners = shells.iter().map(|&t| self.mesh.triangles[t as usize]);
        let mut nodes: Vec<u32> = corners.clone().flatten().collect();
        nodes.sort_unstable();
        nodes.dedup();
        let mut number = vec![0; self.mesh.points.len()];
        (0..).zip(&nodes).for_each(|(at, &node)| number[node as usize] = at);
        let triangles = corners.map(|nodes| nodes.map(|n| number[n as usize])).collect();
        let points = nodes.iter().map(|&n| self.mesh.points[n as usize]).collect();
        let some = |flags: &[bool]| nodes.iter().map(|&n| flags[n as usize]).collect();
        let own_flat =
            if self.flat.is_empty() { Vec::new() } else { shells.iter().map(|&t| self.is_flat(t)).collect() };
        let mut mesh = TriangleMesh::new(points, triangles);
        let renumbered = |node: u32| nodes.binary_search(&node).ok().map(|at| at as u32);
        mesh.set_creases(self.mesh.creases().filter_map(|[a, b]| Some([renumbered(a)?, renumbered(b)?])));
        let part = Self {
            mesh,
            normals: nodes.iter().map(|&n| self.normals[n as usize]).collect(),
            on_border: some(&self.on_border),
            active: some(&self.active),
            strict: self.strict,
            creased: some(&self.creased),
            sharp: some(&self.sharp),
            flat: own_flat,
        };
        (part, nodes)
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
        let [(a, [ab, ac]), (b, [bc, ba]), (c, [ca, cb])] =
            [0, 1, 2].map(|corner| self.corner(triangle, corner));
        CurvedTriangle::new(self.mesh.corners(triangle), [a, b, c], [ab, ba, bc, cb, ca, ac], EdgeRule::Arc)
    }

    /// True if a corner of a shell may move, or the shell is gone.
    fn moves(&self, shell: u32) -> bool {
        !self.mesh.exists(shell)
            || self.mesh.triangles[shell as usize].iter().any(|&n| self.active[n as usize])
    }

    /// Shells that may move.
    fn moving(&self) -> usize {
        self.mesh.alive().filter(|&t| self.moves(t)).count()
    }

    /// Fits until all distances are within `aim` [m], or they stop falling.
    fn settle(
        &mut self,
        mut now: Distances,
        aim: f64,
        times: usize,
        target: &Target,
        effort: &mut Effort,
    ) -> Distances {
        for _ in 0..times {
            let far = now.far();
            if far.iter().all(|&off| off <= aim) || effort.is_spent() {
                break;
            }
            let scale = if aim > 0.0 { aim } else { share(&far) };
            let mut next = self.clone();
            for _ in 0..2 {
                next.fit(target, &now.landings, scale, effort);
            }
            let then = next.distances_after(&now, target, effort);
            let sum = |far: &[f64]| far.iter().map(|off| (off / scale).powi(8)).sum::<f64>();
            if sum(&then.far()) > 0.98 * sum(&far) {
                break;
            }
            (*self, now) = (next, then);
        }
        now
    }
}
