//! The region of one label or several, cut out of its image, and its cleaning: keep the largest piece, fill
//! holes, close gaps. Closing is dilation and erosion by a ball in millimetres, through exact distances. So
//! it is the same along every axis of an image with thick slices.

use std::fmt;

use pliant_geometry::Vector3;
use serde::Serialize;

use crate::distance::nearest_sites;
use crate::error::LabelError;
use crate::labels::Components;
use crate::region::{LARGEST, Region};

/// Cleaning of a region before meshing; by default none. The order is: gaps, holes, pieces.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cleaning {
    /// Width of gaps and channels to close [m]; 0 closes none.
    pub close_gaps: f64,
    /// True to fill cavities that are not joined to the outside through faces of voxels.
    pub fill_holes: bool,
    /// True to keep only the largest piece.
    pub keep_largest: bool,
}

/// The changes of a cleaning.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Cleaned {
    /// Voxels added in gaps.
    pub gap_voxels: u64,
    /// Holes filled.
    pub holes: u64,
    /// Voxels added in holes.
    pub hole_voxels: u64,
    /// Smaller pieces removed.
    pub pieces_removed: u64,
    /// Voxels removed with them.
    pub voxels_removed: u64,
}

impl fmt::Display for Cleaned {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { gap_voxels, holes, hole_voxels, pieces_removed, voxels_removed } = self;
        let done = [
            (*gap_voxels, format!("{gap_voxels} voxels added in gaps")),
            (*holes, format!("{hole_voxels} voxels added in {holes} holes")),
            (*pieces_removed, format!("{voxels_removed} voxels removed in {pieces_removed} smaller pieces")),
        ];
        let done: Vec<String> =
            done.into_iter().filter(|(count, _)| *count > 0).map(|(_, words)| words).collect();
        if done.is_empty() { f.write_str("nothing to clean") } else { f.write_str(&done.join(", ")) }
    }
}

impl Region {
    /// Number of voxels inside.
    pub fn voxels(&self) -> u64 {
        self.inside.iter().filter(|&&inside| inside).count() as u64
    }

    /// Volume [m³].
    pub fn volume(&self) -> f64 {
        self.voxels() as f64 * self.grid.voxel_volume()
    }

    /// Pieces joined through faces of voxels.
    pub fn components(&self) -> usize {
        Components::new(self.grid.dims, |at| self.inside[at].into(), 0)
            .largest()
            .map_or(0, |(_, count)| count)
    }

    /// Cleans the region and returns the changes. Closing gaps enlarges the box.
    pub fn clean(mut self, cleaning: &Cleaning) -> Result<(Self, Cleaned), LabelError> {
        let mut done = Cleaned::default();
        let width = cleaning.close_gaps;
        if !(width.is_finite() && width >= 0.0) {
            return Err(LabelError::BadLength { what: "the width of gaps to close", value: width });
        }
        if width > 0.0 {
            let before = self.voxels();
            self = self.closed(width / 2.0)?;
            done.gap_voxels = self.voxels() - before;
        }
        if cleaning.fill_holes {
            (done.holes, done.hole_voxels) = self.fill_holes();
        }
        if cleaning.keep_largest {
            (done.pieces_removed, done.voxels_removed) = self.keep_largest();
        }
        if self.voxels() == 0 {
            return Err(LabelError::Emptied { label: self.label, operation: "cleaning" });
        }
        Ok((self, done))
    }

    /// Closes gaps: adds everything that a ball of `radius` [m] outside the region cannot reach.
    fn closed(self, radius: f64) -> Result<Self, LabelError> {
        let spacing = self.grid.spacing();
        let wide = self.padded(spacing.map(|h| (radius / h).ceil() as usize + 1))?;
        let outside: Vec<bool> =
            distances(&wide, true).into_iter().map(|square| square > radius * radius).collect();
        let eroded = distances(&Self { inside: outside, ..wide.clone() }, true);
        let inside =
            wide.inside.iter().zip(eroded).map(|(&inside, square)| inside || square > radius * radius);
        Ok(Self { inside: inside.collect(), ..wide })
    }

    /// The region in a box larger by some voxels on every side.
    fn padded(&self, by: [usize; 3]) -> Result<Self, LabelError> {
        let dims = [0, 1, 2].map(|axis| self.grid.dims[axis].saturating_add(by[axis].saturating_mul(2)));
        let voxels = dims.iter().fold(1_u64, |product, &n| product.saturating_mul(n as u64));
        if voxels > LARGEST {
            return Err(LabelError::TooManyVoxels { voxels, limit: LARGEST });
        }
        let mut inside = vec![false; voxels as usize];
        for (row, voxels) in self.inside.chunks_exact(self.grid.dims[0]).enumerate() {
            let [j, k] = [row % self.grid.dims[1] + by[1], row / self.grid.dims[1] + by[2]];
            inside[by[0] + dims[0] * (j + dims[1] * k)..][..voxels.len()].copy_from_slice(voxels);
        }
        Ok(Self { grid: self.grid.part(by.map(|n| -(n as i64)), dims), inside, ..*self })
    }

    /// Fills every piece of the outside that does not touch the rim of the box.
    fn fill_holes(&mut self) -> (u64, u64) {
        let [nx, ny, nz] = self.grid.dims;
        let outside = Components::new(self.grid.dims, |at| self.inside[at].into(), 1);
        let mut open = vec![false; outside.sizes().len()];
        for (voxels, root) in outside.voxels(nx) {
            let [j, k] = [voxels.start / nx % ny, voxels.start / nx / ny];
            let rim = voxels.start % nx == 0
                || voxels.end % nx == 0
                || j == 0
                || j == ny - 1
                || k == 0
                || k == nz - 1;
            open[root as usize] |= rim;
        }
        let mut filled = 0;
        for (voxels, root) in outside.voxels(nx) {
            if !open[root as usize] {
                filled += voxels.len() as u64;
                self.inside[voxels].fill(true);
            }
        }
        let holes = outside.sizes().iter().zip(&open).filter(|(size, open)| **size > 0 && !**open).count();
        (holes as u64, filled)
    }

    fn keep_largest(&mut self) -> (u64, u64) {
        let pieces = Components::new(self.grid.dims, |at| self.inside[at].into(), 0);
        let Some((largest, count)) = pieces.largest() else { return (0, 0) };
        let mut removed = 0;
        for (voxels, root) in pieces.voxels(self.grid.dims[0]) {
            if root != largest {
                removed += voxels.len() as u64;
                self.inside[voxels].fill(false);
            }
        }
        (count as u64 - 1, removed)
    }
}

/// Squared distance [m²] of each voxel to the nearest one that is (not) inside; infinite if none exists.
fn distances(region: &Region, inside: bool) -> Vec<f64> {
    let spacing = Vector3::from(region.grid.spacing());
    let sites = nearest_sites(&region.grid, |at| region.inside[at] == inside);
    let square = |(at, &site): (usize, &u32)| match site {
        u32::MAX => f64::INFINITY,
        site => {
            let [here, there] =
                [at, site as usize].map(|at| Vector3::from(region.grid.triple(at).map(|i| i as f64)));
            (here - there).component_mul(&spacing).norm_squared()
        }
    };
    sites.iter().enumerate().map(square).collect()
}
