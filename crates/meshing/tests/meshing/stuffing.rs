//! Isosurface stuffing of spheres and of awkward bodies.

use std::f64::consts::PI;

use pliant_geometry::Vector3;
use pliant_meshing::{Ellipsoid, FieldMesh, ImplicitField, Organ, Phantom, Stuffing};
use pliant_testing::Random;

use pliant_testing::mesh_checks::*;

const RADIUS: f64 = 0.05;

fn sphere() -> Ellipsoid {
    Ellipsoid::sphere(Vector3::new(0.01, -0.02, 0.3), RADIUS)
}

fn stuffed(field: &impl ImplicitField, edge: f64, origin: Vector3) -> FieldMesh {
    Stuffing { origin: Some(origin), ..Stuffing::new(edge) }.mesh(field).expect("the body is meshed")
}

/// T1 of the specification: 20 offsets of the lattice at 8, 12, 16 and 20 mm.
#[test]
fn a_sphere_is_round_closed_and_free_of_slivers_wherever_the_lattice_lies() {
    let mut random = Random::new(1);
    let exact = 4.0 / 3.0 * PI * RADIUS.powi(3);
    let (mut sharpest, mut shortest) = (180.0_f64, f64::INFINITY);
    for edge in [0.008, 0.012, 0.016, 0.020] {
        // A chord of length s lies s²/(8 r) under the sphere: the volume is short by a part that grows as
        // (a/r)².
        let tolerance = 0.02 * (edge / 0.008_f64).powi(2);
        for _ in 0..20 {
            let filled = stuffed(&sphere(), edge, offset(&mut random, edge));
            let boundary = conforming_boundary(&filled.mesh);
            assert!(tet_volumes(&filled.mesh).iter().all(|&volume| volume > 0.0));
            assert!((tet_volume(&filled.mesh) / exact - 1.0).abs() < tolerance);
            assert_eq!((filled.dropped_components, filled.dropped_cells), (0, 0));
            assert_eq!(filled.non_manifold_edges, 0);
            assert!(edge_counts(&boundary).values().all(|&count| count == 2));
            assert_eq!(euler_characteristic(&boundary), 2);
            sharpest = sharpest.min(dihedral_range(&filled.mesh)[0]);
            shortest = shortest.min(least_acoustic_length(&filled.mesh) / ideal_acoustic_length(edge));
            assert_near_sphere(&filled, &boundary, edge);
        }
    }
    println!("spheres: least dihedral {sharpest:.2}°, least acoustic length {shortest:.3} of ideal");
    assert!(sharpest > 10.0);
    assert!(shortest > 0.2);
}

/// Points of the boundary lie on the sphere, its faces within 0.15 a below.
fn assert_near_sphere(filled: &FieldMesh, boundary: &[Vec<u32>], edge: f64) {
    let depth = |point: Vector3| RADIUS - (point - sphere().centre).norm();
    for face in boundary {
        let corners: Vec<Vector3> = face.iter().map(|&node| filled.mesh.points[node as usize]).collect();
        // 24 bisections of an edge of the lattice.
        assert!(corners.iter().all(|&corner| depth(corner).abs() < 1e-7 * edge));
        assert!(depth((corners[0] + corners[1] + corners[2]) / 3.0) < 0.15 * edge);
    }
}

#[test]
fn the_default_lattice_is_centred_on_the_body() {
    let body = sphere();
    let by_default = Stuffing::new(0.013).mesh(&body).expect("the body is meshed");
    let (low, high) = body.bounds();
    assert_eq!(by_default, stuffed(&body, 0.013, (low + high) / 2.0));
}

#[test]
fn a_lattice_shifted_by_whole_cubes_is_the_same_lattice() {
    let near = stuffed(&sphere(), 0.0125, Vector3::zeros());
    let far = stuffed(&sphere(), 0.0125, Vector3::new(125.0, -12.5, 0.0125));
    assert_eq!(near.mesh.blocks, far.mesh.blocks);
}

/// T4 of the specification.
#[test]
fn the_thread_count_never_changes_a_bit() {
    let brain = Phantom::new(Organ::Brain, 1.0).expect("a positive scale");
    let with_threads = |count| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build().expect("a pool");
        pool.install(|| Stuffing::new(0.01).mesh(&brain)).expect("the brain is meshed")
    };
    let (one, four) = (with_threads(1), with_threads(4));
    assert_eq!(one, four);
    let bits = |filled: &FieldMesh| -> Vec<u64> {
        filled.mesh.points.iter().flat_map(|point| point.iter().map(|x| x.to_bits())).collect()
    };
    assert_eq!(bits(&one), bits(&four));
}

/// Two balls that do not touch.
struct TwoBalls;

impl ImplicitField for TwoBalls {
    fn value(&self, point: &Vector3) -> f64 {
        let small = Ellipsoid::sphere(Vector3::zeros(), 0.02);
        let large = Ellipsoid::sphere(Vector3::new(0.1, 0.0, 0.0), 0.04);
        small.value(point).max(large.value(point))
    }

    fn bounds(&self) -> (Vector3, Vector3) {
        (Vector3::new(-0.02, -0.04, -0.04), Vector3::new(0.14, 0.04, 0.04))
    }
}

#[test]
fn only_the_largest_component_is_kept() {
    let filled = Stuffing::new(0.008).mesh(&TwoBalls).expect("the balls are meshed");
    let small = Stuffing::new(0.008).mesh(&Ellipsoid::sphere(Vector3::zeros(), 0.02)).expect("a ball");
    assert_eq!(filled.dropped_components, 1);
    assert!(filled.dropped_cells.abs_diff(small.mesh.blocks[0].len()) < filled.dropped_cells / 2);
    let exact = 4.0 / 3.0 * PI * 0.04_f64.powi(3);
    assert!((tet_volume(&filled.mesh) / exact - 1.0).abs() < 0.03);
    conforming_boundary(&filled.mesh);
}

/// A cube whose faces pass exactly through lattice points: values of exactly zero.
struct Cube;

impl ImplicitField for Cube {
    fn value(&self, point: &Vector3) -> f64 {
        0.5 - point.amax()
    }

    fn bounds(&self) -> (Vector3, Vector3) {
        (Vector3::repeat(-0.5), Vector3::repeat(0.5))
    }
}

#[test]
fn points_exactly_on_the_surface_are_kept_as_they_are() {
    let filled = stuffed(&Cube, 0.25, Vector3::zeros());
    let boundary = conforming_boundary(&filled.mesh);
    assert_eq!(euler_characteristic(&boundary), 2);
    assert!(tet_volumes(&filled.mesh).iter().all(|&volume| volume > 0.0));
    // Flat faces lie on lattice planes; only the twelve edges of the cube are bevelled.
    let volume = tet_volume(&filled.mesh);
    assert!(volume > 0.85 && volume <= 1.0 + 1e-12, "{volume}");
}
