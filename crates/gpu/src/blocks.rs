//! Blocks of neighbouring cells, small enough for the memory that a group of invocations shares.

use pliant_mechanics::model::{Cells, Model, Solid};
use pliant_mechanics::tensor::{Vector, add, scale, sub};

use crate::kernel::{Binding, Bound, GROUP, Memory};
use crate::{Device, GpuError};

/// Most nodes of a block: a corner takes one byte.
const MOST_NODES: usize = 255;

/// A block; twin of the one in block_cells.wgsl.
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
    /// How many there are.
    pub count: usize,
    /// The cells, block by block.
    pub order: Vec<u32>,
    /// The nodes of all blocks: each has a slot.
    pub nodes: Vec<u32>,
}

/// Sizes of arrays in shared memory.
pub(crate) fn shared_sizes(cells: &Cells) -> [(&'static str, usize); 2] {
    [("MOST_NODES", 3 * MOST_NODES), ("FORCES", 3 * cells.nodes_per_cell() * GROUP as usize)]
}

/// The nodes of some cells, increasing.
fn nodes_of(cells: &Cells, block: &[u32]) -> Vec<u32> {
    let mut nodes: Vec<u32> = block.iter().flat_map(|&cell| cells.nodes(cell as usize)).copied().collect();
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}

/// Puts cells that lie together next to each other, by cutting in two along the longest side; ends of blocks in `ends`.
fn bisect(cells: &Cells, centres: &[Vector<f64>], order: &mut [u32], first: usize, ends: &mut Vec<usize>) {
    let group = GROUP as usize;
    if order.len() <= group && nodes_of(cells, order).len() <= MOST_NODES {
        ends.push(first + order.len());
        return;
    }
    let along = |c: usize| order.iter().map(move |&cell| centres[cell as usize][c]);
    let extent =
        |c: usize| along(c).fold(f64::NEG_INFINITY, f64::max) - along(c).fold(f64::INFINITY, f64::min);
    let axis = (0..3).max_by(|&a, &b| extent(a).total_cmp(&extent(b))).unwrap_or(0);
    // Whole groups to the left, so that all but the last are full.
    let groups = order.len().div_ceil(group);
    let middle = if groups > 1 { groups / 2 * group } else { order.len() / 2 };
    let by_place =
        |a: &u32, b: &u32| centres[*a as usize][axis].total_cmp(&centres[*b as usize][axis]).then(a.cmp(b));
    order.select_nth_unstable_by(middle, by_place);
    let (left, right) = order.split_at_mut(middle);
    bisect(cells, centres, left, first, ends);
    bisect(cells, centres, right, first + middle, ends);
}

impl DeviceBlocks {
    /// # Errors
    /// If an array is too large.
    pub(crate) fn new(
        memory: &Memory<'_>,
        device: &Device,
        model: &Model,
        solid: &Solid,
    ) -> Result<Self, GpuError> {
        let cells = &solid.cells;
        let per_cell = cells.nodes_per_cell();
        let centre = |cell: usize| {
            let sum =
                cells.nodes(cell).iter().fold([0.0; 3], |sum, &node| add(sum, model.rest[node as usize]));
            scale(sum, 1.0 / per_cell as f64)
        };
        let centres: Vec<_> = (0..cells.len()).map(centre).collect();
        let mut order: Vec<u32> = (0..cells.len() as u32).collect();
        let mut ends = Vec::new();
        if !order.is_empty() {
            bisect(cells, &centres, &mut order, 0, &mut ends);
        }
        let mut blocks = Vec::new();
        let (mut nodes, mut rest, mut offsets, mut given) = (Vec::new(), Vec::new(), vec![0_u32], Vec::new());
        let mut corners = vec![[0_u8; 4]; cells.len() * per_cell / 4];
        let mut first = 0;
        for end in ends {
            // In the order of the model, so that histories and shapes are read in long runs.
            order[first..end].sort_unstable();
            let own = nodes_of(cells, &order[first..end]);
            let mut at_nodes = vec![Vec::new(); own.len()];
            for (place, &cell) in order[first..end].iter().enumerate() {
                for (a, node) in cells.nodes(cell as usize).iter().enumerate() {
                    let local = own.partition_point(|known| known < node);
                    corners[a / 4 * cells.len() + first + place][a % 4] = local as u8;
                    at_nodes[local].push((a * GROUP as usize + place) as u16);
                }
            }
            let origin = model.rest[own[0] as usize];
            rest.extend(
                own.iter().flat_map(|&node| sub(model.rest[node as usize], origin)).map(|x| x as f32),
            );
            for at_node in at_nodes {
                given.extend(at_node);
                offsets.push(given.len() as u32);
            }
            blocks.push(Block {
                first_cell: first as u32,
                cells: (end - first) as u32,
                first_node: nodes.len() as u32,
                nodes: own.len() as u32,
            });
            nodes.extend(own);
            first = end;
        }
        given.resize(given.len().next_multiple_of(2), 0);
        let arrays = [
            memory.filled("the blocks of cells", &blocks)?,
            memory.filled("the nodes of blocks", &nodes)?,
            memory.filled("the cells", &corners)?,
            memory.filled("the nodes of blocks", &offsets)?,
            memory.filled("the corners at nodes", &given)?,
            memory.filled("the nodes of blocks", &rest)?,
        ];
        let bound = Bound::new(device, &arrays.each_ref().map(Binding::Read));
        Ok(Self { bound, count: blocks.len(), order, nodes })
    }
}
