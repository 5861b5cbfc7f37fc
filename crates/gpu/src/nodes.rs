//! Nodes on the device: where they are, what holds them, and the kernels that move them.

use bytemuck::{Pod, Zeroable};
use pliant_explicit::NO_MASS;
use pliant_mechanics::model::{FREE, Model};
use pliant_mechanics::tensor::Vector;

use crate::kernel::{Binding, Bound, GROUP, Kernel, Memory, Sides, groups};
use crate::loads::DeviceLoads;
use crate::ties::Followers;
use crate::transfer::Four;
use crate::{Device, GpuError};

/// A node that is held.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Hold {
    owner: [u32; 4],
    amplitudes: [Four; 2],
}

/// Numbers that the pass over nodes leaves for each of its groups.
pub(crate) const SUMS: usize = 12;

/// Vectors of a node beside its increment, and that: see in_place.wgsl.
pub(crate) const OF_NODE: usize = 3;

/// The arrays of nodes.
pub(crate) struct DeviceNodes {
    pub displacement: Sides,
    /// Increment of each node, and the internal forces at the last two instants.
    pub increment: Sides,
    /// Coming increment of each node, and internal forces; where sides alternate they lie where the
    /// increments will be.
    pub next: Sides,
    pub reactions: wgpu::Buffer,
    pub sums: wgpu::Buffer,
    constants: wgpu::Buffer,
    holds: wgpu::Buffer,
    /// The nodes that are held, in the order of `reactions`.
    pub held: Vec<u32>,
    /// Nodes that follow others.
    pub followers: Option<Followers>,
    /// Number of nodes.
    pub count: usize,
    /// Groups that leave sums: of the pass over them, or of blocks.
    pub groups: usize,
}

/// The passes over the nodes; they change the side that is now.
pub(crate) struct NodeKernels {
    /// Finds the coming increments.
    pub pass: Kernel,
    /// Continues from an evaluated instant.
    pub advance: Kernel,
}

impl DeviceNodes {
    /// Makes the arrays; `blocks` is the number of blocks that move nodes from one side to the other, if
    /// there are some.
    ///
    /// # Errors
    /// If an array is too large.
    pub(crate) fn new(
        memory: &Memory<'_>,
        model: &Model,
        owners: &[[u32; 3]],
        blocks: Option<usize>,
    ) -> Result<Self, GpuError> {
        let count = model.node_count();
        let amplitudes = model.amplitudes(owners);
        let followers = Followers::new(memory, model)?;
        let mut held = Vec::new();
        let mut holds = Vec::new();
        let mut constants = Vec::new();
        for body in &model.bodies {
            for node in body.nodes.clone() {
                let owner = owners[node as usize];
                // One more than its place among those held, or zero.
                let mut tag = 0;
                if owner != [FREE; 3] {
                    held.push(node);
                    tag = held.len() as u32;
                    let four = |[x, y, z]: Vector<f64>| [x as f32, y as f32, z as f32, 0.0];
                    holds.push(Hold {
                        owner: [owner[0], owner[1], owner[2], FREE],
                        amplitudes: amplitudes[node as usize].map(four),
                    });
                }
                // Nodes that follow others have no mass, and no force but where they are held: there next to
                // no mass moves with them.
                let follows = followers.as_ref().is_some_and(|followers| followers.number(node).is_some());
                let inertia = match follows {
                    true if tag == 0 => 1.0,
                    true => NO_MASS,
                    false => model.inertia(node as usize),
                };
                let mass = model.mass[node as usize];
                constants.push([inertia as f32, body.damping as f32, mass as f32, f32::from_bits(tag)]);
            }
        }
        let vectors =
            |each: usize, alternate| memory.sides("the nodes", each * count * size_of::<Four>(), alternate);
        let [columns, rows] = groups(count);
        let groups = ((columns * rows) as usize).max(blocks.unwrap_or(0));
        let increment = vectors(OF_NODE, blocks.is_some())?;
        let next = match blocks {
            Some(_) => [increment[1].clone(), increment[0].clone()],
            None => vectors(OF_NODE, false)?,
        };
        Ok(Self {
            displacement: vectors(1, blocks.is_some())?,
            increment,
            next,
            reactions: memory.zeros("the reactions", held.len() * size_of::<Four>())?,
            sums: memory.zeros("the energies", groups * SUMS * size_of::<f32>())?,
            constants: memory.filled("the nodes", &constants)?,
            holds: memory.filled("the nodes that are held", &holds)?,
            held,
            followers,
            count,
            groups,
        })
    }

