//! `pliant`: real-time simulation of soft organs. Words and wiring only; the work is done by the libraries.

mod arguments;
mod commands;
mod report;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    let arguments = arguments::Arguments::parse();
    let json = arguments.command.wants_json();
    match commands::execute(arguments.command) {
        Ok(code) => code,
        Err(failure) => report::failure(&failure, json),
    }
}
