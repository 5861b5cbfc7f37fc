//! Cells of a solid in their kinds, and their shapes at rest.

use super::{LEAST_FRACTION, picked};
use crate::element::{
    Cord, GaussPoints, HEX_EDGES, Hex8, Rest, Sheet, bar, gauss_points, hex8, membrane, tet4,
};
use crate::tensor::{Vector, add, cross, dot, sub};

/// Runs `$body` with `$bound` the concrete [`CellBlock`].
#[doc(hidden)]
#[macro_export]
macro_rules! with_cells {
    ($cells:expr, $bound:ident => $body:expr) => {
        match $cells {
            $crate::model::Cells::Tet4($bound) | $crate::model::Cells::AveragedTet4($bound, _) => $body,
            $crate::model::Cells::Hex8($bound) | $crate::model::Cells::FullHex8($bound, _) => $body,
            $crate::model::Cells::Membrane($bound, _) => $body,
            $crate::model::Cells::Bar($bound, _) => $body,
        }
    };
}
/// Cells of one element type.
#[derive(Clone, Debug)]
pub enum Cells {
    /// Linear tetrahedra.
    Tet4(CellBlock<4>),
    /// Linear tetrahedra with averaged pressure.
    AveragedTet4(CellBlock<4>, Averaging),
    /// Uniform-strain hexahedra.
    Hex8(CellBlock<8>),
    /// Hexahedra with eight Gauss points and one mean dilatation.
    FullHex8(CellBlock<8>, Vec<GaussPoints>),
    /// Triangles of a wall without bending, in plane stress, with the frame and the thickness of each.
    Membrane(CellBlock<3>, Vec<Sheet>),
    /// Bars, all with the same slack, linear in their stretch by the law's Young's modulus at small strain.
    Bar(CellBlock<2>, Cord),
}

/// Method by which tetrahedra average their pressure over nodes; see `forces/averaged.rs`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Averaging {
    /// Average nodal pressure (Bonet and Burton 1998): the recommended tetrahedron.
    Nodal,
    /// Improved average nodal pressure in a variational form.
    Variational,
    /// Improved average nodal pressure as in NiftySim; not the gradient of an energy.
    NiftySim,
}

/// Cells of `N` nodes at rest, struct of arrays.
#[derive(Clone, Debug)]
pub struct CellBlock<const N: usize> {
    /// Nodes of each cell, numbered in the model.
    pub nodes: Vec<[u32; N]>,
    /// Volume [m³], what of it is filled, and mean gradients [1/m] of each cell.
    pub rest: Vec<Rest<N>>,
    /// Stiffness against hourglass patterns; `None` for an element that has none.
    pub hourglass: Option<Hourglass<f64, N>>,
    /// X_a − X_0 [m] of the nodes of each hexahedron, whose corners are judged; empty for tetrahedra.
    pub offsets: Vec<[Vector<f64>; N]>,
}

/// Hourglass control: energy ½ k Σ_c |Σ_a γ_ca u_a|², or g times this energy.
#[derive(Clone, Debug)]
pub struct Hourglass<R, const N: usize> {
    /// The patterns γ, four per cell.
    pub patterns: Vec<[[R; N]; 4]>,
    /// The moments Y of their signs Γ [m], γ_ca = Γ_ca − B_a·Y_c.
    pub moments: Vec<[Vector<R>; 4]>,
    /// k = c μ V ΣB²/8 [N/m], one per cell.
    pub stiffness: Vec<R>,
    /// κ² [1/m²] of each cell: how far corners follow the patterns; see [`Hex8::corner_reach`].
    pub corner_reach: Vec<R>,
    /// True if the stiffness grows with the shear stiffness of the law, k g; see
    /// [`ShearGrowth`](crate::law::ShearGrowth).
    pub grows: bool,
}

impl<const N: usize> CellBlock<N> {
    pub(super) fn fill(&mut self, fractions: &[f64]) {
        for (rest, fraction) in self.rest.iter_mut().zip(fractions) {
            rest.volume *= fraction.max(LEAST_FRACTION);
        }
        if let Some(control) = &mut self.hourglass {
            for (stiffness, fraction) in control.stiffness.iter_mut().zip(fractions) {
                *stiffness *= fraction.max(LEAST_FRACTION);
            }
        }
    }