    /// The passes, with `gather` and `gathered` how forces come from the cells, and the forces of contacts on
    /// nodes [N].
    ///
    /// # Errors
    /// If the adapter allows fewer arrays.
    pub(crate) fn kernels(
        &self,
        device: &Device,
        instant: &Bound,
        (gather, gathered): (&str, &Bound),
        loads: Option<&DeviceLoads>,
        contact_forces: Option<&wgpu::Buffer>,
        constants: &[(&str, usize)],
    ) -> Result<NodeKernels, GpuError> {
        let count = self.count;
        let mut bindings = vec![
            Binding::WriteNow(&self.displacement),
            Binding::WriteNow(&self.increment),
            Binding::WriteNow(&self.next),
            Binding::Read(&self.constants),
            Binding::Read(&self.holds),
            Binding::Write(&self.reactions),
            Binding::Write(&self.sums),
        ];
        bindings.extend(contact_forces.map(Binding::Read));
        let bound = Bound::new(device, &bindings);
        let touched = if contact_forces.is_some() { include_str!("shaders/touched.wgsl") } else { UNTOUCHED };
        let loaded = loads.map(|loads| Bound::new(device, &loads.bindings()));
        let common = [INSTANT, gather, MOVE, include_str!("shaders/in_place.wgsl")];
        let pass = [external_forces(loads), touched, MOTION, include_str!("shaders/node.wgsl")];
        let pass = [&common[..], &pass].concat();
        let advance = [&common[..], &[include_str!("shaders/advance.wgsl")]].concat();
        let numbers = [constants, &[("NODES", count)]].concat();
        let groups = [instant, gathered, &bound];
        let with_loads: Vec<&Bound> = groups.into_iter().chain(&loaded).collect();
        Ok(NodeKernels {
            pass: Kernel::new(device, "nodes", &numbers, &pass, &with_loads, count)?,
            advance: Kernel::new(device, "advance", &numbers, &advance, &groups, count)?,
        })
    }

    /// Marks nodes that grips pull at, or unmarks them.
    pub(crate) fn mark(&self, device: &Device, nodes: &[u32], gripped: bool) {
        for &node in nodes {
            let tag = self.held.binary_search(&node).map_or(0, |hold| hold as u32 + 1);
            let tag = if gripped { tag | GRIPPED } else { tag };
            let place = (node as usize * size_of::<Four>() + 3 * size_of::<f32>()) as u64;
            device.queue.write_buffer(&self.constants, place, bytemuck::bytes_of(&tag));
        }
    }

    /// Binds the arrays of nodes that contacts work on, with the contacts' own arrays.
    pub(crate) fn of_contacts(&self, device: &Device, contact_arrays: &[Binding<'_>]) -> Bound {
        let bindings = [
            Binding::ReadNow(&self.displacement),
            Binding::ReadNow(&self.increment),
            Binding::Nothing,
            Binding::Read(&self.constants),
            Binding::Read(&self.holds),
            Binding::Nothing,
            Binding::Nothing,
            Binding::Nothing,
        ];
        Bound::new(device, &[&bindings[..], contact_arrays].concat())
    }

    /// Binds the arrays of blocks of nodes; `left` has the forces that blocks leave.
    pub(crate) fn of_blocks(&self, device: &Device, left: &wgpu::Buffer) -> Bound {
        let bindings = [
            Binding::ReadNow(&self.displacement),
            Binding::ReadNow(&self.increment),
            Binding::WriteNext(&self.displacement),
            Binding::Read(&self.constants),
            Binding::Read(&self.holds),
            Binding::WriteNext(&self.increment),
            Binding::Write(&self.sums),
            Binding::Write(left),
        ];
        Bound::new(device, &bindings)
    }
}

const INSTANT: &str = include_str!("shaders/instant.wgsl");

/// Marks a node that a grip pulls at; twin of the one in move.wgsl.
const GRIPPED: u32 = 1 << 31;

/// Inertia and constraints of nodes.
pub(crate) const MOVE: &str = include_str!("shaders/move.wgsl");
/// The coming increment of a node.
pub(crate) const MOTION: &str = include_str!("shaders/central_difference.wgsl");

/// Shader of nodes without contacts.
pub(crate) const UNTOUCHED: &str = include_str!("shaders/untouched.wgsl");

/// Returns the shader of the forces on nodes from outside.
pub(crate) fn external_forces(loads: Option<&DeviceLoads>) -> &'static str {
    match loads {
        Some(_) => include_str!("shaders/loads.wgsl"),
        None => include_str!("shaders/unloaded.wgsl"),
    }
}

/// Vectors as the device reads them.
pub(crate) fn fours(vectors: impl IntoIterator<Item = Vector<f32>>) -> Vec<Four> {
    vectors.into_iter().map(|[x, y, z]| [x, y, z, 0.0]).collect()
}

const _: () = assert!(GROUP.is_power_of_two());
