//! Co-rotational triangular shells.
mod dynamics;
pub mod element;
mod error;
mod facet;
mod linear;
mod model;
mod rotation;
mod sparse;
mod state;
mod statics;
mod surface;
mod system;
#[cfg(test)]
mod testing;
pub use dynamics::{BackwardEuler, DynamicSettings, DynamicStep, Explicit};
pub use error::{ModelError, SolveError};
pub use facet::{Broken, Facet, Resultants, ShellEnergy, Tangent};
pub use linear::{LinearReport, LinearSolver, Preconditioner};
pub use model::{Constraint, Load, LoadKind, Material, Model, Motion, Normal, Notes, Shell, Spring};
pub use state::State;
pub use statics::{Control, StaticSettings, Statics, Step};
pub use surface::{Carried, CurvedSurface, EdgeRule, Patch, Picture, Place};
pub use system::Phases;
#[cfg(test)]
mod tests;
