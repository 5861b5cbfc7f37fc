//! The subcommands.

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use pliant_format::diagnostic::Diagnostic;
use pliant_format::{Reads, Scene, reference, registry};
use pliant_geometry::words::number;
use pliant_gpu::{Adapter, GpuError};
use pliant_run::{Checkpoint, Draw, Options, OutputFolder, Sweep, SweepOptions, SweepPart};
use pliant_scene::World;
use serde_json::{Value as Json, json};

use crate::SUCCESS;
use crate::arguments::{self, Check, Command, Moved, Run};
use crate::haptics::haptics;
use crate::info::info;
use crate::mesh;
use crate::pictures;
use crate::prepare::{Opened, mesh_cache, open, prepare, translate};
use crate::report::{self, Bar, Failure, say};
use crate::signals;

pub fn execute(command: Command) -> Result<u8, Failure> {
    match command {
        Command::Run(arguments) => run(&arguments),
        Command::Sweep(arguments) => sweep(&arguments),
        Command::Check(arguments) => check(&arguments),
        Command::New { name } => new(&name),
        Command::Schema { markdown, python, commands } => {
            let sections = registry::sections();
            match (markdown, python, commands) {
                (true, ..) => say(reference::page(&sections).trim_end())?,
                (_, true, _) => say(reference::python(&sections).trim_end())?,
                (.., true) => say(arguments::page().trim_end())?,
                _ => say(format_args!("{:#}", registry::scene_schema()))?,
            }
            Ok(SUCCESS)
        }
        Command::Info(arguments) => info(&arguments),
        Command::Labels(arguments) => mesh::labels(&arguments),
        Command::Mesh(arguments) => mesh::mesh(&arguments),
        Command::Import { model, out, allow_partial } => import(&model, &out, allow_partial),
        Command::Reproduce(arguments) => Err(moved("reproduce", &arguments)),
        Command::Bench(arguments) => Err(moved("bench", &arguments)),
        Command::View(arguments) => pictures::view(&arguments),
        Command::Render(arguments) => pictures::render(&arguments),
        Command::Haptics(arguments) => haptics(&arguments),
        Command::Devices { json } => devices(json),
    }
}

/// A command that the laboratory has now, with the one to type.
fn moved(command: &str, arguments: &Moved) -> Failure {
    let words = [&[command.to_owned()][..], &arguments.words].concat().join(" ");
    let help = format!("in a checkout of Pliant type `cargo run --release -p pliant-lab -- {words}`");
    Failure::plain(format!("`{command}` is a command of `pliant-lab`"), help)
}

/// The folder of a run that starts at rest.
fn fresh_folder(arguments: &Run, scene: &Scene) -> Result<OutputFolder, Failure> {
    let file = pliant_format::scene_file(&arguments.scene);
    let path = arguments.out.clone().unwrap_or_else(|| OutputFolder::default_for(&file));
    OutputFolder::prepare(path, scene, arguments.force).map_err(|error| Failure::plain(&error, error.remedy))
}

fn run(arguments: &Run) -> Result<u8, Failure> {
    let checkpoint = arguments.resume.as_deref().map(Checkpoint::read).transpose()?;
    let mut world = prepare(&arguments.scene, &arguments.overrides)?;
    if let Some(checkpoint) = &checkpoint {
        world = checkpoint.continues(&world)?;
    }
    if !arguments.long {
        let before = checkpoint.as_ref().map_or(0.0, Checkpoint::time);
        refuse_very_long(&world, before)?;
    }
    let folder = match &checkpoint {
        Some(checkpoint) => {
            let parent = checkpoint.path().parent().unwrap_or(Path::new(""));
            let path = arguments.out.clone().unwrap_or_else(|| parent.to_owned());
            OutputFolder::reopen(path, &world.scene, checkpoint)?
        }
        None => fresh_folder(arguments, &world.scene)?,
    };
    for note in world.notes() {
        eprintln!("note: {note}");
    }
    let picture = arguments.picture.then(|| pictures::FinalPicture::new(&world)).transpose()?;
    let bar = Bar::new();
    let options = Options {
        resume: checkpoint.as_ref(),
        stop: Some(signals::stop()),
        picture: picture.as_ref().map(|picture| picture as &dyn Draw),
    };
    let mut report = |progress| bar.update(progress);
    let result = pliant_run::run_with(&world, &folder, options, &mut report);
    bar.finish();
    let interrupted = matches!(&result, Ok(summary) if summary.status == "interrupted");
    let (words, failure, json) = match result {
        Ok(summary) => {
            summary.warnings.iter().for_each(|warning| eprintln!("warning: {warning}"));
            let message = summary.error.as_ref().map(|error| error.message.clone());
            (report::result(&summary), message, json!(summary))
        }
        Err(error) => {
            (String::new(), Some(format!("{error}; {}", error.remedy)), pliant_run::failed_output(&error))
        }
    };
    let printed = match arguments.json {
        true => say(json),
        false if words.is_empty() => Ok(()),
        false => say(words),
    };
    if let Some(message) = failure {
        eprintln!("error: {message}");
        // This error matters more than failed standard output.
        return Ok(if interrupted { signals::exit_code() } else { 1 });
    }
    printed.map(|()| SUCCESS)
}

