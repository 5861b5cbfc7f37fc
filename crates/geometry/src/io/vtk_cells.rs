//! Cells of VTK files (legacy and XML): cell types, and connectivity with offsets.

use super::cells::{Cells, FileKind, node};
use super::error::{Fault, MeshFileProblem, Place};
use crate::{CellKind, SplitKind};

/// VTK's number for a kind.
pub(super) const fn type_number(kind: CellKind) -> u8 {
    match kind {
        CellKind::Vertex => 1,
        CellKind::Line => 3,
        CellKind::Triangle => 5,
        CellKind::Quad => 9,
        CellKind::Tet => 10,
        CellKind::Hex => 12,
    }
}

/// Name and dimension of a VTK cell type that is not supported. Unknown types may be volumes.
fn unsupported(number: i64) -> (String, usize) {
    let (name, dimension) = match number {
        0 => ("empty cell", 0),
        15 => ("pentagonal prism", 3),
        16 => ("hexagonal prism", 3),
        21 => ("quadratic line (line3)", 1),
        22 => ("quadratic triangle (tri6)", 2),
        23 => ("quadratic quad (quad8)", 2),
        24 => ("quadratic tet (tet10)", 3),
        25 => ("quadratic hex (hex20)", 3),
        26 => ("quadratic wedge (wedge15)", 3),
        27 => ("quadratic pyramid (pyramid13)", 3),
        28 => ("quadratic quad (quad9)", 2),
        29 => ("quadratic hex (hex27)", 3),
        30 => ("quadratic-linear quad", 2),
        31 => ("quadratic-linear wedge", 3),
        32 => ("quadratic wedge (wedge18)", 3),
        33 => ("quadratic hex (hex24)", 3),
        34 => ("quadratic triangle (tri7)", 2),
        35 => ("cubic line (line4)", 1),
        36 => ("quadratic polygon", 2),
        37 => ("quadratic pyramid (pyramid19)", 3),
        41 => ("convex point set", 3),
        42 => ("polyhedron", 3),
        68 => ("Lagrange curve", 1),
        69 | 70 => ("Lagrange face", 2),
        71..=74 => ("Lagrange cell", 3),
        75 => ("Bézier curve", 1),
        76 | 77 => ("Bézier face", 2),
        78..=81 => ("Bézier cell", 3),
        _ => return (format!("VTK cell type {number}"), 3),
    };
    (format!("{name} (VTK type {number})"), dimension)
}

/// Cells as connectivity and the end of each cell in it.
#[derive(Default)]
pub(super) struct Connectivity {
    pub nodes: Vec<i64>,
    /// End of each cell in `nodes`.
    pub ends: Vec<i64>,
}

impl Connectivity {
    /// From the layout of old legacy files: for each cell its number of nodes and its nodes.
    pub(crate) fn from_counted(counted: &[i64], cells: usize, place: Place) -> Result<Self, Fault> {
        let mut connectivity =
            Self { nodes: Vec::with_capacity(counted.len().saturating_sub(cells)), ends: Vec::new() };
        let mut rest = counted;
        while let [count, nodes @ ..] = rest {
            let count = usize::try_from(*count).ok().filter(|&count| count <= nodes.len());
            let Some(count) = count else {
                let cell = connectivity.ends.len();
                return Err(Fault::malformed(
                    place,
                    format!("the number of nodes of cell {cell} is {}", rest[0]),
                ));
            };
            connectivity.nodes.extend_from_slice(&nodes[..count]);
            connectivity.ends.push(connectivity.nodes.len() as i64);
            rest = &nodes[count..];
        }
        if connectivity.ends.len() != cells {
            let what = format!("{cells} cells are announced, {} were found", connectivity.ends.len());
            return Err(Fault::malformed(place, what));
        }
        Ok(connectivity)
    }

    /// From offsets that begin with 0 and have one more entry than there are cells.
    pub(crate) fn from_offsets(offsets: Vec<i64>, nodes: Vec<i64>) -> Self {
        Self { nodes, ends: offsets.get(1..).map(<[i64]>::to_vec).unwrap_or_default() }
    }

    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// The nodes of each cell in turn; an error where the offsets do not fit the connectivity.
    fn each(
        &self,
        place: Place,
        mut use_cell: impl FnMut(usize, &[i64]) -> Result<(), Fault>,
    ) -> Result<(), Fault> {
        let mut start = 0;
        for (cell, &end) in self.ends.iter().enumerate() {
            let nodes = usize::try_from(end).ok().and_then(|end| {
                let nodes = self.nodes.get(start..end);
                start = end;
                nodes
            });
            let Some(nodes) = nodes else {
                let what =
                    format!("offset {end} of cell {cell} does not fit {} node numbers", self.nodes.len());
                return Err(Fault::malformed(place, what));
            };
            use_cell(cell, nodes)?;
        }
        Ok(())
    }
}

