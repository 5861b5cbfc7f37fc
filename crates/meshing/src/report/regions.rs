//! The labels of a mesh: cells, volume and distances of each, and distances of each interface between two
//! labels, against the input.

use std::collections::BTreeMap;

use pliant_geometry::{Mesh, Vector3, volume};
use serde::Serialize;

use crate::input::anatomy::Anatomy;
use crate::input::given::Patches;
use crate::report::deviation::{Deviation, SAMPLES_PER_EDGE};
use crate::tets::missed::Missed;
use crate::tets::topology::faces_between_labels;
use crate::tets::voxels::Voxels;

/// Volumes off by more than this part are reported.
pub(crate) const LARGEST_VOLUME_ERROR: f64 = 0.05;

/// One label of a mesh.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LabelReport {
    /// The label.
    pub label: i32,
    /// Its cells.
    pub cells: usize,
    /// Their volume [m³], of cells that are filled in part that part.
    pub volume: f64,
    /// Volume of its voxels after cleaning, or within the surface [m³], where known.
    pub input_volume: Option<f64>,
    /// Distances between its whole surface in the mesh and in the input, if both have several labels.
    pub distances: Option<Deviation>,
}

impl LabelReport {
    /// Relative error of its volume, if known.
    pub fn volume_error(&self) -> Option<f64> {
        self.input_volume.map(|input| self.volume / input - 1.0)
    }
}

/// The faces between two labels of a mesh.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct InterfaceReport {
    /// The labels, 0 for the outside.
    pub labels: [i32; 2],
    /// Area of the faces in the mesh [m²].
    pub area: f64,
    /// Distances between the faces in the mesh and in the input, where both have some.
    pub distances: Option<Deviation>,
}

/// The labels of a mesh and their interfaces.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Regions {
    /// Its labels.
    pub labels: Vec<LabelReport>,
    /// Its interfaces, if there are several labels with known interfaces in the input.
    pub interfaces: Vec<InterfaceReport>,
}

impl Regions {
    /// Reports the regions of a mesh of an anatomy with cells of `edge` [m].
    pub fn of(mesh: &Mesh, anatomy: &Anatomy<'_>, edge: f64) -> Self {
        let mut found = Self { labels: volumes(mesh, anatomy), interfaces: Vec::new() };
        // Partly filled cubes have no surface of their own.
        let is_filled = mesh.blocks.iter().all(|block| !block.data.contains_key(Voxels::FRACTION));
        if let Some(given) = anatomy.given().filter(|_| found.labels.len() > 1 && is_filled) {
            let (made, given, to) = (faces_between_labels(mesh), anatomy.patches(), given.measured_to());
            let measured = |chosen: &dyn Fn([i32; 2]) -> bool| {
                let distances = Deviation::between(&made, &given, chosen, edge / SAMPLES_PER_EDGE);
                distances.map(|distances| Deviation { to, ..distances })
            };
            for region in &mut found.labels {
                region.distances = measured(&|sides| sides.contains(&region.label));
            }
            let interface = |labels: [i32; 2]| InterfaceReport {
                labels,
                area: made.only(|sides| sides == labels).area(),
                distances: measured(&|sides| sides == labels),
            };
            found.interfaces = pairs(&[&made, &given]).into_iter().map(interface).collect();
        }
        found
    }

    /// Labels that are lost, whose volume is off by more than 5 %, or whose surface is farther off than
    /// `allowed` [m].
    pub fn missed(&self, allowed: f64) -> Vec<Missed> {
        let mut missed = Vec::new();
        for region in &self.labels {
            let label = region.label;
            if region.cells == 0 {
                missed.push(Missed::Label { label });
                continue;
            }
            if let Some(part) = region.volume_error().filter(|part| part.abs() > LARGEST_VOLUME_ERROR) {
                missed.push(Missed::LabelVolume { label, part });
            }
            if let Some((distance, place)) = region.distances.map(|distances| distances.largest())
                && distance > allowed
            {
                missed.push(Missed::LabelAway { label, distance, place });
            }
        }
        missed
    }
}

/// Pairs of labels between which there are faces.
fn pairs(surfaces: &[&Patches]) -> Vec<[i32; 2]> {
    let mut pairs: Vec<[i32; 2]> = surfaces.iter().flat_map(|patches| &patches.sides).copied().collect();
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}

/// Cells and volume of each label of a mesh, filled by the fractions of its cells, beside the volume of the
/// input.
fn volumes(mesh: &Mesh, anatomy: &Anatomy<'_>) -> Vec<LabelReport> {
    let mut found: BTreeMap<i32, (usize, f64)> = BTreeMap::new();
    for block in mesh.volume_blocks() {
        let labels = block.data.get("label").map_or(&[][..], |labels| &labels.values);
        let fractions = block.data.get(Voxels::FRACTION).map_or(&[][..], |fractions| &fractions.values);
        let fractions = fractions.iter().copied().chain(std::iter::repeat(1.0));
        for ((cell, label), fraction) in block.cells().zip(labels).zip(fractions) {
            let corners: Vec<Vector3> = cell.iter().map(|&node| mesh.points[node as usize]).collect();
            let (cells, sum) = found.entry(*label as i32).or_default();
            *cells += 1;
            *sum += fraction * volume(block.kind, &corners);
        }
    }
    let of_label = |(label, &input_volume): (i32, &Option<f64>)| {
        let (cells, volume) = found.get(&label).copied().unwrap_or_default();
        LabelReport { label, cells, volume, input_volume, distances: None }
    };
    anatomy.labels().into_iter().zip(anatomy.volumes()).map(of_label).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Volume and surface of a label are judged each by itself, at 5 % and at the distance allowed, and said
    /// with number and place.
    #[test]
    fn labels_off_by_volume_or_by_place_are_told_apart() {
        let region = |label: i32, part: f64, away: f64| LabelReport {
            label,
            cells: 10,
            volume: 1.0 + part,
            input_volume: Some(1.0),
            distances: Some(Deviation {
                largest_from_body: away,
                farthest: [0.01, 0.02, 0.03],
                ..Deviation::default()
            }),
        };
        let found = Regions {
            labels: vec![
                region(1, 0.049, 0.0039),
                region(2, -0.16, 0.001),
                region(3, 0.1, 0.001),
                region(4, 0.01, 0.006),
                LabelReport { cells: 0, ..region(5, -1.0, 0.02) },
            ],
            ..Regions::default()
        };
        let missed = found.missed(0.004);
        let [
            Missed::LabelVolume { label: 2, part },
            _,
            Missed::LabelAway { label: 4, place, distance },
            Missed::Label { label: 5 },
        ] = missed[..]
        else {
            panic!("{missed:?}")
        };
        assert!((part + 0.16).abs() < 1e-12 && distance == 0.006 && place == [0.01, 0.02, 0.03]);
        let words: Vec<String> = missed.iter().map(ToString::to_string).collect();
        assert_eq!(words[0], "label 2 has 16.0 % less volume than the input");
        assert_eq!(words[1], "label 3 has 10.0 % more volume than the input");
        assert!(words[2].starts_with("the surface of label 4 is 6.0 mm from the input at "), "{}", words[2]);
    }
}
