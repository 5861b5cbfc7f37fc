//! Report of a run about its critical time step, added mass and hourglass energy.

use std::fmt;

use pliant_explicit::BALANCE_LIMIT;
use pliant_explicit::stability::StepLimit;
use pliant_format::tables::OnUnstableName;
use pliant_geometry::words::{counted, number};
use pliant_mechanics::Energies;
use pliant_scene::{Built, PlannedParticipant, World};
use pliant_sim::{Failure, FailureKind};
use serde::Serialize;

use super::outcome::HeldBack;
use super::{Outcome, PartOutcome};

/// Hourglass energy, as a fraction of the internal one, above which a run gives a warning.
const MUCH_HOURGLASS: f64 = 0.05;

/// The monitored critical time step.
#[derive(Clone, Debug, Serialize)]
pub struct StabilitySummary {
    /// Reaction of the run to a limit below its step.
    pub on_unstable: OnUnstableName,
    /// Number of checks of the limit.
    pub checks: u64,
    /// The smallest limit seen [s]; `None` if it was never checked.
    pub smallest_limit: Option<f64>,
    /// The smallest limit over the running step.
    pub limit_over_step: Option<f64>,
    /// Time of the smallest limit [s].
    pub smallest_at: Option<f64>,
    /// Steps during which the limit was known to be below the whole step.
    pub steps_below: u64,
    /// Number of changes from whole steps to cut ones.
    pub cuts: u32,
    /// Beginning of the first step that was cut [s].
    pub first_cut: Option<f64>,
    /// Beginning of the last step that was cut [s].
    pub last_cut: Option<f64>,
    /// The most parts of a step.
    pub most_substeps: u32,
    /// Steps taken beyond the whole ones.
    pub extra_steps: u64,
    /// Number of times that the run went back after a failed step and halved its steps from there on.
    pub halvings: u32,
    /// True if a node is free to move, so that a limit exists.
    #[serde(skip)]
    limited: bool,
}

impl StabilitySummary {
    pub(crate) fn new(part: &PlannedParticipant, outcome: &PartOutcome) -> Option<Self> {
        let PlannedParticipant { scene, plan, .. } = part;
        let seen = outcome.stability?;
        let of = |value: fn(&StepLimit) -> f64| seen.smallest.as_ref().map(value);
        Some(Self {
            on_unstable: scene.run.on_unstable.unwrap_or_default(),
            checks: seen.checks,
            smallest_limit: of(|look| look.limit),
            limit_over_step: of(|look| look.limit).map(|limit| limit / plan.steps.step),
            smallest_at: of(|look| look.time),
            steps_below: seen.steps_below,
            cuts: seen.cuts,
            first_cut: seen.first_cut,
            last_cut: seen.last_cut,
            most_substeps: seen.most_substeps,
            extra_steps: seen.extra_steps,
            halvings: seen.halvings,
            limited: plan.limits.as_ref().is_some_and(|limits| limits.critical.assembled.step.is_finite()),
        })
    }

    /// Returns the reason why the result may be wrong.
    fn doubt(&self) -> Option<String> {
        let fell = self.limit_over_step.is_some_and(|ratio| ratio < 1.0);
        (fell && self.on_unstable == OnUnstableName::Report)
            .then(|| format!("{self}; take a smaller `step`, or `on-unstable = \"substep\"`"))
    }
}

impl fmt::Display for StabilitySummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.smallest_limit, self.limit_over_step, self.smallest_at) {
            (Some(limit), Some(ratio), Some(time)) => write!(
                f,
                "smallest stable step seen: {} s, {ratio:.2} × the step, at t = {} s",
                number(limit),
                number(time)
            )?,
            _ if self.limited => write!(f, "the run ended before the critical time step was checked")?,
            _ => write!(f, "any step is stable, as no node is free to move")?,
        }
        if let (Some(first), Some(last)) = (self.first_cut, self.last_cut) {
            let [first, last] = [first, last].map(number);
            let times = counted(self.cuts as usize, "time");
            let extra = counted(self.extra_steps as usize, "extra step");
            write!(
                f,
                "; steps were cut {times} between t = {first} s and {last} s, into at most {} parts: {extra}",
                self.most_substeps
            )?;
        } else if self.steps_below > 0 {
            write!(
                f,
                "; the stable step was below the step during {}",
                counted(self.steps_below as usize, "step")
            )?;
        }
        if self.halvings > 0 {
            let times = counted(self.halvings as usize, "time");
            write!(f, "; the run went back {times} after a step that failed, and halved its steps")?;
        }
        Ok(())
    }
}

/// Mass that mass scaling adds.
#[derive(Clone, Debug, Serialize)]
pub struct AddedMass {
    /// In all [kg].
    pub mass: f64,
    /// In percent of the mass of the materials.
    pub percent: f64,
    /// Nodes made heavier.
    pub nodes: usize,
    /// The critical time step without it [s]; `null` if every node is held.
    pub unscaled_critical_step: f64,
}

impl AddedMass {
    pub(crate) fn new(built: &Built) -> Option<Self> {
        let scaling = built.model.mass_scaling.as_ref()?;
        let (mass, whole) = (scaling.total(), built.model.mass.iter().sum::<f64>());
        let percent = mass / whole * 100.0;
        let (nodes, unscaled_critical_step) = (scaling.nodes(), scaling.unscaled_critical_step);
        Some(Self { mass, percent, nodes, unscaled_critical_step })
    }
}

