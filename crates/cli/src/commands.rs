//! The subcommands.

use std::cell::OnceCell;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use pliant_geometry::io;
use pliant_gpu::{Adapter, GpuError};
use pliant_scene::diagnostic::Diagnostic;
use pliant_scene::source::{Source, Value};
use pliant_scene::{
    Checkpoint, Draw, MeshCache, Meshing, Options, OutputFolder, Reads, Scene, Sweep, SweepOptions, World,
    niftysim, reference, registry,
};
use pliant_sim::number;
use serde_json::{Value as Json, json};
use tempfile::TempDir;

use crate::arguments::{self, Check, Command, DeviceName, Overrides, Precision, Run};
use crate::bench::bench;
use crate::info::info;
use crate::mesh;
use crate::pictures;
use crate::report::{self, Bar, Failure, say};
use crate::reproduce::reproduce;
use crate::signals;

pub fn execute(command: Command) -> Result<ExitCode, Failure> {
    match command {
        Command::Run(arguments) => run(&arguments),
        Command::Sweep(arguments) => sweep(&arguments),
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
        Command::Labels(arguments) => mesh::labels(&arguments),
        Command::Mesh(arguments) => mesh::mesh(&arguments),
        Command::Import { model, out, allow_partial } => import(&model, &out, allow_partial),
        Command::Reproduce(arguments) => reproduce(&arguments),
        Command::Bench(arguments) => bench(&arguments),
        Command::View(arguments) => pictures::view(&arguments),
        Command::Render(arguments) => pictures::render(&arguments),
        Command::Devices { json } => devices(json),
    }
}

/// Reads, builds and plans a scene; warnings go to standard error.
pub fn prepare(path: &Path, overrides: &Overrides) -> Result<World, Failure> {
    prepare_changed(path, overrides, |_| {})
}

/// As [`prepare`], for a scene that is changed after reading.
pub fn prepare_changed(
    path: &Path,
    overrides: &Overrides,
    change: impl FnOnce(&mut Scene),
) -> Result<World, Failure> {
    let Opened { mut source, folder, assumed, _translated } =
        open(path, overrides.sandbox, overrides.allow_partial)?;
    let mut mistakes: Vec<_> =
        overrides.set.iter().filter_map(|set| source.assign(set).err()).map(|mistake| *mistake).collect();
    let precision = overrides.precision.map(|precision| match precision {
        Precision::Single => "single",
        Precision::Double => "double",
    });
    let device = overrides.device.map(|device| match device {
        DeviceName::Cpu => "cpu",
        DeviceName::Gpu => "gpu",
        DeviceName::Auto => "auto",
    });
    let settings = [
        (["scene", "until"], overrides.until.map(Value::from)),
        (["run", "step"], overrides.step.map(Value::from)),
        (["run", "threads"], overrides.threads.map(Value::from)),
        (["run", "precision"], precision.map(Value::from)),
        (["run", "device"], device.map(Value::from)),
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
    let mut scene = Scene::from_source(source, folder)?;
    change(&mut scene);
    let mut world = build(&scene, &mesh_cache(overrides.no_cache))?;
    if let Some(assumed) = assumed {
        world.doubt(Diagnostic::warning(assumed));
    }
    let warnings: Vec<Diagnostic> = world.warnings().cloned().collect();
    if !warnings.is_empty() {
        report::show(&scene.source.errors(warnings));
    }
    Ok(world)
}

/// Builds a scene; a bar shows the progress of meshes from images.
fn build(scene: &Scene, cache: &MeshCache) -> Result<World, Failure> {
    let bar: OnceCell<Bar> = OnceCell::new();
    let built = World::assemble(scene, cache, &|meshing| {
        let Meshing { body, part, now } = meshing;
        bar.get_or_init(Bar::new).update_mesh(part, format!("mesh of `{body}`: {now}"));
    });
    if let Some(bar) = bar.get() {
        bar.finish();
    }
    Ok(built?)
}

/// A scene that was read.
struct Opened {
    source: Source,
    folder: PathBuf,
    /// Assumptions about a mesh.
    assumed: Option<String>,
    /// The folder of a translated model, kept alive with this value.
    _translated: Option<TempDir>,
}

/// Reads the text of a scene. A NiftySim model is translated first; a mesh gets a scene of its own. In a sandbox, the scene reads
/// only files in its own folder.
fn open(path: &Path, sandbox: bool, allow_partial: bool) -> Result<Opened, Failure> {
    let reads = |folder: &Path| {
        let reads = if sandbox { Reads::within(folder) } else { Ok(Reads::anywhere()) };
        let failed = |error| format!("the folder `{}` cannot be read: {error}", folder.display());
        reads.map_err(|error| Failure::plain(failed(error), "check the path and the permissions"))
    };
    let file = pliant_scene::scene_file(path);
    let own = reads(file.parent().unwrap_or(Path::new("")))?;
    if pliant_scene::is_mesh(path) {
        let help = "`pliant info` reads a mesh file on its own";
        let made = pliant_scene::scene_of_mesh(path).map_err(|error| Failure::plain(error, help))?;
        let source = Source::parse(path.display().to_string(), made.text)?.reading(own);
        return Ok(Opened { source, folder: made.folder, assumed: Some(made.assumed), _translated: None });
    }
    if !path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("xml")) {
        let (source, folder) = pliant_scene::open_within(path, own)?;
        return Ok(Opened { source, folder, assumed: None, _translated: None });
    }
    let folder = tempfile::tempdir().map_err(|error| {
        Failure::plain(
            format!("cannot make a temporary folder: {error}"),
            "check the free space, or set TMPDIR",
        )
    })?;
    let notes = translate(path, &own, &folder.path().join("scene.toml"), allow_partial)?;
    notes.iter().for_each(|note| eprintln!("note: {note}"));
    let (source, place) = pliant_scene::open_within(folder.path(), reads(folder.path())?)?;
    Ok(Opened { source, folder: place, assumed: None, _translated: Some(folder) })
}

