//! Meshes of label images: the meshing specification's T1 to T4, materials, gaps, orientation, errors.

use std::f64::consts::PI;

use pliant_geometry::{Grid, Vector3};
use pliant_imaging::{Cleaning, LabelError, LabelImage, Smoothing};
use pliant_meshing::{
    Anatomy, Closing, Ellipsoid, Enclosed, ImplicitField, MeshingError, OrganMesh, OrganTets,
    SURFACE_SMOOTHING, SurfaceCheck, TriangleMesh, Voxels,
};
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

/// T4: every inner face has two cells, volumes are positive and every point is used. No boundary edge has
/// more than two faces, and no edge is longer than 1.6 times the local request. The report matches the mesh.
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

/// No flat tets are left at lines and corners where labels meet.
#[test]
fn many_labels_keep_three_quarters_of_the_ideal_step() {
    let ball = anatomy(&organs::parted_ball(0.05), &[1, 2, 3, 4, 5]);
    let made = meshed(&ball, 0.008, Vector3::zeros());
    check_sound(&made);
    assert!(made.report.acoustic_part >= 0.75, "{}", made.report);
}

/// A hundred labels side by side, four cells wide. Each has its cells in its place, with about its volume.
#[test]
#[ignore = "slow: a minute"]
fn a_hundred_labels_are_as_many_materials() {
    let dims = [40, 40, 32];
    let grid = Grid::along_axes(dims, Vector3::zeros(), [1e-3; 3]).unwrap();
    let cube = |at: usize| {
        let [i, j, k] = [at % 40 / 8, at / 40 % 40 / 8, at / 1600 / 8];
        (1 + i + 5 * (j + 5 * k)) as i32
    };
    let labels = (0..grid.len()).map(cube).collect();
    let numbers: Vec<i32> = (1..=100).collect();
    let body = anatomy(&LabelImage { grid, labels }, &numbers);
    let made = meshed(&body, 0.002, Vector3::zeros());
    check_sound(&made);
    for material in &made.report.materials {
        let off = material.volume / 512e-9 - 1.0;
        assert!(material.tets > 20 && off.abs() < 0.15, "label {}: {off}", material.label);
    }
    let block = &made.mesh.blocks[0];
    for (cell, label) in block.cells().zip(&block.data["label"].values) {
        let centre = cell.iter().map(|&node| made.mesh.points[node as usize]).sum::<Vector3>() / 4.0;
        let cube = centre.map(|x| ((x / 1e-3 + 0.5) / 8.0).floor());
        let expected = [(*label as i32 - 1) % 5, (*label as i32 - 1) / 5 % 5, (*label as i32 - 1) / 25];
        let far = (0..3).map(|axis| (cube[axis] - f64::from(expected[axis])).abs()).fold(0.0, f64::max);
        assert!(far <= 1.0, "a cell of label {label} at {centre}");
    }
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
            // The prototype of the specification had 0.15; its goal of 0.1 is missed by the ventricles, 12 mm
            // thick, at 10 mm.
            assert!(interface <= 0.15 * edge);
        }
    }
}

/// T4: the whole mesher gives the same bytes for any number of threads: field, lattice, materials, gaps,
/// optimiser.
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

/// A body in an image stored mirrored and turned gives the same mesh.
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
    let many: Vec<i32> = (1..=128).collect();
    let error =
        Anatomy::from_image(&organs::ball(0.02), &many, &Cleaning::default(), &Smoothing::default(), &|_| {});
    assert!(matches!(error, Err(LabelError::TooManyLabels { labels: 128, limit: 127 })));
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

/// The space between two spheres about the origin.
struct Hollow {
    outer: f64,
    wall: f64,
}

impl ImplicitField for Hollow {
    fn value(&self, point: &Vector3) -> f64 {
        let half = self.wall / 2.0;
        half - (point.norm() - self.outer + half).abs()
    }

    fn bounds(&self) -> (Vector3, Vector3) {
        (Vector3::repeat(-self.outer), Vector3::repeat(self.outer))
    }
}

