//! Promises of the meshes of this crate: volume, conformity, quality, determinism, errors.

mod broken;
mod checks;
mod enclosed;
mod errors;
// Validation and an example share these; each uses its part.
#[allow(dead_code)]
mod images;
mod organs;
mod phantoms;
mod sizes;
mod smoothing;
mod structured;
mod stuffing;
mod voxels;
