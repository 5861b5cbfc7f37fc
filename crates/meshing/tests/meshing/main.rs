//! Promises of the meshes of this crate: volume, conformity, quality, determinism, errors.

mod broken;
mod enclosed;
mod errors;
mod organs;
mod phantoms;
mod sizes;
mod smoothing;
mod structured;
mod stuffing;
mod touching;
mod voxels;
