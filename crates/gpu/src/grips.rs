//! Grips on the device: the springs of `pliant_mechanics::grip`, in single precision.

use pliant_mechanics::grip::Grip;
use pliant_mechanics::model::Model;
use pliant_mechanics::tensor::{add, scale, sub};

use crate::kernel::{Binding, Bound, GROUP, Kernel, Sides};
use crate::transfer::Four;
use crate::{Device, GpuError};

/// Kernel that finds the forces of grips, and the nodes that they pull at.
pub(crate) struct DeviceGrips {
    kernel: Kernel,
    /// Nodes that are pulled at, increasing, each once.
    pub nodes: Vec<u32>,
}

impl DeviceGrips {
    /// # Errors
    /// If the adapter allows fewer arrays.
    pub(crate) fn new(device: &Device, instant: &Bound, displacement: &Sides) -> Result<Self, GpuError> {
        let bound = Bound::new(device, &[Binding::ReadNow(displacement)]);
        let snippets = [include_str!("shaders/instant.wgsl"), include_str!("shaders/grips.wgsl")];
        let kernel = Kernel::new(device, "grips", &[], &snippets, &[instant, &bound], GROUP as usize)?;
        Ok(Self { kernel, nodes: Vec::new() })
    }

    /// The kernel, while anything is held.
    pub(crate) fn kernel(&self) -> Option<&Kernel> {
        (!self.nodes.is_empty()).then_some(&self.kernel)
    }

    /// Sets the grips. Returns them as instant.wgsl reads them.
    pub(crate) fn take(&mut self, model: &Model, grips: &[Grip]) -> Vec<Four> {
        let number = |n: usize| f32::from_bits(n as u32);
        self.kernel.dispatch_groups(grips.len() as u32);
        let of_grip = |(index, grip): (usize, &'_ Grip)| {
            let nodes = model.resolved(&grip.nodes).into_iter();
            nodes.map(|(node, weight)| (node, weight, index)).collect::<Vec<_>>()
        };
        let mut entries: Vec<_> = grips.iter().enumerate().flat_map(of_grip).collect();
        entries.sort_by_key(|&(node, ..)| node);
        self.nodes = entries.iter().map(|&(node, ..)| node).collect();
        self.nodes.dedup();
        let mut numbers = vec![[number(grips.len()), number(entries.len()), 0.0, 0.0]];
        for grip in grips {
            let rest = grip
                .nodes
                .iter()
                .fold([0.0; 3], |sum, &(node, weight)| add(sum, scale(model.rest[node as usize], weight)));
            let [x, y, z] = sub(grip.place, rest).map(|x| x as f32);
            numbers.push([x, y, z, grip.stiffness as f32]);
        }
        numbers.resize(1 + 2 * grips.len(), Four::default());
        let entry = |(node, weight, grip)| [f32::from_bits(node), weight as f32, number(grip), 0.0];
        numbers.extend(entries.into_iter().map(entry));
        numbers
    }
}
