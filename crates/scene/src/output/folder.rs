//! The folder a run writes to.

use std::fs;
use std::path::{Path, PathBuf};

use super::OutputError;
use crate::scene::Scene;

/// Where a run writes.
#[derive(Clone, Debug)]
pub struct OutputFolder {
    path: PathBuf,
}

impl OutputFolder {
    /// `out/NAME` with the name of the scene's folder (of the file, for another name than `scene.toml`).
    pub fn default_for(scene_file: &Path) -> PathBuf {
        let stem = scene_file.file_stem().unwrap_or_default();
        let folder =
            fs::canonicalize(scene_file).ok().and_then(|p| p.parent()?.file_name().map(ToOwned::to_owned));
        let name = match folder {
            Some(folder) if stem == "scene" => folder,
            _ => stem.to_owned(),
        };
        Path::new("out").join(name)
    }

    /// Makes the folder. One that holds something is refused unless `force` is given; then what an earlier run of the
    /// same outputs left is removed, and nothing else.
    ///
    /// # Errors
    /// If the folder holds something, or can't be written to.
    pub fn prepare(path: PathBuf, scene: &Scene, force: bool) -> Result<Self, OutputError> {
        let failed = |error: std::io::Error| OutputError::new(&path, error);
        if path.exists() && !path.is_dir() {
            return Err(OutputError::new(&path, "it is a file, not a folder"));
        }
        if path.is_dir() {
            let filled = fs::read_dir(&path).map_err(failed)?.next().is_some();
            if filled && !force {
                return Err(OutputError::new(
                    &path,
                    "it is not empty; add --force to overwrite it, or --out DIR",
                ));
            }
            for (name, _) in &scene.outputs {
                remove_series(&path.join(name)).map_err(failed)?;
            }
        } else {
            fs::create_dir_all(&path).map_err(failed)?;
        }
        let probe = path.join(".pliant-write-test");
        fs::write(&probe, b"").map_err(failed)?;
        fs::remove_file(&probe).map_err(failed)?;
        Ok(Self { path })
    }

    /// Its path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes a whole file in one go: under a temporary name first, so that a failure leaves the old one.
    pub(crate) fn write(&self, name: &str, content: &str) -> Result<PathBuf, OutputError> {
        let (path, temporary) = (self.path.join(name), self.path.join(format!("{name}.tmp")));
        fs::write(&temporary, content)
            .and_then(|()| fs::rename(&temporary, &path))
            .map_err(|error| OutputError::new(&path, error))?;
        Ok(path)
    }
}

/// Removes the frames of an earlier run, so that a series never mixes two.
fn remove_series(folder: &Path) -> std::io::Result<()> {
    if !folder.is_dir() {
        return Ok(());
    }
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let frame =
            path.file_stem().is_some_and(|stem| stem.to_string_lossy().bytes().all(|b| b.is_ascii_digit()));
        if frame && path.extension().is_some_and(|extension| extension == "vtu") {
            fs::remove_file(path)?;
        }
    }
    Ok(())
}
