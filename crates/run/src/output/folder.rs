//! The folder a run writes to. One run at a time holds it.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use pliant_format::Scene;
use pliant_format::registry::OutputTable;

use super::file::{check_own, check_own_folder, is_at, replace, temporary};
use super::{OutputError, Written, csv, vtu};
use crate::checkpoint::{Checkpoint, ResumeError, steps_of};

/// The page to read after a run.
pub(crate) const SUMMARY: &str = "summary.md";
/// The plot in it.
pub(crate) const PLOT: &str = "plot.svg";
/// Residuals of the iterations of a run that solves equations.
pub(crate) const CONVERGENCE: &str = "convergence.csv";
/// The picture of the last instant, if requested.
pub(crate) const PICTURE: &str = "picture.png";
/// Locked by the run that writes to the folder; holds the number of its process.
const LOCK: &str = ".pliant-lock";

/// The output folder of a run. As long as this value or a clone lives, no other run gets the folder.
#[derive(Clone, Debug)]
pub struct OutputFolder {
    path: PathBuf,
    _lock: Arc<Lock>,
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

    /// Makes the folder. A non-empty folder is rejected unless `force` is given; then the files of an earlier
    /// run of the same outputs are removed, and nothing else.
    ///
    /// # Errors
    /// If the folder holds something, holds a link where this run would write, is held by another run, or
    /// can't be written to.
    pub fn prepare(path: PathBuf, scene: &Scene, force: bool) -> Result<Self, OutputError> {
        let folder = Self::claim(path, force, |_| false)?;
        remove_earlier(folder.path(), scene)?;
        Ok(folder)
    }

    /// Makes the folder. One with files for whose names `is_own` is false is rejected without `force`.
    ///
    /// # Errors
    /// If the folder holds something, is held by another run, or can't be written to.
    pub fn claim(path: PathBuf, force: bool, is_own: impl Fn(&str) -> bool) -> Result<Self, OutputError> {
        let failed = |error: io::Error| OutputError::new(&path, error);
        let refused =
            |reason: &str, remedy| OutputError { path: path.clone(), reason: reason.into(), remedy };
        if path.exists() && !path.is_dir() {
            return Err(refused("it is a file, not a folder", "choose another name with `--out DIR`"));
        }
        fs::create_dir_all(&path).map_err(failed)?;
        let lock = Lock::take(&path)?;
        let mut entries = fs::read_dir(&path).map_err(failed)?;
        let filled = entries.any(|entry| {
            let name = entry.map(|entry| entry.file_name().to_string_lossy().into_owned());
            !name.is_ok_and(|name| name == LOCK || is_own(&name))
        });
        if filled && !force {
            let remedy =
                "add `--force` to replace what an earlier run left there, or choose another with `--out DIR`";
            return Err(refused("it is not empty", remedy));
        }
        Ok(Self { path, _lock: Arc::new(lock) })
    }

    /// Opens the folder of an interrupted run to continue the run. The files do not change yet.
    ///
    /// # Errors
    /// If the folder does not hold the outputs as they were at the checkpoint, or nothing is left to run.
    /// Also if another run holds the folder or it can't be written to.
    pub fn reopen(path: PathBuf, scene: &Scene, checkpoint: &Checkpoint) -> Result<Self, ResumeError> {
        let refused = |path: &Path, reason| ResumeError::OtherOutputs { path: path.to_owned(), reason };
        if !path.is_dir() {
            return Err(refused(&path, "there is no such folder".into()));
        }
        let lock = Lock::take(&path)?;
        check_links(&path, scene)?;
        for ((name, _), (_, written)) in scene.outputs.iter().zip(&checkpoint.progressed.outputs) {
            let (file, verified) = match written {
                Written::Rows { bytes, crc } => {
                    let file = table_file(&path, name);
                    let verified = csv::verify(&file, *bytes, *crc);
                    (file, verified)
                }
                Written::Frames(times) => (series_file(&path, name), vtu::verify(&path, name, times)),
            };
            verified.map_err(|reason| refused(&file, reason))?;
        }
        let (time, until) = (checkpoint.time(), scene.scene.until);
        if checkpoint.is_at_the_end(until) && has_ended(&path, scene, time) {
            return Err(ResumeError::AtTheEnd { time, until });
        }
        Ok(Self { path, _lock: Arc::new(lock) })
    }

