//! `pliant`: real-time simulation of soft organs. This crate parses commands and prints results; the libraries compute.

/// A line on standard error. A full disk or a closed pipe must not end a run: unlike the standard library's macro, this one
/// never panics.
macro_rules! eprintln {
    ($($text:tt)*) => { $crate::report::tell(format_args!($($text)*)) };
}

mod arguments;
mod bench;
mod commands;
#[cfg(feature = "viewer")]
mod gallery;
mod haptics;
mod info;
#[cfg(feature = "viewer")]
mod look;
mod mesh;
mod page;
#[cfg_attr(not(feature = "viewer"), path = "no_pictures.rs")]
mod pictures;
mod prepare;
mod report;
mod reproduce;
mod signals;
#[cfg(feature = "viewer")]
mod view;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    let arguments = match arguments::Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => return mistyped(&error),
    };
    let json = arguments.command.wants_json();
    match commands::execute(arguments.command) {
        Ok(code) => code,
        Err(failure) => report::failure(&failure, json),
    }
}

/// An invalid command line, or a request for help.
fn mistyped(error: &clap::Error) -> ExitCode {
    if error.use_stderr() && std::env::args().any(|argument| argument == "--json") {
        report::refused(error.to_string().trim_end());
    }
    // A closed terminal is not an error.
    let _ = error.print();
    ExitCode::from(error.exit_code() as u8)
}
