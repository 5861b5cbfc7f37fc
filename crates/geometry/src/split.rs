//! Wedges and pyramids become tets, because no element of a body has their shape. Each quadrilateral face is
//! cut along the diagonal through its node of the smallest number. So the cells on both sides of the face
//! agree (Dompierre, Labbé, Vallet and Camarero 1999). A cell is the cone from its smallest node to the
//! triangles of its other faces. Hexes that share a face with a split cell are split as well: a hex and two
//! tets on one face fail the patch test. Where two tets already meet a face, their diagonal counts. If a cell
//! then has no node for a cone, the cone starts from a new node at its centre.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use crate::cell::faces;
use crate::surface::face_key;
use crate::{CellKind, DataArray, Mesh, Vector3, volume};

/// Volume cells that are split into tets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SplitKind {
    /// Triangular prism: 0–2 one triangle, 3–5 the other one. Either orientation is valid, since VTK and Gmsh
    /// differ.
    Wedge,
    /// Pyramid: 0–3 the base, counter-clockwise seen from the apex, 4 the apex.
    Pyramid,
}

impl SplitKind {
    /// Nodes of one cell.
    pub const fn node_count(self) -> usize {
        match self {
            Self::Wedge => 6,
            Self::Pyramid => 5,
        }
    }

    /// The word for it in messages.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Wedge => "wedge",
            Self::Pyramid => "pyramid",
        }
    }

    /// Local nodes of every face, counter-clockwise seen from outside.
    const fn faces(self) -> &'static [&'static [usize]] {
        match self {
            Self::Wedge => &[&[0, 2, 1], &[3, 4, 5], &[0, 1, 4, 3], &[1, 2, 5, 4], &[2, 0, 3, 5]],
            Self::Pyramid => &[&[0, 3, 2, 1], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]],
        }
    }
}

/// Cells to be split, all of one kind.
#[derive(Clone, Debug, PartialEq)]
pub struct SplitCells {
    /// Their shape.
    pub kind: SplitKind,
    /// Node indices, `kind.node_count()` per cell; every node exists in the mesh.
    pub nodes: Vec<u32>,
    /// Data by name, one item per cell; each tet gets the data of its cell.
    pub data: BTreeMap<String, DataArray>,
    /// Named sets of cells; each tet is in the sets of its cell.
    pub sets: BTreeMap<String, Vec<u32>>,
}

/// Adds cells to a mesh as tets. Returns a sentence on the cells that were split; `None` without any.
pub fn add_as_tets(mesh: &mut Mesh, cells: &[SplitCells]) -> Option<String> {
    let cell_count = |cells: &SplitCells| cells.nodes.len() / cells.kind.node_count();
    if cells.iter().all(|cells| cell_count(cells) == 0) {
        return None;
    }
    let mut splitter = Splitter::new(mesh, cells);
    let hexes = splitter.joined_hexes(mesh);
    let mut counts: Vec<String> = Vec::new();
    let mut count = |number: usize, name: &str| {
        if number > 0 {
            counts.push(format!("{number} {name}{}", if number == 1 { "" } else { "s" }));
        }
    };
    for cells in cells {
        count(cell_count(cells), cells.kind.name());
    }
    match hexes.len() {
        0 => {}
        1 => counts.push("1 adjacent hex".to_owned()),
        number => counts.push(format!("{number} adjacent hexes")),
    }
    let mut tets = Vec::new();
    for cells in cells {
        let turned = |nodes: &[u32]| upright(cells.kind, nodes, &mesh.points);
        let pieces: Vec<Vec<[u32; 4]>> = cells
            .nodes
            .chunks_exact(cells.kind.node_count())
            .map(turned)
            .collect::<Vec<_>>()
            .iter()
            .map(|nodes| splitter.split(mesh, nodes, cells.kind.faces()))
            .collect();
        tets.push((pieces, cells.data.clone(), cells.sets.clone()));
    }
    if let Some(block) = mesh.blocks.iter().position(|block| block.kind == CellKind::Hex)
        && !hexes.is_empty()
    {
        let mut kept: Vec<bool> = vec![true; mesh.blocks[block].len()];
        hexes.iter().for_each(|&hex| kept[hex as usize] = false);
        let mut gone = mesh.blocks[block].clone();
        gone.retain(&kept.iter().map(|kept| !kept).collect::<Vec<_>>());
        mesh.blocks[block].retain(&kept);
        if mesh.blocks[block].is_empty() {
            mesh.blocks.remove(block);
        }
        let nodes: Vec<Vec<u32>> = gone.cells().map(<[u32]>::to_vec).collect();
        let pieces = nodes.iter().map(|nodes| splitter.split(mesh, nodes, faces(CellKind::Hex))).collect();
        tets.push((pieces, gone.data, gone.sets));
    }
    for (pieces, data, sets) in tets {
        add(mesh, &pieces, &data, &sets);
    }
    let centres = match splitter.centres {
        0 => String::new(),
        number => format!("; {number} of these cells got a node at the centre"),
    };
    Some(format!("split into tets: {}{centres}", counts.join(", ")))
}

