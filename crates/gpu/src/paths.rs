//! The way forces take from cells to nodes, for each design.

use pliant_mechanics::model::{CellBlock, Cells, Model, Solid};
use pliant_mechanics::tensor::dot;

use crate::kernel::{Binding, Bound, Memory};
use crate::solids::Four;
use crate::{Design, Device, GpuError};

/// Takes displacements from where they lie.
pub(crate) const CORNERS: &str = include_str!("shaders/cell_corners.wgsl");
/// The entry of a kernel of which each invocation takes a cell.
pub(crate) const EACH_CELL: &str = include_str!("shaders/each_cell.wgsl");

/// Where cells give forces and nodes take them.
pub(crate) struct Paths {
    /// What kernels of cells read and write.
    pub cells: Bound,
    /// Their snippet: `displacement_of`, `give` and the entry.
    pub cell_snippet: String,
    /// What the passes over nodes read.
    pub nodes: Bound,
    /// Their snippet: `internal_force` and `clear`.
    pub node_snippet: String,
    /// First slot of each solid.
    pub first_slot: Vec<usize>,
    /// Forces that have to be zero before an instant.
    sums: Option<wgpu::Buffer>,
}

impl Paths {
    /// # Errors
    /// If an array is too large, or the device lacks what the design needs.
    pub(crate) fn new(
        design: Design,
        memory: &Memory<'_>,
        device: &Device,
        model: &Model,
        displacement: &wgpu::Buffer,
    ) -> Result<Self, GpuError> {
        match design {
            Design::Gather => Self::gather(memory, device, model, displacement),
            Design::FloatAtomics => {
                if !device.adapter().float_atomics {
                    let what = format!(
                        "`{design}` needs floating-point atomics, which `{}` lacks; it",
                        device.adapter().name
                    );
                    return Err(GpuError::Unsupported { what });
                }
                let snippets =
                    [include_str!("shaders/float_cells.wgsl"), include_str!("shaders/float_nodes.wgsl")];
                Self::atomics(memory, device, model, displacement, snippets, "")
            }
            Design::FixedAtomics => {
                let snippets =
                    [include_str!("shaders/fixed_cells.wgsl"), include_str!("shaders/fixed_nodes.wgsl")];
                Self::atomics(memory, device, model, displacement, snippets, &Scale::new(model).constants())
            }
        }
    }

    fn gather(
        memory: &Memory<'_>,
        device: &Device,
        model: &Model,
        displacement: &wgpu::Buffer,
    ) -> Result<Self, GpuError> {
        let slots = Slots::new(model);
        let forces = memory.zeros("the forces of cells", slots.of_node.len() * size_of::<Four>())?;
        let offsets = memory.filled("the cells at nodes", &slots.offsets)?;
        let of_node = memory.filled("the cells at nodes", &slots.of_node)?;
        Ok(Self {
            cells: Bound::new(device, &[Binding::Read(displacement), Binding::Write(&forces)]),
            cell_snippet: [CORNERS, include_str!("shaders/gather_cells.wgsl"), EACH_CELL].join("\n"),
            nodes: Bound::new(device, &[&forces, &offsets, &of_node].map(Binding::Read)),
            node_snippet: include_str!("shaders/gather_nodes.wgsl").to_owned(),
            first_slot: slots.first,
            sums: None,
        })
    }

    fn atomics(
        memory: &Memory<'_>,
        device: &Device,
        model: &Model,
        displacement: &wgpu::Buffer,
        [cells, nodes]: [&str; 2],
        constants: &str,
    ) -> Result<Self, GpuError> {
        let forces = memory.zeros("the forces on nodes", model.node_count() * size_of::<Four>())?;
        Ok(Self {
            cells: Bound::new(device, &[Binding::Read(displacement), Binding::Write(&forces)]),
            cell_snippet: [constants, CORNERS, cells, EACH_CELL].join("\n"),
            nodes: Bound::new(device, &[Binding::Write(&forces)]),
            node_snippet: [constants, nodes].join("\n"),
            first_slot: vec![0; model.solids.len()],
            sums: Some(forces),
        })
    }

    /// Begins at zero.
    pub(crate) fn clear(&self, device: &Device) {
        if let Some(sums) = &self.sums {
            let mut encoder = device.device.create_command_encoder(&Default::default());
            encoder.clear_buffer(sums, 0, None);
            device.queue.submit([encoder.finish()]);
        }
    }
}

/// The units of forces and energies that are added up as whole numbers of 32 bits. A cell gives at most 2³¹ over the most
/// cells at a node, so that no sum leaves the range; that much is the force of the stiffest cell at a strain of 1,
/// V (λ+2μ) |B|. What is more is cut off and reported.
struct Scale {
    limit: f32,
    per_force: f32,
    per_energy: f32,
}

impl Scale {
    fn new(model: &Model) -> Self {
        let mut cells_at = vec![0_u32; model.node_count()];
        let (mut force, mut length) = (0.0_f64, 0.0_f64);
        for solid in &model.solids {
            for cell in 0..solid.cells.len() {
                solid.cells.nodes(cell).iter().for_each(|&node| cells_at[node as usize] += 1);
                force = force.max(force_at_unit_strain(solid, cell));
                length = length.max(solid.cells.volume(cell).cbrt());
            }
        }
        let most = cells_at.into_iter().max().unwrap_or(1).max(1);
        // A little less: a limit that is rounded must not be above.
        let limit = 0.999 * 2.0_f64.powi(31) / f64::from(most);
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
    };
    area * solid.material.law.longitudinal_modulus()
}

/// The slots of all cells, and for each node those that are its own, in the order of solids and cells.
struct Slots {
    /// First slot of each solid, one more than there are solids. Slots of a solid lie node by node of the cells.
    first: Vec<usize>,
    /// First entry of `of_node` of each node.
    offsets: Vec<u32>,
    of_node: Vec<u32>,
}

impl Slots {
    fn new(model: &Model) -> Self {
        let mut first = vec![0];
        let mut offsets = vec![0_u32; model.node_count() + 1];
        let each = |visit: &mut dyn FnMut(usize, usize, usize, u32)| {
            for (index, solid) in model.solids.iter().enumerate() {
                for cell in 0..solid.cells.len() {
                    for (a, &node) in solid.cells.nodes(cell).iter().enumerate() {
                        visit(index, cell, a, node);
                    }
                }
            }
        };
        for solid in &model.solids {
            first.push(first[first.len() - 1] + solid.cells.len() * solid.cells.nodes_per_cell());
        }
        each(&mut |_, _, _, node| offsets[node as usize + 1] += 1);
        for node in 0..model.node_count() {
            offsets[node + 1] += offsets[node];
        }
        let mut next = offsets.clone();
        let mut of_node = vec![0; first[first.len() - 1]];
        each(&mut |solid, cell, a, node| {
            let place = &mut next[node as usize];
            of_node[*place as usize] = (first[solid] + a * model.solids[solid].cells.len() + cell) as u32;
            *place += 1;
        });
        Self { first, offsets, of_node }
    }
}
