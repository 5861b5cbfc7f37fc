//! Blocks of neighbouring cells or nodes, small enough for the memory that a group of invocations shares.

use pliant_mechanics::model::{Cells, Model, Solid};
use pliant_mechanics::tensor::{Vector, add, cross, dot, scale, sub};

use crate::kernel::{Binding, Bound, GROUP, GROUP_NAME, Memory};
use crate::loads::DeviceLoads;
use crate::{Device, GpuError};

/// Most nodes of a block: a corner takes one byte.
const MOST_NODES: usize = 255;

/// Tetrahedra of a block of cells, one an invocation: more than [`GROUP`], since they share more of their
/// nodes.
const TETS: usize = 256;

/// A block; twin of those in block_cells.wgsl and node_blocks.wgsl.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Block {
    first_cell: u32,
    cells: u32,
    first_node: u32,
    nodes: u32,
}

/// The blocks of a solid on the device.
pub(crate) struct DeviceBlocks {
    pub bound: Bound,
    /// Number of blocks.
    pub count: usize,
    /// The cells, block by block; some are in several blocks.
    pub order: Vec<u32>,
    /// The nodes of all blocks.
    pub nodes: Vec<u32>,
    /// Constants of the kernel.
    pub constants: Vec<(&'static str, usize)>,
}

/// The nodes of some cells, increasing.
fn nodes_of(cells: &Cells, block: &[u32]) -> Vec<u32> {
    sorted(block.iter().flat_map(|&cell| cells.nodes(cell as usize)).copied().collect())
}

fn sorted(mut numbers: Vec<u32>) -> Vec<u32> {
    numbers.sort_unstable();
    numbers.dedup();
    numbers
}

/// Cuts things at some places into blocks by halving along the longest side.
struct Bisection<'a> {
    places: &'a [Vector<f64>],
    /// Blocks have a multiple of this number where possible, so that all but the last are full.
    whole: usize,
    fits: &'a dyn Fn(&[u32]) -> bool,
}

impl Bisection<'_> {
    /// Puts what lies together next to each other; ends of blocks in `ends`. One alone is a block whether it
    /// fits or not.
    fn cut(&self, order: &mut [u32], first: usize, ends: &mut Vec<usize>) {
        if order.len() <= 1 || order.len() <= self.whole && (self.fits)(order) {
            if !order.is_empty() {
                ends.push(first + order.len());
            }
            return;
        }
        let along = |c: usize| order.iter().map(move |&item| self.places[item as usize][c]);
        let extent =
            |c: usize| along(c).fold(f64::NEG_INFINITY, f64::max) - along(c).fold(f64::INFINITY, f64::min);
        let axis = (0..3).max_by(|&a, &b| extent(a).total_cmp(&extent(b))).unwrap_or(0);
        let wholes = order.len().div_ceil(self.whole);
        let middle = if wholes > 1 { wholes / 2 * self.whole } else { order.len() / 2 };
        let place = |item: u32| self.places[item as usize][axis];
        order.select_nth_unstable_by(middle, |&a, &b| place(a).total_cmp(&place(b)).then(a.cmp(&b)));
        let (left, right) = order.split_at_mut(middle);
        self.cut(left, first, ends);
        self.cut(right, first + middle, ends);
    }
}

