//! Meshes of label images: the meshing specification's T1 to T4, materials, gaps, orientation, errors.

use std::f64::consts::PI;

use pliant_geometry::{Grid, Vector3};
use pliant_imaging::{Cleaning, LabelError, LabelImage, Smoothing};
use pliant_meshing::{Anatomy, Ellipsoid, MeshingError, OrganMesh, OrganTets};
use pliant_testing::Random;

use pliant_testing::mesh_checks::*;
use pliant_testing::organs;

pub fn anatomy(image: &LabelImage, labels: &[i32]) -> Anatomy<'static> {
    let cleaning = Cleaning { keep_largest: true, ..Cleaning::default() };
    Anatomy::from_image(image, labels, &cleaning, &Smoothing::default(), &|_| {})
        .expect("the labels are there")
        .0
}

fn meshed(anatomy: &Anatomy<'_>, edge: f64, origin: Vector3) -> OrganMesh {
    let request = OrganTets { origin: Some(origin), ..OrganTets::new(edge) };
    request.mesh(anatomy, &|_| {}).expect("the organ is meshed")
}

/// T4: every inner face has two cells, volumes are positive, every point is used, no boundary edge has more than two
/// faces, no edge is longer than 1.6 times the local request; the report matches the mesh.
pub fn check_sound(made: &OrganMesh) -> Vec<Vec<u32>> {
    let faces = conforming_boundary(&made.mesh);
    assert!(tet_volumes(&made.mesh).iter().all(|&volume| volume > 0.0));
    assert!(edge_counts(&faces).values().all(|&count| count == 2));
    assert_eq!(made.report.crowded_edges_left, 0);
    assert!(pinched(&faces).is_empty() && made.report.pinched_points.is_empty());
    assert!((made.report.edges.longest / longest_edge(&made.mesh) - 1.0).abs() < 1e-12);
    assert!(made.report.edges.longest_part <= 1.6 + 1e-9, "{}", made.report);
    assert_eq!((made.report.nodes, made.report.tets), (made.mesh.points.len(), made.mesh.blocks[0].len()));
    assert!((made.report.acoustic_length / least_acoustic_length(&made.mesh) - 1.0).abs() < 1e-12);
    faces
}

/// T1: a sphere of 50 mm at 8 to 20 mm, for any offset of the lattice.
#[test]
fn a_sphere_of_voxels_is_round_and_keeps_three_quarters_of_the_ideal_step() {
    sphere_at(2);
}

#[test]
#[ignore = "slow: twenty lattices at each of four sizes"]
fn a_sphere_of_voxels_wherever_the_lattice_lies() {
    sphere_at(20);
}

fn sphere_at(lattices: usize) {
    let ball = anatomy(&organs::ball(0.05), &[1]);
    let exact = 4.0 / 3.0 * PI * 0.05_f64.powi(3);
    let mut random = Random::new(1);
    for edge in [0.008, 0.012, 0.016, 0.020] {
        for _ in 0..lattices {
            let made = meshed(&ball, edge, offset(&mut random, edge));
            let faces = check_sound(&made);
            assert_eq!(euler_characteristic(&faces), 2);
            assert!(made.report.acoustic_part >= 0.75, "{}", made.report);
            assert!((tet_volume(&made.mesh) / exact - 1.0).abs() < 0.02, "{}", made.report);
            let centres = faces
                .iter()
                .map(|face| face.iter().map(|&node| made.mesh.points[node as usize]).sum::<Vector3>() / 3.0);
            let farthest = centres.map(|centre| (centre.norm() - 0.05).abs()).fold(0.0, f64::max);
            assert!(farthest < 0.15 * edge, "{farthest} at {edge}");
        }
    }
}

/// Where labels meet in lines and corners, no flat tets are left between them.
#[test]
fn many_labels_keep_three_quarters_of_the_ideal_step() {
    let ball = anatomy(&organs::parted_ball(0.05), &[1, 2, 3, 4, 5]);
    let made = meshed(&ball, 0.008, Vector3::zeros());
    check_sound(&made);
    assert!(made.report.acoustic_part >= 0.75, "{}", made.report);
}

/// T2 for one lattice; the other seven, and 5 mm, are in the slow test.
#[test]
fn the_liver_keeps_its_shape_its_volume_and_its_step() {
    liver_at(0.010, 1);
}

#[test]
#[ignore = "slow: eight lattices at 10 mm, two at 5 mm"]
fn the_liver_wherever_the_lattice_lies() {
    liver_at(0.010, 8);
    liver_at(0.005, 2);
}

