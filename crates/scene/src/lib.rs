//! From the tables of a scene to a [`World`], which `pliant-run` runs with its outputs.
//!
//! ```
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
//! let world = pliant_scene::World::new(&scene)?;
//! let block = world.only().unwrap();
//! assert_eq!(block.built.model.node_count(), 27);
//! let limits = block.plan.limits.as_ref().unwrap();
//! assert!(limits.critical.bound.step <= limits.critical.assembled.step);
//! # Ok::<(), pliant_format::diagnostic::SceneErrors>(())
//! ```

mod assemble;
mod bound;
mod cache;
mod coupled_surfaces;
mod method;
mod penalty;
mod plan;
#[cfg(test)]
mod starter_scenes;
mod target;
#[cfg(test)]
mod testing;
mod view;
mod world;

pub use assemble::{BodyLocator, Built, BuiltBody, Located, Meshing, SizeDoubt, build, build_with, mesh_of};
pub use bound::element_bound;
pub use cache::{MeshCache, cache_folder};
pub use plan::{LimitingElement, Limits, Plan, plan};
pub use target::Target;
pub use world::{PlannedParticipant, World};
