//! Crops an image to the box of a body, and resamples it by majority if the box has too many voxels. Voxels
//! at the border of the image are reported, because the body may be cut off there.

use std::collections::{BTreeMap, BTreeSet};

use pliant_geometry::Vector3;
use rayon::prelude::*;

use crate::border::Border;
use crate::error::LabelError;
use crate::image::{Image, LabelImage};
use crate::names::LabelChoice;

/// Most voxels of a box without resampling, 322³. Its fields take some 20 bytes a voxel.
const MOST_VOXELS: usize = 1 << 25;

/// The part of an image that is the body.
#[derive(Clone, Debug, PartialEq)]
pub enum Choice {
    /// These labels.
    Labels(Vec<i32>),
    /// Voxels of at least this value, with label 1.
    From(f64),
}

/// A body cut out of an image.
#[derive(Clone, Debug, PartialEq)]
pub struct Cut {
    /// The box round it; all other labels are 0.
    pub labels: LabelImage,
    /// Its labels.
    pub chosen: Vec<i32>,
    /// Voxels of the image in one of the box along i, j and k.
    pub factors: [usize; 3],
}

impl Cut {
    /// The resampling, if any.
    pub fn note(&self) -> Option<String> {
        let [x, y, z] = self.labels.grid.spacing().map(|h| h * 1e3);
        (self.factors != [1; 3]).then(|| {
            format!("resampled to voxels of {x:.3} × {y:.3} × {z:.3} mm: the box of the body is limited to 322³ voxels")
        })
    }
}

impl Image {
    /// Returns the labels selected by words. It is an error if the image has no labels, lacks a selected one,
    /// or has one in a group and elsewhere. The labels of a group become one in the image. Rounded labels are
    /// noted.
    pub fn choose(&mut self, choices: &[LabelChoice]) -> Result<Choice, LabelError> {
        let present = self.survey()?;
        let (mut chosen, mut groups) = (Vec::new(), Vec::new());
        let mut taken = BTreeSet::new();
        for choice in choices {
            let labels = LabelChoice::resolve(std::slice::from_ref(choice), &self.names, &present)?;
            if labels.contains(&0) {
                return Err(LabelError::Background { present });
            }
            if let Some(&label) = labels.iter().find(|label| !present.contains(label)) {
                return Err(LabelError::Absent { label, present });
            }
            if let Some(&label) = labels.iter().find(|&&label| !taken.insert(label)) {
                return Err(LabelError::Repeated { label });
            }
            match (choice, labels.first()) {
                (LabelChoice::Group(name, _), Some(&first)) => {
                    chosen.push(first);
                    groups.push((name, labels));
                }
                _ => chosen.extend(labels),
            }
        }
        if chosen.is_empty() {
            return Err(LabelError::NoneChosen { present });
        }
        let note = self.rounding().filter(|note| !self.notes.contains(note));
        self.notes.extend(note);
        self.merge(groups);
        Ok(Choice::Labels(chosen))
    }

    /// Gives the voxels of each group of labels the number of its first label, and this label the name of the
    /// group.
    fn merge(&mut self, groups: Vec<(&String, Vec<i32>)>) {
        let mut first_of = BTreeMap::new();
        for (name, labels) in groups {
            first_of.extend(labels.iter().map(|&label| (label, labels[0])));
            self.names.insert(labels[0], name);
        }
        if first_of.is_empty() {
            return;
        }
        let size = self.numbers.scalar.size();
        // The bytes of the first label of each group, as the file has them.
        let mut stored: BTreeMap<i32, Vec<u8>> = BTreeMap::new();
        for at in 0..self.grid.len() {
            let label = self.label(at);
            if first_of.get(&label) == Some(&label) && !stored.contains_key(&label) {
                stored.insert(label, self.numbers.bytes[at * size..(at + 1) * size].to_vec());
            }
        }
        for at in 0..self.grid.len() {
            if let Some(bytes) = first_of.get(&self.label(at)).and_then(|first| stored.get(first)) {
                self.numbers.bytes[at * size..(at + 1) * size].copy_from_slice(bytes);
            }
        }
    }

