//! Ties between participants: springs with dashpots between points of bodies that are stepped apart.
//!
//! With the gap g between two points and their relative velocity v, the points pull at each other by f = k
//! g + c v. The participant with the longer steps H goes first. The other one feels the spring at each of its
//! own steps h, with the first one on a straight way in between. Its impulses h f, summed over a step of the
//! first one, push that one back in its next step. Action equals reaction, later by (H − h)/2. An implicit
//! participant solves for the force together with its motion.
//!
//! The spring needs the dashpot. Let a = k H²/m and b = c H/m, and let Ω = ω² H² be the vibrations of a body.
//! The delayed force leaves the central differences of that body stable for a/2 < b and Ω + 2 b < 4 (from the
//! characteristic polynomial). With a = 1.5 b, vibrations of two bodies without damping were seen to grow.
//! Ties take [`SPRING`] for a/b, and a and 2 b of the margin that vibrations leave, summed over the points of
//! a node. They are as stiff as the lightest nodes and the longest step allow. A body at 0.9 of its critical
//! time step leaves little margin. At half of that step its side of the tie is some twenty times stiffer. A
//! tie opens by f/k under a lasting force f, which is [reported](TieNow).

use pliant_mechanics::grip::Grip;
use pliant_mechanics::mapping::{Weights, weighted};
use pliant_mechanics::tensor::{Vector, add, dot, scale, sub};
use serde::{Deserialize, Serialize};

use crate::failure::Failure;
use crate::participant::Participant;
use crate::participant_setup::{Method, ParticipantSetup};

/// Ratio a/b: the stiffness k is this ratio times c/H.
const SPRING: f64 = 1.0;
/// The part of the limit of stability that ties and vibrations of a body take together.
const ALL: f64 = 0.96;
/// The part that ties are left with at least.
const LEAST: f64 = 0.02;

/// Points of one participant that springs hold to points of another one.
#[derive(Clone, Debug)]
pub struct PenaltyTie {
    /// Its name.
    pub name: String,
    /// The participants, by their place in the setup.
    pub parts: [usize; 2],
    /// The points in each, as many in one as in the other: rows over the nodes of its model that sum to 1.
    pub points: [Weights; 2],
}

/// A tie between participants at an instant.
#[derive(Clone, Copy, Debug)]
pub struct TieNow<'a> {
    /// Its name.
    pub name: &'a str,
    /// Its points.
    pub points: usize,
    /// Force [N] on each participant, summed over the points. The participant with the longer steps has the
    /// mean of the other one's forces since its last step.
    pub forces: [Vector<f64>; 2],
    /// The widest gap of a point [m].
    pub gap: f64,
    /// The widest gap since the start [m].
    pub widest: f64,
}

/// State of the ties of a setup that a restart needs.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct TieMemory {
    /// Forces of each point on its slower and its faster side [N], and the impulse that the slower side is
    /// still to feel [N s].
    points: Vec<[Vector<f64>; 3]>,
    /// The widest gap [m] of each tie.
    widest: Vec<f64>,
}

impl TieMemory {
    /// True if there are no ties.
    pub(crate) fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// True if the memory belongs to some ties, or is empty.
    pub(crate) fn fits(&self, ties: &[PenaltyTie]) -> bool {
        let points: usize = ties.iter().map(|tie| tie.points[0].len()).sum();
        self.points.is_empty() || [self.points.len(), self.widest.len()] == [points, ties.len()]
    }
}

/// A side of a point.
struct Side {
    part: usize,
    /// Its nodes follow no others.
    grip: Grip,
    /// Place at rest [m].
    rest: Vector<f64>,
}

impl Side {
    fn field(
        &self,
        participants: &[Box<dyn Participant>],
        field: impl Fn(&dyn Participant, usize) -> Vector<f64>,
    ) -> Vector<f64> {
        let now = participants[self.part].as_ref();
        weighted(self.grip.nodes.iter().copied(), |node| field(now, node as usize))
    }

