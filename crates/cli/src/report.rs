//! Output for the user: errors with their line, progress, results.

use std::borrow::Cow;
use std::fmt::Display;
use std::io::{self, IsTerminal, Write};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use miette::Diagnostic;
use pliant_format::diagnostic::SceneErrors;
use pliant_format::{ReadError, printable};
use pliant_geometry::io::MeshFileError;
use pliant_geometry::words::number;
use pliant_gpu::Adapter;
use pliant_run::{Progress, ResumeError, Summary, SweepProgress, failed_input};
use pliant_sim::LoadStepProgress;
use serde_json::json;

/// Invalid input (exit code 2), or failed output.
#[derive(Debug)]
pub enum Failure {
    /// A scene with errors.
    Scene(SceneErrors),
    /// Any other error, with a remedy.
    Plain {
        /// The mistake.
        message: String,
        /// The remedy.
        help: String,
    },
    /// Standard output can't be written; the input is valid (exit code 1).
    Output(io::Error),
}

impl Failure {
    /// An error with a remedy, which may be empty.
    pub fn plain(message: impl ToString, help: impl ToString) -> Self {
        Self::Plain { message: message.to_string(), help: help.to_string() }
    }
}

impl From<SceneErrors> for Failure {
    fn from(errors: SceneErrors) -> Self {
        Self::Scene(errors)
    }
}

impl From<ReadError> for Failure {
    fn from(error: ReadError) -> Self {
        match error {
            ReadError::Scene(errors) => Self::Scene(errors),
            ReadError::File { .. } => Self::plain(
                error,
                "give a scene file, or a folder with a scene.toml; `pliant new NAME` writes one",
            ),
        }
    }
}

impl From<ResumeError> for Failure {
    fn from(error: ResumeError) -> Self {
        Self::plain(&error, error.remedy())
    }
}

/// Prints the error; exit code 2 for invalid input.
pub fn failure(failure: &Failure, json: bool) -> u8 {
    let text = match failure {
        Failure::Scene(errors) => {
            show(errors);
            errors.plain().to_string()
        }
        Failure::Plain { message, help } => {
            eprintln!("error: {message}");
            if !help.is_empty() {
                eprintln!("  help: {help}");
            }
            if help.is_empty() { message.clone() } else { format!("{message} (help: {help})") }
        }
        Failure::Output(error) => {
            eprintln!("error: standard output cannot be written: {error}; check the free space");
            return 1;
        }
    };
    if json {
        refused(text.trim_end());
    }
    2
}

/// Prints the JSON object of invalid input.
pub fn refused(message: &str) {
    // If standard output can't be written, the exit code still reports the error.
    let _ = say(failed_input(message));
}

/// Prints that a mesh could not be written; exit code 1.
pub fn failed_output(error: &MeshFileError, json: bool) -> Result<u8, Failure> {
    eprintln!("error: {error}");
    if json {
        say(json!({ "status": "failed", "error": { "kind": "output", "message": error.to_string() } }))?;
    }
    Ok(1)
}

/// Prints errors or warnings with the user's own lines underlined.
pub fn show(errors: &SceneErrors) {
    let handler = miette::GraphicalReportHandler::new_themed(theme());
    let mut text = String::new();
    let drawn = handler.render_report(&mut text, errors as &dyn Diagnostic);
    match drawn {
        // Its colours are terminal codes; text from the scene is already printable.
        Ok(()) => drop(writeln!(io::stderr(), "{}", text.trim_end_matches('\n'))),
        Err(_) => eprintln!("{}", errors.plain().to_string().trim_end_matches('\n')),
    }
}

fn theme() -> miette::GraphicalTheme {
    let colours = std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    if colours { miette::GraphicalTheme::unicode() } else { miette::GraphicalTheme::unicode_nocolor() }
}

/// Time between lines of progress without a terminal.
const BETWEEN_LINES: Duration = Duration::from_secs(10);

/// A progress bar with the time left and the real-time factor; without a terminal a line every ten seconds.
pub struct Bar {
    bar: ProgressBar,
    /// Time of the last line, or of the begin of the work; `None` with a terminal.
    last: Option<Mutex<Instant>>,
}

