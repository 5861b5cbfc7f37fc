//! The binary: [`pliant_command`] with the words of the command line.

fn main() -> std::process::ExitCode {
    pliant_command::main(std::env::args_os()).into()
}
