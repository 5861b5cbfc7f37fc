//! `pliant-lab`: results of the literature, computed again and compared with the published ones, and the cost of a step on this machine. The
//! libraries in `bench` and `reproduce` compute; `validation` has a test per claim, `peers` measures other programs.

mod arguments;
mod bench;
mod page;
mod report;
mod reproduce;

use clap::Parser;

use crate::arguments::{Arguments, Command};

fn main() -> std::process::ExitCode {
    let (json, result) = match Arguments::parse().command {
        Command::Reproduce(arguments) => (false, reproduce::reproduce(&arguments)),
        Command::Bench(arguments) => (arguments.json, bench::bench(&arguments)),
    };
    result.unwrap_or_else(|failure| failure.tell(json)).into()
}
