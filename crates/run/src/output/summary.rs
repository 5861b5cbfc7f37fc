//! The result of a run: as one JSON object, and as a page to read.

use std::fmt::Write;
use std::path::Path;

use pliant_format::printable;
use pliant_geometry::words::{counted, number};
use pliant_mechanics::Energies;
use pliant_mechanics::model::{Constraint, Enclosed};
use pliant_scene::{Built, LimitingElement, Limits, PlannedParticipant, World};
use pliant_sim::{Critical, Effort, Equilibria, Failure, FailureKind};
use serde::{Serialize, Serializer};
use serde_json::{Value as Json, json};

use super::stability::{AddedMass, StabilitySummary, doubts};
use super::{CoupledSurfaceSummary, History, Intersections, Outcome, PartOutcome, TieSummary};
use super::{OutputError, StrainSummary, VolumeChange, constraints};

/// The result of a run.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// `done`, `failed` or `interrupted`.
    pub status: &'static str,
    /// Reason of the failure.
    pub error: Option<Failure>,
    /// The bodies.
    pub bodies: Vec<BodySummary>,
    /// Number of nodes.
    pub nodes: usize,
    /// Number of elements.
    pub elements: usize,
    /// Mass of the materials [kg].
    pub mass: f64,
    /// Time [s] from one common instant of all participants to the next: the time step, where all bodies go
    /// together.
    pub step: f64,
    /// Smallest element bound of the critical step [s]; `null` of shells and with `implicit` and `static`, as
    /// the two below.
    pub element_bound: Option<f64>,
    /// The critical time step of the assembled model [s].
    pub critical_step: Option<f64>,
    /// The element that sets the bound.
    pub limiting_element: Option<LimitingElement>,
    /// The participants of a scene with several; later fields are then of the first participant that has
    /// them.
    pub participants: Vec<ParticipantSummary>,
    /// The ties between participants.
    pub ties: Vec<TieSummary>,
    /// The contacts between participants.
    pub guests: Vec<CoupledSurfaceSummary>,
    /// Cost of its equations; `null` where none were solved.
    pub solver: Option<Effort>,
    /// Quality of the equilibria of a quasi-static run; `null` for other runs.
    pub equilibria: Option<Equilibria>,
    /// Reason why a path by arc length ended before its last load step; `null` for all other runs.
    pub ended: Option<String>,
    /// The largest strain of each shell, over up to 1000 sampled instants.
    pub shell_strains: Vec<StrainSummary>,
    /// Intersections of explicit bodies in the written states; `null` where none were searched for with
    /// `check-intersections`.
    pub intersections: Option<Intersections>,
    /// The largest change of volume of each nearly incompressible body and of each body with fibres.
    pub volume_changes: Vec<VolumeChange>,
    /// The device: `cpu`, or the name of the GPU.
    pub device: String,
    /// `single` or `double`.
    pub precision: &'static str,
    /// Steps taken.
    pub steps: u64,
    /// Wall time of the steps and their outputs [s].
    pub wall_seconds: f64,
    /// Simulated time over wall time.
    pub real_time_factor: f64,
    /// The monitored critical time step; `null` of a quasi-static run.
    pub stability: Option<StabilitySummary>,
    /// Effect of mass scaling; `null` without it.
    pub added_mass: Option<AddedMass>,
    /// Imbalance of the energies at the end, as a fraction of the largest; `null` of shells and with
    /// `implicit` and `static`.
    pub energy_balance: Option<f64>,
    /// Force [N] of each constraint at the end, by name.
    #[serde(serialize_with = "as_map")]
    pub reactions: Vec<(String, [f64; 3])>,
    /// Volume [m³] and pressure [Pa] of each constraint of volume at the end, by name.
    #[serde(serialize_with = "as_map")]
    pub volumes: Vec<(String, [f64; 2])>,
    /// Warnings to know before trusting the result.
    pub warnings: Vec<String>,
    /// Files written, as paths.
    pub files: Vec<String>,
    /// Simulated time at the end [s].
    #[serde(skip)]
    pub time: f64,
    /// Energies at the end [J].
    #[serde(skip)]
    pub energies: Energies,
}

