//! The outcome of a run: its samples, the worst of its balances and strains, and its end.

use std::path::PathBuf;

use nalgebra::Vector3;
use pliant_explicit::model_balance_floor;
use pliant_explicit::stability::Stability;
use pliant_format::tables::SolverName;
use pliant_geometry::words::{counted, number};
use pliant_mechanics::Energies;
use pliant_mechanics::count;
use pliant_mechanics::model::Enclosed;
use pliant_scene::{PlannedParticipant, World};
use pliant_sim::contact::barrier::IntersectionCheck;
use pliant_sim::contact::lag::Lag;
use pliant_sim::{CoupledSurfaceNow, Effort, Equilibria, Failure, Instant, TieNow};
use serde::{Deserialize, Serialize};

use super::{Frame, ShellStrains, SolidStrains, time_of};

/// The result of a run.
#[derive(Clone, Debug)]
pub(crate) struct Outcome {
    pub failure: Option<Failure>,
    /// Common instants after the start.
    pub steps: u64,
    pub time: f64,
    pub wall_seconds: f64,
    /// Energies of all participants together.
    pub energies: Energies,
    /// Results of the participants, in the order of the world.
    pub parts: Vec<PartOutcome>,
    /// The ties between participants.
    pub ties: Vec<TieSummary>,
    /// The contacts between participants.
    pub guests: Vec<CoupledSurfaceSummary>,
    /// Reason why the run ended before the time of the scene was over, without a failure.
    pub ended: Option<String>,
    pub history: History,
    pub files: Vec<PathBuf>,
    /// The picture of the last instant.
    pub picture: Option<PathBuf>,
    pub threads: usize,
    /// The checkpoint it went on from, and its time [s].
    pub resumed: Option<(PathBuf, f64)>,
}

impl Outcome {
    /// Makes the outcome of a run whose steppers could not be made.
    pub(crate) fn not_begun(failure: Failure, world: &World) -> Self {
        let part = |part: &PlannedParticipant| PartOutcome {
            reactions: vec![[0.0; 3]; part.built.model.constraints.len()],
            ..PartOutcome::default()
        };
        Self {
            failure: Some(failure),
            steps: 0,
            time: 0.0,
            wall_seconds: 0.0,
            energies: Energies::default(),
            parts: world.participants.iter().map(part).collect(),
            ties: Vec::new(),
            guests: Vec::new(),
            ended: None,
            history: History::default(),
            files: Vec::new(),
            picture: None,
            threads: rayon::current_num_threads(),
            resumed: None,
        }
    }
}

/// The result of a participant.
#[derive(Clone, Debug, Default)]
pub(crate) struct PartOutcome {
    pub steps: u64,
    pub energies: Energies,
    pub balance_floor: f64,
    /// Hourglass energy over the internal one.
    pub hourglass_share: f64,
    pub watched: Watched,
    /// The monitored critical time step; `None` for a run without inertia.
    pub stability: Option<Stability>,
    /// Quality of the equilibria, if the participant found some by dynamic relaxation.
    pub equilibria: Option<Equilibria>,
    /// Cost of its equations, if it solved some.
    pub effort: Option<Effort>,
    /// Residuals of its last iterations, as a table.
    pub convergence: Option<String>,
    pub reactions: Vec<[f64; 3]>,
    /// State of what each volume constraint encloses.
    pub enclosed: Vec<Option<Enclosed>>,
    /// The tools and the constraints that were held back.
    pub held_back: Vec<HeldBack>,
}

/// Something that was held back by a limit of its force or its pressure.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct HeldBack {
    /// The tool or the constraint.
    pub name: String,
    /// True for a volume.
    pub is_volume: bool,
    /// Its longest lag [m, of a volume m³].
    pub lag: f64,
    /// Time of the longest lag [s].
    pub time: f64,
}