    /// The labels of a choice that reach the border of the image, each with its voxels there.
    pub fn border(&self, choice: &Choice) -> Vec<(i32, Border)> {
        let labels: &[i32] = match choice {
            Choice::Labels(labels) => labels,
            Choice::From(_) => &[1],
        };
        let mut borders: Vec<(i32, Border)> =
            labels.iter().map(|&label| (label, Border::new(&self.grid))).collect();
        let dims = self.grid.dims;
        for axis in 0..3 {
            let [p, q] = [[1, 2], [0, 2], [0, 1]][axis];
            for side in 0..2 {
                for at in 0..dims[p] * dims[q] {
                    let mut voxel = [0; 3];
                    (voxel[p], voxel[q], voxel[axis]) = (at % dims[p], at / dims[p], side * (dims[axis] - 1));
                    let label = self.chosen(choice, voxel[0] + dims[0] * (voxel[1] + dims[1] * voxel[2]));
                    if let Some((_, border)) =
                        borders.iter_mut().find(|(known, _)| *known == label && label != 0)
                    {
                        let mut one = [[0; 2]; 3];
                        one[axis][side] = 1;
                        border.add(one);
                    }
                }
            }
        }
        borders.retain(|(_, border)| border.is_touched());
        borders
    }

    /// The label of a voxel if it belongs to a choice, otherwise 0.
    fn chosen(&self, choice: &Choice, at: usize) -> i32 {
        match choice {
            Choice::Labels(labels) => {
                Some(self.label(at)).filter(|label| labels.contains(label)).unwrap_or(0)
            }
            Choice::From(least) => i32::from(self.value(at) >= *least),
        }
    }

    /// Cuts a body out. Where its box has more than 322³ voxels, they are resampled to coarser ones of
    /// `coarsest` [m] at most. `progress` hears fractions from 0 to 1.
    pub fn cut(&self, choice: &Choice, coarsest: f64, progress: &dyn Fn(f64)) -> Result<Cut, LabelError> {
        let chosen = match choice {
            Choice::Labels(labels) => labels.clone(),
            Choice::From(_) => vec![1],
        };
        let none = || LabelError::Absent { label: chosen.first().copied().unwrap_or(0), present: Vec::new() };
        let [first, last] = self.box_of(choice).ok_or_else(none)?;
        progress(0.4);
        let dims = [0, 1, 2].map(|axis| last[axis] - first[axis] + 1);
        let factors = factors(dims, self.grid.spacing(), coarsest);
        let labels = self.resampled(choice, first, dims, factors);
        if factors != [1; 3]
            && let Some(&label) = chosen.iter().find(|label| !labels.labels.contains(label))
        {
            return Err(LabelError::Emptied { label, operation: "resampling" });
        }
        progress(1.0);
        Ok(Cut { labels, chosen, factors })
    }

    /// The first and the last voxel of the box round a choice.
    fn box_of(&self, choice: &Choice) -> Option<[[usize; 3]; 2]> {
        let [nx, ny, nz] = self.grid.dims;
        let in_slice = |k: usize| {
            let mut found: Option<[[usize; 3]; 2]> = None;
            for j in 0..ny {
                let row = nx * (j + ny * k);
                let inside = |i: &usize| self.chosen(choice, row + i) != 0;
                let Some(from) = (0..nx).find(inside) else { continue };
                let to = (from..nx).rev().find(inside).unwrap_or(from);
                let [low, high] = found.get_or_insert([[from, j, k], [to, j, k]]);
                (low[0], high[0], high[1]) = (low[0].min(from), high[0].max(to), j);
            }
            found
        };
        let wider = |a: [[usize; 3]; 2], b: [[usize; 3]; 2]| {
            [
                [0, 1, 2].map(|axis| a[0][axis].min(b[0][axis])),
                [0, 1, 2].map(|axis| a[1][axis].max(b[1][axis])),
            ]
        };
        (0..nz).into_par_iter().filter_map(in_slice).reduce_with(wider)
    }

