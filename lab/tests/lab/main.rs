//! `pliant-lab` through the real binary.

mod bench;
mod reproduce;

use std::ops::Deref;
use std::process::Command;

use pliant_testing::scenes;
pub use pliant_testing::scenes::Said;

/// A temporary folder in which the binary runs.
pub struct Workshop(scenes::Workshop);

impl Deref for Workshop {
    type Target = scenes::Workshop;

    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl Workshop {
    /// A folder with this scene.
    pub fn new(scene: &str) -> Self {
        Self(scenes::Workshop::new(scene))
    }

    /// The binary, to be run in the folder.
    pub fn command(&self, arguments: &[&str]) -> Command {
        self.program(env!("CARGO_BIN_EXE_pliant-lab"), arguments)
    }

    /// Runs the binary in the folder; returns its output.
    pub fn lab(&self, arguments: &[&str]) -> Said {
        self.command(arguments).output().expect("the binary starts").into()
    }
}

/// True if there is a GPU. Fails if a GPU is promised but missing.
pub fn has_gpu() -> bool {
    pliant_testing::has_gpu(pliant_gpu::adapters().len())
}
