//! Everything that is wrong with a mesh, by cell and node, and the repair of cells that are only numbered
//! the wrong way round. Leaves out: intersections of cells that share no node, and self-intersection.

use std::fmt;

use rstar::RTree;
use rstar::primitives::GeomWithData;

use crate::cell::{CellId, corners, diagonal, edges, is_finite, nodes_differ};
use crate::disjoint_sets::DisjointSets;
use crate::quality::{scaled_jacobian, volume};
use crate::surface::{FaceGroups, boundary, valid_cells};
use crate::{CellKind, Mesh, Vector3};

/// Nodes closer than this part of the bounding box's diagonal coincide.
const COINCIDENT: f64 = 1e-9;
/// A cell is degenerate if its volume is less than this part of the cube of its longest edge (area: square).
const FLAT: f64 = 1e-12;

/// A face that belongs to more than two cells.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CrowdedFace {
    /// Its three or four nodes, increasing.
    pub nodes: Vec<u32>,
    /// The cells that share it.
    pub cells: Vec<CellId>,
}

/// The defects of a mesh. Indices are counted from 0, lists are complete and in increasing order.
///
/// A cell appears in at most one list of cells: without valid nodes its volume isn't computed, and a
/// degenerate cell isn't also inverted.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Diagnosis {
    /// The mesh has no cells at all.
    pub no_cells: bool,
    /// Kinds whose list of nodes is not a multiple of the nodes of one cell.
    pub incomplete_blocks: Vec<CellKind>,
    /// Nodes with a coordinate that is infinite or not a number.
    pub non_finite_nodes: Vec<u32>,
    /// Cells that name a node beyond the last point.
    pub out_of_range_cells: Vec<CellId>,
    /// Tets of negative volume, hexes turned inside out or flat at a corner.
    pub inverted_cells: Vec<CellId>,
    /// Cells that name a node twice, or whose volume is below 1e-12 of the cube of their longest edge (area:
    /// the square).
    pub degenerate_cells: Vec<CellId>,
    /// Pairs of cells with the same nodes: the first one and its duplicate.
    pub duplicate_cells: Vec<[CellId; 2]>,
    /// Nodes that no cell uses; in a mesh with volume cells, nodes that no volume cell uses.
    pub unused_nodes: Vec<u32>,
    /// Pairs of nodes closer than 1e-9 of the bounding box's diagonal: the first one and its duplicate.
    pub duplicate_nodes: Vec<[u32; 2]>,
    /// Faces that belong to more than two volume cells.
    pub crowded_faces: Vec<CrowdedFace>,
    /// Edges of more than two boundary faces; without volume cells, of more than two triangles or quads.
    pub non_manifold_edges: Vec<[u32; 2]>,
    /// Without volume cells: edges of one triangle or quad only, the rim of the surface.
    pub open_edges: Vec<[u32; 2]>,
    /// Without volume cells: edges whose two faces are turned to opposite sides.
    pub inconsistent_edges: Vec<[u32; 2]>,
    /// Number of parts that are connected by faces of volume cells; without volume cells, by edges of
    /// triangles and quads; 0 without either.
    pub components: usize,
}

/// Looks for everything in [`Diagnosis`]; n log n in the number of cells and nodes.
pub fn diagnose(mesh: &Mesh) -> Diagnosis {
    let mut found = Diagnosis { no_cells: mesh.blocks.iter().all(|b| b.is_empty()), ..Diagnosis::default() };
    inspect_nodes(mesh, &mut found);
    inspect_cells(mesh, &mut found);
    inspect_duplicate_cells(mesh, &mut found);
    if mesh.volume_blocks().any(|block| !block.is_empty()) {
        inspect_volume(mesh, &mut found);
    } else {
        inspect_surface(mesh, &mut found);
    }
    found
}

/// Renumbers inverted tets (two nodes swapped) and hexes (bottom and top swapped) if that makes them
/// valid; returns the number of repaired cells. Other cells do not change.
pub fn reorder(mesh: &mut Mesh) -> usize {
    let mut repaired = 0;
    for block in mesh.blocks.iter_mut().filter(|block| block.kind.dimension() == 3) {
        let kind = block.kind;
        for nodes in block.nodes.chunks_exact_mut(kind.node_count()) {
            if fault_of(kind, nodes, &mesh.points) == Some(CellFault::Inverted) {
                let before: Vec<u32> = nodes.to_vec();
                match kind {
                    CellKind::Tet => nodes.swap(1, 2),
                    _ => nodes.rotate_left(4),
                }
                if fault_of(kind, nodes, &mesh.points).is_none() {
                    repaired += 1;
                } else {
                    nodes.copy_from_slice(&before);
                }
            }
        }
    }
    repaired
}