impl DeviceBlocks {
    /// Blocks of the cells of a solid.
    ///
    /// # Errors
    /// If an array is too large, or groups share too little memory.
    pub(crate) fn of_cells(
        memory: &Memory<'_>,
        device: &Device,
        model: &Model,
        solid: &Solid,
    ) -> Result<Self, GpuError> {
        let cells = &solid.cells;
        let per_cell = cells.nodes_per_cell();
        // Displacements and places at rest of all nodes, forces and energies of all cells, and a force that
        // is zero.
        let needed = |group: usize| 4 * (2 * 3 * MOST_NODES + (3 * per_cell + 1) * group + 4);
        let adapter = device.adapter();
        let group = match cells {
            Cells::Tet4(_)
                if adapter.group_size as usize >= TETS && adapter.shared_memory as usize >= needed(TETS) =>
            {
                TETS
            }
            _ => GROUP as usize,
        };
        device.shares(needed(group))?;
        let centre = |cell: usize| {
            let sum =
                cells.nodes(cell).iter().fold([0.0; 3], |sum, &node| add(sum, model.rest[node as usize]));
            scale(sum, 1.0 / per_cell as f64)
        };
        let centres: Vec<_> = (0..cells.len()).map(centre).collect();
        let mut order: Vec<u32> = (0..cells.len() as u32).collect();
        let mut ends = Vec::new();
        let fits = |block: &[u32]| nodes_of(cells, block).len() <= MOST_NODES;
        Bisection { places: &centres, whole: group, fits: &fits }.cut(&mut order, 0, &mut ends);
        let mut blocks = Vec::new();
        let (mut nodes, mut rest, mut offsets, mut given) = (Vec::new(), Vec::new(), vec![0_u32], Vec::new());
        let mut corners = vec![[0_u8; 4]; cells.len() * per_cell.div_ceil(4)];
        let mut first = 0;
        for end in ends {
            // In the order of the model, so that histories and shapes are read in long runs.
            order[first..end].sort_unstable();
            let block_nodes = nodes_of(cells, &order[first..end]);
            let mut at_nodes = vec![Vec::new(); block_nodes.len()];
            for (place, &cell) in order[first..end].iter().enumerate() {
                for (a, node) in cells.nodes(cell as usize).iter().enumerate() {
                    let local = block_nodes.partition_point(|known| known < node);
                    corners[a / 4 * cells.len() + first + place][a % 4] = local as u8;
                    at_nodes[local].push((a * group + place) as u16);
                }
            }
            let origin = model.rest[block_nodes[0] as usize];
            rest.extend(
                block_nodes.iter().flat_map(|&node| sub(model.rest[node as usize], origin)).map(|x| x as f32),
            );
            for at_node in at_nodes {
                given.extend(at_node);
                given.resize(given.len().next_multiple_of(8), (per_cell * group) as u16);
                offsets.push((given.len() / 8) as u32);
            }
            blocks.push(Block {
                first_cell: first as u32,
                cells: (end - first) as u32,
                first_node: nodes.len() as u32,
                nodes: block_nodes.len() as u32,
            });
            nodes.extend(block_nodes);
            first = end;
        }
        let arrays = [
            memory.filled("the blocks of cells", &blocks)?,
            memory.filled("the nodes of blocks", &nodes)?,
            memory.filled("the cells", &corners)?,
            memory.filled("the nodes of blocks", &offsets)?,
            memory.filled("the corners at nodes", &given)?,
            memory.filled("the nodes of blocks", &rest)?,
        ];
        let bound = Bound::new(device, &arrays.each_ref().map(Binding::Read));
        let constants = vec![("MOST_NODES", MOST_NODES), ("CORNERS", per_cell), (GROUP_NAME, group)];
        Ok(Self { bound, count: blocks.len(), order, nodes, constants })
    }

    /// Blocks of nodes, the first of them number `first_block` of all; their kernel also reads the loads.
    ///
    /// # Errors
    /// If an array is too large.
    pub(crate) fn of_nodes(
        memory: &Memory<'_>,
        device: &Device,
        cut: NodeBlocks,
        first_block: usize,
        loads: Option<&DeviceLoads>,
    ) -> Result<Self, GpuError> {
        let arrays = [
            memory.filled("the blocks of nodes", &cut.blocks)?,
            memory.filled("the nodes of blocks", &cut.nodes)?,
            memory.filled("the cells of blocks", &cut.corners)?,
        ];
        let mut bindings = loads.map_or([Binding::Nothing; 4], DeviceLoads::bindings).to_vec();
        bindings.extend(arrays.each_ref().map(Binding::Read));
        let constants = vec![
            ("MOST_NODES", cut.most_nodes),
            ("MOST_OWN", MOST_OWN),
            ("CORNER_BITS", cut.corner_bits),
            ("BLOCKS", cut.blocks.len()),
            ("FIRST_BLOCK", first_block),
        ];
        let bound = Bound::new(device, &bindings);
        Ok(Self { bound, count: cut.blocks.len(), order: cut.cells, nodes: cut.nodes, constants })
    }
}

/// Most nodes that a block of nodes moves: 4³, where hexahedra are evaluated 1.95 times each and tetrahedra
/// 1.78 times.
const MOST_OWN: usize = 64;

/// A node of a block of which an earlier solid has left forces.
const TAKES: u32 = 1 << 31;

/// A node of a block that a later solid moves.
const LEAVES: u32 = 1 << 30;

/// Shared memory of a block of nodes [B]: what adds up work, a whole force of each node it moves, and
/// displacements.
fn shared_memory(nodes: usize) -> usize {
    16 * GROUP as usize + 16 * MOST_OWN + 16 + 12 * nodes
}

/// True if the shapes of cells at rest are found from the places of their nodes. This holds for linear
/// tetrahedra that are full.
pub(crate) fn finds_shapes(cells: &Cells) -> bool {
    let Cells::Tet4(block) = cells else { return false };
    block.rest.iter().all(|rest| {
        let [_, a, b, c] = rest.gradient;
        (6.0 * rest.volume * dot(a, cross(b, c)) - 1.0).abs() < 1e-9
    })
}

/// The nodes of a solid, cut into blocks with all cells at them.
pub(crate) struct NodeBlocks {
    blocks: Vec<Block>,
    /// The nodes of all blocks, with what they take and leave; in each block first those that it moves.
    nodes: Vec<u32>,
    /// The cells of all blocks; those at borders are in several blocks.
    cells: Vec<u32>,
    /// Corners of the cells among the nodes of their block, in rows of all cells.
    corners: Vec<u32>,
    /// Bits of a corner.
    corner_bits: usize,
    /// Most nodes of a block.
    most_nodes: usize,
}

