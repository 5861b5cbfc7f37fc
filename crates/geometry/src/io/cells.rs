//! Cells in the order of a file, sorted into one block per kind. A map from cells of the file to cells of
//! the mesh places data and sets of the file.

use std::collections::BTreeMap;

use super::error::{Fault, MeshFileProblem, Place};
use crate::{CellBlock, CellKind, DataArray, Mesh, SplitCells, SplitKind, Vector3, add_as_tets};

/// Prefix of arrays that hold a named set: 1 inside, 0 outside.
pub(super) const SET_PREFIX: &str = "set:";
/// Field data with the names of labels: bytes of texts such as `5 liver`, each ended by a 0.
pub(super) const LABEL_NAMES: &str = "label-names";
/// Field data with the names of bodies, obstacles and tools.
pub(super) const BODY_NAMES: &str = "body-names";

/// A kind of cell in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum FileKind {
    /// Read as it is.
    Kept(CellKind),
    /// Read as tets.
    Split(SplitKind),
}

impl FileKind {
    pub const fn node_count(self) -> usize {
        match self {
            Self::Kept(kind) => kind.node_count(),
            Self::Split(kind) => kind.node_count(),
        }
    }

    pub const fn dimension(self) -> usize {
        match self {
            Self::Kept(kind) => kind.dimension(),
            Self::Split(_) => 3,
        }
    }

    pub const fn name(self) -> &'static str {
        match self {
            Self::Kept(kind) => kind.name(),
            Self::Split(kind) => kind.name(),
        }
    }
}

/// Cells of one kind.
struct Block {
    kind: FileKind,
    nodes: Vec<u32>,
    data: BTreeMap<String, DataArray>,
    sets: BTreeMap<String, Vec<u32>>,
}

/// Range of the cells that came from one cell of the file.
#[derive(Clone, Copy)]
struct Span {
    block: u32,
    start: u32,
    end: u32,
}

/// Cells being collected.
#[derive(Default)]
pub(super) struct Cells {
    blocks: Vec<Block>,
    /// For each cell of the file: its cells here (none if skipped, several for polygons and lists).
    spans: Vec<Span>,
    /// Cells of unsupported kinds: their dimension and number by name.
    skipped: BTreeMap<String, (usize, usize)>,
    cut: usize,
}

impl Cells {
    /// Number of cells of the file so far, skipped ones included.
    pub fn len(&self) -> usize {
        self.spans.len()
    }

    /// Starts the next cell of the file; cells pushed from now on come from it.
    pub fn open(&mut self) {
        self.spans.push(Span { block: 0, start: 0, end: 0 });
    }

    /// Adds a cell of the mesh to the open cell of the file.
    pub fn push(&mut self, kind: CellKind, nodes: &[u32]) {
        self.push_of(FileKind::Kept(kind), nodes);
    }

    /// Adds a cell of any readable kind to the open cell of the file.
    pub(crate) fn push_of(&mut self, kind: FileKind, nodes: &[u32]) {
        let at = self.blocks.iter().position(|block| block.kind == kind).unwrap_or_else(|| {
            let (data, sets) = (BTreeMap::new(), BTreeMap::new());
            self.blocks.push(Block { kind, nodes: Vec::new(), data, sets });
            self.blocks.len() - 1
        });
        let block = &mut self.blocks[at];
        let index = (block.nodes.len() / kind.node_count()) as u32;
        block.nodes.extend_from_slice(nodes);
        if let Some(span) = self.spans.last_mut() {
            if span.start == span.end {
                *span = Span { block: at as u32, start: index, end: index };
            }
            span.end = index + 1;
        }
    }

