//! Nodes on the device: where they are, what holds them, and the kernels that move them.

use bytemuck::{Pod, Zeroable};
use pliant_mechanics::model::{FREE, Model};
use pliant_mechanics::tensor::Vector;

use crate::kernel::{Binding, Bound, GROUP, Kernel, Memory, groups};
use crate::loads::DeviceLoads;
use crate::solids::Four;
use crate::{Device, GpuError};

/// A node that is held.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Hold {
    owner: [u32; 4],
    amplitude: Four,
}

/// Numbers that the pass over nodes leaves for each of its groups.
pub(crate) const SUMS: usize = 12;

/// The arrays of nodes.
pub(crate) struct DeviceNodes {
    pub displacement: wgpu::Buffer,
    pub increment: wgpu::Buffer,
    pub next: wgpu::Buffer,
    pub reactions: wgpu::Buffer,
    pub sums: wgpu::Buffer,
    constants: wgpu::Buffer,
    holds: wgpu::Buffer,
    /// The nodes that are held, in the order of `reactions`.
    pub held: Vec<u32>,
    /// How many nodes there are.
    pub count: usize,
    /// Groups of the pass over them.
    pub groups: usize,
}

/// The passes over the nodes.
pub(crate) struct NodeKernels {
    /// Finds the coming increments.
    pub pass: Kernel,
    /// Goes on from an instant that was looked at.
    pub advance: Kernel,
}

impl DeviceNodes {
    /// # Errors
    /// If an array is too large.
    pub(crate) fn new(memory: &Memory<'_>, model: &Model, owners: &[[u32; 3]]) -> Result<Self, GpuError> {
        let count = model.node_count();
        let amplitudes = model.amplitudes(owners);
        let mut held = Vec::new();
        let mut holds = Vec::new();
        let mut constants = Vec::new();
        for body in &model.bodies {
            for node in body.nodes.clone() {
                let owner = owners[node as usize];
                let mut hold = FREE;
                if owner != [FREE; 3] {
                    hold = held.len() as u32;
                    held.push(node);
                    let [x, y, z] = amplitudes[node as usize].map(|a| a as f32);
                    holds.push(Hold {
                        owner: [owner[0], owner[1], owner[2], FREE],
                        amplitude: [x, y, z, 0.0],
                    });
                }
                let (inertia, mass) = (model.inertia(node as usize), model.mass[node as usize]);
                constants.push([inertia as f32, body.damping as f32, mass as f32, f32::from_bits(hold)]);
            }
        }
        let vectors = || memory.zeros("the nodes", count * size_of::<Four>());
        let [columns, rows] = groups(count);
        let groups = (columns * rows) as usize;
        Ok(Self {
            displacement: vectors()?,
            increment: vectors()?,
            next: vectors()?,
            reactions: memory.zeros("the reactions", held.len() * size_of::<Four>())?,
            sums: memory.zeros("the energies", groups * SUMS * size_of::<f32>())?,
            constants: memory.filled("the nodes", &constants)?,
            holds: memory.filled("the nodes that are held", &holds)?,
            held,
            count,
            groups,
        })
    }

    /// The passes, with `gather` and `gathered` how forces come from the cells.
    pub(crate) fn kernels(
        &self,
        device: &Device,
        instant: &Bound,
        (gather, gathered): (&str, &Bound),
        loads: Option<&DeviceLoads>,
        constants: &[(&str, usize)],
    ) -> NodeKernels {
        let count = self.count;
        let bound = Bound::new(
            device,
            &[
                Binding::Write(&self.displacement),
                Binding::Write(&self.increment),
                Binding::Write(&self.next),
                Binding::Read(&self.constants),
                Binding::Read(&self.holds),
                Binding::Write(&self.reactions),
                Binding::Write(&self.sums),
            ],
        );
        let common = [include_str!("shaders/instant.wgsl"), gather, include_str!("shaders/move.wgsl")];
        let (external, mut bounds) = match loads {
            Some(loads) => (include_str!("shaders/loads.wgsl"), vec![&loads.bound]),
            None => (include_str!("shaders/unloaded.wgsl"), vec![]),
        };
        let pass = [&common[..], &[external, include_str!("shaders/node.wgsl")]].concat();
        let advance = [&common[..], &[include_str!("shaders/advance.wgsl")]].concat();
        let numbers = [constants, &[("NODES", count)]].concat();
        let groups = [instant, &bound, gathered];
        bounds.splice(0..0, groups);
        NodeKernels {
            pass: Kernel::new(device, "nodes", &numbers, &pass, &bounds, count),
            advance: Kernel::new(device, "advance", &numbers, &advance, &groups, count),
        }
    }
}

/// Vectors as the device reads them.
pub(crate) fn fours(vectors: impl IntoIterator<Item = Vector<f32>>) -> Vec<Four> {
    vectors.into_iter().map(|[x, y, z]| [x, y, z, 0.0]).collect()
}

const _: () = assert!(GROUP.is_power_of_two());
