//! The box of voxels round a region of an image.

use pliant_geometry::Grid;

use crate::error::LabelError;
use crate::image::LabelImage;

/// Most voxels of a region with its margin, so that their numbers fit into 32 bits.
pub(crate) const LARGEST: u64 = 1 << 30;

/// A region of an image: a box of voxels, each inside or not. The box has a margin; it may reach beyond the
/// image.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// The first label of the region, for messages.
    pub label: i32,
    /// Grid of the voxels of the box.
    pub grid: Grid,
    /// True for each voxel inside, i fastest.
    pub inside: Vec<bool>,
}

impl LabelImage {
    /// The region of one label, or of several taken together, in a box with `margin` voxels round it.
    pub fn region(&self, labels: &[i32], margin: usize) -> Result<Region, LabelError> {
        let mut first = [usize::MAX; 3];
        let mut last = [0; 3];
        let mut seen = vec![false; labels.len()];
        let [nx, ny, _] = self.grid.dims;
        for (row, voxels) in self.labels.chunks_exact(nx).enumerate() {
            let mut ends: Option<[usize; 2]> = None;
            for (i, label) in voxels.iter().enumerate() {
                if let Some(which) = labels.iter().position(|asked| asked == label) {
                    seen[which] = true;
                    ends = Some([ends.map_or(i, |[from, _]| from), i]);
                }
            }
            if let Some([from, to]) = ends {
                for (axis, (low, high)) in
                    [(from, to), (row % ny, row % ny), (row / ny, row / ny)].into_iter().enumerate()
                {
                    first[axis] = first[axis].min(low);
                    last[axis] = last[axis].max(high);
                }
            }
        }
        if let Some(at) = seen.iter().position(|&seen| !seen) {
            return Err(LabelError::Absent { label: labels[at], present: self.present() });
        }
        let label =
            labels.first().copied().ok_or(LabelError::Absent { label: 0, present: self.present() })?;
        let dims = [0, 1, 2].map(|axis| last[axis] - first[axis] + 1 + 2 * margin);
        let voxels = dims.iter().fold(1_u64, |product, &n| product.saturating_mul(n as u64));
        if voxels > LARGEST {
            return Err(LabelError::TooManyVoxels { voxels, limit: LARGEST });
        }
        let mut inside = vec![false; voxels as usize];
        for k in first[2]..=last[2] {
            for j in first[1]..=last[1] {
                let from = nx * (j + ny * k);
                let to = margin + dims[0] * (j - first[1] + margin + dims[1] * (k - first[2] + margin));
                let source = &self.labels[from + first[0]..=from + last[0]];
                for (inside, label) in inside[to..].iter_mut().zip(source) {
                    *inside = labels.contains(label);
                }
            }
        }
        let grid = self.grid.part(first.map(|i| i as i64 - margin as i64), dims);
        Ok(Region { label, grid, inside })
    }
}
