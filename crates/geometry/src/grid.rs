//! Regular grids of points, as the voxel centres of an image: world = origin + axes · (i, j, k), in metres. A
//! grid may be mirrored (det < 0) or sheared (tilted gantry).

use nalgebra::Matrix3;
use thiserror::Error;

use crate::Vector3;

/// The steps of a grid are not finite, have no length or lie in a plane.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("the steps of the grid ({:?}, {:?} and {:?} m) span no volume", steps[0].as_slice(), steps[1].as_slice(), steps[2].as_slice())]
pub struct FlatGrid {
    /// Steps along i, j and k [m].
    pub steps: [Vector3; 3],
}

/// A regular grid; its points are the centres of voxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Points along i, j and k; i runs fastest in memory.
    pub dims: [usize; 3],
    /// The point (0, 0, 0) [m].
    pub origin: Vector3,
    /// Columns: the steps [m] from a point to the next along i, j and k.
    pub axes: Matrix3<f64>,
    /// Inverse of `axes` [1/m].
    inverse: Matrix3<f64>,
}

impl Grid {
    /// A grid from its size, origin [m] and steps [m]. An error if a number is not finite, a step has no
    /// length, or the steps lie (nearly) in a plane.
    pub fn new(dims: [usize; 3], origin: Vector3, axes: Matrix3<f64>) -> Result<Self, FlatGrid> {
        let finite = origin.iter().chain(axes.iter()).all(|x| x.is_finite());
        let lengths = [0, 1, 2].map(|a| axes.column(a).norm());
        let volume = axes.determinant();
        // 1e-4: steps within 0.006° of a plane. No scanner tilts this far; the matrix is damaged.
        let flat = volume.abs() <= 1e-4 * lengths.iter().product::<f64>();
        match axes.try_inverse() {
            Some(inverse) if finite && !flat && inverse.iter().all(|x| x.is_finite()) => {
                Ok(Self { dims, origin, axes, inverse })
            }
            _ => Err(FlatGrid { steps: [0, 1, 2].map(|a| axes.column(a).into()) }),
        }
    }

    /// A grid along the world axes.
    pub fn along_axes(dims: [usize; 3], origin: Vector3, spacing: [f64; 3]) -> Result<Self, FlatGrid> {
        Self::new(dims, origin, Matrix3::from_diagonal(&spacing.into()))
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.dims.iter().product()
    }

    /// True without any point.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Lengths of the steps along i, j and k [m].
    pub fn spacing(&self) -> [f64; 3] {
        [0, 1, 2].map(|axis| self.axes.column(axis).norm())
    }

    /// Volume of a voxel [m³].
    pub fn voxel_volume(&self) -> f64 {
        self.axes.determinant().abs()
    }

    /// World position [m] of a place in the grid; voxel centres are whole numbers.
    pub fn position(&self, index: &Vector3) -> Vector3 {
        self.origin + self.axes * index
    }

    /// Place in the grid of a world position [m].
    pub fn index(&self, position: &Vector3) -> Vector3 {
        self.inverse * (position - self.origin)
    }

    /// Gradient in world coordinates [1/m] of a function with this gradient along i, j and k.
    pub fn gradient(&self, along_index: &Vector3) -> Vector3 {
        self.inverse.transpose() * along_index
    }

    /// The point (i, j, k) of a place in memory.
    pub fn triple(&self, at: usize) -> [usize; 3] {
        let [nx, ny, _] = self.dims;
        [at % nx, at / nx % ny, at / nx / ny]
    }

    /// The part of the grid from point `first` on, `dims` long; it may reach beyond the grid.
    pub fn part(&self, first: [i64; 3], dims: [usize; 3]) -> Self {
        let origin = self.position(&Vector3::from(first.map(|i| i as f64)));
        Self { dims, origin, ..*self }
    }

    /// A grid from another origin [m] on, with multiples of these steps.
    pub fn coarser(&self, dims: [usize; 3], origin: Vector3, factors: [usize; 3]) -> Self {
        let factors = Vector3::from(factors.map(|n| n as f64));
        let axes = self.axes * Matrix3::from_diagonal(&factors);
        let inverse = Matrix3::from_diagonal(&factors.map(f64::recip)) * self.inverse;
        Self { dims, origin, axes, inverse }
    }

    /// Box [m] in world coordinates round the voxels `first` to `last`, faces included.
    pub fn world_box(&self, first: [usize; 3], last: [usize; 3]) -> [Vector3; 2] {
        let low = Vector3::from(first.map(|i| i as f64 - 0.5));
        let high = Vector3::from(last.map(|i| i as f64 + 0.5));
        let corners = (0..8).map(|at| {
            let pick = |axis: usize| if at >> axis & 1 == 0 { low[axis] } else { high[axis] };
            self.position(&Vector3::new(pick(0), pick(1), pick(2)))
        });
        corners
            .fold([Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)], |[low, high], x| {
                [low.inf(&x), high.sup(&x)]
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn index_undoes_position_for_a_sheared_left_handed_grid() {
        let axes = Matrix3::new(-1.0, 0.1, 0.3, 0.0, 2.0, 0.2, 0.1, 0.0, 3.0) * 1e-3;
        let grid = Grid::new([4, 5, 6], Vector3::new(0.1, 0.2, 0.3), axes).unwrap();
        let place = Vector3::new(1.5, -2.0, 7.25);
        assert!((grid.index(&grid.position(&place)) - place).norm() < 1e-12);
        assert!((grid.voxel_volume() - 6.058e-9).abs() < 1e-15);
    }

    #[test]
    fn steps_in_a_plane_are_refused() {
        let axes = Matrix3::new(1.0, 2.0, 0.0, 1.0, 2.0, 0.0, 0.0, 0.0, 1.0);
        assert!(matches!(Grid::new([1; 3], Vector3::zeros(), axes), Err(FlatGrid { .. })));
        let nan = Matrix3::repeat(f64::NAN);
        assert!(matches!(Grid::new([1; 3], Vector3::zeros(), nan), Err(FlatGrid { .. })));
    }
}
