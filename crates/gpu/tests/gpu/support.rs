//! The device tests run on, and shells.

use pliant_geometry::Mesh;
use pliant_gpu::{Device, GpuError};
use pliant_implicit::{Assembly, Shell};
use pliant_meshing::{DEFAULT_CELL_LIMIT, Pattern, Sheet};
use pliant_shells::element::Formulation;
use pliant_shells::element::Wall;
use pliant_testing::found_or_skipped;

/// The best device. Without any a test is skipped with a notice, or fails where `PLIANT_REQUIRE_GPU=1`.
pub fn device() -> Option<Device> {
    match Device::open(None) {
        Err(error) if !matches!(error, GpuError::NoAdapter) => panic!("{error}: {}", error.remedy()),
        found => found_or_skipped(found.map_err(|error| format!("{error} ({})", error.remedy()))),
    }
}

/// Returns the triangles of a sheet with `counts` cells along its axes; points are numbered along the first.
pub fn triangles(sheet: Sheet, counts: [usize; 2], pattern: Pattern) -> Mesh {
    sheet.mesh(counts, pattern, None, DEFAULT_CELL_LIMIT).unwrap()
}

/// A shell of the triangles of a mesh.
pub fn shell(mesh: &Mesh, thickness: f64, wall: Wall, formulation: Formulation) -> Assembly {
    let cells = mesh.blocks[0].cells().map(|cell| [cell[0], cell[1], cell[2]]).collect();
    let mut model = Assembly::new("wall", mesh.points.iter().copied());
    model.add_shell(&Shell { formulation, ..Shell::new("wall", cells, thickness, wall) }).unwrap();
    model
}