    /// Removes the files of a finished run and the unfinished files of a killed one, before a resumed run
    /// continues. Only a run that has ended leaves pages.
    pub(crate) fn go_on(&self, scene: &Scene) -> Result<(), OutputError> {
        let removed = || -> io::Result<()> {
            remove_pages(&self.path)?;
            let mut frames = scene.outputs.iter().map(|(name, _)| self.path.join(name));
            frames.try_for_each(|frames| remove_frames(&frames, ".vtu.tmp"))
        };
        removed().map_err(|error| OutputError::new(&self.path, error))
    }

    /// Removes a folder with the outputs of an earlier run of a scene; other files stay.
    pub(crate) fn clear(path: &Path, scene: &Scene) -> Result<(), OutputError> {
        remove_earlier(path, scene)?;
        let cleared = || -> io::Result<()> {
            remove(&path.join(LOCK))?;
            for (name, table) in &scene.outputs {
                match table {
                    OutputTable::Csv(_) => remove(&table_file(path, name))?,
                    OutputTable::Vtu(_) => remove_empty(&path.join(name))?,
                }
            }
            remove_empty(path)
        };
        cleared().map_err(|error| OutputError::new(path, error))
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
        let path = self.path.join(name);
        replace(&path, |file| file.write_all(content.as_ref()))
            .map_err(|error| OutputError::new(&path, error))?;
        Ok(path)
    }
}

/// A locked file in a folder. The system gives the lock back when the process ends, however it ends.
#[derive(Debug)]
struct Lock {
    path: PathBuf,
    file: File,
}

impl Lock {
    fn take(folder: &Path) -> Result<Self, OutputError> {
        let path = folder.join(LOCK);
        let failed = |error: io::Error| OutputError::new(folder, error);
        loop {
            check_own(&path).map_err(|error| OutputError::new(&path, error))?;
            let opened = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path);
            let mut file = opened.map_err(failed)?;
            if let Err(TryLockError::WouldBlock) = file.try_lock() {
                return Err(held(folder, &mut file));
            }
            // Otherwise locked, or on a file system without locks. The last holder may have removed the file
            // meanwhile.
            if is_at(&file, &path).map_err(failed)? {
                let lock = Self { path, file };
                lock.sign();
                return Ok(lock);
            }
        }
    }

    /// Writes the number of this process into the lock, for later processes. A lock without a number holds as
    /// well.
    fn sign(&self) {
        let mut file = &self.file;
        let _ = self.file.set_len(0).and_then(|()| write!(file, "{}", std::process::id()));
    }
}