/// One participant of several.
#[derive(Clone, Debug, Serialize)]
pub struct ParticipantSummary {
    /// Its name.
    pub name: String,
    /// Its bodies.
    pub bodies: Vec<String>,
    /// Its solver, as in a scene file.
    pub solver: &'static str,
    /// Its time step [s].
    pub step: f64,
    /// Its steps.
    pub steps: u64,
    /// `cpu`, or the name of the GPU.
    pub device: String,
    /// `single` or `double`.
    pub precision: &'static str,
    /// Its energies at the end [J].
    pub energies: Energies,
    /// Imbalance of its energies at the end, as a fraction of the largest; `null` where it is not judged.
    pub energy_balance: Option<f64>,
}

impl ParticipantSummary {
    fn new(part: &PlannedParticipant, outcome: &PartOutcome) -> Self {
        Self {
            name: part.name.clone(),
            bodies: part.scene.bodies.iter().map(|(name, _)| name.clone()).collect(),
            solver: part.scene.run.solver.word(),
            step: part.plan.steps.step,
            steps: outcome.steps,
            device: part.plan.target.name().to_owned(),
            precision: part.plan.target.precision.word(),
            energies: outcome.energies,
            energy_balance: outcome.balance(),
        }
    }
}

impl PartOutcome {
    /// Imbalance of the energies at the end; `None` where it is not judged.
    fn balance(&self) -> Option<f64> {
        self.balance_floor.is_finite().then_some(self.energies.balance)
    }
}

/// One body.
#[derive(Clone, Debug, Serialize)]
pub struct BodySummary {
    /// Its name.
    pub name: String,
    /// Its nodes.
    pub nodes: usize,
    /// Its elements.
    pub elements: usize,
    /// Its volume at rest [m³].
    pub volume: f64,
    /// Its mass [kg].
    pub mass: f64,
}

fn as_map<S: Serializer, T: Serialize>(pairs: &[(String, T)], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(pairs.iter().map(|(name, force)| (name, force)))
}

/// The JSON object of a rejected input: the keys of [`Summary`], empty where nothing was built.
pub fn failed_input(message: &str) -> Json {
    empty("invalid", Failure::new(FailureKind::Input, message.into(), None))
}

/// The JSON object of a run whose outputs could not be opened or finished.
pub fn failed_output(error: &OutputError) -> Json {
    empty("failed", output_failure(error, None))
}

fn empty(status: &str, error: Failure) -> Json {
    json!({
        "status": status,
        "error": error,
        "bodies": [], "nodes": null, "elements": null, "mass": null, "step": null, "element_bound": null,
        "critical_step": null, "limiting_element": null, "participants": [], "ties": [], "guests": [], "solver": null, "equilibria": null, "ended": null, "shell_strains": [], "intersections": null, "volume_changes": [], "device": null, "precision": null, "steps": 0, "wall_seconds": 0.0, "real_time_factor": null,
        "stability": null, "added_mass": null, "energy_balance": null, "reactions": {}, "volumes": {}, "warnings": [], "files": [],
    })
}

/// The failure of an output that could not be written, at a time [s] of the run.
pub(crate) fn output_failure(error: &OutputError, time: Option<f64>) -> Failure {
    let message = format!("{error}; what was written before stays readable; {}", error.remedy);
    Failure::new(FailureKind::Output, message, time)
}

/// Makes the failure of a stopped run, with the checkpoint that the run left.
pub(crate) fn interrupted(time: f64, checkpoint: Option<&Path>) -> Failure {
    let way = match checkpoint {
        Some(path) => format!("continue with `--resume {}`", path.display()),
        None => {
            "what was written before stays readable; with `checkpoint = { every = 1.0 }` in `[run]` it could \
                 be resumed"
                .into()
        }
    };
    let message = format!("the run was interrupted at t = {} s; {way}", number(time));
    Failure::new(FailureKind::Interrupted, message, Some(time))
}

