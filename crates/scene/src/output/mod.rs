//! Observers: they write down instants of a run and never change the state.

mod csv;
mod curved;
mod field_mesh;
mod fields;
mod file;
mod folder;
mod merged;
mod plot;
mod stability;
mod strains;
mod summary;
mod vtu;

use std::path::{Path, PathBuf};

use pliant_sim::Instant;
use serde::{Deserialize, Serialize};

pub(crate) use file::{check_own_folder, replace};
pub use folder::OutputFolder;
pub(crate) use folder::{CONVERGENCE, PICTURE, PLOT, SUMMARY};
pub use stability::{AddedMass, StabilitySummary};
pub(crate) use strains::ShellStrains;
pub use strains::StrainSummary;
pub use summary::{BodySummary, ParticipantSummary, Summary, failed_input, failed_output};

pub use csv::Column;
pub(crate) use csv::{AXES, ENERGIES, Samples};
pub(crate) use field_mesh::FieldMesh;
pub(crate) use plot::{constraints, plot};
pub(crate) use summary::{INTERRUPTED, bodies, interrupted, markdown, output_failure, summarise, told_limit};

use crate::assemble::Built;
use crate::registry::OutputTable;
use crate::world::{Part, World};

/// An output that could not be written.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("`{path}` cannot be written: {reason}")]
pub struct OutputError {
    /// The file or folder.
    pub path: PathBuf,
    /// What the system says.
    pub reason: String,
    /// What to try.
    pub remedy: &'static str,
}

impl OutputError {
    pub(crate) fn new(path: &Path, reason: impl ToString) -> Self {
        let remedy =
            "check the folder, its permissions and the free space, or choose another with `--out DIR`";
        Self { path: path.to_owned(), reason: reason.to_string(), remedy }
    }
}

/// One participant at an instant, seen between the two halves of a step.
#[derive(Clone, Copy)]
pub(crate) struct Frame<'a> {
    pub part: &'a Part,
    pub now: &'a dyn Instant,
}

impl Frame<'_> {
    fn built(&self) -> &Built {
        &self.part.built
    }

    /// Force [N] that holds or moves the nodes of each constraint.
    pub(crate) fn reactions(&self) -> impl Iterator<Item = [f64; 3]> {
        (0..self.built().model.constraints.len()).map(|constraint| self.now.reaction(constraint))
    }
}

