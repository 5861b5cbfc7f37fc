//! Exchange of shells once their requested number is reached. The shells that are farthest off are fitted
//! again by themselves, edges flip or shells are halved. For each halved shell two others collapse, where
//! they stay close. Each change is tried on a part of the shells (`part`). It stays if the farthest there
//! come nearer, or if collapsed shells stay nearer than the farthest of all. The exchange ends when the
//! farthest come no nearer, nothing collapses or the work is done. Leaves out: collapses of points of
//! borders, of sharp edges and of creases.

use std::collections::BTreeSet;

use super::effort::{Effort, LANDING};
use super::measure::Distances;
use super::part::Part;
use super::target::Target;
use super::{POOR, Shells, worst};
use crate::surface::edges::key;

/// Distances stay below this part of the largest where edges collapse.
const SPARE: f64 = 0.75;

/// Most collapses tried in a row: the remaining edges are farther off, and fail as well.
const MOST_COLLAPSES: usize = 30;

/// Most shells halved in one part until its largest distance falls.
const MOST_HALVED: usize = 4;

/// Parts of the largest distance that fits aim at: without more shells, and with some.
const AIM: f64 = 0.8;
const AIM_HALVED: f64 = 0.6;

/// A change stays if the largest distance falls below this part of its old value: without more shells, and
/// with some.
const NEARER: f64 = 0.95;
const NEARER_HALVED: f64 = 0.98;

/// Number of times that triangles are evened out after their number changed.
const EVENED: usize = 3;

/// Change of a part of the shells. Points and shells have their numbers in the part.
#[derive(Clone, Copy, Debug)]
enum Change {
    /// Only places and normals change.
    Fit,
    /// The edge between two shells turns.
    Flip([u32; 2]),
    /// A shell is halved at its longest edge.
    Halve(u32),
    /// Two points become the first one.
    Collapse([u32; 2]),
}

impl Part {
    /// The part after a change and a fit until distances are within `aim` [m]; `None` if it cannot change so.
    fn changed(&self, change: Change, aim: f64, target: &Target, effort: &mut Effort) -> Option<Self> {
        let mut next = self.clone();
        let shells = &mut next.shells;
        match change {
            Change::Fit => {}
            Change::Flip([a, b]) => {
                let new = shells.mesh.flipped(a, b)?;
                if !new.as_flattened().iter().all(|&n| shells.active[n as usize]) {
                    return None;
                }
                shells.mesh.flip(a, b, new);
                shells.stand_all();
            }
            Change::Halve(shell) => {
                let edge = shells.longest_edge(shell);
                if !edge.iter().any(|&n| shells.active[n as usize]) {
                    return None;
                }
                shells.halve(shell, edge, target);
                shells.even_out(target, EVENED, effort);
            }
            Change::Collapse(ends) => {
                if !shells.collapse(ends, target) {
                    return None;
                }
                shells.even_out(target, EVENED, effort);
            }
        }
        let now = shells.distances_after(&next.distances, target, effort);
        next.distances = shells.settle(now, aim, 4, target, effort);
        Some(next)
    }

    /// True if a change has not made triangles poorer, taken the normal of any point, or made more shells
    /// cross.
    fn holds(&self, before: &Self, effort: &mut Effort) -> bool {
        let crossing = |part: &Self, effort: &mut Effort| {
            part.shells.crossing_with_moving(part.shells.parts_in_the_end(), effort)
        };
        let folds = |part: &Self| {
            let nodes = part.shells.creased.iter().zip(&part.shells.sharp);
            nodes.filter(|(creased, sharp)| **creased && !**sharp).count()
        };
        self.least_worth() >= before.least_worth().min(POOR)
            && folds(self) <= folds(before)
            && crossing(self, effort) <= crossing(before, effort)
    }

    /// The least worth of triangles with a point that may move.
    fn least_worth(&self) -> f64 {
        let shells = &self.shells;
        let active = (0..).zip(&shells.mesh.points).filter(|(n, _)| shells.active[*n as usize]);
        active.map(|(n, x)| shells.worth_round(n, x)).fold(1.0, f64::min)
    }

    /// The largest distance of shells that move and of the points of the target that were nearest to them
    /// [m].
    fn farthest(&self) -> f64 {
        self.shells.farthest_moving(&self.distances).max(self.distances.largest_back())
    }

    /// The shell that moves and is farthest off.
    fn farthest_shell(&self) -> Option<u32> {
        let far = self.distances.far();
        let moving = self.shells.mesh.alive().filter(|&t| self.shells.moves(t));
        moving.max_by(|&a, &b| far[a as usize].total_cmp(&far[b as usize]))
    }
}

