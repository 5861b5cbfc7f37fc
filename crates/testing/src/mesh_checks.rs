//! Measures of a mesh, written for clarity and apart from the library.

use std::collections::BTreeMap;

use pliant_geometry::{CellKind, Mesh, Vector3};

use crate::Random;

/// Six times the signed volume of a tetrahedron.
fn determinant([a, b, c, d]: [Vector3; 4]) -> f64 {
    (b - a).cross(&(c - a)).dot(&(d - a))
}

/// Corners of each tetrahedron [m].
pub fn tets(mesh: &Mesh) -> impl Iterator<Item = [Vector3; 4]> {
    let block = mesh.block(CellKind::Tet).expect("the mesh has tetrahedra");
    block.cells().map(|cell| [0, 1, 2, 3].map(|node| mesh.points[cell[node] as usize]))
}

/// Volumes of the tetrahedra [m³].
pub fn tet_volumes(mesh: &Mesh) -> Vec<f64> {
    tets(mesh).map(|tet| determinant(tet) / 6.0).collect()
}

/// Volume of a mesh of tetrahedra [m³].
pub fn tet_volume(mesh: &Mesh) -> f64 {
    tet_volumes(mesh).iter().sum()
}

/// Volume of a mesh of hexahedra with straight edges [m³], and the least Jacobian determinant at a corner
/// [m³]. Each hexahedron is taken as the mean of its two splits into five tetrahedra, which is exact for the
/// trilinear map.
pub fn hex_volume(mesh: &Mesh) -> (f64, f64) {
    const SPLITS: [[usize; 4]; 10] = [
        [0, 1, 3, 4],
        [2, 3, 1, 6],
        [5, 4, 6, 1],
        [7, 6, 4, 3],
        [1, 3, 4, 6],
        [1, 2, 0, 5],
        [3, 0, 2, 7],
        [4, 7, 5, 0],
        [6, 5, 7, 2],
        [0, 2, 7, 5],
    ];
    let block = mesh.block(CellKind::Hex).expect("the mesh has hexahedra");
    let (mut volume, mut least) = (0.0, f64::INFINITY);
    for cell in block.cells() {
        for (at, split) in SPLITS.iter().enumerate() {
            let six = determinant(split.map(|node| mesh.points[cell[node] as usize]));
            volume += six / 12.0;
            if at % 5 != 4 {
                least = f64::min(least, six);
            }
        }
    }
    (volume, least)
}

/// Smallest and largest angle between two faces of a tetrahedron in the mesh [degrees].
pub fn dihedral_range(mesh: &Mesh) -> [f64; 2] {
    const PAIRS: [[usize; 4]; 6] =
        [[0, 1, 2, 3], [0, 2, 3, 1], [0, 3, 1, 2], [1, 2, 0, 3], [1, 3, 2, 0], [2, 3, 0, 1]];
    let mut range = [f64::INFINITY, 0.0_f64];
    for tet in tets(mesh) {
        for [a, b, c, d] in PAIRS.map(|pair| pair.map(|node| tet[node])) {
            let axis = (b - a).normalize();
            let across = |p: Vector3| (p - a) - axis * axis.dot(&(p - a));
            let angle = across(c).angle(&across(d)).to_degrees();
            range = [range[0].min(angle), range[1].max(angle)];
        }
    }
    range
}

/// Length of the longest edge [m].
pub fn longest_edge(mesh: &Mesh) -> f64 {
    let of_tet =
        |[a, b, c, d]: [Vector3; 4]| [a - b, a - c, a - d, b - c, b - d, c - d].map(|edge| edge.norm());
    tets(mesh).flat_map(of_tet).fold(0.0, f64::max)
}

/// Points of a boundary at which the faces form more than one fan.
pub fn pinched(faces: &[Vec<u32>]) -> Vec<u32> {
    let mut others: BTreeMap<u32, Vec<[u32; 2]>> = BTreeMap::new();
    for face in faces {
        for (at, &node) in face.iter().enumerate() {
            others.entry(node).or_default().push([face[(at + 1) % 3], face[(at + 2) % 3]]);
        }
    }
    // Goes from the first face to the next across their common edge: a single fan returns after all faces.
    let is_one_fan = |links: &Vec<[u32; 2]>| {
        let (mut at, mut length) = (links[0][1], 1);
        while at != links[0][0] {
            at = links.iter().find(|link| link[0] == at).expect("the boundary is closed")[1];
            length += 1;
        }
        length == links.len()
    };
    others.into_iter().filter(|(_, links)| !is_one_fan(links)).map(|(node, _)| node).collect()
}

