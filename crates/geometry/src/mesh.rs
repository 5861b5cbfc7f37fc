//! A mesh: points, cells by kind, named sets, and data carried by points and cells.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use nalgebra::Matrix3;

use crate::Vector3;

/// Shape of a cell and the number and order of its nodes (the order of VTK).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum CellKind {
    /// One node.
    Vertex,
    /// Two nodes.
    Line,
    /// Three nodes, counter-clockwise seen from outside.
    Triangle,
    /// Four nodes, counter-clockwise seen from outside.
    Quad,
    /// Linear tetrahedron: (1−0, 2−0, 3−0) is right-handed.
    Tet,
    /// Linear hexahedron: 0–3 the bottom, counter-clockwise seen from above, 4–7 the top above them.
    Hex,
}

impl CellKind {
    /// Nodes of one cell.
    pub const fn node_count(self) -> usize {
        match self {
            Self::Vertex => 1,
            Self::Line => 2,
            Self::Triangle => 3,
            Self::Quad | Self::Tet => 4,
            Self::Hex => 8,
        }
    }

    /// Topological dimension: 0 point, 1 line, 2 face, 3 volume.
    pub const fn dimension(self) -> usize {
        match self {
            Self::Vertex => 0,
            Self::Line => 1,
            Self::Triangle | Self::Quad => 2,
            Self::Tet | Self::Hex => 3,
        }
    }

    /// The word for it in messages: `tet`, `hex`, `triangle`, …
    pub const fn name(self) -> &'static str {
        match self {
            Self::Vertex => "vertex",
            Self::Line => "line",
            Self::Triangle => "triangle",
            Self::Quad => "quad",
            Self::Tet => "tet",
            Self::Hex => "hex",
        }
    }
}

/// Values carried by each point or each cell.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DataArray {
    /// Numbers per item: 1 scalar, 3 vector, 9 tensor (row-major).
    pub components: usize,
    /// Values, item after item; length = items × components.
    pub values: Vec<f64>,
}

impl DataArray {
    /// One number per item.
    pub fn scalar(values: Vec<f64>) -> Self {
        Self { components: 1, values }
    }

    /// The values of item `index`, `components` long.
    pub fn item(&self, index: usize) -> &[f64] {
        &self.values[index * self.components..(index + 1) * self.components]
    }

    /// Number of items.
    pub fn len(&self) -> usize {
        self.values.len().checked_div(self.components).unwrap_or(0)
    }

    /// True without any item.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }
}

/// Cells of one kind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CellBlock {
    /// Their shape.
    pub kind: CellKind,
    /// Node indices, `kind.node_count()` per cell.
    pub nodes: Vec<u32>,
    /// Data by name, one item per cell. `label` (one component) holds region numbers.
    pub data: BTreeMap<String, DataArray>,
    /// Named sets: cell indices within this block, increasing.
    pub sets: BTreeMap<String, Vec<u32>>,
}

impl CellBlock {
    /// A block without data or sets.
    pub fn new(kind: CellKind, nodes: Vec<u32>) -> Self {
        Self { kind, nodes, data: BTreeMap::new(), sets: BTreeMap::new() }
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.nodes.len() / self.kind.node_count()
    }

    /// True without any cell.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// The nodes of cell `index`.
    pub fn cell(&self, index: usize) -> &[u32] {
        let n = self.kind.node_count();
        &self.nodes[index * n..(index + 1) * n]
    }

    /// Removes cells that are not kept, with their data and set entries.
    pub(crate) fn retain(&mut self, kept: &[bool]) {
        if kept.iter().all(|&kept| kept) {
            return;
        }
        self.nodes = kept_items(&self.nodes, self.kind.node_count(), kept);
        for array in self.data.values_mut() {
            array.values = kept_items(&array.values, array.components, kept);
        }
        let numbers = numbers_of(kept);
        for set in self.sets.values_mut() {
            set.retain_mut(|cell| {
                let old = *cell as usize;
                *cell = numbers[old];
                kept[old]
            });
        }
    }

    /// Cells in order.
    pub fn cells(&self) -> std::slice::ChunksExact<'_, u32> {
        self.nodes.chunks_exact(self.kind.node_count())
    }
}

/// Points and the cells between them. Lengths are in metres once a scene has applied its `scale`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Positions.
    pub points: Vec<Vector3>,
    /// Cells, at most one block per kind.
    pub blocks: Vec<CellBlock>,
    /// Data by name, one item per point.
    pub point_data: BTreeMap<String, DataArray>,
    /// Named sets of points: indices, increasing.
    pub point_sets: BTreeMap<String, Vec<u32>>,
    /// Names of labels of cells (cell data `label`), of some or all.
    pub label_names: BTreeMap<i32, String>,
    /// Names of bodies, obstacles and tools (cell data `body`), of some or all.
    pub body_names: BTreeMap<i32, String>,
}

impl Mesh {
    /// Turns or mirrors the mesh about the origin: its points, and its data of three components as vectors.
    pub fn transform(&mut self, map: &Matrix3<f64>) {
        self.points.iter_mut().for_each(|point| *point = map * *point);
        let of_cells = self.blocks.iter_mut().flat_map(|block| block.data.values_mut());
        for array in self.point_data.values_mut().chain(of_cells).filter(|array| array.components == 3) {
            for vector in array.values.chunks_exact_mut(3) {
                vector.copy_from_slice((map * Vector3::from_column_slice(vector)).as_slice());
            }
        }
    }

