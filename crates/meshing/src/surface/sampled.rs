//! Signed distances of a closed surface at the points of a regular grid, as contact needs them. They are
//! exact wherever the surface, moved outward by an offset, may be near. Far from it they are exact at every
//! fourth point along each axis and linear in between. Leaves out: sharp edges of the moved surface, which is
//! rounded where it goes outward round an edge.

use pliant_geometry::{DistanceField, Grid, SurfaceLocator, Vector3};
use rayon::prelude::*;

use crate::error::{MeshingError, require_positive};
use crate::input::enclosed::{Enclosed, MOST_POINTS, sign};
use crate::report::hausdorff::{distance, locator};
use crate::surface::nesting::corners_of;
use crate::surface::triangles::TriangleMesh;
use crate::surface::winding::Winding;
use crate::{DEFAULT_CELL_LIMIT, Fewer};

/// Spacing, in points along each axis, of the points that have an exact distance also far from the surface.
const COARSE: usize = 4;

/// Least number of grid points on each side of the moved surface with exact distances.
const BAND: f64 = 2.0;

/// Least number of grid points around the surface.
const MARGIN: f64 = 4.0;

/// Steps of the grid along the cubes in which a moved surface is drawn.
const DRAWN: f64 = 3.0;

/// Most triangles of a drawn surface.
const MOST_DRAWN: usize = 20_000;

/// Signed distances of a surface on a regular grid.
#[derive(Clone, Debug)]
pub struct SampledDistances {
    /// The first point [m].
    pub origin: Vector3,
    /// Distance between the points along each axis [m].
    pub spacing: f64,
    /// Points along each axis.
    pub counts: [usize; 3],
    /// Distances [m], negative inside, x fastest.
    pub values: Vec<f32>,
    /// The moved surface in triangles, to be drawn.
    pub surface: TriangleMesh,
    /// Thickness of the inside [m]: the true thickness is less on a twentieth of the surface only.
    pub thickness: f64,
}

impl Enclosed {
    /// Length of an edge [m], as a mean over all triangles.
    pub fn mean_edge(&self) -> f64 {
        let corners = corners_of(&self.points, &self.triangles);
        let around = |[a, b, c]: &[Vector3; 3]| (b - a).norm() + (c - b).norm() + (a - c).norm();
        corners.iter().map(around).sum::<f64>() / (3 * corners.len()) as f64
    }

    /// Points along each axis of the grid that [`sampled`](Self::sampled) fills.
    pub fn grid_counts(&self, spacing: f64, offset: f64) -> [f64; 3] {
        let (low, high) = self.bounds();
        let room = 2.0 * (offset.max(0.0) / spacing + MARGIN);
        let cells = ((high - low) / spacing).add_scalar(room).map(|n| (n / COARSE as f64).ceil());
        [0, 1, 2].map(|axis| cells[axis] * COARSE as f64 + 1.0)
    }