/// A wall of little more than a cell keeps its two surfaces: cells are smaller where all points of some lie
/// on them.
#[test]
fn a_thin_wall_is_not_torn() {
    // Without smaller cells the first has 48 holes, and the second 12.
    for (outer, wall) in [(0.03, 0.003), (0.02, 0.0028)] {
        let body = Anatomy::new(1, Hollow { outer, wall });
        let request = OrganTets { target: 0.0, ..OrganTets::new(0.0025) };
        let report = request.mesh(&body, &|_| {}).unwrap().report;
        assert!(report.repairs.closed_tears > 0, "{report}");
        assert_eq!((report.surface.euler_number, report.surface.of_body), (4, Some(4)), "{report}");
        assert_eq!((report.surface.self_intersections, report.tears.number), (0, 0));
    }
}

/// Every kind of mesh reports whether its boundary has the topology of the body. Large cubes do not enclose
/// the cavity of a thin wall, fine triangles do.
#[test]
fn boundaries_of_cubes_and_triangles_are_checked() {
    let wall = Hollow { outer: 0.03, wall: 0.003 };
    let cubes = |edge: f64| {
        let mesh = Voxels::new(edge).mesh(&wall).unwrap().mesh;
        SurfaceCheck::of(&mesh).with_body(&wall, edge)
    };
    assert_eq!(cubes(0.001).of_body, Some(4));
    assert_eq!(cubes(0.001).euler_number, 4);
    assert_ne!(cubes(0.005).euler_number, 4);
    let surface = TriangleMesh::of_field(&wall, 0.001, usize::MAX).unwrap().to_mesh();
    let check = SurfaceCheck::of(&surface);
    assert_eq!((check.euler_number, check.self_intersections, check.doubt()), (4, 0, None));
    // A moved piece of the surface passes through the rest.
    let mut moved = surface.clone();
    moved.points.iter_mut().filter(|x| x.norm() > 0.0285).for_each(|x| x.x += 0.004);
    let check = SurfaceCheck::of(&moved);
    assert!(
        check.self_intersections > 0 && check.doubt().unwrap().contains("pass through others"),
        "{check:?}"
    );
}

/// Two balls with a neck of one cell between them.
struct Dumbbell {
    neck: f64,
}

impl ImplicitField for Dumbbell {
    fn value(&self, point: &Vector3) -> f64 {
        let ball = |x: f64| 0.015 - (point - Vector3::new(x, 0.0, 0.0)).norm();
        let bar = (self.neck - point.y.hypot(point.z)).min(0.025 - point.x.abs());
        ball(-0.025).max(ball(0.025)).max(bar)
    }

    fn bounds(&self) -> (Vector3, Vector3) {
        (Vector3::new(-0.04, -0.015, -0.015), Vector3::new(0.04, 0.015, 0.015))
    }
}

#[test]
fn a_thin_neck_is_not_broken() {
    for shift in [2, 3] {
        let origin = Vector3::new(0.0, 0.0006 * f64::from(shift), 0.0004 * f64::from(shift));
        let request = OrganTets { target: 0.0, origin: Some(origin), ..OrganTets::new(0.005) };
        let report = request.mesh(&Anatomy::new(1, Dumbbell { neck: 0.0025 }), &|_| {}).unwrap().report;
        assert_eq!((report.surface.euler_number, report.repairs.closed_tears), (2, 1), "{report}");
    }
}

/// Two cubes that share an edge come apart, with a gap between them that survives the optimiser.
struct Cubes;

impl ImplicitField for Cubes {
    fn value(&self, point: &Vector3) -> f64 {
        let cube = |sign: f64| {
            let centre = Vector3::new(0.02 * sign, 0.02 * sign, 0.0);
            0.02 - (point - centre).amax()
        };
        cube(1.0).max(cube(-1.0))
    }

    fn bounds(&self) -> (Vector3, Vector3) {
        (Vector3::new(-0.04, -0.04, -0.02), Vector3::new(0.04, 0.04, 0.02))
    }
}

