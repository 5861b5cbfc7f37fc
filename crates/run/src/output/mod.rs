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
mod stability;
mod strains;
mod summary;
mod vtu;

use std::cell::OnceCell;
use std::path::{Path, PathBuf};

use pliant_explicit::recover::CellFields;
use pliant_sim::{CellsNow, Instant, Simulation};
use serde::{Deserialize, Serialize};

pub(crate) use file::{check_own_folder, replace};
pub use folder::OutputFolder;
pub(crate) use folder::{CONVERGENCE, PICTURE, PLOT, SUMMARY};
pub use outcome::{GuestSummary, TieSummary};
pub(crate) use outcome::{History, Outcome, PartOutcome, Watched};
pub use stability::{AddedMass, StabilitySummary};
pub(crate) use strains::ShellStrains;
pub use strains::StrainSummary;
pub use summary::{BodySummary, ParticipantSummary, Summary, failed_input, failed_output};

pub(crate) use csv::{AXES, ENERGIES, Samples, in_columns};
pub use csv::{Column, sampled_columns};
pub(crate) use field_mesh::{FieldMesh, carried_on_shell};
pub(crate) use outputs::Outputs;
pub(crate) use plot::{MOST_CURVES, Reactions, constraints, plot, plot_of_sweep};
pub(crate) use summary::{bodies, interrupted, markdown, output_failure, summarise, told_limit};

use pliant_scene::{Built, Part, World};

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
pub(crate) struct Frame<'a> {
    pub part: &'a Part,
    pub now: &'a dyn Instant,
    /// Fields of its cells, without and with stable steps, once an output has asked for them.
    cells: [OnceCell<Option<Recovered<'a>>>; 2],
}

impl<'a> Frame<'a> {
    pub(crate) fn new(part: &'a Part, now: &'a dyn Instant) -> Self {
        Self { part, now, cells: Default::default() }
    }

    /// Fields of the cells of its solids, with their stable steps if these are wanted; `None` where it has none.
    fn cells(&self, steps: bool) -> Option<&Recovered<'a>> {
        let find = || Some(Recovered::new(self.now.cells(steps)?, self.built().model.solids.len()));
        self.cells[usize::from(steps)].get_or_init(find).as_ref()
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
    solids: Vec<OnceCell<Vec<CellFields>>>,
}

impl<'a> Recovered<'a> {
    fn new(now: Box<dyn CellsNow + 'a>, solids: usize) -> Self {
        Self { now, solids: vec![OnceCell::new(); solids] }
    }

    /// Those of one cell of a solid.
    fn at(&self, solid: usize, cell: usize) -> CellFields {
        self.now.at(solid, cell)
    }

    /// Those of all cells of a solid.
    fn of(&self, solid: usize) -> &[CellFields] {
        self.solids[solid].get_or_init(|| self.now.of(solid))
    }
}

/// All participants of a simulation of a world as outputs read them.
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
