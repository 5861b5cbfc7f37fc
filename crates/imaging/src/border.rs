//! Voxels of a region at the border of the image, where the body may be cut off.

use std::fmt;

use serde::{Serialize, Serializer};

use pliant_geometry::Grid;

/// Voxels of a region at the six sides of its image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Border {
    /// The side of the patient at the least and the largest i, j and k, and the number of voxels there.
    sides: [[(&'static str, u64); 2]; 3],
}

impl Border {
    /// Makes a border without voxels, for the sides of a grid.
    pub(crate) fn new(grid: &Grid) -> Self {
        const WORDS: [[&str; 2]; 3] = [["left", "right"], ["back", "front"], ["foot", "head"]];
        let along = |world: usize, axis: usize| grid.axes[(world, axis)] / grid.axes.column(axis).norm();
        let orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
        // The world axes nearest to the axes of the image, each once.
        let fit = |order: &[usize; 3]| (0..3).map(|axis| along(order[axis], axis).abs()).sum::<f64>();
        let order = orders.into_iter().max_by(|a, b| fit(a).total_cmp(&fit(b))).unwrap_or([0, 1, 2]);
        let sides = [0, 1, 2].map(|axis| {
            let [low, high] = WORDS[order[axis]];
            let words = if along(order[axis], axis) < 0.0 { [high, low] } else { [low, high] };
            words.map(|word| (word, 0))
        });
        Self { sides }
    }

    pub(crate) fn add(&mut self, voxels: [[u64; 2]; 3]) {
        let sides = self.sides.as_flattened_mut().iter_mut();
        sides.zip(voxels.as_flattened()).for_each(|((_, sum), voxels)| *sum += voxels);
    }

    /// True if the region has voxels at the border of the image.
    pub(crate) fn is_touched(&self) -> bool {
        self.sides.as_flattened().iter().any(|(_, voxels)| *voxels > 0)
    }
}

impl Serialize for Border {
    /// Serializes the numbers of voxels of the sides that have any.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let touched = self.sides.as_flattened().iter().filter(|(_, voxels)| *voxels > 0);
        serializer.collect_map(touched.map(|(side, voxels)| (side, voxels)))
    }
}

impl fmt::Display for Border {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let touched = self.sides.as_flattened().iter().filter(|(_, voxels)| *voxels > 0);
        let words: Vec<String> =
            touched.map(|(side, voxels)| format!("{voxels} voxels on the {side} side")).collect();
        f.write_str(&words.join(", "))
    }
}