    fn moved(&self, participants: &[Box<dyn Participant>]) -> Vector<f64> {
        self.field(participants, |now, node| now.displacement(node))
    }

    fn velocity(&self, participants: &[Box<dyn Participant>]) -> Vector<f64> {
        self.field(participants, |now, node| now.last_velocity(node))
    }

    /// Makes the grip pull by a force [N] where the side is.
    fn pull(&mut self, force: Vector<f64>, participants: &[Box<dyn Participant>]) {
        let here = add(self.rest, self.moved(participants));
        self.grip.place = add(here, scale(force, 1.0 / self.grip.stiffness));
    }
}

/// A point of a tie: its slower and its faster side.
struct Point {
    slow: Side,
    fast: Side,
    /// True if the faster side is the first one of the tie.
    turned: bool,
    /// True if equations of the faster side are solved.
    solved: bool,
    /// k [N/m].
    spring: f64,
    /// c [N s/m].
    dashpot: f64,
    /// The gap now [m].
    gap: Vector<f64>,
}

impl Point {
    /// Width of the gap [m].
    fn width(&self) -> f64 {
        dot(self.gap, self.gap).sqrt()
    }
}

/// The ties of a simulation.
pub(crate) struct Springs {
    ties: Vec<PenaltyTie>,
    points: Vec<Point>,
    memory: TieMemory,
}