/// Shells of which some are exchanged.
struct Exchange<'t> {
    shells: Shells,
    distances: Distances,
    target: &'t Target,
    effort: &'t mut Effort,
    /// Edges whose collapse was tried.
    tried: BTreeSet<[u32; 2]>,
}

impl Shells {
    /// Exchanges shells as long as the largest distance falls, if their requested number is reached. `report`
    /// hears this distance [m].
    pub(super) fn exchange(
        &mut self,
        number: usize,
        target: &Target,
        effort: &mut Effort,
        report: impl Fn(f64),
    ) {
        if self.mesh.len() + 1 < number {
            return;
        }
        effort.search(target.fine.samples.len(), LANDING);
        let distances = self.distances(&target.fine, target);
        let mut work = Exchange { shells: self.clone(), distances, target, effort, tried: BTreeSet::new() };
        let mut nearest = f64::INFINITY;
        loop {
            let (count, off) = (work.shells.mesh.len(), worst(&work.distances.far()));
            if count <= number && count + 1 >= number && off < nearest {
                nearest = off;
                *self = work.shells.clone();
                report(off);
            }
            let changes = !work.effort.is_spent()
                && if count > number { work.collapse(off) } else { work.come_nearer(off) };
            if !changes {
                break;
            }
        }
        // Drop removed shells and points.
        *self = self.part(&self.mesh.alive().collect::<Vec<_>>()).0;
    }
}

