//! Sweeps: one scene run for every combination of some values, each run on one thread, several at a time, and
//! one table of their results.

use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use pliant_format::Scene;
use pliant_format::diagnostic::{Diagnostic, Place, SceneErrors};
use pliant_format::registry::OutputTable;
use pliant_format::source::{SET, Source};
use pliant_geometry::words::number;
use pliant_mechanics::{Energies, fingerprint};
use pliant_scene::{MeshCache, World};
use pliant_sim::StopFlag;
use serde::{Deserialize, Serialize};

use crate::output::{
    AXES, ENERGIES, MOST_CURVES, OutputError, OutputFolder, Reactions, Summary, check_own_folder, in_columns,
    plot_of_sweep,
};
use crate::run::{Options, run_with};

/// The table of a sweep.
pub(crate) const SWEEP: &str = "sweep.csv";
/// Its plot: the reactions of all runs over time.
pub(crate) const SWEEP_PLOT: &str = "sweep.svg";
/// Combinations a sweep may have.
const MOST: usize = 100_000;

/// A scene and the values it is to be run with.
#[derive(Clone, Debug)]
pub struct Sweep {
    source: Source,
    /// The folder that file names in the scene are relative to.
    folder: PathBuf,
    axes: Vec<Axis>,
    cache: MeshCache,
}

/// A key with its values, in the order given.
#[derive(Clone, Debug, PartialEq)]
struct Axis {
    key: String,
    values: Vec<String>,
}

/// Options of a sweep.
#[derive(Clone, Copy, Debug, Default)]
pub struct SweepOptions<'a> {
    /// Runs at a time; 0: one per core. The number never changes a result.
    pub threads: usize,
    /// True if the series of fields are written, too.
    pub keep_fields: bool,
    /// Ends the sweep once it is asked.
    pub stop: Option<&'a StopFlag>,
}

/// Progress of a sweep.
#[derive(Clone, Copy, Debug, Default)]
pub struct SweepProgress {
    /// Runs that have ended.
    pub ended: usize,
    /// Runs that have failed.
    pub failed: usize,
    /// Part of all simulated time that is done.
    pub part: f64,
}

/// The result of a sweep.
#[derive(Clone, Debug)]
pub struct SweepSummary {
    /// The table.
    pub table: PathBuf,
    /// The plot; `None` where no run has written reactions.
    pub plot: Option<PathBuf>,
    /// For each run that failed its number and the reason.
    pub failures: Vec<(usize, String)>,
    /// Runs.
    pub runs: usize,
    /// True if the sweep was stopped before its end.
    pub interrupted: bool,
}

/// The result of one run.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Row {
    pub status: String,
    pub message: String,
    pub time: f64,
    pub steps: u64,
    pub step: f64,
    pub energies: Energies,
    pub reactions: Vec<(String, [f64; 3])>,
    /// Column and value of each probe at the end.
    pub probes: Vec<(String, String)>,
    pub wall_seconds: f64,
}

impl Sweep {
    /// Makes a sweep from a scene's text and assignments `KEY=VALUES`. VALUES are separated by commas outside
    /// of brackets and quotes. `FROM..TO/N` stands for N numbers from FROM to TO in equal steps.
    ///
    /// # Errors
    /// If an assignment has another form, a key has no value or stands twice, or there are too many
    /// combinations.
    pub fn new(source: Source, folder: PathBuf, sets: &[String]) -> Result<Self, SceneErrors> {
        let (mut axes, mut mistakes) = (Vec::<Axis>::new(), Vec::new());
        for set in sets {
            match Axis::parse(set) {
                Ok(axis) if axes.iter().any(|other| other.key == axis.key) => {
                    let message = format!("`{}` is set twice", axis.key);
                    let help = "give all its values in one option: a=1,2,3";
                    mistakes
                        .push(Diagnostic::error(message).at(place(set, 0..axis.key.len()), "").help(help));
                }
                Ok(axis) => axes.push(axis),
                Err(mistake) => mistakes.push(*mistake),
            }
        }
        let runs = axes.iter().try_fold(1_usize, |runs, axis| runs.checked_mul(axis.values.len()));
        if runs.is_none_or(|runs| runs > MOST) {
            let message = format!("the sweep has more than {MOST} combinations");
            mistakes.push(Diagnostic::error(message).help("take fewer values, or several sweeps"));
        }
        let cache = MeshCache::off();
        if mistakes.is_empty() {
            Ok(Self { source, folder, axes, cache })
        } else {
            Err(source.errors(mistakes))
        }
    }

