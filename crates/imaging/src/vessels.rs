//! The parts of vessels that run inside an organ. A segmentation labels vessels apart from the tissue round
//! them, and labels of large vessels continue far outside. From a voxel of a vessel 26 straight ways lead
//! through its neighbours. The voxel is inside if most of these ways lead through vessels into the organ. In
//! a tube inside the organ all ways do but the ones along the tube. In a tube that lies against the organ
//! less than half do.

use rayon::prelude::*;

use crate::image::{Image, Numbers, Order, Scalar};

/// Least number of ways into the organ, of 26, of a voxel inside.
const INSIDE: usize = 14;

impl Image {
    /// Returns the image of labels with the voxels of vessels inside an organ as voxels of the organ. Each
    /// takes the label that most ways lead to. Also returns the numbers of voxels of the vessels inside and
    /// outside. Labels of the organ are no vessels.
    pub fn with_vessels_inside(&self, organ: &[i32], vessels: &[i32]) -> (Self, [usize; 2]) {
        let vessels: Vec<i32> = vessels.iter().copied().filter(|label| !organ.contains(label)).collect();
        let dims = self.grid.dims;
        // The label behind the vessels on a way from a voxel; 0 beyond the image.
        let behind = |from: [usize; 3], way: usize| {
            let shift = [way % 3, way / 3 % 3, way / 9];
            let mut to = from;
            loop {
                for axis in 0..3 {
                    match (to[axis] + shift[axis]).checked_sub(1).filter(|&i| i < dims[axis]) {
                        Some(i) => to[axis] = i,
                        None => return 0,
                    }
                }
                let label = self.label(to[0] + dims[0] * (to[1] + dims[1] * to[2]));
                if !vessels.contains(&label) {
                    return label;
                }
            }
        };
        let of_voxel = |at: usize| {
            let voxel_label = self.label(at);
            if !vessels.contains(&voxel_label) {
                return (voxel_label, None);
            }
            let from = self.grid.triple(at);
            let mut found: Vec<i32> = (0..27).filter(|&way| way != 13).map(|way| behind(from, way)).collect();
            found.retain(|label| organ.contains(label));
            if found.len() < INSIDE {
                return (voxel_label, Some(false));
            }
            let count = |label: i32| found.iter().filter(|&&neighbour| neighbour == label).count();
            // Among equals, the first label of the organ wins.
            let most = organ.iter().rev().max_by_key(|&&label| count(label));
            (most.copied().unwrap_or(voxel_label), Some(true))
        };
        let voxels: Vec<(i32, Option<bool>)> = (0..self.grid.len()).into_par_iter().map(of_voxel).collect();
        let sides =
            [true, false].map(|side| voxels.iter().filter(|(_, inside)| *inside == Some(side)).count());
        let bytes = voxels.into_iter().flat_map(|(label, _)| label.to_le_bytes()).collect();
        let numbers = Numbers { scalar: Scalar::I32, order: Order::Little, bytes };
        let (format, notes, names) = (self.format.clone(), self.notes.clone(), self.names.clone());
        (Self { grid: self.grid, format, notes, names, numbers, scale: [1.0, 0.0] }, sides)
    }
}

#[cfg(test)]
mod tests {
    use pliant_geometry::{Grid, Vector3};

    use super::*;
    use crate::names::LabelNames;

    /// A ball of label 5 with a tube of label 8 through it that continues outside. Another tube, of label 9,
    /// lies against the ball.
    #[test]
    fn a_tube_is_inside_where_the_ball_is_round_it() {
        let grid = Grid::along_axes([41, 41, 61], Vector3::zeros(), [1e-3, 1e-3, 1e-3]).unwrap();
        let place = |at: usize| {
            let [i, j, k] = grid.triple(at).map(|i| i as f64);
            (i - 20.0, j - 20.0, k - 30.0)
        };
        let label = |at: usize| {
            let (x, y, z) = place(at);
            match () {
                () if x.hypot(y) < 3.5 => 8_u8,
                () if (x - 18.5).hypot(y) < 2.5 => 9,
                () if x.hypot(y).hypot(z) < 16.0 => 5,
                () => 0,
            }
        };
        let bytes = (0..grid.len()).map(label).collect();
        let image = Image::new(grid, Scalar::U8, bytes, LabelNames::default()).unwrap();
        let (filled, [inside, outside]) = image.with_vessels_inside(&[5], &[8, 9]);
        let (mut wrong, mut exact) = (0, 0);
        for at in 0..grid.len() {
            let (x, y, z) = place(at);
            let is_inside = x.hypot(y) < 3.5 && x.hypot(y).hypot(z) < 16.0;
            exact += usize::from(is_inside);
            assert!(label(at) != 9 || filled.label(at) == 9, "the tube that lies against the ball");
            // Near its ends the tube is half in the ball and half out.
            wrong += usize::from(
                label(at) == 8 && (filled.label(at) == 5) != is_inside && (z.abs() - 15.6).abs() > 4.0,
            );
        }
        assert_eq!(wrong, 0);
        assert!((inside as f64 / exact as f64 - 1.0).abs() < 0.1, "{inside} of {exact}");
        assert_eq!(inside + outside, (0..grid.len()).filter(|&at| label(at) >= 8).count());
    }
}
