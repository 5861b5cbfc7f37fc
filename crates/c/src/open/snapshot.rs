//! A snapshot that is open.

use std::sync::Arc;

use pliant_sim::{Setup, SimulationState};

/// A state, and the setup that it is of.
pub(crate) struct OpenSnapshot {
    pub(crate) setup: Arc<Setup>,
    pub(crate) state: SimulationState,
}