#[derive(Clone, Copy, PartialEq)]
enum CellFault {
    OutOfRange,
    NonFinite,
    Degenerate,
    Inverted,
}

/// The first fault of a cell.
fn fault_of(kind: CellKind, nodes: &[u32], points: &[Vector3]) -> Option<CellFault> {
    if nodes.iter().any(|&node| node as usize >= points.len()) {
        return Some(CellFault::OutOfRange);
    }
    let mut buffer = [Vector3::zeros(); 8];
    let Some(x) = corners(points, nodes, &mut buffer) else { return Some(CellFault::NonFinite) };
    let longest = edges(kind).iter().map(|&[a, b]| (x[b] - x[a]).norm()).fold(0.0, f64::max);
    let volume = volume(kind, x);
    let flat = match kind.dimension() {
        0 => false,
        dimension => volume.abs() <= FLAT * longest.powi(dimension as i32),
    };
    if flat || !nodes_differ(nodes) {
        return Some(CellFault::Degenerate);
    }
    let inverted = match <&[Vector3; 8]>::try_from(x) {
        Ok(hex) => scaled_jacobian(hex) <= 0.0,
        Err(_) => volume < 0.0,
    };
    inverted.then_some(CellFault::Inverted)
}

fn inspect_nodes(mesh: &Mesh, found: &mut Diagnosis) {
    for (node, (point, used)) in (0u32..).zip(mesh.points.iter().zip(mesh.used_points())) {
        if !is_finite(point) {
            found.non_finite_nodes.push(node);
        }
        if !used {
            found.unused_nodes.push(node);
        }
    }
    found.duplicate_nodes = duplicate_nodes(&mesh.points);
}

/// Each node that coincides with an earlier one, with that one.
fn duplicate_nodes(points: &[Vector3]) -> Vec<[u32; 2]> {
    let reach = COINCIDENT * diagonal(points);
    let finite = (0u32..).zip(points).filter(|(_, p)| is_finite(p));
    let tree = RTree::bulk_load(finite.map(|(node, p)| GeomWithData::new([p.x, p.y, p.z], node)).collect());
    let mut repeats = vec![false; points.len()];
    let mut pairs = Vec::new();
    for (node, p) in (0u32..).zip(points).filter(|(_, p)| is_finite(p)) {
        // Duplicates of a node are skipped: with all nodes at one position they would give n² pairs.
        if !repeats[node as usize] {
            for near in tree.locate_within_distance([p.x, p.y, p.z], reach * reach) {
                if near.data > node && !repeats[near.data as usize] {
                    repeats[near.data as usize] = true;
                    pairs.push([node, near.data]);
                }
            }
        }
    }
    pairs.sort_unstable();
    pairs
}

fn inspect_cells(mesh: &Mesh, found: &mut Diagnosis) {
    for block in &mesh.blocks {
        let kind = block.kind;
        if !block.nodes.len().is_multiple_of(kind.node_count()) {
            found.incomplete_blocks.push(kind);
        }
        for (index, nodes) in (0u32..).zip(block.cells()) {
            let cell = CellId { kind, index };
            match fault_of(kind, nodes, &mesh.points) {
                Some(CellFault::OutOfRange) => found.out_of_range_cells.push(cell),
                Some(CellFault::Degenerate) => found.degenerate_cells.push(cell),
                Some(CellFault::Inverted) => found.inverted_cells.push(cell),
                Some(CellFault::NonFinite) | None => {}
            }
        }
    }
    for cells in [&mut found.out_of_range_cells, &mut found.degenerate_cells, &mut found.inverted_cells] {
        cells.sort_unstable();
    }
}

fn inspect_duplicate_cells(mesh: &Mesh, found: &mut Diagnosis) {
    for block in &mesh.blocks {
        let mut cells: Vec<([u32; 8], CellId)> = (0u32..)
            .zip(block.cells())
            .map(|(index, nodes)| {
                let mut key = [u32::MAX; 8];
                key[..nodes.len()].copy_from_slice(nodes);
                key.sort_unstable();
                (key, CellId { kind: block.kind, index })
            })
            .collect();
        cells.sort_unstable();
        for group in cells.chunk_by(|a, b| a.0 == b.0) {
            let (_, first) = group[0];
            found.duplicate_cells.extend(group[1..].iter().map(|&(_, repeat)| [first, repeat]));
        }
    }
    found.duplicate_cells.sort_unstable();
}

