//! Distance between two surfaces in both directions: from each of many samples of one to the nearest point of
//! the other. The largest of both directions is the Hausdorff distance. Samples have at most the requested
//! spacing, so narrower peaks may be missed; the distances of samples are exact.

use std::fmt;

use pliant_geometry::{SurfaceLocator, Vector3, boundary};
use rayon::prelude::*;
use serde::Serialize;

use crate::surface::triangles::TriangleMesh;

/// Most samples along an edge.
const MOST_ALONG: usize = 64;

/// Distances between two surfaces [m]: from the first to the second, and back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Hausdorff {
    /// Largest distance from the first to the second.
    pub largest_forward: f64,
    /// Root mean square of it over the area.
    pub rms_forward: f64,
    /// Largest distance from the second to the first.
    pub largest_backward: f64,
    /// Root mean square of it over the area.
    pub rms_backward: f64,
}

/// A point of a surface, and its area [m²].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub(crate) point: Vector3,
    pub(crate) area: f64,
}

impl Hausdorff {
    /// Distances between two surfaces of triangles, with samples no more than `spacing` [m] apart.
    pub fn between(first: &TriangleMesh, second: &TriangleMesh, spacing: f64) -> Self {
        Self::with_places(first, second, spacing).0
    }

    /// Returns the distances, and the points of the first and of the second surface [m] that are farthest
    /// from the other surface.
    pub fn with_places(first: &TriangleMesh, second: &TriangleMesh, spacing: f64) -> (Self, [[f64; 3]; 2]) {
        let one_way = |from: &TriangleMesh, to: &TriangleMesh| {
            let locator = locator(to);
            let samples = samples(from, spacing);
            let far: Vec<f64> = samples.par_iter().map(|sample| distance(&locator, &sample.point)).collect();
            let farthest = samples.iter().zip(&far).max_by(|a, b| a.1.total_cmp(b.1));
            (spread(&samples, &far), farthest.map_or([0.0; 3], |(sample, _)| sample.point.into()))
        };
        let ((forward, there), (backward, back)) = (one_way(first, second), one_way(second, first));
        (Self::of(forward, backward), [there, back])
    }

    pub(crate) fn of(forward: (f64, f64), backward: (f64, f64)) -> Self {
        Self {
            largest_forward: forward.0,
            rms_forward: forward.1,
            largest_backward: backward.0,
            rms_backward: backward.1,
        }
    }

    /// The Hausdorff distance [m].
    pub fn largest(&self) -> f64 {
        self.largest_forward.max(self.largest_backward)
    }

    /// Both ways in words, in millimetres and in percent of a diagonal [m].
    pub fn lines(&self, diagonal: f64, ways: [&str; 2]) -> [String; 2] {
        let line = |way: &str, most: f64, rms: f64| {
            let part = |x: f64| 100.0 * x / diagonal;
            format!(
                "{way} {:.3} mm rms, {:.3} mm at most ({:.3} %, {:.3} % of the diagonal)",
                rms * 1e3,
                most * 1e3,
                part(rms),
                part(most)
            )
        };
        [
            line(ways[0], self.largest_forward, self.rms_forward),
            line(ways[1], self.largest_backward, self.rms_backward),
        ]
    }
}

impl fmt::Display for Hausdorff {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { largest_forward, rms_forward, largest_backward, rms_backward } = self;
        write!(
            f,
            "{largest_forward:.3e} m ({rms_forward:.3e} rms) there, {largest_backward:.3e} m ({rms_backward:.3e} rms) back"
        )
    }
}

/// The largest of distances, and their root mean square over the area.
pub(crate) fn spread(samples: &[Sample], far: &[f64]) -> (f64, f64) {
    let area: f64 = samples.iter().map(|sample| sample.area).sum();
    let squares: f64 = samples.iter().zip(far).map(|(sample, far)| sample.area * far * far).sum();
    let rms = if area > 0.0 { (squares / area).sqrt() } else { 0.0 };
    (far.iter().copied().fold(0.0, f64::max), rms)
}

pub(crate) fn locator(mesh: &TriangleMesh) -> SurfaceLocator {
    let flat = mesh.to_mesh();
    let surface = boundary(&flat);
    let faces: Vec<u32> = (0..surface.faces.len() as u32).collect();
    SurfaceLocator::new(&surface, &faces, &flat.points)
}

pub(crate) fn distance(locator: &SurfaceLocator, point: &Vector3) -> f64 {
    locator.closest(point).map_or(f64::INFINITY, |at| (at.position - point).norm())
}

/// Area coordinates of a lattice on a triangle of `n` parts along each edge, with its corners.
pub(crate) fn lattice(n: usize) -> Vec<[f64; 3]> {
    let of = |i: usize, j: usize| [i, j, n - i - j].map(|k| k as f64 / n as f64);
    (0..=n).flat_map(|i| (0..=n - i).map(move |j| of(i, j))).collect()
}

/// Samples of all triangles with their corners and edges.
pub(crate) fn samples(mesh: &TriangleMesh, spacing: f64) -> Vec<Sample> {
    let mut found = Vec::new();
    for t in mesh.alive() {
        let [a, b, c] = mesh.corners(t);
        let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
        let lattice = lattice(((longest / spacing).ceil() as usize).clamp(1, MOST_ALONG));
        let area = mesh.area(t) / lattice.len() as f64;
        found.extend(lattice.iter().map(|w| Sample { point: a * w[0] + b * w[1] + c * w[2], area }));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DEFAULT_CELL_LIMIT, sphere};

    /// Balls of radius 1 and 1.1: 0.1 apart up to the sagitta of their triangles, 0.003.
    #[test]
    fn spheres_are_as_far_apart_as_their_radii() {
        let ball =
            |radius| TriangleMesh::from_mesh(&sphere(radius, 4, DEFAULT_CELL_LIMIT).unwrap()).unwrap().0;
        let apart = Hausdorff::between(&ball(1.0), &ball(1.1), 0.05);
        for distance in [apart.largest_forward, apart.rms_forward, apart.largest_backward, apart.rms_backward]
        {
            assert!((distance - 0.1).abs() < 0.004, "{apart:?}");
        }
    }
}
