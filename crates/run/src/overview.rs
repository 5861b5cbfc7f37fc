//! The report of `pliant check`: the model before it runs.

use std::fmt::{self, Write};

use pliant_format::Scene;
use pliant_format::registry::OutputTable;
use pliant_format::tables::{LinearName, PreconditionerName, SolverName};
use pliant_geometry::QualityReport;
use pliant_geometry::words::{counted, number};
use pliant_implicit::bytes_of_factors;
use pliant_linear::memory;
use pliant_mechanics::load::{Load, LoadKind};
use pliant_mechanics::model::{Constraint, Material, Motion, Solid};
use pliant_scene::{Built, BuiltBody, Limits, Plan, World};
use pliant_shells::Facet;
use pliant_sim::contact::touch::With;
use pliant_sim::{BodyCells, Critical, ImplicitBodies};

use crate::output::{AddedMass, BodySummary, bodies, told_limit};

/// The model in words: bodies, quality, constraints, loads, critical step, expected cost.
pub fn overview(world: &World) -> String {
    let mut page = String::new();
    // Writing to a String cannot fail.
    let _ = write_overview(&mut page, world);
    page
}

fn write_overview(page: &mut String, world: &World) -> fmt::Result {
    let scene = &world.scene;
    if !scene.scene.title.is_empty() {
        writeln!(page, "{}\n", scene.scene.title)?;
    }
    for set in scene.source.assignments() {
        writeln!(page, "set on the command line: {set}")?;
    }
    for part in &world.participants {
        if let Some(name) = part.prefix() {
            writeln!(page, "participant `{name}`, solver `{}`\n", part.scene.run.solver.word())?;
        }
        write_model(page, &part.built)?;
        if world.only().is_none() {
            write_step(page, &part.scene, &part.built, &part.plan)?;
            writeln!(page)?;
        }
    }
    write_outputs(page, scene)?;
    match world.only() {
        Some(part) => write_step(page, &part.scene, &part.built, &part.plan)?,
        None => writeln!(page, "common instants every {} s", number(world.slowest().plan.steps.step))?,
    }
    let notes = world.participants.iter().flat_map(|part| &part.built.notes);
    for remark in world.warnings().map(ToString::to_string).chain(notes.cloned()) {
        writeln!(page, "note: {remark}")?;
    }
    Ok(())
}

fn write_model(page: &mut String, built: &Built) -> fmt::Result {
    for (summary, body) in bodies(built).iter().zip(&built.bodies) {
        write_body(page, summary, body, built)?;
    }
    for (surface, mesh) in built.model.surfaces.iter().zip(&built.surfaces) {
        let body = &built.model.bodies[surface.body].name;
        let faces: usize = mesh.blocks.iter().map(|block| block.len()).sum();
        writeln!(
            page,
            "surface `{}` on `{body}`: {} points, {faces} faces",
            surface.name,
            surface.rest.len()
        )?;
    }
    for constraint in &built.model.constraints {
        write_constraint(page, constraint)?;
    }
    for contact in built.contacts.iter().flat_map(|contacts| &contacts.contacts) {
        let thing = match (&contact.with, &built.contacts) {
            (With::Rigid(rigid), Some(contacts)) => format!("`{}`", contacts.rigids[*rigid].name),
            (With::Body(other), _) => format!("{} of another body", counted(other.nodes.len(), "node")),
            _ => "each other".into(),
        };
        let nodes = counted(contact.surface.nodes.len(), "node");
        let friction = number(contact.touch.friction);
        writeln!(page, "contact `{}`: {nodes} with {thing}, friction {friction}", contact.name)?;
    }
    for load in &built.model.loads {
        writeln!(page, "load `{}`: {}", load.name, describe_load(built, load))?;
    }
    if let Some(springs) = built.implicit.as_ref().map(|part| part.model.springs.len()).filter(|&n| n > 0) {
        writeln!(page, "{} to points", counted(springs, "spring"))?;
    }
    Ok(())
}