impl Bar {
    /// At the start of the work.
    #[expect(clippy::new_without_default, reason = "it begins to draw")]
    pub fn new() -> Self {
        let bar = ProgressBar::new(1000);
        let style = ProgressStyle::with_template("{bar:40} {percent:>3} %  {msg}  {eta} left");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        bar.enable_steady_tick(Duration::from_millis(200));
        let last = (!io::stderr().is_terminal()).then(|| Mutex::new(Instant::now()));
        Self { bar, last }
    }

    /// Shows the finished part of the work, from 0 to 1, and its present step.
    pub fn show(&self, part: f64, now: impl Into<Cow<'static, str>>) {
        let now = now.into();
        if let Some(last) = &self.last
            && let Ok(mut last) = last.lock()
            && last.elapsed() >= BETWEEN_LINES
        {
            *last = Instant::now();
            tell(format_args!("{:3.0} %  {:4.0} s  {now}", 100.0 * part, self.bar.elapsed().as_secs_f64()));
        }
        self.bar.set_position((1000.0 * part) as u64);
        self.bar.set_message(now);
    }

    pub(crate) fn update(&self, progress: Progress) {
        let Progress { time, until, wall, load_step } = progress;
        let now = match load_step {
            Some(LoadStepProgress { number, of, iteration, tolerance }) => format!(
                "load step {number} of {of}: iteration {}, residual {:.1e} of {tolerance:.0e}",
                iteration.number, iteration.residual
            ),
            None => {
                let factor = time / wall.as_secs_f64().max(f64::MIN_POSITIVE);
                format!("{time:.3} of {until} s simulated, {factor:.2} × real time")
            }
        };
        self.show(time / until, now);
    }

    pub(crate) fn update_sweep(&self, progress: SweepProgress, runs: usize) {
        self.show(progress.part, progress.words(runs));
    }

    /// At its end.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

/// The result of a run in a few lines; for a failed run, without valid energies and forces, only its files.
pub fn result(summary: &Summary) -> String {
    let Summary { nodes, elements, step, steps, wall_seconds, real_time_factor, energy_balance, .. } =
        summary;
    let mut lines =
        vec![format!("{nodes} nodes, {elements} elements; step {} s, {steps} steps", number(*step))];
    if summary.error.is_none() {
        let [wall, factor] = [*wall_seconds, *real_time_factor].map(number);
        let balance = energy_balance
            .map_or_else(String::new, |balance| format!("; energies balance to {:.2} %", balance * 100.0));
        lines.push(format!("wall time {wall} s, {factor} × real time{balance}"));
        lines.extend(summary.stability.as_ref().map(ToString::to_string));
        lines.extend(summary.reactions.iter().map(|(name, force)| {
            let [x, y, z] = force.map(number);
            format!("reaction of `{name}`: ({x}, {y}, {z}) N")
        }));
    }
    lines.extend(summary.files.iter().map(|file| format!("wrote {file}")));
    lines.join("\n")
}

/// The GPUs as a list, the best first.
pub fn adapters(found: &[Adapter]) -> String {
    let of = |a: &Adapter| {
        let atomics = if a.float_atomics { "atomic float addition" } else { "no atomic float addition" };
        format!(
            "{}\n  {}, {}, {}\n  buffers up to {} MiB, {} KiB shared memory, workgroups up to {} invocations, {atomics}",
            a.name,
            a.kind,
            a.backend,
            a.driver,
            a.largest_buffer >> 20,
            a.shared_memory >> 10,
            a.group_size,
        )
    };
    found.iter().map(of).collect::<Vec<_>>().join("\n")
}

/// Prints a line on standard output. A closed pipe (`pliant schema | head`) is not an error.
///
/// # Errors
/// If it can't be written.
pub fn say(text: impl Display) -> Result<(), Failure> {
    let text = text.to_string();
    let written = writeln!(io::stdout(), "{}", printable(&text)).and_then(|()| io::stdout().flush());
    match written {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(Failure::Output(error)),
        _ => Ok(()),
    }
}

/// Prints a line on standard error, if possible. Names from files reach the terminal without control codes.
pub fn tell(text: impl Display) {
    let _ = writeln!(io::stderr(), "{}", printable(&text.to_string()));
}
