//! The model: everything constant, built once and shared between threads. Arrays are in the order of the nodes, all
//! bodies one after another.

use std::borrow::Cow;
use std::ops::Range;

use crate::curve::Curve;
use crate::element::{
    Cord, GaussPoints, HEX_EDGES, Hex8, Rest, Sheet, bar, gauss_points, hex8, membrane, tet4,
};
use crate::law::AnyLaw;
use crate::load::{Face, Load, LoadKind, face_areas};
use crate::mapping::{Displaced, Weights};
use crate::order::order;
use crate::prony::Prony;
use crate::tensor::{Vector, add, cross, dot, scale, sub};
use crate::tie::Tie;

/// Bodies, what holds and loads them, and the surfaces they carry.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// Rest positions [m] of the nodes.
    pub rest: Vec<Vector<f64>>,
    /// Lumped masses [kg] of the nodes, those of their materials.
    pub mass: Vec<f64>,
    /// The bodies.
    pub bodies: Vec<Body>,
    /// The solid parts: one per body, element and law.
    pub solids: Vec<Solid>,
    /// Prescribed motions.
    pub constraints: Vec<Constraint>,
    /// Loads.
    pub loads: Vec<Load>,
    /// Surfaces carried by bodies.
    pub surfaces: Vec<Surface>,
    /// Nodes that follow others.
    pub ties: Vec<Tie>,
    /// Stiffness-proportional damping β [s].
    pub stiffness_damping: f64,
    /// Mass added for a larger stable step.
    pub mass_scaling: Option<MassScaling>,
    /// Velocities [m/s] of the nodes at time 0, for dynamics; nodes beyond its end are at rest.
    pub initial_velocity: Vec<Vector<f64>>,
}

/// Mass that is added to nodes for a larger critical time step; `pliant-explicit` finds it (`mass_scaling.rs`).
#[derive(Clone, Debug, PartialEq)]
pub struct MassScaling {
    /// The critical time step of the assembled model without it [s].
    pub unscaled_critical_step: f64,
    /// Mass added to each node [kg].
    pub added: Vec<f64>,
}

impl MassScaling {
    /// Added mass in all [kg].
    pub fn total(&self) -> f64 {
        self.added.iter().sum()
    }

    /// How many nodes are heavier.
    pub fn nodes(&self) -> usize {
        self.added.iter().filter(|&&added| added > 0.0).count()
    }
}

/// A body.
#[derive(Clone, Debug)]
pub struct Body {
    /// Its name.
    pub name: String,
    /// The nodes of its own.
    pub nodes: Range<u32>,
    /// The nodes of other bodies that its cells use, numbered in the model: those of a wall on the boundary of a solid.
    pub shared: Vec<u32>,
    /// Mass-proportional damping α [1/s].
    pub damping: f64,
}

impl Body {
    /// The model's number of a node of its mesh: its own nodes first, then those that it shares.
    pub fn node(&self, index: u32) -> u32 {
        let own = self.nodes.len() as u32;
        if index < own { self.nodes.start + index } else { self.shared[(index - own) as usize] }
    }

    /// The nodes of its mesh, numbered in the model.
    pub fn all_nodes(&self) -> impl Iterator<Item = u32> + '_ {
        self.nodes.clone().chain(self.shared.iter().copied())
    }
}

/// A law with its history, and the density.
#[derive(Clone, Debug)]
pub struct Material {
    /// The elastic law.
    pub law: AnyLaw,
    /// Its relaxation.
    pub prony: Prony,
    /// Mass per reference volume [kg/m³].
    pub density: f64,
}

impl Material {
    /// A law without relaxation, and the density [kg/m³].
    pub fn elastic(law: AnyLaw, density: f64) -> Self {
        Self { law, prony: Prony::default(), density }
    }
}

/// The cells of one body that share an element and a material.
#[derive(Clone, Debug)]
pub struct Solid {
    /// The body.
    pub body: usize,
    /// The material.
    pub material: Material,
    /// The cells with their element.
    pub cells: Cells,
    /// Unit fibre directions at rest, cell by cell as many as the law has families.
    pub fibre: Vec<Vector<f64>>,
    /// The number of each cell in the user's mesh, counted over the cells of its kind.
    pub original: Vec<u32>,
}

impl Solid {
    /// Cells of a body without fibres, in the order of the user's mesh.
    pub fn new(body: usize, material: Material, cells: Cells) -> Self {
        let original = (0..cells.len() as u32).collect();
        Self { body, material, cells, fibre: Vec::new(), original }
    }

    /// The directions of the families of fibres in a cell, at rest.
    pub fn fibres(&self, cell: usize) -> &[Vector<f64>] {
        let families = self.material.law.families();
        &self.fibre[cell * families..(cell + 1) * families]
    }

