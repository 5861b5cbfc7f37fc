//! Undoing crossings at the end of a fit: corners of shells that cross are turned or moved, as long as fewer pairs cross.
//! The target does not cross itself, nor do flat triangles close to it. So one aim is the target with its normals, the other flatter
//! shells. A fit without crossings stays as it is, bit by bit.
//! Leaves out: knots that no step of this list loosens. The report counts them.

use pliant_geometry::Vector3;

use super::effort::Effort;
use super::measure::Distances;
use super::target::Target;
use super::{POOR, Shells};

/// Steps at most that are tried.
const MOST_TRIES: usize = 4000;

/// A try looks at all shells: so many shells at most in all tries together.
const MOST_SHELLS_TRIED: usize = 4_000_000;

/// Where corners go in a step.
#[derive(Clone, Copy, Debug)]
enum Step {
    /// Normals turn this part of the way to the mean of the triangles.
    Flatter(f64),
    /// Normals become those of the target.
    Facing,
    /// Points go this part of the way to the target, with its normals.
    Nearer(f64),
    /// Points go this part of the way to the middle of their neighbours, and normals to the mean of the triangles.
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

impl Shells {
    /// Loosens knots of shells that cross. The result counts only if fewer shells cross than before.
    pub(super) fn repair(&mut self, target: &Target) {
        let before = self.crossing();
        let mut tries = MOST_TRIES.min(MOST_SHELLS_TRIED / self.mesh.len().max(1));
        let mut tried = self.clone();
        let mut now = before.clone();
        while !now.pairs.is_empty() {
            let mut loosened = false;
            for knot in knots(&tried, &now.pairs) {
                loosened |= tried.loosen(&knot, target, &mut tries);
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

    /// Takes the step of one knot's corners, or of one of them, after which fewer pairs cross. Steps that take nothing farther off come
    /// first, then those that leave the fewest pairs, then the closest. Returns whether there is one.
    fn loosen(&mut self, knot: &[u32], target: &Target, tries: &mut usize) -> bool {
        // Normals of their neighbours turn, too.
        self.activate(knot.to_vec());
        let before = self.distances(&target.coarse, target);
        let off = |distances: &Distances| {
            let far = distances.far();
            self.mesh.alive().filter(|&t| self.moves(t)).map(|t| far[t as usize]).fold(0.0, f64::max)
        };
        let (pairs, close) = (self.crossing_with_moving(), off(&before));
        let mut best: Option<((bool, usize, f64), Self)> = None;
        let singles = knot.iter().map(std::slice::from_ref);
        let choices = std::iter::once(knot).chain(singles).flat_map(|nodes| STEPS.map(|step| (nodes, step)));
        for (nodes, step) in choices.take(*tries) {
            *tries -= 1;
            let Some(tried) = self.with(step, nodes, target) else { continue };
            let left = tried.crossing_with_moving();
            if left < pairs {
                let then = off(&tried.distances_after(&before, target, &mut Effort::new(usize::MAX)));
                let standing = (then > close, left, then);
                if best.as_ref().is_none_or(|(best, _)| standing < *best) {
                    best = Some((standing, tried));
                }
            }
        }
        best.map(|(_, found)| *self = found).is_some()
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

/// The corners of pairs that hang together by corners, for each such knot increasing.
fn knots(shells: &Shells, pairs: &[[u32; 2]]) -> Vec<Vec<u32>> {
    let mut knots: Vec<Vec<u32>> = Vec::new();
    for pair in pairs {
        let mut own: Vec<u32> = pair.iter().flat_map(|&t| shells.mesh.triangles[t as usize]).collect();
        let (joined, apart): (Vec<_>, Vec<_>) =
            knots.into_iter().partition(|knot| knot.iter().any(|node| own.contains(node)));
        own.extend(joined.into_iter().flatten());
        own.sort_unstable();
        own.dedup();
        knots = apart;
        knots.push(own);
    }
    knots
}