/// Writes a NiftySim model as a scene file with its meshes beside it; returns notes. A model with unsupported parts is rejected
/// unless they may be omitted.
fn translate(model: &Path, reads: &Reads, file: &Path, allow_partial: bool) -> Result<Vec<String>, Failure> {
    let imported = niftysim::import_within(model, reads).map_err(|error| Failure::plain(error, ""))?;
    if !imported.missing.is_empty() && !allow_partial {
        let missing = imported.missing.join("; ");
        let message = format!("`{}` has parts that Pliant does not support: {missing}", model.display());
        let help = "`--allow-partial` of `pliant run` and `pliant import` omits these parts: the results then belong to a \
                    different model";
        return Err(Failure::plain(message, help));
    }
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

/// This user's cache of meshes made from images.
fn mesh_cache(off: bool) -> MeshCache {
    if off { MeshCache::off() } else { MeshCache::of_user() }
}

/// The folder of a run that starts at rest.
fn fresh_folder(arguments: &Run, scene: &Scene) -> Result<OutputFolder, Failure> {
    let file = pliant_scene::scene_file(&arguments.scene);
    let path = arguments.out.clone().unwrap_or_else(|| OutputFolder::default_for(&file));
    OutputFolder::prepare(path, scene, arguments.force).map_err(|error| Failure::plain(&error, error.remedy))
}

fn run(arguments: &Run) -> Result<ExitCode, Failure> {
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
            let own = checkpoint.path().parent().unwrap_or(Path::new(""));
            let path = arguments.out.clone().unwrap_or_else(|| own.to_owned());
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
    let result = pliant_scene::run_with(&world, &folder, options, &mut report);
    bar.finish();
    let interrupted = matches!(&result, Ok(summary) if summary.status == "interrupted");
    let (words, failure, json) = match result {
        Ok(summary) => {
            summary.warnings.iter().for_each(|warning| eprintln!("warning: {warning}"));
            let message = summary.error.as_ref().map(|error| error.message.clone());
            (report::result(&summary), message, json!(summary))
        }
        Err(error) => {
            (String::new(), Some(format!("{error}; {}", error.remedy)), pliant_scene::failed_output(&error))
        }
    };
    let told = match arguments.json {
        true => say(json),
        false if words.is_empty() => Ok(()),
        false => say(words),
    };
    if let Some(message) = failure {
        eprintln!("error: {message}");
        // This error matters more than failed standard output.
        return Ok(ExitCode::from(if interrupted { signals::exit_code() } else { 1 }));
    }
    told.map(|()| ExitCode::SUCCESS)
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
fn devices(json: bool) -> Result<ExitCode, Failure> {
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
    Ok(ExitCode::SUCCESS)
}

fn sweep(arguments: &arguments::Sweep) -> Result<ExitCode, Failure> {
    let Opened { source, folder, _translated, .. } = open(&arguments.scene, arguments.sandbox, false)?;
    let sweep = Sweep::new(source, folder, &arguments.set)?.with_cache(mesh_cache(arguments.no_cache));
    let (runs, threads) = (sweep.runs(), arguments.threads.into());
    refuse_mistakes(&sweep, threads)?;
    if arguments.dry_run {
        let lines: Vec<String> = (0..runs).map(|run| format!("run-{run:04}  {}", sweep.title(run))).collect();
        say(lines.join("\n"))?;
        return Ok(ExitCode::SUCCESS);
    }
    let path = arguments.out.clone().unwrap_or_else(|| {
        let mut path = OutputFolder::default_for(&pliant_scene::scene_file(&arguments.scene));
        path.as_mut_os_string().push("-sweep");
        path
    });
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
            return Ok(ExitCode::from(1));
        }
    };
    say(summary.words())?;
    for (run, message) in &summary.failures {
        eprintln!("error: run-{run:04} ({}): {message}", sweep.title(*run));
    }
    if summary.interrupted {
        eprintln!("error: the sweep was interrupted; the table contains the finished runs");
        return Ok(ExitCode::from(signals::exit_code()));
    }
    if summary.failures.is_empty() {
        return Ok(ExitCode::SUCCESS);
    }
    eprintln!("error: {} of {runs} runs failed", summary.failures.len());
    Ok(ExitCode::from(1))
}