/// The bodies of a model.
pub(crate) fn bodies(built: &Built) -> Vec<BodySummary> {
    let of = |index: usize| {
        let body = &built.model.bodies[index];
        let solids = built.model.solids.iter().filter(|solid| solid.body == index);
        let volume = |solid: &pliant_mechanics::model::Solid| -> f64 {
            (0..solid.cells.len()).map(|cell| solid.cells.volume(cell)).sum()
        };
        // Mass of its own cells: its nodes may carry the mass of a wall, too.
        let of_cells = || {
            let mut mass = vec![0.0; built.model.node_count()];
            solids.clone().for_each(|solid| solid.add_mass(&mut mass));
            mass.iter().sum()
        };
        let mass = built.implicit.as_ref().and_then(|part| part.mass(index)).unwrap_or_else(of_cells);
        let (elements, volume) = match built.implicit.as_ref().and_then(|part| part.size(index)) {
            Some(size) => size,
            None => (solids.clone().map(|solid| solid.cells.len()).sum(), solids.clone().map(volume).sum()),
        };
        BodySummary { name: body.name.clone(), nodes: body.all_nodes().count(), elements, volume, mass }
    };
    (0..built.model.bodies.len()).map(of).collect()
}

/// The summary of a run.
pub(crate) fn summarise(world: &World, outcome: &Outcome) -> Summary {
    let parts = || world.participants.iter().zip(&outcome.parts);
    let bodies: Vec<BodySummary> = parts().flat_map(|(part, _)| bodies(&part.built)).collect();
    let limits = parts().find_map(|(part, _)| part.plan.limits.as_ref());
    let stability = || parts().map(|(part, result)| StabilitySummary::new(part, result));
    let doubts = |((part, result), seen): ((&PlannedParticipant, &PartOutcome), Option<StabilitySummary>)| {
        doubts(&part.built, result, seen.as_ref())
    };
    let reactions = parts()
        .flat_map(|(part, result)| part.built.model.constraints.iter().zip(&result.reactions))
        .filter(|(constraint, _)| !constraint.motion.encloses());
    let volumes =
        parts().flat_map(|(part, result)| part.built.model.constraints.iter().zip(&result.enclosed));
    let target = &world.participants[0].plan.target;
    let balances = parts().filter_map(|(_, result)| result.balance());
    Summary {
        status: match &outcome.failure {
            None => "done",
            Some(failure) if failure.is_interrupted() => FailureKind::Interrupted.word(),
            Some(_) => "failed",
        },
        error: outcome.failure.clone(),
        nodes: parts().map(|(part, _)| part.built.model.node_count()).sum(),
        elements: bodies.iter().map(|body| body.elements).sum(),
        mass: parts().map(|(part, _)| part.built.model.mass.iter().sum::<f64>()).sum(),
        bodies,
        step: world.slowest().plan.steps.step,
        element_bound: limits.map(|limits| limits.critical.bound.step),
        critical_step: limits.map(|limits| limits.critical.assembled.step),
        limiting_element: limits.map(|limits| limits.limiting.clone()),
        participants: match world.only() {
            Some(_) => Vec::new(),
            None => parts().map(|(part, result)| ParticipantSummary::new(part, result)).collect(),
        },
        ties: outcome.ties.clone(),
        guests: outcome.guests.clone(),
        solver: parts().find_map(|(_, result)| result.effort.clone()),
        equilibria: parts().find_map(|(_, result)| result.equilibria),
        ended: outcome.ended.clone(),
        shell_strains: parts().flat_map(|(_, result)| result.watched.strains.0.clone()).collect(),
        intersections: parts()
            .filter(|(part, _)| part.built.check_intersections)
            .map(|(_, result)| result.watched.intersections.clone())
            .reduce(Intersections::with),
        volume_changes: parts().flat_map(|(_, result)| result.watched.solids.volumes().cloned()).collect(),
        device: target.name().to_owned(),
        precision: target.precision.word(),
        steps: outcome.steps,
        wall_seconds: outcome.wall_seconds,
        real_time_factor: outcome.time / outcome.wall_seconds.max(f64::MIN_POSITIVE),
        warnings: parts().zip(stability()).flat_map(doubts).collect(),
        stability: stability().flatten().next(),
        added_mass: parts().find_map(|(part, _)| AddedMass::new(&part.built)),
        energy_balance: balances.reduce(f64::max),
        reactions: reactions.map(|(constraint, force)| (constraint.name.clone(), *force)).collect(),
        volumes: volumes
            .filter_map(|(constraint, enclosed)| Some((constraint.name.clone(), (*enclosed)?)))
            .map(|(name, Enclosed { volume, pressure })| (name, [volume, pressure]))
            .collect(),
        files: outcome.files.iter().map(|file| file.display().to_string()).collect(),
        time: outcome.time,
        energies: outcome.energies,
    }
}