/// Smallest acoustic length 6V / √Σ (2A)² of a tetrahedron in the mesh [m].
pub fn least_acoustic_length(mesh: &Mesh) -> f64 {
    let length = |tet: [Vector3; 4]| {
        let faces = [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]];
        let areas = faces.map(|[a, b, c]| (tet[b] - tet[a]).cross(&(tet[c] - tet[a])).norm_squared());
        determinant(tet) / areas.iter().sum::<f64>().sqrt()
    };
    tets(mesh).map(length).fold(f64::INFINITY, f64::min)
}

/// Acoustic length of the tetrahedra of an undisturbed lattice [m].
pub fn ideal_acoustic_length(edge: f64) -> f64 {
    edge / 8.0_f64.sqrt()
}

/// Faces of a kind of cell, outward.
fn faces_of(kind: CellKind) -> &'static [&'static [usize]] {
    match kind {
        CellKind::Tet => &[&[1, 2, 3], &[0, 3, 2], &[0, 1, 3], &[0, 2, 1]],
        _ => &[&[0, 3, 2, 1], &[4, 5, 6, 7], &[0, 1, 5, 4], &[1, 2, 6, 5], &[2, 3, 7, 6], &[3, 0, 4, 7]],
    }
}

/// A face turned so that its smallest node comes first.
fn rotated(mut face: Vec<u32>) -> Vec<u32> {
    let first = (0..face.len()).min_by_key(|&i| face[i]).unwrap_or(0);
    face.rotate_left(first);
    face
}

/// Returns the boundary, outward. Checks that every inner face belongs to two cells on opposite sides, no
/// face to more, and every point to a cell.
pub fn conforming_boundary(mesh: &Mesh) -> Vec<Vec<u32>> {
    let [block] = &mesh.blocks[..] else { panic!("one block expected") };
    let mut faces: BTreeMap<Vec<u32>, usize> = BTreeMap::new();
    let mut used = vec![false; mesh.points.len()];
    for cell in block.cells() {
        for local in faces_of(block.kind) {
            let face = rotated(local.iter().map(|&node| cell[node]).collect());
            *faces.entry(face).or_default() += 1;
        }
        cell.iter().for_each(|&node| used[node as usize] = true);
    }
    assert!(used.iter().all(|&used| used), "a point without a cell");
    assert!(faces.values().all(|&count| count == 1), "two cells on one side of a face");
    let opposite = |face: &Vec<u32>| rotated(face.iter().rev().copied().collect());
    let boundary: Vec<_> =
        faces.keys().filter(|face| !faces.contains_key(&opposite(face))).cloned().collect();
    // If three nodes appear in two orders, one side of the face occurs twice.
    let mut sorted: Vec<_> = boundary.iter().map(|face| sorted(face)).collect();
    sorted.sort();
    assert!(sorted.windows(2).all(|pair| pair[0] != pair[1]), "faces that do not meet");
    boundary
}

fn sorted(face: &[u32]) -> Vec<u32> {
    let mut nodes = face.to_vec();
    nodes.sort_unstable();
    nodes
}

/// Number of times that each edge occurs in the faces.
pub fn edge_counts(faces: &[Vec<u32>]) -> BTreeMap<[u32; 2], usize> {
    let mut edges = BTreeMap::new();
    for face in faces {
        for (i, &a) in face.iter().enumerate() {
            let b = face[(i + 1) % face.len()];
            *edges.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    edges
}

/// Vertices − edges + faces of a surface.
pub fn euler_characteristic(faces: &[Vec<u32>]) -> isize {
    let mut vertices = faces.concat();
    vertices.sort_unstable();
    vertices.dedup();
    vertices.len() as isize - edge_counts(faces).len() as isize + faces.len() as isize
}

/// A vector with each coordinate in [−½, ½) `length`.
pub fn offset(random: &mut Random, length: f64) -> Vector3 {
    Vector3::from(random.vector()) * (0.5 * length)
}