impl PartOutcome {
    pub fn new(part: &PlannedParticipant, participant: &dyn Instant, watched: Watched) -> Self {
        let watches = part.plan.limits.is_some() && part.scene.run.solver == SolverName::Explicit;
        let frame = Frame::new(part, participant);
        Self {
            steps: participant.steps(),
            energies: participant.energies(),
            balance_floor: participant.balance_floor(),
            hourglass_share: hourglass_share(part, participant, 0.0).unwrap_or(0.0),
            watched,
            stability: watches.then(|| participant.stability()),
            equilibria: participant.equilibria(),
            effort: participant.effort(),
            convergence: participant.convergence(),
            reactions: frame.reactions().collect(),
            enclosed: (0..part.built.model.constraints.len())
                .map(|index| participant.enclosed(index))
                .collect(),
            held_back: held_back(part, participant),
        }
    }
}

/// Tools, and constraints that move nodes or fill volumes, that were held back by the limits of their forces
/// and pressures.
fn held_back(part: &PlannedParticipant, now: &dyn Instant) -> Vec<HeldBack> {
    let of = |name: &str, is_volume: bool, lag: &Lag| {
        let (lag, time) = lag.longest();
        (lag > 0.0).then(|| HeldBack { name: name.to_owned(), is_volume, lag, time })
    };
    let rigids = part.built.contacts.iter().flat_map(|contacts| &contacts.rigids).enumerate();
    let mut held: Vec<HeldBack> =
        rigids.filter_map(|(number, rigid)| of(rigid.tool(), false, now.lag(number)?)).collect();
    // Jaws lag together.
    held.dedup();
    let constraints = part.built.model.constraints.iter().enumerate();
    held.extend(constraints.filter_map(|(number, constraint)| {
        of(&constraint.name, constraint.motion.encloses(), now.lag_of_constraint(number)?)
    }));
    held
}

/// A tie between two participants.
#[derive(Clone, Debug, Serialize)]
pub struct TieSummary {
    /// Its name.
    pub name: String,
    /// The bodies that it ties.
    pub bodies: [String; 2],
    /// Its points.
    pub points: usize,
    /// Force [N] on the first body at the end.
    pub force: [f64; 3],
    /// The widest gap of a point at the end [m].
    pub gap: f64,
    /// The widest gap of a point during the run [m].
    pub widest: f64,
}

impl TieSummary {
    pub(crate) fn new(world: &World, tie: TieNow<'_>) -> Self {
        let TieNow { name, points, forces: [force, _], gap, widest } = tie;
        let table = world.scene.ties.iter().find(|(known, _)| known == name);
        let bodies = table.map_or_else(Default::default, |(_, table)| table.between.clone());
        Self { name: name.into(), bodies, points, force, gap, widest }
    }
}

/// The contacts between two participants.
#[derive(Clone, Debug, Serialize)]
pub struct CoupledSurfaceSummary {
    /// The explicit and the implicit participant.
    pub participants: [String; 2],
    /// Mean force [N] over the last step on each.
    pub forces: [[f64; 3]; 2],
    /// Mean of the times that a step in contact was taken.
    pub passes: f64,
    /// The largest difference of the forces on both in a step, relative to them.
    pub worst_difference: f64,
}

impl CoupledSurfaceSummary {
    pub(crate) fn new(world: &World, now: CoupledSurfaceNow) -> Self {
        let CoupledSurfaceNow { parts, forces, passes, worst } = now;
        let participants = parts.map(|part| world.participants[part].name.clone());
        Self { participants, forces, passes, worst_difference: worst }
    }
}

/// Samples of a run for plot and summary.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct History {
    pub times: Vec<f64>,
    pub energies: Vec<Energies>,
    /// Size of each constraint's reaction [N].
    pub reactions: Vec<Vec<f64>>,
    /// Volume [m³] and pressure [Pa] of each constraint of volume, one instant after the other.
    pub enclosed: Vec<[f64; 2]>,
}

impl History {
    pub fn sample(&mut self, frames: &[Frame<'_>]) {
        self.times.push(time_of(frames));
        self.energies.push(Energies::total(frames.iter().map(|frame| frame.now.energies())));
        let size = |force: [f64; 3]| force.iter().map(|f| f * f).sum::<f64>().sqrt();
        self.reactions.push(frames.iter().flat_map(Frame::reactions).map(size).collect());
        for frame in frames {
            let constraints = frame.part.built.model.constraints.iter().enumerate();
            for (index, _) in constraints.filter(|(_, constraint)| constraint.motion.encloses()) {
                let Enclosed { volume, pressure } = frame.now.enclosed(index).unwrap_or_default();
                self.enclosed.push([volume, pressure]);
            }
        }
    }
}

/// The worst that was seen of a participant so far.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Watched {
    pub worst_balance: f64,
    /// The largest hourglass energy over the internal one, and its time [s].
    pub worst_hourglass: (f64, f64),
    /// Largest strains of shells.
    pub strains: ShellStrains,
    /// Intersections of explicit bodies.
    pub intersections: Intersections,
    /// Changes of volume of solids, and compression of membranes.
    pub solids: SolidStrains,
}