/// Faces of hexes that two tets meet. Nodal forces of the two sides differ there, so bodies of both kinds
/// fail the patch test.
pub fn faces_met_by_two_tets(mesh: &Mesh) -> usize {
    let [Some(hexes), Some(_)] = [CellKind::Hex, CellKind::Tet].map(|kind| mesh.block(kind)) else {
        return 0;
    };
    let splitter = Splitter::new(mesh, &[]);
    let of_hex = |nodes: &[u32]| {
        let met = faces(CellKind::Hex).iter().filter(|face| {
            let [a, b, c, d] = [0, 1, 2, 3].map(|at| nodes[face[at]]);
            splitter.diagonals([a, b, c, d]).contains(&true)
        });
        met.count()
    };
    hexes.cells().map(of_hex).sum()
}

/// The nodes of a cell in the order of positive volume. Only wedges have two orders.
fn upright(kind: SplitKind, nodes: &[u32], points: &[Vector3]) -> Vec<u32> {
    let mut nodes = nodes.to_vec();
    if kind == SplitKind::Wedge {
        let corner = |at: usize| points[nodes[at] as usize];
        // Three tets whose common edges are diagonals of the faces.
        let volumes =
            [[0, 1, 2, 3], [1, 2, 3, 4], [2, 3, 4, 5]].map(|tet| volume(CellKind::Tet, &tet.map(corner)));
        if volumes.iter().sum::<f64>() < 0.0 {
            nodes.rotate_left(3);
        }
    }
    nodes
}

/// The faces between cells, and how they are cut.
struct Splitter {
    /// Faces of three nodes of the tets of a mesh.
    triangles: BTreeSet<[u32; 4]>,
    /// Faces of four nodes of the cells that are split.
    quads: BTreeSet<[u32; 4]>,
    /// Cells that got a node at their centre.
    centres: usize,
}

impl Splitter {
    fn new(mesh: &Mesh, cells: &[SplitCells]) -> Self {
        let mut splitter = Self { triangles: BTreeSet::new(), quads: BTreeSet::new(), centres: 0 };
        for nodes in mesh.block(CellKind::Tet).into_iter().flat_map(|tets| tets.cells()) {
            splitter.triangles.extend(faces(CellKind::Tet).iter().map(|face| key(nodes, face)));
        }
        for cells in cells {
            let quads = || cells.kind.faces().iter().filter(|face| face.len() == 4);
            for nodes in cells.nodes.chunks_exact(cells.kind.node_count()) {
                splitter.quads.extend(quads().map(|face| key(nodes, face)));
            }
        }
        splitter
    }

    /// The hexes that hang together with split cells by faces, increasing. Their faces are cut, too.
    fn joined_hexes(&mut self, mesh: &Mesh) -> Vec<u32> {
        let Some(block) = mesh.block(CellKind::Hex) else { return Vec::new() };
        let keys = |hex: u32| {
            let nodes = block.cell(hex as usize);
            faces(CellKind::Hex).iter().map(|face| key(nodes, face))
        };
        let mut of_face: HashMap<[u32; 4], Vec<u32>> = HashMap::new();
        for hex in 0..block.len() as u32 {
            keys(hex).for_each(|key| of_face.entry(key).or_default().push(hex));
        }
        let mut joined = BTreeSet::new();
        let mut ahead: Vec<[u32; 4]> = self.quads.iter().copied().collect();
        while let Some(face) = ahead.pop() {
            for hex in of_face.remove(&face).unwrap_or_default() {
                if joined.insert(hex) {
                    ahead.extend(keys(hex));
                }
            }
        }
        self.quads.extend(joined.iter().flat_map(|&hex| keys(hex)));
        joined.into_iter().collect()
    }

