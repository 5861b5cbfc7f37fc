//! Arrays on a device, and kernels that are bound to them.

use std::cell::Cell;

use bytemuck::NoUninit;
use wgpu::util::{BufferInitDescriptor, DeviceExt};
use wgpu::{BufferUsages, ShaderStages};

use crate::{Device, GpuError};

/// Invocations in a group.
pub(crate) const GROUP: u32 = 128;

/// Most groups along one dimension of a dispatch.
const MOST_GROUPS: u32 = 65_535;

/// Makes arrays and counts their bytes.
pub(crate) struct Memory<'d> {
    device: &'d Device,
    bytes: Cell<u64>,
}

impl<'d> Memory<'d> {
    pub(crate) fn new(device: &'d Device) -> Self {
        Self { device, bytes: Cell::new(0) }
    }

    /// All arrays so far [MiB], rounded up.
    pub(crate) fn mebibytes(&self) -> u64 {
        self.bytes.get().div_ceil(1 << 20)
    }

    /// An array with contents; at least as large as the largest element of any kernel.
    ///
    /// # Errors
    /// If it is larger than the adapter allows.
    pub(crate) fn filled<T: NoUninit>(
        &self,
        what: &'static str,
        contents: &[T],
    ) -> Result<wgpu::Buffer, GpuError> {
        let bytes: &[u8] = bytemuck::cast_slice(contents);
        self.count(what, bytes.len() as u64)?;
        let least = [0; 16];
        let contents = if bytes.len() < least.len() { &least } else { bytes };
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
        Ok(self.device.device.create_buffer_init(&BufferInitDescriptor {
            label: Some(what),
            contents,
            usage,
        }))
    }

    /// An array of zeros.
    ///
    /// # Errors
    /// As [`Self::filled`].
    pub(crate) fn zeros(&self, what: &'static str, bytes: usize) -> Result<wgpu::Buffer, GpuError> {
        let size = (bytes as u64).max(16).next_multiple_of(16);
        self.count(what, size)?;
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
        Ok(self.buffer(what, size, usage))
    }

    /// A small array for reading the same place at once.
    pub(crate) fn uniform(&self, what: &'static str, bytes: usize) -> wgpu::Buffer {
        self.buffer(what, bytes as u64, BufferUsages::UNIFORM | BufferUsages::COPY_DST)
    }

    fn buffer(&self, what: &'static str, size: u64, usage: BufferUsages) -> wgpu::Buffer {
        let descriptor = wgpu::BufferDescriptor { label: Some(what), size, usage, mapped_at_creation: false };
        self.device.device.create_buffer(&descriptor)
    }

    fn count(&self, what: &'static str, needed: u64) -> Result<(), GpuError> {
        self.bytes.set(self.bytes.get() + needed);
        let adapter = self.device.adapter();
        if needed > adapter.largest_buffer {
            let (adapter, limit) = (adapter.name.clone(), adapter.largest_buffer);
            return Err(GpuError::TooLarge { adapter, what, needed, limit });
        }
        Ok(())
    }
}

/// An array as a kernel sees it.
#[derive(Clone, Copy)]
pub(crate) enum Binding<'a> {
    /// To read.
    Read(&'a wgpu::Buffer),
    /// To read and write.
    Write(&'a wgpu::Buffer),
    /// The same for all.
    Uniform(&'a wgpu::Buffer),
    /// The same for all, `size` bytes from an offset on that each dispatch gives.
    Moving(&'a wgpu::Buffer, u64),
}

/// A group of bindings with its layout, in the order of their numbers.
pub(crate) struct Bound {
    layout: wgpu::BindGroupLayout,
    group: wgpu::BindGroup,
}

impl Bound {
    pub(crate) fn new(device: &Device, bindings: &[Binding<'_>]) -> Self {
        let storage = |read_only| wgpu::BufferBindingType::Storage { read_only };
        let layout: Vec<wgpu::BindGroupLayoutEntry> = (0..)
            .zip(bindings)
            .map(|(binding, what)| {
                let (ty, has_dynamic_offset) = match what {
                    Binding::Read(_) => (storage(true), false),
                    Binding::Write(_) => (storage(false), false),
                    Binding::Uniform(_) => (wgpu::BufferBindingType::Uniform, false),
                    Binding::Moving(..) => (wgpu::BufferBindingType::Uniform, true),
                };
                let ty = wgpu::BindingType::Buffer { ty, has_dynamic_offset, min_binding_size: None };
                wgpu::BindGroupLayoutEntry { binding, visibility: ShaderStages::COMPUTE, ty, count: None }
            })
            .collect();
        let entries: Vec<wgpu::BindGroupEntry<'_>> = (0..)
            .zip(bindings)
            .map(|(binding, what)| {
                let resource = match what {
                    Binding::Read(buffer) | Binding::Write(buffer) | Binding::Uniform(buffer) => {
                        buffer.as_entire_binding()
                    }
                    Binding::Moving(buffer, size) => wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                        buffer,
                        offset: 0,
                        size: wgpu::BufferSize::new(*size),
                    }),
                };
                wgpu::BindGroupEntry { binding, resource }
            })
            .collect();
        let device = &device.device;
        let layout = device
            .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &layout });
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &layout,
            entries: &entries,
        });
        Self { layout, group }
    }
}