fn liver_at(edge: f64, lattices: usize) {
    let liver = anatomy(&organs::liver(), &[1]);
    let truth = organs::truth("liver");
    let mut random = Random::new(5);
    for _ in 0..lattices {
        let made = meshed(&liver, edge, offset(&mut random, edge));
        let [forth, back, rms] = organs::distances(&made.mesh, &truth);
        println!("{}\nH {:.3} / {:.3} a, RMS {:.3} a", made.report, forth / edge, back / edge, rms / edge);
        check_sound(&made);
        assert!(made.report.acoustic_part >= 0.75);
        assert!(made.report.tets <= if edge < 0.01 { 80_000 } else { 10_000 });
        assert!(rms <= 0.06 * edge);
        // The true volume is 774 ml to the printed digit.
        assert!((tet_volume(&made.mesh) / 774e-6 - 1.0).abs() < 0.005);
    }
}

/// T3, with its ventricles and its tumour.
#[test]
fn the_brain_comes_with_its_materials_and_its_banks_apart() {
    brain_at(1);
}

#[test]
#[ignore = "slow: eight lattices"]
fn the_brain_wherever_the_lattice_lies() {
    brain_at(8);
}

fn brain_at(lattices: usize) {
    let edge = 0.010;
    let image = organs::brain();
    let brain = anatomy(&image, &[1, 2, 3]);
    let truth = organs::truth("brain");
    let mut random = Random::new(5);
    for _ in 0..lattices {
        let made = meshed(&brain, edge, offset(&mut random, edge));
        let [_, _, rms] = organs::distances(&made.mesh, &truth);
        println!("{}\nRMS {:.3} a", made.report, rms / edge);
        check_sound(&made);
        assert!(made.report.acoustic_part >= 0.75);
        assert!(rms <= 0.065 * edge);
        for material in &made.report.materials {
            let voxels = material.voxel_volume.expect("the image knows");
            assert!((material.volume / voxels - 1.0).abs() < 0.05, "{material:?}");
        }
        for (label, organ) in [(2, pliant_meshing::Organ::Ventricles), (3, pliant_meshing::Organ::Tumour)] {
            let interface = organs::interface_rms(&made.mesh, label, organ);
            println!("interface of label {label}: RMS {:.3} a", interface / edge);
            // The prototype of the specification had 0.15; its goal of 0.1 is missed by the ventricles, 12 mm thick, at 10 mm.
            assert!(interface <= 0.15 * edge);
        }
    }
}

/// T4: the whole mesher gives the same bytes for any number of threads: field, lattice, materials, gaps, optimiser.
#[test]
fn the_thread_count_never_changes_a_bit() {
    let image = organs::brain();
    let with = |count| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build().expect("a pool");
        pool.install(|| meshed(&anatomy(&image, &[1, 2, 3]), 0.012, Vector3::new(1e-3, 2e-3, 3e-3)))
    };
    let bits = |made: &OrganMesh| -> Vec<u64> {
        made.mesh.points.iter().flat_map(|point| point.iter().map(|x| x.to_bits())).collect()
    };
    let one = with(1);
    for many in [with(2), with(8)] {
        assert_eq!(one.mesh.blocks, many.mesh.blocks);
        assert_eq!(bits(&one), bits(&many));
    }
}

/// The same body in an image stored mirrored and turned gives the same mesh.
#[test]
fn storage_order_and_handedness_do_not_matter() {
    let image = organs::ball(0.03);
    let [nx, ny, nz] = image.grid.dims;
    // i and k change places, j runs backwards: left-handed to right-handed and back.
    let axes = image.grid.axes;
    let turned_axes = nalgebra::Matrix3::from_columns(&[
        axes.column(2).into_owned(),
        -axes.column(1),
        axes.column(0).into_owned(),
    ]);
    let origin = image.grid.position(&Vector3::new(0.0, (ny - 1) as f64, 0.0));
    let grid = Grid::new([nz, ny, nx], origin, turned_axes).expect("a grid");
    let labels = (0..grid.len()).map(|at| {
        let [k, j, i] = grid.triple(at);
        image.labels[i + nx * (ny - 1 - j + ny * k)]
    });
    let turned = LabelImage { labels: labels.collect(), grid };
    let [one, other] = [&image, &turned].map(|image| meshed(&anatomy(image, &[1]), 0.01, Vector3::zeros()));
    assert_eq!(one.mesh.blocks, other.mesh.blocks);
    let far = one.mesh.points.iter().zip(&other.mesh.points).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    // Single-precision fields: 1e-7 of the distances in them.
    assert!(far < 1e-6, "{far}");
}