/// Time of the instant of frames [s].
pub(crate) fn time_of(frames: &[Frame<'_>]) -> f64 {
    frames.first().map_or(0.0, |frame| frame.now.time())
}

/// Looks at the instants of a run.
pub(crate) trait Observer {
    /// Writes down an instant of all participants.
    fn see(&mut self, frames: &[Frame<'_>]) -> Result<(), OutputError>;

    /// What is written so far.
    fn written(&self) -> Written;

    /// Removes what an interrupted run had written beyond the end of the one that went on with it.
    fn finish(&mut self) -> Result<(), OutputError>;
}

/// What an output has written, for a run that goes on with it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum Written {
    /// Whole rows of a table.
    Rows {
        /// Bytes of them and the header.
        bytes: u64,
        /// CRC-32 of these bytes.
        crc: u32,
    },
    /// Frames of a series: their times [s].
    Frames(Vec<f64>),
}

/// When an observer looks: at the first instant, at the one nearest to each multiple of an interval, and at the last.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Schedule {
    every: f64,
    seen: u64,
    /// The last instant that it was due at; before the first, none is.
    last: f64,
}

impl Schedule {
    pub fn new(every: f64) -> Self {
        Self { every, seen: 0, last: f64::NEG_INFINITY }
    }

    /// One that has seen all up to an instant, that included.
    pub fn after(every: f64, time: f64, step: f64) -> Self {
        let mut schedule = Self::new(every);
        schedule.is_due(time, step, true);
        schedule
    }

    /// Whether the observer has yet to see an instant.
    pub fn awaits(&self, time: f64, step: f64, last: bool) -> bool {
        last || time + 0.5 * step >= self.seen as f64 * self.every
    }

    /// How many steps from a time miss no instant that the observer has to see; at least one.
    pub fn stride(&self, time: f64, step: f64) -> u64 {
        steps_to(self.seen as f64 * self.every, time, step)
    }

    /// Whether the observer has to see an instant; it then counts as seen.
    pub fn is_due(&mut self, time: f64, step: f64, last: bool) -> bool {
        let due = self.awaits(time, step, last);
        if due {
            self.seen = (((time + 0.5 * step) / self.every).floor() as u64).saturating_add(1);
            self.last = time;
        }
        due
    }

    /// Whether it was due at this instant.
    pub fn has_seen(&self, time: f64) -> bool {
        self.last == time
    }
}

/// Steps from a time to the instant nearest to another time, at least one; rather one too few than one too many.
pub(crate) fn steps_to(goal: f64, time: f64, step: f64) -> u64 {
    (((goal - time) / step - 0.5 - 1e-6).ceil()).max(1.0) as u64
}

/// An observer with its schedule.
pub(crate) type Scheduled = (Schedule, Box<dyn Observer>);

/// The observers of a scene's outputs. Their files are opened here; all paths go to `files`. Those of a run that goes
/// on take up what is `written`.
pub(crate) fn observers(
    world: &World,
    folder: &Path,
    files: &mut Vec<PathBuf>,
    written: Option<&[(Schedule, Written)]>,
) -> Result<Vec<Scheduled>, OutputError> {
    let mut all: Vec<Scheduled> = Vec::new();
    for (index, (name, table)) in world.scene.outputs.iter().enumerate() {
        let before = written.and_then(|written| written.get(index));
        let (every, observer): (f64, Box<dyn Observer>) = match table {
            OutputTable::Vtu(table) => {
                let mut series = vtu::Series::new(world, table, folder, name)?;
                if let Some((_, Written::Frames(times))) = before {
                    series.take_up(times);
                }
                files.push(series.index().to_owned());
                (table.every, Box::new(series))
            }
            OutputTable::Csv(table) => {
                let mut rows = csv::Rows::new(world, table, folder, name);
                match before {
                    Some((_, Written::Rows { bytes, crc })) => rows.take_up(*bytes, *crc)?,
                    _ => rows.start()?,
                }
                files.push(rows.path().to_owned());
                (table.every, Box::new(rows))
            }
        };
        all.push((before.map_or(Schedule::new(every), |(schedule, _)| *schedule), observer));
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_schedule_sees_the_first_the_nearest_and_the_last_instant() {
        let mut schedule = Schedule::new(0.1);
        let step = 0.03;
        let seen: Vec<u32> =
            (0..=10).filter(|&n| schedule.is_due(f64::from(n) * step, step, n == 10)).collect();
        // 0.00, 0.09, 0.21, 0.30.
        assert_eq!(seen, [0, 3, 7, 10]);
    }

    #[test]
    fn strides_miss_no_instant() {
        for (every, step) in [(0.1, 0.03), (0.1, 0.1), (0.1, 0.02), (0.01, 0.05), (1.0, 1e-4)] {
            let end = 20_000_u64;
            let mut one_by_one = Schedule::new(every);
            let mut in_strides = one_by_one;
            let seen: Vec<u64> =
                (0..end).filter(|&n| one_by_one.is_due(n as f64 * step, step, false)).collect();
            let (mut found, mut looks, mut n) = (Vec::new(), 0, 0);
            while n < end {
                looks += 1;
                if in_strides.is_due(n as f64 * step, step, false) {
                    found.push(n);
                }
                n += in_strides.stride(n as f64 * step, step);
            }
            assert_eq!(seen, found, "every {every} s in steps of {step} s");
            assert!(looks <= 2 * seen.len(), "{looks} looks for {} instants", seen.len());
        }
    }

    #[test]
    fn an_interval_below_the_step_sees_every_instant_once() {
        let mut schedule = Schedule::new(0.01);
        assert!((0..20).all(|n| schedule.is_due(f64::from(n) * 0.05, 0.05, false)));
        // More intervals than an integer counts.
        let mut schedule = Schedule::new(1e-300);
        assert!((0..20).all(|n| schedule.is_due(f64::from(n) * 0.05, 0.05, false)));
    }
}