    /// The tets of a cell with some faces.
    fn split(&mut self, mesh: &mut Mesh, nodes: &[u32], faces: &[&[usize]]) -> Vec<[u32; 4]> {
        let halves: Vec<Vec<[u32; 3]>> = faces
            .iter()
            .map(|face| match face.iter().map(|&at| nodes[at]).collect::<Vec<_>>()[..] {
                [a, b, c] => vec![[a, b, c]],
                [a, b, c, d] if self.is_cut_at_first([a, b, c, d]) => vec![[a, b, c], [a, c, d]],
                [a, b, c, d] => vec![[a, b, d], [b, c, d]],
                _ => Vec::new(),
            })
            .collect();
        let mut from: Vec<u32> = nodes.to_vec();
        from.sort_unstable();
        // All triangles of the faces at a node have it: the cone from it cuts these faces as they are.
        let starts = |node: &&u32| {
            halves.iter().all(|triangles| {
                let with = triangles.iter().filter(|triangle| triangle.contains(*node)).count();
                with == 0 || with == triangles.len()
            })
        };
        let apex = from.iter().find(starts).copied().unwrap_or_else(|| {
            self.centres += 1;
            centre(mesh, nodes)
        });
        let beyond = halves.into_iter().flatten().filter(|triangle| !triangle.contains(&apex));
        beyond.map(|[a, b, c]| [a, c, b, apex]).collect()
    }

    /// True if a face is cut from its first to its third node.
    fn is_cut_at_first(&self, nodes: [u32; 4]) -> bool {
        let [a, b, c, d] = nodes;
        match self.diagonals(nodes) {
            [true, false] => true,
            [false, true] => false,
            _ => a.min(c) < b.min(d),
        }
    }

    /// True for each diagonal along which two tets already meet a face: from its first to its third node, and
    /// from its second to its fourth.
    fn diagonals(&self, [a, b, c, d]: [u32; 4]) -> [bool; 2] {
        let meets = |tets: [[u32; 3]; 2]| tets.iter().all(|face| self.triangles.contains(&face_key(face)));
        [meets([[a, b, c], [a, c, d]]), meets([[a, b, d], [b, c, d]])]
    }
}

/// Key of a face, equal for all faces of the same nodes.
fn key(nodes: &[u32], face: &[usize]) -> [u32; 4] {
    let mut chosen = [0; 4];
    chosen.iter_mut().zip(face).for_each(|(slot, &at)| *slot = nodes[at]);
    face_key(&chosen[..face.len()])
}

/// A new point at the centre of some points, with the mean of their data.
fn centre(mesh: &mut Mesh, nodes: &[u32]) -> u32 {
    let part = 1.0 / nodes.len() as f64;
    let sum: Vector3 = nodes.iter().map(|&node| mesh.points[node as usize]).sum();
    for array in mesh.point_data.values_mut() {
        let mean = |at: usize| nodes.iter().map(|&node| array.item(node as usize)[at]).sum::<f64>() * part;
        let item: Vec<f64> = (0..array.components).map(mean).collect();
        array.values.extend(item);
    }
    mesh.points.push(sum * part);
    mesh.points.len() as u32 - 1
}

