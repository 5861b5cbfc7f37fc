//! Parts of a sweep, for job arrays. Each part is a separate process and appends a line to its file when a
//! run ends. The parts are put together at the end.

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Mutex;

use serde_json::{Map, Value as Json, json};

use crate::output::{AXES, ENERGIES, OutputError, in_columns, replace};
use crate::sweep::{Row, SWEEP, Sweep, SweepOptions, failures, in_parallel, lock};

/// A part of a sweep: every `of`-th combination.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SweepPart {
    /// The first combination, counted from 1.
    pub number: usize,
    /// Parts in all.
    pub of: usize,
}

impl FromStr for SweepPart {
    type Err = String;

    /// Reads `3/40`.
    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('/').map(|(number, of)| (number.trim().parse(), of.trim().parse()));
        match parts {
            Some((Ok(number), Ok(of))) if (1..=of).contains(&number) => Ok(Self { number, of }),
            _ => Err(format!("`{text}` is no part of a sweep: write 3/40 for the third of forty parts")),
        }
    }
}

impl SweepPart {
    /// The file of its rows.
    fn file(self) -> String {
        format!("rows-{}-of-{}.jsonl", self.number, self.of)
    }
}

/// The result of a part.
#[derive(Clone, Debug)]
pub struct PartSummary {
    /// The file of its rows.
    pub rows: PathBuf,
    /// Runs of the part.
    pub runs: usize,
    /// Runs whose rows were there from an earlier call.
    pub known: usize,
    /// Runs that failed: number and reason.
    pub failures: Vec<(usize, String)>,
    /// True if the part was stopped before its end.
    pub interrupted: bool,
}

/// Parts that were put together.
#[derive(Clone, Debug)]
pub struct MergedSweep {
    /// The table.
    pub table: PathBuf,
    /// Runs whose rows are missing.
    pub missing: Vec<usize>,
    /// Runs that failed: number and reason.
    pub failures: Vec<(usize, String)>,
}

impl Sweep {
    /// Runs a part, but for runs whose rows are in its file already. Any number of parts can run at a time in
    /// one folder.
    ///
    /// # Errors
    /// If the folder or the rows can't be written.
    pub fn run_part(
        &self,
        folder: &Path,
        part: SweepPart,
        options: SweepOptions<'_>,
        report: &(dyn Fn(usize) + Sync),
    ) -> Result<PartSummary, OutputError> {
        let path = folder.join(part.file());
        let failed = |error: io::Error| OutputError::new(&path, error);
        fs::create_dir_all(folder).map_err(|error| OutputError::new(folder, error))?;
        let (file, lines) = open_rows(&path).map_err(failed)?;
        let assigned: Vec<usize> = (part.number - 1..self.runs()).step_by(part.of).collect();
        let known: BTreeMap<usize, Json> = self.known(&lines).collect();
        let left: Vec<usize> = assigned.iter().copied().filter(|run| !known.contains_key(run)).collect();
        let rows = Mutex::new((file, Vec::new(), None));
        in_parallel(left.len(), options.threads, options.stop, |index| {
            let row = self.run_one(left[index], folder, options, &mut |_| {});
            // A run that was stopped is done again.
            if row.status == "interrupted" {
                return;
            }
            let line = self.line(left[index], &row);
            let (file, failures, trouble) = &mut *lock(&rows);
            if row.status == "failed" {
                failures.push((left[index], row.message));
            }
            if let Err(error) = file.write_all(line.as_bytes()).and_then(|()| file.flush()) {
                trouble.get_or_insert(error);
            }
            report(known.len() + index + 1);
        });
        let (_, mut failures, trouble) = rows.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some(error) = trouble {
            return Err(failed(error));
        }
        failures.sort_unstable();
        let interrupted = options.stop.is_some_and(pliant_sim::StopFlag::is_asked);
        Ok(PartSummary { rows: path, runs: assigned.len(), known: known.len(), failures, interrupted })
    }

