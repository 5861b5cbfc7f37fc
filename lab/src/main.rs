//! `pliant-lab`: results of the literature, computed again and compared with the published ones, and the cost
//! of a step on this machine. The libraries in `bench` and `reproduce` compute; `validation` has a test per
//! claim, `peers` measures other programs.

mod arguments;
mod bench;
mod page;
mod reproduce;

use crate::arguments::{Arguments, Command};

fn main() -> std::process::ExitCode {
    let wants_json =
        |arguments: &Arguments| matches!(&arguments.command, Command::Bench(bench) if bench.json);
    let execute = |arguments: Arguments| match arguments.command {
        Command::Reproduce(arguments) => reproduce::reproduce(&arguments),
        Command::Bench(arguments) => bench::bench(&arguments),
    };
    pliant_command::program(std::env::args_os(), wants_json, execute).into()
}