    pub(super) fn in_order(&self, order: &[u32]) -> Self {
        Self {
            nodes: picked(&self.nodes, order),
            rest: picked(&self.rest, order),
            hourglass: self.hourglass.as_ref().map(|control| Hourglass {
                patterns: picked(&control.patterns, order),
                moments: picked(&control.moments, order),
                stiffness: picked(&control.stiffness, order),
                corner_reach: picked(&control.corner_reach, order),
                grows: control.grows,
            }),
            offsets: if self.offsets.is_empty() { vec![] } else { picked(&self.offsets, order) },
        }
    }
}

impl Cells {
    /// Tetrahedra from their nodes.
    pub fn tet4(nodes: Vec<[u32; 4]>, rest: &[Vector<f64>]) -> Self {
        let quantities = nodes.iter().map(|cell| tet4(&cell.map(|n| rest[n as usize]))).collect();
        Self::Tet4(CellBlock { nodes, rest: quantities, hourglass: None, offsets: vec![] })
    }

    /// Hexahedra from their nodes; `hourglass` is the coefficient c, `shear` the modulus μ [Pa] that scales
    /// it.
    pub fn hex8(nodes: Vec<[u32; 8]>, rest: &[Vector<f64>], hourglass: f64, shear: f64) -> Self {
        let hexes: Vec<Hex8> = nodes.iter().map(|cell| hex8(&cell.map(|n| rest[n as usize]))).collect();
        let stiffness =
            |hex: &Hex8| hourglass * shear * hex.rest.volume * hex.rest.gradient_square_sum() / 8.0;
        Self::Hex8(CellBlock {
            offsets: offsets(&nodes, rest),
            nodes,
            rest: hexes.iter().map(|hex| hex.rest).collect(),
            hourglass: Some(Hourglass {
                patterns: hexes.iter().map(|hex| hex.hourglass).collect(),
                moments: hexes.iter().map(|hex| hex.moments).collect(),
                stiffness: hexes.iter().map(stiffness).collect(),
                corner_reach: hexes.iter().map(|hex| hex.corner_reach).collect(),
                grows: false,
            }),
        })
    }

    /// Lets the stiffness against hourglass patterns grow with the shear stiffness of the law. Without this
    /// growth evenly squeezed cells of a law that stiffens collapse into these patterns.
    pub fn with_growing_hourglass(mut self) -> Self {
        if let Self::Hex8(CellBlock { hourglass: Some(control), .. }) = &mut self {
            control.grows = true;
        }
        self
    }

    /// Tetrahedra with averaged pressure from their nodes.
    pub fn averaged_tet4(nodes: Vec<[u32; 4]>, rest: &[Vector<f64>], averaging: Averaging) -> Self {
        let quantities = nodes.iter().map(|cell| tet4(&cell.map(|n| rest[n as usize]))).collect();
        let block = CellBlock { nodes, rest: quantities, hourglass: None, offsets: vec![] };
        Self::AveragedTet4(block, averaging)
    }

    /// Hexahedra with eight Gauss points from their nodes.
    pub fn full_hex8(nodes: Vec<[u32; 8]>, rest: &[Vector<f64>]) -> Self {
        let corners = |cell: &[u32; 8]| cell.map(|n| rest[n as usize]);
        let quantities = nodes.iter().map(|cell| hex8(&corners(cell)).rest).collect();
        let points = nodes.iter().map(|cell| gauss_points(&corners(cell))).collect();
        let offsets = offsets(&nodes, rest);
        Self::FullHex8(CellBlock { nodes, rest: quantities, hourglass: None, offsets }, points)
    }

    /// Triangles of a membrane from their nodes and the thickness of each [m].
    ///
    /// # Panics
    /// If there are not as many thicknesses as triangles.
    pub fn membrane(nodes: Vec<[u32; 3]>, rest: &[Vector<f64>], thickness: &[f64]) -> Self {
        assert_eq!(thickness.len(), nodes.len(), "every triangle has a thickness");
        let of_cell = |(cell, &t): (&[u32; 3], &f64)| membrane(&cell.map(|n| rest[n as usize]), t);
        let (quantities, sheets) = nodes.iter().zip(thickness).map(of_cell).unzip();
        Self::Membrane(CellBlock { nodes, rest: quantities, hourglass: None, offsets: vec![] }, sheets)
    }

