//! Faces between cells: the largest face-connected component, and edges where its boundary is not a surface.

use pliant_geometry::{CellBlock, CellKind, Mesh, Vector3};
use rayon::prelude::*;

use crate::FieldMesh;
use crate::input::given::{OUTSIDE_LABEL, Patches, sorted};

/// Faces of a tetrahedron, outward, as local nodes.
const TET_FACES: [&[usize]; 4] = [&[1, 2, 3], &[0, 3, 2], &[0, 1, 3], &[0, 2, 1]];

/// Faces of a hexahedron, outward, as local nodes.
const HEX_FACES: [&[usize]; 6] =
    [&[0, 3, 2, 1], &[4, 5, 6, 7], &[0, 1, 5, 4], &[2, 3, 7, 6], &[1, 2, 6, 5], &[0, 4, 7, 3]];

/// Keeps the face-connected component of `cells` with the most cells (of equals the one with the lowest
/// cell). Its points follow in increasing order of their numbers in `cells`. `position` gives a point by that
/// number.
pub(crate) fn largest_component(
    kind: CellKind,
    cells: &[u32],
    position: impl Fn(u32) -> Vector3 + Sync + Send,
) -> FieldMesh {
    // Among equal components only the first is kept.
    large_components(kind, cells, f64::INFINITY, position)
}

/// Keeps the largest face-connected component of `cells` and all that have at least the part `smallest` of
/// its cells.
pub(crate) fn large_components(
    kind: CellKind,
    cells: &[u32],
    smallest: f64,
    position: impl Fn(u32) -> Vector3 + Sync + Send,
) -> FieldMesh {
    let faces = sorted_faces(kind, cells);
    let components = Components::new(kind, cells, &faces);
    let kept = components.large(smallest);
    let n = kind.node_count();
    let nodes: Vec<u32> = cells
        .chunks_exact(n)
        .zip(&components.root)
        .filter(|(_, root)| kept[**root as usize])
        .flat_map(|(cell, _)| cell)
        .copied()
        .collect();
    FieldMesh {
        non_manifold_edges: non_manifold_edges(kind, cells, &faces, |cell| {
            kept[components.root[cell] as usize]
        }),
        dropped_components: components.count - kept.iter().filter(|&&kept| kept).count(),
        dropped_cells: (cells.len() - nodes.len()) / n,
        mesh: compact(kind, nodes, position),
    }
}

/// The faces of the volume cells of a mesh between different labels (cell data `label`) and to the outside,
/// quads as two triangles.
pub(crate) fn faces_between_labels(mesh: &Mesh) -> Patches {
    let mut faces: Vec<([u32; 4], Vec<u32>, i32)> = Vec::new();
    for block in mesh.volume_blocks() {
        let labels = block.data.get("label").map_or(&[][..], |labels| &labels.values);
        // Without labels, all cells have one label that is not the outside.
        let labels = labels.iter().map(|&label| label as i32).chain(std::iter::repeat(OUTSIDE_LABEL + 1));
        for (cell, label) in block.cells().zip(labels) {
            for face in local_faces(block.kind) {
                let nodes: Vec<u32> = face.iter().map(|&at| cell[at]).collect();
                let mut key = [u32::MAX; 4];
                key[..nodes.len()].copy_from_slice(&nodes);
                key.sort_unstable();
                faces.push((key, nodes, label));
            }
        }
    }
    faces.sort_unstable();
    let mut found = Patches { points: mesh.points.clone(), ..Patches::default() };
    for same in faces.chunk_by(|a, b| a.0 == b.0) {
        let other = if same.len() == 1 { OUTSIDE_LABEL } else { same[same.len() - 1].2 };
        let (nodes, label) = (&same[0].1, same[0].2);
        if label != other {
            for k in 2..nodes.len() {
                found.triangles.push([nodes[0], nodes[k - 1], nodes[k]]);
                found.sides.push(sorted([label, other]));
            }
        }
    }
    found
}

/// Returns true for each cell of a component with at least the part `smallest` of the cells of the largest
/// one. Also counts the smaller components.
pub(crate) fn in_large_components(kind: CellKind, cells: &[u32], smallest: f64) -> (Vec<bool>, usize) {
    let components = Components::new(kind, cells, &sorted_faces(kind, cells));
    let kept = components.large(smallest);
    let smaller = components.count - kept.iter().filter(|&&kept| kept).count();
    (components.root.iter().map(|&root| kept[root as usize]).collect(), smaller)
}

/// A mesh of the cells, its points numbered without gaps.
fn compact(kind: CellKind, mut nodes: Vec<u32>, position: impl Fn(u32) -> Vector3 + Sync + Send) -> Mesh {
    let last = nodes.iter().max().map_or(0, |&node| node as usize + 1);
    let mut number = vec![0_u32; last];
    for &node in &nodes {
        number[node as usize] = 1;
    }
    let used: Vec<u32> = (0..last as u32).filter(|&node| number[node as usize] == 1).collect();
    for (new, &old) in used.iter().enumerate() {
        number[old as usize] = new as u32;
    }
    for node in &mut nodes {
        *node = number[*node as usize];
    }
    Mesh {
        points: used.into_par_iter().map(position).collect(),
        blocks: vec![CellBlock::new(kind, nodes)],
        ..Mesh::default()
    }
}

fn local_faces(kind: CellKind) -> &'static [&'static [usize]] {
    if kind == CellKind::Hex { &HEX_FACES } else { &TET_FACES }
}

