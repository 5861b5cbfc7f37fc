//! The boundary of a body: the faces that belong to one cell only, turned outwards. Leaves out: data and
//! sets, which stay with the body's mesh and are reached through the parent cell or node.

use crate::cell::{CellId, body_blocks, faces};
use crate::quality::vector_area;
use crate::{CellBlock, CellKind, Mesh, Vector3};

/// One face of a boundary.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Face {
    /// `Triangle` or `Quad`.
    pub kind: CellKind,
    /// The cell that it bounds.
    pub parent: CellId,
    /// Its nodes, counter-clockwise seen from outside; of a triangle the last repeats the first.
    corners: [u32; 4],
}

impl Face {
    /// Its nodes, three or four, counter-clockwise seen from outside.
    pub fn nodes(&self) -> &[u32] {
        &self.corners[..self.kind.node_count()]
    }

    /// Area times outward unit normal [m²]; of a quad that is not planar, the integral of its normal.
    pub fn vector_area(&self, points: &[Vector3]) -> Vector3 {
        let corners = self.corners.map(|node| points[node as usize]);
        vector_area(&corners[..self.kind.node_count()])
    }

    /// Area [m²].
    pub fn area(&self, points: &[Vector3]) -> f64 {
        self.vector_area(points).norm()
    }

    /// Outward unit normal; zero if the face has no area.
    pub fn normal(&self, points: &[Vector3]) -> Vector3 {
        self.vector_area(points).try_normalize(0.0).unwrap_or_default()
    }

    /// Mean of its nodes [m].
    pub fn centre(&self, points: &[Vector3]) -> Vector3 {
        self.nodes().iter().map(|&n| points[n as usize]).sum::<Vector3>() / self.nodes().len() as f64
    }

    /// From the nodes around it, without repeated neighbours (a side of a hex may be collapsed); `None`
    /// if fewer than three differ.
    fn new(parent: CellId, around: impl Iterator<Item = u32>) -> Option<Self> {
        let mut corners = [0; 4];
        let mut count = 0;
        for node in around {
            if !corners[..count].contains(&node) {
                corners[count] = node;
                count += 1;
            }
        }
        let kind = match count {
            3 => CellKind::Triangle,
            4 => CellKind::Quad,
            _ => return None,
        };
        if count == 3 {
            corners[3] = corners[0];
        }
        Some(Self { kind, parent, corners })
    }

    /// Key of the face, equal for all faces of the same nodes.
    fn key(&self) -> [u32; 4] {
        face_key(self.nodes())
    }
}

/// Sorted nodes of a face of three or four nodes, filled up: equal for faces of the same nodes.
pub(crate) fn face_key(nodes: &[u32]) -> [u32; 4] {
    let mut key = [u32::MAX; 4];
    key[..nodes.len()].copy_from_slice(nodes);
    key.sort_unstable();
    key
}

/// The faces of all volume cells in groups of the same nodes; within a group by cell. Cells that name a node
/// beyond the points are left out.
pub(crate) struct FaceGroups(Vec<([u32; 4], Face)>);

impl FaceGroups {
    pub(crate) fn new(mesh: &Mesh) -> Self {
        let mut keyed = Vec::new();
        for block in mesh.volume_blocks() {
            for (parent, nodes) in valid_cells(mesh, block) {
                let faces = faces(block.kind).iter();
                let faces = faces.filter_map(|face| Face::new(parent, face.iter().map(|&a| nodes[a])));
                keyed.extend(faces.map(|face| (face.key(), face)));
            }
        }
        keyed.sort_unstable_by_key(|(key, face)| (*key, face.parent, face.corners));
        Self(keyed)
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &[([u32; 4], Face)]> {
        self.0.chunk_by(|a, b| a.0 == b.0)
    }
}

/// The cells of a block whose nodes all exist.
pub(crate) fn valid_cells<'m>(
    mesh: &'m Mesh,
    block: &'m CellBlock,
) -> impl Iterator<Item = (CellId, &'m [u32])> {
    let cells = block.cells().enumerate();
    cells
        .filter(|(_, nodes)| nodes.iter().all(|&n| (n as usize) < mesh.points.len()))
        .map(|(index, nodes)| (CellId { kind: block.kind, index: index as u32 }, nodes))
}

/// The boundary of a mesh. Faces follow the order of their cells, tets before hexes, so the same mesh always
/// gives the same order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Surface {
    /// Its faces.
    pub faces: Vec<Face>,
}

