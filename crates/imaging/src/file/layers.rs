//! Segmentations of 3D Slicer in layers (`.seg.nrrd` with a first axis of layers). The layers are label
//! images of the same voxels, in which segments may overlap and use a value again. They become one label
//! image.

use std::collections::{BTreeMap, BTreeSet};

use crate::image::{Numbers, Order, Scalar};
use crate::names::LabelNames;

/// A segment: its layer and value in the file, and its name.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Segment {
    layer: usize,
    value: i32,
    name: String,
}

/// The segments of a header in the order of their numbers: `Segment0_LabelValue:=5` with `Segment0_Layer:=1`
/// and `Segment0_Name:=liver`. Segments without a value are left out.
pub(super) fn segments(pairs: &[(String, String)]) -> Vec<Segment> {
    let mut found: BTreeMap<u32, (Segment, bool)> = BTreeMap::new();
    for (key, value) in pairs {
        let Some((number, field)) = key.strip_prefix("Segment").and_then(|key| key.split_once('_')) else {
            continue;
        };
        let Ok(number) = number.parse() else { continue };
        let (segment, has_value) = found.entry(number).or_default();
        match (field, value.trim().parse()) {
            ("LabelValue", Ok(value)) => (segment.value, *has_value) = (value, true),
            ("Layer", Ok(layer)) => segment.layer = usize::try_from(layer).unwrap_or(usize::MAX),
            ("Name", _) => segment.name.clone_from(value),
            _ => {}
        }
    }
    found.into_values().filter(|(_, has_value)| *has_value).map(|(segment, _)| segment).collect()
}

/// The layers, with the values of each voxel side by side, as one image of labels with their names. Labels
/// are the values of the segments, or the segment numbers from 1 if a value repeats. Where segments overlap,
/// the later one wins.
pub(super) fn joined(
    layers: usize,
    numbers: &Numbers,
    segments: &[Segment],
    notes: &mut Vec<String>,
) -> (Numbers, LabelNames) {
    let values: BTreeSet<i32> = segments.iter().map(|segment| segment.value).collect();
    let distinct = values.len() == segments.len() && !values.contains(&0);
    let label = |number: usize| if distinct { segments[number].value } else { number as i32 + 1 };
    let place: BTreeMap<(usize, i32), usize> = segments
        .iter()
        .enumerate()
        .map(|(number, segment)| ((segment.layer, segment.value), number))
        .collect();
    let voxels = numbers.bytes.len() / (numbers.scalar.size() * layers);
    let (mut bytes, mut shared, mut lost) = (Vec::with_capacity(4 * voxels), 0_u64, 0_u64);
    for voxel in 0..voxels {
        let (mut last, mut count) = (None, 0);
        for layer in 0..layers {
            let value = numbers.value(voxel * layers + layer);
            if value != 0.0 {
                let number =
                    (f64::from(value as i32) == value).then(|| place.get(&(layer, value as i32))).flatten();
                count += u64::from(number.is_some());
                lost += u64::from(number.is_none());
                last = last.max(number.copied());
            }
        }
        shared += u64::from(count > 1);
        bytes.extend(last.map_or(0, label).to_le_bytes());
    }
    if !distinct {
        notes.push("several segments share a value: the labels are the segment numbers from 1".into());
    }
    if shared > 0 {
        notes.push(format!("segments overlap in {shared} voxels, which belong to the later one"));
    }
    if lost > 0 {
        notes.push(format!("{lost} values belong to no segment and were ignored"));
    }
    let mut names = LabelNames::default();
    segments.iter().enumerate().for_each(|(number, segment)| names.insert(label(number), &segment.name));
    (Numbers { scalar: Scalar::I32, order: Order::Little, bytes }, names)
}