fn inspect_volume(mesh: &Mesh, found: &mut Diagnosis) {
    let groups = FaceGroups::new(mesh);
    let mut cells: Vec<CellId> =
        mesh.volume_blocks().flat_map(|block| valid_cells(mesh, block)).map(|(cell, _)| cell).collect();
    cells.sort_unstable();
    let place = |cell: CellId| cells.partition_point(|&other| other < cell);
    let mut parts = DisjointSets::new(cells.len());
    for group in groups.iter() {
        for pair in group.windows(2) {
            parts.join(place(pair[0].1.parent), place(pair[1].1.parent));
        }
        if group.len() > 2 {
            let mut nodes = group[0].1.nodes().to_vec();
            nodes.sort_unstable();
            let cells = group.iter().map(|(_, face)| face.parent).collect();
            found.crowded_faces.push(CrowdedFace { nodes, cells });
        }
    }
    found.components = parts.count();
    let surface = boundary(mesh);
    let uses = EdgeUses::new(surface.faces.iter().map(|face| face.nodes()));
    found.non_manifold_edges = uses.edges_where(|uses| uses.len() > 2);
}

fn inspect_surface(mesh: &Mesh, found: &mut Diagnosis) {
    let surface = boundary(mesh);
    let uses = EdgeUses::new(surface.faces.iter().map(|face| face.nodes()));
    found.open_edges = uses.edges_where(|uses| uses.len() == 1);
    found.non_manifold_edges = uses.edges_where(|uses| uses.len() > 2);
    found.inconsistent_edges = uses.edges_where(|uses| uses.len() == 2 && uses[0].forward == uses[1].forward);
    let mut parts = DisjointSets::new(surface.faces.len());
    for group in uses.iter() {
        for pair in group.windows(2) {
            parts.join(pair[0].face, pair[1].face);
        }
    }
    found.components = parts.count();
}

/// A face passing along an edge.
struct EdgeUse {
    nodes: [u32; 2],
    face: usize,
    /// From the smaller node to the larger one.
    forward: bool,
}

/// The edges of faces in groups of the same nodes.
struct EdgeUses(Vec<EdgeUse>);

impl EdgeUses {
    fn new<'n>(faces: impl Iterator<Item = &'n [u32]>) -> Self {
        let mut uses = Vec::new();
        for (face, nodes) in faces.enumerate() {
            for (at, &a) in nodes.iter().enumerate() {
                let b = nodes[(at + 1) % nodes.len()];
                uses.push(EdgeUse { nodes: [a.min(b), a.max(b)], face, forward: a < b });
            }
        }
        uses.sort_unstable_by_key(|used| (used.nodes, used.face));
        Self(uses)
    }

    fn iter(&self) -> impl Iterator<Item = &[EdgeUse]> {
        self.0.chunk_by(|a, b| a.nodes == b.nodes)
    }

    fn edges_where(&self, wanted: impl Fn(&[EdgeUse]) -> bool) -> Vec<[u32; 2]> {
        self.iter().filter(|group| wanted(group)).map(|group| group[0].nodes).collect()
    }
}

impl Diagnosis {
    /// True if nothing is wrong. Open edges and several parts are often meant: they don't count.
    pub fn is_clean(&self) -> bool {
        let meant =
            Self { open_edges: self.open_edges.clone(), components: self.components, ..Self::default() };
        *self == meant
    }

    /// True if a simulation can use every cell: cells exist, none is inverted or degenerate, and all their
    /// nodes exist and are finite. Other defects may still be mistakes.
    pub fn is_usable(&self) -> bool {
        !self.no_cells
            && self.incomplete_blocks.is_empty()
            && self.non_finite_nodes.is_empty()
            && self.out_of_range_cells.is_empty()
            && self.inverted_cells.is_empty()
            && self.degenerate_cells.is_empty()
    }
}

impl fmt::Display for Diagnosis {
    /// One line for each kind of fault that was found, with its number and the first ten.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let edge = |[a, b]: &[u32; 2]| format!("{a}–{b}");
        let crowded = |face: &CrowdedFace| format!("{:?} of {} cells", face.nodes, face.cells.len());
        let mut lines = Vec::new();
        if self.no_cells {
            lines.push("no cells".to_owned());
        }
        lines.extend([
            line("blocks with an incomplete last cell", &self.incomplete_blocks, |kind| kind.name().into()),
            line("nodes that are not finite", &self.non_finite_nodes, u32::to_string),
            line("cells with nodes that don't exist", &self.out_of_range_cells, CellId::to_string),
            line("inverted cells", &self.inverted_cells, CellId::to_string),
            line("degenerate cells", &self.degenerate_cells, CellId::to_string),
            line("duplicate cells", &self.duplicate_cells, |[a, b]| format!("{b} = {a}")),
            line("unused nodes", &self.unused_nodes, u32::to_string),
            line("duplicate nodes", &self.duplicate_nodes, |[a, b]| format!("{b} = {a}")),
            line("faces of more than two cells", &self.crowded_faces, crowded),
            line("non-manifold edges", &self.non_manifold_edges, edge),
            line("open edges", &self.open_edges, edge),
            line("edges between faces of opposite orientation", &self.inconsistent_edges, edge),
        ]);
        if self.components > 1 {
            lines.push(format!("{} separate parts", self.components));
        }
        lines.retain(|line| !line.is_empty());
        if lines.is_empty() { f.write_str("no faults found") } else { f.write_str(&lines.join("\n")) }
    }
}

