//! A smooth field of a region: the signed distance to its surface, clipped and smoothed by a Gaussian. It is
//! shifted so that its zero surface encloses the volume of the voxels. It is linear in each cell of eight
//! voxel centres. Nearest voxels are exact (Felzenszwalb, Huttenlocher 2012, row by row along each axis). The
//! surface is half a voxel before the nearest voxel of the other side, measured along the way to that voxel.
//! Distances use only the step lengths: in a sheared grid they are distances before shearing.

use pliant_geometry::{DistanceField, Grid, Vector3};
use rayon::prelude::*;

use crate::error::LabelError;
use crate::region::Region;

/// No voxel.
const NONE: u32 = u32::MAX;

/// Smoothing of a field, in voxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smoothing {
    /// Standard deviation of the Gaussian along each axis [voxels]; 0 does not smooth.
    pub sigma: f64,
    /// Distances beyond this are cut [voxels].
    pub clip: f64,
}

impl Default for Smoothing {
    /// The setting measured in the project's meshing specification: sigma 1, clipped at 6.
    fn default() -> Self {
        Self { sigma: 1.0, clip: 6.0 }
    }
}

impl Smoothing {
    /// Voxels that the box of a region must reach beyond it.
    pub fn margin(&self) -> usize {
        4 + (3.0 * self.sigma.clamp(0.0, 100.0)).ceil() as usize
    }
}

impl Region {
    /// The smooth signed distance to the surface of the region, whose box has the margin of the smoothing.
    /// `progress` hears fractions from 0 to 1.
    pub fn distance_field(
        &self,
        smoothing: &Smoothing,
        progress: &dyn Fn(f64),
    ) -> Result<DistanceField, LabelError> {
        let outside: Vec<bool> = self.inside.iter().map(|inside| !inside).collect();
        self.distance_field_beside(&outside, smoothing, progress)
    }

    /// The smooth signed distance to the surface between the region and another one in the same box. In
    /// voxels of neither, the nearer region decides.
    pub(crate) fn distance_field_beside(
        &self,
        other: &[bool],
        smoothing: &Smoothing,
        progress: &dyn Fn(f64),
    ) -> Result<DistanceField, LabelError> {
        for (what, value) in [("sigma", smoothing.sigma), ("clip", smoothing.clip)] {
            if !(0.0..=100.0).contains(&value) {
                return Err(LabelError::BadLength { what, value });
            }
        }
        let grid = self.grid;
        let mut values = signed_distances(self, other, smoothing.clip * largest(grid.spacing()), progress);
        progress(0.7);
        for axis in 0..3 {
            values = smoothed(&grid, values, axis, smoothing.sigma);
        }
        progress(0.9);
        let counted =
            values.iter().enumerate().filter(|&(at, _)| self.inside[at] || other[at]).map(|(_, f)| *f);
        let shift = matching_shift(counted, self.volume(), &grid);
        values.par_iter_mut().for_each(|value| *value -= shift as f32);
        let field = DistanceField::of_values(grid, values)
            .ok_or(LabelError::Emptied { label: self.label, operation: "smoothing" })?;
        progress(1.0);
        Ok(field)
    }
}

fn largest(spacing: [f64; 3]) -> f64 {
    spacing.into_iter().fold(0.0, f64::max)
}

/// The distance to the surface between a region and another one [m], positive inside, cut at ± `clip`. In
/// voxels of neither, it is half of the difference between the two distances, positive where the region is
/// nearer.
fn signed_distances(region: &Region, other: &[bool], clip: f64, progress: &dyn Fn(f64)) -> Vec<f32> {
    let grid = region.grid;
    let spacing = Vector3::from(grid.spacing());
    let to_inside = nearest_sites(&grid, |at| region.inside[at]);
    progress(0.35);
    let to_other = nearest_sites(&grid, |at| other[at]);
    let way = |at: usize, site: u32| {
        let [here, there] = [at, site as usize].map(|at| Vector3::from(grid.triple(at).map(|i| i as f64)));
        (here - there).component_mul(&spacing)
    };
    let length = |at: usize, site: u32| if site == NONE { 2.0 * clip } else { way(at, site).norm() };
    let to_face = |at: usize, site: u32| {
        if site == NONE {
            return clip;
        }
        // Half a voxel along the way: h/2 in a cubic grid, h_a/2 along axis a.
        let way = way(at, site);
        way.norm() - way.normalize().component_mul(&spacing).norm() / 2.0
    };
    let distance = |at: usize| {
        let distance = match (region.inside[at], other[at]) {
            (true, _) => to_face(at, to_other[at]),
            (false, true) => -to_face(at, to_inside[at]),
            _ => 0.5 * (length(at, to_other[at]) - length(at, to_inside[at])),
        };
        distance.clamp(-clip, clip) as f32
    };
    (0..grid.len()).into_par_iter().map(distance).collect()
}