/// Adds the tets of some cells to a mesh with what each cell has. Cells without some data get NaN.
fn add(
    mesh: &mut Mesh,
    pieces: &[Vec<[u32; 4]>],
    data: &BTreeMap<String, DataArray>,
    sets: &BTreeMap<String, Vec<u32>>,
) {
    let block = mesh.block_mut(CellKind::Tet);
    let before = block.len();
    let ends: Vec<usize> = pieces
        .iter()
        .scan(before, |end, piece| {
            *end += piece.len();
            Some(*end)
        })
        .collect();
    block.nodes.extend(pieces.iter().flatten().flatten());
    for (name, array) in data {
        let target = block.data.entry(name.clone()).or_insert_with(|| DataArray {
            components: array.components,
            values: vec![f64::NAN; before * array.components],
        });
        if target.components == array.components {
            for (cell, piece) in pieces.iter().enumerate() {
                piece.iter().for_each(|_| target.values.extend(array.item(cell)));
            }
        }
    }
    let after = block.len();
    for array in block.data.values_mut() {
        array.values.resize(after * array.components, f64::NAN);
    }
    for (name, cells) in sets {
        let tets = cells.iter().map(|&cell| cell as usize).flat_map(|cell| {
            let start = if cell == 0 { before } else { ends[cell - 1] };
            start as u32..ends[cell] as u32
        });
        let set = block.sets.entry(name.clone()).or_default();
        set.extend(tets);
        set.sort_unstable();
        set.dedup();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::points;
    use crate::{boundary, diagnose};
    use pliant_testing::Random;

    fn cells(kind: SplitKind, nodes: &[u32]) -> SplitCells {
        SplitCells { kind, nodes: nodes.to_vec(), data: BTreeMap::new(), sets: BTreeMap::new() }
    }

    /// A grid of unit cubes with moved nodes in a random numbering, each cube a hex, two wedges or six
    /// pyramids round its centre.
    fn mixed(n: [u32; 3], random: &mut Random) -> (Mesh, Vec<SplitCells>) {
        let count = ((n[0] + 1) * (n[1] + 1) * (n[2] + 1)) as usize;
        let mut order: Vec<u32> = (0..count as u32).collect();
        for at in (1..count).rev() {
            order.swap(at, random.below(at + 1));
        }
        let node = |i: u32, j: u32, k: u32| order[(i + (n[0] + 1) * (j + (n[1] + 1) * k)) as usize];
        let mut mesh = Mesh { points: vec![Vector3::zeros(); count], ..Mesh::default() };
        for (i, j, k) in
            (0..=n[0]).flat_map(|i| (0..=n[1]).flat_map(move |j| (0..=n[2]).map(move |k| (i, j, k))))
        {
            mesh.points[node(i, j, k) as usize] = Vector3::new(f64::from(i), f64::from(j), f64::from(k));
        }
        let (mut wedges, mut pyramids) = (Vec::new(), Vec::new());
        for (i, j, k) in
            (0..n[0]).flat_map(|i| (0..n[1]).flat_map(move |j| (0..n[2]).map(move |k| (i, j, k))))
        {
            let at = |[x, y, z]: [u32; 3]| node(i + x, j + y, k + z);
            let hex =
                [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
                    .map(at);
            match random.below(3) {
                0 => mesh.block_mut(CellKind::Hex).nodes.extend(hex),
                // The triangles of wedges stand across z, where cubes above and below may be cut otherwise:
                // keep z open.
                1 if n[2] == 1 => {
                    let [a, b, c, d, e, f, g, h] = hex;
                    wedges.extend([a, b, c, e, f, g]);
                    // The other order of VTK.
                    wedges.extend([e, g, h, a, c, d]);
                }
                _ => {
                    let apex = mesh.points.len() as u32;
                    mesh.points.push(Vector3::new(f64::from(i), f64::from(j), f64::from(k)).add_scalar(0.5));
                    for face in faces(CellKind::Hex) {
                        // Seen from the apex, the other way round.
                        pyramids.extend(face.iter().rev().map(|&corner| hex[corner]).chain([apex]));
                    }
                }
            }
        }
        (mesh, vec![cells(SplitKind::Wedge, &wedges), cells(SplitKind::Pyramid, &pyramids)])
    }

    #[test]
    fn cells_of_any_numbering_meet_face_to_face() {
        let mut random = Random::new(5);
        for n in [[3, 3, 1], [3, 2, 2], [1, 1, 1], [4, 4, 1], [2, 3, 3]] {
            for _ in 0..20 {
                let (mut mesh, cells) = mixed(n, &mut random);
                add_as_tets(&mut mesh, &cells);
                let found = diagnose(&mesh);
                assert!(found.inverted_cells.is_empty() && found.degenerate_cells.is_empty(), "{found}");
                let whole = f64::from(n[0] * n[1] * n[2]);
                let sum: f64 = mesh
                    .volume_blocks()
                    .flat_map(|block| block.cells().map(move |cell| (block.kind, cell)))
                    .map(|(kind, cell)| {
                        let x: Vec<Vector3> = cell.iter().map(|&node| mesh.points[node as usize]).collect();
                        volume(kind, &x)
                    })
                    .sum();
                assert!((sum - whole).abs() < 1e-12 * whole, "{sum} {whole}");
                // Faces that do not agree would be boundary inside the block.
                let area = 2.0 * f64::from(n[0] * n[1] + n[1] * n[2] + n[2] * n[0]);
                assert!((boundary(&mesh).area(&mesh.points) - area).abs() < 1e-12 * area);
            }
        }
    }

    /// A wedge whose three quads are each met by two tets, cut in a cycle: no node of it has a cone.
    #[test]
    fn the_diagonals_of_tets_count_and_a_cycle_gets_a_node_inside() {
        let wedge = [0, 1, 2, 3, 4, 5];
        let mut mesh = Mesh {
            points: points(&[
                [0.0, 0.0, 0.0],
                [1.0, 0.0, 0.0],
                [0.0, 1.0, 0.0],
                [0.0, 0.0, 1.0],
                [1.0, 0.0, 1.0],
                [0.0, 1.0, 1.0],
                [0.5, -1.0, 0.5],
                [1.0, 1.0, 0.5],
                [-1.0, 0.5, 0.5],
            ]),
            ..Mesh::default()
        };
        mesh.point_data.insert("x".into(), DataArray::scalar(mesh.points.iter().map(|x| x.x).collect()));
        // On the outward faces 0 1 4 3, 1 2 5 4 and 2 0 3 5. They are cut along 0 4, 1 5 and 2 3.
        let tets: [[u32; 4]; 6] =
            [[0, 1, 4, 6], [0, 4, 3, 6], [1, 2, 5, 7], [1, 5, 4, 7], [2, 0, 3, 8], [2, 3, 5, 8]];
        mesh.block_mut(CellKind::Tet).nodes = tets.concat();
        let whole = |mesh: &Mesh| crate::QualityReport::new(mesh).volume;
        let outer = whole(&mesh);
        let said = add_as_tets(&mut mesh, &[cells(SplitKind::Wedge, &wedge)]).unwrap();
        assert_eq!(said, "split into tets: 1 wedge; 1 of these cells got a node at the centre");
        assert_eq!((mesh.points.len(), mesh.blocks[0].len()), (10, 6 + 8));
        assert!((mesh.point_data["x"].values[9] - 1.0 / 3.0).abs() < 1e-15);
        assert!((whole(&mesh) - outer - 0.5).abs() < 1e-14);
        let found = diagnose(&mesh);
        assert!(found.inverted_cells.is_empty() && found.non_manifold_edges.is_empty(), "{found}");
        // Two triangles of the wedge and four outer faces of each pair of tets.
        assert_eq!(boundary(&mesh).faces.len(), 2 + 3 * 4);
    }

    #[test]
    fn a_hex_under_two_tets_has_one_such_face() {
        let mut mesh = Mesh { points: points(&crate::testing::UNIT_CUBE), ..Mesh::default() };
        mesh.points.push(Vector3::new(0.5, 0.5, 3.0));
        mesh.block_mut(CellKind::Hex).nodes = (0..8).collect();
        assert_eq!(faces_met_by_two_tets(&mesh), 0);
        mesh.block_mut(CellKind::Tet).nodes = vec![4, 5, 6, 8, 4, 6, 7, 8];
        assert_eq!(faces_met_by_two_tets(&mesh), 1);
    }

    #[test]
    fn data_and_sets_go_to_the_tets_of_their_cells() {
        let mut mesh = Mesh { points: points(&crate::testing::UNIT_CUBE), ..Mesh::default() };
        mesh.points.push(Vector3::new(0.5, 0.5, 1.5));
        let hexes = mesh.block_mut(CellKind::Hex);
        hexes.nodes = (0..8).collect();
        hexes.data.insert("label".into(), DataArray::scalar(vec![3.0]));
        hexes.sets.insert("low".into(), vec![0]);
        let mut pyramid = cells(SplitKind::Pyramid, &[4, 5, 6, 7, 8]);
        pyramid.data.insert("label".into(), DataArray::scalar(vec![7.0]));
        pyramid.sets.insert("tip".into(), vec![0]);
        let said = add_as_tets(&mut mesh, &[pyramid]).unwrap();
        assert_eq!(said, "split into tets: 1 pyramid, 1 adjacent hex");
        let [block] = &mesh.blocks[..] else { panic!() };
        assert_eq!(block.data["label"].values, [[7.0; 2].as_slice(), &[3.0; 6]].concat());
        assert_eq!((&block.sets["tip"][..], &block.sets["low"][..]), (&[0, 1][..], &[2, 3, 4, 5, 6, 7][..]));
    }
}
