//! 1: a scene is loaded, a value of it changed, and it is run.
//!
//! Run: `cargo run --release --bin 1-run-scene -- scenes/cube`
//!
//! Read before: nothing.

use std::error::Error;
use std::path::PathBuf;

use pliant_format::{Scene, open};
use pliant_run::OutputFolder;
use pliant_scene::World;

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).map_or_else(|| PathBuf::from("scenes/cube"), PathBuf::from);
    let (mut source, folder) = open(&path)?;
    // A value of the file, changed as with `--set`.
    source.set(&["scene", "until"], 0.02).map_err(|mistake| mistake.message.clone())?;
    let scene = Scene::from_source(source, folder)?;
    let world = World::new(&scene)?;
    let place = tempfile::tempdir()?;
    let out = OutputFolder::prepare(place.path().join("out"), &scene, false)?;
    let summary = pliant_run::run(&world, &out, &mut |_| ())?;
    println!("{}: {} steps of {:.3} ms", summary.status, summary.steps, 1e3 * summary.step);
    for (constraint, force) in &summary.reactions {
        println!("`{constraint}` holds with {force:.3?} N");
    }
    match summary.error {
        None => Ok(()),
        Some(failure) => Err(failure.message.into()),
    }
}
