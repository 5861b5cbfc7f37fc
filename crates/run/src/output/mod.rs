//! Outputs: they write down instants of a run and never change the state.

mod csv;
mod curved;
mod field_mesh;
mod fields;
mod file;
mod folder;
mod merged;
mod outcome;
mod outputs;
mod plot;
mod solid_strains;
mod stability;
mod strains;
mod summary;
mod vtu;

use std::cell::{OnceCell, RefCell};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use pliant_explicit::recover::CellFields;
use pliant_format::tables::FieldName;
use pliant_scene::{Built, PlannedParticipant, World};
use pliant_sim::{CellsNow, Instant, Simulation};
use serde::{Deserialize, Serialize};

pub(crate) use csv::{AXES, ENERGIES, Samples, in_columns};
pub use csv::{Column, sampled_columns};
pub(crate) use field_mesh::{FieldMesh, carried_on_shell};
pub(crate) use file::{check_own_folder, replace};
pub use folder::OutputFolder;
pub(crate) use folder::{CONVERGENCE, PICTURE, PLOT, SUMMARY};
pub use outcome::{CoupledSurfaceSummary, Intersections, TieSummary};
pub(crate) use outcome::{History, Outcome, PartOutcome, Watched};
pub(crate) use outputs::Outputs;
pub(crate) use plot::{MOST_CURVES, Reactions, constraints, plot, plot_of_sweep};
pub(crate) use solid_strains::SolidStrains;
pub use solid_strains::VolumeChange;
pub(crate) use stability::hourglass_failure;
pub use stability::{AddedMass, StabilitySummary};
pub(crate) use strains::ShellStrains;
pub use strains::StrainSummary;
pub use summary::{BodySummary, ParticipantSummary, Summary, failed_input, failed_output};
pub(crate) use summary::{bodies, interrupted, markdown, output_failure, summarise, told_limit};

/// An output that could not be written.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("`{path}` cannot be written: {reason}")]
pub struct OutputError {
    /// The file or folder.
    pub path: PathBuf,
    /// Message of the system.
    pub reason: String,
    /// Remedy for the user.
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
pub(crate) struct Frame<'a> {
    pub part: &'a PlannedParticipant,
    pub now: &'a dyn Instant,
    /// Fields of its cells, once an output has asked for some.
    cells: OnceCell<Option<Recovered<'a>>>,
}

impl<'a> Frame<'a> {
    pub(crate) fn new(part: &'a PlannedParticipant, now: &'a dyn Instant) -> Self {
        Self { part, now, cells: OnceCell::new() }
    }

    /// Fields of the cells of its solids; `None` where it has none.
    fn cells(&self) -> Option<&Recovered<'a>> {
        let find = || Some(Recovered::new(self.now.cells()?, self.built().model.solids.len()));
        self.cells.get_or_init(find).as_ref()
    }

    fn built(&self) -> &Built {
        &self.part.built
    }

    /// Force [N] that holds or moves the nodes of each constraint.
    pub(crate) fn reactions(&self) -> impl Iterator<Item = [f64; 3]> {
        (0..self.built().model.constraints.len()).map(|constraint| self.now.reaction(constraint))
    }
}

/// Fields of cells of solids, found once for all outputs that show the instant.
struct Recovered<'a> {
    now: Box<dyn CellsNow + 'a>,
    /// Fields of each solid that were asked for.
    solids: Vec<RefCell<Vec<(FieldName, CellNumbers)>>>,
}

impl<'a> Recovered<'a> {
    fn new(now: Box<dyn CellsNow + 'a>, solids: usize) -> Self {
        Self { now, solids: vec![RefCell::default(); solids] }
    }

    /// Returns the fields of one cell of a solid.
    fn at(&self, solid: usize, cell: usize, step: bool) -> CellFields {
        self.now.at(solid, cell, step)
    }

    /// Returns some fields of all cells of a solid. New fields take one pass over the cells together.
    fn of(&self, solid: usize, wanted: &[FieldName]) -> Vec<CellNumbers> {
        let mut known = self.solids[solid].borrow_mut();
        let mut missing: Vec<FieldName> = Vec::new();
        for &field in wanted {
            if !missing.contains(&field) && known.iter().all(|(known, _)| *known != field) {
                missing.push(field);
            }
        }
        if !missing.is_empty() {
            let width = missing.iter().map(|field| field.components()).sum();
            let steps = missing.contains(&FieldName::ElementStep);
            let numbers = self.now.numbers(solid, steps, width, &|found, mut to| {
                for &field in &missing {
                    let (target, rest) = to.split_at_mut(field.components());
                    target.copy_from_slice(&fields::of_cell(found, field)[..target.len()]);
                    to = rest;
                }
            });
            let (numbers, mut first) = (Rc::new(numbers), 0);
            for field in missing {
                let columns = first..first + field.components();
                first = columns.end;
                known.push((field, CellNumbers { numbers: Rc::clone(&numbers), width, columns }));
            }
        }
        let find = |field: &FieldName| known.iter().find(|(known, _)| known == field);
        wanted.iter().filter_map(find).map(|(_, numbers)| numbers.clone()).collect()
    }
}