#[test]
fn banks_that_touch_are_moved_apart() {
    let made = OrganTets::new(0.005).mesh(&Anatomy::new(1, Cubes), &|_| {}).unwrap();
    check_sound(&made);
    assert!(made.report.repairs.doubled_points > 0, "{}", made.report);
    assert_eq!(made.report.surface.self_intersections, 0, "{}", made.report);
    // Points of the two cubes near their edge.
    let faces = conforming_boundary(&made.mesh);
    let near = |side: f64| {
        let mut nodes: Vec<u32> = faces.concat();
        nodes.retain(|&n| {
            let x = made.mesh.points[n as usize];
            x.x.hypot(x.y) < 0.003 && side * (x.x + x.y) > 0.0
        });
        nodes
    };
    let (first, second) = (near(1.0), near(-1.0));
    assert!(!first.is_empty() && !second.is_empty());
    let gaps = first.iter().flat_map(|&a| second.iter().map(move |&b| (a, b)).filter(|(a, b)| a != b));
    let least = gaps
        .map(|(a, b)| (made.mesh.points[a as usize] - made.mesh.points[b as usize]).norm())
        .fold(f64::INFINITY, f64::min);
    assert!(least > 0.04 * 0.005, "{least}");
}

/// A ball with a disc round it, which is far thinner than the cells.
struct Saturn;

impl ImplicitField for Saturn {
    fn value(&self, point: &Vector3) -> f64 {
        let ball = 0.02 - point.norm();
        let disc = (0.0005 - point.z.abs()).min(0.03 - point.x.hypot(point.y));
        ball.max(disc)
    }

    fn bounds(&self) -> (Vector3, Vector3) {
        (Vector3::new(-0.03, -0.03, -0.02), Vector3::new(0.03, 0.03, 0.02))
    }
}

#[test]
fn what_is_lost_is_named_and_does_not_inflate_the_rest() {
    let surface = TriangleMesh::of_field(&Saturn, 0.0004, usize::MAX).unwrap().to_mesh();
    let body = Enclosed::new(&surface, 0.005, &Closing::default()).unwrap();
    let made = OrganTets::new(0.005).mesh(&body.anatomy(7, 0.005, &|_| {}).unwrap(), &|_| {}).unwrap();
    let ball = 4.0 / 3.0 * PI * 0.02_f64.powi(3);
    let disc = body.volume() - ball;
    assert!((tet_volume(&made.mesh) / ball - 1.0).abs() < 0.005, "{}", made.report);
    let [lost] = made.report.lost[..] else { panic!("{}", made.report) };
    assert!((lost.volume / disc - 1.0).abs() < 0.05, "{lost:?} of {disc:e}");
    assert!(lost.label == 7 && lost.place[0].hypot(lost.place[1]) > 0.028 && lost.place[2].abs() < 0.001);
    let doubts = made.report.doubts().join("\n");
    assert!(
        doubts.contains("lacks parts of the body: 1.") && doubts.contains(" ml of label 7 at ("),
        "{doubts}"
    );
}

/// A ball of 10 mm in triangles of 8 mm is a fifth too small unless its points move out.
#[test]
fn a_surface_of_few_triangles_keeps_the_volume_of_its_label() {
    let image = organs::ball(0.01);
    let cleaning = Cleaning::default();
    let (body, _) = Anatomy::from_image(&image, &[1], &cleaning, &SURFACE_SMOOTHING, &|_| {})
        .expect("the label is there");
    let voxel = image.grid.spacing()[0];
    let mut surface = TriangleMesh::of_image(&body, voxel, usize::MAX).unwrap();
    surface.remesh(0.008, usize::MAX).unwrap();
    let kept = surface.keep_volume(&body).unwrap();
    let [label] = kept.labels[..] else { panic!("{kept:?}") };
    assert!(label.error().abs() < 1e-3 && kept.moved > 0.5e-3, "{kept:?}");
    assert!(kept.lost.is_empty() && kept.warnings().is_empty(), "{kept:?}");
    assert!(kept.lines()[0].contains("% of the input"), "{:?}", kept.lines());
}