/// The page to read.
pub(crate) fn markdown(world: &World, outcome: &Outcome, summary: &Summary) -> String {
    let mut page = String::new();
    // Writing to a String cannot fail.
    let _ = write_page(&mut page, world, outcome, summary);
    // Names and titles come from files that others wrote: no codes for terminals, no HTML.
    printable(&page).replace('<', "&lt;")
}

fn write_page(page: &mut String, world: &World, outcome: &Outcome, summary: &Summary) -> std::fmt::Result {
    let scene = &world.scene;
    let title = if scene.scene.title.is_empty() { "Untitled scene" } else { &scene.scene.title };
    writeln!(page, "# {title}\n")?;
    match &outcome.failure {
        None => {
            writeln!(page, "Done: {} s simulated in {} steps.\n", number(outcome.time), outcome.steps)?;
            if let Some(why) = &outcome.ended {
                writeln!(page, "The run ended before its last step: {why}.\n")?;
            }
        }
        Some(failure) if failure.is_interrupted() => {
            writeln!(page, "**Interrupted**: {}\n", failure.message)?;
        }
        Some(failure) => writeln!(page, "**Failed** ({}): {}\n", failure.kind, failure.message)?,
    }
    if let Some((checkpoint, time)) = &outcome.resumed {
        writeln!(page, "Resumed at t = {} s from `{}`.\n", number(*time), short(checkpoint))?;
    }
    if !scene.source.assignments().is_empty() {
        writeln!(page, "Set on the command line:\n")?;
        scene.source.assignments().iter().try_for_each(|set| writeln!(page, "* `{set}`"))?;
        writeln!(page)?;
    }
    if outcome.picture.is_some() {
        writeln!(page, "![the last instant](picture.png)\n")?;
    }
    writeln!(page, "![forces and energies over time](plot.svg)\n")?;
    writeln!(page, "## Model\n")?;
    writeln!(
        page,
        "| body | mesh | nodes | elements | volume [m³] | mass [kg] |\n|---|---|---|---|---|---|"
    )?;
    let built = world.participants.iter().flat_map(|part| &part.built.bodies);
    for (body, built) in summary.bodies.iter().zip(built) {
        let BodySummary { name, nodes, elements, volume, mass } = body;
        writeln!(
            page,
            "| {name} | {} | {nodes} | {elements} | {} | {} |",
            built.origin,
            number(*volume),
            number(*mass)
        )?;
    }
    for (part, result) in world.participants.iter().zip(&outcome.parts) {
        write_part(page, part, result)?;
    }
    if world.only().is_none() {
        writeln!(page, "\n## Energy of all participants at the end\n\n| | J |\n|---|---|")?;
        write_energy_rows(page, &outcome.energies)?;
    }
    write_reactions(page, world, outcome)?;
    write_volumes(page, &summary.volumes)?;
    write_ties(page, &outcome.ties)?;
    write_coupled_surfaces(page, &outcome.guests)?;
    writeln!(page, "\n## Cost\n\n| | |\n|---|---|")?;
    writeln!(page, "| wall time | {} s |", number(summary.wall_seconds))?;
    writeln!(page, "| real-time factor | {} |", number(summary.real_time_factor))?;
    let work = outcome.steps as f64 * summary.elements as f64;
    writeln!(page, "| per element and step | {} ns |", number(summary.wall_seconds / work.max(1.0) * 1e9))?;
    writeln!(page, "| device | {} |", summary.device)?;
    writeln!(page, "| threads | {} |", outcome.threads)?;
    writeln!(page, "| precision | {} |", summary.precision)?;
    let doubts = summary.warnings.iter().map(|doubt| format!("**Warning:** {doubt}"));
    let remarks: Vec<String> = (doubts.chain(world.warnings().map(ToString::to_string)))
        .chain(world.participants.iter().flat_map(|part| &part.built.notes).cloned())
        .collect();
    if !remarks.is_empty() {
        writeln!(page, "\n## Remarks\n")?;
        remarks.iter().try_for_each(|remark| writeln!(page, "* {remark}"))?;
    }
    writeln!(page, "\n## Files\n")?;
    outcome.files.iter().try_for_each(|file| writeln!(page, "* `{}`", short(file)))
}