impl Springs {
    /// Makes the springs of a setup, from a remembered state or an empty one.
    ///
    /// # Errors
    /// If a participant takes part in no ties.
    pub(crate) fn new(
        ties: &[PenaltyTie],
        parts: &[ParticipantSetup],
        memory: TieMemory,
    ) -> Result<Self, Failure> {
        let mut points = Vec::new();
        // Sum of the weights of all points at each node.
        let mut shares: Vec<Vec<f64>> = parts.iter().map(|part| vec![0.0; part.model.node_count()]).collect();
        for tie in ties {
            let slow = tie.slower(parts)?;
            for point in 0..tie.points[0].len() {
                let mut side = |side: usize| {
                    let (part, row) = (tie.parts[side], tie.points[side].row(point).collect::<Vec<_>>());
                    let nodes = parts[part].model.resolved(&row);
                    for &(node, weight) in &nodes {
                        shares[part][node as usize] += weight.abs();
                    }
                    let rest = weighted(nodes.iter().copied(), |node| parts[part].model.rest[node as usize]);
                    Side { part, grip: Grip { nodes, ..Grip::default() }, rest }
                };
                points.push(Point {
                    slow: side(slow),
                    fast: side(1 - slow),
                    turned: slow == 1,
                    solved: parts[tie.parts[1 - slow]].method.solves_steps(),
                    spring: 0.0,
                    dashpot: 0.0,
                    gap: [0.0; 3],
                });
            }
        }
        for point in &mut points {
            let allowed = |side: &Side| {
                let (part, shares) = (&parts[side.part], &shares[side.part]);
                let of = |&(node, _): &(u32, f64)| mass_of(part, node) / shares[node as usize];
                let mass = side.grip.nodes.iter().map(of).fold(f64::INFINITY, f64::min);
                4.0 * room(part) * mass / ((SPRING + 2.0) * part.steps.step)
            };
            point.dashpot = match point.solved {
                true => allowed(&point.slow),
                // The two sides may move against each other.
                false => 0.5 * allowed(&point.slow).min(allowed(&point.fast)),
            };
            point.spring = SPRING * point.dashpot / parts[point.slow.part].steps.step;
            let from_dashpot =
                if point.solved { point.dashpot / parts[point.fast.part].steps.step } else { 0.0 };
            point.slow.grip.stiffness = point.spring;
            point.fast.grip.stiffness = point.spring + from_dashpot;
        }
        let memory = match memory.points.is_empty() {
            true => TieMemory { points: vec![[[0.0; 3]; 3]; points.len()], widest: vec![0.0; ties.len()] },
            false => memory,
        };
        Ok(Self { ties: ties.to_vec(), points, memory })
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    pub(crate) fn memory(&self) -> &TieMemory {
        &self.memory
    }

    /// Prepares a step of a participant: finds what its springs pull it by. `ahead` is how far [s] others
    /// are, each by its place, beyond the end of this step.
    pub(crate) fn before(
        &mut self,
        part: usize,
        participants: &[Box<dyn Participant>],
        ahead: impl Fn(usize) -> f64,
    ) {
        for (point, [on_slow, on_fast, _]) in self.points.iter_mut().zip(&mut self.memory.points) {
            if point.slow.part == part {
                point.slow.pull(*on_slow, participants);
            } else if point.fast.part == part && point.solved {
                // k (u′ − u⁺) + c (v′ − (u⁺ − u)/h) at the end, with the displacement u before and u⁺ after
                // the step.
                let velocity = point.slow.velocity(participants);
                let there = sub(point.slow.moved(participants), scale(velocity, ahead(point.slow.part)));
                let here = point.fast.moved(participants);
                let pull = add(scale(sub(there, here), point.spring), scale(velocity, point.dashpot));
                point.fast.pull(pull, participants);
            } else if point.fast.part == part {
                point.fast.pull(*on_fast, participants);
            }
        }
    }

    /// Lets a participant feel in its next step what those with shorter steps have felt since its last one.
    pub(crate) fn settle(&mut self, part: usize, parts: &[ParticipantSetup]) {
        let of_part =
            self.points.iter().zip(&mut self.memory.points).filter(|(point, _)| point.slow.part == part);
        for (_, [on_slow, _, owed]) in of_part {
            *on_slow = scale(std::mem::take(owed), 1.0 / parts[part].steps.step);
        }
    }

    /// Follows a step of a participant: finds the present force of its springs, and the impulse that slower
    /// participants are to feel.
    pub(crate) fn after(
        &mut self,
        part: usize,
        parts: &[ParticipantSetup],
        participants: &[Box<dyn Participant>],
        ahead: impl Fn(usize) -> f64,
    ) {
        let step = parts[part].steps.step;
        for (point, [_, on_fast, owed]) in self.points.iter().zip(&mut self.memory.points) {
            if point.fast.part != part {
                continue;
            }
            let here = point.fast.moved(participants);
            *on_fast = match point.solved {
                true => {
                    let grip = &point.fast.grip;
                    scale(sub(grip.place, add(point.fast.rest, here)), grip.stiffness)
                }
                false => {
                    let velocity = point.slow.velocity(participants);
                    let there = sub(point.slow.moved(participants), scale(velocity, ahead(point.slow.part)));
                    let relative = sub(velocity, point.fast.velocity(participants));
                    add(scale(sub(there, here), point.spring), scale(relative, point.dashpot))
                }
            };
            *owed = sub(*owed, scale(*on_fast, step));
        }
    }

    /// Finds gaps where all participants meet, and notes the widest.
    pub(crate) fn meet(&mut self, participants: &[Box<dyn Participant>]) {
        for point in &mut self.points {
            point.gap = sub(point.slow.moved(participants), point.fast.moved(participants));
        }
        let mut first = 0;
        for (tie, widest) in self.ties.iter().zip(&mut self.memory.widest) {
            let points = &self.points[first..first + tie.points[0].len()];
            first += points.len();
            *widest = points.iter().map(Point::width).fold(*widest, f64::max);
        }
    }

    /// Adds the springs at a participant to grips.
    pub(crate) fn add_to(&self, part: usize, grips: &mut Vec<Grip>) {
        let sides = self.points.iter().flat_map(|point| [&point.slow, &point.fast]);
        grips.extend(sides.filter(|side| side.part == part).map(|side| side.grip.clone()));
    }

    /// The ties where all participants met last.
    pub(crate) fn now(&self) -> impl Iterator<Item = TieNow<'_>> {
        let mut first = 0;
        self.ties.iter().zip(&self.memory.widest).map(move |(tie, &widest)| {
            let range = first..first + tie.points[0].len();
            first = range.end;
            let points = &self.points[range.clone()];
            let gap = points.iter().map(Point::width).fold(0.0, f64::max);
            let of = points.iter().zip(&self.memory.points[range]);
            let forces = of.fold([[0.0; 3]; 2], |[a, b], (point, &[on_slow, on_fast, _])| {
                let [first, second] = if point.turned { [on_fast, on_slow] } else { [on_slow, on_fast] };
                [add(a, first), add(b, second)]
            });
            TieNow { name: &tie.name, points: points.len(), forces, gap, widest }
        })
    }
}

