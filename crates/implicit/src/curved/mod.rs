//! The curved surface of a model's shells: its points, things that follow it, its pictures, and fields of
//! cells.

pub(crate) mod carry;
pub(crate) mod mapping;
pub(crate) mod picture;
pub(crate) mod recover;
pub(crate) mod surface;
