//! What the meshes of this crate promise: volume, conformity, quality, determinism, errors.

mod checks;
mod errors;
mod images;
mod organs;
mod phantoms;
mod structured;
mod stuffing;
mod voxels;