    /// Signed distances of the surface moved outward by an offset [m], inward if it is negative, at points
    /// `spacing` [m] apart. `progress` hears fractions from 0 to 1.
    ///
    /// # Errors
    /// If the spacing is not positive, the grid has more than 2²⁶ points, or nothing is left inside.
    pub fn sampled(
        &self,
        spacing: f64,
        offset: f64,
        progress: &dyn Fn(f64),
    ) -> Result<SampledDistances, MeshingError> {
        require_positive("spacing", spacing)?;
        let (low, high) = self.bounds();
        let counts = self.grid_counts(spacing, offset);
        let points: f64 = counts.iter().product();
        if points > MOST_POINTS as f64 {
            return Err(MeshingError::LatticeTooLarge { cubes: points as u64, limit: MOST_POINTS });
        }
        let counts = counts.map(|n| n as usize);
        let length = Vector3::from(counts.map(|n| (n - 1) as f64)) * spacing;
        let origin = (low + high - length) / 2.0;
        let grid =
            Grid::along_axes(counts, origin, [spacing; 3]).map_err(|_| MeshingError::BadBox { low, high })?;
        let winding = Winding::new(corners_of(&self.points, &self.triangles));
        let hull = self.hull(&winding, spacing);
        progress(0.1);
        let reach = offset.abs() + BAND * spacing;
        let mut values = distances(&grid, &locator(&hull), reach, &|done| progress(0.1 + 0.6 * done));
        sign(&grid, &winding, &mut values);
        values.par_iter_mut().for_each(|value| *value += offset as f32);
        progress(0.8);
        let within = values.par_iter().copied().reduce(|| f32::NEG_INFINITY, f32::max);
        let field = DistanceField::of_values(grid, values.clone()).ok_or(MeshingError::NothingEnclosed)?;
        let thickness = hull.thickness().map_or(f64::from(within), |found| found.thickness.p5 + 2.0 * offset);
        let mut surface = match offset == 0.0 {
            true => hull,
            false => TriangleMesh::of_field(&field, DRAWN * spacing, DEFAULT_CELL_LIMIT)?,
        };
        if surface.len() > MOST_DRAWN {
            surface.decimate(Fewer::Triangles(MOST_DRAWN))?;
        }
        values.par_iter_mut().for_each(|value| *value = -*value);
        progress(1.0);
        Ok(SampledDistances { origin, spacing, counts, values, surface, thickness })
    }
}