/// A run with fewer steps takes less than a day on any machine.
const FEW_STEPS: f64 = 1e6;
/// Longest run [s] without `--long`.
const A_DAY: f64 = 86_400.0;

/// Rejects a run of more than a day, estimated from its first steps.
fn refuse_very_long(world: &World, before: f64) -> Result<(), Failure> {
    let scene = &world.scene;
    let steps = (scene.scene.until - before) / world.step();
    if steps < FEW_STEPS {
        return Ok(());
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(scene.run.threads as usize).build();
    let pool = pool.map_err(|error| Failure::plain(error, "try fewer `threads`"))?;
    let Some(each) = pool.install(|| seconds_of_a_step(world)) else { return Ok(()) };
    let wall = steps * each;
    if wall < A_DAY {
        return Ok(());
    }
    let [simulated, step] = [scene.scene.until - before, world.step()].map(number);
    let message = format!(
        "the run takes {} steps of {step} s for {simulated} s, about {} on this machine",
        number(steps),
        days(wall)
    );
    let diagnostic = Diagnostic::error(message)
        .at(scene.source.span(&["scene", "until"]), "this long")
        .help("shorten it (`until`), use a coarser mesh, or add `--long` to run it anyway");
    Err(scene.source.errors(vec![diagnostic]).into())
}

/// "12 days", "3 years".
fn days(seconds: f64) -> String {
    let days = seconds / A_DAY;
    if days < 1000.0 { format!("{days:.0} days") } else { format!("{} years", number(days / 365.25)) }
}

/// Wall time [s] of a step, from the first steps; `None` if they fail.
fn seconds_of_a_step(world: &World) -> Option<f64> {
    const ENOUGH: Duration = Duration::from_millis(100);
    let mut simulation = world.simulation().ok()?;
    let (started, mut steps) = (Instant::now(), 0);
    while started.elapsed() < ENOUGH {
        steps += simulation.step(u64::MAX).ok()?;
    }
    Some(started.elapsed().as_secs_f64() / steps as f64)
}

/// Lists the GPUs.
fn devices(json: bool) -> Result<u8, Failure> {
    let found = pliant_gpu::adapters();
    if json {
        let object = |a: &Adapter| {
            json!({
                "name": a.name, "kind": a.kind.to_string(), "backend": a.backend, "driver": a.driver,
                "largest_buffer": a.largest_buffer, "shared_memory": a.shared_memory, "group_size": a.group_size,
                "float_atomics": a.float_atomics, "timestamps": a.timestamps,
            })
        };
        say(Json::Array(found.iter().map(object).collect()))?;
    } else if found.is_empty() {
        say(format_args!("{}; {}", GpuError::NoAdapter, GpuError::NoAdapter.remedy()))?;
    } else {
        say(report::adapters(&found))?;
    }
    Ok(SUCCESS)
}

fn sweep(arguments: &arguments::Sweep) -> Result<u8, Failure> {
    let Opened { source, folder, _translated, .. } = open(&arguments.scene, arguments.sandbox, false)?;
    let sweep = Sweep::new(source, folder, &arguments.set)?.with_cache(mesh_cache(arguments.no_cache));
    let (runs, threads) = (sweep.runs(), arguments.threads.into());
    refuse_mistakes(&sweep, threads)?;
    if arguments.dry_run {
        let lines: Vec<String> = (0..runs).map(|run| format!("run-{run:04}  {}", sweep.title(run))).collect();
        say(lines.join("\n"))?;
        return Ok(SUCCESS);
    }
    let path = arguments.out.clone().unwrap_or_else(|| {
        let mut path = OutputFolder::default_for(&pliant_format::scene_file(&arguments.scene));
        path.as_mut_os_string().push("-sweep");
        path
    });
    if arguments.merge {
        return merge(&sweep, &path);
    }
    if let Some(part) = arguments.part {
        return sweep_part(&sweep, &path, part, threads, arguments.keep_fields);
    }
    let folder =
        sweep.open_folder(path, arguments.force).map_err(|error| Failure::plain(&error, error.remedy))?;
    let bar = Bar::new();
    let options = SweepOptions { threads, keep_fields: arguments.keep_fields, stop: Some(signals::stop()) };
    let result = sweep.run(&folder, options, &|progress| bar.update_sweep(progress, runs));
    bar.finish();
    let summary = match result {
        Ok(summary) => summary,
        Err(error) => {
            eprintln!("error: {error}; {}", error.remedy);
            return Ok(1);
        }
    };
    say(summary.words())?;
    told_failures(&sweep, &summary.failures);
    if summary.interrupted {
        eprintln!("error: the sweep was interrupted; the table contains the finished runs");
        return Ok(signals::exit_code());
    }
    if summary.failures.is_empty() {
        return Ok(SUCCESS);
    }
    eprintln!("error: {} of {runs} runs failed", summary.failures.len());
    Ok(1)
}

/// Runs a part of a sweep.
fn sweep_part(
    sweep: &Sweep,
    folder: &Path,
    part: SweepPart,
    threads: usize,
    keep_fields: bool,
) -> Result<u8, Failure> {
    let options = SweepOptions { threads, keep_fields, stop: Some(signals::stop()) };
    let found = sweep.run_part(folder, part, options, &|_| {});
    let summary = found.map_err(|error| Failure::plain(&error, error.remedy))?;
    let known = if summary.known > 0 { format!(", {} of them before", summary.known) } else { String::new() };
    let failed = summary.failures.len();
    say(format_args!("{} runs{known}, {failed} failed\nwrote {}", summary.runs, summary.rows.display()))?;
    told_failures(sweep, &summary.failures);
    if summary.interrupted {
        eprintln!("error: the part was interrupted; repeat the command to do the missing runs");
        return Ok(signals::exit_code());
    }
    Ok(u8::from(failed > 0))
}

/// Puts the parts of a sweep together.
fn merge(sweep: &Sweep, folder: &Path) -> Result<u8, Failure> {
    let merged = sweep.merge(folder).map_err(|error| Failure::plain(&error, error.remedy))?;
    let there = sweep.runs() - merged.missing.len();
    say(format_args!("{there} of {} runs\nwrote {}", sweep.runs(), merged.table.display()))?;
    told_failures(sweep, &merged.failures);
    for &run in &merged.missing {
        eprintln!("error: run-{run:04} ({}) is missing", sweep.title(run));
    }
    Ok(u8::from(!(merged.missing.is_empty() && merged.failures.is_empty())))
}

fn told_failures(sweep: &Sweep, failures: &[(usize, String)]) {
    for (run, message) in failures {
        eprintln!("error: run-{run:04} ({}): {message}", sweep.title(*run));
    }
}

/// Rejects a sweep with invalid combinations; an error shared by several is reported once.
fn refuse_mistakes(sweep: &Sweep, threads: usize) -> Result<(), Failure> {
    let mistakes = sweep.check(threads);
    let mut reported = Vec::<String>::new();
    for (run, errors) in &mistakes {
        let text = errors.plain().to_string();
        if !reported.contains(&text) {
            eprintln!("run-{run:04} ({}):", sweep.title(*run));
            report::show(errors);
            reported.push(text);
        }
    }
    if mistakes.is_empty() {
        return Ok(());
    }
    let message = format!("{} of {} combinations are invalid; nothing was run", mistakes.len(), sweep.runs());
    Err(Failure::plain(message, "correct the values above, or sweep without them"))
}

fn check(arguments: &Check) -> Result<u8, Failure> {
    let world = prepare(&arguments.scene, &arguments.overrides)?;
    say(pliant_run::overview(&world).trim_end())?;
    Ok(SUCCESS)
}

fn new(name: &Path) -> Result<u8, Failure> {
    let file = name.join("scene.toml");
    if file.exists() {
        return Err(Failure::plain(format!("`{}` exists already", file.display()), "choose another name"));
    }
    let title = name.file_name().unwrap_or(name.as_os_str()).to_string_lossy();
    fs::create_dir_all(name).and_then(|()| fs::write(&file, pliant_format::starter(&title))).map_err(
        |error| {
            let help = "check the folder, its permissions and the free space, or choose another name";
            Failure::plain(format!("`{}` cannot be written: {error}", file.display()), help)
        },
    )?;
    say(format_args!("wrote {}; try: pliant run {}", file.display(), name.display()))?;
    Ok(SUCCESS)
}

fn import(model: &Path, out: &Path, allow_partial: bool) -> Result<u8, Failure> {
    let is_file = out.extension().is_some_and(|ending| ending == "toml");
    let file = if is_file { out.to_owned() } else { out.join("scene.toml") };
    for note in translate(model, &Reads::anywhere(), &file, allow_partial)? {
        eprintln!("note: {note}");
    }
    say(format_args!("wrote {}; try: pliant run {}", file.display(), out.display()))?;
    Ok(SUCCESS)
}
