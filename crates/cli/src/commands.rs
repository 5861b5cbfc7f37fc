//! What each subcommand does.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use pliant_geometry::io::{self, MeshFile};
use pliant_geometry::{Mesh, QualityReport, Spread, Vector3, diagnose};
use pliant_scene::diagnostic::SceneErrors;
use pliant_scene::source::{Source, Value};
use pliant_scene::{Built, OutputFolder, Plan, Scene, niftysim, number, reference, registry};
use serde_json::{Map, Value as Json, json};
use tempfile::TempDir;

use crate::arguments::{Check, Command, Info, Overrides, Precision, Run};
use crate::report::{self, Bar, Failure, say};

pub fn execute(command: Command) -> Result<ExitCode, Failure> {
    match command {
        Command::Run(arguments) => run(&arguments),
        Command::Check(arguments) => check(&arguments),
        Command::New { name } => new(&name),
        Command::Schema { markdown } => {
            if markdown {
                say(reference::page(&registry::sections()).trim_end())?;
            } else {
                say(format_args!("{:#}", registry::scene_schema()))?;
            }
            Ok(ExitCode::SUCCESS)
        }
        Command::Info(arguments) => info(&arguments),
        Command::Import { model, out } => import(&model, &out),
    }
}

/// Reads, builds and plans a scene; doubts go to standard error.
fn prepare(path: &Path, overrides: &Overrides) -> Result<(Scene, Built, Plan), Failure> {
    let (mut source, folder, _translated) = open(path)?;
    let mut mistakes = Vec::new();
    let precision = overrides.precision.map(|precision| match precision {
        Precision::Single => "single",
        Precision::Double => "double",
    });
    let settings = [
        (["scene", "until"], overrides.until.map(Value::from)),
        (["run", "step"], overrides.step.map(Value::from)),
        (["run", "threads"], overrides.threads.map(Value::from)),
        (["run", "precision"], precision.map(Value::from)),
    ];
    for (path, value) in settings {
        if let Some(value) = value
            && let Err(mistake) = source.set(&path, value)
        {
            mistakes.push(*mistake);
        }
    }
    if !mistakes.is_empty() {
        return Err(source.errors(mistakes).into());
    }
    let scene = Scene::from_source(source, folder)?;
    let built = pliant_scene::build(&scene)?;
    if !built.warnings.is_empty() {
        report::show(&scene.source.errors(built.warnings.clone()));
    }
    let plan = in_pool(&scene, || pliant_scene::plan(&scene, &built))?;
    Ok((scene, built, plan))
}

/// Reads the text of a scene. A NiftySim model is translated first, into a folder that lasts as long as the last value.
fn open(path: &Path) -> Result<(Source, PathBuf, Option<TempDir>), Failure> {
    if !path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("xml")) {
        let (source, folder) = pliant_scene::open(path)?;
        return Ok((source, folder, None));
    }
    let folder = tempfile::tempdir().map_err(|error| {
        Failure::plain(
            format!("no temporary folder can be made: {error}"),
            "check the free space, or set TMPDIR",
        )
    })?;
    let notes = translate(path, &folder.path().join("scene.toml"))?;
    notes.iter().for_each(|note| eprintln!("note: {note}"));
    let (source, place) = pliant_scene::open(folder.path())?;
    Ok((source, place, Some(folder)))
}

/// Writes a NiftySim model as a scene file with its meshes beside it; returns what is worth knowing.
fn translate(model: &Path, file: &Path) -> Result<Vec<String>, Failure> {
    let imported = niftysim::import(model).map_err(|error| Failure::plain(error, ""))?;
    let folder = file.parent().unwrap_or(Path::new(""));
    let meshes = imported.meshes.iter().map(|(name, mesh)| (folder.join(name), mesh));
    if let Some(taken) =
        meshes.clone().map(|(path, _)| path).chain([file.to_owned()]).find(|path| path.exists())
    {
        return Err(Failure::plain(format!("`{}` exists already", taken.display()), "choose another name"));
    }
    let unwritable = |error: &dyn std::fmt::Display| {
        let help = "check the folder, its permissions and the free space, or choose another name";
        Failure::plain(format!("`{}` cannot be written: {error}", folder.display()), help)
    };
    if !folder.as_os_str().is_empty() {
        fs::create_dir_all(folder).map_err(|error| unwritable(&error))?;
    }
    for (path, mesh) in meshes {
        io::write(&path, mesh).map_err(|error| unwritable(&error))?;
    }
    fs::write(file, &imported.scene).map_err(|error| unwritable(&error))?;
    Ok(imported.notes)
}

/// Runs something on the scene's number of threads.
fn in_pool<T: Send>(
    scene: &Scene,
    work: impl FnOnce() -> Result<T, SceneErrors> + Send,
) -> Result<T, Failure> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(scene.run.threads as usize).build();
    let pool = pool.map_err(|error| Failure::plain(error, "try fewer `threads`"))?;
    Ok(pool.install(work)?)
}

