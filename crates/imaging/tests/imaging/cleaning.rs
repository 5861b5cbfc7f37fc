//! Regions of labels, and their cleaning.

use pliant_geometry::Grid;
use pliant_imaging::{Cleaning, LabelError, LabelImage};

fn image(dims: [usize; 3], spacing: [f64; 3], label: impl Fn([usize; 3]) -> i32) -> LabelImage {
    let grid = Grid::along_axes(dims, [0.0; 3].into(), spacing).unwrap();
    LabelImage { labels: (0..grid.len()).map(|at| label(grid.triple(at))).collect(), grid }
}

/// Two cubes of label 7 that meet along an edge only, and a bar of label −2.
fn cubes() -> LabelImage {
    image([12, 10, 8], [1e-3, 2e-3, 4e-3], |[i, j, k]| {
        let within = |from: usize, to: usize, x: usize| (from..to).contains(&x);
        if within(1, 4, i) && within(1, 4, j) && within(1, 4, k)
            || within(4, 6, i) && within(4, 6, j) && within(1, 4, k)
        {
            7
        } else if j == 8 && k == 6 {
            -2
        } else {
            0
        }
    })
}

#[test]
fn regions_have_volume_box_and_pieces() {
    let regions = cubes().regions();
    assert_eq!(regions.iter().map(|region| region.label).collect::<Vec<_>>(), [-2, 7]);
    let seven = &regions[1];
    assert_eq!((seven.voxels, seven.components, seven.largest_component), (39, 2, 27));
    assert!((seven.volume - 39.0 * 8e-9).abs() < 1e-18);
    let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
    assert!(near(seven.low, [0.5e-3, 1e-3, 2e-3]) && near(seven.high, [5.5e-3, 11e-3, 14e-3]), "{seven:?}");
    assert_eq!((regions[0].voxels, regions[0].components), (12, 1));
    let text = seven.to_string();
    assert!(
        text.starts_with("label 7: 39 voxels, 0.31 ml")
            && text.ends_with("in 2 pieces, the largest of 27 voxels")
    );
    let json = serde_json::to_value(seven).unwrap();
    assert_eq!(json["largest_component"], 27);
}

#[test]
fn an_absent_label_lists_those_that_are_there() {
    let error = cubes().region(&[3], 1).unwrap_err();
    assert_eq!(error, LabelError::Absent { label: 3, present: vec![-2, 7] });
    assert!(error.to_string().contains("the image has -2, 7"));
    let empty = image([2; 3], [1e-3; 3], |_| 0).region(&[1], 1).unwrap_err();
    assert!(empty.to_string().contains("only background"), "{empty}");
}

#[test]
fn the_largest_piece_is_kept() {
    let region = cubes().region(&[7], 2).unwrap();
    assert_eq!((region.voxels(), region.components()), (39, 2));
    let (kept, done) = region.clean(&Cleaning { keep_largest: true, ..Cleaning::default() }).unwrap();
    assert_eq!((kept.voxels(), kept.components()), (27, 1));
    assert_eq!((done.pieces_removed, done.voxels_removed), (1, 12));
}

#[test]
fn labels_together_are_one_region_and_its_grid_lies_where_it_was() {
    let image = cubes();
    let region = image.region(&[7, -2], 3).unwrap();
    assert_eq!(region.voxels(), 51);
    let inside = |at: usize| region.inside[at].then(|| region.grid.position(&pos(region.grid.triple(at))));
    let expected = (0..image.labels.len()).filter(|&at| image.labels[at] != 0);
    let mut places: Vec<_> = (0..region.inside.len()).filter_map(inside).collect();
    for at in expected {
        let place = image.grid.position(&pos(image.grid.triple(at)));
        let found =
            places.iter().position(|found| (found - place).norm() < 1e-12).expect("each voxel is there");
        places.swap_remove(found);
    }
    assert!(places.is_empty());
}

fn pos(triple: [usize; 3]) -> nalgebra::Vector3<f64> {
    triple.map(|i| i as f64).into()
}

/// A shell with a cavity, and a bay that is open to the outside.
#[test]
fn holes_are_filled_and_bays_are_not() {
    let shell = image([12, 12, 12], [1e-3; 3], |x| {
        let wall = x.iter().all(|i| (2..10).contains(i));
        let cavity = x.iter().all(|i| (4..6).contains(i));
        let bay = x[0] >= 8 && x[1] == 5 && x[2] == 5;
        i32::from(wall && !cavity && !bay)
    });
    let region = shell.region(&[1], 0).unwrap();
    let before = region.voxels();
    let (filled, done) = region.clean(&Cleaning { fill_holes: true, ..Cleaning::default() }).unwrap();
    assert_eq!((done.holes, done.hole_voxels), (1, 8));
    assert_eq!(filled.voxels(), before + 8);
}

/// Two slabs 3 mm apart, along the axis of thick slices and across it: a gap is closed by its width in
/// millimetres.
#[test]
fn gaps_are_closed_by_their_width_along_every_axis() {
    for axis in 0..3 {
        let mut dims = [14; 3];
        let mut spacing = [1.5e-3; 3];
        // Slices of 3 mm along the axis or voxels of 1.5 mm: the gap is 3 mm either way.
        for thick in [false, true] {
            let gap = if thick { 6..7 } else { 6..8 };
            spacing[axis] = if thick { 3e-3 } else { 1.5e-3 };
            dims[axis] = 14;
            let slabs =
                image(dims, spacing, |x| i32::from((2..12).contains(&x[axis]) && !gap.contains(&x[axis])));
            let closed = |width: f64| {
                let region = slabs.region(&[1], 1).unwrap();
                let cleaning = Cleaning { close_gaps: width, ..Cleaning::default() };
                region.clean(&cleaning).unwrap().0.components()
            };
            assert_eq!(closed(2.9e-3), 2, "axis {axis}, thick {thick}");
            assert_eq!(closed(6.1e-3), 1, "axis {axis}, thick {thick}");
        }
    }
}

#[test]
fn closing_adds_nothing_to_a_box() {
    let region = image([8; 3], [1e-3; 3], |_| 1).region(&[1], 0).unwrap();
    let (closed, done) = region.clean(&Cleaning { close_gaps: 4e-3, ..Cleaning::default() }).unwrap();
    assert_eq!((done.gap_voxels, closed.voxels()), (0, 512));
    let region = image([8; 3], [1e-3; 3], |_| 1).region(&[1], 0).unwrap();
    let error = region.clean(&Cleaning { close_gaps: f64::NAN, ..Cleaning::default() }).unwrap_err();
    assert!(matches!(error, LabelError::BadLength { .. }), "{error}");
}

/// A label only in a removed piece is not reported as absent.
#[test]
fn a_label_that_cleaning_removed_is_told_so() {
    let two = image([8, 1, 1], [1e-3; 3], |[i, ..]| [1, 1, 1, 1, 0, 2, 0, 0][i]);
    let cleaning = Cleaning { keep_largest: true, ..Cleaning::default() };
    let (whole, _) = two.region(&[1, 2], 1).unwrap().clean(&cleaning).unwrap();
    assert!((whole.parts(&two, &[1]).unwrap().volume(1) - 4e-9).abs() < 1e-20);
    let error = whole.parts(&two, &[1, 2]).unwrap_err();
    assert!(matches!(error, LabelError::Emptied { label: 2, .. }), "{error}");
    assert!(matches!(whole.parts(&two, &[3]).unwrap_err(), LabelError::Absent { label: 3, .. }));
}