    /// Sets the cache for meshes of images.
    pub fn with_cache(self, cache: MeshCache) -> Self {
        Self { cache, ..self }
    }

    /// Number of combinations.
    pub fn runs(&self) -> usize {
        self.axes.iter().map(|axis| axis.values.len()).product()
    }

    /// The key and value of each assignment of a combination. The last key changes fastest.
    pub fn combination(&self, run: usize) -> Vec<(&str, &str)> {
        let mut rest = run;
        let mut assignments: Vec<_> = (self.axes.iter().rev())
            .map(|axis| {
                let value = &axis.values[rest % axis.values.len()];
                rest /= axis.values.len();
                (axis.key.as_str(), value.as_str())
            })
            .collect();
        assignments.reverse();
        assignments
    }

    /// A combination in words: `a=1 b=2`.
    pub fn title(&self, run: usize) -> String {
        let pairs = self.combination(run).into_iter().map(|(key, value)| format!("{key}={value}"));
        pairs.collect::<Vec<_>>().join(" ")
    }

    fn scene(&self, run: usize) -> Result<Scene, SceneErrors> {
        let mut source = self.source.clone();
        let sets = self.combination(run).into_iter().map(|(key, value)| format!("{key}={value}"));
        let mistakes: Vec<_> = sets.filter_map(|set| source.assign(&set).err()).map(|m| *m).collect();
        if !mistakes.is_empty() {
            return Err(source.errors(mistakes));
        }
        let mut scene = Scene::from_source(source, self.folder.clone())?;
        (scene.run.threads, scene.run.checkpoint) = (1, None);
        Ok(scene)
    }

    fn prepare(&self, run: usize) -> Result<World, SceneErrors> {
        World::assemble(&self.scene(run)?, &self.cache, &|_| {})
    }

    /// Reads, builds and plans every combination; runs nothing. The mistakes come with the combination's
    /// number, in order.
    pub fn check(&self, threads: usize) -> Vec<(usize, SceneErrors)> {
        let mistakes = Mutex::new(Vec::new());
        in_parallel(self.runs(), threads, None, |run| {
            if let Err(errors) = self.prepare(run) {
                lock(&mistakes).push((run, errors));
            }
        });
        let mut mistakes = mistakes.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        mistakes.sort_by_key(|(run, _)| *run);
        mistakes
    }