    /// The directions of the families of fibres in a cell as its law sees them: those at rest, in a membrane within the frame of the triangle.
    pub fn law_fibres(&self, cell: usize) -> Cow<'_, [Vector<f64>]> {
        let Cells::Membrane(_, sheets) = &self.cells else { return Cow::Borrowed(self.fibres(cell)) };
        let sheet = &sheets[cell];
        let in_plane = |&fibre: &Vector<f64>| {
            let [along, across] = sheet.axes.map(|axis| dot(fibre, axis));
            let length = along.hypot(across);
            [along / length, across / length, 0.0]
        };
        Cow::Owned(self.fibres(cell).iter().map(in_plane).collect())
    }

    /// An upper bound of ρc² [Pa] at rest: of a membrane that of plane stress, of a bar that of uniaxial stress.
    pub fn longitudinal_modulus(&self) -> f64 {
        match &self.cells {
            Cells::Membrane(..) => self.material.law.plane_modulus(),
            Cells::Bar(_, cord) => self.material.law.small_strain().young() / cord.slack,
            _ => self.material.law.longitudinal_modulus(),
        }
    }

    /// The shear modulus at rest [Pa] over which that of a state is the factor on the hourglass stiffness; `None` where that stiffness stays.
    pub fn hourglass_growth(&self) -> Option<f64> {
        let Cells::Hex8(CellBlock { hourglass: Some(control), .. }) = &self.cells else { return None };
        let law = &self.material.law;
        (control.grows && !law.keeps_shear_stiffness()).then(|| law.small_strain().shear)
    }

    /// Adds ρV/N [kg] of every cell to the masses of its nodes.
    pub fn add_mass(&self, mass: &mut [f64]) {
        for cell in 0..self.cells.len() {
            let nodes = self.cells.nodes(cell);
            let share = self.material.density * self.cells.volume(cell) / nodes.len() as f64;
            nodes.iter().for_each(|&node| mass[node as usize] += share);
        }
    }

    /// The same solid with neighbouring cells one after another.
    fn in_order(self, rest: &[Vector<f64>]) -> Self {
        let centre = |cell: usize| {
            let nodes = self.cells.nodes(cell);
            nodes.iter().fold([0.0; 3], |sum, &n| add(sum, scale(rest[n as usize], 1.0 / nodes.len() as f64)))
        };
        let centres: Vec<Vector<f64>> = (0..self.cells.len()).map(centre).collect();
        let order = order(&centres);
        Self {
            fibre: order.iter().flat_map(|&cell| self.fibres(cell as usize)).copied().collect(),
            original: order.iter().map(|&cell| self.original[cell as usize]).collect(),
            cells: self.cells.in_order(&order),
            ..self
        }
    }
}

/// The values of some cells, one after another.
fn picked<T: Clone>(values: &[T], cells: &[u32]) -> Vec<T> {
    cells.iter().map(|&cell| values[cell as usize].clone()).collect()
}

/// A cell counts as filled by so much at least: nodes that hang on slivers alone would move wildly.
pub const LEAST_FRACTION: f64 = 0.1;

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

/// How tetrahedra average their pressure over nodes; see `forces/averaged.rs`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Averaging {
    /// Average nodal pressure (Bonet and Burton 1998): the recommended tetrahedron.
    Nodal,
    /// Improved average nodal pressure in a variational form.
    Variational,
    /// Improved average nodal pressure as in NiftySim; not the gradient of an energy.
    NiftySim,
}

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
pub use with_cells;

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

/// Hourglass control: energy ½ k Σ_c |Σ_a γ_ca u_a|², or ½ k g of it.
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
    /// Whether the stiffness grows with the shear stiffness of the law, k g; see [`ShearGrowth`](crate::law::ShearGrowth).
    pub grows: bool,
}

impl<const N: usize> CellBlock<N> {
    fn fill(&mut self, fractions: &[f64]) {
        for (rest, fraction) in self.rest.iter_mut().zip(fractions) {
            rest.volume *= fraction.max(LEAST_FRACTION);
        }
        if let Some(control) = &mut self.hourglass {
            for (stiffness, fraction) in control.stiffness.iter_mut().zip(fractions) {
                *stiffness *= fraction.max(LEAST_FRACTION);
            }
        }
    }

