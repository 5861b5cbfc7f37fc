//! Undoing crossings at the end of a fit: corners of shells that cross are turned or moved, as long as fewer
//! pairs cross. The target does not cross itself, nor do flat triangles close to it. So one aim is the target
//! with its normals, the other flatter shells. A fit without crossings stays bit by bit. Leaves out: knots
//! that no step of this list loosens. The report counts them.

use std::cmp::Reverse;

use pliant_geometry::Vector3;

use super::effort::Effort;
use super::measure::Distances;
use super::part::Part;
use super::target::Target;
use super::{POOR, Shells};

/// Most pieces of shells that all tries together test: about 3 s of one core.
const MOST_PIECES_TRIED: usize = 1_000_000;

/// Most times that corners of crossing shells become creases.
const CREASINGS: usize = 8;

/// Step of the corners of shells.
#[derive(Clone, Copy, Debug)]
enum Step {
    /// Normals turn this part of the way to the mean of the triangles.
    Flatter(f64),
    /// Normals become normals of the target.
    Facing,
    /// Points go this part of the way to the target, with its normals.
    Nearer(f64),
    /// Points go this part of the way to the middle of their neighbours, and normals to the mean of the
    /// triangles.
    Evener(f64),
    /// Points go this part of the mean edge along their normals, out or in.
    Along(f64),
}

/// Steps from little to much.
const STEPS: [Step; 14] = [
    Step::Flatter(0.25),
    Step::Flatter(0.5),
    Step::Facing,
    Step::Nearer(0.5),
    Step::Flatter(1.0),
    Step::Nearer(1.0),
    Step::Evener(0.1),
    Step::Evener(0.25),
    Step::Along(-0.05),
    Step::Along(0.05),
    Step::Evener(0.5),
    Step::Along(-0.15),
    Step::Along(0.15),
    Step::Evener(1.0),
];

/// Rank of a step; the least is best. True if shells come farther off, number of pairs that are parted, and
/// distance of the shells [m].
type Rank = (bool, Reverse<usize>, f64);

impl Part {
    /// The part after the best step of a knot of its points, if there is one.
    fn best_step(&self, knot: &[u32], target: &Target, parts: usize, effort: &mut Effort) -> Option<Shells> {
        let mut best: Option<(Rank, Shells)> = None;
        let singles = knot.iter().map(std::slice::from_ref);
        for nodes in std::iter::once(knot).chain(singles) {
            let mut start = self.shells.clone();
            start.activate(nodes.to_vec());
            let before = start.crossing_with_moving(parts, effort);
            let close = start.farthest_moving(&self.distances);
            if before == 0 {
                continue;
            }
            for step in STEPS {
                if effort.is_spent() {
                    break;
                }
                let Some(tried) = start.with(step, nodes, target) else { continue };
                let left = tried.crossing_with_moving(parts, effort);
                if left < before {
                    let after = tried.distances_after(&self.distances, target, &mut Effort::new(usize::MAX));
                    let then = tried.farthest_moving(&after);
                    let standing = (then > close, Reverse(before - left), then);
                    if best.as_ref().is_none_or(|(best, _)| standing < *best) {
                        best = Some((standing, tried));
                    }
                }
            }
        }
        best.map(|(_, found)| found)
    }
}

impl Shells {
    /// Loosens knots of shells that cross. The result counts only if fewer shells cross than before.
    pub(super) fn repair(&mut self, target: &Target) {
        let before = self.crossing();
        if before.pairs.is_empty() {
            return;
        }
        let parts = self.parts_in_the_end();
        let mut effort = Effort::new(MOST_PIECES_TRIED);
        let mut tried = self.clone();
        let mut distances = self.distances(&target.coarse, target);
        let mut now = before.clone();
        while !now.pairs.is_empty() {
            let mut loosened = false;
            for knot in knots(&tried, &now.pairs) {
                loosened |= tried.loosen(&knot, &mut distances, target, parts, &mut effort);
            }
            if !loosened {
                break;
            }
            now = tried.crossing();
        }
        if now.shells().len() < before.shells().len() {
            *self = tried;
        }
    }