    /// Opens the folder of a sweep like [`OutputFolder::prepare`]. With `force` it also removes what the runs
    /// of an earlier sweep left in their folders.
    ///
    /// # Errors
    /// If the first combination is no scene, or the folder holds something or can't be written to.
    pub fn open_folder(&self, path: PathBuf, force: bool) -> Result<OutputFolder, OutputError> {
        let scene = self.scene(0).map_err(|errors| OutputError::new(&path, errors.plain()))?;
        let folder = OutputFolder::prepare(path.clone(), &scene, force)?;
        let entries = fs::read_dir(&path).map_err(|error| OutputError::new(&path, error))?;
        for entry in entries.flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            let is_run =
                name.strip_prefix("run-").is_some_and(|n| n.bytes().all(|byte| byte.is_ascii_digit()));
            if is_run {
                check_own_folder(&entry.path()).map_err(|error| OutputError::new(&entry.path(), error))?;
            }
            if is_run && entry.path().is_dir() {
                OutputFolder::clear(&entry.path(), &scene)?;
            }
        }
        Ok(folder)
    }

    /// Runs all combinations, each in its own folder `run-NNNN`, and writes the table after each. A run that
    /// fails is a row as any other.
    ///
    /// # Errors
    /// If the table can't be written.
    pub fn run(
        &self,
        folder: &OutputFolder,
        options: SweepOptions<'_>,
        report: &(dyn Fn(SweepProgress) + Sync),
    ) -> Result<SweepSummary, OutputError> {
        let runs = self.runs();
        let rows: Mutex<Vec<Option<Row>>> = Mutex::new((0..runs).map(|_| None).collect());
        let parts: Mutex<Vec<f64>> = Mutex::new(vec![0.0; runs]);
        let ended = [AtomicUsize::new(0), AtomicUsize::new(0)];
        let tell = || {
            let part = lock(&parts).iter().sum::<f64>() / runs as f64;
            let [ended, failed] = [0, 1].map(|index: usize| ended[index].load(Ordering::Relaxed));
            report(SweepProgress { ended, failed, part });
        };
        let trouble = Mutex::new(None);
        self.write(folder, &lock(&rows))?;
        in_parallel(runs, options.threads, options.stop, |run| {
            let mut watch = |part| {
                lock(&parts)[run] = part;
                tell();
            };
            let row = self.run_one(run, folder.path(), options, &mut watch);
            lock(&parts)[run] = 1.0;
            ended[0].fetch_add(1, Ordering::Relaxed);
            ended[1].fetch_add(usize::from(row.status != "done"), Ordering::Relaxed);
            tell();
            let mut rows = lock(&rows);
            rows[run] = Some(row);
            if let Err(error) = self.write(folder, &rows) {
                lock(&trouble).get_or_insert(error);
            }
        });
        if let Some(error) = lock(&trouble).take() {
            return Err(error);
        }
        let rows = rows.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        Ok(SweepSummary {
            table: folder.path().join(SWEEP),
            plot: self.plot(folder, runs)?,
            failures: failures(&rows),
            runs,
            interrupted: rows.iter().any(|row| row.as_ref().is_none_or(|row| row.status == "interrupted")),
        })
    }

    /// Does one run in a folder of its own, below a folder.
    pub(crate) fn run_one(
        &self,
        run: usize,
        folder: &Path,
        options: SweepOptions<'_>,
        watch: &mut (dyn FnMut(f64) + Send),
    ) -> Row {
        let mut world = match self.prepare(run) {
            Ok(prepared) => prepared,
            Err(errors) => return Row::failed(errors.plain()),
        };
        if !options.keep_fields {
            world.scene.outputs.retain(|(_, table)| !matches!(table, OutputTable::Vtu(_)));
        }
        let path = folder.join(format!("run-{run:04}"));
        // Files in it that are not of a run stay.
        let folder = match OutputFolder::prepare(path, &world.scene, true) {
            Ok(folder) => folder,
            Err(error) => return Row::failed(error),
        };
        let options = Options { stop: options.stop, ..Options::default() };
        let mut report = |progress: crate::run::Progress| watch(progress.time / progress.until);
        match run_with(&world, &folder, options, &mut report) {
            Ok(summary) => Row::new(summary, final_probes(&world.scene, folder.path())),
            Err(error) => Row::failed(error),
        }
    }

    /// Draws the reactions that the runs have written.
    fn plot(&self, folder: &OutputFolder, runs: usize) -> Result<Option<PathBuf>, OutputError> {
        let of_run = |run: usize| {
            let scene = self.scene(run).ok()?;
            let path = folder.path().join(format!("run-{run:04}"));
            let found = reactions(&scene, &path);
            (!found.is_empty()).then(|| (self.title(run), found))
        };
        // No more tables are read than are drawn.
        let found: Vec<(String, Reactions)> = (0..runs).filter_map(of_run).take(MOST_CURVES).collect();
        let svg = plot_of_sweep(&found).map_err(|error| OutputError::new(folder.path(), error))?;
        svg.map(|svg| folder.write(SWEEP_PLOT, svg)).transpose()
    }

    /// Paths of the values that are varied.
    pub(crate) fn keys(&self) -> impl Iterator<Item = &str> {
        self.axes.iter().map(|axis| axis.key.as_str())
    }

    /// Key of a row: a fingerprint of the scene, the values of its run and this version.
    pub(crate) fn key(&self, run: usize) -> String {
        let scene =
            (self.source.text(), self.source.assignments(), self.title(run), env!("CARGO_PKG_VERSION"));
        format!("{:016x}", fingerprint(&scene))
    }

    fn write(&self, folder: &OutputFolder, rows: &[Option<Row>]) -> Result<(), OutputError> {
        folder.write(SWEEP, self.table(rows)).map(|_| ())
    }

    /// The table of the runs that have ended. Columns that a run has no value for stay empty.
    pub(crate) fn table(&self, rows: &[Option<Row>]) -> String {
        let ended = || rows.iter().flatten();
        let reactions = distinct(ended().flat_map(|row| row.reactions.iter().map(|(name, _)| name)));
        let probes = distinct(ended().flat_map(|row| row.probes.iter().map(|(column, _)| column)));
        let mut header = vec!["run".to_owned()];
        header.extend(self.axes.iter().map(|axis| quoted(&axis.key)));
        header.extend(["status", "error", "time", "steps", "step"].map(str::to_owned));
        header.extend(ENERGIES.map(|energy| format!("energy.{energy}")));
        header.extend(
            reactions.iter().flat_map(|name| AXES.map(|axis| quoted(&format!("reaction.{name}.{axis}")))),
        );
        header.extend(probes.iter().map(|column| quoted(column)));
        header.push("wall_seconds".into());
        let mut text = header.join(",") + "\n";
        for (run, row) in rows.iter().enumerate() {
            let Some(row) = row else { continue };
            let mut cells = vec![run.to_string()];
            cells.extend(self.combination(run).into_iter().map(|(_, value)| quoted(value)));
            cells.extend([row.status.clone(), quoted(&row.message)]);
            cells.extend([format!("{:e}", row.time), row.steps.to_string(), format!("{:e}", row.step)]);
            let good = row.status == "done";
            let value = |x: f64| if good { format!("{x:e}") } else { String::new() };
            cells.extend(in_columns(&row.energies).map(value));
            for name in &reactions {
                let found = row.reactions.iter().find(|(other, _)| good && other == *name);
                cells.extend([0, 1, 2].map(|c| found.map_or(String::new(), |(_, f)| format!("{:e}", f[c]))));
            }
            for column in &probes {
                let found = row.probes.iter().find(|(other, _)| good && other == *column);
                cells.push(found.map_or(String::new(), |(_, value)| value.clone()));
            }
            cells.push(format!("{:e}", row.wall_seconds));
            text.push_str(&cells.join(","));
            text.push('\n');
        }
        text
    }
}

