//! The C interface of Pliant. Programs in C, C++, C# and others load scenes, step them, read positions,
//! normals, fields and forces, and lead tools and hands. `include/pliant.h` is made of these declarations,
//! `include/pliant.hpp` wraps it for C++; the guide is `docs/guide/c.md`.
//!
//! The interface is thin: it builds a [`World`](pliant_scene::World) and steps a
//! [`Simulation`](pliant_sim::Simulation). Positions and values come from [`Skin`](pliant_run::Skin) and
//! [`FieldReader`](pliant_run::FieldReader).
//!
//! **Duties of the caller** for every function, on which the `unsafe` here rests:
//! * A pointer is null, or points to a value of its type as long as the call lasts. Texts end with a zero.
//!   Arrays have as many items, and buffers as much room, as the call says. Null is answered by
//!   `PLIANT_STATUS_NULL`, unless the function gives it a meaning.
//! * A context comes from `pliant_context_open`, and is closed only while no call on it is under way. A
//!   closed context must not be used.
//!
//! The library checks everything else. Handles are numbers in the table of their context. So a handle that is
//! closed, of another kind, of another context or made up is answered by an error. No panic leaves the
//! library: the call returns `PLIANT_STATUS_INTERNAL`, and the handle is closed. Errors go into a
//! [`PliantError`] of the caller; there is no global state.
//!
//! **Threads**: calls on different handles run side by side. A handle takes one call at a time; a second call
//! is answered by `PLIANT_STATUS_BUSY` at once. `pliant_stop` and `..._close` may be called at any time.

mod buffer;
mod context;
mod grips;
mod lock;
mod open;
mod pointers;
mod scene;
mod simulation;
mod snapshot;
mod status;
mod surface;
mod tools;
mod values;
mod version;

pub use buffer::*;
pub use context::PliantContext;
pub use grips::*;
pub use scene::*;
pub use simulation::*;
pub use snapshot::*;
pub use status::{PliantError, PliantStatus};
pub use surface::*;
pub use tools::*;
pub use values::*;
pub use version::*;
