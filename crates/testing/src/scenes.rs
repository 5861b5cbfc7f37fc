//! Scenes of tests: texts and mesh files to start from, a temporary folder for them, and the results of
//! checks and runs. Everything happens in this process by calls of the libraries, so only the tests of the
//! binary itself need the binary.

mod said;
mod texts;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use pliant_format::Scene;
use pliant_format::diagnostic::{Diagnostic, MOST_SHOWN, SceneErrors};
use pliant_format::source::Source;
use pliant_geometry::io::{self, MeshFile};
use pliant_run::{
    Checkpoint, Options, OutputFolder, Summary, Sweep, SweepOptions, SweepSummary, failed_input,
    failed_output, overview,
};
use pliant_scene::{MeshCache, World};
use pliant_sim::{FailureKind, Simulation, SimulationState, StopFlag};
use serde_json::{Value, json};
use tempfile::TempDir;

pub use said::Said;
use texts::FROM_NAMES;
pub use texts::{
    BLOCK, CORNERS, FROM_FILE, FROM_IMAGE, HEXES, SHELL, TETS, fibres, labels, resumable, strip, vtk,
};

/// The repository.
pub const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// The scene of a text, or its mistakes.
///
/// # Errors
/// The mistakes in words.
pub fn scene(text: &str) -> Result<Scene, String> {
    let source = Source::parse("scene.toml", text.to_owned()).map_err(|errors| errors.plain().to_string())?;
    Scene::from_source(source, ".".into()).map_err(|errors| errors.plain().to_string())
}

/// The world of a text.
///
/// # Errors
/// The mistakes in words.
pub fn world(text: &str) -> Result<World, String> {
    World::new(&scene(text)?).map_err(|errors| errors.plain().to_string())
}

/// Runs a text into a folder.
#[track_caller]
pub fn run(text: &str, folder: &Path) -> Summary {
    run_world(&world(text).unwrap_or_else(|errors| panic!("{errors}")), folder)
}

/// Runs a world into a folder.
#[track_caller]
pub fn run_world(world: &World, folder: &Path) -> Summary {
    let folder = OutputFolder::prepare(folder.to_owned(), &world.scene, false).unwrap();
    let summary = pliant_run::run(world, &folder, &mut |_| ()).unwrap();
    assert_complete(&summary);
    summary
}

/// Asserts that an error has these words, as shown and as running text, and that the object of the run calls
/// it an input error.
#[track_caller]
pub fn assert_input_error([err, words]: [&str; 2], json: &Value, says: &[&str]) {
    for piece in says {
        assert!(words.contains(piece), "no `{piece}` in:\n{err}");
    }
    assert_eq!(json["status"], "invalid", "{json}");
    assert_eq!(json["error"]["kind"], "input", "{json}");
    assert!(json["error"]["message"].as_str().is_some_and(|message| message.len() > 10), "{json}");
    for key in ["body", "element", "node", "time"] {
        assert!(json["error"][key].is_null(), "{json}");
    }
}

/// Meshes of tests are coarse, so a run may end with much energy in hourglass modes; all its outputs are
/// there.
#[track_caller]
pub(crate) fn assert_complete(summary: &Summary) {
    let is_coarse = summary.error.as_ref().is_some_and(|error| error.kind == FailureKind::Hourglass);
    assert!(summary.status == "done" || is_coarse, "{:?}", summary.error);
}

/// The last row of the table of a run, by the names of its columns.
pub fn last_row(text: &str) -> BTreeMap<String, f64> {
    let out = tempfile::tempdir().unwrap();
    run(text, &out.path().join("out"));
    last_row_in(&out.path().join("out"))
}

/// Compares two rows. Columns whose names contain a word differ by less than the word's limit, relative to
/// the largest of their values in the first row.
#[track_caller]
pub fn assert_rows_agree(what: &str, [one, other]: [&BTreeMap<String, f64>; 2], limits: &[(&str, f64)]) {
    for (word, limit) in limits {
        let of_word = || one.iter().filter(|(name, _)| name.contains(word));
        let largest = of_word().map(|(_, value)| value.abs()).fold(0.0, f64::max);
        let off = of_word().map(|(name, value)| (value - other[name]).abs()).fold(0.0, f64::max);
        println!("{what}: {word} {:.1e} of {largest:e}", off / largest);
        assert!(largest > 0.0 && off < limit * largest, "{what}: {word} {off:e} of {largest:e}");
    }
}

