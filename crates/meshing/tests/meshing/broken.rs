//! Surfaces of the test files of the readers, malformed and changed at random: each gives a body or an error,
//! never a panic.

use std::fs;
use std::path::Path;

use pliant_geometry::io::{Format, read_bytes};
use pliant_geometry::{Mesh, Vector3};
use pliant_meshing::{Closing, Enclosed, TriangleMesh};
use pliant_testing::Random;

/// Makes everything that surfaces allow, with cells of an eighth of the box. Returns true if there was a
/// body.
fn fill(mesh: &Mesh) -> bool {
    let size = mesh.bounds().map_or(0.0, |(low, high)| (high - low).norm());
    if let Ok((surface, _)) = TriangleMesh::from_mesh(mesh) {
        let _ = (surface.curvature(), surface.thickness());
    }
    let thorough = Closing { holes: size, fill_cavities: true, keep_largest: true };
    let made = |closing: &Closing| {
        let body = Enclosed::new(mesh, size / 8.0, closing)?;
        body.field(size / 8.0, &|_| {})
    };
    [Closing::default(), thorough].iter().filter(|closing| made(closing).is_ok()).count() > 0
}

#[test]
fn surfaces_of_broken_files_never_panic() {
    let geometry = Path::new(env!("CARGO_MANIFEST_DIR")).join("../geometry/tests");
    let mut random = Random::new(1);
    let mut below = move |limit: usize| random.below(limit);
    let (mut tried, mut bodies) = (0, 0);
    let mut paths: Vec<_> = ["data", "corpus"]
        .iter()
        .flat_map(|folder| fs::read_dir(geometry.join(folder)).unwrap())
        .map(|entry| entry.unwrap().path())
        .collect();
    paths.sort();
    for path in paths {
        let Some(format) = Format::of_path(&path) else { continue };
        let bytes = fs::read(&path).unwrap();
        for round in 0..8 {
            let mut changed = bytes.clone();
            for _ in 0..if bytes.is_empty() { 0 } else { round % 3 } {
                let at = below(changed.len());
                changed[at] = [b'9', b'-', b'0', b'e', 0xFF, 0, 1, changed[at] ^ 64][below(8)];
            }
            if let Ok(file) = read_bytes(&changed, format) {
                tried += 1;
                bodies += usize::from(fill(&file.mesh));
            }
        }
    }
    println!("{tried} meshes, {bodies} bodies");
    assert!(tried > 100 && bodies > 20, "{tried} {bodies}");
}

/// Triangles between few points at random: every kind of edge, folds, crossings, on a lattice also exact
/// contact.
#[test]
fn surfaces_at_random_never_panic() {
    let mut random = Random::new(7);
    let mut below = move |limit: usize| random.below(limit);
    for round in 0..40 {
        let scale = [1.0, 1e-3, 1e-12, 1e9, 1e150][round % 5];
        let points = (0..8).map(|_| Vector3::from_fn(|_, _| below(3) as f64) * scale).collect();
        let mut mesh = Mesh { points, ..Mesh::default() };
        mesh.block_mut(pliant_geometry::CellKind::Triangle).nodes =
            (0..36).map(|_| below(8) as u32).collect();
        fill(&mesh);
    }
}