/// Returns what a user should know before trusting a result.
pub(crate) fn doubts(
    built: &Built,
    outcome: &PartOutcome,
    stability: Option<&StabilitySummary>,
) -> Vec<String> {
    let (share, time) = outcome.watched.worst_hourglass;
    let hourglass =
        (share > MUCH_HOURGLASS).then(|| held_by_hourglass(built, share, time, "5 %", HOURGLASS_REMEDY));
    (hourglass.into_iter())
        .chain(stability.and_then(StabilitySummary::doubt))
        .chain(equilibria_doubts(outcome))
        .chain(unstable_equilibria(built, outcome))
        .chain(outcome.watched.strains.doubts())
        .chain(outcome.watched.intersections.doubt())
        .chain(outcome.watched.solids.doubts())
        .chain(outcome.held_back.iter().map(held_back))
        .collect()
}

/// The failure of a run that ended with a larger part of its internal energy in hourglass modes than its
/// scene allows.
pub(crate) fn hourglass_failure(world: &World, outcome: &Outcome) -> Option<Failure> {
    let allowed = world.scene.run.allow_hourglass;
    let (part, share) = (world.participants.iter().zip(&outcome.parts))
        .map(|(part, result)| (part, result.hourglass_share))
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .filter(|(_, share)| *share > allowed)?;
    let most = format!("{} % that `allow-hourglass` of `[run]` allows at the end", number(allowed * 100.0));
    let remedy = format!("{HOURGLASS_REMEDY}; outputs are complete");
    let message = held_by_hourglass(&part.built, share, outcome.time, &most, &remedy);
    Some(Failure::new(FailureKind::Hourglass, message, Some(outcome.time)))
}

/// Warns that hourglass control holds a share of the internal energy at a time [s].
fn held_by_hourglass(built: &Built, share: f64, time: f64, most: &str, remedy: &str) -> String {
    let of = match share < 10.0 {
        true => format!("{:.1} % of the internal energy", share * 100.0),
        false => "more than ten times the internal energy".to_owned(),
    };
    let has_control = |index: usize| {
        built.model.solids.iter().any(|solid| solid.body == index && solid.cells.element() == "hex8")
    };
    let bodies = built.model.bodies.iter().enumerate().filter(|(index, _)| has_control(*index));
    let bodies: Vec<String> = bodies.map(|(_, body)| format!("`{}`", body.name)).collect();
    format!(
        "hourglass control holds {of} at t = {} s, more than {most}: the shape of the elements of {} is not resolved; {remedy}",
        number(time),
        bodies.join(", ")
    )
}

/// Warning of unstable static equilibria. A run with a control has none, since it passes limit points on
/// purpose.
fn unstable_equilibria(built: &Built, outcome: &PartOutcome) -> Option<String> {
    let controlled = built.implicit.as_ref().is_some_and(|part| part.control.is_some());
    let from = outcome.effort.as_ref().filter(|_| !controlled)?.unstable_from?;
    Some(format!(
        "the equilibria from t = {} s on are unstable: the body would buckle or snap there to another shape; give it a small load or a small `initial-displacement` across, or take `solver = \"implicit\"`",
        number(from)
    ))
}

/// Warns that a tool, moved nodes or a volume were held back, with the longest lag and its time.
fn held_back(HeldBack { name, is_volume, lag, time }: &HeldBack) -> String {
    let [lag, time] = [*lag, *time].map(number);
    match is_volume {
        false => format!(
            "`{name}` was held back by its `force-limit`: it was up to {lag} m behind its trajectory, at t = {time} s"
        ),
        true => format!(
            "`{name}` was held back by its `pressure-limit`: its volume was up to {lag} m³ off its curve, at t = {time} s"
        ),
    }
}

/// Estimated error of displacements, over the largest one, above which equilibria give a warning.
const MUCH_ERROR: f64 = 1e-3;

/// Warnings about equilibria.
fn equilibria_doubts(outcome: &PartOutcome) -> impl Iterator<Item = String> {
    let Energies { internal, hourglass, external, .. } = outcome.energies;
    let largest = internal.abs().max(external.abs());
    let displacement = outcome.equilibria.filter(|found| found.displacement_error > MUCH_ERROR).map(|found| {
        format!(
            "the displacements of the equilibria are off by about {:.1} %: take a smaller `tolerance`, and in single precision also \
             `precision = \"double\"`",
            found.displacement_error * 100.0
        )
    });
    let lost = outcome.equilibria.and_then(|found| found.external_error).and_then(|error| {
        let missing = (internal + hourglass - external).abs() - error.abs();
        (missing > BALANCE_LIMIT * largest).then(|| {
            format!(
                "{:.1} % of the energy is missing between equilibria: the body has snapped from one shape to another, or there are too few \
                 load steps",
                100.0 * missing / largest
            )
        })
    });
    displacement.into_iter().chain(lost)
}

const HOURGLASS_REMEDY: &str =
    "try a finer mesh, `element = \"hex8-full\"`, another `hourglass`, or a load spread over more nodes";