/// Distances to a surface [m] at the points of a grid, exact where they are below `reach`.
fn distances(grid: &Grid, surface: &SurfaceLocator, reach: f64, progress: &dyn Fn(f64)) -> Vec<f32> {
    let [nx, ny, nz] = grid.dims;
    let blocks = grid.dims.map(|n| (n - 1) / COARSE);
    let corners = blocks.map(|n| n + 1);
    let at = |index: [usize; 3]| distance(surface, &grid.position(&Vector3::from(index.map(|i| i as f64))));
    let corner_at = |n: usize| {
        let [i, j, k] = [n % corners[0], n / corners[0] % corners[1], n / (corners[0] * corners[1])];
        at([i, j, k].map(|i| i * COARSE))
    };
    let coarse: Vec<f64> = (0..corners.iter().product()).into_par_iter().map(corner_at).collect();
    progress(0.3);
    // A distance changes by no more than the way: no point of a block is farther than this from its nearest
    // corner.
    let half = 0.5 * COARSE as f64 * Vector3::from(grid.spacing()).norm();
    let layer = |k: usize| {
        let (block, part) = (k / COARSE, (k % COARSE) as f64 / COARSE as f64);
        let mut values = vec![0.0; nx * ny];
        for (j, row) in values.chunks_exact_mut(nx).enumerate() {
            for (i, value) in row.iter_mut().enumerate() {
                let first = [i / COARSE, j / COARSE, block];
                let parts = [(i % COARSE) as f64 / COARSE as f64, (j % COARSE) as f64 / COARSE as f64, part];
                let mut least = f64::INFINITY;
                let mut linear = 0.0;
                for corner in 0..8 {
                    let side = [0, 1, 2].map(|axis| corner >> axis & 1);
                    let weight = |axis: usize| if side[axis] == 1 { parts[axis] } else { 1.0 - parts[axis] };
                    let weight: f64 = (0..3).map(weight).product();
                    if weight > 0.0 {
                        let [a, b, c] = [0, 1, 2].map(|axis| first[axis] + side[axis]);
                        let found = coarse[a + corners[0] * (b + corners[1] * c)];
                        least = least.min(found);
                        linear += weight * found;
                    }
                }
                *value = if least > reach + half { linear } else { at([i, j, k]) } as f32;
            }
        }
        values
    };
    let values = (0..nz).into_par_iter().flat_map_iter(layer).collect();
    progress(1.0);
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use pliant_geometry::{Mesh, Vector3};

    use crate::{Block, Closing, Resolution, VolumeCell, sphere};

    fn enclosed(mesh: &Mesh) -> Enclosed {
        Enclosed::new(mesh, 1e-6, &Closing::default()).unwrap()
    }

    /// Values of the grid with their places.
    fn points(sampled: &SampledDistances) -> impl Iterator<Item = (Vector3, f64)> {
        let [nx, ny, _] = sampled.counts;
        sampled.values.iter().enumerate().map(move |(at, &value)| {
            let index = Vector3::new((at % nx) as f64, (at / nx % ny) as f64, (at / (nx * ny)) as f64);
            (sampled.origin + sampled.spacing * index, f64::from(value))
        })
    }

    /// The distance to a box about its middle, in closed form.
    fn to_box(point: &Vector3, half: &Vector3) -> f64 {
        let beyond = point.abs() - half;
        beyond.map(|x| x.max(0.0)).norm() + beyond.max().min(0.0)
    }

    /// Distances to a box: exact where they are small, with the right sign everywhere. Elsewhere they are off
    /// by less than the spacing of the coarse points.
    #[test]
    fn distances_to_a_box_are_those_of_geometry() {
        let size = [0.05, 0.03, 0.02];
        let mesh = Block::new(size)
            .mesh(Resolution::Counts([2, 2, 2]), VolumeCell::Hex, DEFAULT_CELL_LIMIT)
            .unwrap();
        let half = Vector3::from(size) / 2.0;
        for (spacing, offset) in [(0.001, 0.0), (0.0007, 0.002), (0.001, -0.003)] {
            let sampled = enclosed(&mesh).sampled(spacing, offset, &|_| ()).unwrap();
            let (mut exact, mut total) = (0, 0);
            for (place, value) in points(&sampled) {
                let expected = to_box(&(place - half), &half) - offset;
                let off = (value - expected).abs();
                total += 1;
                if expected.abs() < BAND * spacing {
                    exact += 1;
                    assert!(off < 1e-8, "{value} instead of {expected} at {place}");
                }
                assert!(off < COARSE as f64 * spacing, "{value} instead of {expected} at {place}");
                assert!(expected.abs() < 1e-8 || value * expected > 0.0, "{value}, {expected} at {place}");
            }
            println!(
                "spacing {spacing} m, offset {offset} m: {exact} of {total} points are near the surface"
            );
            assert!((sampled.thickness - (0.02 + 2.0 * offset)).abs() < 1e-9);
            let drawn = sampled.surface.to_mesh();
            let far = drawn.points.iter().map(|x| (to_box(&(x - half), &half) - offset).abs());
            assert!(far.fold(0.0, f64::max) < spacing);
        }
    }

    /// A ball in a ball with the inner one turned inside out is a shell: inside between the two.
    #[test]
    fn a_cavity_is_outside() {
        let mut shell = sphere(0.05, 4, DEFAULT_CELL_LIMIT).unwrap();
        let inner = sphere(0.03, 4, DEFAULT_CELL_LIMIT).unwrap();
        let first = shell.points.len() as u32;
        shell.points.extend(&inner.points);
        let turned = inner.blocks[0].cells().flat_map(|nodes| [nodes[0], nodes[2], nodes[1]]);
        shell.blocks[0].nodes.extend(turned.map(|node| first + node));
        let sampled = enclosed(&shell).sampled(0.002, 0.0, &|_| ()).unwrap();
        for (place, value) in points(&sampled) {
            let expected = (place.norm() - 0.04).abs() - 0.01;
            // Facets lie up to 0.25 mm below the balls.
            let bound = if expected.abs() < 0.004 { 2.5e-4 } else { 0.008 };
            assert!((value - expected).abs() < bound, "{value} instead of {expected} at {place}");
            assert!(expected.abs() < 2.5e-4 || value * expected > 0.0, "{value}, {expected} at {place}");
        }
    }

    #[test]
    fn a_grid_that_is_too_large_or_empty_is_refused() {
        let ball = enclosed(&sphere(0.05, 3, DEFAULT_CELL_LIMIT).unwrap());
        let refused = |spacing, offset| ball.sampled(spacing, offset, &|_| ()).unwrap_err();
        assert!(matches!(refused(1e-5, 0.0), MeshingError::LatticeTooLarge { .. }));
        assert!(matches!(refused(0.0, 0.0), MeshingError::NotPositive { .. }));
        assert_eq!(refused(0.005, -0.06), MeshingError::NothingEnclosed);
    }
}
