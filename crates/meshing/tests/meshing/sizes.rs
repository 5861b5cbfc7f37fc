//! Distances to the input, wrong labels, cells of several sizes, and distance bounds.

use pliant_geometry::{CellKind, Grid, Mesh, Vector3};
use pliant_imaging::LabelImage;
use pliant_meshing::{
    Anatomy, Assessment, Closing, DEFAULT_CELL_LIMIT, Ellipsoid, Enclosed, Hausdorff, MeasuredTo,
    MeshingError, Missed, OrganMesh, OrganTets, TriangleMesh, sphere,
};
use pliant_testing::mesh_checks::{conforming_boundary, tet_volume};

use crate::organs::{anatomy, check_sound};

/// A ball of 30 mm with a spike that ends 55 mm from its centre; its base is a cap of this many
/// degrees.
fn spiked(cap: f64) -> Mesh {
    let mut mesh = sphere(0.03, 5, DEFAULT_CELL_LIMIT).expect("a sphere");
    for point in &mut mesh.points {
        let from_axis = point.angle(&Vector3::z()).to_degrees();
        *point *= 1.0 + 25.0 / 30.0 * (1.0 - from_axis / cap).max(0.0);
    }
    mesh
}

/// The boundary of a mesh of tets.
fn skin(mesh: &Mesh) -> TriangleMesh {
    let mut skin = Mesh { points: mesh.points.clone(), ..Mesh::default() };
    skin.block_mut(CellKind::Triangle).nodes = conforming_boundary(mesh).concat();
    TriangleMesh::from_mesh(&skin).expect("a surface").0
}

/// The field of cells of 8 mm loses most of the spike, and the mesh follows the field. The report must give
/// the distance from the triangles.
#[test]
fn tets_of_a_surface_are_measured_to_its_triangles() {
    let edge = 0.008;
    let given = spiked(3.0);
    let body = Enclosed::new(&given, edge, &Closing::default()).expect("closed");
    let anatomy = body.anatomy(1, edge, &|_| {}).expect("a field");
    let made = OrganTets::new(edge).mesh(&anatomy, &|_| {}).expect("a mesh");
    let Assessment { deviation, missed, .. } = Assessment::of(&made.mesh, &anatomy, edge).expect("a body");
    let given = TriangleMesh::from_mesh(&given).expect("a surface").0;
    let truth = Hausdorff::between(&skin(&made.mesh), &given, 2e-4);
    assert_eq!(deviation.to, MeasuredTo::Triangles);
    // Samples are a quarter of an edge apart; the tip is a sample.
    assert!(
        (deviation.largest_from_body / truth.largest_backward - 1.0).abs() < 0.01,
        "{deviation:?} {truth:?}"
    );
    assert!(
        (deviation.largest_from_mesh - truth.largest_forward).abs() < 0.05 * edge,
        "{deviation:?} {truth:?}"
    );
    assert!(deviation.largest_from_body > 0.01 && deviation.farthest[2] > 0.054);
    assert!(deviation.median_from_body <= deviation.p95_from_body);
    assert!(deviation.p95_from_body < 0.1 * deviation.largest_from_body, "{deviation:?}");
    assert!(!missed.is_empty());
    let field = pliant_meshing::Deviation::new(&made.mesh, anatomy.field(), edge).expect("a body");
    println!(
        "to the field {:.4}, to the triangles {:.4}",
        field.largest_from_body, deviation.largest_from_body
    );
}