/// The boundary of the volume cells of `mesh`: faces of one cell only. A mesh without volume cells is its
/// own surface: its triangles and quads are the faces, with their orientation in the mesh.
pub fn boundary(mesh: &Mesh) -> Surface {
    let mut faces: Vec<Face> = if mesh.volume_blocks().any(|block| !block.is_empty()) {
        let groups = FaceGroups::new(mesh);
        groups.iter().filter_map(|group| if let [(_, face)] = group { Some(*face) } else { None }).collect()
    } else {
        let blocks = mesh.blocks.iter().filter(|block| block.kind.dimension() == 2);
        let cells = blocks.flat_map(|block| valid_cells(mesh, block));
        cells.filter_map(|(parent, nodes)| Face::new(parent, nodes.iter().copied())).collect()
    };
    faces.sort_unstable_by_key(|face| (face.parent, face.corners));
    Surface { faces }
}

/// The faces between volume cells of different kinds, each once as a face of one cell, with the other one.
pub fn borders<K: PartialEq>(mesh: &Mesh, kind: impl Fn(CellId) -> K) -> Vec<(Face, CellId)> {
    let groups = FaceGroups::new(mesh);
    let pairs = groups.iter().filter_map(|group| match group {
        [(_, face), (_, other)] => Some((*face, other.parent)),
        _ => None,
    });
    pairs.filter(|(face, other)| kind(face.parent) != kind(*other)).collect()
}