impl Row {
    fn new(summary: Summary, probes: Vec<(String, String)>) -> Self {
        Self {
            status: summary.status.to_owned(),
            message: summary.error.map_or(String::new(), |error| error.message),
            time: summary.time,
            steps: summary.steps,
            step: summary.step,
            energies: summary.energies,
            reactions: summary.reactions,
            probes,
            wall_seconds: summary.wall_seconds,
        }
    }

    /// Makes the result of a run that did not start.
    fn failed(reason: impl ToString) -> Self {
        Self {
            status: "failed".to_owned(),
            message: reason.to_string(),
            time: 0.0,
            steps: 0,
            step: f64::NAN,
            energies: Energies::default(),
            reactions: Vec::new(),
            probes: Vec::new(),
            wall_seconds: 0.0,
        }
    }
}

/// Runs that failed: number and reason.
pub(crate) fn failures(rows: &[Option<Row>]) -> Vec<(usize, String)> {
    let failed = |(run, row): (usize, &Option<Row>)| {
        row.as_ref().filter(|row| row.status == "failed").map(|row| (run, row.message.clone()))
    };
    rows.iter().enumerate().filter_map(failed).collect()
}

/// The tables that a run has written, by the names of their outputs.
fn tables<'s>(scene: &'s Scene, folder: &Path) -> impl Iterator<Item = (&'s String, String)> {
    let of_output = |(name, table): &'s (String, OutputTable)| match table {
        OutputTable::Csv(_) => Some((name, fs::read_to_string(folder.join(format!("{name}.csv"))).ok()?)),
        OutputTable::Vtu(_) => None,
    };
    scene.outputs.iter().filter_map(of_output)
}

/// The sizes of the reactions in the first table of a run that has some.
fn reactions(scene: &Scene, folder: &Path) -> Reactions {
    for (_, text) in tables(scene, folder) {
        let mut lines = text.lines();
        let header: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
        let rows: Vec<Vec<f64>> = lines
            .map(|line| line.split(',').map(|cell| cell.parse().unwrap_or(f64::NAN)).collect())
            .collect();
        let column = |name: &str| header.iter().position(|known| *known == name);
        let constraints =
            header.iter().filter_map(|column| column.strip_prefix("reaction.")?.strip_suffix(".x"));
        let sizes = constraints.filter_map(|constraint| {
            let columns = AXES.map(|axis| column(&format!("reaction.{constraint}.{axis}")));
            let [Some(x), Some(y), Some(z)] = columns else { return None };
            let at = |row: &Vec<f64>, column: usize| row.get(column).copied().unwrap_or(f64::NAN);
            let size = |row| [at(row, 0), at(row, x).hypot(at(row, y)).hypot(at(row, z))];
            Some((constraint.to_owned(), rows.iter().map(size).collect()))
        });
        let sizes: Reactions = sizes.collect();
        if !sizes.is_empty() {
            return sizes;
        }
    }
    Vec::new()
}

