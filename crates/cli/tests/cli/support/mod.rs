//! A folder with a scene, the real binary run in it, and its output.

use std::ops::Deref;
use std::process::Command;

use pliant_testing::scenes;

pub use pliant_testing::scenes::{
    BLOCK, CORNERS, FROM_FILE, FROM_IMAGE, Said, TETS, changed, from_names, labels, resumable, series, vtk,
};

/// A temporary folder with a scene in `case/scene.toml`, in which the binary runs.
pub struct Workshop(scenes::Workshop);

impl Deref for Workshop {
    type Target = scenes::Workshop;

    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl Workshop {
    pub fn new(scene: &str) -> Self {
        Self(scenes::Workshop::new(scene))
    }

    /// [`BLOCK`] with one place changed.
    pub fn block(good: &str, other: &str) -> Self {
        Self(scenes::Workshop::block(good, other))
    }

    /// The binary, to be run in the folder.
    pub fn command(&self, arguments: &[&str]) -> Command {
        self.program(env!("CARGO_BIN_EXE_pliant"), arguments)
    }

    pub fn pliant(&self, arguments: &[&str]) -> Said {
        self.command(arguments).output().expect("the binary starts").into()
    }

    /// `pliant run case --json …`
    pub fn run(&self, more: &[&str]) -> Said {
        self.pliant(&[&["run", "case", "--json"], more].concat())
    }
}

pub fn has_gpu() -> bool {
    pliant_testing::has_gpu(pliant_gpu::adapters().len())
}