impl NodeBlocks {
    /// Cuts each solid. The last solid at a node moves it; the last solid of all moves nodes without solids.
    ///
    /// # Errors
    /// If the data of one node do not fit into the memory that a group shares.
    pub(crate) fn of_solids(device: &Device, model: &Model) -> Result<Vec<Self>, GpuError> {
        let cells_of = |solid: &Solid| (0..solid.cells.len() as u32).collect::<Vec<_>>();
        let mut nodes: Vec<_> =
            model.solids.iter().map(|solid| nodes_of(&solid.cells, &cells_of(solid))).collect();
        let last = model.solids.len().saturating_sub(1);
        let mut of_node = vec![(u32::MAX, last as u32); model.node_count()];
        for (solid, nodes) in (0..).zip(&nodes) {
            for &node in nodes {
                let (first, last) = &mut of_node[node as usize];
                (*first, *last) = (solid.min(*first), solid);
            }
        }
        let strays = (0..).zip(&of_node).filter(|(_, (first, _))| *first == u32::MAX).map(|(node, _)| node);
        if let Some(nodes) = nodes.last_mut() {
            nodes.extend(strays);
        }
        let cut = |(index, solid, nodes): (u32, &Solid, Vec<u32>)| {
            let marked = |node: u32| {
                let (first, last) = of_node[node as usize];
                let takes = if first < index { TAKES } else { 0 };
                node | takes | if last > index { LEAVES } else { 0 }
            };
            Self::cut(device, model, solid, nodes, &marked)
        };
        let solids = (0..).zip(&model.solids).zip(nodes);
        solids.map(|((index, solid), nodes)| cut((index, solid, nodes))).collect()
    }

    /// Returns the number of blocks.
    pub(crate) fn len(&self) -> usize {
        self.blocks.len()
    }

    fn cut(
        device: &Device,
        model: &Model,
        solid: &Solid,
        mut order: Vec<u32>,
        marked: &dyn Fn(u32) -> u32,
    ) -> Result<Self, GpuError> {
        let cells = &solid.cells;
        let mut at_node = vec![Vec::new(); model.node_count()];
        for cell in 0..cells.len() {
            cells.nodes(cell).iter().for_each(|&node| at_node[node as usize].push(cell as u32));
        }
        let cells_at =
            |owned: &[u32]| sorted(owned.iter().flat_map(|&n| &at_node[n as usize]).copied().collect());
        let limit = device.adapter().shared_memory as usize;
        let most = (limit.saturating_sub(shared_memory(0)) / 12).min(MOST_NODES);
        let fits = |owned: &[u32]| nodes_of(cells, &cells_at(owned)).len() <= most;
        let mut ends = Vec::new();
        Bisection { places: &model.rest, whole: MOST_OWN, fits: &fits }.cut(&mut order, 0, &mut ends);

        let mut cut = Self {
            blocks: vec![],
            nodes: vec![],
            cells: vec![],
            corners: vec![],
            corner_bits: 8,
            most_nodes: 1,
        };
        let mut locals = Vec::new();
        let mut first = 0;
        for end in ends {
            order[first..end].sort_unstable();
            let owned = &order[first..end];
            let block_cells = cells_at(owned);
            let mut around = nodes_of(cells, &block_cells);
            let (neighbours, needed) = (around.len(), shared_memory(around.len()));
            if needed > limit {
                let (adapter, node) = (device.adapter().name.clone(), owned[0]);
                let (needed, limit) = (needed as u64, limit as u64);
                return Err(GpuError::Crowded { adapter, node, neighbours, needed, limit });
            }
            around.retain(|node| owned.binary_search(node).is_err());
            let local = |node: &u32| match owned.binary_search(node) {
                Ok(place) => place,
                Err(_) => owned.len() + around.partition_point(|known| known < node),
            };
            locals.extend(block_cells.iter().flat_map(|&cell| cells.nodes(cell as usize)).map(local));
            let count = owned.len() + around.len();
            cut.blocks.push(Block {
                first_cell: cut.cells.len() as u32,
                cells: block_cells.len() as u32,
                first_node: cut.nodes.len() as u32,
                nodes: (owned.len() << 16 | count) as u32,
            });
            cut.nodes.extend(owned.iter().chain(&around).map(|&node| marked(node)));
            cut.cells.extend(block_cells);
            cut.most_nodes = cut.most_nodes.max(count);
            first = end;
        }
        cut.pack(&locals, cells.nodes_per_cell());
        Ok(cut)
    }

    /// Packs the corners, cell by cell, into rows.
    fn pack(&mut self, locals: &[usize], per_cell: usize) {
        self.corner_bits = if self.most_nodes <= 256 { 8 } else { 16 };
        let (count, per_word) = (self.cells.len(), 32 / self.corner_bits);
        self.corners = vec![0; count * per_cell.div_ceil(per_word)];
        for (index, &local) in locals.iter().enumerate() {
            let (cell, a) = (index / per_cell, index % per_cell);
            self.corners[a / per_word * count + cell] |=
                (local as u32) << (self.corner_bits * (a % per_word));
        }
    }
}
