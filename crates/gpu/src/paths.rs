//! The way forces take from cells to nodes, for each design.
//!
//! The table counts the bytes and operations of an elastic `tet4` in a step. Bytes follow from the arrays
//! below for six cells a node, each number read once from memory. Operations are counted in a prototype's PTX
//! (sm_90, neo-Hookean). The node itself (u, Δu read and written, its constants) is 80 B, 13 a cell. Times
//! are in docs/lab/performance.md.
//!
//! | design | bytes | operations | where they go |
//! |---|---|---|---|
//! | `gather` | 230 | 260 | cell: nodes 16, shape 48, u 3, forces written 64; node: forces 64, places 17 |
//! | `blocks` | 120 | 475 | 1.78 × (shape 48, corners 4), 3.4 × nodes around 11; no second kernel |
//! | `float-atomics` | 90 | 260 | nodes 16, shape 48, u 3, sums 8; twelve atomic additions |
//! | `fast` | 50 | 325 | corners 4, places of corners 14, 2.0 × nodes of blocks 20; shapes found again |

use pliant_mechanics::model::{CellBlock, Cells, Model, Solid};
use pliant_mechanics::tensor::dot;

use crate::blocks::{DeviceBlocks, NodeBlocks};
use crate::kernel::{Binding, Bound, Memory};
use crate::loads::DeviceLoads;
use crate::nodes::{DeviceNodes, MOTION, MOVE, UNTOUCHED, external_forces};
use crate::run::table_constants;
use crate::ties::{Followers, Giving};
use crate::transfer::Four;
use crate::{Design, Device, GpuError};

/// Shader that reads displacements where they lie.
pub(crate) const CORNERS: &str = include_str!("shaders/cell_corners.wgsl");
/// The entry of a kernel of which each invocation takes a cell.
pub(crate) const EACH_CELL: &str = include_str!("shaders/each_cell.wgsl");
/// Forces as whole numbers.
const FIXED: &str = include_str!("shaders/fixed.wgsl");

/// Arrays into which cells give forces, and from which nodes take them.
pub(crate) struct Paths {
    /// Arrays that kernels of cells read and write.
    pub cells: Bound,
    /// Shader snippet of cells: `displacement_of`, `give` and the entry.
    pub cell_snippet: String,
    /// Arrays that the passes over nodes read.
    pub nodes: Bound,
    /// Shader snippet of nodes: `internal_force` and `clear`.
    pub node_snippet: String,
    /// Path of forces on nodes that follow others, if there are any.
    pub giving: Option<Giving>,
    /// First slot of each solid.
    pub first_slot: Vec<usize>,
    /// Blocks of each solid, if the design has some.
    pub blocks: Vec<DeviceBlocks>,
    /// True if blocks find the shapes of plain tetrahedra at rest again from the places of their nodes.
    pub finds_shapes: bool,
    /// True if kernels of cells move the nodes, too.
    pub moves: bool,
    /// Constants of kernels of cells.
    pub constants: Vec<(&'static str, usize)>,
    /// Forces that have to be zero before an instant.
    sums: Option<wgpu::Buffer>,
}

impl Paths {
    /// Makes the paths of a design; `cut` has the blocks of nodes if the design cuts them.
    ///
    /// # Errors
    /// If an array is too large, or the device lacks what the design needs.
    pub(crate) fn new(
        design: Design,
        memory: &Memory<'_>,
        device: &Device,
        model: &Model,
        nodes: &DeviceNodes,
        loads: Option<&DeviceLoads>,
        cut: Vec<NodeBlocks>,
    ) -> Result<Self, GpuError> {
        match design {
            Design::Gather => Self::gather(memory, device, model, nodes),
            Design::Blocks => Self::blocks(memory, device, model, nodes, loads, cut),
            Design::Fast => Self::fast(memory, device, model, nodes),
            Design::FloatAtomics => {
                if !device.adapter().float_atomics {
                    return Err(device.lacks("floating-point atomics".to_owned()));
                }
                Self::atomics(memory, device, model, nodes)
            }
        }
    }

