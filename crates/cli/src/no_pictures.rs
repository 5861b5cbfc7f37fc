//! Replaces pictures in a build without the feature `viewer`.

use pliant_geometry::Mesh;
use pliant_run::Draw;
use pliant_scene::World;

use crate::arguments::{Render, View};
use crate::report::Failure;

fn missing() -> Failure {
    Failure::plain(
        "this `pliant` was built without pictures and the window",
        "build it with `cargo build --release --features viewer`, or install it with `cargo install --path crates/cli \
         --features viewer`",
    )
}

pub fn render(_arguments: &Render) -> Result<u8, Failure> {
    Err(missing())
}

pub fn view(_arguments: &View) -> Result<u8, Failure> {
    Err(missing())
}

/// Draws nothing and is never constructed.
#[derive(Debug)]
pub enum FinalPicture {}

impl FinalPicture {
    pub fn new(_world: &World) -> Result<Self, Failure> {
        Err(missing())
    }
}

impl Draw for FinalPicture {
    fn draw(&self, _mesh: &Mesh, _marks: Option<&Mesh>, _time: f64) -> Result<Vec<u8>, String> {
        match *self {}
    }
}