/// One number per face of each cell, sorted so that the faces shared by cells follow each other. Its high
/// bits are the three smallest nodes (in a lattice they identify a quad too), its low bits cell × faces +
/// local face.
fn sorted_faces(kind: CellKind, cells: &[u32]) -> Vec<u128> {
    let local = local_faces(kind);
    let n = kind.node_count();
    let mut faces: Vec<u128> = (0..cells.len() / n * local.len())
        .into_par_iter()
        .map(|at| {
            let cell = &cells[at / local.len() * n..][..n];
            let mut key = [u32::MAX; 4];
            for (slot, &node) in key.iter_mut().zip(local[at % local.len()]) {
                *slot = cell[node];
            }
            key.sort_unstable();
            (u128::from(key[0]) << 96) | (u128::from(key[1]) << 64) | (u128::from(key[2]) << 32) | at as u128
        })
        .collect();
    faces.par_sort_unstable();
    faces
}

/// The records of each face, shared ones together.
fn shared(faces: &[u128]) -> impl Iterator<Item = &[u128]> {
    faces.chunk_by(|a, b| a >> 32 == b >> 32)
}

/// Cells joined through faces.
struct Components {
    /// Lowest cell of the component, per cell.
    root: Vec<u32>,
    /// Number of components.
    count: usize,
}

impl Components {
    fn new(kind: CellKind, cells: &[u32], faces: &[u128]) -> Self {
        let per_cell = local_faces(kind).len();
        let mut root: Vec<u32> = (0..(cells.len() / kind.node_count()) as u32).collect();
        for face in shared(faces) {
            for pair in face.windows(2) {
                let [a, b] =
                    [pair[0], pair[1]].map(|record| find(&mut root, (record as u32) / per_cell as u32));
                root[a.max(b) as usize] = a.min(b);
            }
        }
        for cell in 0..root.len() as u32 {
            root[cell as usize] = find(&mut root, cell);
        }
        let count = root.iter().enumerate().filter(|&(cell, &root)| cell == root as usize).count();
        Self { root, count }
    }

    /// Returns true for each root of a large component. This is the component with the most cells (the lowest
    /// of equals), or one with at least the part `smallest` of its cells.
    fn large(&self, smallest: f64) -> Vec<bool> {
        let mut size = vec![0_u32; self.root.len()];
        for &root in &self.root {
            size[root as usize] += 1;
        }
        let largest = (0..size.len()).rev().max_by_key(|&root| size[root]).unwrap_or(0);
        let least = smallest * f64::from(size.get(largest).copied().unwrap_or(0));
        (0..size.len())
            .map(|root| root == largest || size[root] > 0 && f64::from(size[root]) >= least)
            .collect()
    }
}

fn find(root: &mut [u32], mut cell: u32) -> u32 {
    while root[cell as usize] != cell {
        root[cell as usize] = root[root[cell as usize] as usize];
        cell = root[cell as usize];
    }
    cell
}

/// Boundary edges of the kept cells with a number of boundary faces other than two.
fn non_manifold_edges(kind: CellKind, cells: &[u32], faces: &[u128], kept: impl Fn(usize) -> bool) -> usize {
    let local = local_faces(kind);
    let n = kind.node_count();
    let mut edges = Vec::new();
    for face in shared(faces).filter(|records| records.len() == 1) {
        let at = face[0] as u32 as usize;
        let (cell, nodes) = (at / local.len(), local[at % local.len()]);
        if kept(cell) {
            for (i, &a) in nodes.iter().enumerate() {
                let b = nodes[(i + 1) % nodes.len()];
                let [a, b] = [a, b].map(|node| u64::from(cells[cell * n + node]));
                edges.push(a.min(b) << 32 | a.max(b));
            }
        }
    }
    edges.sort_unstable();
    edges.chunk_by(|a, b| a == b).filter(|same| same.len() != 2).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at_index(node: u32) -> Vector3 {
        Vector3::repeat(f64::from(node))
    }

    #[test]
    fn the_largest_component_is_kept_and_its_points_renumbered() {
        // Cell 0 alone; cells 1 and 2 share the face (20, 21, 22).
        let cells = [1, 2, 3, 4, 20, 21, 22, 23, 20, 22, 21, 24];
        let kept = largest_component(CellKind::Tet, &cells, at_index);
        assert_eq!((kept.dropped_components, kept.dropped_cells, kept.non_manifold_edges), (1, 1, 0));
        assert_eq!(kept.mesh.blocks[0].nodes, [0, 1, 2, 3, 0, 2, 1, 4]);
        assert_eq!(kept.mesh.points, [20, 21, 22, 23, 24].map(at_index));
    }

    #[test]
    fn of_equal_components_the_first_is_kept() {
        let kept = largest_component(CellKind::Tet, &[4, 5, 6, 7, 0, 1, 2, 3], at_index);
        assert_eq!(kept.mesh.points, [4, 5, 6, 7].map(at_index));
    }

    #[test]
    fn an_edge_that_four_boundary_faces_share_is_not_manifold() {
        // The first and the last tet share only the edge (0, 1); the two between join them through faces.
        let cells = [0, 1, 2, 3, 0, 2, 3, 4, 0, 3, 4, 5, 0, 1, 4, 5];
        let kept = largest_component(CellKind::Tet, &cells, at_index);
        assert_eq!((kept.dropped_components, kept.non_manifold_edges), (0, 1));
        let joined = largest_component(CellKind::Tet, &cells[..12], at_index);
        assert_eq!((joined.dropped_components, joined.non_manifold_edges), (0, 0));
    }
}
