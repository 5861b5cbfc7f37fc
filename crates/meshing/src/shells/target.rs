//! The surface to be fitted, and its sampled points. Where a surface folds, its other side may be nearer than
//! the side that a shell stands for. Points that look the other way are passed over within the size of the
//! shell.

use std::collections::BTreeMap;

use pliant_geometry::Vector3;
use rayon::prelude::*;

use crate::report::hausdorff::{Sample, samples};
use crate::surface::remesh::Reference;
use crate::surface::triangles::TriangleMesh;

/// Most points of the target that are measured in each round, and for the final check.
const MOST_COARSE: usize = 20_000;
const MOST_FINE: usize = 80_000;

/// Cosine between two normals below which a surface looks the other way from a shell.
pub(super) const FACING: f64 = -0.3;

/// The surface to be fitted.
pub(super) struct Target {
    pub(super) reference: Reference,
    /// Measured in each round.
    pub(super) coarse: Detail,
    /// Measured for the final check.
    pub(super) fine: Detail,
    pub(super) diagonal: f64,
}

/// Resolution at which distances are measured.
pub(super) struct Detail {
    /// Points of the target.
    pub(super) samples: Vec<Sample>,
    /// The normals there.
    pub(super) normals: Vec<Vector3>,
    /// Parts of an edge between places of the shells.
    pub(super) parts: usize,
}

impl Target {
    pub(super) fn new(mesh: &TriangleMesh) -> Self {
        let diagonal = mesh.diagonal();
        let reference = Reference::new(mesh);
        let area: f64 = mesh.alive().map(|t| mesh.area(t)).sum();
        let detail = |part: f64, most: usize, parts: usize| {
            // Spacing at which the whole area takes the most points.
            let spacing = (diagonal * part).max((area / most as f64).sqrt());
            let samples = thinned(distinct(samples(mesh, spacing)), spacing, most);
            let normals = samples.par_iter().map(|sample| reference.closest(&sample.point).1).collect();
            Detail { samples, normals, parts }
        };
        let coarse = detail(1.0 / 60.0, MOST_COARSE, 8);
        let fine = detail(1.0 / 300.0, MOST_FINE, 16);
        Self { coarse, fine, diagonal, reference }
    }

    /// Returns the nearest point that looks the same way as `facing`, and the normal there. The nearest point
    /// of all counts, even if it looks the other way, unless such a point is within `reach` [m] beyond it.
    pub(super) fn foot(&self, x: &Vector3, facing: &Vector3, reach: f64) -> (Vector3, Vector3) {
        let nearest = self.reference.closest(x);
        if nearest.1.dot(facing) < FACING {
            let within = (nearest.0 - x).norm() + reach;
            return self.reference.closest_facing(x, facing, FACING, within).unwrap_or(nearest);
        }
        nearest
    }
}

/// Merges samples at the same place.
fn distinct(mut samples: Vec<Sample>) -> Vec<Sample> {
    let place = |sample: &Sample| <[f64; 3]>::from(sample.point).map(f64::to_bits);
    samples.sort_by_key(place);
    samples.dedup_by(|next, kept| {
        let same = place(next) == place(kept);
        kept.area += if same { next.area } else { 0.0 };
        same
    });
    samples
}

/// Thins samples so that no cube of a grid holds two. The cubes grow until there are no more than `most`. One
/// sample stands for the area of all in its cube.
fn thinned(mut samples: Vec<Sample>, spacing: f64, most: usize) -> Vec<Sample> {
    let mut size = 0.5 * spacing;
    while samples.len() > most {
        let mut taken: BTreeMap<[i64; 3], usize> = BTreeMap::new();
        let mut kept: Vec<Sample> = Vec::new();
        for sample in samples {
            let cube = <[f64; 3]>::from(sample.point).map(|x| (x / size).floor() as i64);
            match taken.get(&cube) {
                Some(&at) => kept[at].area += sample.area,
                None => {
                    taken.insert(cube, kept.len());
                    kept.push(sample);
                }
            }
        }
        samples = kept;
        size *= 1.3;
    }
    samples
}
