//! The reference page of the command line: the help of each command, as Markdown.

use std::fmt::Write;

use clap::CommandFactory;

use super::Arguments;

/// Columns of the help texts.
const WIDTH: usize = 100;

/// The page `docs/reference/command-line.md`.
pub fn page() -> String {
    let mut program = Arguments::command().term_width(WIDTH).disable_help_subcommand(true);
    program.build();
    let mut page = "# Command line\n\nWritten by `pliant schema --commands` from the help of each command; do not edit.\n".to_owned();
    section(&mut page, "pliant", &mut program);
    for command in program.get_subcommands_mut().filter(|command| !command.is_hide_set()) {
        let title = format!("pliant {}", command.get_name());
        section(&mut page, &title, command);
    }
    page
}

fn section(page: &mut String, title: &str, command: &mut clap::Command) {
    let help = command.render_long_help().to_string();
    // Lines that the terminal's width would break are kept whole; none ends in spaces.
    let help: Vec<&str> = help.lines().map(str::trim_end).collect();
    let _ = write!(page, "\n## {title}\n\n```text\n{}\n```\n", help.join("\n").trim_end());
}
