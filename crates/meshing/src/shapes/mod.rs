//! Built-in shapes.

pub(crate) mod lens;
pub(crate) mod phantom;
pub(crate) mod sheets;
pub(crate) mod structured;