/// The last row of the table in the folder of a run, by the names of its columns.
pub fn last_row_in(folder: &Path) -> BTreeMap<String, f64> {
    let table = fs::read_to_string(folder.join("history.csv")).unwrap();
    let names = table.lines().next().unwrap().split(',').map(str::to_owned);
    names.zip(table.lines().last().unwrap().split(',').map(|value| value.parse().unwrap())).collect()
}

/// Checks that a run of 1 s, cut off at 0.4 s and resumed, writes the same last row as a run without a stop.
/// Snapshots on the way change no bit.
pub fn resumes(text: &str) {
    let whole = world(text).unwrap();
    let half = world(&text.replace("until = 1", "until = 0.4")).unwrap();
    looks_change_nothing(&half);
    let place = tempfile::tempdir().unwrap();
    let [a, b] = taken_up(&whole, &half, place.path()).1;
    assert_eq!(a.lines().last(), b.lines().last(), "{text}");
}

/// Checks that snapshots change nothing. A run continues from snapshots at instants whose forces are
/// computed, and after steps that were stopped. It ends in the same bits as a run without snapshots.
pub fn looks_change_nothing(world: &World) {
    let mut whole = world.simulation().unwrap();
    let steps = world.steps();
    // A load step in parts counts as several.
    for _ in 0..steps {
        whole.step(1).unwrap();
    }
    let mut looked = world.simulation().unwrap();
    let stop = StopFlag::default();
    looked.stop_on(&stop);
    let every = (steps / 8).max(1);
    for step in 0..steps {
        if step % every == 0 {
            let seen = |simulation: &mut Simulation| {
                let frame = simulation.frame().unwrap();
                let forces: Vec<_> = frame.parts().map(|(_, now)| now.contact_forces()).collect();
                format!("{:?} {forces:?}", frame.energies())
            };
            let first = seen(&mut looked);
            let (bytes, state) = (looked.encode().unwrap(), looked.state().unwrap());
            if (step / every).is_multiple_of(2) {
                looked.restore(state).unwrap();
            } else {
                let state = SimulationState::decode(looked.setup(), &bytes).unwrap();
                looked = Simulation::resumed(looked.setup().clone(), state).unwrap();
                looked.stop_on(&stop);
            }
            assert_eq!(seen(&mut looked), first, "at t = {} s", looked.time());
            // Only long steps are interrupted; an interrupted step is not taken.
            stop.ask();
            let stopped = looked.step(1);
            stop.clear();
            let Err(failure) = stopped else { continue };
            assert!(failure.is_interrupted(), "{failure}");
            assert_eq!(seen(&mut looked), first, "at t = {} s", looked.time());
        }
        looked.step(1).unwrap();
    }
    // Reading the forces at the end copies the state back from a device.
    let prints = [&mut looked, &mut whole].map(|simulation| {
        simulation.frame().unwrap();
        simulation.fingerprint()
    });
    assert_eq!(prints[0], prints[1]);
}

/// Runs a world without a stop, and from the checkpoint of a shorter run. Returns the checkpoint and the
/// table of each.
pub fn taken_up(whole: &World, half: &World, place: &Path) -> (Checkpoint, [String; 2]) {
    for (world, name) in [(whole, "whole"), (half, "half")] {
        run_world(world, &place.join(name));
    }
    let checkpoint = Checkpoint::read(&place.join("half")).unwrap();
    let onward = checkpoint.continues(whole).unwrap();
    let folder = OutputFolder::reopen(place.join("half"), &onward.scene, &checkpoint).unwrap();
    let options = Options { resume: Some(&checkpoint), ..Options::default() };
    let summary = pliant_run::run_with(&onward, &folder, options, &mut |_| ()).unwrap();
    assert_complete(&summary);
    let table = |name: &str| fs::read_to_string(place.join(name).join("history.csv")).unwrap();
    (checkpoint, ["whole", "half"].map(table))
}

/// A temporary folder with a scene in `case/scene.toml`.
#[derive(Debug)]
pub struct Workshop {
    folder: TempDir,
    /// The folder of the scene.
    case: PathBuf,
}