/// `title: total (first, second, … and n more)`; empty without items.
fn line<T>(title: &str, items: &[T], name: impl Fn(&T) -> String) -> String {
    const SHOWN: usize = 10;
    if items.is_empty() {
        return String::new();
    }
    let shown: Vec<String> = items.iter().take(SHOWN).map(name).collect();
    let more = match items.len().saturating_sub(SHOWN) {
        0 => String::new(),
        more => format!(", … and {more} more"),
    };
    format!("{title}: {} ({}{more})", items.len(), shown.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::DataArray;
    use pliant_testing::Random;

    use crate::testing::{UNIT_CUBE, block_of_hexes, block_of_tets, noise, points};

    const TET: CellKind = CellKind::Tet;

    fn cell(kind: CellKind, index: u32) -> CellId {
        CellId { kind, index }
    }

    fn single(kind: CellKind, points: Vec<Vector3>, nodes: &[u32]) -> Mesh {
        let mut mesh = Mesh { points, ..Mesh::default() };
        mesh.block_mut(kind).nodes.extend(nodes);
        mesh
    }

    #[test]
    fn good_meshes_are_clean() {
        for mesh in [block_of_hexes([3, 2, 2]), block_of_tets([3, 2, 2])] {
            let found = diagnose(&mesh);
            assert!(found.is_clean() && found.is_usable(), "{found}");
            assert_eq!(found.components, 1);
            assert_eq!(found.to_string(), "no faults found");
        }
    }

    #[test]
    fn closed_surface_is_clean_and_an_open_one_has_a_rim() {
        let block = block_of_tets([2, 2, 2]);
        let (mut mesh, _) = boundary(&block).to_mesh(&block.points);
        let found = diagnose(&mesh);
        assert!(found.is_clean() && found.open_edges.is_empty(), "{found}");
        mesh.blocks[0].nodes.drain(..3);
        assert_eq!(diagnose(&mesh).open_edges.len(), 3);
        mesh.blocks[0].nodes.swap(0, 1);
        assert!(!diagnose(&mesh).inconsistent_edges.is_empty());
    }

    #[test]
    fn every_single_fault_is_found() {
        let mut mesh = block_of_tets([1, 1, 1]);
        mesh.points.extend(points(&[[0.5, 0.5, 0.5], [0.5, 0.5, 0.5]]));
        mesh.points.push(Vector3::new(f64::NAN, 0.0, 0.0));
        mesh.block_mut(TET).nodes.swap(0, 1);
        // Tets 6 to 9: flat, a node twice, a node beyond, tet 1 again.
        mesh.block_mut(TET).nodes.extend([0, 1, 2, 3, 0, 1, 2, 2, 0, 1, 2, 77]);
        let again = mesh.blocks[0].cell(1).to_vec();
        mesh.block_mut(TET).nodes.extend(again);
        let found = diagnose(&mesh);
        assert_eq!(found.inverted_cells, [cell(TET, 0)]);
        assert_eq!(found.degenerate_cells, [cell(TET, 6), cell(TET, 7)]);
        assert_eq!(found.out_of_range_cells, [cell(TET, 8)]);
        assert_eq!(found.duplicate_cells, [[cell(TET, 1), cell(TET, 9)]]);
        assert_eq!(found.unused_nodes, [8, 9, 10]);
        assert_eq!(found.duplicate_nodes, [[8, 9]]);
        assert_eq!(found.non_finite_nodes, [10]);
        assert!(!found.crowded_faces.is_empty());
        assert!(!found.is_clean() && !found.is_usable());
        assert!(found.to_string().contains("inverted cells: 1 (tet 0)"), "{found}");
    }

    #[test]
    fn a_node_of_surface_cells_only_is_unused_in_a_mesh_with_volume_cells() {
        let mut mesh = block_of_tets([1, 1, 1]);
        mesh.points.push(Vector3::new(2.0, 0.0, 0.0));
        let triangles = mesh.block_mut(CellKind::Triangle);
        triangles.nodes = vec![0, 1, 8, 0, 1, 3];
        triangles.data.insert("label".into(), DataArray::scalar(vec![7.0, 9.0]));
        triangles.sets.insert("rim".into(), vec![0, 1]);
        assert_eq!(diagnose(&mesh).unused_nodes, [8]);
        assert_eq!(mesh.drop_unused_points(), 1);
        let triangles = mesh.block(CellKind::Triangle).unwrap();
        assert_eq!(triangles.nodes, [0, 1, 3]);
        assert_eq!(triangles.data["label"].values, [9.0]);
        assert_eq!(triangles.sets["rim"], [0]);
        assert!(diagnose(&mesh).unused_nodes.is_empty());
    }

    #[test]
    fn nothing_at_all_is_a_fault() {
        let found = diagnose(&Mesh::default());
        assert!(found.no_cells && !found.is_usable());
        assert_eq!(found.to_string(), "no cells");
    }

    #[test]
    fn incomplete_block_is_found() {
        let mut mesh = block_of_tets([1, 1, 1]);
        mesh.block_mut(TET).nodes.pop();
        assert_eq!(diagnose(&mesh).incomplete_blocks, [TET]);
    }

    #[test]
    fn cubes_that_touch_along_an_edge_are_two_parts_with_a_non_manifold_edge() {
        let mut mesh = block_of_hexes([2, 2, 1]);
        let nodes = &mut mesh.blocks[0].nodes;
        nodes.drain(8..24);
        let found = diagnose(&mesh);
        assert_eq!(found.non_manifold_edges, [[4, 13]]);
        assert_eq!(found.components, 2);
        assert!(found.to_string().contains("2 separate parts"));
    }

    #[test]
    fn three_triangles_on_an_edge_are_not_a_manifold() {
        let x = points(&[[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., -1., 0.], [0., 0., 1.]]);
        let mesh = single(CellKind::Triangle, x, &[0, 1, 2, 1, 0, 3, 0, 1, 4]);
        let found = diagnose(&mesh);
        assert_eq!(found.non_manifold_edges, [[0, 1]]);
        assert_eq!(found.open_edges.len(), 6);
    }

    #[test]
    fn display_shows_ten_and_counts_the_rest() {
        let mut mesh = block_of_tets([1, 1, 1]);
        mesh.points.extend((0..25).map(|i| Vector3::new(f64::from(i), 5.0, 0.0)));
        let text = diagnose(&mesh).to_string();
        assert_eq!(text, "unused nodes: 25 (8, 9, 10, 11, 12, 13, 14, 15, 16, 17, … and 15 more)");
    }

    #[test]
    fn reorder_turns_inverted_cells_round() {
        let mut mesh = block_of_tets([2, 2, 2]);
        let good = mesh.clone();
        for nodes in mesh.blocks[0].nodes.chunks_exact_mut(4).step_by(3) {
            nodes.swap(0, 3);
        }
        assert_eq!(reorder(&mut mesh), 16);
        assert!(diagnose(&mesh).is_clean());
        let mut hexes = block_of_hexes([2, 1, 1]);
        hexes.blocks[0].nodes[..8].rotate_left(4);
        assert_eq!(diagnose(&hexes).inverted_cells, [cell(CellKind::Hex, 0)]);
        assert_eq!(reorder(&mut hexes), 1);
        assert_eq!(hexes, block_of_hexes([2, 1, 1]));
        mesh = good.clone();
        assert_eq!((reorder(&mut mesh), mesh), (0, good));
    }

    #[test]
    fn reorder_leaves_alone_what_it_cannot_repair() {
        let mut twisted = single(CellKind::Hex, points(&UNIT_CUBE), &[0, 1, 2, 3, 4, 5, 7, 6]);
        let before = twisted.clone();
        assert_eq!((reorder(&mut twisted), &twisted), (0, &before));
        assert_eq!(diagnose(&twisted).inverted_cells, [cell(CellKind::Hex, 0)]);
    }

    #[test]
    fn huge_and_coincident_coordinates_are_survived() {
        let mut random = Random::new(4);
        let x: Vec<Vector3> = (0..8).map(|_| noise(&mut random) * 1e200).collect();
        diagnose(&single(CellKind::Hex, x, &[0, 1, 2, 3, 4, 5, 6, 7]));
        let found = diagnose(&single(CellKind::Hex, vec![Vector3::zeros(); 5000], &[0, 1, 2, 3, 4, 5, 6, 7]));
        assert_eq!(found.duplicate_nodes.len(), 4999);
    }
}
