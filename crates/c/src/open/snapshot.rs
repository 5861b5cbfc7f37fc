//! A snapshot that is open.

use std::sync::Arc;

use pliant_sim::{State, World};

/// A state, and the world that it is of.
pub(crate) struct OpenSnapshot {
    pub(crate) world: Arc<World>,
    pub(crate) state: State,
}