/// Steps, equations, strains and energies of a participant.
fn write_part(page: &mut String, part: &PlannedParticipant, outcome: &PartOutcome) -> std::fmt::Result {
    let PlannedParticipant { built, plan, .. } = part;
    let of = part.prefix().map(|name| format!(" of `{name}`")).unwrap_or_default();
    writeln!(page, "\n## Time step{of}\n")?;
    writeln!(page, "| | |\n|---|---|")?;
    if part.prefix().is_some() {
        writeln!(page, "| solver | {} |", part.scene.run.solver.word())?;
    }
    writeln!(page, "| step | {} s |", number(plan.steps.step))?;
    if let Some(Limits { critical: Critical { bound, assembled: limit }, limiting }) = &plan.limits {
        writeln!(page, "| element bound | {} s, set by {limiting} |", number(bound.step))?;
        writeln!(page, "| critical time step (assembled model) | {} |", told_limit(limit.step))?;
    }
    if let Some(AddedMass { mass, percent, nodes, unscaled_critical_step }) = AddedMass::new(built) {
        let (mass, nodes) = (number(mass), counted(nodes, "node"));
        writeln!(page, "| mass added by scaling | {mass} kg, {percent:.2} %, to {nodes} |")?;
        writeln!(page, "| critical time step without it | {} |", told_limit(unscaled_critical_step))?;
    }
    if let Some(note) = &plan.note {
        writeln!(page, "\n{note}.")?;
    }
    if let Some(stability) = StabilitySummary::new(part, outcome) {
        writeln!(page, "\nDuring the run: {stability}.")?;
    }
    if let Some(effort) = &outcome.effort {
        write_effort(page, effort, outcome.steps)?;
    }
    write_strains(page, &outcome.watched.strains.0)?;
    write_volume_changes(page, outcome)?;
    write_energies(page, &of, outcome)
}

fn write_effort(page: &mut String, effort: &Effort, steps: u64) -> std::fmt::Result {
    writeln!(page, "\n## Equations\n\n| | |\n|---|---|")?;
    let per_step = |count: u64| number(count as f64 / steps.max(1) as f64);
    let iterations = effort.newton_iterations;
    writeln!(page, "| iterations of Newton's method | {iterations}, {} per step |", per_step(iterations))?;
    if effort.linear_iterations > 0 {
        let iterations = effort.linear_iterations;
        writeln!(
            page,
            "| iterations of conjugate gradients | {iterations}, {} per step |",
            per_step(iterations)
        )?;
        if effort.left_to_cpu > 0 {
            let part = format!("{} of {}", effort.left_to_cpu, effort.solutions);
            writeln!(page, "| solutions that the GPU left to the CPU | {part} |")?;
        }
        writeln!(
            page,
            "| last residual of conjugate gradients, relative | {} |",
            number(effort.linear_residual)
        )?;
    }
    if let Some(residual) = effort.residual {
        writeln!(page, "| last residual, relative | {} |", number(residual))?;
    }
    writeln!(page, "| steps that were halved | {} |", effort.halved)?;
    if effort.unconverged > 0 {
        writeln!(page, "| accepted steps that did not converge | {} |", effort.unconverged)?;
    }
    let milliseconds = |seconds: f64| number(seconds * 1e3 / steps.max(1) as f64);
    writeln!(page, "| forces and stiffness | {} ms per step |", milliseconds(effort.seconds_cells))?;
    if effort.seconds_contact > 0.0 {
        writeln!(page, "| contact | {} ms per step |", milliseconds(effort.seconds_contact))?;
    }
    writeln!(page, "| factors or preconditioner | {} ms per step |", milliseconds(effort.seconds_factors))?;
    writeln!(page, "| solution | {} ms per step |", milliseconds(effort.seconds_solution))?;
    if let Some(time) = effort.unstable_from {
        writeln!(page, "| unstable equilibria | from t = {} s on |", number(time))?;
    }
    Ok(())
}