    /// Takes the normals of the corners of shells that still cross: at creases shells are as flat as their
    /// triangles, which do not cross. The result counts only if fewer shells cross than before. Nothing may
    /// turn normals afterwards.
    pub(super) fn crease_crossing(&mut self) {
        let mut now = self.crossing().shells();
        for _ in 0..CREASINGS {
            if now.is_empty() {
                return;
            }
            let mut tried = self.clone();
            for node in now.iter().flat_map(|&t| self.mesh.triangles[t as usize]) {
                tried.creased[node as usize] = true;
            }
            let then = tried.crossing().shells();
            if then.len() >= now.len() {
                return;
            }
            (*self, now) = (tried, then);
        }
    }

    /// Takes the step of all corners of a knot, or of one corner, after which fewer pairs cross. Steps that
    /// take nothing farther off come first, then steps that leave the fewest pairs, then the closest. Returns
    /// whether there is one.
    fn loosen(
        &mut self,
        knot: &[u32],
        distances: &mut Distances,
        target: &Target,
        parts: usize,
        effort: &mut Effort,
    ) -> bool {
        let Some(part) = Part::new(self, knot, distances) else { return false };
        let points: Vec<u32> = knot.iter().filter_map(|&node| part.point(node)).collect();
        let Some(found) = part.best_step(&points, target, parts, effort) else { return false };
        // Normals of neighbours turn, too.
        self.activate(knot.to_vec());
        for (at, &node) in part.nodes.iter().enumerate().filter(|(_, node)| self.active[**node as usize]) {
            let node = node as usize;
            self.mesh.points[node] = found.mesh.points[at];
            self.normals[node] = found.normals[at];
            self.creased[node] = found.creased[at];
        }
        *distances = self.distances_after(distances, target, &mut Effort::new(usize::MAX));
        true
    }

    /// The shells after a step of some corners; `None` if a triangle loses its shape or a corner its normal.
    fn with(&self, step: Step, nodes: &[u32], target: &Target) -> Option<Self> {
        let mut next = self.clone();
        for &node in nodes {
            let n = node as usize;
            let (here, normal) = (self.mesh.points[n], self.normals[n]);
            let moved = |to: Vector3, part: f64| if self.on_border[n] { here } else { here.lerp(&to, part) };
            let turned = |to: Vector3, part: f64| normal.lerp(&to, part).try_normalize(0.0).unwrap_or(normal);
            let mean = self.mesh.point_normal(node);
            let around = self.mesh.neighbours(node);
            let points = around.iter().map(|&other| self.mesh.points[other as usize]);
            let middle = points.clone().sum::<Vector3>() / around.len().max(1) as f64;
            let size = points.map(|x| (x - here).norm()).sum::<f64>() / around.len().max(1) as f64;
            (next.mesh.points[n], next.normals[n]) = match step {
                Step::Flatter(part) => (here, turned(mean, part)),
                Step::Facing => (here, turned(target.foot(&here, &mean, size).1, 1.0)),
                Step::Nearer(part) => {
                    let (foot, facing) = target.foot(&here, &mean, size);
                    (moved(foot, part), turned(facing, part))
                }
                Step::Evener(part) => (moved(middle, part), turned(mean, part)),
                Step::Along(part) => (moved(here + part * size * normal, 1.0), normal),
            };
        }
        for &node in nodes {
            next.stand(node);
            next.mesh.neighbours(node).into_iter().for_each(|other| next.stand(other));
        }
        let keeps = |&node: &u32| {
            let shape = |shells: &Self| shells.worth_round(node, &shells.mesh.points[node as usize]);
            let is_creased = |&other: &u32| next.creased[other as usize] && !self.creased[other as usize];
            shape(&next) >= shape(self).min(POOR)
                && !next.mesh.neighbours(node).iter().chain([&node]).any(is_creased)
        };
        nodes.iter().all(keeps).then_some(next)
    }
}

/// The corners of crossing pairs that are connected by corners, increasing for each such knot.
fn knots(shells: &Shells, pairs: &[[u32; 2]]) -> Vec<Vec<u32>> {
    let mut knots: Vec<Vec<u32>> = Vec::new();
    for pair in pairs {
        let mut nodes: Vec<u32> = pair.iter().flat_map(|&t| shells.mesh.triangles[t as usize]).collect();
        let (joined, apart): (Vec<_>, Vec<_>) =
            knots.into_iter().partition(|knot| knot.iter().any(|node| nodes.contains(node)));
        nodes.extend(joined.into_iter().flatten());
        nodes.sort_unstable();
        nodes.dedup();
        knots = apart;
        knots.push(nodes);
    }
    knots
}