/// A body: its mesh, its laws, and the quality of its elements.
fn write_body(page: &mut String, summary: &BodySummary, body: &BuiltBody, built: &Built) -> fmt::Result {
    let quality = QualityReport::new(&body.mesh);
    writeln!(page, "body `{}`: {}", body.name, body.origin)?;
    writeln!(page, "  {} nodes, {} elements", summary.nodes, summary.elements)?;
    writeln!(page, "  volume {} m³, mass {} kg", number(summary.volume), number(summary.mass))?;
    let is_own = |solid: &&Solid| built.model.bodies[solid.body].name == body.name;
    for solid in built.model.solids.iter().filter(is_own) {
        let Material { law, prony, .. } = &solid.material;
        let moduli = law.small_strain();
        writeln!(
            page,
            "  {} {} with law {}: shear modulus {} Pa, bulk modulus {} Pa, {}",
            solid.cells.len(),
            solid.cells.element(),
            law.name(),
            number(moduli.shear),
            number(moduli.bulk),
            counted(prony.isochoric.len() + prony.volumetric.len(), "relaxing term"),
        )?;
    }
    if let Some(part) = &built.implicit {
        write_implicit(page, part, &body.name, built)?;
    }
    if let Some([least, most]) = quality.dihedral {
        writeln!(page, "  dihedral angles {least:.1}° to {most:.1}°")?;
    }
    if let Some(jacobian) = quality.scaled_jacobian {
        writeln!(page, "  smallest scaled Jacobian {jacobian:.3}")?;
    }
    if let Some(edge) = quality.edge_length {
        let [min, median, max] = [edge.min, edge.median, edge.max].map(number);
        writeln!(page, "  edges {min} to {max} m, median {median} m")?;
    }
    if quality.acoustic_length.is_some() {
        writeln!(page, "  quality (acoustic length relative to the ideal cell of the same volume):")?;
        quality.histogram_lines().iter().try_for_each(|line| writeln!(page, "    {line}"))?;
    }
    writeln!(page)
}

/// Writes the effect of a constraint, and its number of nodes.
fn write_constraint(page: &mut String, constraint: &Constraint) -> fmt::Result {
    let what = match constraint.motion {
        Motion::Fixed => "fixes",
        Motion::Displacement(..) | Motion::Displacements(..) | Motion::Turn { .. } | Motion::Velocity(..) => {
            "moves"
        }
        Motion::Rotation { .. } => "rotates",
        Motion::Mean { .. } => "moves the mean",
        Motion::Rigid => "keeps the shape,",
        Motion::Volume { .. } => "fills the volume within",
    };
    let (moves, turns) = constraint.components.split_at(3);
    let axes: String = "xyz".chars().zip(moves).filter(|(_, on)| **on).map(|(c, _)| c).collect();
    let rotations: Vec<&str> =
        ["rx", "ry", "rz"].into_iter().zip(turns).filter(|(_, on)| **on).map(|(axis, _)| axis).collect();
    let axes = [axes, rotations.join(" ")].join(" ").trim().to_owned();
    let nodes = counted(constraint.nodes.len(), "node");
    writeln!(page, "constraint `{}`: {what} {axes} of {nodes}", constraint.name)
}

fn write_outputs(page: &mut String, scene: &Scene) -> fmt::Result {
    for (name, table) in &scene.outputs {
        match table {
            OutputTable::Vtu(vtu) => {
                writeln!(page, "output `{name}`: {name}.pvd, a frame every {} s", number(vtu.every))
            }
            OutputTable::Csv(csv) => {
                writeln!(page, "output `{name}`: {name}.csv, a row every {} s", number(csv.every))
            }
        }?;
    }
    Ok(())
}

/// Describes the effect of a load at its full size.
fn describe_load(built: &Built, load: &Load) -> String {
    let vector = |v: [f64; 3]| format!("({})", v.map(number).join(", "));
    match &load.kind {
        LoadKind::Forces(forces) => {
            let sum = forces.iter().fold([0.0; 3], |sum, (_, f)| [0, 1, 2].map(|c| sum[c] + f[c]));
            let mut nodes: Vec<u32> = forces.iter().map(|&(node, _)| node).collect();
            nodes.sort_unstable();
            nodes.dedup();
            let what = if load.surface.is_some() { "carried point" } else { "node" };
            format!("{} N in all on {}", vector(sum), counted(nodes.len(), what))
        }
        LoadKind::Moments(moments) => {
            let sum = moments.iter().fold([0.0; 3], |sum, (_, m)| [0, 1, 2].map(|c| sum[c] + m[c]));
            format!("{} N m in all on {}", vector(sum), counted(moments.len(), "node"))
        }
        LoadKind::ShellPressure { facets, pressure, .. } => {
            format!("{} Pa on {}", number(*pressure), counted(facets.len(), "triangle"))
        }
        LoadKind::Pressure { faces, pressure } => {
            format!("{} Pa on {}", number(*pressure), counted(faces.len(), "face"))
        }
        LoadKind::Gravity { body, acceleration } => {
            format!("{} m/s² on `{}`", vector(*acceleration), built.model.bodies[*body].name)
        }
    }
}