impl Workshop {
    /// A folder with this scene.
    pub fn new(scene: &str) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let workshop = Self { case: folder.path().join("case"), folder };
        workshop.write("case/scene.toml", scene);
        workshop
    }

    /// A program, to be run in the folder with a cache of its own.
    pub fn program(&self, binary: &str, arguments: &[&str]) -> Command {
        let mut command = Command::new(binary);
        command.args(arguments).current_dir(self.path(""));
        command.env("PLIANT_CACHE", self.path("cache"));
        command
    }

    /// A folder for the outputs of a scene of the project, which stays where it is.
    pub fn shipped(name: &str) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        Self { case: Path::new(ROOT).join("scenes").join(name), folder }
    }

    /// [`BLOCK`] with one place changed.
    pub fn block(good: &str, other: &str) -> Self {
        Self::new(&changed(BLOCK, good, other))
    }

    /// The path of a file in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes a file; the folders to it are made.
    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder is made");
        fs::write(path, content).expect("a file is written");
    }

    /// The text of a file.
    pub fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// The times of a series, after all its frames were read.
    pub fn series(&self, name: &str) -> Vec<(f64, MeshFile)> {
        series(&self.path(name))
    }

    /// The header of a CSV file and its rows; all have the same number of columns, all values are numbers.
    pub fn table(&self, name: &str) -> (Vec<String>, Vec<Vec<f64>>) {
        let text = self.read(name);
        assert!(text.ends_with('\n'), "the last row of {name} is not whole");
        let mut lines = text.lines();
        let header: Vec<String> = lines.next().expect("a header").split(',').map(str::to_owned).collect();
        let number = |text: &str| text.parse::<f64>().unwrap_or_else(|_| panic!("{name}: {text}"));
        let rows: Vec<Vec<f64>> = lines.map(|line| line.split(',').map(number).collect()).collect();
        assert!(rows.iter().all(|row| row.len() == header.len()), "{name}");
        (header, rows)
    }

    /// The cells of a CSV file row by row; commas in quotes do not separate cells.
    pub fn cells(&self, name: &str) -> Vec<Vec<String>> {
        let cells = |line: &str| {
            let (mut cells, mut quoted) = (vec![String::new()], false);
            for c in line.chars() {
                match c {
                    '"' => quoted = !quoted,
                    ',' if !quoted => cells.push(String::new()),
                    c => cells.last_mut().expect("a cell").push(c),
                }
            }
            cells
        };
        self.read(name).lines().map(cells).collect()
    }

    /// The checkpoints in a folder, in order.
    pub fn checkpoints(&self, folder: &str) -> Vec<PathBuf> {
        let paths =
            fs::read_dir(self.path(folder)).expect("a folder").map(|entry| entry.expect("an entry").path());
        let mut checkpoints: Vec<PathBuf> =
            paths.filter(|path| path.extension().is_some_and(|ending| ending == "pliant")).collect();
        checkpoints.sort();
        checkpoints
    }

    /// Returns all files in a folder with their contents, except checkpoints and the page with the wall time.
    pub fn files(&self, folder: &str) -> Vec<(PathBuf, Vec<u8>)> {
        let folder = self.path(folder);
        let (mut files, mut open) = (Vec::new(), vec![folder.clone()]);
        while let Some(next) = open.pop() {
            for entry in fs::read_dir(next).expect("a folder") {
                let path = entry.expect("an entry").path();
                let kept = path.file_name().is_some_and(|name| name == "summary.md")
                    || path.extension().is_some_and(|ending| ending == "pliant");
                if path.is_dir() {
                    open.push(path);
                } else if !kept {
                    let name = path.strip_prefix(&folder).expect("a path below").to_owned();
                    files.push((name, fs::read(&path).expect("a file")));
                }
            }
        }
        files.sort();
        files
    }

    /// Panics unless two folders have the same [files](Self::files).
    #[track_caller]
    pub fn assert_same_files(&self, one: &str, other: &str, what: &str) {
        let [one, other] = [one, other].map(|folder| self.files(folder));
        let names =
            |files: &[(PathBuf, Vec<u8>)]| files.iter().map(|file| file.0.clone()).collect::<Vec<_>>();
        assert_eq!(names(&one), names(&other), "{what}");
        for (one, other) in one.iter().zip(&other) {
            assert!(one.1 == other.1, "{what}: {} differs", one.0.display());
        }
    }

    /// Builds the scene with the values of some keys set, as `pliant check` does, and describes it.
    pub fn check(&self, set: &[&str]) -> Told {
        let mut output = Told::default();
        match self.world(set, &mut output) {
            Ok(world) => output.out = overview(&world),
            Err(message) => output.result = failed_input(&message),
        }
        self.relative(output)
    }

    /// Runs the scene with the values of some keys set, as `pliant run` does. The outputs are in `out/case`;
    /// the outputs of an earlier run there are replaced.
    pub fn run(&self, set: &[&str]) -> Told {
        self.run_into("out/case", set)
    }

    /// Runs the scene like [`run`](Self::run), with the outputs in another folder.
    pub fn run_into(&self, out: &str, set: &[&str]) -> Told {
        self.go(None, out, set)
    }

    /// Resumes a run from a checkpoint, or from the last one of a folder, with the outputs in the folder of
    /// the checkpoint.
    pub fn resume(&self, checkpoint: &str, set: &[&str]) -> Told {
        let path = Path::new(checkpoint);
        let is_file = path.extension().is_some_and(|ending| ending == "pliant");
        let out = if is_file { path.parent().unwrap_or(Path::new("")) } else { path };
        self.go(Some(checkpoint), out.to_str().expect("a path in UTF-8"), set)
    }

    /// Resumes a run like [`resume`](Self::resume), with the outputs in another folder.
    pub fn resume_in(&self, checkpoint: &str, out: &str) -> Told {
        self.go(Some(checkpoint), out, &[])
    }

    /// The combinations of some values of keys.
    ///
    /// # Errors
    /// The mistakes of the values.
    pub fn combinations(&self, set: &[&str]) -> Result<Sweep, SceneErrors> {
        let set: Vec<String> = set.iter().map(|set| (*set).to_owned()).collect();
        Sweep::new(self.source()?, self.case.clone(), &set)
    }

    /// Runs the scene for all combinations of some values of keys, as `pliant sweep` does; files of an
    /// earlier sweep there are removed.
    #[track_caller]
    pub fn sweep(&self, out: &str, set: &[&str], options: SweepOptions<'_>) -> SweepSummary {
        let sweep = self.combinations(set).unwrap_or_else(|errors| panic!("{}", errors.plain()));
        let folder = sweep.open_folder(self.path(out), true).expect("a folder");
        sweep.run(&folder, options, &|_| ()).expect("a table")
    }

    fn source(&self) -> Result<Source, SceneErrors> {
        let text = fs::read_to_string(self.case.join("scene.toml")).expect("a scene");
        Source::parse("case/scene.toml", text)
    }

    fn go(&self, checkpoint: Option<&str>, out: &str, set: &[&str]) -> Told {
        let mut output = Told::default();
        output.result = match self.attempt(checkpoint, out, set, &mut output) {
            Ok(result) => result,
            Err(message) => failed_input(&message),
        };
        self.relative(output)
    }

    /// The result of a run as an object, or the message with the reason why there is no run.
    fn attempt(
        &self,
        checkpoint: Option<&str>,
        out: &str,
        set: &[&str],
        output: &mut Told,
    ) -> Result<Value, String> {
        let checkpoint = checkpoint.map(|name| Checkpoint::read(&self.path(name))).transpose();
        let checkpoint = checkpoint.map_err(|error| output.refuse(&error, &error.remedy()))?;
        let mut world = self.world(set, output)?;
        if let Some(checkpoint) = &checkpoint {
            world = checkpoint.continues(&world).map_err(|error| output.refuse(&error, &error.remedy()))?;
        }
        let folder = match &checkpoint {
            Some(checkpoint) => OutputFolder::reopen(self.path(out), &world.scene, checkpoint)
                .map_err(|error| output.refuse(&error, &error.remedy())),
            None => OutputFolder::prepare(self.path(out), &world.scene, true)
                .map_err(|error| output.refuse(&error, error.remedy)),
        }?;
        output.err.extend(world.notes().map(|note| format!("note: {note}\n")));
        let options = Options { resume: checkpoint.as_ref(), ..Options::default() };
        Ok(match pliant_run::run_with(&world, &folder, options, &mut |_| ()) {
            Ok(summary) => {
                output.err.extend(summary.warnings.iter().map(|warning| format!("warning: {warning}\n")));
                output.err.extend(summary.error.iter().map(|error| format!("error: {}\n", error.message)));
                json!(summary)
            }
            Err(error) => {
                output.err += &format!("error: {error}; {}\n", error.remedy);
                failed_output(&error)
            }
        })
    }

    /// The world of the scene with the values of some keys set, or its mistakes.
    fn world(&self, set: &[&str], output: &mut Told) -> Result<World, String> {
        let world = (|| {
            let mut source = self.source()?;
            let mistakes: Vec<Diagnostic> =
                set.iter().filter_map(|set| source.assign(set).err()).map(|mistake| *mistake).collect();
            if !mistakes.is_empty() {
                return Err(source.errors(mistakes));
            }
            let scene = Scene::from_source(source, self.case.clone())?;
            World::assemble(&scene, &MeshCache::in_folder(self.path("cache")), &|_| ())
        })();
        match &world {
            Ok(world) => {
                output.show(&world.scene.source.errors(world.warnings().cloned().collect()));
            }
            Err(errors) => output.show(errors),
        }
        world.map_err(|errors| errors.plain().to_string())
    }

    /// The messages, with paths relative to the folder.
    fn relative(&self, mut output: Told) -> Told {
        let folder = format!("{}/", self.folder.path().display());
        output.out = output.out.replace(&folder, "");
        output.err = output.err.replace(&folder, "");
        output.result =
            serde_json::from_str(&output.result.to_string().replace(&folder, "")).expect("an object");
        output
    }
}