/// A block of 40 mm of label 1. It contains a plate of label 2, 4 mm thick, and a ball of label 3 of 3 mm.
fn block_with_plate() -> LabelImage {
    let grid = Grid::along_axes([50, 50, 50], Vector3::zeros(), [1e-3; 3]).expect("a grid");
    let label = |at: usize| {
        let [i, j, k] = grid.triple(at);
        let inside = |low: usize, high: usize| [i, j, k].iter().all(|x| (low..high).contains(x));
        let speck =
            [i, j, k].iter().zip([11, 11, 11]).map(|(&x, c)| (x as f64 - c as f64).powi(2)).sum::<f64>();
        match () {
            () if speck < 9.0 => 3,
            () if inside(15, 35) && (23..27).contains(&k) => 2,
            () => i32::from(inside(5, 45)),
        }
    };
    LabelImage { labels: (0..grid.len()).map(label).collect(), grid }
}

fn off(made: &OrganMesh, label: i32) -> f64 {
    let material = made.report.materials.iter().find(|material| material.label == label).expect("a label");
    (material.volume / material.voxel_volume.expect("the image knows") - 1.0).abs()
}

#[test]
fn labels_that_are_off_are_told_and_better_where_they_are_protected() {
    let edge = 0.008;
    let image = block_with_plate();
    let block = anatomy(&image, &[1, 2, 3]);
    let plain = OrganTets::new(edge);
    let coarse = plain.mesh(&block, &|_| {}).expect("a mesh");
    let found = Assessment::of(&coarse.mesh, &block, edge).expect("a body");
    assert_eq!(found.deviation.to, MeasuredTo::Voxels);
    let reports = |found: &Assessment, label: i32| {
        found.missed.iter().any(|missed| match missed {
            Missed::Label { label: missing }
            | Missed::LabelVolume { label: missing, .. }
            | Missed::LabelAway { label: missing, .. } => *missing == label,
            _ => false,
        })
    };
    assert!(reports(&found, 3), "{:?}", found.missed);
    let between = |found: &Assessment| {
        let interface = found.regions.interfaces.iter().find(|interface| interface.labels == [1, 2]);
        interface.expect("the image has it").distances.map(|distances| distances.p95_from_body)
    };
    let fine = plain.protecting(&[(2, Some(0.002)), (3, Some(0.001))]).mesh(&block, &|_| {}).expect("a mesh");
    println!("{}\n{}", coarse.report, fine.report);
    check_sound(&fine);
    let better = Assessment::of(&fine.mesh, &block, edge).expect("a body");
    for (made, found) in [&coarse, &fine].into_iter().zip([&found, &better]) {
        for material in &made.report.materials {
            let label = material.label;
            let part = material.volume / material.voxel_volume.expect("the image knows") - 1.0;
            let volume = found.missed.iter().find_map(|missed| match missed {
                Missed::LabelVolume { label: missing, part } if *missing == label => Some(*part),
                _ => None,
            });
            println!("label {label}: {part:+.4}, told {volume:?}");
            assert_eq!(volume.is_some(), part.abs() > 0.05 && material.tets > 0, "{label}: {part}");
            assert!(
                volume.is_none_or(|reported| (reported - part).abs() < 1e-9),
                "{label}: {part}, {volume:?}"
            );
        }
    }
    // The sharp corners of the block are still cut.
    assert!(!reports(&better, 2) && !reports(&better, 3), "{:?}", better.missed);
    assert!(off(&fine, 2) < 0.02 && off(&fine, 3) < 0.05, "{}", fine.report);
    assert!(between(&better).is_some_and(|better| better < between(&found).unwrap_or(f64::INFINITY)));
    assert!(fine.report.acoustic_part > 0.6, "{}", fine.report);
    // Only on request: cells of 2 mm everywhere would be 64 times as many as cells of 8 mm.
    assert!(fine.report.tets < 40 * coarse.report.tets);
    let error =
        OrganTets::new(edge).protecting(&[(4, None)]).mesh(&block, &|_| {}).expect_err("no such label");
    assert!(matches!(error, MeshingError::NoSuchLabel { label: 4, .. }));
}