    fn in_order(&self, order: &[u32]) -> Self {
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

    /// Hexahedra from their nodes; `hourglass` is the coefficient c, `shear` the modulus μ [Pa] that scales it.
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

    /// The same cells, whose stiffness against hourglass patterns grows with the shear stiffness of their law. Without it evenly squeezed
    /// cells of a law that stiffens collapse into these patterns.
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

    /// The same cells, each filled only in part, as cubes at the border of a body are: its volume and with it its stiffness
    /// and mass are those of its fraction, one per cell, of [`LEAST_FRACTION`] at least. Gradients stay, and with them element
    /// bounds. One constant weight a cell is the simplest of the finite cells of Parvizian, Düster and Rank (2007).
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

    /// The same cells in another order.
    fn in_order(&self, order: &[u32]) -> Self {
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

    /// True where pressures are averaged, so that a point has none of its own.
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

    /// The corner of a hexahedron at which det F is least, as its node and that determinant; `None` of others.
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
fn offsets(nodes: &[[u32; 8]], rest: &[Vector<f64>]) -> Vec<[Vector<f64>; 8]> {
    let of_cell = |cell: &[u32; 8]| cell.map(|node| sub(rest[node as usize], rest[cell[0] as usize]));
    nodes.iter().map(of_cell).collect()
}

/// The nodes of some cells, numbered among themselves in increasing order, and the cells at each of them.
#[derive(Clone, Debug)]
pub struct LocalNodes {
    /// Local nodes of each cell.
    pub nodes: Vec<[u32; 4]>,
    /// First entry of `incident` of each local node, one more than there are nodes.
    offsets: Vec<u32>,
    /// Cells at each local node, increasing.
    incident: Vec<u32>,
}

impl LocalNodes {
    /// From the cells.
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

/// A prescribed motion of some nodes.
#[derive(Clone, Debug)]
pub struct Constraint {
    /// Its name.
    pub name: String,
    /// The nodes.
    pub nodes: Vec<u32>,
    /// Which of x, y and z it prescribes, and which of the rotations about them, where nodes have some.
    pub components: [bool; 6],
    /// Where they go.
    pub motion: Motion,
}

impl Constraint {
    /// The force λ [N] with which a mean is held, w λ on each node, of the forces [N] that its nodes resist with: by least squares, exact in
    /// equilibrium. None for other motions.
    pub fn mean_force(&self, resisting: impl Fn(u32) -> Vector<f64>) -> Vector<f64> {
        let Motion::Mean { weights, .. } = &self.motion else { return [0.0; 3] };
        let squared: f64 = weights.iter().map(|w| w * w).sum();
        let sum = self.nodes.iter().zip(weights).fold([0.0; 3], |sum, (&node, &w)| {
            let force = resisting(node);
            [0, 1, 2].map(|c| if self.components[c] { sum[c] + w * force[c] } else { 0.0 })
        });
        scale(sum, 1.0 / squared)
    }

    /// The forces [N] with which a mean or an enclosed volume is held, node by node, of the forces [N] that its nodes resist with at some places [m]:
    /// by least squares over the components that are free, exact in equilibrium. None for other motions and on facets of shells.
    pub fn borne(
        &self,
        place: impl Fn(u32) -> Vector<f64>,
        resisting: impl Fn(u32) -> Vector<f64>,
        is_free: impl Fn(u32, usize) -> bool,
    ) -> Vec<Vector<f64>> {
        match &self.motion {
            Motion::Mean { weights, .. } => {
                let force = self.mean_force(resisting);
                weights.iter().map(|&weight| scale(force, weight)).collect()
            }
            Motion::Volume { enclosure, .. } => {
                let mut gradient = vec![[0.0; 3]; self.nodes.len()];
                enclosure.add_gradient(|at| place(self.nodes[at as usize]), &mut gradient);
                for (g, &node) in gradient.iter_mut().zip(&self.nodes) {
                    *g = [0, 1, 2].map(|c| if is_free(node, c) { g[c] } else { 0.0 });
                }
                let along = gradient.iter().zip(&self.nodes).map(|(g, &node)| dot(*g, resisting(node)));
                let pressure = along.sum::<f64>() / gradient.iter().map(|g| dot(*g, *g)).sum::<f64>();
                gradient.into_iter().map(|g| scale(g, pressure)).collect()
            }
            _ => Vec::new(),
        }
    }

    /// Displacement [m] that the nodes of a mean lack at a time [s], on average; zero of other constraints. `displacement` is that of a
    /// node [m].
    pub fn missing_mean(&self, time: f64, displacement: impl Fn(u32) -> Vector<f64>) -> Vector<f64> {
        let Motion::Mean { weights, by, curve } = &self.motion else { return [0.0; 3] };
        let add_node = |sum, (&node, &weight): (&u32, &f64)| add(sum, scale(displacement(node), weight));
        let mean = self.nodes.iter().zip(weights).fold([0.0; 3], add_node);
        let missing = sub(scale(*by, curve.value(time)), mean);
        [0, 1, 2].map(|c| if self.components[c] { missing[c] } else { 0.0 })
    }

    /// The amplitudes of each node's motion.
    fn amplitudes(&self) -> impl Iterator<Item = Amplitudes> + '_ {
        (0..self.nodes.len()).map(|index| self.motion.amplitudes(index))
    }
}

/// What the two factors of a motion multiply. All but rotations have one, the other is zero.
pub type Amplitudes = [Vector<f64>; 2];

/// How a prescribed motion goes over time.
#[derive(Clone, Debug)]
pub enum Motion {
    /// They stay where they are at rest.
    Fixed,
    /// Displacement [m] × curve.
    Displacement(Vector<f64>, Curve),
    /// Displacements [m], one per node of the constraint in their order, × curve.
    Displacements(Vec<Vector<f64>>, Curve),
    /// Displacements [m], one per node, with a rotation vector [rad] that turns each node about its own place, × curve. With all three
    /// rotations prescribed a node turns by exp(curve · vector) exactly, about any axis by any angle; with fewer, those components of
    /// its spin are. Constraints with courses of their own on the same node about different axes do not commute.
    Turn {
        /// The displacements [m].
        by: Vec<Vector<f64>>,
        /// The rotation vector [rad].
        turn: Vector<f64>,
        /// Their curve over time.
        curve: Curve,
    },
    /// Velocity [m/s] × curve; the displacement is its integral.
    Velocity(Vector<f64>, Curve),
    /// Rotation about an axis by an angle × curve, each node on its circle; see [`Motion::rotation`].
    Rotation {
        /// k × r and k × (k × r) [m] of each node of the constraint, in their order: k is the axis, r the arm from it.
        arms: Vec<Amplitudes>,
        /// The angle [rad].
        angle: f64,
        /// Its curve over time.
        curve: Curve,
    },
    /// The mean of their displacements goes by so much [m] × curve, with weights that sum to 1; each by itself is free, as under a plate
    /// that tilts.
    Mean {
        /// One for each node of the constraint.
        weights: Vec<f64>,
        /// Displacement [m].
        by: Vector<f64>,
        /// Its curve over time.
        curve: Curve,
    },
    /// Together they move as a rigid body, free in space.
    Rigid,
    /// The volume that faces enclose grows by so much [m³] × curve from what it is at rest; a uniform pressure on them does it.
    Volume {
        /// What encloses it.
        enclosure: Enclosure,
        /// The growth [m³].
        by: f64,
        /// Its curve over time.
        curve: Curve,
    },
}

/// A closed surface, made of faces of solids and membranes or of facets of shells.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Enclosure {
    /// Faces, numbered by the nodes of their constraint; normals outwards from what is enclosed.
    pub faces: Vec<Face>,
    /// Facets of shells, numbered in the model; normals outwards, too.
    pub facets: Vec<u32>,
}

impl Enclosure {
    /// The volume [m³] within the faces and its gradient [m²], which is added to one entry a node; `place` gives the places [m] of nodes. Facets of
    /// shells do not count here.
    pub fn add_gradient(&self, place: impl Fn(u32) -> Vector<f64>, gradient: &mut [Vector<f64>]) -> f64 {
        let mut sum = 0.0;
        for (node, area) in self.faces.iter().flat_map(|face| face_areas(face, &place)) {
            gradient[node as usize] = add(gradient[node as usize], area);
            sum += dot(place(node), area);
        }
        sum / 3.0
    }
}

/// Corrections of a volume at most: six make that of a ball eightfold.
const CORRECTIONS: usize = 50;

/// A volume that is off by no more, over itself, is where it should be.
const FILLED: f64 = 1e-12;

/// Moves the components of a state along the gradient of an enclosed volume until that is `wanted` [m³] (Newton's method). `volume` finds
/// the volume [m³] and its gradient; `advance` moves the state by a multiple of the gradient.
pub fn fill<S: ?Sized>(
    state: &mut S,
    wanted: f64,
    gradient: &mut [f64],
    volume: impl Fn(&S, &mut [f64]) -> f64,
    advance: impl Fn(&mut S, &[f64], f64),
) {
    for _ in 0..CORRECTIONS {
        let missing = wanted - volume(state, gradient);
        let squared: f64 = gradient.iter().map(|g| g * g).sum();
        if missing.abs() <= FILLED * wanted.abs() || squared == 0.0 {
            break;
        }
        advance(state, gradient, missing / squared);
    }
}

/// What a constraint of volume has at an instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Enclosed {
    /// The volume [m³].
    pub volume: f64,
    /// The pressure within [Pa], above that outside.
    pub pressure: f64,
}

impl Motion {
    /// Whether it binds nodes to each other and prescribes none by itself.
    pub fn is_collective(&self) -> bool {
        matches!(self, Self::Mean { .. } | Self::Rigid | Self::Volume { .. })
    }

