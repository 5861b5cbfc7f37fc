//! Scene files and what runs them: a text is read into a [`Scene`], built into a model, and run with its outputs.
//!
//! ```
//! use pliant_scene::{Scene, source::Source};
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
//! let world = pliant_scene::World::new(&scene)?;
//! let block = world.only().unwrap();
//! assert_eq!(block.built.model.node_count(), 27);
//! let limits = block.plan.limits.as_ref().unwrap();
//! assert!(limits.critical.bound.step <= limits.critical.assembled.step);
//! # Ok::<(), pliant_scene::diagnostic::SceneErrors>(())
//! ```

mod advice;
mod assemble;
mod bound;
mod cache;
pub mod checker;
mod checkpoint;
pub mod diagnostic;
pub mod format;
mod live;
mod method;
mod nearest;
pub mod niftysim;
mod of_mesh;
mod organ_scene;
mod output;
mod overview;
mod participants;
mod penalty;
mod plan;
mod plausible;
mod printable;
mod reads;
pub mod reference;
pub mod registry;
mod run;
mod scene;
pub mod source;
mod starter;
mod sweep;
mod target;
#[cfg(test)]
mod testing;
mod view;
mod world;

pub use assemble::{Built, BuiltBody, Meshing, SizeDoubt, build, build_watched, build_with};
pub use bound::element_bound;
pub use cache::MeshCache;
pub use checkpoint::{Checkpoint, ResumeError};
pub use live::Live;
pub use of_mesh::{SceneOfMesh, is_mesh, scene_of_mesh};
pub use organ_scene::OrganScene;
pub use output::{
    AddedMass, BodySummary, Column, OutputError, OutputFolder, ParticipantSummary, StabilitySummary, Summary,
    TieSummary, failed_input, failed_output,
};
pub use overview::overview;
pub use plan::{LimitingElement, Limits, Plan, plan};
pub use printable::printable;
pub use reads::Reads;
pub use run::{Options, Progress, run, run_with};
pub use scene::{ReadError, Scene, open, open_within, scene_file};
pub use starter::starter;
pub use sweep::{Sweep, SweepOptions, SweepProgress, SweepSummary};
pub use target::Target;
pub use view::Draw;
pub use world::{Part, World};
