//! Output for the user: errors, progress, results.

use std::borrow::Cow;
use std::fmt::Display;
use std::io::{self, Write};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use pliant_format::printable;
use pliant_run::failed_input;

/// The code of a process that did what it was to do.
pub const SUCCESS: u8 = 0;

/// Invalid input, or failed output.
#[derive(Debug)]
pub enum Failure {
    /// An error with a remedy.
    Plain { message: String, help: String },
    /// Standard output can't be written; the input is valid.
    Output(io::Error),
}

impl Failure {
    pub fn plain(message: impl ToString, help: impl ToString) -> Self {
        Self::Plain { message: message.to_string(), help: help.to_string() }
    }

    /// Prints it, with an object on standard output where that is promised; the exit code.
    pub fn tell(&self, json: bool) -> u8 {
        match self {
            Self::Plain { message, help } => {
                eprintln!("error: {}", printable(message));
                eprintln!("  help: {}", printable(help));
                if json {
                    // If standard output can't be written, the exit code still reports the error.
                    let _ = say(failed_input(&format!("{message} (help: {help})")));
                }
                2
            }
            Self::Output(error) => {
                eprintln!("error: standard output cannot be written: {error}; check the free space");
                1
            }
        }
    }
}

/// A progress bar with the time left, on standard error; hidden without a terminal.
pub struct Bar(ProgressBar);

impl Bar {
    pub fn new() -> Self {
        let bar = ProgressBar::new(1000);
        let style = ProgressStyle::with_template("{bar:40} {percent:>3} %  {msg}  {eta} left");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        bar.enable_steady_tick(Duration::from_millis(200));
        Self(bar)
    }

    /// Shows a part of the work from 0 to 1 and what is being done.
    pub fn show(&self, part: f64, now: impl Into<Cow<'static, str>>) {
        self.0.set_position((1000.0 * part) as u64);
        self.0.set_message(now);
    }

    pub fn finish(&self) {
        self.0.finish_and_clear();
    }
}

/// Prints a line on standard output. A closed pipe (`pliant-lab bench --list | head`) is not an error.
pub fn say(text: impl Display) -> Result<(), Failure> {
    let text = text.to_string();
    let written = writeln!(io::stdout(), "{}", printable(&text)).and_then(|()| io::stdout().flush());
    match written {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(Failure::Output(error)),
        _ => Ok(()),
    }
}
