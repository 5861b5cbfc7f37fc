//! Tables in Markdown pages, updated between two marks: `<!-- pliant-lab COMMAND: start -->` and
//! `<!-- pliant-lab COMMAND: end -->`.

use std::fs;
use std::path::{Path, PathBuf};

use pliant_command::{Failure, tell};

/// A page with a place for the table of a command.
pub struct Page {
    path: PathBuf,
    /// Up to the first mark, which it includes.
    before: String,
    /// From the second mark on.
    after: String,
}

impl Page {
    pub fn read(path: &Path, command: &str) -> Result<Self, Failure> {
        let text = fs::read_to_string(path).map_err(|error| {
            Failure::plain(
                format!("`{}` cannot be read: {error}", path.display()),
                "check the name after `--table`",
            )
        })?;
        let marks = ["start", "end"].map(|place| format!("<!-- pliant-lab {command}: {place} -->"));
        let (before, after) = around(&text, &marks).ok_or_else(|| {
            let [start, end] = &marks;
            Failure::plain(
                format!("`{}` has no place for the table", path.display()),
                format!("add the lines {start} and {end} at its place"),
            )
        })?;
        Ok(Self { path: path.to_owned(), before: before.into(), after: after.into() })
    }

    /// Writes the page with a new table, which ends with a newline.
    pub fn renew(&self, table: &str) -> Result<(), Failure> {
        let Self { path, before, after } = self;
        fs::write(path, format!("{before}\n{table}{after}")).map_err(|error| {
            let message = format!("`{}` cannot be written: {error}", path.display());
            Failure::plain(message, "check the file and its permissions")
        })?;
        tell(format_args!("updated the table in {}", path.display()));
        Ok(())
    }
}

/// The text up to the end of the first mark, and from the second mark on.
fn around<'t>(text: &'t str, [start, end]: &[String; 2]) -> Option<(&'t str, &'t str)> {
    let from = text.find(start)? + start.len();
    let to = from + text[from..].find(end)?;
    Some((&text[..from], &text[to..]))
}
