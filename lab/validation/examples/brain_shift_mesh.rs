//! Writes the mesh of `scenes/brain-shift`: `cargo run -p pliant-validation --example brain_shift_mesh`.

use std::path::Path;

use pliant_geometry::io::{VtuOptions, save_vtu};
use pliant_validation::brain_shift;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/brain-shift/ellipsoid.vtu");
    let mesh = brain_shift::mesh();
    save_vtu(&path, &mesh, &VtuOptions { compress: true, ..VtuOptions::default() })?;
    println!("{} nodes", mesh.points.len());
    Ok(())
}
