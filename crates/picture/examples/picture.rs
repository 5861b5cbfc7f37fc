//! A picture without a window: a block that is bent, coloured by its displacement:
//! `cargo run --release -p pliant-picture --example picture -- block.png`.

use std::error::Error;

use pliant_geometry::{CellKind, Mesh, Vector3};
use pliant_picture::{Camera, Frame, Graphics, Offscreen, Regions, Style, Subject};

const SIZE: [u32; 2] = [640, 480];

fn main() -> Result<(), Box<dyn Error>> {
    let file = std::env::args().nth(1).unwrap_or_else(|| "block.png".into());
    // Ten cubes of 20 mm along x.
    let mut mesh = Mesh::default();
    let square = [[0.0, 0.0], [0.02, 0.0], [0.02, 0.02], [0.0, 0.02]];
    for level in 0..=10 {
        mesh.points.extend(square.map(|[y, z]| Vector3::new(0.02 * f64::from(level), y, z)));
    }
    for level in 0..10 {
        let hex = [0, 4, 5, 1, 3, 7, 6, 2].map(|node| node + 4 * level);
        mesh.block_mut(CellKind::Hex).nodes.extend(hex);
    }
    let displacement = |p: &Vector3| Vector3::new(0.0, 0.0, -2.0 * p.x * p.x);
    let moved: Vec<Vector3> = mesh.points.iter().map(displacement).collect();

    let graphics = Graphics::open()?;
    let subject = Subject::new(&mesh);
    let mut offscreen = Offscreen::new(&graphics, &subject, SIZE)?;
    let points: Vec<Vector3> = mesh.points.iter().zip(&moved).map(|(p, u)| p + u).collect();
    let values: Vec<f64> = moved.iter().map(|u| u.norm()).collect();
    let largest = values.iter().copied().fold(0.0, f64::max);
    let mut camera = Camera::default();
    camera.fit(&points, f64::from(SIZE[0]) / f64::from(SIZE[1]));
    let style = Style { range: Some([0.0, largest]), edges: true, ..Style::default() };
    let picture =
        offscreen.draw(&Frame { points, values, critical: None }, &camera, &style, &Regions::default())?;
    std::fs::write(&file, picture.png()?)?;
    println!("wrote {file}");
    Ok(())
}
