//! Reading arrays back.

use bytemuck::AnyBitPattern;
use wgpu::{BufferAddress, BufferUsages};

use crate::{Device, GpuError};

/// Four numbers that kernels read together.
pub(crate) type Four = [f32; 4];

/// A place in ordinary memory that the device can copy to; grows as needed.
#[derive(Default)]
pub(crate) struct Transfer(Option<wgpu::Buffer>);

impl Transfer {
    /// Reads the first `count` entries of an array once all that was submitted is done.
    ///
    /// # Errors
    /// If the device fails.
    pub(crate) fn read<T: AnyBitPattern>(
        &mut self,
        device: &Device,
        from: &wgpu::Buffer,
        count: usize,
        take: impl FnOnce(&[T]),
    ) -> Result<(), GpuError> {
        self.read_all(device, &[(from, (count * size_of::<T>()) as BufferAddress)], |parts| {
            take(bytemuck::cast_slice(parts[0]));
        })
    }

    /// Reads the first bytes of several arrays at once, multiples of four.
    ///
    /// # Errors
    /// If the device fails.
    pub(crate) fn read_all(
        &mut self,
        device: &Device,
        from: &[(&wgpu::Buffer, BufferAddress)],
        take: impl FnOnce(&[&[u8]]),
    ) -> Result<(), GpuError> {
        let size: BufferAddress = from.iter().map(|(_, bytes)| bytes).sum();
        if self.0.as_ref().is_none_or(|staging| staging.size() < size) {
            self.0 = Some(device.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("results"),
                size,
                usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }));
            device.check()?;
        }
        let Some(staging) = &self.0 else { return Ok(()) };
        let mut encoder = device.device.create_command_encoder(&Default::default());
        let mut ends = vec![0];
        for &(buffer, bytes) in from {
            let end = ends[ends.len() - 1];
            encoder.copy_buffer_to_buffer(buffer, 0, staging, end, bytes);
            ends.push(end + bytes);
        }
        device.queue.submit([encoder.finish()]);
        device.count_read_back();
        staging.map_async(wgpu::MapMode::Read, ..size, |_| {});
        device.wait()?;
        let view = staging.get_mapped_range(..size).map_err(|error| device.fault(&error))?;
        let parts: Vec<&[u8]> =
            ends.windows(2).map(|ends| &view[ends[0] as usize..ends[1] as usize]).collect();
        take(&parts);
        drop(view);
        staging.unmap();
        Ok(())
    }
}