/// Rejects a sweep with invalid combinations; an error shared by several is reported once.
fn refuse_mistakes(sweep: &Sweep, threads: usize) -> Result<(), Failure> {
    let mistakes = sweep.check(threads);
    let mut told = Vec::<String>::new();
    for (run, errors) in &mistakes {
        let text = errors.plain().to_string();
        if !told.contains(&text) {
            eprintln!("run-{run:04} ({}):", sweep.title(*run));
            report::show(errors);
            told.push(text);
        }
    }
    if mistakes.is_empty() {
        return Ok(());
    }
    let message = format!("{} of {} combinations are invalid; nothing was run", mistakes.len(), sweep.runs());
    Err(Failure::plain(message, "correct the values above, or sweep without them"))
}

fn check(arguments: &Check) -> Result<ExitCode, Failure> {
    let world = prepare(&arguments.scene, &arguments.overrides)?;
    say(pliant_scene::overview(&world).trim_end())?;
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

fn import(model: &Path, out: &Path, allow_partial: bool) -> Result<ExitCode, Failure> {
    let is_file = out.extension().is_some_and(|ending| ending == "toml");
    let file = if is_file { out.to_owned() } else { out.join("scene.toml") };
    for note in translate(model, &Reads::anywhere(), &file, allow_partial)? {
        eprintln!("note: {note}");
    }
    say(format_args!("wrote {}; try: pliant run {}", file.display(), out.display()))?;
    Ok(ExitCode::SUCCESS)
}