#[test]
fn cells_are_larger_inside_and_the_threads_never_change_a_bit() {
    let ball = Anatomy::new(1, Ellipsoid::sphere(Vector3::zeros(), 0.05));
    let even = OrganTets::new(0.005);
    let graded = OrganTets { inner_edge: Some(0.01), ..even.clone() };
    let made = graded.mesh(&ball, &|_| {}).expect("a mesh");
    println!("{}", made.report);
    check_sound(&made);
    let uniform = even.mesh(&ball, &|_| {}).expect("a mesh");
    assert!(
        4 * made.report.tets < 3 * uniform.report.tets,
        "{} of {}",
        made.report.tets,
        uniform.report.tets
    );
    assert!(made.report.acoustic_part >= 0.7 && made.report.dihedral[0] > 10.0, "{}", made.report);
    assert!((tet_volume(&made.mesh) / tet_volume(&uniform.mesh) - 1.0).abs() < 0.005);
    assert!(made.report.edges.longest > 0.009 && made.report.edges.longest < 0.016);
    let bits = |made: &OrganMesh| -> Vec<u64> {
        made.mesh.points.iter().flat_map(|point| point.iter().map(|x| x.to_bits())).collect()
    };
    let coarser = OrganTets { inner_edge: Some(0.02), ..OrganTets::new(0.01) };
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| coarser.mesh(&ball, &|_| {})).expect("a mesh")
    };
    let one = with(1);
    for other in [with(2), with(8)] {
        assert_eq!((&other.mesh.blocks, bits(&other)), (&one.mesh.blocks, bits(&one)));
    }
}

#[test]
fn a_distance_is_held_or_the_best_so_far_is_told() {
    let given = spiked(25.0);
    let closed = Enclosed::new(&given, 0.016, &Closing::default()).expect("closed");
    let held = OrganTets { distance: Some(0.0015), ..OrganTets::new(0.016) };
    let body = closed.fine_anatomy(1, held.edge, held.finest(), &|_| {}).expect("a field");
    let made = held.mesh(&body, &|_| {}).expect("a mesh");
    println!("{}", made.report);
    check_sound(&made);
    let found = made.report.distance.expect("a distance was asked for");
    let truth =
        Hausdorff::between(&skin(&made.mesh), &TriangleMesh::from_mesh(&given).expect("a surface").0, 2e-4);
    assert!(
        found.to == MeasuredTo::Triangles && found.reached <= 0.0015 && found.passes > 1,
        "{}",
        made.report
    );
    assert!(truth.largest() < 1.53e-3, "{truth:?}");
    // A warning names the spike, which costs most of the step. It is the only warning.
    let doubts = made.report.doubts();
    assert!(doubts.len() == 1 && doubts[0].contains("make the step"), "{doubts:?}");
    // Few cells are allowed.
    let made = OrganTets { cell_limit: 2000, ..held }.mesh(&body, &|_| {}).expect("a mesh");
    assert!(made.report.tets <= 2000 && made.report.doubts()[0].contains("not reached"), "{}", made.report);
}

/// At the border between cubes of two sizes, edges along large cubes with small cubes at both ends are
/// halved.
#[test]
fn no_edge_is_longer_than_allowed_where_sizes_change() {
    let ball = |x: f64, radius: f64| Ellipsoid::sphere(Vector3::new(x, 0.0, 0.0), radius);
    let body = || {
        Anatomy::new(1, ball(0.0, 0.05)).with_inner(2, ball(0.02, 0.012)).with_inner(3, ball(-0.035, 0.008))
    };
    let plain = OrganTets::new(0.01);
    let inside = OrganTets { inner_edge: Some(0.04), ..plain.clone().protecting(&[(3, Some(0.0025))]) };
    for request in [plain.protecting(&[(2, None), (3, Some(0.0025))]), inside] {
        let made = request.mesh(&body(), &|_| {}).expect("a mesh");
        println!("{}", made.report);
        check_sound(&made);
        assert!(made.report.repairs.long_edges > 0 && made.report.acoustic_part >= 0.75, "{}", made.report);
    }
}
