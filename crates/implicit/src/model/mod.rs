//! What is constant during a run, and what changes: models with shells, contacts and turns of theirs, states,
//! errors. Knows no equations.

pub(crate) mod assembly;
pub(crate) mod contact;
pub(crate) mod error;
mod initial;
pub(crate) mod resolution;
pub(crate) mod state;
pub(crate) mod turns;