impl Surface {
    /// Its nodes, increasing, each once.
    pub fn nodes(&self) -> Vec<u32> {
        let mut nodes: Vec<u32> = self.faces.iter().flat_map(|face| face.nodes()).copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// Its faces as triangles, quads cut in two, in the order of the faces.
    pub fn triangles(&self) -> Vec<[u32; 3]> {
        let halves = |face: &Face| {
            let [a, b, c, d] = face.corners;
            let second = (face.kind == CellKind::Quad).then_some([a, c, d]);
            std::iter::once([a, b, c]).chain(second)
        };
        self.faces.iter().flat_map(halves).collect()
    }

    /// Total area [m²].
    pub fn area(&self, points: &[Vector3]) -> f64 {
        self.faces.iter().map(|face| face.area(points)).sum()
    }

    /// Outward unit normals, one per point of the mesh. Each is the mean of the normals of the faces around
    /// the point, weighted by area. It is zero at points that are not on the surface.
    pub(crate) fn node_normals(&self, points: &[Vector3]) -> Vec<Vector3> {
        let mut normals = vec![Vector3::zeros(); points.len()];
        for face in &self.faces {
            let area = face.vector_area(points);
            for &node in face.nodes() {
                normals[node as usize] += area;
            }
        }
        normals.into_iter().map(|normal| normal.try_normalize(0.0).unwrap_or_default()).collect()
    }

    /// Returns the surface as a separate mesh, with triangles and quads in the order of the faces. Also
    /// returns the original index in `points` of each of its points.
    pub fn to_mesh(&self, points: &[Vector3]) -> (Mesh, Vec<u32>) {
        let parents = self.nodes();
        let mut numbers = vec![0; points.len()];
        for (at, &parent) in parents.iter().enumerate() {
            numbers[parent as usize] = at as u32;
        }
        let points = parents.iter().map(|&parent| points[parent as usize]).collect();
        let mut mesh = Mesh { points, ..Mesh::default() };
        for face in &self.faces {
            mesh.block_mut(face.kind).nodes.extend(face.nodes().iter().map(|&node| numbers[node as usize]));
        }
        mesh.blocks.sort_by_key(|block| block.kind);
        (mesh, parents)
    }
}

/// The labels (cell data `label`, rounded) of the body's cells, increasing, each once. The body is made of
/// the cells of the highest dimension in the mesh.
pub fn labels(mesh: &Mesh) -> Vec<i32> {
    let blocks = body_blocks(mesh).into_iter().filter_map(|block| block.data.get("label"));
    let mut labels: Vec<i32> =
        blocks.flat_map(|data| (0..data.len()).map(|at| label_number(data.item(at)))).collect();
    labels.sort_unstable();
    labels.dedup();
    labels
}

/// Nodes of the body's cells of one label, increasing, each once.
pub(crate) fn label_nodes(mesh: &Mesh, label: i32) -> Vec<u32> {
    let mut nodes = Vec::new();
    for block in body_blocks(mesh) {
        let cells = valid_cells(mesh, block);
        let cells = cells.filter(|(cell, _)| cell_label(block, cell.index) == Some(label));
        nodes.extend(cells.flat_map(|(_, nodes)| nodes));
    }
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}

/// Nodes shared by cells of two different labels, increasing, each once: the interface of two regions.
pub(crate) fn label_boundary(mesh: &Mesh, labels: [i32; 2]) -> Vec<u32> {
    let [mut nodes, others] = labels.map(|label| label_nodes(mesh, label));
    nodes.retain(|node| others.binary_search(node).is_ok());
    nodes
}

/// The label of a cell (cell data `label`, rounded), if its block has labels.
pub fn cell_label(block: &CellBlock, index: u32) -> Option<i32> {
    let data = block.data.get("label")?;
    let at = index as usize;
    (at < data.len()).then(|| label_number(data.item(at)))
}

fn label_number(item: &[f64]) -> i32 {
    item[0].round() as i32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::DataArray;
    use crate::testing::{UNIT_CUBE, block_of_hexes, block_of_tets, points};

    #[test]
    fn borders_are_the_faces_between_kinds() {
        let mesh = block_of_hexes([3, 2, 2]);
        let between = borders(&mesh, |cell| cell.index % 3 == 0);
        assert_eq!(between.len(), 4);
        assert!(between.iter().all(|(face, other)| {
            [face.parent, *other].map(|cell| cell.index % 3 == 0) == [true, false]
                && (face.area(&mesh.points) - 1.0).abs() < 1e-12
        }));
        assert!(borders(&mesh, |_| 0).is_empty());
    }

    #[test]
    fn boundary_of_a_block_is_closed_and_points_outwards() {
        for (mesh, faces) in [(block_of_hexes([3, 2, 2]), 32), (block_of_tets([3, 2, 2]), 64)] {
            let surface = boundary(&mesh);
            assert_eq!(surface.faces.len(), faces);
            assert!((surface.area(&mesh.points) - 32.0).abs() < 1e-12);
            // Divergence theorem: ∮ x · n dA = 3 V.
            let flux: f64 = surface
                .faces
                .iter()
                .map(|face| face.centre(&mesh.points).dot(&face.vector_area(&mesh.points)))
                .sum();
            assert!((flux - 36.0).abs() < 1e-12);
            for face in &surface.faces {
                let block = mesh.block(face.parent.kind).unwrap();
                let parent = block.cell(face.parent.index as usize);
                assert!(face.nodes().iter().all(|node| parent.contains(node)));
            }
            assert!(surface.faces.is_sorted_by_key(|face| face.parent));
        }
    }

    #[test]
    fn node_normals_point_along_the_diagonal_at_a_corner() {
        let mesh = block_of_hexes([2, 2, 2]);
        let normals = boundary(&mesh).node_normals(&mesh.points);
        assert!((normals[0] + Vector3::repeat(1.0 / 3f64.sqrt())).norm() < 1e-15);
        assert_eq!(normals[13], Vector3::zeros(), "the node inside");
    }

    #[test]
    fn order_of_blocks_does_not_matter() {
        let mut mesh = block_of_hexes([1, 1, 1]);
        mesh.points.push(Vector3::new(0.5, 0.5, 3.0));
        mesh.block_mut(CellKind::Tet).nodes.extend([4, 5, 6, 8, 4, 6, 7, 8]);
        let first = boundary(&mesh);
        mesh.blocks.reverse();
        assert_eq!(first, boundary(&mesh));
        assert_eq!(first.faces.iter().filter(|face| face.parent.kind == CellKind::Hex).count(), 6);
    }

    #[test]
    fn collapsed_hex_meets_its_neighbour_face_to_face() {
        // A wedge, written as a hex with its edges 2-3 and 6-7 collapsed, beside a tet on its triangle 0,
        // 1, 2.
        let mut mesh = Mesh { points: points(&UNIT_CUBE), ..Mesh::default() };
        mesh.points.push(Vector3::new(0.5, 0.5, -1.0));
        mesh.block_mut(CellKind::Hex).nodes = vec![0, 1, 2, 2, 4, 5, 6, 6];
        mesh.block_mut(CellKind::Tet).nodes.extend([0, 2, 1, 8]);
        let surface = boundary(&mesh);
        let quads = surface.faces.iter().filter(|face| face.kind == CellKind::Quad).count();
        assert_eq!((quads, surface.faces.len()), (3, 7));
    }

    #[test]
    fn surface_becomes_a_mesh_of_its_own() {
        let mesh = block_of_hexes([2, 2, 2]);
        let surface = boundary(&mesh);
        let (surface_mesh, parents) = surface.to_mesh(&mesh.points);
        assert_eq!(surface_mesh.points.len(), 26);
        assert!(!parents.contains(&13));
        for (point, &parent) in surface_mesh.points.iter().zip(&parents) {
            assert_eq!(*point, mesh.points[parent as usize]);
        }
        let again = boundary(&surface_mesh);
        assert_eq!(again.area(&surface_mesh.points), surface.area(&mesh.points));
    }

    #[test]
    fn labels_share_the_nodes_between_them() {
        let mut mesh = block_of_hexes([3, 1, 1]);
        mesh.blocks[0].data.insert("label".into(), DataArray::scalar(vec![1.0, 2.0, 5.0]));
        assert_eq!(labels(&mesh), [1, 2, 5]);
        assert_eq!(label_boundary(&mesh, [1, 2]), [1, 5, 9, 13]);
        assert!(label_boundary(&mesh, [1, 5]).is_empty());
        assert_eq!(label_nodes(&mesh, 5).len(), 8);
    }

    #[test]
    fn mesh_without_cells_has_no_boundary() {
        assert_eq!(boundary(&Mesh::default()), Surface::default());
    }
}