    /// Whether it fills a volume.
    pub fn encloses(&self) -> bool {
        matches!(self, Self::Volume { .. })
    }

    /// Rotation of nodes about an axis through a centre [m], by an angle [rad] × curve, by Rodrigues' formula
    /// u = sin θ k × r + (1 − cos θ) k × (k × r). The axis need not be of unit length, nor zero.
    pub fn rotation(
        axis: Vector<f64>,
        centre: Vector<f64>,
        angle: f64,
        curve: Curve,
        rest: impl Iterator<Item = Vector<f64>>,
    ) -> Self {
        let axis = scale(axis, 1.0 / dot(axis, axis).sqrt());
        let arm = |place: Vector<f64>| {
            let across = cross(axis, sub(place, centre));
            [across, cross(axis, across)]
        };
        Self::Rotation { arms: rest.map(arm).collect(), angle, curve }
    }

    /// A displacement [m] and a rotation vector [rad] of each of so many nodes, × curve.
    pub fn turn(by: Vector<f64>, turn: Vector<f64>, nodes: usize, curve: Curve) -> Self {
        Self::Turn { by: vec![by; nodes], turn, curve }
    }

    /// What the factors multiply: the displacement [m], the velocity [m/s] or the arms [m] of the constraint's node at `index`.
    pub fn amplitudes(&self, index: usize) -> Amplitudes {
        let one = |amplitude| [amplitude, [0.0; 3]];
        match self {
            Self::Fixed | Self::Rigid | Self::Volume { .. } => one([0.0; 3]),
            Self::Displacement(by, _) | Self::Mean { by, .. } => one(*by),
            Self::Displacements(by, _) | Self::Turn { by, .. } => one(by[index]),
            Self::Velocity(velocity, _) => one(*velocity),
            Self::Rotation { arms, .. } => arms[index],
        }
    }

