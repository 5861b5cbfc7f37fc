//! Files that the window writes beside a scene.

use std::fs::File;
use std::io::{Error, ErrorKind};
use std::path::{Path, PathBuf};

/// Makes `NAME-WHAT.EXTENSION` beside the file of a scene, with a number where there is one already: it never
/// overwrites.
///
/// # Errors
/// If the folder cannot be written.
pub(crate) fn create_beside(scene: &Path, what: &str, extension: &str) -> Result<(PathBuf, File), Error> {
    let stem = scene.file_stem().map_or("scene".into(), |stem| stem.to_string_lossy());
    let mut number = 1;
    loop {
        let more = if number > 1 { format!("-{number}") } else { String::new() };
        let path = scene.with_file_name(format!("{stem}-{what}{more}.{extension}"));
        match File::create_new(&path) {
            Ok(file) => return Ok((path, file)),
            Err(error) if error.kind() == ErrorKind::AlreadyExists => number += 1,
            Err(error) => return Err(error),
        }
    }
}