/// The last row of the probes in a run's tables; the columns begin with the name of the output.
fn final_probes(scene: &Scene, folder: &Path) -> Vec<(String, String)> {
    let mut found = Vec::new();
    for (name, text) in tables(scene, folder) {
        let (Some(header), Some(last)) = (text.lines().next(), text.lines().last()) else { continue };
        let columns = header.split(',').zip(last.split(','));
        let probes = columns.filter(|(column, _)| column.starts_with("probe."));
        found.extend(probes.map(|(column, value)| (format!("{name}.{column}"), value.to_owned())));
    }
    found
}

fn distinct<'a>(names: impl Iterator<Item = &'a String>) -> Vec<&'a String> {
    let mut kept = Vec::new();
    let mut seen = std::collections::HashSet::new();
    kept.extend(names.filter(|name| seen.insert(*name)));
    kept
}

/// A cell of a table, in quotes where it needs some (RFC 4180).
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

/// Does the work of all runs on some threads, each run on one; after `stop` none is begun. A run's own pool
/// is inside its thread: a worker of rayon's that waits for it would begin another run meanwhile.
pub(crate) fn in_parallel(runs: usize, threads: usize, stop: Option<&StopFlag>, work: impl Fn(usize) + Sync) {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = if threads == 0 { cores } else { threads }.min(runs.max(1));
    let next = AtomicUsize::new(0);
    let take = || {
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build();
        while !stop.is_some_and(StopFlag::is_asked) {
            let run = next.fetch_add(1, Ordering::Relaxed);
            if run >= runs {
                break;
            }
            match &one {
                Ok(one) => one.install(|| work(run)),
                Err(_) => work(run),
            }
        }
    };
    std::thread::scope(|scope| {
        (1..threads).for_each(|_| {
            scope.spawn(take);
        });
        take();
    });
}

pub(crate) fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// A part of an option as typed.
fn place(set: &str, span: Range<usize>) -> Place {
    let text: Arc<str> = format!("{SET}{set}").into();
    Place::Option(text, span.start + SET.len()..span.end + SET.len())
}

impl Axis {
    fn parse(set: &str) -> Result<Self, Box<Diagnostic>> {
        let refused = |message: String, span: Range<usize>, help: &str| {
            Box::new(Diagnostic::error(message).at(place(set, span), "").help(help))
        };
        let whole = 0..set.len();
        let Some((key, right)) = set.split_once('=') else {
            let message = format!("`{set}` is not an assignment");
            return Err(refused(
                message,
                whole,
                "write key=value,value,…, such as law.tissue.young-modulus=1e3,2e3",
            ));
        };
        let mut values = Vec::new();
        let start = key.len() + 1;
        for span in split(right) {
            let text = right[span.clone()].trim();
            let span = span.start + start..span.end + start;
            if text.is_empty() {
                let message = format!("a value of `{}` is missing", key.trim());
                return Err(refused(message, span, "write values with one comma between them: 1,2,3"));
            }
            match range(text) {
                None => values.push(text.to_owned()),
                Some(Ok(range)) => values.extend(range),
                Some(Err(why)) => {
                    let help = "write FROM..TO/N, such as 1e3..5e3/5 for 1000, 2000, 3000, 4000 and 5000";
                    return Err(refused(format!("`{text}` is not a range: {why}"), span, help));
                }
            }
        }
        Ok(Self { key: key.trim().to_owned(), values })
    }
}

/// The parts of a text between commas outside brackets and quotes.
fn split(text: &str) -> Vec<Range<usize>> {
    let (mut parts, mut start, mut depth, mut quote) = (Vec::new(), 0, 0_i32, None);
    let mut escaped = false;
    for (at, c) in text.char_indices() {
        match (quote, c) {
            _ if escaped => escaped = false,
            (Some('"'), '\\') => escaped = true,
            (Some(open), c) if c == open => quote = None,
            (Some(_), _) => {}
            (None, '"' | '\'') => quote = Some(c),
            (None, '[' | '{') => depth += 1,
            (None, ']' | '}') => depth -= 1,
            (None, ',') if depth <= 0 => {
                parts.push(start..at);
                start = at + 1;
            }
            _ => {}
        }
    }
    parts.push(start..text.len());
    parts
}