impl Exchange<'_> {
    fn put_back(&mut self, part: Part) {
        part.put_back(&mut self.shells, &mut self.distances);
    }

    /// Brings the farthest shell nearer, whose distance is given [m]: with the same number of shells, or with
    /// more. Returns whether it did.
    fn come_nearer(&mut self, off: f64) -> bool {
        let far = self.distances.far();
        let alive = self.shells.mesh.alive();
        let Some(farthest) = alive.max_by(|&a, &b| far[a as usize].total_cmp(&far[b as usize])) else {
            return false;
        };
        let mesh = &self.shells.mesh;
        let [a, b] = self.shells.longest_edge(farthest);
        let apexes = mesh.sides(a, b).into_iter().flatten().map(|t| mesh.opposite(t, a, b));
        let knot: Vec<u32> = [a, b].into_iter().chain(apexes).collect();
        let Some(part) = Part::new(&mut self.shells, &knot, &self.distances) else { return false };
        let Some(shell) = part.shell(farthest) else { return false };
        let [p, q, r] = part.shells.mesh.triangles[shell as usize];
        let found = self
            .best_of(&part, &[Change::Fit], off)
            .or_else(|| self.best_of(&part, &[[p, q], [q, r], [r, p]].map(Change::Flip), off))
            .or_else(|| self.halved(&part, shell, off));
        found.map(|found| self.put_back(found)).is_some()
    }

    /// The part after the change that comes nearest, if one comes near enough.
    fn best_of(&mut self, part: &Part, changes: &[Change], off: f64) -> Option<Part> {
        let mut best: Option<(f64, Part)> = None;
        for &change in changes {
            let Some(found) = part.changed(change, AIM * off, self.target, self.effort) else { continue };
            let then = found.farthest();
            if then < best.as_ref().map_or(NEARER * off, |(least, _)| *least)
                && found.holds(part, self.effort)
            {
                best = Some((then, found));
            }
        }
        best.map(|(_, found)| found)
    }

    /// The part after halving a shell, and then the farthest there, as often as needed.
    fn halved(&mut self, part: &Part, shell: u32, off: f64) -> Option<Part> {
        let (mut found, mut shell) = (part.clone(), shell);
        for _ in 0..MOST_HALVED {
            found = found.changed(Change::Halve(shell), AIM_HALVED * off, self.target, self.effort)?;
            if found.farthest() < NEARER_HALVED * off && found.holds(part, self.effort) {
                return Some(found);
            }
            shell = found.farthest_shell()?;
        }
        None
    }

    /// Collapses an edge where shells are close, measured by the largest distance [m]. Returns whether it
    /// did.
    fn collapse(&mut self, off: f64) -> bool {
        let far = self.distances.far();
        let mesh = &self.shells.mesh;
        let round = |star: &Vec<u32>| star.iter().map(|&t| far[t as usize]).fold(0.0, f64::max);
        let round: Vec<f64> = mesh.star.iter().map(round).collect();
        let both = |[a, b]: [u32; 2]| (round[a as usize].max(round[b as usize]), [a, b]);
        let edges = mesh.edges().into_iter().filter(|edge| !self.tried.contains(edge)).map(both);
        let mut close: Vec<(f64, [u32; 2])> = edges.filter(|(far, _)| *far < SPARE * off).collect();
        close.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let ways = close.into_iter().flat_map(|(_, [a, b])| [[a, b], [b, a]]);
        let mut left = MOST_COLLAPSES;
        for ends in ways {
            if left == 0 || self.effort.is_spent() {
                break;
            }
            if !self.shells.may_collapse(ends) || !self.tried.insert(key(ends[0], ends[1])) {
                continue;
            }
            left -= 1;
            let Some(part) = Part::new(&mut self.shells, &ends, &self.distances) else { continue };
            let [Some(keep), Some(gone)] = ends.map(|n| part.point(n)) else { continue };
            let change = Change::Collapse([keep, gone]);
            let Some(found) = part.changed(change, SPARE * off, self.target, self.effort) else { continue };
            if found.farthest() < SPARE * off && found.holds(&part, self.effort) {
                self.put_back(found);
                return true;
            }
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use pliant_geometry::Vector3;

    use super::*;
    use crate::surface::triangles::TriangleMesh;
    use crate::{DEFAULT_CELL_LIMIT, ImplicitField, sphere};

    /// A ball of 20 mm with a knob of 5 mm on it, joined smoothly over 4 mm.
    struct Knob;

    impl ImplicitField for Knob {
        fn value(&self, x: &Vector3) -> f64 {
            let [ball, knob] =
                [(0.02, 0.0), (0.005, 0.021)].map(|(radius, z)| radius - (x - Vector3::z() * z).norm());
            let near = (1.0 - (ball - knob).abs() / 0.004).max(0.0);
            ball.max(knob) + 0.25 * near * near * 0.004
        }

        fn bounds(&self) -> (Vector3, Vector3) {
            (Vector3::repeat(-0.022), Vector3::new(0.022, 0.022, 0.028))
        }
    }

    /// Even shells on the ball are too large for the knob. After an exchange for as many others they come
    /// four times nearer. The surface stays closed, and distances equal a new measurement.
    #[test]
    fn shells_go_where_the_surface_bends() {
        let surface = TriangleMesh::of_field(&Knob, 0.001, DEFAULT_CELL_LIMIT).unwrap();
        let (even, _) = TriangleMesh::from_mesh(&sphere(0.02, 2, DEFAULT_CELL_LIMIT).unwrap()).unwrap();
        let target = Target::new(&surface);
        let mut shells = Shells::new(&even, &target);
        (0..even.points.len() as u32).for_each(|point| shells.place(point, &target));
        shells.require_upright();
        let start = shells.distances(&target.fine, &target);
        let fitted = shells.settle(start, 0.0, 12, &target, &mut Effort::new(usize::MAX));
        let before = worst(&fitted.far());
        let reported = Cell::new(f64::INFINITY);
        shells.exchange(even.len(), &target, &mut Effort::new(4_000_000), |off| {
            assert!(off < reported.replace(off));
        });
        let after = worst(&shells.distances(&target.fine, &target).far());
        println!("{} shells, {before:.2e} m and {after:.2e} m", even.len());
        assert!(after < 0.25 * before, "{before} {after}");
        assert!(after <= reported.get() && reported.get() < 1.1 * after, "{after} {}", reported.get());
        let mesh = &shells.mesh;
        assert!(mesh.len() == even.len() || mesh.len() + 1 == even.len(), "{}", mesh.len());
        assert_eq!(mesh.triangles.len(), mesh.len());
        assert_eq!(mesh.points.len() + mesh.len(), mesh.edges().len() + 2);
        assert!(mesh.edges().iter().all(|&[a, b]| mesh.sides(a, b).iter().all(Option::is_some)));
        assert!(shells.crossing().pairs.is_empty());
    }

    /// The exchange leaves shells alone if their requested number is not reached.
    #[test]
    fn fewer_shells_than_asked_for_stay() {
        let (ball, _) = TriangleMesh::from_mesh(&sphere(0.02, 1, DEFAULT_CELL_LIMIT).unwrap()).unwrap();
        let target = Target::new(&ball);
        let mut shells = Shells::new(&ball, &target);
        shells.exchange(ball.len() + 2, &target, &mut Effort::new(1_000_000), |_| panic!("exchanged"));
        assert_eq!(shells.mesh.points, ball.points);
    }
}