/// For each voxel the nearest one (by step lengths) with `is_site` true, or `u32::MAX`.
pub(crate) fn nearest_sites(grid: &Grid, is_site: impl Fn(usize) -> bool + Sync) -> Vec<u32> {
    let spacing = grid.spacing();
    let mut sites: Vec<u32> = (0..grid.len() as u32)
        .into_par_iter()
        .map(|at| if is_site(at as usize) { at } else { NONE })
        .collect();
    let mut dims = grid.dims;
    for axis in 0..3 {
        // Along the axis that runs fastest; then that axis becomes the slowest.
        let before = |site: u32| {
            let triple = grid.triple(site as usize).map(|i| i as f64);
            move |here: [f64; 3]| -> f64 {
                (0..axis).map(|done| ((here[done] - triple[done]) * spacing[done]).powi(2)).sum()
            }
        };
        let [n, second, _] = dims;
        sites.par_chunks_exact_mut(n).enumerate().for_each_init(
            Envelope::default,
            |envelope, (row, line)| {
                // The coordinates of a line along the axes done so far.
                let [j, k] = [row % second, row / second];
                let mut here = [0.0; 3];
                match axis {
                    1 => here[0] = k as f64,
                    2 => (here[0], here[1]) = (j as f64, k as f64),
                    _ => {}
                }
                envelope.replace(line, spacing[axis], |site| before(site)(here));
            },
        );
        sites = rotated(&sites, dims);
        dims = [dims[1], dims[2], dims[0]];
    }
    sites
}

/// Values in memory order (j, k, i) instead of (i, j, k).
fn rotated(values: &[u32], [nx, ny, nz]: [usize; 3]) -> Vec<u32> {
    let mut out = vec![0; values.len()];
    out.par_chunks_exact_mut(ny * nz).enumerate().for_each(|(i, plane)| {
        for (at, value) in plane.iter_mut().enumerate() {
            *value = values[at * nx + i];
        }
    });
    out
}

/// The lower envelope of parabolas along a line: the parabolas that are lowest somewhere, and their
/// starts.
#[derive(Default)]
struct Envelope {
    /// Place, height and site.
    parabolas: Vec<(f64, f64, u32)>,
    from: Vec<f64>,
}

impl Envelope {
    /// Replaces each entry of a line by the site that is nearest to it; `height` is the squared distance of a
    /// site from the line.
    fn replace(&mut self, line: &mut [u32], step: f64, height: impl Fn(u32) -> f64) {
        self.parabolas.clear();
        self.from.clear();
        for (at, &site) in line.iter().enumerate().filter(|(_, site)| **site != NONE) {
            let (place, vertex) = (at as f64 * step, height(site));
            let mut start = f64::NEG_INFINITY;
            while let Some(&(other, lower, _)) = self.parabolas.last() {
                start = ((vertex + place * place) - (lower + other * other)) / (2.0 * (place - other));
                if self.from.last().is_some_and(|&from| start <= from) {
                    self.parabolas.pop();
                    self.from.pop();
                    start = f64::NEG_INFINITY;
                } else {
                    break;
                }
            }
            self.parabolas.push((place, vertex, site));
            self.from.push(start);
        }
        if self.parabolas.is_empty() {
            return;
        }
        let mut current = 0;
        for (at, entry) in line.iter_mut().enumerate() {
            while self.from.get(current + 1).is_some_and(|&from| from < at as f64 * step) {
                current += 1;
            }
            *entry = self.parabolas[current].2;
        }
    }
}

/// Convolution with a Gaussian along an axis; beyond the box the outermost values continue.
fn smoothed(grid: &Grid, values: Vec<f32>, axis: usize, sigma: f64) -> Vec<f32> {
    if sigma == 0.0 {
        return values;
    }
    let reach = (4.0 * sigma).ceil() as usize;
    let mut weights: Vec<f64> = (0..=reach).map(|i| (-0.5 * (i as f64 / sigma).powi(2)).exp()).collect();
    let sum = weights[0] + 2.0 * weights[1..].iter().sum::<f64>();
    weights.iter_mut().for_each(|weight| *weight /= sum);
    let (n, stride) = (grid.dims[axis], grid.dims[..axis].iter().product::<usize>());
    let row = grid.dims[0];
    let mut out = vec![0.0; values.len()];
    out.par_chunks_exact_mut(row).enumerate().for_each(|(number, line)| {
        for (i, out) in line.iter_mut().enumerate() {
            let at = number * row + i;
            let place = at / stride % n;
            let value = |to: usize| f64::from(values[at + to * stride - place * stride]);
            let mut sum = weights[0] * value(place);
            for (step, weight) in weights.iter().enumerate().skip(1) {
                sum += weight * (value(place.saturating_sub(step)) + value((place + step).min(n - 1)));
            }
            *out = sum as f32;
        }
    });
    out
}

/// The constant c for which f − c encloses `volume` [m³]. A voxel counts by its part on the inner side of a
/// plane at the distance f − c. The voxel is taken as one mean step thick.
fn matching_shift(values: impl Iterator<Item = f32> + Clone, volume: f64, grid: &Grid) -> f64 {
    let step = grid.voxel_volume().cbrt();
    let near: Vec<f64> = values.clone().map(f64::from).filter(|f| f.abs() < 2.0 * step).collect();
    let deep = values.filter(|&f| f64::from(f) >= 2.0 * step).count() as f64;
    let enclosed = |shift: f64| {
        let parts = near.iter().map(|f| (0.5 + (f - shift) / step).clamp(0.0, 1.0));
        (deep + parts.sum::<f64>()) * grid.voxel_volume()
    };
    // The shift is within a voxel either way. Only a region that smoothing tore apart needs more.
    let (mut low, mut high) = (-step, step);
    for _ in 0..50 {
        let middle = (low + high) / 2.0;
        if enclosed(middle) > volume { low = middle } else { high = middle }
    }
    (low + high) / 2.0
}
