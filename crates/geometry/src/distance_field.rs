//! Signed distances at the points of a regular grid, linear in each cell of eight points.

use rayon::prelude::*;

use crate::Vector3;
use crate::grid::Grid;

/// A signed distance, positive inside [m].
#[derive(Clone, Debug, PartialEq)]
pub struct DistanceField {
    grid: Grid,
    values: Vec<f32>,
    /// Box in which the field may be positive [m].
    bounds: [Vector3; 2],
}

impl DistanceField {
    /// Makes a field from values [m] at the points of a grid, positive inside, i fastest. `None` if no value
    /// is positive, their number does not match the grid, or the grid has fewer than two points along an
    /// axis.
    pub fn of_values(grid: Grid, values: Vec<f32>) -> Option<Self> {
        let fits = values.len() == grid.len() && grid.dims.iter().all(|&n| n > 1);
        let bounds = fits.then(|| positive_box(&grid, &values)).flatten()?;
        Some(Self { grid, values, bounds })
    }

    /// Volume of the inside [m³]. Each cell round a point counts in part, by the share of the cell on the
    /// inner side of a plane. The cell is one mean step thick, and the plane is at the distance of its
    /// centre.
    pub fn volume(&self) -> f64 {
        let step = self.grid.voxel_volume().cbrt();
        let parts = self.values.par_iter().map(|&f| (0.5 + f64::from(f) / step).clamp(0.0, 1.0));
        // In chunks of a fixed length, so the sum does not depend on threads.
        let sums: Vec<f64> = parts.chunks(1 << 16).map(|chunk| chunk.iter().sum()).collect();
        sums.iter().sum::<f64>() * self.grid.voxel_volume()
    }

    /// The field at a point [m], positive inside.
    pub fn value(&self, point: &Vector3) -> f64 {
        let index = self.grid.index(point);
        let within = self.clamped(&index);
        let (values, part) = self.round(&within);
        self.value_of(&values, &part, [&index, &within], point)
    }

    /// Gradient of the field at a point, dimensionless; of length 1 except for smoothing.
    pub fn gradient(&self, point: &Vector3) -> Vector3 {
        let (values, part) = self.round(&self.clamped(&self.grid.index(point)));
        self.gradient_of(&values, &part)
    }

    /// The value and the gradient, for little more than the cost of one.
    pub fn value_and_gradient(&self, point: &Vector3) -> (f64, Vector3) {
        let index = self.grid.index(point);
        let within = self.clamped(&index);
        let (values, part) = self.round(&within);
        (self.value_of(&values, &part, [&index, &within], point), self.gradient_of(&values, &part))
    }

    fn value_of(
        &self,
        values: &[f64; 8],
        part: &Vector3,
        [index, within]: [&Vector3; 2],
        point: &Vector3,
    ) -> f64 {
        let along = |at: usize, t: f64| values[at] * (1.0 - t) + values[at + 1] * t;
        let plane = |at: usize| along(at, part.x) * (1.0 - part.y) + along(at + 2, part.x) * part.y;
        let inner = plane(0) * (1.0 - part.z) + plane(4) * part.z;
        // Beyond the box the field falls with the distance from it.
        if index == within { inner } else { inner - (self.grid.position(within) - point).norm() }
    }

    fn gradient_of(&self, values: &[f64; 8], part: &Vector3) -> Vector3 {
        let mut gradient = Vector3::zeros();
        for (at, value) in values.iter().enumerate() {
            let side = [at & 1, at >> 1 & 1, at >> 2 & 1];
            let weight = |axis: usize| if side[axis] == 1 { part[axis] } else { 1.0 - part[axis] };
            let slope = |axis: usize| if side[axis] == 1 { 1.0 } else { -1.0 };
            gradient.x += value * slope(0) * weight(1) * weight(2);
            gradient.y += value * weight(0) * slope(1) * weight(2);
            gradient.z += value * weight(0) * weight(1) * slope(2);
        }
        self.grid.gradient(&gradient)
    }

    /// Smallest and largest corner of a box round the inside [m].
    pub fn bounds(&self) -> [Vector3; 2] {
        self.bounds
    }

    /// Lengths of the steps of the grid [m].
    pub fn spacing(&self) -> [f64; 3] {
        self.grid.spacing()
    }

    fn clamped(&self, index: &Vector3) -> Vector3 {
        let last = self.grid.dims.map(|n| n as f64 - 1.0);
        Vector3::new(index.x.clamp(0.0, last[0]), index.y.clamp(0.0, last[1]), index.z.clamp(0.0, last[2]))
    }

    /// Returns the values at the corners of the cell that holds a place, and the place within the cell (0 to
    /// 1 along each axis). The bits of a corner's number are steps along i, j and k.
    fn round(&self, within: &Vector3) -> ([f64; 8], Vector3) {
        let [nx, ny, _] = self.grid.dims;
        // No place is negative, so the conversion rounds down.
        let first = [0, 1, 2].map(|axis| (within[axis] as usize).min(self.grid.dims[axis] - 2));
        let start = first[0] + nx * (first[1] + ny * first[2]);
        let value =
            |at: usize| f64::from(self.values[start + (at & 1) + nx * ((at >> 1 & 1) + ny * (at >> 2 & 1))]);
        (std::array::from_fn(value), Vector3::from_fn(|axis, _| within[axis] - first[axis] as f64))
    }
}

/// Box in world coordinates round all cells with a positive corner.
fn positive_box(grid: &Grid, values: &[f32]) -> Option<[Vector3; 2]> {
    let mut first = [usize::MAX; 3];
    let mut last = [0; 3];
    for at in (0..values.len()).filter(|&at| values[at] > 0.0) {
        for (axis, i) in grid.triple(at).into_iter().enumerate() {
            first[axis] = first[axis].min(i);
            last[axis] = last[axis].max(i);
        }
    }
    // Half a voxel more than the faces of the voxels: linear values reach zero before the next centre.
    let round = |i: usize| i.saturating_sub(1);
    (first[0] != usize::MAX).then(|| grid.world_box(first.map(round), last.map(|i| i + 1)))
}
