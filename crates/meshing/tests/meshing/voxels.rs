//! Cubes in bodies.

use std::f64::consts::PI;

use pliant_geometry::{Mesh, Vector3};
use pliant_meshing::{Ellipsoid, ImplicitField, Organ, Phantom, Voxels};

use pliant_testing::mesh_checks::*;

#[test]
fn cubes_fill_a_sphere() {
    let sphere = Ellipsoid::sphere(Vector3::new(0.3, 0.2, 0.1), 0.05);
    let filled = Voxels::new(0.005).mesh(&sphere).expect("the sphere is filled");
    assert_eq!((filled.dropped_components, filled.non_manifold_edges), (0, 0));
    assert_eq!(euler_characteristic(&conforming_boundary(&filled.mesh)), 2);
    let (volume, least) = hex_volume(&filled.mesh);
    assert!((least / 0.005_f64.powi(3) - 1.0).abs() < 1e-9);
    // About 0.1 r of jagged surface, random in sign.
    assert!((volume / (4.0 / 3.0 * PI * 0.05_f64.powi(3)) - 1.0).abs() < 0.03);
}

/// The volume that cubes fill, and the least and largest fraction.
fn filled_volume(mesh: &Mesh, edge: f64) -> [f64; 3] {
    let fractions = &mesh.blocks[0].data[Voxels::FRACTION].values;
    assert_eq!(fractions.len(), mesh.blocks[0].len());
    let least = fractions.iter().copied().fold(f64::INFINITY, f64::min);
    let largest = fractions.iter().copied().fold(0.0, f64::max);
    [fractions.iter().sum::<f64>() * edge.powi(3), least, largest]
}

#[test]
fn immersed_cubes_hold_the_volume_of_a_body_within_a_percent() {
    let ball = Ellipsoid::sphere(Vector3::new(0.3, 0.2, 0.1), 0.05);
    let liver = Phantom::new(Organ::Liver, 1.0).expect("a positive scale");
    // The true volume of the liver is 774 ml to the printed digit.
    let bodies: [(&dyn ImplicitField, f64); 2] =
        [(&ball, 4.0 / 3.0 * PI * 0.05_f64.powi(3)), (&liver, 774e-6)];
    for (body, exact) in bodies {
        for edge in [0.012, 0.010, 0.008] {
            let filled = Voxels::new(edge).immersed(body).expect("the body is filled");
            let [volume, least, largest] = filled_volume(&filled.mesh, edge);
            let majority = hex_volume(&Voxels::new(edge).mesh(body).expect("the body is filled").mesh).0;
            println!(
                "{edge}: {:+.2} %, by majority {:+.2} %",
                1e2 * (volume / exact - 1.0),
                1e2 * (majority / exact - 1.0)
            );
            assert!((volume / exact - 1.0).abs() < 0.01, "{volume} of {exact} at {edge}");
            assert!(least > 0.02 && largest == 1.0);
            assert_eq!((filled.dropped_components, filled.dropped_cells), (0, 0));
        }
    }
}

#[test]
fn fractions_are_those_of_the_samples_and_loose_cubes_go_with_theirs() {
    let made = Voxels::new(1.0).immersed(&Cubes(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [3.0, 3.0, 3.0]]));
    let made = made.expect("cubes are filled");
    let fractions = &made.mesh.blocks[0].data[Voxels::FRACTION].values;
    // The grid reaches from −0.5 to 3.5: whole cubes.
    assert_eq!((fractions.as_slice(), made.dropped_components, made.dropped_cells), (&[1.0, 1.0][..], 1, 1));
    let finer = Voxels::new(4.0 / 3.0).immersed(&Cubes(&[[0.0, 0.0, 0.0]])).expect("a cube is filled");
    // A cube of 1 m in one of 4/3 m: six of eight samples along each edge, (3/4)³.
    assert_eq!(finer.mesh.blocks[0].data[Voxels::FRACTION].values, [27.0 / 64.0]);
}

/// Cubes of 1 m at whole positions.
struct Cubes(&'static [[f64; 3]]);

impl ImplicitField for Cubes {
    fn value(&self, point: &Vector3) -> f64 {
        let inside = |cube: &[f64; 3]| 0.5 - (point - Vector3::from(*cube)).amax();
        self.0.iter().map(inside).fold(-1.0, f64::max)
    }

    fn bounds(&self) -> (Vector3, Vector3) {
        (Vector3::repeat(-0.5), Vector3::repeat(3.5))
    }
}

#[test]
fn cubes_joined_only_by_an_edge_are_components() {
    let filled = Voxels::new(1.0)
        .mesh(&Cubes(&[[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [2.0, 1.0, 0.0]]))
        .expect("cubes are filled");
    assert_eq!((filled.dropped_components, filled.dropped_cells, filled.non_manifold_edges), (1, 1, 0));
    assert_eq!(filled.mesh.points.len(), 12);
    assert_eq!(filled.mesh.bounds(), Some((Vector3::new(0.5, 0.5, -0.5), Vector3::new(2.5, 1.5, 0.5))));
}

#[test]
fn an_edge_where_the_body_touches_itself_is_reported() {
    let ring = [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, 1.0], [1.0, 1.0, 0.0]];
    let ring: &'static [[f64; 3]] = Box::leak(Box::new(ring));
    let filled = Voxels::new(1.0).mesh(&Cubes(ring)).expect("cubes are filled");
    assert_eq!((filled.dropped_components, filled.non_manifold_edges), (0, 1));
}