    /// Adds a polygon to the open cell of the file: triangle, quad, or a fan of triangles around its first
    /// corner (right for convex polygons).
    pub(crate) fn push_polygon(&mut self, nodes: &[u32]) {
        match nodes {
            [_, _, _] => self.push(CellKind::Triangle, nodes),
            [_, _, _, _] => self.push(CellKind::Quad, nodes),
            [first, rest @ ..] => {
                self.cut += 1;
                for pair in rest.windows(2) {
                    self.push(CellKind::Triangle, &[*first, pair[0], pair[1]]);
                }
            }
            [] => {}
        }
    }

    /// Leaves the open cell of the file out, because its kind is not supported. Its dimension is 3 for a
    /// volume.
    pub fn skip(&mut self, kind: impl Into<String>, dimension: usize) {
        self.skipped.entry(kind.into()).or_insert((dimension, 0)).1 += 1;
    }

    /// The mesh's cells that came from a cell of the file: index of the block and range in it.
    fn span(&self, source: usize) -> Option<(usize, std::ops::Range<u32>)> {
        self.spans.get(source).map(|span| (span.block as usize, span.start..span.end))
    }

    /// Gives the cells their data: one item per cell of the file. In a file with cells of several kinds an
    /// array that is NaN for all cells of a kind is taken as missing there.
    pub(crate) fn add_data(&mut self, name: &str, array: &DataArray) {
        if let Some(set) = name.strip_prefix(SET_PREFIX)
            && array.components == 1
        {
            let members = array.values.iter().enumerate().filter(|(_, v)| v.abs() > 0.0).map(|(i, _)| i);
            self.add_set(set, members);
            return;
        }
        let several = self.blocks.len() > 1;
        self.add_data_where(name, array, |values| !several || values.iter().any(|value| !value.is_nan()));
    }

    /// Gives the cells their data, one item per cell of the file, in those blocks where `keep` says so.
    pub(crate) fn add_data_where(&mut self, name: &str, array: &DataArray, keep: impl Fn(&[f64]) -> bool) {
        let mut split: Vec<Vec<f64>> = vec![Vec::new(); self.blocks.len()];
        for source in 0..self.len() {
            if let Some((block, range)) = self.span(source) {
                for _ in range {
                    split[block].extend_from_slice(array.item(source));
                }
            }
        }
        for (block, values) in self.blocks.iter_mut().zip(split) {
            if keep(&values) {
                block.data.insert(name.to_owned(), DataArray { components: array.components, values });
            }
        }
    }

    /// Adds cells of the file to a named set. A set without any cell is kept, empty, in the first block.
    pub(crate) fn add_set(&mut self, name: &str, sources: impl IntoIterator<Item = usize>) {
        for source in sources {
            if let Some((block, range)) = self.span(source)
                && !range.is_empty()
            {
                let sets = &mut self.blocks[block].sets;
                match sets.get_mut(name) {
                    Some(set) => set.extend(range),
                    None => {
                        sets.insert(name.to_owned(), range.collect());
                    }
                }
            }
        }
        let known = self.blocks.iter().any(|block| block.sets.contains_key(name));
        if let Some(block) = self.blocks.first_mut()
            && !known
        {
            block.sets.insert(name.to_owned(), Vec::new());
        }
    }