fn write_volume_changes(page: &mut String, outcome: &PartOutcome) -> std::fmt::Result {
    let mut changes = outcome.watched.solids.volumes().peekable();
    if changes.peek().is_none() {
        return Ok(());
    }
    writeln!(
        page,
        "\n## Largest changes of volume\n\n| body | J − 1 | element | at t [s] |\n|---|---|---|---|"
    )?;
    for VolumeChange { body, change, element, time } in changes {
        writeln!(page, "| {body} | {:+.2} % | {element} | {} |", 100.0 * change, number(*time))?;
    }
    Ok(())
}

fn write_strains(page: &mut String, strains: &[StrainSummary]) -> std::fmt::Result {
    if strains.is_empty() {
        return Ok(());
    }
    writeln!(
        page,
        "\n## Largest strains of shells\n\n| body | at a surface | there in the middle | triangle | at t [s] |\n|---|---|---|---|---|"
    )?;
    for StrainSummary { body, largest, membrane, element, time, .. } in strains {
        let [largest, membrane] = [largest, membrane].map(|strain| format!("{:.2} %", 100.0 * strain));
        writeln!(page, "| {body} | {largest} | {membrane} | {element} | {} |", number(*time))?;
    }
    Ok(())
}

fn write_energy_rows(page: &mut String, energies: &Energies) -> std::fmt::Result {
    let Energies { kinetic, internal, damping, hourglass, external, step_changes, .. } = *energies;
    for (name, value) in [
        ("external work", external),
        ("internal (stored and viscous)", internal),
        ("kinetic", kinetic),
        ("lost to damping", damping),
        ("hourglass control", hourglass),
        ("added by step changes", step_changes),
    ] {
        writeln!(page, "| {name} | {} |", number(value))?;
    }
    Ok(())
}

fn write_energies(page: &mut String, of: &str, outcome: &PartOutcome) -> std::fmt::Result {
    let Energies { internal, external, balance, .. } = outcome.energies;
    writeln!(page, "\n## Energy{of} at the end\n\n| | J |\n|---|---|")?;
    write_energy_rows(page, &outcome.energies)?;
    if outcome.balance_floor.is_infinite() {
        return writeln!(
            page,
            "\nThe balance is not checked: an implicit step dissipates energy like a damper, and external work is summed by the trapezoidal rule."
        );
    }
    let Some(equilibria) = &outcome.equilibria else {
        return writeln!(
            page,
            "\nBalance: {:.3} % of the largest energy at the end, {:.3} % at worst (checked above {} J).",
            balance * 100.0,
            outcome.watched.worst_balance * 100.0,
            number(outcome.balance_floor)
        );
    };
    let of_largest = |energy: f64| 100.0 * energy / internal.abs().max(external.abs()).max(f64::MIN_POSITIVE);
    let error = match equilibria.external_error {
        Some(error) => {
            let found = equilibria.found;
            format!(
                "Its error with {found} equilibria is about {} J, {:.3} %",
                number(error),
                of_largest(error.abs())
            )
        }
        None => "Its error is unknown, since one load step covers a large part of the way".to_owned(),
    };
    writeln!(
        page,
        "\nInternal and external energy differ by {:.3} % of the largest energy. Internal energy is the energy that laws store and viscoelastic laws \
         have dissipated. External energy is the work of loads, reactions and prescribed motions by the trapezoidal rule over each load step. \
         {error}. More load steps reduce the error, and change neither forces nor displacements of elastic bodies.",
        balance * 100.0
    )
}