    /// Labels of a choice in a box, in coarser voxels of `factors` voxels of the image along each axis. Each
    /// takes the label that most of its voxels have.
    fn resampled(
        &self,
        choice: &Choice,
        first: [usize; 3],
        dims: [usize; 3],
        factors: [usize; 3],
    ) -> LabelImage {
        let [nx, ny, _] = self.grid.dims;
        let coarse = [0, 1, 2].map(|axis| dims[axis].div_ceil(factors[axis]));
        let middle = Vector3::from_fn(|axis, _| first[axis] as f64 + (factors[axis] as f64 - 1.0) / 2.0);
        let grid = self.grid.coarser(coarse, self.grid.position(&middle), factors);
        let mut labels = vec![0; grid.len()];
        labels.par_chunks_mut(coarse[0]).enumerate().for_each(|(row, line)| {
            let [j, k] = [row % coarse[1], row / coarse[1]];
            let range = |axis: usize, at: usize| {
                let from = at * factors[axis];
                first[axis] + from..first[axis] + (from + factors[axis]).min(dims[axis])
            };
            let mut votes: Vec<(i32, usize)> = Vec::new();
            for (i, label) in line.iter_mut().enumerate() {
                votes.clear();
                for (z, y) in range(2, k).flat_map(|z| range(1, j).map(move |y| (z, y))) {
                    for x in range(0, i) {
                        let vote = self.chosen(choice, x + nx * (y + ny * z));
                        match votes.iter_mut().find(|(label, _)| *label == vote) {
                            Some((_, count)) => *count += 1,
                            None => votes.push((vote, 1)),
                        }
                    }
                }
                // Ties alternate between inner and outer, so the total volume is unbiased.
                let turn = (i + j + k) % 2 == 0;
                let best = votes.iter().max_by_key(|(label, count)| (*count, (*label != 0) == turn, *label));
                *label = best.map_or(0, |(label, _)| *label);
            }
        });
        LabelImage { grid, labels }
    }
}

