//! Checks before any allocation: the box of a field is sound, and the number of cells of its body is within
//! the limit.

use pliant_geometry::{CellKind, Vector3};

use crate::error::{MeshingError, require_at_most, require_positive};
use crate::input::field::ImplicitField;

/// Tetrahedra in a cube of the lattice.
pub(crate) const TETS_PER_CUBE: f64 = 12.0;

/// Largest possible number of cells, for 32-bit indices of lattice points.
const MOST_CELLS: usize = 1 << 25;

/// Cubes of the lattice over a box allowed per allowed cell, and always.
const CUBES_PER_CELL: usize = 4;
const CUBES_ALWAYS: usize = 1_000_000;

/// Samples along each axis to estimate which part of its box a body fills.
const SAMPLES: usize = 32;

/// The limit on cells that applies.
pub(crate) fn allowed(cell_limit: usize) -> usize {
    cell_limit.min(MOST_CELLS)
}

/// The box of a field, finite and not empty.
pub(crate) fn checked_box(field: &(impl ImplicitField + ?Sized)) -> Result<(Vector3, Vector3), MeshingError> {
    let (low, high) = field.bounds();
    let sound = (0..3).all(|axis| low[axis].is_finite() && high[axis].is_finite() && low[axis] < high[axis]);
    if sound { Ok((low, high)) } else { Err(MeshingError::BadBox { low, high }) }
}

/// Checks that cubes of edge `edge` over the box of a field, each filled with `cells_per_cube`, stay within
/// the limit. The body is sampled only if its whole box would exceed it.
pub(crate) fn require_room(
    field: &(impl ImplicitField + ?Sized),
    edge: f64,
    cells_per_cube: f64,
    cell_limit: usize,
) -> Result<(), MeshingError> {
    let (low, high) = checked_box(field)?;
    let cubes_along = (high - low) / edge;
    let cubes = cubes_along.add_scalar(4.0).product();
    let limit = allowed(cell_limit);
    if cubes * cells_per_cube > limit as f64 {
        require_at_most(filled_fraction(field) * cubes_along.product() * cells_per_cube, limit)?;
    }
    let cube_limit = limit.saturating_mul(CUBES_PER_CELL).max(CUBES_ALWAYS);
    if cubes > cube_limit as f64 {
        return Err(MeshingError::LatticeTooLarge { cubes: cubes as u64, limit: cube_limit });
    }
    Ok(())
}

/// Checks before meshing that a body of a volume [m³] filled with tets or hexes of `edge` [m] stays within
/// the limit on cells.
pub fn require_room_for(
    kind: CellKind,
    edge: f64,
    volume: f64,
    cell_limit: usize,
) -> Result<(), MeshingError> {
    require_positive("edge", edge)?;
    let cells_per_cube = if kind == CellKind::Tet { TETS_PER_CUBE } else { 1.0 };
    require_at_most(cells_per_cube * volume / edge.powi(3), allowed(cell_limit))
}

/// About the part of its box that a body fills.
fn filled_fraction(field: &(impl ImplicitField + ?Sized)) -> f64 {
    let (low, high) = field.bounds();
    let step = (high - low) / SAMPLES as f64;
    let inside = |at: &usize| {
        let along = [at % SAMPLES, at / SAMPLES % SAMPLES, at / SAMPLES / SAMPLES];
        let point = low + step.component_mul(&Vector3::from(along.map(|i| i as f64 + 0.5)));
        field.value(&point) > 0.0
    };
    let samples = SAMPLES.pow(3);
    (0..samples).filter(inside).count() as f64 / samples as f64
}
