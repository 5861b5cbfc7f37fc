//! The real binary: words, exit codes, files. Tests that need a simulation alone are in `crates/run/tests`.
//! One program holds all files here, so that they are linked once; run the tests of a file with
//! `cargo test -p pliant --test cli running::`.

mod bad_contact;
mod bad_images;
mod bad_input;
mod devices;
mod haptics;
mod label_names;
mod meshing_images;
mod meshing_surfaces;
mod pictures;
mod resuming;
mod running;
mod setting;
mod shells_of_surfaces;
mod support;
#[cfg(unix)]
mod surroundings;
mod sweeping;
#[cfg(all(feature = "viewer", target_os = "linux"))]
mod window;
mod words;
