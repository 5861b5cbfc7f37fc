//! Runs of scenes: steps a [`World`](pliant_scene::World), and writes its outputs, checkpoints, plot and
//! summary to a folder. The function [`run`] does one run, and a [`Sweep`] does many with different values. A
//! window steps a [`Live`] at its own pace. Outputs read instants and fields of [`pliant_sim`] and never
//! change a state.
//!
//! ```
//! use pliant_run::{OutputFolder, run};
//! use pliant_scene::World;
//! use pliant_format::{Scene, source::Source};
//!
//! let text = r#"
//!     [scene]
//!     until = 0.01
//!     gravity = [0, 0, -9.81]
//!
//!     [law.tissue]
//!     type = "neo-hookean"
//!     young-modulus = 3000
//!     poisson-ratio = 0.45
//!
//!     [body.block]
//!     mesh = { block = { size = [0.1, 0.1, 0.1] }, edge = 0.05 }
//!     law = "tissue"
//!     density = 1000
//!
//!     [constraint.base]
//!     type = "fix"
//!     body = "block"
//!     nodes = { set = "z-min" }
//! "#;
//! let scene = Scene::from_source(Source::parse("block.toml", text)?, ".".into())?;
//! let place = tempfile::tempdir()?;
//! let folder = OutputFolder::prepare(place.path().join("block"), &scene, false)?;
//! let summary = run(&World::new(&scene)?, &folder, &mut |_| ())?;
//! // Two thirds of the weight of a kilogram hang on the base by then.
//! assert_eq!(summary.status, "done");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod advice;
mod checkpoint;
mod field_reader;
mod live;
mod output;
mod overview;
mod parts;
mod progressed;
mod rollback;
mod run;
mod skin;
mod snapshot;
mod sweep;
#[cfg(test)]
mod testing;

pub use checkpoint::{Checkpoint, ResumeError};
pub use field_reader::{FieldReader, field_named};
pub use live::Live;
pub use output::{
    AddedMass, BodySummary, Column, CoupledSurfaceSummary, Intersections, OutputError, OutputFolder,
    ParticipantSummary, StabilitySummary, Summary, TieSummary, failed_input, failed_output, sampled_columns,
};
pub use overview::overview;
pub use parts::{MergedSweep, PartSummary, SweepPart};
pub use run::{Draw, Options, Progress, run, run_with};
pub use skin::Skin;
pub use snapshot::{snapshot_framed, snapshot_from_bytes, snapshot_to_bytes};
pub use sweep::{Sweep, SweepOptions, SweepProgress, SweepSummary};
