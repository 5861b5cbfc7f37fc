//! What goes to the user: mistakes with the line they are in, progress, results.

use std::io::IsTerminal;
use std::process::ExitCode;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use miette::Diagnostic;
use pliant_scene::diagnostic::SceneErrors;
use pliant_scene::{Progress, ReadError, Summary, failed_input};

/// The input is wrong (exit code 2).
#[derive(Debug)]
pub enum Failure {
    /// A scene with mistakes.
    Scene(SceneErrors),
    /// Anything else, with a remedy.
    Plain { message: String, help: String },
}

impl Failure {
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

/// Prints what is wrong with the input; exit code 2.
pub fn failure(failure: &Failure, json: bool) -> ExitCode {
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
    };
    if json {
        println!("{}", failed_input(text.trim_end()));
    }
    ExitCode::from(2)
}

/// Prints mistakes or doubts with the user's own lines underlined.
pub fn show(errors: &SceneErrors) {
    let handler = miette::GraphicalReportHandler::new_themed(theme());
    let mut text = String::new();
    let drawn = handler.render_report(&mut text, errors as &dyn Diagnostic);
    match drawn {
        Ok(()) => eprint!("{text}"),
        Err(_) => eprint!("{}", errors.plain()),
    }
}

fn theme() -> miette::GraphicalTheme {
    let colours = std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    if colours { miette::GraphicalTheme::unicode() } else { miette::GraphicalTheme::unicode_nocolor() }
}

/// A bar with the time left and the real-time factor; nothing where nobody looks.
pub struct Bar(ProgressBar);

impl Bar {
    pub fn new() -> Self {
        let bar = ProgressBar::new(1000);
        let style = ProgressStyle::with_template("{bar:40} {percent:>3} %  {msg}  {eta} left");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        bar.enable_steady_tick(Duration::from_millis(200));
        Self(bar)
    }

    pub fn update(&self, progress: Progress) {
        let Progress { time, until, wall } = progress;
        self.0.set_position((1000.0 * time / until) as u64);
        let factor = time / wall.as_secs_f64().max(f64::MIN_POSITIVE);
        self.0.set_message(format!("{time:.3} of {until} s simulated, {factor:.2} × real time"));
    }

    pub fn finish(&self) {
        self.0.finish_and_clear();
    }
}

/// The result of a run in a few lines.
pub fn result(summary: &Summary) {
    let Summary { nodes, elements, step, steps, wall_seconds, real_time_factor, energy_balance, .. } =
        summary;
    println!("{nodes} nodes, {elements} elements; step {step:.3e} s, {steps} steps");
    println!(
        "wall time {wall_seconds:.2} s, {real_time_factor:.2} × real time; energies balance to {:.2} %",
        energy_balance * 100.0
    );
    for (name, force) in &summary.reactions {
        println!("reaction of `{name}`: {force} N");
    }
    for file in &summary.files {
        println!("wrote {file}");
    }
}
