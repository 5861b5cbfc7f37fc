//! Files that a scene may read: regular files of bounded length, with `--sandbox` only those in its folder.

use std::io;
use std::path::{Path, PathBuf};

use pliant_geometry::io::read_limited;

/// Longest scene file [bytes].
pub(crate) const LONGEST_SCENE: u64 = 1 << 26;
/// Longest table and XML model [bytes].
pub const LONGEST_TABLE: u64 = 1 << 30;

/// Files that may be read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Reads {
    within: Option<PathBuf>,
}

impl Reads {
    /// Allows any file that this user can read.
    pub fn anywhere() -> Self {
        Self::default()
    }

    /// Allows files in a folder and in its subfolders. Links are resolved first: their targets count.
    ///
    /// # Errors
    /// If there is no such folder.
    pub fn within(folder: &Path) -> io::Result<Self> {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        Ok(Self { within: Some(folder.canonicalize()?) })
    }

    /// The folder that files have to be in, links resolved.
    pub fn folder(&self) -> Option<&Path> {
        self.within.as_deref()
    }

    /// The path by which a file may be read, links resolved where it matters.
    ///
    /// # Errors
    /// If the file may not be read or does not exist.
    pub fn allow(&self, path: &Path) -> io::Result<PathBuf> {
        let Some(folder) = &self.within else { return Ok(path.to_owned()) };
        let found = path.canonicalize()?;
        if found.starts_with(folder) {
            return Ok(found);
        }
        let reason = format!(
            "it is outside the scene's folder `{}`, and `--sandbox` allows nothing else; move it there, or leave \
             `--sandbox` out if you trust the scene",
            folder.display()
        );
        Err(io::Error::new(io::ErrorKind::PermissionDenied, reason))
    }

    /// The bytes of a file that may be read.
    ///
    /// # Errors
    /// If the file may not be read, is no regular file or is longer than `longest` bytes.
    pub fn read(&self, path: &Path, longest: u64) -> io::Result<Vec<u8>> {
        read_limited(&self.allow(path)?, longest)
    }
}

/// The text of a table beside a scene.
pub fn table(path: &Path) -> io::Result<String> {
    String::from_utf8(read_limited(path, LONGEST_TABLE)?).map_err(io::Error::other)
}

/// The rows of a table with the numbers of their lines. Empty lines and comments after a # are skipped.
pub fn rows_of(text: &str) -> impl Iterator<Item = (&str, usize)> {
    let lines = text.strip_prefix('\u{feff}').unwrap_or(text).lines().zip(1..);
    let rows = lines.map(|(line, number)| (line.split('#').next().unwrap_or("").trim(), number));
    rows.filter(|(row, _)| !row.is_empty())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn a_sandbox_allows_what_really_lies_in_its_folder() {
        let folder = tempfile::tempdir().unwrap();
        let inside = folder.path().join("scene");
        fs::create_dir_all(inside.join("meshes")).unwrap();
        fs::write(inside.join("meshes/a.vtk"), "a").unwrap();
        fs::write(folder.path().join("b.vtk"), "b").unwrap();
        let reads = Reads::within(&inside).unwrap();
        assert!(reads.allow(&inside.join("meshes/a.vtk")).is_ok());
        assert!(reads.allow(&inside.join("meshes/../meshes/a.vtk")).is_ok());
        for outside in [inside.join("../b.vtk"), folder.path().join("b.vtk")] {
            let error = reads.allow(&outside).unwrap_err();
            assert!(error.to_string().contains("outside the scene's folder"), "{error}");
        }
        assert!(Reads::anywhere().allow(Path::new("/")).is_ok());
    }
}
