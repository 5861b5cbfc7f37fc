//! Boxes by their places, for surfaces that change. Each box is in the cubes of a grid as coarse as the box
//! is large. So a search looks at few cubes whatever the sizes are. Changed boxes are inserted anew; their
//! old entries stay until all are inserted again.

use std::collections::{BTreeMap, HashMap};

use pliant_geometry::Vector3;

type Cubes = HashMap<[i64; 3], Vec<u32>>;

/// Numbered boxes.
pub(crate) struct Boxes {
    /// Grids by the power of two that is the edge of their cubes [m]. A box is in the cube of its centre.
    grids: BTreeMap<i32, Cubes>,
    finest: i32,
    len: usize,
}

impl Boxes {
    /// Makes an empty set. Boxes much smaller than `finest` [m] would share cubes.
    pub(crate) fn new(finest: f64) -> Self {
        Self { grids: BTreeMap::new(), finest: power(finest), len: 0 }
    }

    /// Makes an empty set with the same finest cubes.
    pub(crate) fn emptied(&self) -> Self {
        Self { grids: BTreeMap::new(), finest: self.finest, len: 0 }
    }

    /// Number of insertions.
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    pub(crate) fn insert(&mut self, number: u32, [low, high]: [Vector3; 2]) {
        let power = power((high - low).amax()).max(self.finest);
        let size = 2_f64.powi(power);
        let cube = <[f64; 3]>::from(low + (high - low) / 2.0).map(|x| (x / size).floor() as i64);
        self.grids.entry(power).or_default().entry(cube).or_default().push(number);
        self.len += 1;
    }

    /// Returns all boxes that may meet a box, and some that do not, in no order. A box that was inserted
    /// twice may occur twice.
    pub(crate) fn near(&self, [low, high]: [Vector3; 2]) -> Vec<u32> {
        let mut found = Vec::new();
        for (&power, cubes) in &self.grids {
            let size = 2_f64.powi(power);
            // A box reaches half its size out of its cube.
            let first = <[f64; 3]>::from(low).map(|x| (x / size - 0.5).floor() as i64);
            let last = <[f64; 3]>::from(high).map(|x| (x / size + 0.5).floor() as i64);
            let count: f64 = (0..3).map(|axis| (last[axis] - first[axis] + 1) as f64).product();
            if count > cubes.len() as f64 {
                let within = |cube: &[i64; 3]| (0..3).all(|k| (first[k]..=last[k]).contains(&cube[k]));
                found.extend(cubes.iter().filter(|(cube, _)| within(cube)).flat_map(|(_, numbers)| numbers));
                continue;
            }
            for i in first[0]..=last[0] {
                for j in first[1]..=last[1] {
                    let row = (first[2]..=last[2]).filter_map(|k| cubes.get(&[i, j, k]));
                    found.extend(row.flatten());
                }
            }
        }
        found
    }
}

/// The least power of two that is no smaller than a length [m].
fn power(length: f64) -> i32 {
    length.max(f64::MIN_POSITIVE).log2().ceil() as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Boxes of sizes from 1 to 1e-4 at places of a sequence, and one without size.
    #[test]
    fn all_boxes_that_meet_one_are_found() {
        let place = |k: usize| Vector3::from([0.618, 0.414, 0.732].map(|x| (x * k as f64).fract() - 0.5));
        let boxed = |k: usize| {
            let half = Vector3::repeat(0.5 * 10_f64.powi(-((k % 5) as i32))).component_mul(&place(k + 7));
            [place(k) - half.abs(), place(k) + half.abs()]
        };
        let mut extents: Vec<[Vector3; 2]> = (0..500).map(boxed).collect();
        extents.push([place(3); 2]);
        let mut boxes = Boxes::new(1e-3);
        (0..).zip(&extents).for_each(|(number, &extent)| boxes.insert(number, extent));
        assert_eq!(boxes.len(), extents.len());
        let mut met = 0;
        for extent in &extents {
            let near = boxes.near(*extent);
            for (number, other) in (0_u32..).zip(&extents) {
                if (0..3).all(|k| extent[0][k] <= other[1][k] && other[0][k] <= extent[1][k]) {
                    assert!(near.contains(&number));
                    met += 1;
                }
            }
        }
        assert!(met > 2 * extents.len() && met < extents.len() * extents.len() / 2, "{met}");
    }
}
