//! Files in an output folder: made whole, and never through a link, which could lead to a file elsewhere.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};

/// Rejects a link and anything else that is neither a regular file nor missing.
pub(crate) fn check_own(path: &Path) -> io::Result<()> {
    match fs::symlink_metadata(path) {
        Ok(found) if found.is_symlink() => Err(link(path)),
        Ok(found) if !found.is_file() => {
            Err(io::Error::other("it is not a regular file; move it away, or choose another folder"))
        }
        _ => Ok(()),
    }
}

/// Rejects a folder that is a link.
pub(crate) fn check_own_folder(path: &Path) -> io::Result<()> {
    if path.is_symlink() { Err(link(path)) } else { Ok(()) }
}

fn link(path: &Path) -> io::Error {
    let goal = fs::read_link(path).unwrap_or_default();
    io::Error::other(format!(
        "`{}` is a link to `{}`, and links inside an output folder are not followed; remove it",
        path.display(),
        goal.display()
    ))
}

/// Makes a new file in place of an older one of that name.
pub(crate) fn create(path: &Path) -> io::Result<File> {
    check_own(path)?;
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        // A link that appears now is an error, too.
        _ => File::create_new(path),
    }
}

/// Opens an existing file to read it and append to it.
pub(crate) fn reopen(path: &Path) -> io::Result<File> {
    check_own(path)?;
    let file = OpenOptions::new().read(true).write(true).open(path)?;
    if is_at(&file, path)? { Ok(file) } else { Err(link(path)) }
}

/// True if a path leads to the open file itself, and not through a link.
#[cfg(unix)]
pub(crate) fn is_at(file: &File, path: &Path) -> io::Result<bool> {
    use std::os::unix::fs::MetadataExt;
    let opened = file.metadata()?;
    match fs::symlink_metadata(path) {
        Ok(found) => Ok((found.dev(), found.ino()) == (opened.dev(), opened.ino())),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

/// True if a path leads to the open file itself; except on Unix an open file keeps its name.
#[cfg(not(unix))]
pub(crate) fn is_at(_: &File, _: &Path) -> io::Result<bool> {
    Ok(true)
}

/// The name under which a file is written before it is whole.
pub(crate) fn temporary(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".tmp");
    name.into()
}

/// Writes a whole file under its temporary name, then gives it its own; a failure leaves the old file and
/// nothing else.
pub(crate) fn replace(path: &Path, write: impl FnOnce(&mut File) -> io::Result<()>) -> io::Result<()> {
    check_own(path)?;
    let temporary = temporary(path);
    let mut file = create(&temporary)?;
    let written = write(&mut file).and_then(|()| fs::rename(&temporary, path));
    if written.is_err() {
        // A half-written file is not left behind.
        let _ = fs::remove_file(&temporary);
    }
    written
}
