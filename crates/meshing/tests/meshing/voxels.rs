//! Cubes in bodies.

use std::f64::consts::PI;

use pliant_geometry::Vector3;
use pliant_meshing::{Ellipsoid, ImplicitField, Voxels};

use crate::checks::*;

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