/// Voxels along each axis that become one: 1 unless the box is too large, first along the finest axes.
fn factors(dims: [usize; 3], spacing: [f64; 3], coarsest: f64) -> [usize; 3] {
    let mut factors = [1; 3];
    let size = |factors: [usize; 3]| (0..3).map(|axis| dims[axis].div_ceil(factors[axis])).product::<usize>();
    while size(factors) > MOST_VOXELS {
        let after = |axis: usize| spacing[axis] * (factors[axis] + 1) as f64;
        let finest = (0..3).filter(|&axis| dims[axis] > factors[axis] && after(axis) <= coarsest);
        let Some(axis) = finest.min_by(|&a, &b| after(a).total_cmp(&after(b))) else { break };
        factors[axis] += 1;
    }
    factors
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;
    use crate::image::{Numbers, Order, Scalar};
    use crate::names::LabelNames;
    use pliant_geometry::Grid;

    fn image(dims: [usize; 3], label: impl Fn([usize; 3]) -> u8) -> Image {
        let grid = Grid::along_axes(dims, Vector3::new(0.1, 0.2, 0.3), [1e-3, 1e-3, 2e-3]).unwrap();
        let bytes = (0..grid.len()).map(|at| label(grid.triple(at))).collect();
        let numbers = Numbers { scalar: Scalar::U8, order: Order::Little, bytes };
        let (notes, names) = (Vec::new(), LabelNames::default());
        Image { grid, format: "here".into(), notes, names, numbers, scale: [1.0, 0.0] }
    }

    #[test]
    fn a_body_is_cut_out_with_its_box_in_its_place() {
        let image = image([9, 8, 7], |[i, j, k]| match [i, j, k] {
            [2..=4, 3..=5, 1] => 4,
            [6, 5, 3] => 9,
            [0, 0, 0] => 5,
            _ => 0,
        });
        let cut = image.cut(&Choice::Labels(vec![4, 9]), f64::INFINITY, &|_| {}).unwrap();
        assert_eq!((cut.labels.grid.dims, cut.factors, cut.note()), ([5, 3, 3], [1; 3], None));
        let whole = image.labels().unwrap().regions();
        for (region, expected) in cut.labels.regions().iter().zip([&whole[0], &whole[2]]) {
            assert_eq!((region.label, region.voxels), (expected.label, expected.voxels));
            let off = Vector3::from(region.low) - Vector3::from(expected.low);
            assert!(off.norm() < 1e-12, "{region} {expected}");
        }
        assert!(matches!(image.cut(&Choice::From(10.0), 1.0, &|_| {}), Err(LabelError::Absent { .. })));
    }

    #[test]
    fn sides_of_the_border_are_those_of_the_patient() {
        let mut image = image([4, 4, 4], |[i, _, k]| if i == 0 && k >= 2 { 3 } else { 0 });
        let described = |image: &Image| {
            let borders = image.border(&Choice::Labels(vec![3]));
            borders.iter().map(|(label, border)| format!("{label}: {border}")).collect::<Vec<_>>()
        };
        let expected = "3: 8 voxels on the left side, 2 voxels on the back side, 2 voxels on the front side, 4 voxels on the head side";
        assert_eq!(described(&image), [expected]);
        let axes = image.grid.axes * Matrix3::from_diagonal(&Vector3::new(-1.0, 1.0, 1.0));
        image.grid = Grid::new(image.grid.dims, image.grid.origin, axes).unwrap();
        assert_eq!(described(&image), [expected.replace("left", "right")]);
        assert_eq!(image.border(&Choice::From(4.0)), []);
    }

    #[test]
    fn coarser_voxels_keep_place_and_volume() {
        let centre = Vector3::new(20.3, 19.6, 10.2);
        let ball = image([40, 40, 20], |voxel| {
            let way = Vector3::from(voxel.map(|i| i as f64)) - centre;
            u8::from(way.component_mul(&Vector3::new(1.0, 1.0, 2.0)).norm() < 17.0)
        });
        let choice = Choice::Labels(vec![1]);
        let [first, last] = ball.box_of(&choice).unwrap();
        let dims = [0, 1, 2].map(|axis| last[axis] - first[axis] + 1);
        let coarse = ball.resampled(&choice, first, dims, [2, 2, 1]);
        let [before, after] = [&ball.labels().unwrap(), &coarse].map(|labels| labels.regions()[0].clone());
        assert!((after.volume / before.volume - 1.0).abs() < 0.01, "{before:?} {after:?}");
        for axis in 0..3 {
            let off = [before.low[axis] - after.low[axis], before.high[axis] - after.high[axis]];
            assert!(off.iter().all(|off| off.abs() <= 2.001e-3), "{off:?}");
        }
    }

    #[test]
    fn large_boxes_become_coarser_along_the_finest_axis_first_and_no_coarser_than_asked_for() {
        assert_eq!(factors([300, 300, 300], [1e-3; 3], 1.0), [1; 3]);
        assert_eq!(factors([760, 760, 760], [1e-3; 3], 1.0), [3, 3, 2]);
        assert_eq!(factors([760, 760, 100], [0.5e-3, 0.5e-3, 3e-3], 1.0), [2, 1, 1]);
        assert_eq!(factors([760, 760, 760], [1e-3; 3], 2e-3), [2; 3]);
        assert_eq!(factors([760, 760, 760], [1e-3; 3], 1.5e-3), [1; 3]);
    }
}
