//! `pliant`: real-time simulation of soft organs. This crate parses commands and prints results; the
//! libraries compute. The binary and the Python package both call [`main`].
//!
//! ```
//! let words = ["pliant", "schema", "--markdown"].map(std::ffi::OsString::from);
//! assert_eq!(pliant_command::main(words), pliant_command::SUCCESS);
//! ```

/// A line on standard error. A full disk or a closed pipe must not end a run: unlike the standard library's
/// macro, this one never panics.
macro_rules! eprintln {
    ($($text:tt)*) => { $crate::report::tell(format_args!($($text)*)) };
}

mod arguments;
mod commands;
mod haptics;
mod info;
#[cfg(feature = "viewer")]
mod look;
mod mesh;
#[cfg_attr(not(feature = "viewer"), path = "no_pictures.rs")]
mod pictures;
mod prepare;
mod report;
mod signals;
#[cfg(feature = "viewer")]
mod view;

use std::ffi::OsString;

use clap::Parser;

#[cfg(feature = "viewer")]
pub use pictures::{FinalPicture, look_of_world};
pub use report::{Bar, Failure, say, tell};

/// Exit code of a process that succeeded.
pub const SUCCESS: u8 = 0;

/// Executes a command line, whose first word is the program: prints, writes files, opens a window. Returns
/// the exit code.
pub fn main(words: impl IntoIterator<Item = OsString>) -> u8 {
    let wants_json = |arguments: &arguments::Arguments| arguments.command.wants_json();
    program(words, wants_json, |arguments| commands::execute(arguments.command))
}

/// Executes a command line of any program with commands, and returns the exit code. Prints errors, also as an
/// object on standard output if `wants_json` says so.
pub fn program<A: Parser>(
    words: impl IntoIterator<Item = OsString>,
    wants_json: impl FnOnce(&A) -> bool,
    execute: impl FnOnce(A) -> Result<u8, Failure>,
) -> u8 {
    signals::outlive_large_files();
    let words: Vec<OsString> = words.into_iter().collect();
    let arguments = match A::try_parse_from(&words) {
        Ok(arguments) => arguments,
        Err(error) => return mistyped(&error, &words),
    };
    let json = wants_json(&arguments);
    execute(arguments).unwrap_or_else(|failure| report::failure(&failure, json))
}

/// An invalid command line, or a request for help.
fn mistyped(error: &clap::Error, words: &[OsString]) -> u8 {
    if error.use_stderr() && words.iter().any(|word| word == "--json") {
        report::refused(error.to_string().trim_end());
    }
    // A closed terminal is not an error.
    let _ = error.print();
    error.exit_code() as u8
}
