//! Constant and changing data of a run: models with shells, their contacts and turns, states, errors. Knows
//! no equations.

pub(crate) mod assembly;
pub(crate) mod contact;
pub(crate) mod error;
mod initial;
pub(crate) mod resolution;
pub(crate) mod state;
pub(crate) mod turns;