    /// Displacement over amplitudes at a time [s].
    pub fn factors(&self, time: f64) -> [f64; 2] {
        self.factors_of_part(time, 1.0)
    }

    /// Displacement over amplitudes where a part, from 0 to 1, of the way to where it is at a time [s] is gone.
    fn factors_of_part(&self, time: f64, part: f64) -> [f64; 2] {
        match self {
            Self::Fixed | Self::Rigid => [0.0; 2],
            Self::Displacement(_, curve)
            | Self::Displacements(_, curve)
            | Self::Turn { curve, .. }
            | Self::Mean { curve, .. }
            | Self::Volume { curve, .. } => [part * curve.value(time), 0.0],
            Self::Velocity(_, curve) => [part * curve.integral(time), 0.0],
            Self::Rotation { angle, curve, .. } => {
                let angle = part * angle * curve.value(time);
                // 1 − cos θ without cancellation.
                [angle.sin(), 2.0 * (0.5 * angle).sin().powi(2)]
            }
        }
    }

    /// Displacement [m] of the constraint's node at `index`, a part, from 0 to 1, of the way to where it is at a time [s].
    pub fn displacement(&self, index: usize, time: f64, part: f64) -> Vector<f64> {
        let (amplitudes, factors) = (self.amplitudes(index), self.factors_of_part(time, part));
        [0, 1, 2].map(|c| placed(component(&amplitudes, c), factors))
    }

    /// Displacement [m] and rotation vector [rad] of the constraint's node at `index` at a time [s].
    pub fn place(&self, index: usize, time: f64) -> [f64; 6] {
        let [x, y, z] = self.displacement(index, time, 1.0);
        let turn = match self {
            Self::Turn { turn, curve, .. } => scale(*turn, curve.value(time)),
            _ => [0.0; 3],
        };
        [x, y, z, turn[0], turn[1], turn[2]]
    }

    /// How far the constraint's node at `index` goes between two times [s]: its displacement [m] and its rotation vector [rad].
    pub fn increment(&self, index: usize, from: f64, to: f64) -> [f64; 6] {
        let shift = match self {
            Self::Fixed | Self::Rigid | Self::Volume { .. } => [0.0; 3],
            // The difference of the factors first: it is exact to more digits than that of places.
            Self::Displacement(_, curve)
            | Self::Displacements(_, curve)
            | Self::Turn { curve, .. }
            | Self::Mean { curve, .. } => {
                scale(self.amplitudes(index)[0], curve.value(to) - curve.value(from))
            }
            Self::Velocity(..) | Self::Rotation { .. } => {
                sub(self.displacement(index, to, 1.0), self.displacement(index, from, 1.0))
            }
        };
        let spin = match self {
            Self::Turn { turn, curve, .. } => scale(*turn, curve.value(to) - curve.value(from)),
            _ => [0.0; 3],
        };
        [shift[0], shift[1], shift[2], spin[0], spin[1], spin[2]]
    }