/// The part of the limit of stability that ties can take of a participant.
fn room(part: &ParticipantSetup) -> f64 {
    let critical = match (&part.method, part.method.bodies()) {
        (Method::Explicit(settings), _) => settings.critical_step,
        (_, Some(bodies)) => pliant_implicit::ExplicitShells::stable_step(&bodies.model),
        _ => f64::INFINITY,
    };
    (ALL - (part.steps.step / critical).powi(2)).max(LEAST)
}

/// Mass [kg] of a node as its participant steps it.
fn mass_of(part: &ParticipantSetup, node: u32) -> f64 {
    match part.method.bodies() {
        Some(bodies) => bodies.model.mass[node as usize],
        None => part.model.inertia(node as usize),
    }
}

impl PenaltyTie {
    /// Its side with the longer steps.
    ///
    /// # Errors
    /// If springs can't hold both sides.
    pub fn slower(&self, parts: &[ParticipantSetup]) -> Result<usize, Failure> {
        let refused = |why: String| Failure::input(&format_args!("tie `{}`: {why}", self.name));
        let [a, b] = self.parts;
        if a == b || a.max(b) >= parts.len() || self.points[0].len() != self.points[1].len() {
            return Err(refused("it needs the same number of points in both participants".into()));
        }
        let both = [&parts[a], &parts[b]];
        for part in both {
            if let Some(why) = part.method.untied() {
                return Err(refused(format!("participant `{}` {why}", part.name)));
            }
        }
        let solves = both.map(|part| part.method.solves_steps());
        if solves == [true; 2] {
            return Err(refused(
            "both participants are implicit, and a spring between them would be soft: put their bodies into one".into(),
        ));
        }
        if let Some(solving) = solves.iter().position(|&solves| solves) {
            if both[solving].steps.number < both[1 - solving].steps.number {
                return Err(refused(format!(
                    "participant `{}` is implicit with longer steps than `{}`, and the tie would be soft: give it a `step` of at most {:e} s",
                    both[solving].name,
                    both[1 - solving].name,
                    both[1 - solving].steps.step
                )));
            }
            return Ok(1 - solving);
        }
        Ok(usize::from(both[1].steps.number < both[0].steps.number))
    }
}

impl Method {
    /// True if the equations of each step are solved.
    pub(crate) fn solves_steps(&self) -> bool {
        matches!(self, Self::Implicit(..))
    }

    /// True if a step may take so long that the user waits.
    pub(crate) fn takes_long(&self) -> bool {
        self.solves_steps() || matches!(self, Self::Static(..) | Self::QuasiStatic { .. })
    }

    /// Returns the reason why bodies of this method cannot be tied to another participant; `None` if they
    /// can.
    pub fn untied(&self) -> Option<&'static str> {
        match self {
            Self::Static(..) | Self::QuasiStatic { .. } => {
                Some("finds equilibria, which have no steps in common with others")
            }
            #[cfg(feature = "gpu")]
            Self::Explicit(settings) if settings.device.is_some() => {
                Some("is on a GPU, where it cannot be tied to other participants")
            }
            _ => None,
        }
    }
}