/// Edges of bodies that go through triangles of others, in the states that outputs have written and in the
/// last one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Intersections {
    /// Number of intersections, counted in each state.
    #[serde(deserialize_with = "count::read")]
    pub count: u64,
    /// States that were searched.
    #[serde(deserialize_with = "count::read")]
    pub searched: u64,
    /// States with some.
    #[serde(deserialize_with = "count::read")]
    pub states: u64,
    /// The largest depth [m].
    pub deepest: f64,
    /// Time of the deepest one [s].
    pub time: f64,
    /// Place of the deepest one [m].
    pub at: [f64; 3],
    /// Contact of the deepest one.
    pub contact: String,
}

impl Intersections {
    /// Looks at an instant of a participant.
    pub(crate) fn look(&mut self, check: &IntersectionCheck, part: &PlannedParticipant, now: &dyn Instant) {
        let rest = &part.built.model.rest;
        let place =
            |node: u32| Vector3::from(rest[node as usize]) + Vector3::from(now.displacement(node as usize));
        let before = self.count;
        self.searched += 1;
        check.find(place, |found| {
            self.count += 1;
            if found.depth > self.deepest {
                (self.deepest, self.time, self.at) = (found.depth, now.time(), found.place);
                let contacts = part.built.contacts.as_deref();
                self.contact = contacts
                    .map_or_else(String::new, |contacts| contacts.contacts[found.contact].name.clone());
            }
        });
        self.states += u64::from(self.count > before);
    }

    /// Joins this result with another participant's.
    pub(crate) fn with(self, other: Self) -> Self {
        let [count, searched, states] =
            [self.count + other.count, self.searched + other.searched, self.states + other.states];
        let deepest = if other.deepest > self.deepest { other } else { self };
        Self { count, searched, states, ..deepest }
    }

    /// Returns the warning to the user; `None` without intersections.
    pub(crate) fn doubt(&self) -> Option<String> {
        let Self { count, searched, states, deepest, time, at, contact } = self;
        (*count > 0).then(|| {
            format!(
                "contact `{contact}`: {} of edges with triangles in {states} of {}, up to {} m deep at t = {} s at ({}) m; \
                 take a larger `thickness`, smaller elements, or `solver = \"implicit\"`, whose barriers exclude them",
                counted(*count as usize, "intersection"),
                counted(*searched as usize, "searched state"),
                number(*deepest),
                number(*time),
                at.map(number).join(", ")
            )
        })
    }
}

impl Watched {
    pub fn see(&mut self, part: &PlannedParticipant, participant: &dyn Instant) {
        if participant.largest_energy() > participant.balance_floor() {
            self.worst_balance = self.worst_balance.max(participant.energies().balance);
        }
        if let Some(share) = hourglass_share(part, participant, self.worst_hourglass.0) {
            self.worst_hourglass = (share, participant.time());
        }
    }
}

/// Hourglass energy over internal energy, if it is above a share; none while both together are below the
/// energy from which on they mean something. A vibrating body has no internal energy at times, so a hundredth
/// of the largest energy counts as internal at least.
fn hourglass_share(part: &PlannedParticipant, participant: &dyn Instant, above: f64) -> Option<f64> {
    let Energies { internal, hourglass, .. } = participant.energies();
    let share = hourglass / internal.max(0.01 * participant.largest_energy()).max(f64::MIN_POSITIVE);
    let floor = participant.balance_floor();
    let means = || {
        let least = model_balance_floor::<f64>(&part.built.model);
        internal + hourglass > if floor.is_finite() { floor.max(least) } else { least }
    };
    (share > above && means()).then_some(share)
}