fn write_reactions(page: &mut String, world: &World, outcome: &Outcome) -> std::fmt::Result {
    let binds = |constraint: &Constraint| !constraint.motion.encloses();
    if !constraints(world).any(binds) {
        return Ok(());
    }
    writeln!(
        page,
        "\n## Reactions\n\n| constraint | nodes | at the end [N] | largest [N] |\n|---|---|---|---|"
    )?;
    let forces = outcome.parts.iter().flat_map(|part| &part.reactions);
    let pairs = constraints(world).zip(forces).enumerate();
    for (index, (constraint, force)) in pairs.filter(|(_, (constraint, _))| binds(constraint)) {
        let [x, y, z] = force.map(number);
        let nodes = constraint.nodes.len();
        let largest = number(outcome.history.largest_reaction(index));
        writeln!(page, "| {} | {nodes} | ({x}, {y}, {z}) | {largest} |", constraint.name)?;
    }
    Ok(())
}

fn write_volumes(page: &mut String, volumes: &[(String, [f64; 2])]) -> std::fmt::Result {
    if volumes.is_empty() {
        return Ok(());
    }
    writeln!(
        page,
        "\n## Enclosed volumes\n\n| constraint | volume at the end [m³] | pressure at the end [Pa] |\n|---|---|---|"
    )?;
    for (name, [volume, pressure]) in volumes {
        writeln!(page, "| {name} | {} | {} |", number(*volume), number(*pressure))?;
    }
    Ok(())
}

fn write_ties(page: &mut String, ties: &[TieSummary]) -> std::fmt::Result {
    if ties.is_empty() {
        return Ok(());
    }
    writeln!(
        page,
        "\n## Ties between participants\n\n| tie | points | force on the first body [N] | gap [m] | widest gap [m] |\n|---|---|---|---|---|"
    )?;
    for TieSummary { name, points, force, gap, widest, .. } in ties {
        let [x, y, z] = force.map(number);
        writeln!(page, "| {name} | {points} | ({x}, {y}, {z}) | {} | {} |", number(*gap), number(*widest))?;
    }
    writeln!(page, "\nThese ties are springs: they open under load, less with shorter steps.")
}

fn write_coupled_surfaces(page: &mut String, guests: &[CoupledSurfaceSummary]) -> std::fmt::Result {
    if guests.is_empty() {
        return Ok(());
    }
    writeln!(
        page,
        "\n## Contact between participants\n\n| participants | force on each at the end [N] | passes per step | largest difference |\n|---|---|---|---|"
    )?;
    for CoupledSurfaceSummary { participants: [first, second], forces, passes, worst_difference } in guests {
        let [one, other] = forces.map(|force| {
            let [x, y, z] = force.map(number);
            format!("({x}, {y}, {z})")
        });
        let (passes, worst) = (number(*passes), number(100.0 * worst_difference));
        writeln!(page, "| {first}, {second} | {one}, {other} | {passes} | {worst} % |")?;
    }
    writeln!(
        page,
        "\nA step in contact is taken again until the forces on both sides agree to 1 %; the remaining difference acts in the next step."
    )
}

fn short(file: &Path) -> String {
    file.file_name().map_or_else(|| file.display().to_string(), |name| name.to_string_lossy().into_owned())
}

/// The critical time step of the assembled model [s] in words.
pub(crate) fn told_limit(limit: f64) -> String {
    if limit.is_finite() {
        format!("{} s", number(limit))
    } else {
        "none: every node is held or moved as prescribed".into()
    }
}

impl History {
    /// Largest magnitude of a constraint's reaction in the samples [N].
    fn largest_reaction(&self, constraint: usize) -> f64 {
        self.reactions.iter().map(|row| row[constraint]).fold(0.0, f64::max)
    }
}