/// A field of all cells of a solid.
#[derive(Clone)]
struct CellNumbers {
    /// This field and others, cell by cell.
    numbers: Rc<Vec<f64>>,
    /// Numbers of a cell, and where this field is among them.
    width: usize,
    columns: Range<usize>,
}

impl CellNumbers {
    /// The components in a cell.
    fn at(&self, cell: usize) -> &[f64] {
        &self.numbers[cell * self.width..][self.columns.clone()]
    }
}

/// Returns all participants of a simulation of a world as outputs read them.
pub(crate) fn frames<'a>(world: &'a World, simulation: &'a Simulation) -> Vec<Frame<'a>> {
    world.participants.iter().zip(simulation.instants()).map(|(part, now)| Frame::new(part, now)).collect()
}

/// Time of the instant of frames [s].
pub(crate) fn time_of(frames: &[Frame<'_>]) -> f64 {
    frames.first().map_or(0.0, |frame| frame.now.time())
}

/// Writes instants of a run.
pub(crate) trait Output: Send {
    /// Writes down an instant of all participants.
    fn see(&mut self, frames: &[Frame<'_>]) -> Result<(), OutputError>;

    /// Returns what the output has written so far.
    fn written(&self) -> Written;

    /// Removes the later output of an interrupted run, after the end of the run that continued it.
    fn finish(&mut self) -> Result<(), OutputError>;
}

/// Progress of an output, for a run that continues it.
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

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use pliant_explicit::State;
    use pliant_explicit::recover::Recovery;
    use pliant_format::Scene;
    use pliant_format::source::Source;

    use super::*;

    const CUBE: &str = "[scene]\nuntil = 0.1\n[law.tissue]\ntype = \"neo-hookean\"\nyoung-modulus = 3e3\npoisson-ratio = 0.45\n[body.cube]\nmesh = \
         { block = { size = [0.1, 0.1, 0.1], cells = [3, 3, 3] }, as = \"hexes\" }\nlaw = \"tissue\"\ndensity = 1000\n";

    /// Cells of one solid, and how often all are asked.
    struct Counted<'a>(Recovery<'a, f64>, &'a AtomicUsize);

    impl CellsNow for Counted<'_> {
        fn at(&self, solid: usize, cell: usize, step: bool) -> CellFields {
            CellFields { stable_step: step.then_some(1e-3 * cell as f64), ..self.0.cell(solid, cell) }
        }

        fn numbers(
            &self,
            solid: usize,
            steps: bool,
            width: usize,
            of: &(dyn Fn(&CellFields, &mut [f64]) + Sync),
        ) -> Vec<f64> {
            self.1.fetch_add(1, Ordering::Relaxed);
            self.0.numbers(solid, width, |cell, _, to| of(&self.at(solid, cell, steps), to))
        }
    }

    #[test]
    fn fields_of_cells_are_found_once_and_in_any_order() {
        use FieldName::{ElementStep, GreenStrain, VonMises};
        let scene = Scene::from_source(Source::parse("cube.toml", CUBE).unwrap(), ".".into()).unwrap();
        let built = pliant_scene::build(&scene).unwrap_or_else(|errors| panic!("{}", errors.plain()));
        let model = &*built.model;
        let mut state = State::<f64>::at_rest(model);
        state
            .displacement
            .iter_mut()
            .zip(&model.rest)
            .for_each(|(u, x)| *u = [0.1 * x[1], 0.2 * x[0] * x[2], 0.0]);
        let passes = AtomicUsize::new(0);
        let recovered = Recovered::new(Box::new(Counted(Recovery::new(model, &state), &passes)), 1);
        for (wanted, after) in [
            (vec![VonMises, GreenStrain], 1),
            (vec![ElementStep, GreenStrain, ElementStep, VonMises], 2),
            (vec![GreenStrain, ElementStep], 2),
        ] {
            let found = recovered.of(0, &wanted);
            assert_eq!((found.len(), passes.load(Ordering::Relaxed)), (wanted.len(), after));
            for cell in 0..model.cell_count() {
                let fields = recovered.at(0, cell, true);
                for (field, found) in wanted.iter().zip(&found) {
                    assert_eq!(found.at(cell), &fields::of_cell(&fields, *field)[..field.components()]);
                }
            }
        }
    }
}
