//! Samples of a run for plots over time, and the table that they are written to. Their number is limited,
//! however long the run is.

use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use pliant_run::Column;

use crate::beside::create_beside;

/// Names of the forces of the hands.
pub(crate) const HAND: &str = "hand";
pub(crate) const SECOND_HAND: &str = "second-hand";
/// Samples kept.
const MOST: usize = 4000;

/// State of a run at one instant.
#[derive(Clone, Debug)]
pub struct Sample {
    /// Time [s].
    pub time: f64,
    /// Names and units.
    pub columns: Arc<[Column]>,
    /// Forces of the hands, energies, reactions, probes and displacements of points that are followed.
    pub values: Vec<f64>,
}

/// Samples of a run, in the order of time.
#[derive(Clone, Debug, Default)]
pub struct Samples {
    columns: Arc<[Column]>,
    /// Times [s].
    times: Vec<f64>,
    /// One after the other, each as long as there are columns.
    values: Vec<f64>,
    /// Number of samples seen for each one that is kept.
    every: u64,
    /// Number of samples since the last kept one.
    passed: u64,
}

impl Samples {
    /// Names and units.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// Returns the number of samples.
    pub fn len(&self) -> usize {
        self.times.len()
    }

    /// True if there are no samples.
    pub fn is_empty(&self) -> bool {
        self.times.is_empty()
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// Adds a sample, unless the last one has the same time. If the run went back, the later samples are
    /// removed first. When the limit is exceeded, every second sample is removed, and later samples are taken
    /// half as often.
    pub fn take(&mut self, Sample { time, columns, values }: Sample) {
        let last = self.times.last().copied().unwrap_or(-1.0);
        if time < last {
            self.forget_from(time);
        } else if time == last {
            return;
        }
        if self.columns != columns {
            self.rearrange(&columns);
        }
        self.passed += 1;
        if self.passed < self.every {
            return;
        }
        self.passed = 0;
        self.times.push(time);
        self.values.extend(values);
        if self.times.len() > MOST {
            let width = self.columns.len();
            for kept in 0..MOST / 2 {
                let from = 2 * kept + 1;
                self.times[kept] = self.times[from];
                self.values.copy_within(from * width..(from + 1) * width, kept * width);
            }
            self.times.truncate(MOST / 2);
            self.values.truncate(MOST / 2 * width);
            self.every = 2 * self.every.max(1);
        }
    }

    /// Removes the samples from a time on; all if none is earlier.
    fn forget_from(&mut self, time: f64) {
        let kept = self.times.partition_point(|known| *known < time);
        if kept == 0 {
            return self.clear();
        }
        self.times.truncate(kept);
        self.values.truncate(kept * self.columns.len());
    }

    /// Changes the columns. Earlier values of new columns are NaN.
    fn rearrange(&mut self, columns: &Arc<[Column]>) {
        let places: Vec<_> =
            columns.iter().map(|new| self.columns.iter().position(|old| old == new)).collect();
        let width = self.columns.len().max(1);
        let rows = self.values.chunks_exact(width);
        let moved = rows.flat_map(|row| places.iter().map(move |place| place.map_or(f64::NAN, |at| row[at])));
        self.values = moved.collect();
        self.columns = columns.clone();
    }

    /// The curve of a column: times [s] and values.
    pub fn curve(&self, column: usize) -> impl Iterator<Item = [f64; 2]> + '_ {
        let width = self.columns.len().max(1);
        let values = self.values.iter().skip(column).step_by(width);
        self.times.iter().zip(values).map(|(time, value)| [*time, *value])
    }

    /// Writes a table with a header of names and units into the folder of a scene: `NAME-probes.csv`, with a
    /// number if that file exists. Unknown values are empty.
    ///
    /// # Errors
    /// If the file can't be written.
    pub fn write_beside(&self, scene: &Path) -> std::io::Result<PathBuf> {
        let (path, file) = create_beside(scene, "probes", "csv")?;
        let mut out = BufWriter::new(file);
        write!(out, "time [s]")?;
        for Column { name, unit } in self.columns.iter() {
            if unit.is_empty() { write!(out, ",{name}")? } else { write!(out, ",{name} [{unit}]")? }
        }
        writeln!(out)?;
        for (time, row) in self.times.iter().zip(self.values.chunks_exact(self.columns.len().max(1))) {
            write!(out, "{time:e}")?;
            for value in row {
                if value.is_nan() { write!(out, ",")? } else { write!(out, ",{value:e}")? }
            }
            writeln!(out)?;
        }
        out.flush()?;
        Ok(path)
    }
}