    /// One kernel a step. The forces of a block are kept only as whole numbers, 16 bytes a node. In shared
    /// memory every GPU adds them natively, in any order to the same sum. Slots to gather forces would take
    /// 48 bytes or more a cell there. This makes blocks smaller and cells at borders more.
    fn blocks(
        memory: &Memory<'_>,
        device: &Device,
        model: &Model,
        nodes: &DeviceNodes,
        loads: Option<&DeviceLoads>,
        cut: Vec<NodeBlocks>,
    ) -> Result<Self, GpuError> {
        let left = memory.zeros("the forces on nodes", model.node_count() * size_of::<Four>())?;
        let scale = Scale::new(model).constants();
        let moves = [external_forces(loads), UNTOUCHED, MOTION, include_str!("shaders/node_blocks.wgsl")];
        let snippets = [&[&scale, FIXED, MOVE][..], &moves].concat();
        let mut first = 0;
        let mut blocks = Vec::new();
        for cut in cut {
            let count = cut.len();
            blocks.push(DeviceBlocks::of_nodes(memory, device, cut, first, loads)?);
            first += count;
        }
        Ok(Self {
            cells: nodes.of_blocks(device, &left),
            cell_snippet: snippets.join("\n"),
            nodes: Bound::new(device, &[Binding::Read(&left)]),
            node_snippet: [&scale, FIXED, include_str!("shaders/left_nodes.wgsl")].join("\n"),
            giving: None,
            first_slot: vec![0; model.solids.len()],
            blocks,
            finds_shapes: false,
            moves: true,
            constants: table_constants(model).to_vec(),
            sums: None,
        })
    }

    fn gather(
        memory: &Memory<'_>,
        device: &Device,
        model: &Model,
        nodes: &DeviceNodes,
    ) -> Result<Self, GpuError> {
        // A slot for each corner of each cell, corner by corner.
        let mut first_slot = vec![0];
        for solid in &model.solids {
            let count = solid.cells.len() * solid.cells.nodes_per_cell();
            first_slot.push(first_slot[first_slot.len() - 1] + count);
        }
        let slots = model.solids.iter().zip(&first_slot).flat_map(|(solid, first)| {
            let cells = &solid.cells;
            (0..cells.len()).flat_map(move |cell| {
                let slot = move |a: usize| (first + a * cells.len() + cell) as u32;
                cells.nodes(cell).iter().enumerate().map(move |(a, &node)| (slot(a), node))
            })
        });
        let what = ("the forces of cells", "the cells at nodes");
        let paths = Self::of_slots(memory, device, nodes, what, slots)?;
        Ok(Self {
            cell_snippet: [CORNERS, include_str!("shaders/gather_cells.wgsl"), EACH_CELL].join("\n"),
            first_slot,
            ..paths
        })
    }

    fn fast(
        memory: &Memory<'_>,
        device: &Device,
        model: &Model,
        nodes: &DeviceNodes,
    ) -> Result<Self, GpuError> {
        let blocks = (model.solids.iter())
            .map(|solid| DeviceBlocks::of_cells(memory, device, model, solid))
            .collect::<Result<Vec<_>, _>>()?;
        let mut first_slot = vec![0];
        for blocks in &blocks {
            first_slot.push(first_slot[first_slot.len() - 1] + blocks.nodes.len());
        }
        let slots = (0..).zip(blocks.iter().flat_map(|blocks| blocks.nodes.iter().copied()));
        let what = ("the forces of blocks", "the blocks at nodes");
        let paths = Self::of_slots(memory, device, nodes, what, slots)?;
        Ok(Self {
            cell_snippet: include_str!("shaders/block_cells.wgsl").to_owned(),
            first_slot,
            blocks,
            finds_shapes: true,
            ..paths
        })
    }

    /// Makes paths from slots with their nodes, which gather them. `what` and `lists` describe the slots and
    /// their lists in words.
    fn of_slots(
        memory: &Memory<'_>,
        device: &Device,
        nodes: &DeviceNodes,
        (what, lists): (&'static str, &'static str),
        slots: impl Iterator<Item = (u32, u32)> + Clone,
    ) -> Result<Self, GpuError> {
        let first_given = slots.clone().count();
        let followers = nodes.followers.as_ref();
        let number = |node: u32| followers.and_then(|followers| followers.number(node));
        let followed = followers.into_iter().flat_map(Followers::followed);
        let independent = slots.clone().filter(|&(_, node)| number(node).is_none());
        let taken = independent.chain((first_given as u32..).zip(followed.clone()));
        let forces = memory.zeros(what, (first_given + followed.count()) * size_of::<Four>())?;
        let listed = |(offsets, slots): (Vec<u32>, Vec<u32>)| -> Result<[wgpu::Buffer; 2], GpuError> {
            Ok([memory.filled(lists, &offsets)?, memory.filled(lists, &slots)?])
        };
        let turned = |(slot, node): (u32, u32)| (node, slot);
        let [offsets, of_node] = listed(by_rows(nodes.count, taken.map(turned)))?;
        let giving = match followers {
            Some(followers) => {
                let following = slots.filter_map(|(slot, node)| Some((slot, number(node)?)));
                let lists = listed(by_rows(followers.count, following.map(turned)))?;
                Some(followers.among_slots(device, &forces, &lists, first_given))
            }
            None => None,
        };
        Ok(Self {
            cells: Bound::new(device, &[Binding::ReadNow(&nodes.displacement), Binding::Write(&forces)]),
            cell_snippet: String::new(),
            nodes: Bound::new(device, &[&forces, &offsets, &of_node].map(Binding::Read)),
            node_snippet: include_str!("shaders/gather_nodes.wgsl").to_owned(),
            giving,
            first_slot: vec![],
            blocks: vec![],
            finds_shapes: false,
            moves: false,
            constants: vec![],
            sums: None,
        })
    }