    /// Returns the mesh, or the reason for its absence; adds notes about skipped and split cells. Cells may
    /// be skipped only if their dimension is below the largest: a body would have holes without them.
    pub(crate) fn into_mesh(
        self,
        points: Vec<Vector3>,
        point_data: BTreeMap<String, DataArray>,
        notes: &mut Vec<String>,
    ) -> Result<Mesh, Fault> {
        if points.is_empty() {
            return Err(Fault::whole(MeshFileProblem::NoPoints));
        }
        let kinds: Vec<String> =
            self.skipped.iter().map(|(kind, (_, count))| format!("{count} {kind}")).collect();
        let kinds = kinds.join(", ");
        let most = self.blocks.iter().map(|block| block.kind.dimension()).max();
        let lacks =
            |most: usize| self.skipped.values().any(|&(dimension, _)| dimension > 0 && dimension >= most);
        match most {
            None if kinds.is_empty() => return Err(Fault::whole(MeshFileProblem::NoCells)),
            Some(most) if !lacks(most) => {}
            _ => return Err(Fault::whole(MeshFileProblem::UnsupportedCells { kinds })),
        }
        if !kinds.is_empty() {
            notes.push(format!("skipped cells of unsupported kinds: {kinds}"));
        }
        if self.cut > 0 {
            notes.push(format!("{} polygons with more than 4 corners were split into triangles", self.cut));
        }
        let mut blocks = self.blocks;
        for set in blocks.iter_mut().flat_map(|block| block.sets.values_mut()) {
            set.sort_unstable();
            set.dedup();
        }
        let mut mesh = Mesh { points, ..Mesh::default() };
        let mut split = Vec::new();
        for Block { kind, nodes, data, sets } in blocks {
            match kind {
                FileKind::Kept(kind) => mesh.blocks.push(CellBlock { kind, nodes, data, sets }),
                FileKind::Split(kind) => split.push(SplitCells { kind, nodes, data, sets }),
            }
        }
        for (name, array) in point_data {
            match name.strip_prefix(SET_PREFIX) {
                Some(set) if array.components == 1 => {
                    let members = array.values.iter().enumerate().filter(|(_, v)| v.abs() > 0.0);
                    mesh.point_sets.insert(set.to_owned(), members.map(|(i, _)| i as u32).collect());
                }
                _ => {
                    mesh.point_data.insert(name, array);
                }
            }
        }
        notes.extend(add_as_tets(&mut mesh, &split));
        Ok(mesh)
    }
}

/// Largest number of bytes of arrays that a file may fill. Some files give a few numbers each for many arrays
/// of the whole mesh, share bytes between arrays or compress well. The limit keeps them from multiplying
/// without end.
pub(super) fn array_limit(file_size: usize) -> usize {
    file_size.saturating_mul(128).saturating_add(64 << 20)
}

/// Checks that a file of `file_size` bytes may fill arrays of `numbers` numbers.
pub(super) fn check_filled(numbers: usize, file_size: usize) -> Result<(), Fault> {
    if numbers.saturating_mul(size_of::<f64>()) <= array_limit(file_size) {
        return Ok(());
    }
    Err(Fault::malformed(Place::File, "the arrays are far larger than the file"))
}

/// A point of a file, which must be finite. `number` is its number in the file.
pub(super) fn finite(x: f64, y: f64, z: f64, number: u64, place: Place) -> Result<Vector3, Fault> {
    if x.is_finite() && y.is_finite() && z.is_finite() {
        Ok(Vector3::new(x, y, z))
    } else {
        Err(Fault { place, problem: MeshFileProblem::NotFinite { point: number, x, y, z } })
    }
}

/// Reads the points of an array of coordinates, numbered from 0.
pub(super) fn finite_points(coordinates: &[f64], place: Place) -> Result<Vec<Vector3>, Fault> {
    index_limit(coordinates.len() / 3, place)?;
    let points = coordinates.chunks_exact(3).enumerate();
    points.map(|(i, x)| finite(x[0], x[1], x[2], i as u64, place)).collect()
}

/// Indices are `u32`: more points or cells than that are an error.
pub(super) fn index_limit(count: usize, place: Place) -> Result<(), Fault> {
    if count < u32::MAX as usize {
        return Ok(());
    }
    Err(Fault::unsupported(
        place,
        format!("{count} points or cells (the limit is {})", u32::MAX - 1),
        "use a coarser mesh",
    ))
}

/// The index of a node numbered from 0, if there are that many points.
pub(super) fn node(
    index: i64,
    points: usize,
    place: Place,
    cell: impl FnOnce() -> String,
) -> Result<u32, Fault> {
    match u32::try_from(index) {
        Ok(node) if (node as usize) < points => Ok(node),
        _ => Err(Fault { place, problem: MeshFileProblem::UndefinedNode { node: index, cell: cell() } }),
    }
}
