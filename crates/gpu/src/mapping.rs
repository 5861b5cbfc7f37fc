//! Points that nodes carry, found on the device where they are drawn from: nothing of them goes through
//! ordinary memory.

use pliant_mechanics::tensor::Vector;

use crate::kernel::{Binding, Bound, Kernel, Memory, Sides};
use crate::transfer::Four;
use crate::transfer::Transfer;
use crate::{Device, GpuError};

/// The value of a point on a device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PointValue {
    /// A component of its displacement [m].
    Component(u8),
    /// The size of its displacement [m].
    #[default]
    Size,
    /// Value given by [`DeviceMapping::give`].
    Given,
}

/// Points on a device, four numbers each: position [m] and value.
#[derive(Clone, Debug)]
pub struct DevicePoints {
    device: Device,
    buffer: wgpu::Buffer,
    count: usize,
}

impl DevicePoints {
    /// Returns the buffer of the points.
    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }

    /// The device on which they lie.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// Reads them back.
    ///
    /// # Errors
    /// If the device fails.
    pub fn read(&self) -> Result<Vec<[f32; 4]>, GpuError> {
        let mut points = Vec::new();
        Transfer::default()
            .read::<Four>(&self.device, &self.buffer, self.count, |read| points.extend_from_slice(read))?;
        Ok(points)
    }
}

/// Kernel that finds points that are combinations of nodes.
pub struct DeviceMapping {
    kernel: Kernel,
    shown: wgpu::Buffer,
    bound: Bound,
    given: wgpu::Buffer,
    points: DevicePoints,
}

impl DeviceMapping {
    /// Maps points at rest [m], with the nodes and weights of each.
    ///
    /// # Errors
    /// If an array is too large, or the memory full.
    pub(crate) fn new(
        device: &Device,
        displacement: &Sides,
        points: impl Iterator<Item = (Vector<f64>, Vec<(u32, f64)>)>,
    ) -> Result<Self, GpuError> {
        let (mut offsets, mut entries, mut rest) = (vec![0_u32], Vec::new(), Vec::new());
        for (place, nodes) in points {
            let [x, y, z] = place.map(|x| x as f32);
            rest.push([x, y, z, 0.0]);
            entries.extend(nodes.iter().map(|&(node, weight)| [node, (weight as f32).to_bits()]));
            offsets.push(entries.len() as u32);
        }
        let (memory, count) = (Memory::new(device), rest.len());
        device.fill(
            || memory.bytes(),
            || {
                let offsets = memory.filled("the points drawn", &offsets)?;
                let entries = memory.filled("the points drawn", &entries)?;
                let rest = memory.filled("the points drawn", &rest)?;
                let given = memory.zeros("the values drawn", count * size_of::<f32>())?;
                let buffer = memory.zeros("the points drawn", count * size_of::<Four>())?;
                let shown = memory.uniform("what is drawn", size_of::<[u32; 4]>());
                let bound = Bound::new(device, &[Binding::Moving(&shown, size_of::<[u32; 4]>() as u64)]);
                let arrays = Bound::new(
                    device,
                    &[
                        Binding::ReadNow(displacement),
                        Binding::Read(&offsets),
                        Binding::Read(&entries),
                        Binding::Read(&rest),
                        Binding::Read(&given),
                        Binding::Write(&buffer),
                    ],
                );
                let snippet = [include_str!("shaders/mapping.wgsl")];
                let constants = [("POINTS", count)];
                let kernel = Kernel::new(device, "mapping", &constants, &snippet, &[&bound, &arrays], count)?;
                let points = DevicePoints { device: device.clone(), buffer, count };
                Ok(Self { kernel, shown, bound, given, points })
            },
        )
    }

    /// Gives each point a value.
    pub fn give(&self, values: &[f32]) {
        let values = &values[..values.len().min(self.points.count)];
        self.points.device.queue.write_buffer(&self.given, 0, bytemuck::cast_slice(values));
    }

    /// The points; where they are and what their values are changes with each
    /// [`GpuStepper::apply`](crate::GpuStepper::apply).
    pub fn points(&self) -> &DevicePoints {
        &self.points
    }

    /// Finds the points from displacements on a side.
    pub(crate) fn apply(&self, value: PointValue, side: usize) {
        let Device { device, queue, .. } = &self.points.device;
        let value = match value {
            PointValue::Component(component) => u32::from(component.min(2)),
            PointValue::Size => 3,
            PointValue::Given => 4,
        };
        queue.write_buffer(&self.shown, 0, bytemuck::bytes_of(&[value, 0, 0, 0]));
        let mut encoder = device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        self.kernel.run(&mut pass, &self.bound, 0, side);
        drop(pass);
        queue.submit([encoder.finish()]);
    }
}
