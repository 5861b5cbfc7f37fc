//! Small meshes and repeatable noise for the tests of this crate.

use pliant_testing::Random;

use crate::{CellKind, Mesh, Vector3};

/// Corners of the unit cube in the order of a hex.
pub(crate) const UNIT_CUBE: [[f64; 3]; 8] = [
    [0., 0., 0.],
    [1., 0., 0.],
    [1., 1., 0.],
    [0., 1., 0.],
    [0., 0., 1.],
    [1., 0., 1.],
    [1., 1., 1.],
    [0., 1., 1.],
];

/// Arrays as points.
pub(crate) fn points(coordinates: &[[f64; 3]]) -> Vec<Vector3> {
    coordinates.iter().copied().map(Vector3::from).collect()
}

/// Each coordinate from −1 to 1.
pub(crate) fn noise(random: &mut Random) -> Vector3 {
    random.vector().into()
}

/// A block of unit cubes from the origin; x runs fastest.
pub(crate) fn block_of_hexes(cells: [u32; 3]) -> Mesh {
    let [nx, ny, nz] = cells;
    let mut mesh = Mesh::default();
    for (k, j, i) in triples([nz + 1, ny + 1, nx + 1]) {
        mesh.points.push(Vector3::new(i.into(), j.into(), k.into()));
    }
    let node = |i, j, k| i + (nx + 1) * (j + (ny + 1) * k);
    for (k, j, i) in triples([nz, ny, nx]) {
        let ring = |k| [node(i, j, k), node(i + 1, j, k), node(i + 1, j + 1, k), node(i, j + 1, k)];
        mesh.block_mut(CellKind::Hex).nodes.extend(ring(k).into_iter().chain(ring(k + 1)));
    }
    mesh
}

/// A block of unit cubes, each cut into six tets around its diagonal from 0 to 6 (Kuhn).
pub(crate) fn block_of_tets(cells: [u32; 3]) -> Mesh {
    let hexes = block_of_hexes(cells);
    let mut mesh = Mesh { points: hexes.points.clone(), ..Mesh::default() };
    let ring = [1, 2, 3, 7, 4, 5];
    for hex in hexes.block(CellKind::Hex).into_iter().flat_map(|block| block.cells()) {
        for (at, &a) in ring.iter().enumerate() {
            let b = ring[(at + 1) % 6];
            mesh.block_mut(CellKind::Tet).nodes.extend([hex[0], hex[a], hex[b], hex[6]]);
        }
    }
    mesh
}

fn triples(counts: [u32; 3]) -> impl Iterator<Item = (u32, u32, u32)> {
    let [a, b, c] = counts;
    (0..a).flat_map(move |i| (0..b).flat_map(move |j| (0..c).map(move |k| (i, j, k))))
}
