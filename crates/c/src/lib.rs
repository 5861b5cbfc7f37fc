//! The C interface of Pliant. Programs in C, C++, C# and others load scenes, step them, read positions,
//! normals, fields and forces, and lead tools and hands. `include/pliant.h` is made of these declarations,
//! `include/pliant.hpp` wraps it for C++; the guide is `docs/guide/c.md`.
//!
//! It is thin: a [`World`](pliant_scene::World) is built, a [`Simulation`](pliant_sim::Simulation) stepped,
//! and what is read comes from [`Skin`](pliant_run::Skin) and [`FieldReader`](pliant_run::FieldReader).
//!
//! **What a caller owes** to every function, and what the `unsafe` here rests on:
//! * A pointer is null, or points to what its type says, as long as the call lasts: texts end with a zero,
//!   arrays have the items, and buffers the room, that the call says. Null is answered by
//!   `PLIANT_STATUS_NULL`, unless the function gives it a meaning.
//! * A context is one that `pliant_context_open` gave, and is closed only while no call on it is under way.
//!   After that it must not be used.
//!
//! All else is checked: handles are numbers in the table of their context, so one that is closed, of another
//! kind, of another context or made up is answered by an error. No panic leaves the library: it is answered
//! by `PLIANT_STATUS_INTERNAL`, and closes the handle. Errors go into a [`PliantError`] of the caller; there
//! is no global state.
//!
//! **Threads**: calls on different handles run side by side; on one handle one call at a time, and a second
//! one is answered by `PLIANT_STATUS_BUSY` at once. `pliant_stop` and `..._close` may be called at any time.

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