/// The numbers of `FROM..TO/N`; none if the text is no range at all. Whole numbers stay whole.
fn range(text: &str) -> Option<Result<Vec<String>, String>> {
    if text.starts_with(['"', '\'', '[', '{']) {
        return None;
    }
    let (from, rest) = text.split_once("..")?;
    let first: f64 = from.trim().parse().ok().filter(|x: &f64| x.is_finite())?;
    let Some((to, count)) = rest.split_once('/') else {
        return Some(Err("the number of values is missing".into()));
    };
    let Some(last) = to.trim().parse::<f64>().ok().filter(|x| x.is_finite()) else {
        return Some(Err(format!("`{}` is not a number", to.trim())));
    };
    let Some(count) = count.trim().parse::<usize>().ok().filter(|count| (2..=MOST).contains(count)) else {
        return Some(Err(format!("the number of values must be a whole number from 2 to {MOST}")));
    };
    let value = |index: usize| {
        let s = index as f64 / (count - 1) as f64;
        first * (1.0 - s) + last * s
    };
    let values: Vec<f64> = (0..count).map(value).collect();
    let whole = [from, to].iter().all(|end| end.trim().parse::<i64>().is_ok())
        && values.iter().all(|value| value.fract() == 0.0);
    let show = |value: f64| if whole { format!("{value:.0}") } else { format!("{value:?}") };
    Some(Ok(values.into_iter().map(show).collect()))
}

impl SweepSummary {
    /// The result in a few lines.
    pub fn words(&self) -> String {
        let plot = self.plot.as_ref().map_or(String::new(), |plot| format!("\nwrote {}", plot.display()));
        format!("{} runs, {} failed\nwrote {}{plot}", self.runs, self.failures.len(), self.table.display())
    }
}

impl SweepProgress {
    /// The progress in a few words.
    pub fn words(&self, runs: usize) -> String {
        let failed = if self.failed > 0 { format!(", {} failed", self.failed) } else { String::new() };
        format!("{} of {runs} runs ended{failed}, {} % simulated", self.ended, number(100.0 * self.part))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::CUBE;

    fn values(set: &str) -> Vec<String> {
        Axis::parse(set).unwrap_or_else(|mistake| panic!("{mistake}")).values
    }

    #[test]
    fn values_are_separated_by_commas_outside_of_brackets_and_quotes() {
        assert_eq!(values("a=1,2, 3"), ["1", "2", "3"]);
        assert_eq!(values("a=[0,0,-9.81],[0,0,0]"), ["[0,0,-9.81]", "[0,0,0]"]);
        assert_eq!(
            values("a={ x = [1, 2], y = 3 },'b,c',\"d\\\",e\""),
            ["{ x = [1, 2], y = 3 }", "'b,c'", "\"d\\\",e\""]
        );
        assert_eq!(values("a=tet4,hex8"), ["tet4", "hex8"]);
        assert_eq!(values("a=../x.msh,meshes/../y..z/2"), ["../x.msh", "meshes/../y..z/2"]);
        for bad in ["a", "a=", "a=1,,2", "a=1,", "a=1..3", "a=1..x/3", "a=1..3/1", "a=1..3/2.5", "a=1..3/0"] {
            assert!(Axis::parse(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn ranges_have_both_ends_and_equal_steps() {
        assert_eq!(values("a=1e3..5e3/5"), ["1000.0", "2000.0", "3000.0", "4000.0", "5000.0"]);
        assert_eq!(values("a=1..4/4,10"), ["1", "2", "3", "4", "10"]);
        assert_eq!(values("a=0..1/3"), ["0.0", "0.5", "1.0"]);
        assert_eq!(values("a=-1..-2/2"), ["-1", "-2"]);
        let thirds = values("a=0.1..0.7/7");
        assert_eq!((thirds.first().unwrap().as_str(), thirds.last().unwrap().as_str()), ("0.1", "0.7"));
    }

    #[test]
    fn the_last_key_changes_fastest() {
        let source = Source::parse("cube.toml", CUBE).unwrap();
        let sets = ["scene.until=1,2".to_owned(), "body.cube.density=1..3/3".to_owned()];
        let sweep = Sweep::new(source.clone(), ".".into(), &sets).unwrap();
        assert_eq!(sweep.runs(), 6);
        assert_eq!(sweep.title(1), "scene.until=1 body.cube.density=2");
        assert_eq!(sweep.title(5), "scene.until=2 body.cube.density=3");
        let twice =
            Sweep::new(source.clone(), ".".into(), &["a=1".to_owned(), "a=2".to_owned()]).unwrap_err();
        assert!(twice.plain().to_string().contains("`a` is set twice"));
        let many = ["a=1..1000/1000".to_owned(), "b=1..1000/1000".to_owned()];
        let many = Sweep::new(source, ".".into(), &many).unwrap_err();
        assert!(many.plain().to_string().contains("more than 100000 combinations"));
    }
}
