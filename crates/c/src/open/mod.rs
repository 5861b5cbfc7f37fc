//! Open items of a program.

mod field;
mod held;
mod scene;
mod simulation;
mod snapshot;
mod surface;

pub(crate) use self::field::OpenField;
pub(crate) use self::held::Held;
pub(crate) use self::scene::OpenScene;
pub(crate) use self::simulation::{Running, Shared};
pub(crate) use self::snapshot::OpenSnapshot;
pub(crate) use self::surface::{OpenSurface, Vertices};
