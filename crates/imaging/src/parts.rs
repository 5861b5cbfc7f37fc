//! The parts of a region that have different labels, each with its distances in its own box. The number of
//! parts does not matter: all together take about as much memory as the region.

use std::collections::BTreeMap;

use pliant_geometry::{DistanceField, Grid};

use crate::distance::Smoothing;
use crate::error::LabelError;
use crate::image::LabelImage;
use crate::region::Region;

/// Number of the voxels of a region that have none of the labels, as those that cleaning added.
const ADDED: u8 = u8::MAX;

/// A region divided by labels.
#[derive(Clone, Debug, PartialEq)]
pub struct Parts {
    grid: Grid,
    /// The part of each voxel of the box, numbered from 1; 0 outside the region.
    numbers: Vec<u8>,
    parts: Vec<Part>,
}

/// A part in the box of the region.
#[derive(Clone, Debug, PartialEq)]
struct Part {
    label: i32,
    voxels: u64,
    /// Its first and its last voxel along each axis.
    first: [usize; 3],
    last: [usize; 3],
}

impl Region {
    /// The parts of the region with these labels in its source image, at most 254.
    ///
    /// # Errors
    /// If a label has no voxel in the region, or there are too many labels.
    pub fn parts(&self, image: &LabelImage, labels: &[i32]) -> Result<Parts, LabelError> {
        let limit = usize::from(ADDED) - 1;
        if labels.len() > limit {
            return Err(LabelError::TooManyLabels { labels: labels.len(), limit });
        }
        let number_of: BTreeMap<i32, u8> = labels.iter().copied().zip(1..).collect();
        let from = image.grid.index(&self.grid.origin).map(|at| at.round() as i64);
        let [nx, ny, nz] = self.grid.dims;
        let mut numbers = vec![0; self.inside.len()];
        let none = |&label: &i32| Part { label, voxels: 0, first: [usize::MAX; 3], last: [0; 3] };
        let mut parts: Vec<Part> = labels.iter().map(none).collect();
        for (row, (numbers, inside)) in
            numbers.chunks_exact_mut(nx).zip(self.inside.chunks_exact(nx)).enumerate()
        {
            let [j, k] = [row % ny, row / ny];
            debug_assert!(k < nz);
            // Neighbours mostly have the same label.
            let mut last = (0, ADDED);
            for (i, number) in numbers.iter_mut().enumerate().filter(|(i, _)| inside[*i]) {
                let label = image.label_at([from[0] + i as i64, from[1] + j as i64, from[2] + k as i64]);
                if label != last.0 {
                    last = (label, number_of.get(&label).copied().unwrap_or(ADDED));
                }
                *number = last.1;
                if let Some(part) = parts.get_mut(usize::from(*number) - 1) {
                    part.voxels += 1;
                    for (axis, at) in [i, j, k].into_iter().enumerate() {
                        part.first[axis] = part.first[axis].min(at);
                        part.last[axis] = part.last[axis].max(at);
                    }
                }
            }
        }
        match parts.iter().find(|part| part.voxels == 0) {
            Some(&Part { label, .. }) if image.labels.contains(&label) => {
                Err(LabelError::Emptied { label, operation: "cleaning" })
            }
            Some(&Part { label, .. }) => Err(LabelError::Absent { label, present: image.present() }),
            None => Ok(Parts { grid: self.grid, numbers, parts }),
        }
    }
}

impl Parts {
    /// Volume of a part, numbered from 1 [m³].
    pub fn volume(&self, part: usize) -> f64 {
        self.parts[part - 1].voxels as f64 * self.grid.voxel_volume()
    }

    /// The smooth signed distance of a part, numbered from 1: positive where the part is nearer than the rest
    /// of the region, also outside both. Its zero surface continues beyond the surface of the region.
    /// `progress` hears fractions from 0 to 1.
    ///
    /// # Errors
    /// If smoothing leaves nothing of the part.
    pub fn distance_field(
        &self,
        part: usize,
        smoothing: &Smoothing,
        progress: &dyn Fn(f64),
    ) -> Result<DistanceField, LabelError> {
        let Part { label, first, last, .. } = self.parts[part - 1];
        let (margin, dims) = (smoothing.margin(), self.grid.dims);
        // The region has this margin on all sides, so the box of a part with its margin lies in its own.
        let first = first.map(|at| at.saturating_sub(margin));
        let last = [0, 1, 2].map(|axis| (last[axis] + margin).min(dims[axis] - 1));
        let size = [0, 1, 2].map(|axis| last[axis] - first[axis] + 1);
        let (mut inside, mut rest) = (Vec::new(), Vec::new());
        for k in first[2]..=last[2] {
            for j in first[1]..=last[1] {
                let row = dims[0] * (j + dims[1] * k);
                let numbers = &self.numbers[row + first[0]..=row + last[0]];
                inside.extend(numbers.iter().map(|&number| usize::from(number) == part));
                rest.extend(numbers.iter().map(|&number| number != 0 && usize::from(number) != part));
            }
        }
        let grid = self.grid.part(first.map(|at| at as i64), size);
        Region { label, grid, inside }.distance_field_beside(&rest, smoothing, progress)
    }

    /// The part of each voxel of the box of the region, numbered from 1, 0 outside. Voxels without any of the
    /// labels belong to the first.
    pub fn into_numbers(mut self) -> Vec<u8> {
        for number in self.numbers.iter_mut().filter(|number| **number == ADDED) {
            *number = 1;
        }
        self.numbers
    }
}