    /// Whether two motions of the same amplitudes are the same at all times.
    fn follows(&self, other: &Self) -> bool {
        let curve = |motion: &Self| match motion {
            Self::Fixed | Self::Rigid => None,
            Self::Displacement(_, curve)
            | Self::Displacements(_, curve)
            | Self::Turn { curve, .. }
            | Self::Mean { curve, .. }
            | Self::Volume { curve, .. } => Some((0, 0.0, curve.clone())),
            Self::Velocity(_, curve) => Some((1, 0.0, curve.clone())),
            Self::Rotation { angle, curve, .. } => Some((2, *angle, curve.clone())),
        };
        curve(self) == curve(other)
    }
}

impl Motion {
    /// Whether two motions turn nodes in the same way at all times.
    fn turns_as(&self, other: &Self) -> bool {
        let curve = |motion: &Self| match motion {
            Self::Turn { turn, curve, .. } if *turn != [0.0; 3] => Some((*turn, curve.clone())),
            _ => None,
        };
        curve(self) == curve(other)
    }
}

/// The amplitudes of a component.
#[inline(always)]
pub fn component([first, second]: &Amplitudes, c: usize) -> [f64; 2] {
    [first[c], second[c]]
}

/// A component of a displacement [m] from its amplitudes and factors.
#[inline(always)]
pub fn placed(amplitudes: [f64; 2], factors: [f64; 2]) -> f64 {
    amplitudes[0] * factors[0] + amplitudes[1] * factors[1]
}

/// A surface carried by a body.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Its name.
    pub name: String,
    /// The body that carries it.
    pub body: usize,
    /// Rest positions [m] of its points.
    pub rest: Vec<Vector<f64>>,
    /// How it follows the body's nodes (numbered in the model).
    pub mapping: Weights,
}

/// Two constraints, or a constraint and a tie, that ask for different things of one node.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("`{first}` and `{second}` both prescribe {} of node {node} of `{body}`, and differently", COMPONENTS[*component])]
pub struct Contradiction {
    /// The first constraint.
    pub first: String,
    /// The second constraint.
    pub second: String,
    /// The body.
    pub body: String,
    /// The node, numbered in its body.
    pub node: u32,
    /// 0 to 5 for x, y, z and the rotations about them.
    pub component: usize,
}

/// Components of nodes in words.
const COMPONENTS: [&str; 6] =
    ["x", "y", "z", "the rotation about x", "the rotation about y", "the rotation about z"];

/// No constraint on a component of a node.
pub const FREE: u32 = u32::MAX;

impl Model {
    /// Adds a body of nodes at rest [m], without mass or damping; its number. Solids give it cells and mass, constraints hold it.
    ///
    /// ```
    /// use pliant_mechanics::Model;
    /// use pliant_mechanics::law::{AnyLaw, NeoHookean, Volumetric};
    /// use pliant_mechanics::load::Load;
    /// use pliant_mechanics::model::{Cells, Material, Solid};
    ///
    /// let mut model = Model::default();
    /// let tet = model.add_body("tet", &[[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]]);
    /// let law = AnyLaw::NeoHookean(NeoHookean { shear: 1000.0, volumetric: Volumetric::quadratic(10_000.0) });
    /// let cells = Cells::tet4(vec![[0, 1, 2, 3]], &model.rest);
    /// model.add_solid(Solid::new(tet, Material::elastic(law, 1000.0), cells));
    /// model.fix("base", vec![0, 1, 2]);
    /// model.loads.push(Load::gravity(tet, [0.0, 0.0, -9.81]));
    /// assert!((model.mass.iter().sum::<f64>() - 1000.0 * 0.1_f64.powi(3) / 6.0).abs() < 1e-12);
    /// ```
    pub fn add_body(&mut self, name: &str, rest: &[Vector<f64>]) -> usize {
        let first = self.rest.len() as u32;
        self.rest.extend_from_slice(rest);
        self.mass.resize(self.rest.len(), 0.0);
        let nodes = first..self.rest.len() as u32;
        self.bodies.push(Body { name: name.into(), nodes, shared: Vec::new(), damping: 0.0 });
        self.bodies.len() - 1
    }

    /// Adds a body on nodes that other bodies have, such as a wall on the boundary of a solid; its number. The nodes stay those of their
    /// bodies: damping, gravity and velocity at the start are theirs.
    pub fn add_body_on(&mut self, name: &str, shared: Vec<u32>) -> usize {
        let body = self.add_body(name, &[]);
        self.bodies[body].shared = shared;
        body
    }

    /// Fixes nodes where they are at rest; the number of the constraint.
    pub fn fix(&mut self, name: &str, nodes: Vec<u32>) -> usize {
        self.constrain(name, nodes, Motion::Fixed)
    }

    /// Prescribes the motion of nodes along all axes; the number of the constraint.
    pub fn constrain(&mut self, name: &str, nodes: Vec<u32>, motion: Motion) -> usize {
        self.constraints.push(Constraint { name: name.into(), nodes, components: [true; 6], motion });
        self.constraints.len() - 1
    }

