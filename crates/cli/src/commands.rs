//! What each subcommand does.

use std::fs;
use std::path::Path;
use std::process::ExitCode;

use pliant_geometry::io::{self, MeshFile};
use pliant_geometry::{QualityReport, diagnose};
use pliant_scene::diagnostic::SceneErrors;
use pliant_scene::source::Value;
use pliant_scene::{Built, OutputFolder, Plan, Scene, reference, registry};
use serde_json::json;

use crate::arguments::{Check, Command, Info, Overrides, Precision, Run};
use crate::report::{self, Bar, Failure};

pub fn execute(command: Command) -> Result<ExitCode, Failure> {
    match command {
        Command::Run(arguments) => run(&arguments),
        Command::Check(arguments) => check(&arguments),
        Command::New { name } => new(&name),
        Command::Schema { markdown } => {
            if markdown {
                print!("{}", reference::page(&registry::sections()));
            } else {
                println!("{:#}", registry::scene_schema());
            }
            Ok(ExitCode::SUCCESS)
        }
        Command::Info(arguments) => info(&arguments),
    }
}

/// Reads, builds and plans a scene; doubts go to standard error.
fn prepare(path: &Path, overrides: &Overrides) -> Result<(Scene, Built, Plan), Failure> {
    let (mut source, folder) = pliant_scene::open(path)?;
    let mut mistakes = Vec::new();
    let precision = overrides.precision.map(|precision| match precision {
        Precision::Single => "single",
        Precision::Double => "double",
    });
    let settings = [
        (["scene", "until"], overrides.until.map(Value::from)),
        (["run", "step"], overrides.step.map(Value::from)),
        (["run", "threads"], overrides.threads.map(|n| Value::from(i64::from(n)))),
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
    let folder =
        OutputFolder::prepare(path, &scene, arguments.force).map_err(|error| Failure::plain(error, ""))?;
    for note in built.notes.iter().chain(&plan.note) {
        eprintln!("note: {note}");
    }
    let bar = Bar::new();
    let result = pliant_scene::run(&scene, &built, &plan, &folder, &mut |progress| bar.update(progress));
    bar.finish();
    let summary = match result {
        Ok(summary) => summary,
        Err(error) => {
            eprintln!("error: {error}");
            if arguments.json {
                println!("{}", pliant_scene::failed_output(&error));
            }
            return Ok(ExitCode::from(1));
        }
    };
    if let Some(failure) = &summary.error {
        eprintln!("error: {}", failure.message);
    }
    if arguments.json {
        println!("{}", json!(summary));
    } else {
        report::result(&summary);
    }
    Ok(if summary.error.is_none() { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

fn check(arguments: &Check) -> Result<ExitCode, Failure> {
    let (scene, built, plan) = prepare(&arguments.scene, &arguments.overrides)?;
    print!("{}", pliant_scene::overview(&scene, &built, &plan));
    Ok(ExitCode::SUCCESS)
}

fn new(name: &Path) -> Result<ExitCode, Failure> {
    let file = name.join("scene.toml");
    if file.exists() {
        return Err(Failure::plain(format!("`{}` exists already", file.display()), "choose another name"));
    }
    let title = name.file_name().unwrap_or(name.as_os_str()).to_string_lossy();
    fs::create_dir_all(name)
        .and_then(|()| fs::write(&file, pliant_scene::starter(&title)))
        .map_err(|error| Failure::plain(format!("`{}` cannot be written: {error}", file.display()), ""))?;
    println!("wrote {}; try: pliant run {}", file.display(), name.display());
    Ok(ExitCode::SUCCESS)
}

fn info(arguments: &Info) -> Result<ExitCode, Failure> {
    if !(arguments.scale > 0.0 && arguments.scale.is_finite()) {
        let message = format!("`--scale` must be greater than 0, found {}", arguments.scale);
        return Err(Failure::plain(message, "0.001 for millimetres"));
    }
    let read = io::read(&arguments.mesh).map_err(|error| Failure::plain(error, ""))?;
    let MeshFile { mut mesh, format, notes, .. } = read;
    mesh.points.iter_mut().for_each(|point| *point *= arguments.scale);
    let (quality, found) = (QualityReport::new(&mesh), diagnose(&mesh));
    let sets: Vec<(&str, usize)> = mesh
        .set_names()
        .into_iter()
        .map(|name| (name, mesh.set_points(name).map_or(0, |set| set.len())))
        .collect();
    if arguments.json {
        let cells: serde_json::Map<_, _> =
            quality.cells.iter().map(|(kind, count)| (kind.name().to_owned(), json!(count))).collect();
        let spread = |s: pliant_geometry::Spread| json!({ "min": s.min, "median": s.median, "max": s.max });
        println!(
            "{}",
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
                "sets": sets.iter().map(|(name, count)| (name.to_string(), json!(count))).collect::<serde_json::Map<_, _>>(),
                "usable": found.is_usable(),
                "problems": found.to_string(),
                "notes": notes,
            })
        );
    } else {
        println!("{}: {format}", arguments.mesh.display());
        if let Some((low, high)) = mesh.bounds() {
            println!("from ({}, {}, {}) to ({}, {}, {}) m", low.x, low.y, low.z, high.x, high.y, high.z);
        }
        println!("{quality}");
        for (name, count) in sets {
            println!("set `{name}`: {count} nodes");
        }
        for name in mesh.point_data.keys() {
            println!("point data `{name}`");
        }
        for block in &mesh.blocks {
            for name in block.data.keys() {
                println!("cell data `{name}` of {} cells", block.kind.name());
            }
        }
        for note in notes {
            println!("note: {note}");
        }
        println!("{found}");
    }
    if let Some(target) = &arguments.convert {
        io::write(target, &mesh).map_err(|error| Failure::plain(error, ""))?;
        eprintln!("wrote {}", target.display());
    }
    Ok(ExitCode::SUCCESS)
}
