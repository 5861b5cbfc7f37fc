//! Cubes in the body of a field: every cell of a regular grid whose centre is inside, the largest
//! face-connected part.
//! Leaves out: the fraction of a cube that the body fills, and a surface smoother than steps.

use pliant_geometry::{CellKind, Vector3};
use rayon::prelude::*;

use crate::error::{MeshingError, require_at_most, require_positive};
use crate::extent::{allowed, checked_box, require_room};
use crate::field::ImplicitField;
use crate::structured::Grid;
use crate::topology::largest_component;
use crate::{DEFAULT_CELL_LIMIT, FieldMesh};

/// A request for cubes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Voxels {
    /// Edge of the cubes [m].
    pub edge: f64,
    /// Most cells allowed.
    pub cell_limit: usize,
}

impl Voxels {
    /// Cubes of edge `edge` [m] with the default limit on cells.
    pub fn new(edge: f64) -> Self {
        Self { edge, cell_limit: DEFAULT_CELL_LIMIT }
    }

    /// Fills the body of the field with cubes. The grid is centred on the box of the body and covers it.
    pub fn mesh(&self, field: &(impl ImplicitField + ?Sized)) -> Result<FieldMesh, MeshingError> {
        require_positive("edge", self.edge)?;
        let (low, high) = checked_box(field)?;
        require_room(field, self.edge, 1.0, self.cell_limit)?;
        let counts = [0, 1, 2].map(|axis| count_along(high[axis] - low[axis], self.edge));
        let size = Vector3::from(counts.map(|n| n as f64)) * self.edge;
        let origin = (low + high - size) / 2.0;
        let grid = Grid { counts, wraps: false };
        let inside = self.inside(field, &grid, &origin)?;
        require_at_most(inside.len() as f64, allowed(self.cell_limit))?;
        if inside.is_empty() {
            return Err(MeshingError::NoCells { edge: self.edge, size: high - low });
        }
        let nodes: Vec<u32> = inside.into_iter().flat_map(|cell| grid.hex(cell)).collect();
        let corner = |node: u32| origin + Vector3::from(grid.point(node).map(|i| i as f64)) * self.edge;
        Ok(largest_component(CellKind::Hex, &nodes, corner))
    }

    /// The cells with their centre inside, in the order of the grid.
    fn inside(
        &self,
        field: &(impl ImplicitField + ?Sized),
        grid: &Grid,
        origin: &Vector3,
    ) -> Result<Vec<[usize; 3]>, MeshingError> {
        let value = |cell: [usize; 3]| {
            let point = origin + Vector3::from(cell.map(|i| i as f64 + 0.5)) * self.edge;
            (field.value(&point), point)
        };
        let values: Vec<_> =
            (0..grid.cell_count()).into_par_iter().map(|number| value(grid.cell(number))).collect();
        if let Some(&(value, point)) = values.iter().find(|(value, _)| !value.is_finite()) {
            return Err(MeshingError::FieldNotFinite { value, point });
        }
        Ok((0..values.len()).filter(|&at| values[at].0 > 0.0).map(|number| grid.cell(number)).collect())
    }
}

/// Cells that cover a length; a millionth of a cell too many is no cell.
fn count_along(length: f64, edge: f64) -> usize {
    ((length / edge - 1e-6).ceil() as usize).max(1)
}
