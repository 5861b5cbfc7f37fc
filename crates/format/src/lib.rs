//! Scene files and all messages about them. A text is read into a [`Scene`]: tables of plain data whose
//! values keep their places in the file. The crate knows no solver and no GPU; `pliant-scene` builds the
//! model from a scene.
//!
//! ```
//! use pliant_format::{Scene, source::Source};
//!
//! let text = r#"
//!     [scene]
//!     until = 0.01
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
//! "#;
//! let scene = Scene::from_source(Source::parse("block.toml", text)?, ".".into())?;
//! assert_eq!(scene.bodies[0].0, "block");
//! let wrong = text.replace("density", "densty");
//! let errors = Scene::from_source(Source::parse("block.toml", wrong)?, ".".into()).unwrap_err();
//! assert!(errors.plain().to_string().contains("did you mean `density`?"));
//! # Ok::<(), pliant_format::diagnostic::SceneErrors>(())
//! ```

pub mod checker;
pub mod diagnostic;
mod foreign;
mod nearest;
mod participants;
mod plausible;
mod printable;
mod reads;
pub mod reference;
pub mod registry;
mod scene;
mod shown;
pub mod source;
mod starters;
pub mod tables;

pub use foreign::foreign_file;
pub use nearest::{SCENE, nearest, suggestion};
pub use printable::printable;
pub use reads::{LONGEST_TABLE, Reads, rows_of, table};
pub use scene::{ReadError, Scene, open, open_within, scene_file};
pub use starters::{OrganScene, SceneOfMesh, is_mesh, scene_of_given, scene_of_mesh, starter};