    /// The block of a kind, if the mesh has these cells.
    pub fn block(&self, kind: CellKind) -> Option<&CellBlock> {
        self.blocks.iter().find(|block| block.kind == kind)
    }

    /// The block of a kind, added empty if it is missing.
    pub fn block_mut(&mut self, kind: CellKind) -> &mut CellBlock {
        let at = self.blocks.iter().position(|block| block.kind == kind).unwrap_or_else(|| {
            self.blocks.push(CellBlock::new(kind, Vec::new()));
            self.blocks.len() - 1
        });
        &mut self.blocks[at]
    }

    /// Blocks of volume cells (tets and hexes).
    pub fn volume_blocks(&self) -> impl Iterator<Item = &CellBlock> {
        self.blocks.iter().filter(|block| block.kind.dimension() == 3)
    }

    /// Smallest and largest corner of the axis-aligned box around all points; `None` without points.
    pub fn bounds(&self) -> Option<(Vector3, Vector3)> {
        let first = *self.points.first()?;
        Some(self.points.iter().fold((first, first), |(low, high), p| (low.inf(p), high.sup(p))))
    }

    /// Names of all point sets and cell sets, sorted, each once.
    pub fn set_names(&self) -> Vec<&str> {
        let mut names: Vec<&str> = self
            .point_sets
            .keys()
            .chain(self.blocks.iter().flat_map(|block| block.sets.keys()))
            .map(String::as_str)
            .collect();
        names.sort_unstable();
        names.dedup();
        names
    }

    /// The points of a named set: its point set and the nodes of its cell sets, increasing, each
    /// once; `None` if no set has the name.
    pub fn set_points(&self, name: &str) -> Option<Vec<u32>> {
        let mut found = false;
        let mut points = Vec::new();
        if let Some(set) = self.point_sets.get(name) {
            found = true;
            points.extend_from_slice(set);
        }
        for block in &self.blocks {
            if let Some(set) = block.sets.get(name) {
                found = true;
                points.extend(set.iter().flat_map(|&cell| block.cell(cell as usize)));
            }
        }
        points.sort_unstable();
        points.dedup();
        found.then_some(points)
    }

    /// True for each point that a volume cell uses, or any cell if the mesh has no volume cells.
    pub(crate) fn used_points(&self) -> Vec<bool> {
        let mut used = vec![false; self.points.len()];
        let solid = self.volume_blocks().any(|block| !block.is_empty());
        let using = self.blocks.iter().filter(|block| !solid || block.kind.dimension() == 3);
        for &node in using.flat_map(|block| &block.nodes) {
            if let Some(used) = used.get_mut(node as usize) {
                *used = true;
            }
        }
        used
    }

    /// Removes points that no cell uses (with volume cells: no volume cell), with their data and their
    /// surface cells. Returns the number of points.
    pub fn drop_unused_points(&mut self) -> usize {
        let used = self.used_points();
        for block in &mut self.blocks {
            let hangs_on = |nodes: &[u32]| nodes.iter().all(|&node| used.get(node as usize) != Some(&false));
            let kept: Vec<bool> = block.cells().map(hangs_on).collect();
            block.retain(&kept);
        }
        let target: Vec<u32> = (0..self.points.len() as u32).collect();
        self.renumber(&target, &used)
    }

    /// Joins pairs of points, each second one into its first, and removes the second ones; returns how many.
    pub fn merge_points(&mut self, pairs: &[[u32; 2]]) -> usize {
        let mut target: Vec<u32> = (0..self.points.len() as u32).collect();
        for &[first, second] in pairs {
            target[second as usize] = target[first as usize];
        }
        let kept: Vec<bool> = target.iter().zip(0..).map(|(&target, node)| target == node).collect();
        self.renumber(&target, &kept)
    }

    /// Redirects every reference to a point to its target, then removes points that are not kept.
    fn renumber(&mut self, target: &[u32], kept: &[bool]) -> usize {
        let numbers = numbers_of(kept);
        for node in self.blocks.iter_mut().flat_map(|block| &mut block.nodes) {
            if let Some(&target) = target.get(*node as usize) {
                *node = numbers[target as usize];
            }
        }
        for set in self.point_sets.values_mut() {
            set.retain_mut(|point| {
                let target = target[*point as usize] as usize;
                *point = numbers[target];
                kept[target]
            });
            set.sort_unstable();
            set.dedup();
        }
        for array in self.point_data.values_mut() {
            array.values = kept_items(&array.values, array.components, kept);
        }
        let before = self.points.len();
        let mut keep = kept.iter();
        self.points.retain(|_| keep.next().copied().unwrap_or(true));
        before - self.points.len()
    }
}

/// The new number of each item after removing those that are not kept.
fn numbers_of(kept: &[bool]) -> Vec<u32> {
    let mut next = 0_u32;
    let number = |&kept: &bool| {
        next += u32::from(kept);
        next.wrapping_sub(1)
    };
    kept.iter().map(number).collect()
}

/// The values of the kept items, `size` values per item.
fn kept_items<T: Copy>(values: &[T], size: usize, kept: &[bool]) -> Vec<T> {
    let items = values.chunks(size.max(1)).zip(kept);
    items.filter(|(_, kept)| **kept).flat_map(|(item, _)| item.iter().copied()).collect()
}
