//! Runs of scenes with their files and words, in this process. One program holds all files here; run the
//! tests of a file with `cargo test -p pliant-run --test run resuming::`.

#[cfg(feature = "gpu")]
mod devices;
mod images;
mod meshes;
mod mistakes;
mod motions;
mod outputs;
mod resuming;
mod rollback;
mod shells;
mod steps;
mod sudden;
mod support;
mod surfaces;
mod sweeping;