impl Drop for Lock {
    /// The name is removed before the lock, so that no run locks a file about to disappear.
    fn drop(&mut self) {
        if is_at(&self.file, &self.path).unwrap_or(false) {
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// The error of a folder that another run holds.
fn held(folder: &Path, file: &mut File) -> OutputError {
    let mut number = String::new();
    let read = file.rewind().and_then(|()| file.take(20).read_to_string(&mut number));
    let process = match read {
        Ok(_) if number.parse::<u32>().is_ok() => format!(" (process {number})"),
        _ => String::new(),
    };
    OutputError {
        path: folder.to_owned(),
        reason: format!("another run{process} is writing to it"),
        remedy: "wait until it has ended, or choose another folder with `--out DIR`",
    }
}

/// The table of an output.
fn table_file(folder: &Path, name: &str) -> PathBuf {
    folder.join(format!("{name}.csv"))
}

/// The list of the frames of an output.
fn series_file(folder: &Path, name: &str) -> PathBuf {
    folder.join(format!("{name}.pvd"))
}

/// Refuses links where a run of a scene writes.
fn check_links(folder: &Path, scene: &Scene) -> Result<(), OutputError> {
    let check = |path: PathBuf| check_own(&path).map_err(|error| OutputError::new(&path, error));
    for page in [SUMMARY, PLOT, PICTURE, CONVERGENCE] {
        check(folder.join(page))?;
    }
    for (name, table) in &scene.outputs {
        match table {
            OutputTable::Csv(_) => check(table_file(folder, name))?,
            OutputTable::Vtu(_) => {
                check(series_file(folder, name))?;
                let frames = folder.join(name);
                check_own_folder(&frames).map_err(|error| OutputError::new(&frames, error))?;
            }
        }
    }
    Ok(())
}

/// True if the folder holds everything that a run writes at its end.
fn has_ended(folder: &Path, scene: &Scene, time: f64) -> bool {
    let pages = [SUMMARY, PLOT].iter().all(|page| folder.join(page).is_file());
    let outputs = || {
        scene.outputs.iter().all(|(name, table)| match table {
            OutputTable::Csv(_) => csv::last_time(&table_file(folder, name)) == Some(time),
            OutputTable::Vtu(_) => vtu::last_time(folder, name) == Some(time),
        })
    };
    pages && outputs()
}

/// Removes the files of an earlier run of the same outputs, so that all files belong to one run.
/// A CSV file stays until it is written anew.
fn remove_earlier(folder: &Path, scene: &Scene) -> Result<(), OutputError> {
    check_links(folder, scene)?;
    let removed = || -> io::Result<()> {
        remove_pages(folder)?;
        for entry in fs::read_dir(folder)? {
            let name = entry?.file_name().to_string_lossy().into_owned();
            if steps_of(&name).is_some() {
                remove(&folder.join(name))?;
            }
        }
        for (name, table) in &scene.outputs {
            if let OutputTable::Vtu(_) = table {
                remove(&series_file(folder, name))?;
                for ending in [".vtu", ".vtu.tmp"] {
                    remove_frames(&folder.join(name), ending)?;
                }
            }
        }
        Ok(())
    };
    removed().map_err(|error| OutputError::new(folder, error))
}

/// Removes the pages of a run, and pages and checkpoints that a killed run left unfinished.
fn remove_pages(folder: &Path) -> io::Result<()> {
    for page in [SUMMARY, PLOT, PICTURE, CONVERGENCE] {
        let page = folder.join(page);
        remove(&page)?;
        remove(&temporary(&page))?;
    }
    for entry in fs::read_dir(folder)? {
        let name = entry?.file_name().to_string_lossy().into_owned();
        if name.strip_suffix(".tmp").and_then(steps_of).is_some() {
            remove(&folder.join(name))?;
        }
    }
    Ok(())
}

/// Removes `000000.vtu`, …, or the files with another ending that a killed run left unfinished.
fn remove_frames(folder: &Path, ending: &str) -> io::Result<()> {
    if !folder.is_dir() {
        return Ok(());
    }
    for entry in fs::read_dir(folder)? {
        let name = entry?.file_name().to_string_lossy().into_owned();
        let stem = name.strip_suffix(ending);
        if stem.is_some_and(|stem| !stem.is_empty() && stem.bytes().all(|byte| byte.is_ascii_digit())) {
            remove(&folder.join(name))?;
        }
    }
    Ok(())
}

/// Removes a folder that holds nothing, if there is one.
fn remove_empty(path: &Path) -> io::Result<()> {
    let empty = path.is_dir() && fs::read_dir(path)?.next().is_none();
    if empty { fs::remove_dir(path) } else { Ok(()) }
}

/// Removes a regular file, if there is one.
fn remove(path: &Path) -> io::Result<()> {
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