/// Writes number, thickness, area and smallest altitude of the triangles of a shell.
fn write_implicit(page: &mut String, part: &ImplicitBodies, name: &str, built: &Built) -> fmt::Result {
    let body = built.bodies.iter().position(|body| body.name == name).unwrap_or(0);
    match &part.cells[body] {
        BodyCells::Facets(range) => {
            let facets = &part.model.facets[range.start as usize..range.end as usize];
            let least = |of: fn(&Facet) -> f64| facets.iter().map(of).fold(f64::INFINITY, f64::min);
            let most = |of: fn(&Facet) -> f64| facets.iter().map(of).fold(0.0, f64::max);
            let area: f64 = facets.iter().map(|facet| facet.area).sum();
            let [thin, thick] = [least(|f| f.thickness), most(|f| f.thickness)].map(number);
            let thickness = if thin == thick { thin } else { format!("{thin} to {thick}") };
            writeln!(
                page,
                "  {} of a shell, {thickness} m thick, {} m²",
                counted(facets.len(), "triangle"),
                number(area)
            )?;
            writeln!(page, "  smallest altitude {} m", number(least(Facet::altitude)))
        }
        BodyCells::Solids => Ok(()),
    }
}

/// Writes the memory for the factors of the equations where a solver needs them. Warns if they need more
/// memory than is free.
fn write_factors(page: &mut String, scene: &Scene, built: &Built) -> fmt::Result {
    let table = scene.run.linear.table();
    let needs = match table.by {
        LinearName::Direct => true,
        LinearName::ConjugateGradients => table.preconditioner == PreconditionerName::LaggedFactors,
        LinearName::Unsymmetric => false,
    };
    let solves = matches!(scene.run.solver, SolverName::Static | SolverName::Implicit);
    let Some(part) = built.implicit.as_ref().filter(|_| solves && needs) else { return Ok(()) };
    match bytes_of_factors(&part.model) {
        Ok(bytes) => {
            writeln!(
                page,
                "factors of the equations: {} of memory, without contacts",
                memory::in_words(bytes)
            )?;
            if let Some(free) = memory::free().filter(|&free| free < bytes) {
                let free = memory::in_words(free);
                writeln!(
                    page,
                    "warning: only {free} are free: take `linear = {{ by = \"conjugate-gradients\" }}` or a coarser mesh"
                )?;
            }
            Ok(())
        }
        Err(error) => writeln!(page, "warning: {error}"),
    }
}

fn write_step(page: &mut String, scene: &Scene, built: &Built, plan: &Plan) -> fmt::Result {
    let Some(Limits { critical: Critical { bound, assembled: limit }, limiting }) = &plan.limits else {
        let (step, until, solver) =
            (number(plan.steps.step), number(scene.scene.until), scene.run.solver.word());
        let steps = counted(plan.steps.number as usize, "step");
        writeln!(page, "\nsolver `{solver}`: {steps} of {step} s for {until} s")?;
        return write_factors(page, scene, built);
    };
    let seconds = plan.steps.number as f64 * limit.seconds_per_call;
    writeln!(page, "\ncritical time step:")?;
    writeln!(page, "  element bound {} s, set by {limiting}", number(bound.step))?;
    let calls = limit.force_calls;
    writeln!(page, "  assembled     {} ({calls} force calls)", told_limit(limit.step))?;
    writeln!(
        page,
        "  step          {} s, {} steps for {} s",
        number(plan.steps.step),
        plan.steps.number,
        number(scene.scene.until)
    )?;
    if let Some(note) = &plan.note {
        writeln!(page, "  {note}")?;
    }
    if let Some(AddedMass { mass, percent, nodes, unscaled_critical_step }) = AddedMass::new(built) {
        let (mass, nodes) = (number(mass), counted(nodes, "node"));
        let before = told_limit(unscaled_critical_step);
        writeln!(page, "  mass scaling  adds {mass} kg, {percent:.2} %, to {nodes}; without it {before}")?;
    }
    writeln!(
        page,
        "expected cost: about {} s of wall time, real-time factor {} (from one thread's force evaluations, without outputs)",
        number(seconds),
        number(scene.scene.until / seconds.max(f64::MIN_POSITIVE))
    )
}