fn run(arguments: &Run) -> Result<ExitCode, Failure> {
    let (scene, built, plan) = prepare(&arguments.scene, &arguments.overrides)?;
    let file = pliant_scene::scene_file(&arguments.scene);
    let path = arguments.out.clone().unwrap_or_else(|| OutputFolder::default_for(&file));
    let folder = OutputFolder::prepare(path, &scene, arguments.force)
        .map_err(|error| Failure::plain(&error, error.remedy))?;
    for note in built.notes.iter().chain(&plan.note) {
        eprintln!("note: {note}");
    }
    let bar = Bar::new();
    let result = pliant_scene::run(&scene, &built, &plan, &folder, &mut |progress| bar.update(progress));
    bar.finish();
    let (failure, json) = match result {
        Ok(summary) => {
            if !arguments.json {
                say(report::result(&summary))?;
            }
            for warning in &summary.warnings {
                eprintln!("warning: {warning}");
            }
            (summary.error.as_ref().map(|error| error.message.clone()), json!(summary))
        }
        Err(error) => (Some(format!("{error}; {}", error.remedy)), pliant_scene::failed_output(&error)),
    };
    if arguments.json {
        say(json)?;
    }
    match failure {
        None => Ok(ExitCode::SUCCESS),
        Some(message) => {
            eprintln!("error: {message}");
            Ok(ExitCode::from(1))
        }
    }
}

fn check(arguments: &Check) -> Result<ExitCode, Failure> {
    let (scene, built, plan) = prepare(&arguments.scene, &arguments.overrides)?;
    say(pliant_scene::overview(&scene, &built, &plan).trim_end())?;
    Ok(ExitCode::SUCCESS)
}

fn new(name: &Path) -> Result<ExitCode, Failure> {
    let file = name.join("scene.toml");
    if file.exists() {
        return Err(Failure::plain(format!("`{}` exists already", file.display()), "choose another name"));
    }
    let title = name.file_name().unwrap_or(name.as_os_str()).to_string_lossy();
    fs::create_dir_all(name).and_then(|()| fs::write(&file, pliant_scene::starter(&title))).map_err(
        |error| {
            let help = "check the folder, its permissions and the free space, or choose another name";
            Failure::plain(format!("`{}` cannot be written: {error}", file.display()), help)
        },
    )?;
    say(format_args!("wrote {}; try: pliant run {}", file.display(), name.display()))?;
    Ok(ExitCode::SUCCESS)
}

fn import(model: &Path, out: &Path) -> Result<ExitCode, Failure> {
    let is_file = out.extension().is_some_and(|ending| ending == "toml");
    let file = if is_file { out.to_owned() } else { out.join("scene.toml") };
    for note in translate(model, &file)? {
        eprintln!("note: {note}");
    }
    say(format_args!("wrote {}; try: pliant run {}", file.display(), out.display()))?;
    Ok(ExitCode::SUCCESS)
}

fn info(arguments: &Info) -> Result<ExitCode, Failure> {
    if !(arguments.scale > 0.0 && arguments.scale.is_finite()) {
        let message = format!("`--scale` must be greater than 0, found {}", arguments.scale);
        return Err(Failure::plain(message, "0.001 for millimetres"));
    }
    let mut file = io::read(&arguments.mesh).map_err(|error| Failure::plain(error, ""))?;
    file.mesh.points.iter_mut().for_each(|point| *point *= arguments.scale);
    if arguments.json {
        say(info_object(&file))?;
    } else {
        say(format_args!("{}: {}", arguments.mesh.display(), info_page(&file)))?;
    }
    if let Some(target) = &arguments.convert {
        io::write(target, &file.mesh).map_err(|error| Failure::plain(error, ""))?;
        eprintln!("wrote {}", target.display());
    }
    Ok(ExitCode::SUCCESS)
}

/// The named sets of a mesh with their numbers of nodes.
fn sets(mesh: &Mesh) -> impl Iterator<Item = (&str, usize)> {
    mesh.set_names().into_iter().map(|name| (name, mesh.set_points(name).map_or(0, |set| set.len())))
}

fn info_object(MeshFile { mesh, format, notes, .. }: &MeshFile) -> Json {
    let (quality, found) = (QualityReport::new(mesh), diagnose(mesh));
    let cells: Map<_, _> =
        quality.cells.iter().map(|(kind, count)| (kind.name().to_owned(), json!(count))).collect();
    let sets: Map<_, _> = sets(mesh).map(|(name, count)| (name.to_owned(), json!(count))).collect();
    let spread = |s: Spread| json!({ "min": s.min, "median": s.median, "max": s.max });
    json!({
        "format": format,
        "nodes": quality.nodes,
        "cells": cells,
        "bounds": mesh.bounds().map(|(low, high)| [<[f64; 3]>::from(low), <[f64; 3]>::from(high)]),
        "volume": quality.volume,
        "acoustic_length": quality.acoustic_length.map(spread),
        "edge_length": quality.edge_length.map(spread),
        "dihedral": quality.dihedral,
        "scaled_jacobian": quality.scaled_jacobian,
        "sets": sets,
        "usable": found.is_usable(),
        "problems": found.to_string(),
        "notes": notes,
    })
}

fn info_page(MeshFile { mesh, format, notes, .. }: &MeshFile) -> String {
    let mut lines = vec![format.clone()];
    if let Some((low, high)) = mesh.bounds() {
        let at = |p: Vector3| format!("({}, {}, {})", number(p.x), number(p.y), number(p.z));
        lines.push(format!("from {} to {} m", at(low), at(high)));
    }
    lines.push(QualityReport::new(mesh).to_string().trim_end().to_owned());
    lines.extend(sets(mesh).map(|(name, count)| format!("set `{name}`: {count} nodes")));
    lines.extend(mesh.point_data.keys().map(|name| format!("point data `{name}`")));
    for block in &mesh.blocks {
        let kind = block.kind.name();
        lines.extend(block.data.keys().map(|name| format!("cell data `{name}` of {kind} cells")));
    }
    lines.extend(notes.iter().map(|note| format!("note: {note}")));
    lines.push(diagnose(mesh).to_string().trim_end().to_owned());
    lines.join("\n")
}