    /// Bars from their nodes and their cross section [m²].
    pub fn bar(nodes: Vec<[u32; 2]>, rest: &[Vector<f64>], area: f64, cord: Cord) -> Self {
        let quantities = nodes.iter().map(|cell| bar(&cell.map(|n| rest[n as usize]), area)).collect();
        Self::Bar(CellBlock { nodes, rest: quantities, hourglass: None, offsets: vec![] }, cord)
    }

    /// Fills each cell only in part, as cubes at the border of a body are. Volume, stiffness and mass are
    /// multiplied by the cell's fraction, at least [`LEAST_FRACTION`]. Gradients stay, and with them element
    /// bounds. One constant weight a cell is the simplest of the finite cells of Parvizian, Düster and Rank
    /// (2007).
    ///
    /// # Panics
    /// If there are not as many fractions as cells.
    pub fn filled(mut self, fractions: &[f64]) -> Self {
        assert_eq!(fractions.len(), self.len(), "every cell has a fraction");
        with_cells!(&mut self, block => block.fill(fractions));
        if let Self::FullHex8(_, points) = &mut self {
            for (points, fraction) in points.iter_mut().zip(fractions) {
                points.weight.iter_mut().for_each(|weight| *weight *= fraction.max(LEAST_FRACTION));
            }
        }
        self
    }

    /// Returns the cells in another order.
    pub(super) fn in_order(&self, order: &[u32]) -> Self {
        match self {
            Self::Tet4(block) => Self::Tet4(block.in_order(order)),
            Self::AveragedTet4(block, averaging) => Self::AveragedTet4(block.in_order(order), *averaging),
            Self::Hex8(block) => Self::Hex8(block.in_order(order)),
            Self::FullHex8(block, points) => Self::FullHex8(block.in_order(order), picked(points, order)),
            Self::Membrane(block, sheets) => Self::Membrane(block.in_order(order), picked(sheets, order)),
            Self::Bar(block, cord) => Self::Bar(block.in_order(order), *cord),
        }
    }

    /// Points of a cell at which the law is evaluated.
    pub fn points(&self) -> usize {
        if matches!(self, Self::FullHex8(..)) { 8 } else { 1 }
    }

    /// True where pressures are averaged, so that a point has no pressure alone.
    pub fn averages_pressure(&self) -> bool {
        matches!(self, Self::AveragedTet4(_, Averaging::Nodal | Averaging::Variational) | Self::FullHex8(..))
    }

    /// Number of averaged pressures.
    pub fn averaged_pressures(&self) -> usize {
        match self {
            Self::AveragedTet4(block, Averaging::Nodal) => LocalNodes::new(block).len(),
            Self::AveragedTet4(..) | Self::FullHex8(..) if self.averages_pressure() => self.len(),
            _ => 0,
        }
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        with_cells!(self, block => block.nodes.len())
    }

    /// True without any cell.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Nodes per cell.
    pub fn nodes_per_cell(&self) -> usize {
        match self {
            Self::Tet4(_) | Self::AveragedTet4(..) => 4,
            Self::Hex8(_) | Self::FullHex8(..) => 8,
            Self::Membrane(..) => 3,
            Self::Bar(..) => 2,
        }
    }

    /// The nodes of a cell.
    pub fn nodes(&self, cell: usize) -> &[u32] {
        with_cells!(self, block => block.nodes[cell].as_slice())
    }

    /// Rest volume [m³] of a cell, what of it is filled.
    pub fn volume(&self, cell: usize) -> f64 {
        with_cells!(self, block => block.rest[cell].volume)
    }

