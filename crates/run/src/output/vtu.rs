//! A ParaView series: `X/000000.vtu`, … and `X.pvd`, whole after each frame, so that a killed run leaves a
//! series that can be read. Points are at rest; `displacement` warps them.

use std::fs::{self, File};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use pliant_format::tables::VtuTable;
use pliant_geometry::io::{
    MeshFileError, PVD_TAIL, VtuOptions, VtuSeries, pvd_entry, pvd_text, read_pvd, read_torn_pvd,
};
use pliant_scene::World;

use super::field_mesh::FieldMesh;
use super::file::{check_own_folder, is_at, reopen, replace};
use super::{Frame, Output, OutputError, Written, time_of};

pub(super) struct Series {
    folder: PathBuf,
    index: PathBuf,
    /// The index as it was last written, and the position where its entries end.
    open: Option<(File, u64)>,
    name: String,
    times: Vec<f64>,
    /// Times of the frames that an interrupted run had written beyond these; their files stay until they are
    /// replaced.
    beyond: Vec<f64>,
    shown: FieldMesh,
    frames: VtuSeries,
}

impl Series {
    pub(super) fn new(
        world: &World,
        table: &VtuTable,
        folder: &Path,
        name: &str,
    ) -> Result<Self, OutputError> {
        let path = folder.join(name);
        check_own_folder(&path)
            .and_then(|()| fs::create_dir_all(&path))
            .map_err(|error| OutputError::new(&path, error))?;
        Ok(Self {
            folder: path,
            index: folder.join(format!("{name}.pvd")),
            open: None,
            name: name.into(),
            times: Vec::new(),
            beyond: Vec::new(),
            shown: FieldMesh::new(world, table),
            frames: VtuSeries::default(),
        })
    }

    /// The `.pvd` file.
    pub(super) fn index(&self) -> &Path {
        &self.index
    }

    /// Continues after the frames that an interrupted run had at its checkpoint.
    pub(super) fn take_up(&mut self, times: &[f64]) {
        self.times = times.to_vec();
        self.beyond = listed(&self.index).unwrap_or_default().into_iter().skip(times.len()).collect();
    }

    /// The file of a frame as the index names it.
    fn listed_name(&self, index: usize) -> String {
        format!("{}/{}", self.name, frame_name(index))
    }

    /// Adds the last frame to the index.
    fn list(&mut self) -> Result<(), OutputError> {
        let open = self.open.take();
        let listed = match (open, self.times.last()) {
            (Some((file, end)), Some(&time)) if self.beyond.is_empty() => self.append(file, end, time),
            _ => self.list_all(),
        };
        self.open = listed.map_err(|error| OutputError::new(&self.index, error))?;
        Ok(())
    }

    /// Writes an entry and the end of the list over its old end, at once: who reads finds it whole before and
    /// after.
    fn append(&self, mut file: File, end: u64, time: f64) -> io::Result<Option<(File, u64)>> {
        // Somebody may have put another one in its place, or written in it.
        if !is_at(&file, &self.index)? || file.metadata()?.len() != end + PVD_TAIL.len() as u64 {
            return self.list_all();
        }
        let entry = pvd_entry(time, &self.listed_name(self.times.len() - 1)).map_err(io::Error::other)?;
        let mut write = |text: &str| {
            file.seek(SeekFrom::Start(end))?;
            file.write_all(text.as_bytes())?;
            file.set_len(end + text.len() as u64)
        };
        let written = write(&format!("{entry}{PVD_TAIL}"));
        if written.is_err() {
            // The old end has its place on most disks.
            let _ = write(PVD_TAIL);
        }
        written.map(|()| Some((file, end + entry.len() as u64)))
    }

    /// Writes the list of all frames in place of the old one; returns it and where its entries end, if it can
    /// be written on.
    fn list_all(&self) -> io::Result<Option<(File, u64)>> {
        let frames = self.times.iter().chain(&self.beyond).enumerate();
        let list = pvd_text(frames.map(|(index, &time)| (time, self.listed_name(index))))
            .map_err(io::Error::other)?;
        replace(&self.index, |file| file.write_all(list.as_bytes()))?;
        // The index is written as a whole as long as it lists frames of an interrupted run.
        let file = self.beyond.is_empty().then(|| reopen(&self.index).ok()).flatten();
        Ok(file.map(|file| (file, (list.len() - PVD_TAIL.len()) as u64)))
    }
}

impl Output for Series {
    fn see(&mut self, frames: &[Frame<'_>]) -> Result<(), OutputError> {
        self.shown.fill(frames);
        let time = time_of(frames);
        let path = self.folder.join(frame_name(self.times.len()));
        let options = VtuOptions {
            compress: true,
            single: frames.iter().all(|frame| frame.now.is_single()),
            time: Some(time),
        };
        let written = replace(&path, |file| {
            let mut writer = BufWriter::new(file);
            let frame = self.frames.write(&mut writer, self.shown.mesh(), &options);
            frame.map_err(|error| match error {
                MeshFileError::Write { source, .. } => source,
                other => io::Error::other(other),
            })?;
            writer.flush()
        });
        written.map_err(|error| OutputError::new(&path, error))?;
        self.times.push(time);
        // A later frame of the interrupted run stays in the list as long as it comes later.
        if !self.beyond.is_empty() {
            self.beyond.remove(0);
        }
        if self.beyond.first().is_some_and(|&later| later <= time) {
            self.remove_beyond()?;
        }
        self.list()
    }

    fn written(&self) -> Written {
        Written::Frames(self.times.clone())
    }

    fn finish(&mut self) -> Result<(), OutputError> {
        if self.beyond.is_empty() {
            return Ok(());
        }
        self.remove_beyond()?;
        self.list()
    }
}

impl Series {
    fn remove_beyond(&mut self) -> Result<(), OutputError> {
        for index in 0..std::mem::take(&mut self.beyond).len() {
            let path = self.folder.join(frame_name(self.times.len() + index));
            match fs::remove_file(&path) {
                Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                    return Err(OutputError::new(&path, error));
                }
                _ => {}
            }
        }
        Ok(())
    }
}

fn frame_name(index: usize) -> String {
    format!("{index:06}.vtu")
}

/// Reads the times in a list of frames. If a run was stopped while it wrote the list, only whole entries
/// count.
fn listed(index: &Path) -> Result<Vec<f64>, String> {
    let frames = read_torn_pvd(index).map_err(|error| error.to_string())?;
    Ok(frames.into_iter().map(|(time, _)| time).collect())
}

/// The time [s] of the last frame of a series, if it is there and the list is whole.
pub(super) fn last_time(folder: &Path, name: &str) -> Option<f64> {
    let frames = read_pvd(&folder.join(format!("{name}.pvd"))).ok()?;
    let there = folder.join(name).join(frame_name(frames.len().checked_sub(1)?)).is_file();
    frames.last().map(|(time, _)| *time).filter(|_| there)
}

/// Checks that a series begins with frames of these times; returns the reason if not.
pub(super) fn verify(folder: &Path, name: &str, times: &[f64]) -> Result<(), String> {
    if times.is_empty() {
        return Ok(());
    }
    let listed = listed(&folder.join(format!("{name}.pvd")))?;
    if !listed.starts_with(times) {
        return Err("it does not list the frames of the interrupted run".into());
    }
    let missing = (0..times.len()).find(|&index| !folder.join(name).join(frame_name(index)).is_file());
    missing.map_or(Ok(()), |index| Err(format!("`{name}/{}` is missing", frame_name(index))))
}
