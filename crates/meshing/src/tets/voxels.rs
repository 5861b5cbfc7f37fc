//! Cubes in the body of a field, on a regular grid; only the largest face-connected part is kept. Either
//! every cube with its centre inside counts, or every cube that the body fills by more than a small fraction.
//! The second kind has this fraction as data. Immersed cubes are weighted by their fractions and carry the
//! surface of the body (de Visser and Comas 2008).

use pliant_geometry::{CellKind, DataArray, Vector3};
use rayon::prelude::*;

use crate::error::{MeshingError, require_at_most, require_positive};
use crate::input::extent::{allowed, checked_box, require_room};
use crate::input::field::ImplicitField;
use crate::shapes::structured::Grid;
use crate::tets::topology::largest_component;
use crate::{DEFAULT_CELL_LIMIT, FieldMesh};

/// Cubes that the body fills by less than this are left out.
const LEAST_FRACTION: f64 = 0.02;

/// Samples of the field along an edge of a cube in which the surface may lie.
const SAMPLES: usize = 8;

/// A request for cubes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Voxels {
    /// Edge of the cubes [m].
    pub edge: f64,
    /// Most cells allowed.
    pub cell_limit: usize,
}

impl Voxels {
    /// Name of the cell data of immersed cubes that holds their fractions.
    pub const FRACTION: &str = "fraction";

    /// Cubes of edge `edge` [m] with the default limit on cells.
    pub fn new(edge: f64) -> Self {
        Self { edge, cell_limit: DEFAULT_CELL_LIMIT }
    }

    /// The cubes with their centre inside the body. The grid is centred on the box of the body and covers it.
    pub fn mesh(&self, field: &(impl ImplicitField + ?Sized)) -> Result<FieldMesh, MeshingError> {
        let (mesh, _) = self.fill(field, |point| Ok(finite(field, point)?.max(0.0)), 0.0)?;
        Ok(mesh)
    }

    /// Returns the cubes of the same grid that the body fills by more than 2 %. The fraction is cell data
    /// [`Self::FRACTION`], from 512 samples in each cube near the surface.
    pub fn immersed(&self, field: &(impl ImplicitField + ?Sized)) -> Result<FieldMesh, MeshingError> {
        let (mut made, fractions) =
            self.fill(field, |centre| self.fraction(field, centre), LEAST_FRACTION)?;
        for block in &mut made.mesh.blocks {
            block.data.insert(Self::FRACTION.to_owned(), DataArray::scalar(fractions.clone()));
        }
        Ok(made)
    }

    /// Makes the cubes with more than `least` of a measure at their centres. Also returns the values of the
    /// measure.
    fn fill(
        &self,
        field: &(impl ImplicitField + ?Sized),
        measure: impl Fn(&Vector3) -> Result<f64, MeshingError> + Sync,
        least: f64,
    ) -> Result<(FieldMesh, Vec<f64>), MeshingError> {
        require_positive("edge", self.edge)?;
        let (low, high) = checked_box(field)?;
        require_room(field, self.edge, 1.0, self.cell_limit)?;
        let counts = [0, 1, 2].map(|axis| count_along(high[axis] - low[axis], self.edge));
        let size = Vector3::from(counts.map(|n| n as f64)) * self.edge;
        let origin = (low + high - size) / 2.0;
        let grid = Grid { counts, wraps: false };
        let at = |triple: [usize; 3], shift: f64| {
            origin + Vector3::from(triple.map(|i| i as f64 + shift)) * self.edge
        };
        let measured: Vec<_> = (0..grid.cell_count())
            .into_par_iter()
            .map(|number| measure(&at(grid.cell(number), 0.5)))
            .collect();
        let measured = measured.into_iter().collect::<Result<Vec<f64>, _>>()?;
        let inside: Vec<usize> = (0..measured.len()).filter(|&number| measured[number] > least).collect();
        require_at_most(inside.len() as f64, allowed(self.cell_limit))?;
        if inside.is_empty() {
            return Err(MeshingError::NoCells { edge: self.edge, size: high - low });
        }
        let nodes: Vec<u32> = inside.iter().flat_map(|&number| grid.hex(grid.cell(number))).collect();
        let made = largest_component(CellKind::Hex, &nodes, |node| at(grid.point(node), 0.0));
        // The first corner identifies a cell; the kept cells stay in order.
        let mut kept = made.mesh.blocks[0].cells().map(|cell| made.mesh.points[cell[0] as usize]).peekable();
        let is_kept = |number: &usize| kept.next_if(|first| *first == at(grid.cell(*number), 0.0)).is_some();
        let values = inside.into_iter().filter(is_kept).map(|number| measured[number]).collect();
        Ok((made, values))
    }

    /// The part of a cube that the body fills, by samples at the centres of smaller cubes.
    fn fraction(&self, field: &(impl ImplicitField + ?Sized), centre: &Vector3) -> Result<f64, MeshingError> {
        // A value approximates the distance to the surface: beyond twice the half diagonal, the cube contains
        // no surface.
        let value = finite(field, centre)?;
        if value.abs() > 3.0_f64.sqrt() * self.edge {
            return Ok(if value > 0.0 { 1.0 } else { 0.0 });
        }
        let place = |i: usize| ((i as f64 + 0.5) / SAMPLES as f64 - 0.5) * self.edge;
        let mut filled = 0;
        for at in 0..SAMPLES.pow(3) {
            let shift =
                Vector3::new(place(at % SAMPLES), place(at / SAMPLES % SAMPLES), place(at / SAMPLES.pow(2)));
            filled += usize::from(finite(field, &(centre + shift))? > 0.0);
        }
        Ok(filled as f64 / SAMPLES.pow(3) as f64)
    }
}

/// The value of a field, which must be finite.
fn finite(field: &(impl ImplicitField + ?Sized), point: &Vector3) -> Result<f64, MeshingError> {
    let value = field.value(point);
    if value.is_finite() { Ok(value) } else { Err(MeshingError::FieldNotFinite { value, point: *point }) }
}

/// Number of cells that cover a length; an excess of a millionth of a cell adds none.
fn count_along(length: f64, edge: f64) -> usize {
    ((length / edge - 1e-6).ceil() as usize).max(1)
}