/// List of a poly-data file that cells are from.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum PolyList {
    Vertices,
    Lines,
    Polygons,
    Strips,
}

impl PolyList {
    const fn type_number(self) -> i64 {
        match self {
            Self::Vertices => 2,
            Self::Lines => 4,
            Self::Strips => 6,
            Self::Polygons => 7,
        }
    }
}

/// Adds the cells of a list of a poly-data file. Points are counted from `first`, of which there are
/// `points`.
pub(super) fn add_poly(
    cells: &mut Cells,
    list: PolyList,
    connectivity: &Connectivity,
    first: usize,
    points: usize,
    place: Place,
) -> Result<(), Fault> {
    let number = list.type_number();
    connectivity.each(place, |cell, nodes| add_cell(cells, number, cell, nodes, first, points, place))
}

/// Adds the cells of an unstructured grid. Points are counted from `first`, of which there are `points`.
pub(super) fn add_grid(
    cells: &mut Cells,
    types: &[i64],
    connectivity: &Connectivity,
    first: usize,
    points: usize,
    place: Place,
) -> Result<(), Fault> {
    if types.len() != connectivity.len() {
        let what = format!("there are {} cells but {} cell types", connectivity.len(), types.len());
        return Err(Fault::malformed(place, what));
    }
    connectivity.each(place, |cell, nodes| add_cell(cells, types[cell], cell, nodes, first, points, place))
}

fn add_cell(
    cells: &mut Cells,
    number: i64,
    cell: usize,
    nodes: &[i64],
    first: usize,
    points: usize,
    place: Place,
) -> Result<(), Fault> {
    cells.open();
    let wanted = match number {
        1 => 1,
        3 => 2,
        5 => 3,
        8..=10 => 4,
        11 | 12 => 8,
        13 => 6,
        14 => 5,
        2 | 4 | 6 | 7 => nodes.len(),
        _ => {
            let (name, dimension) = unsupported(number);
            cells.skip(name, dimension);
            return Ok(());
        }
    };
    if nodes.len() != wanted {
        let what = format!("cell {cell} of VTK type {number} has {} nodes, not {wanted}", nodes.len());
        return Err(Fault::malformed(place, what));
    }
    // Lists of polygons and strips may hold shorter cells; too short to be anything are only these.
    if nodes.len() < if number == 4 { 2 } else { 1 } {
        cells.skip(format!("cell of VTK type {number} with {} nodes", nodes.len()), 0);
        return Ok(());
    }
    let mut small = [0; 8];
    let mut long = Vec::new();
    let corners: &mut [u32] = if nodes.len() <= 8 {
        &mut small[..nodes.len()]
    } else {
        long.resize(nodes.len(), 0);
        &mut long
    };
    for (corner, &index) in corners.iter_mut().zip(nodes) {
        let found = node(index, points, place, || format!("cell {cell}"))? as usize + first;
        *corner = u32::try_from(found).map_err(|_| {
            let problem = MeshFileProblem::UndefinedNode { node: index, cell: format!("cell {cell}") };
            Fault { place, problem }
        })?;
    }
    match number {
        1 => cells.push(CellKind::Vertex, corners),
        6 | 7 if corners.len() == 1 => cells.push(CellKind::Vertex, corners),
        6 | 7 if corners.len() == 2 => cells.push(CellKind::Line, corners),
        2 => corners.iter().for_each(|&point| cells.push(CellKind::Vertex, &[point])),
        3 | 4 => corners.windows(2).for_each(|pair| cells.push(CellKind::Line, pair)),
        6 => {
            for (i, corner) in corners.windows(3).enumerate() {
                // Every other triangle of a strip runs the other way round.
                let [a, b] = if i % 2 == 0 { [0, 1] } else { [1, 0] };
                cells.push(CellKind::Triangle, &[corner[a], corner[b], corner[2]]);
            }
        }
        5 | 7 => cells.push_polygon(corners),
        8 => cells.push(CellKind::Quad, &[corners[0], corners[1], corners[3], corners[2]]),
        9 => cells.push(CellKind::Quad, corners),
        10 => cells.push(CellKind::Tet, corners),
        13 => cells.push_of(FileKind::Split(SplitKind::Wedge), corners),
        14 => cells.push_of(FileKind::Split(SplitKind::Pyramid), corners),
        11 => {
            let order = [0, 1, 3, 2, 4, 5, 7, 6];
            cells.push(CellKind::Hex, &order.map(|corner| corners[corner]));
        }
        _ => cells.push(CellKind::Hex, corners),
    }
    Ok(())
}