    fn atomics(
        memory: &Memory<'_>,
        device: &Device,
        model: &Model,
        nodes: &DeviceNodes,
    ) -> Result<Self, GpuError> {
        let forces = memory.zeros("the forces on nodes", model.node_count() * size_of::<Four>())?;
        Ok(Self {
            cells: Bound::new(device, &[Binding::ReadNow(&nodes.displacement), Binding::Write(&forces)]),
            cell_snippet: [CORNERS, include_str!("shaders/float_cells.wgsl"), EACH_CELL].join("\n"),
            nodes: Bound::new(device, &[Binding::Write(&forces)]),
            node_snippet: include_str!("shaders/float_nodes.wgsl").to_owned(),
            giving: nodes.followers.as_ref().map(|followers| followers.among_sums(device, &forces)),
            first_slot: vec![0; model.solids.len()],
            blocks: vec![],
            finds_shapes: false,
            moves: false,
            constants: vec![],
            sums: Some(forces),
        })
    }

    /// Sets the sums to zero.
    pub(crate) fn clear(&self, device: &Device) {
        if let Some(sums) = &self.sums {
            let mut encoder = device.device.create_command_encoder(&Default::default());
            encoder.clear_buffer(sums, 0, None);
            device.queue.submit([encoder.finish()]);
        }
    }
}

/// Units of forces and energies that are added up as whole numbers of 32 bits. A cell gives at most 2³¹ over
/// the most cells at a node, so that no sum leaves the range. This limit stands for the force of the stiffest
/// cell at a strain of 1, V (λ+2μ) |B|. Larger numbers are cut off and reported.
struct Scale {
    limit: f32,
    per_force: f32,
    per_energy: f32,
}

impl Scale {
    fn new(model: &Model) -> Self {
        let mut cells_at = vec![0.0; model.node_count()];
        let (mut force, mut length) = (0.0_f64, 0.0_f64);
        for solid in &model.solids {
            for cell in 0..solid.cells.len() {
                solid.cells.nodes(cell).iter().for_each(|&node| cells_at[node as usize] += 1.0);
                force = force.max(force_at_unit_strain(solid, cell));
                length = length.max(solid.cells.volume(cell).cbrt());
            }
        }
        let most = cells_at.into_iter().fold(1.0, f64::max);
        // A little less: a limit that is rounded must not be above.
        let limit = 0.999 * 2.0_f64.powi(31) / most;
        let per_force = limit / force.max(f64::MIN_POSITIVE);
        Self { limit: limit as f32, per_force: per_force as f32, per_energy: (per_force / length) as f32 }
    }

    fn constants(&self) -> String {
        let Self { limit, per_force, per_energy } = self;
        format!(
            "const LIMIT = {limit:e}f;\nconst PER_FORCE = {per_force:e}f;\nconst PER_ENERGY = {per_energy:e}f;\n"
        )
    }
}

/// V (λ+2μ) max |B_a| [N].
fn force_at_unit_strain(solid: &Solid, cell: usize) -> f64 {
    fn largest<const N: usize>(block: &CellBlock<N>, cell: usize) -> f64 {
        let squares = block.rest[cell].gradient.iter().map(|&b| dot(b, b));
        block.rest[cell].volume * squares.fold(0.0, f64::max).sqrt()
    }
    let area = match &solid.cells {
        Cells::Tet4(block) | Cells::AveragedTet4(block, _) => largest(block, cell),
        Cells::Hex8(block) | Cells::FullHex8(block, _) => largest(block, cell),
        Cells::Membrane(block, _) => largest(block, cell),
        Cells::Bar(block, _) => largest(block, cell),
    };
    area * solid.longitudinal_modulus()
}

/// Returns the first entry of each of `rows` rows, and the entries of the rows in their order, from entries
/// with their rows.
pub(crate) fn by_rows<T: Copy + Default>(
    rows: usize,
    entries: impl Iterator<Item = (u32, T)> + Clone,
) -> (Vec<u32>, Vec<T>) {
    let mut starts = vec![0_u32; rows + 1];
    entries.clone().for_each(|(row, _)| starts[row as usize + 1] += 1);
    for row in 0..rows {
        starts[row + 1] += starts[row];
    }
    let mut next = starts.clone();
    let mut of_rows = vec![T::default(); starts[rows] as usize];
    for (row, entry) in entries {
        let place = &mut next[row as usize];
        of_rows[*place as usize] = entry;
        *place += 1;
    }
    (starts, of_rows)
}
