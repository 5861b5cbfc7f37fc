//! The folder a run writes to.

use std::fs;
use std::path::{Path, PathBuf};

use super::{OutputError, Written, csv, vtu};
use crate::checkpoint::{Checkpoint, ResumeError, steps_of};
use crate::registry::OutputTable;
use crate::scene::Scene;

/// The page to read after a run.
pub(crate) const SUMMARY: &str = "summary.md";
/// The plot in it.
pub(crate) const PLOT: &str = "plot.svg";
/// Residuals of the iterations of a run that solves equations.
pub(crate) const CONVERGENCE: &str = "convergence.csv";
/// The picture of the last instant, if one was asked for.
pub(crate) const PICTURE: &str = "picture.png";

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
        let folder = Self::claim(path, force, |_| false)?;
        remove_earlier(folder.path(), scene).map_err(|error| OutputError::new(folder.path(), error))?;
        Ok(folder)
    }

    /// Makes the folder. One that holds something else than files called as `own` tells is refused unless `force` is
    /// given.
    ///
    /// # Errors
    /// If the folder holds something, or can't be written to.
    pub fn claim(path: PathBuf, force: bool, own: impl Fn(&str) -> bool) -> Result<Self, OutputError> {
        let failed = |error: std::io::Error| OutputError::new(&path, error);
        let refused =
            |reason: &str, remedy| OutputError { path: path.clone(), reason: reason.into(), remedy };
        if path.exists() && !path.is_dir() {
            return Err(refused("it is a file, not a folder", "choose another name with `--out DIR`"));
        }
        if path.is_dir() {
            let mut entries = fs::read_dir(&path).map_err(failed)?;
            let filled =
                entries.any(|entry| !entry.is_ok_and(|entry| own(&entry.file_name().to_string_lossy())));
            if filled && !force {
                let remedy = "add `--force` to replace what an earlier run left there, or choose another with `--out DIR`";
                return Err(refused("it is not empty", remedy));
            }
        } else {
            fs::create_dir_all(&path).map_err(failed)?;
        }
        probe(&path).map_err(failed)?;
        Ok(Self { path })
    }

    /// Opens the folder of an interrupted run to go on with it. Nothing in it changes yet.
    ///
    /// # Errors
    /// If it does not hold the outputs as they were at the checkpoint, or can't be written to.
    pub fn reopen(path: PathBuf, scene: &Scene, checkpoint: &Checkpoint) -> Result<Self, ResumeError> {
        let refused = |path: &Path, reason| ResumeError::OtherOutputs { path: path.to_owned(), reason };
        if !path.is_dir() {
            return Err(refused(&path, "there is no such folder".into()));
        }
        for ((name, _), (_, written)) in scene.outputs.iter().zip(&checkpoint.progressed.outputs) {
            let (file, verified) = match written {
                Written::Rows { bytes, crc } => {
                    let file = path.join(format!("{name}.csv"));
                    let verified = csv::verify(&file, *bytes, *crc);
                    (file, verified)
                }
                Written::Frames(times) => (path.join(format!("{name}.pvd")), vtu::verify(&path, name, times)),
            };
            verified.map_err(|reason| refused(&file, reason))?;
        }
        probe(&path).map_err(|error| refused(&path, error.to_string()))?;
        Ok(Self { path })
    }

    /// Removes a folder with the outputs of an earlier run of a scene; what is not of it stays.
    pub(crate) fn clear(path: &Path, scene: &Scene) -> std::io::Result<()> {
        remove_earlier(path, scene)?;
        for (name, table) in &scene.outputs {
            match table {
                OutputTable::Csv(_) => remove(&path.join(format!("{name}.csv")))?,
                OutputTable::Vtu(_) => remove_empty(&path.join(name))?,
            }
        }
        remove_empty(path)
    }

    /// Its path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes a whole file in one go: under a temporary name first, so that a failure leaves the old one.
    ///
    /// # Errors
    /// If it can't be written.
    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) -> Result<PathBuf, OutputError> {
        let (path, temporary) = (self.path.join(name), self.path.join(format!("{name}.tmp")));
        let written = fs::write(&temporary, content).and_then(|()| fs::rename(&temporary, &path));
        written.map_err(|error| {
            // What is half written is not left behind.
            let _ = fs::remove_file(&temporary);
            OutputError::new(&path, error)
        })?;
        Ok(path)
    }
}

/// Whether files can be made in a folder.
fn probe(folder: &Path) -> std::io::Result<()> {
    let probe = folder.join(".pliant-write-test");
    fs::write(&probe, b"")?;
    fs::remove_file(&probe)
}

/// Removes what an earlier run of the same outputs left, so that no file tells of another run than its neighbours.
/// A CSV file stays until it is written anew.
fn remove_earlier(folder: &Path, scene: &Scene) -> std::io::Result<()> {
    for page in [SUMMARY, PLOT, PICTURE, CONVERGENCE] {
        remove(&folder.join(page))?;
    }
    for entry in fs::read_dir(folder)? {
        let name = entry?.file_name().to_string_lossy().into_owned();
        if steps_of(name.strip_suffix(".tmp").unwrap_or(&name)).is_some() {
            remove(&folder.join(name))?;
        }
    }
    for (name, table) in &scene.outputs {
        if let OutputTable::Vtu(_) = table {
            remove(&folder.join(format!("{name}.pvd")))?;
            remove_frames(&folder.join(name))?;
        }
    }
    Ok(())
}

/// Removes `000000.vtu`, … and one that a killed run left unfinished.
fn remove_frames(folder: &Path) -> std::io::Result<()> {
    if !folder.is_dir() {
        return Ok(());
    }
    for entry in fs::read_dir(folder)? {
        let name = entry?.file_name().to_string_lossy().into_owned();
        let stem = name.strip_suffix(".tmp").unwrap_or(&name).strip_suffix(".vtu");
        if stem.is_some_and(|stem| !stem.is_empty() && stem.bytes().all(|byte| byte.is_ascii_digit())) {
            remove(&folder.join(name))?;
        }
    }
    Ok(())
}

/// Removes a folder that holds nothing, if there is one.
fn remove_empty(path: &Path) -> std::io::Result<()> {
    let empty = path.is_dir() && fs::read_dir(path)?.next().is_none();
    if empty { fs::remove_dir(path) } else { Ok(()) }
}

/// Removes a regular file, if there is one.
fn remove(path: &Path) -> std::io::Result<()> {
    match fs::symlink_metadata(path) {
        Ok(found) if found.is_file() => fs::remove_file(path),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outputs_are_called_after_the_folder_of_the_scene() {
        assert_eq!(OutputFolder::default_for(Path::new("nowhere/liver.toml")), Path::new("out/liver"));
        let here = OutputFolder::default_for(Path::new("src/scene.toml"));
        // A scene.toml that does not exist has no folder to be called after.
        assert_eq!(here, Path::new("out/scene"));
    }
}