/// Output of a check or a run of a scene.
#[derive(Debug, Default)]
pub struct Told {
    /// The description of a scene that was checked.
    pub out: String,
    /// Notes, warnings and mistakes, each with its label and its remedy.
    pub err: String,
    /// The lines of the scene, and the options, in which something is underlined.
    underlined: Vec<String>,
    /// The object that `pliant run --json` prints; null for a check without mistakes.
    result: Value,
}

impl Told {
    /// Adds the texts of mistakes or warnings that are shown.
    fn show(&mut self, errors: &SceneErrors) {
        let diagnostics = errors.diagnostics();
        if diagnostics.len() > 1 {
            self.err += &format!("{errors}\n");
        }
        for diagnostic in &diagnostics[..diagnostics.len().min(MOST_SHOWN)] {
            let Diagnostic { message, span, option, label, help, also, .. } = diagnostic;
            let also_labels = also.iter().map(|(_, label)| label.as_str());
            let pieces = [message.as_str(), label].into_iter().chain(also_labels).chain(help.as_deref());
            self.err.extend(pieces.map(|piece| format!("{piece}\n")));
            let text = errors.text();
            let line = |at: usize| {
                let start = text[..at].rfind('\n').map_or(0, |end| end + 1);
                text[start..].lines().next().unwrap_or_default().to_owned()
            };
            match option {
                Some(option) => self.underlined.push(option.to_string()),
                None => self.underlined.extend(span.iter().map(|span| line(span.start))),
            }
            self.underlined.extend(also.iter().map(|(span, _)| line(span.start)));
        }
    }