/// Two slabs 4 mm apart, joined at one end, with a lattice of 10 mm: its long edges reach over the gap.
#[test]
fn a_gap_thinner_than_the_lattice_stays_open() {
    let h = 1e-3;
    let grid = Grid::along_axes([70, 50, 40], Vector3::zeros(), [h; 3]).expect("a grid");
    let label = |at: usize| {
        let [i, j, k] = grid.triple(at);
        let slab = (5..65).contains(&i) && (5..45).contains(&j) && (5..36).contains(&k);
        i32::from(slab && !((19..23).contains(&k) && i < 50))
    };
    let image = LabelImage { labels: (0..grid.len()).map(label).collect(), grid };
    let made = meshed(&anatomy(&image, &[1]), 0.010, Vector3::new(0.0, 0.0, 0.0205));
    println!("{}", made.report);
    check_sound(&made);
    assert!(made.report.repairs.bridges > 0);
    assert!(made.report.acoustic_part >= 0.75);
    // The middle plane of the gap contains no tet.
    let locator = pliant_geometry::Locator::new(&made.mesh);
    for (x, y) in (10..40).step_by(5).flat_map(|x| (10..40).step_by(5).map(move |y| (x as f64, y as f64))) {
        let place = locator.locate(Vector3::new(x * h, y * h, 0.0205)).expect("the mesh has cells");
        assert!(place.distance > 0.0, "bridged at {x}, {y} mm");
    }
}

#[test]
fn functions_mesh_like_images() {
    let outer = Ellipsoid { centre: Vector3::zeros(), radii: Vector3::new(0.05, 0.04, 0.03) };
    let inner = Ellipsoid::sphere(Vector3::new(0.01, 0.0, 0.0), 0.015);
    let body = Anatomy::new(4, outer).with_inner(9, inner);
    let made = meshed(&body, 0.01, Vector3::zeros());
    check_sound(&made);
    assert!(made.report.acoustic_part >= 0.75, "{}", made.report);
    assert_eq!(body.labels(), [4, 9]);
    let nine = &made.report.materials[1];
    let exact = 4.0 / 3.0 * PI * 0.015_f64.powi(3);
    // Chords of 8.7 mm in a sphere of 15 mm enclose a tenth less; no image provides a volume to correct
    // this.
    assert!(nine.label == 9 && (nine.volume / exact - 1.0).abs() < 0.15, "{nine:?}");
}

#[test]
fn impossible_requests_are_refused() {
    let ball = anatomy(&organs::ball(0.02), &[1]);
    let with = |change: &dyn Fn(&mut OrganTets)| {
        let mut request = OrganTets::new(0.01);
        change(&mut request);
        request.mesh(&ball, &|_| {}).expect_err("the request is impossible")
    };
    assert!(matches!(with(&|r| r.target = 1.0), MeshingError::TargetTooHigh { .. }));
    assert!(matches!(with(&|r| r.target = f64::NAN), MeshingError::NotPositive { .. }));
    assert!(matches!(with(&|r| r.edge = 0.0), MeshingError::NotPositive { .. }));
    assert!(matches!(with(&|r| r.edge = 1e-4), MeshingError::TooManyCells { .. }));
    assert!(matches!(with(&|r| r.edge = 5.0), MeshingError::NoCells { .. }));
    let many: Vec<i32> = (1..=64).collect();
    let error =
        Anatomy::from_image(&organs::ball(0.02), &many, &Cleaning::default(), &Smoothing::default(), &|_| {});
    assert!(matches!(error, Err(LabelError::TooManyLabels { labels: 64, limit: 63 })));
}

/// A real organ from the folder PLIANT_DATA.
#[test]
fn the_liver_of_a_scan_is_meshed_with_the_stomach() {
    let Some(data) = std::env::var_os("PLIANT_DATA") else {
        println!("skipped: set PLIANT_DATA to the folder that holds abdomen-totalseg/example_seg.nii.gz");
        return;
    };
    let path = std::path::Path::new(&data).join("abdomen-totalseg/example_seg.nii.gz");
    let image = pliant_imaging::read(&path, &Default::default()).expect("the image is read");
    let (body, _) = Anatomy::from_image(
        &image.labels().expect("an image of labels"),
        &[5, 6],
        &Cleaning::default(),
        &Smoothing::default(),
        &|_| {},
    )
    .expect("the labels are there");
    let made = meshed(&body, 0.012, Vector3::zeros());
    println!("{}", made.report);
    check_sound(&made);
    assert!(made.report.acoustic_part >= 0.75);
    for material in &made.report.materials {
        assert!((material.volume / material.voxel_volume.expect("the image knows") - 1.0).abs() < 0.05);
    }
}