/// A kernel with the arrays it works on; group 0 is the instant's.
pub(crate) struct Kernel {
    pipeline: wgpu::ComputePipeline,
    groups: Vec<wgpu::BindGroup>,
    /// Groups of invocations along two dimensions.
    dispatch: [u32; 2],
}

/// How many groups a number of invocations fills, along two dimensions.
pub(crate) fn groups(invocations: usize) -> [u32; 2] {
    let groups = (invocations as u64).div_ceil(u64::from(GROUP)).max(1);
    let rows = groups.div_ceil(u64::from(MOST_GROUPS));
    [groups.div_ceil(rows) as u32, rows as u32]
}

impl Kernel {
    /// From snippets of WGSL whose entry is `main`, with constants before them.
    pub(crate) fn new(
        device: &Device,
        name: &str,
        constants: &[(&str, usize)],
        snippets: &[&str],
        bound: &[&Bound],
        invocations: usize,
    ) -> Self {
        let mut source = format!("const GROUP = {GROUP}u;\n");
        for (name, value) in constants {
            source += &format!("const {name} = {value}u;\n");
        }
        source += include_str!("shaders/number.wgsl");
        source += &snippets.join("\n");
        let gpu = &device.device;
        let module = gpu.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(name),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        });
        let layouts: Vec<_> = bound.iter().map(|bound| Some(&bound.layout)).collect();
        let layout = gpu.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(name),
            bind_group_layouts: &layouts,
            immediate_size: 0,
        });
        let pipeline = gpu.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(name),
            layout: Some(&layout),
            module: &module,
            entry_point: Some("main"),
            compilation_options: Default::default(),
            cache: None,
        });
        let groups_bound = bound.iter().skip(1).map(|bound| bound.group.clone()).collect();
        Self { pipeline, groups: groups_bound, dispatch: groups(invocations) }
    }

    /// Runs for the instant at an offset.
    pub(crate) fn run(&self, pass: &mut wgpu::ComputePass<'_>, instant: &Bound, offset: u32) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &instant.group, &[offset]);
        for (index, group) in (1..).zip(&self.groups) {
            pass.set_bind_group(index, group, &[]);
        }
        pass.dispatch_workgroups(self.dispatch[0], self.dispatch[1], 1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_array_beyond_what_the_adapter_allows_is_refused_with_its_size() {
        let Ok(device) = Device::open(None) else { return };
        let limit = device.adapter().largest_buffer;
        let refused = Memory::new(&device).zeros("the cells", limit as usize + 16).err();
        let adapter = device.adapter().name.clone();
        let needed = (limit + 16).next_multiple_of(16);
        assert_eq!(refused, Some(GpuError::TooLarge { adapter, what: "the cells", needed, limit }));
        assert_eq!(device.check(), Ok(()));
    }

    #[test]
    fn groups_fill_two_dimensions() {
        assert_eq!((groups(0), groups(128), groups(129)), ([1, 1], [1, 1], [2, 1]));
        let [columns, rows] = groups(65_536 * 128);
        assert!(columns <= MOST_GROUPS && columns * rows >= 65_536);
    }
}
