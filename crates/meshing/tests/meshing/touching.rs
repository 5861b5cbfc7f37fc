//! Surfaces that touch themselves along an edge.

use pliant_geometry::{CellKind, Mesh, Vector3, diagnose};
use pliant_meshing::TriangleMesh;

/// Two cubes that share an edge are two closed surfaces that touch there. As a mesh they are two pieces
/// without open edges, whose points no reader takes for one, not in single precision either.
#[test]
fn cubes_that_share_an_edge_stay_closed() {
    let cube = |at: f64| {
        let corner =
            |n: usize| Vector3::new((n & 1) as f64 + at, (n >> 1 & 1) as f64 + at, (n >> 2) as f64) * 0.02;
        (0..8).map(corner).collect::<Vec<_>>()
    };
    let faces: Vec<u32> =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]].concat();
    let mut mesh = Mesh { points: [cube(0.0), cube(1.0)].concat(), ..Mesh::default() };
    mesh.block_mut(CellKind::Quad).nodes = faces.iter().copied().chain(faces.iter().map(|n| n + 8)).collect();
    let (surface, repairs) = TriangleMesh::from_mesh(&mesh).unwrap();
    assert_eq!((repairs.joined_points, repairs.cut_edges, repairs.turned_faces), (2, 1, 0));
    let mut made = surface.to_parted_mesh();
    for _ in 0..2 {
        let found = diagnose(&made);
        assert!(found.open_edges.is_empty() && found.duplicate_nodes.is_empty(), "{found}");
        assert_eq!((found.components, made.points.len()), (2, 16));
        made.points.iter_mut().for_each(|x| *x = x.map(|x| f64::from(x as f32)));
    }
}