    /// Puts the parts in a folder together into the table of the sweep.
    ///
    /// # Errors
    /// If the rows can't be read or the table can't be written.
    pub fn merge(&self, folder: &Path) -> Result<MergedSweep, OutputError> {
        let failed = |error: io::Error| OutputError::new(folder, error);
        let mut rows: Vec<Option<Row>> = (0..self.runs()).map(|_| None).collect();
        for entry in fs::read_dir(folder).map_err(failed)?.flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            if !(name.starts_with("rows-") && name.ends_with(".jsonl")) {
                continue;
            }
            let text =
                fs::read_to_string(entry.path()).map_err(|error| OutputError::new(&entry.path(), error))?;
            for (run, line) in self.known(&text) {
                rows[run] = serde_json::from_value(line["row"].clone()).ok();
            }
        }
        let table = folder.join(SWEEP);
        replace(&table, |file| file.write_all(self.table(&rows).as_bytes()))
            .map_err(|error| OutputError::new(&table, error))?;
        let missing = rows.iter().enumerate().filter(|(_, row)| row.is_none()).map(|(run, _)| run).collect();
        Ok(MergedSweep { table, missing, failures: failures(&rows) })
    }

    /// Whole rows of this sweep in a text of lines, by the numbers of their runs.
    fn known<'t>(&'t self, lines: &'t str) -> impl Iterator<Item = (usize, Json)> + 't {
        lines.split_inclusive('\n').filter(|line| line.ends_with('\n')).filter_map(|line| {
            let row: Json = serde_json::from_str(line).ok()?;
            let run = usize::try_from(row["run"].as_u64()?).ok().filter(|&run| run < self.runs())?;
            (row["key"] == self.key(run)).then_some((run, row))
        })
    }

    /// A row as a line: flat for programs, and whole under `row` for [`merge`](Self::merge).
    fn line(&self, run: usize, row: &Row) -> String {
        let mut line = Map::new();
        line.insert("run".into(), json!(run));
        line.insert("runs".into(), json!(self.runs()));
        line.insert("keys".into(), json!(self.keys().collect::<Vec<_>>()));
        line.insert("key".into(), json!(self.key(run)));
        for (key, value) in self.combination(run) {
            line.insert(
                key.into(),
                value.parse::<f64>().map_or_else(|_| json!(value), |number| json!(number)),
            );
        }
        line.insert("status".into(), json!(row.status));
        line.insert("error".into(), json!(row.message));
        line.insert("time".into(), json!(row.time));
        line.insert("steps".into(), json!(row.steps));
        line.insert("step".into(), json!(row.step));
        for (energy, value) in ENERGIES.iter().zip(in_columns(&row.energies)) {
            line.insert(format!("energy.{energy}"), json!(value));
        }
        for (name, force) in &row.reactions {
            for (axis, force) in AXES.iter().zip(force) {
                line.insert(format!("reaction.{name}.{axis}"), json!(force));
            }
        }
        for (column, value) in &row.probes {
            line.insert(column.clone(), json!(value.parse::<f64>().ok()));
        }
        line.insert("wall_seconds".into(), json!(row.wall_seconds));
        line.insert("row".into(), json!(row));
        Json::Object(line).to_string() + "\n"
    }
}

/// Opens a file of rows to append to, and its content; a line that was cut off is ended.
fn open_rows(path: &Path) -> io::Result<(File, String)> {
    let mut file = OpenOptions::new().create(true).append(true).read(true).open(path)?;
    let mut text = String::new();
    file.rewind()?;
    file.read_to_string(&mut text)?;
    if !text.is_empty() && !text.ends_with('\n') {
        file.write_all(b"\n")?;
    }
    Ok((file, text))
}

#[cfg(test)]
mod tests {
    use pliant_format::source::Source;

    use super::*;
    use crate::testing::CUBE;

    #[test]
    fn parts_are_read_as_typed() {
        assert_eq!("3/40".parse(), Ok(SweepPart { number: 3, of: 40 }));
        for wrong in ["0/4", "5/4", "3", "a/b", "3/", "-1/2"] {
            assert!(wrong.parse::<SweepPart>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn parts_make_the_table_of_the_whole_and_go_on_where_they_were_cut() {
        let source = Source::parse("cube.toml", CUBE).unwrap();
        let sets = ["scene.until=0.01,0.02,0.03".to_owned(), "body.cube.density=900,1100".to_owned()];
        let sweep = Sweep::new(source, ".".into(), &sets).unwrap();
        let place = tempfile::tempdir().unwrap();
        let options = SweepOptions { threads: 1, ..SweepOptions::default() };
        let part = |number| {
            let part = SweepPart { number, of: 2 };
            sweep.run_part(place.path(), part, options, &|_| {}).unwrap()
        };
        let first = part(1);
        assert_eq!((first.runs, first.known, first.failures.len()), (3, 0, 0));
        assert_eq!(sweep.merge(place.path()).unwrap().missing, [1, 3, 5]);
        let rows = fs::read_to_string(&first.rows).unwrap();
        // The last line is cut off, as by a process that was killed.
        fs::write(&first.rows, &rows[..rows.len() - 20]).unwrap();
        let again = part(1);
        assert_eq!((again.runs, again.known), (3, 2));
        part(2);
        let merged = sweep.merge(place.path()).unwrap();
        assert!(merged.missing.is_empty() && merged.failures.is_empty());
        let whole = tempfile::tempdir().unwrap();
        let folder = sweep.open_folder(whole.path().join("whole"), false).unwrap();
        let summary = sweep.run(&folder, options, &|_| {}).unwrap();
        let table = |path: &Path| -> Vec<String> {
            let text = fs::read_to_string(path).unwrap();
            // All but the wall time.
            text.lines().map(|line| line.rsplit_once(',').unwrap().0.to_owned()).collect()
        };
        assert_eq!(table(&merged.table), table(&summary.table));
    }
}