    /// Adds ρV/N of every cell of a solid to its nodes. The cells are brought into an order that is good for the caches;
    /// [`Solid::original`] goes along.
    ///
    /// # Panics
    /// If not every cell has a direction for each of the law's families of fibres.
    pub fn add_solid(&mut self, solid: Solid) {
        let needed = solid.material.law.families() * solid.cells.len();
        assert_eq!(solid.fibre.len(), needed, "every cell has a direction for each family of fibres");
        let solid = solid.in_order(&self.rest);
        solid.add_mass(&mut self.mass);
        self.solids.push(solid);
    }

    /// The mass [kg] with which a node resists acceleration: that of the material and what mass scaling adds.
    pub fn inertia(&self, node: usize) -> f64 {
        self.mass[node] + self.mass_scaling.as_ref().map_or(0.0, |scaling| scaling.added[node])
    }

    /// The same model with threads that are taut: its vibrations are the fastest that they allow.
    pub fn with_taut_threads(&self) -> Cow<'_, Self> {
        let is_thread = |solid: &Solid| matches!(solid.cells, Cells::Bar(_, Cord { tension_only: true, .. }));
        if !self.solids.iter().any(is_thread) {
            return Cow::Borrowed(self);
        }
        let mut taut = self.clone();
        for solid in &mut taut.solids {
            if let Cells::Bar(_, cord) = &mut solid.cells {
                cord.tension_only = false;
            }
        }
        Cow::Owned(taut)
    }

    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.rest.len()
    }

    /// Number of cells.
    pub fn cell_count(&self) -> usize {
        self.solids.iter().map(|solid| solid.cells.len()).sum()
    }

    /// The body that a node is of and the node's number in it.
    pub fn locate_node(&self, node: u32) -> (usize, u32) {
        let body = self.bodies.partition_point(|body| body.nodes.end <= node);
        (body, node - self.bodies[body].nodes.start)
    }

    /// The forces [N] of loads on each node at a time [s] and displacements [m], without weights and without what only shells take.
    pub fn load_forces(&self, time: f64, displacement: &[Vector<f64>]) -> Vec<Vector<f64>> {
        let state = Displaced { rest: &self.rest, displacement, velocity: &[] };
        let mut forces = vec![[0.0; 3]; self.node_count()];
        for load in &self.loads {
            let points = load.surface.map(|surface| &self.surfaces[surface].mapping);
            load.add_forces(time, points, &state, &mut forces);
        }
        forces
    }

    /// The weight [N] of each node at a time [s].
    pub fn weights(&self, time: f64) -> Vec<Vector<f64>> {
        let mut weights = vec![[0.0; 3]; self.node_count()];
        for load in &self.loads {
            let LoadKind::Gravity { body, acceleration } = load.kind else { continue };
            let acceleration = scale(acceleration, load.curve.value(time));
            for node in self.bodies[body].nodes.clone() {
                let own = &mut weights[node as usize];
                *own = add(*own, scale(acceleration, self.mass[node as usize]));
            }
        }
        weights
    }

    /// The constraint on each component of each node, [`FREE`] where there is none. Two constraints may prescribe the
    /// same motion of a component (the first keeps the reaction).
    ///
    /// # Errors
    /// If two constraints prescribe different motions for one component of a node.
    pub fn constrained_components(&self) -> Result<Vec<[u32; 3]>, Contradiction> {
        let mut owners = vec![[FREE; 3]; self.node_count()];
        let mut amplitudes = vec![[[0.0; 2]; 3]; self.node_count()];
        let alone = |(_, constraint): &(usize, &Constraint)| !constraint.motion.is_collective();
        for (index, constraint) in self.constraints.iter().enumerate().filter(alone) {
            for (&node, own) in constraint.nodes.iter().zip(constraint.amplitudes()) {
                for component in (0..3).filter(|&c| constraint.components[c]) {
                    let own = self::component(&own, component);
                    let owner = &mut owners[node as usize][component];
                    let known = &mut amplitudes[node as usize][component];
                    if *owner == FREE {
                        (*owner, *known) = (index as u32, own);
                        continue;
                    }
                    let first = &self.constraints[*owner as usize];
                    let still = *known == [0.0; 2];
                    if *known != own || !(still || first.motion.follows(&constraint.motion)) {
                        return Err(self.contradiction([*owner, index as u32], node, component));
                    }
                }
            }
        }
        self.check_rotations()?;
        let bound = self.check_collective(&owners)?;
        for tie in &self.ties {
            for (&node, held) in tie.nodes.iter().zip(&tie.held) {
                let alone = owners[node as usize].into_iter().zip(0..).filter(|&(_, c)| !held[c]);
                let own = alone.chain([(bound[node as usize], 0)]);
                if let Some((first, component)) = own.into_iter().find(|&(first, _)| first != FREE) {
                    let first = self.constraints[first as usize].name.clone();
                    let (body, node) = self.locate_node(node);
                    let (second, body) = (tie.name.clone(), self.bodies[body].name.clone());
                    return Err(Contradiction { first, second, body, node, component });
                }
            }
        }
        Ok(owners)
    }

    /// The first constraint that binds nodes to each other: no GPU and no explicit shell holds them.
    pub fn collective(&self) -> Option<&Constraint> {
        self.constraints.iter().find(|constraint| constraint.motion.is_collective())
    }

    /// The constraint that binds each node to others, [`FREE`] where there is none: one at most, and no other holds the node.
    fn check_collective(&self, owners: &[[u32; 3]]) -> Result<Vec<u32>, Contradiction> {
        let mut bound = vec![FREE; self.node_count()];
        for (index, constraint) in self.constraints.iter().enumerate() {
            for &node in constraint.nodes.iter().filter(|_| constraint.motion.is_collective()) {
                let known = std::mem::replace(&mut bound[node as usize], index as u32);
                let held = |c: usize| constraint.components[c] && owners[node as usize][c] != FREE;
                if known != FREE {
                    return Err(self.contradiction([known, index as u32], node, 0));
                }
                if let Some(component) = (0..3).find(|&c| held(c)) {
                    let owner = owners[node as usize][component];
                    return Err(self.contradiction([owner, index as u32], node, component));
                }
            }
        }
        Ok(bound)
    }

    /// Whether no two constraints turn a node differently.
    fn check_rotations(&self) -> Result<(), Contradiction> {
        let turned = |constraint: &Constraint| constraint.components[3..].contains(&true);
        if !self.constraints.iter().any(|own| turned(own) && matches!(own.motion, Motion::Turn { .. })) {
            return Ok(());
        }
        let mut owners = vec![[FREE; 3]; self.node_count()];
        for (index, constraint) in self.constraints.iter().enumerate().filter(|(_, own)| turned(own)) {
            for &node in &constraint.nodes {
                for c in (0..3).filter(|&c| constraint.components[3 + c]) {
                    let owner = &mut owners[node as usize][c];
                    if *owner == FREE {
                        *owner = index as u32;
                    } else if !self.constraints[*owner as usize].motion.turns_as(&constraint.motion) {
                        return Err(self.contradiction([*owner, index as u32], node, 3 + c));
                    }
                }
            }
        }
        Ok(())
    }

    fn contradiction(&self, constraints: [u32; 2], node: u32, component: usize) -> Contradiction {
        let [first, second] = constraints.map(|index| self.constraints[index as usize].name.clone());
        let (body, node) = self.locate_node(node);
        Contradiction { first, second, body: self.bodies[body].name.clone(), node, component }
    }

    /// The amplitudes of the motion of each component that has an owner (see [`Motion::amplitudes`]); 0 for the others.
    pub fn amplitudes(&self, owners: &[[u32; 3]]) -> Vec<Amplitudes> {
        let mut amplitudes = vec![Amplitudes::default(); self.node_count()];
        for (index, constraint) in self.constraints.iter().enumerate() {
            for (&node, own) in constraint.nodes.iter().zip(constraint.amplitudes()) {
                for c in (0..3).filter(|&c| owners[node as usize][c] == index as u32) {
                    for (to, from) in amplitudes[node as usize].iter_mut().zip(own) {
                        to[c] = from[c];
                    }
                }
            }
        }
        amplitudes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::Shape;

    /// Two constraints of one node: what holds it does not turn it, and turning it twice in the same way is no contradiction.
    #[test]
    fn nodes_are_turned_in_one_way_only() {
        let ramp = |to| Curve { shape: Shape::Ramp, from: 0.0, to };
        let turn = |angle: f64, to: f64| Motion::turn([0.0; 3], [0.0, angle, 0.0], 1, ramp(to));
        let with = |first: Motion, second: Motion| {
            let mut model = Model::default();
            model.add_body("wall", &[[0.0; 3], [1.0, 0.0, 0.0]]);
            for (name, motion) in [("clamp", first), ("hand", second)] {
                let components = [false, false, false, true, true, true];
                model.constraints.push(Constraint { name: name.into(), nodes: vec![1], components, motion });
            }
            model.constrained_components().map(|_| ())
        };
        for same in [Motion::Fixed, turn(0.3, 1.0)] {
            assert_eq!(with(same.clone(), same), Ok(()));
        }
        assert_eq!(with(Motion::Fixed, turn(0.0, 1.0)), Ok(()));
        for (first, second) in [
            (Motion::Fixed, turn(0.3, 1.0)),
            (turn(0.3, 1.0), turn(0.2, 1.0)),
            (turn(0.3, 1.0), turn(0.3, 2.0)),
        ] {
            let told = with(first, second).unwrap_err().to_string();
            let wanted =
                "`clamp` and `hand` both prescribe the rotation about x of node 1 of `wall`, and differently";
            assert_eq!(told, wanted);
        }
    }
}