    /// Adds an error with its remedy; returns both as the message of a result.
    fn refuse(&mut self, error: &dyn std::error::Error, remedy: &str) -> String {
        self.err += &format!("error: {error}\n  help: {remedy}\n");
        format!("{error} (help: {remedy})")
    }

    /// `done`, `failed`, `interrupted` or `invalid`; `checked` for a check without mistakes.
    pub fn status(&self) -> &str {
        self.result["status"].as_str().unwrap_or("checked")
    }

    /// The object that `pliant run --json` prints.
    pub fn json(&self) -> Value {
        self.result.clone()
    }

    /// The object of a run that went well, or to its end on a [coarse mesh](assert_complete).
    #[track_caller]
    pub fn done(&self) -> Value {
        let is_coarse = self.result["error"]["kind"] == "hourglass";
        assert!(self.status() == "done" || is_coarse, "{}", self.err);
        self.json()
    }

    /// The messages as running text.
    pub fn words(&self) -> String {
        self.err.split_whitespace().collect::<Vec<_>>().join(" ")
    }

    /// True if something is underlined in this line of the scene.
    pub fn underlines(&self, line: &str) -> bool {
        self.underlined.iter().any(|shown| shown.trim_end() == line)
    }
}

/// A text with the first place that reads `good` changed.
pub fn changed(text: &str, good: &str, other: &str) -> String {
    assert!(text.contains(good), "`{good}` is not in the scene");
    text.replacen(good, other, 1)
}

/// A scene of [`layered_segmentation`](crate::image_files::layered_segmentation) by the names of its labels,
/// with some replacements, each of which is found in it.
pub fn from_names(changes: &[[&str; 2]]) -> String {
    changes.iter().fold(FROM_NAMES.to_owned(), |text, [good, other]| changed(&text, good, other))
}

/// Reads a ParaView series: the times, and each frame it lists.
pub fn series(index: &Path) -> Vec<(f64, MeshFile)> {
    let text = fs::read_to_string(index).unwrap_or_else(|error| panic!("{}: {error}", index.display()));
    assert!(text.trim_end().ends_with("</VTKFile>"), "{} is not whole", index.display());
    let quoted = |line: &str, key: &str| {
        let value = line.split_once(&format!("{key}=\"")).expect(key).1;
        value.split_once('"').expect("a quote").0.to_owned()
    };
    let frames = text.lines().filter(|line| line.contains("<DataSet"));
    frames
        .map(|line| {
            let time: f64 = quoted(line, "timestep").parse().expect("a time");
            let path = index.with_file_name(quoted(line, "file"));
            let frame = io::read(&path).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(frame.time, Some(time), "TimeValue of {}", path.display());
            (time, frame)
        })
        .collect()
}