    /// The corner of a hexahedron at which det F is least, as its node and that determinant; `None` of
    /// others.
    pub fn worst_corner(&self, cell: usize, displacement: impl Fn(u32) -> Vector<f64>) -> Option<(u32, f64)> {
        let (Self::Hex8(block) | Self::FullHex8(block, _)) = self else { return None };
        let (nodes, rest) = (&block.nodes[cell], &block.offsets[cell]);
        let volume = |x: &[Vector<f64>; 8], corner: usize| {
            let [a, b, c] = HEX_EDGES[corner].map(|node| sub(x[node], x[corner]));
            dot(cross(a, b), c)
        };
        let moved = std::array::from_fn(|a| add(rest[a], displacement(nodes[a])));
        (0..8)
            .map(|corner| (nodes[corner], volume(&moved, corner) / volume(rest, corner)))
            .min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Σ |B_a|² [1/m²] of a cell.
    pub fn gradient_square_sum(&self, cell: usize) -> f64 {
        with_cells!(self, block => block.rest[cell].gradient_square_sum())
    }

    /// c μ [Pa] of a cell's hourglass control at rest; 0 without.
    pub fn hourglass_modulus(&self, cell: usize) -> f64 {
        let of_block = |block: &CellBlock<8>| {
            let stiffness = block.hourglass.as_ref().map_or(0.0, |control| control.stiffness[cell]);
            8.0 * stiffness / (block.rest[cell].volume * block.rest[cell].gradient_square_sum())
        };
        match self {
            Self::Hex8(block) => of_block(block),
            _ => 0.0,
        }
    }

    /// The name of the element in a scene file.
    pub fn element(&self) -> &'static str {
        match self {
            Self::Tet4(_) => "tet4",
            Self::AveragedTet4(_, Averaging::Nodal) => "tet4-anp",
            Self::AveragedTet4(_, Averaging::Variational) => "tet4-ianp",
            Self::AveragedTet4(_, Averaging::NiftySim) => "tet4-ianp-niftysim",
            Self::Hex8(_) => "hex8",
            Self::FullHex8(..) => "hex8-full",
            Self::Membrane(..) => "membrane",
            Self::Bar(..) => "bar",
        }
    }
}

/// X_a − X_0 [m] of hexahedra.
pub(super) fn offsets(nodes: &[[u32; 8]], rest: &[Vector<f64>]) -> Vec<[Vector<f64>; 8]> {
    let of_cell = |cell: &[u32; 8]| cell.map(|node| sub(rest[node as usize], rest[cell[0] as usize]));
    nodes.iter().map(of_cell).collect()
}

/// The nodes of some cells, numbered among themselves in increasing order, and the cells at each node.
#[derive(Clone, Debug)]
pub struct LocalNodes {
    /// Local nodes of each cell.
    pub nodes: Vec<[u32; 4]>,
    /// First entry of `incident` of each local node, one more than there are nodes.
    pub(super) offsets: Vec<u32>,
    /// Cells at each local node, increasing.
    pub(super) incident: Vec<u32>,
}

impl LocalNodes {
    /// Makes the local nodes of some cells.
    pub fn new(cells: &CellBlock<4>) -> Self {
        let mut global: Vec<u32> = cells.nodes.iter().flatten().copied().collect();
        global.sort_unstable();
        global.dedup();
        let local = |node: u32| global.partition_point(|&known| known < node) as u32;
        let nodes: Vec<[u32; 4]> = cells.nodes.iter().map(|cell| cell.map(local)).collect();
        let mut offsets = vec![0; global.len() + 1];
        nodes.iter().flatten().for_each(|&node| offsets[node as usize + 1] += 1);
        for node in 0..global.len() {
            offsets[node + 1] += offsets[node];
        }
        let mut next = offsets.clone();
        let mut incident = vec![0; 4 * nodes.len()];
        for (cell, node) in
            nodes.iter().enumerate().flat_map(|(cell, nodes)| nodes.iter().map(move |n| (cell, n)))
        {
            incident[next[*node as usize] as usize] = cell as u32;
            next[*node as usize] += 1;
        }
        Self { nodes, offsets, incident }
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.offsets.len() - 1
    }

    /// True without any node.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The cells at a node.
    pub fn cells_at(&self, node: usize) -> impl Iterator<Item = usize> + '_ {
        self.incident[self.offsets[node] as usize..self.offsets[node + 1] as usize]
            .iter()
            .map(|&cell| cell as usize)
    }
}
