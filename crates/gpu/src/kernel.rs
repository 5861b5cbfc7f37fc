//! Arrays on a device, and kernels that are bound to them.

use std::cell::Cell;

use bytemuck::NoUninit;
use wgpu::{BufferUsages, ShaderStages};

use crate::{Device, GpuError};

/// Invocations in a group.
pub(crate) const GROUP: u32 = 128;

/// Name of the group size in kernels. One of the constants of a kernel may have this name and another number.
pub(crate) const GROUP_NAME: &str = "GROUP";

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

    /// Returns the size of all arrays so far [B].
    pub(crate) fn bytes(&self) -> u64 {
        self.bytes.get()
    }

    /// An array with contents; at least as large as the largest element of any kernel.
    ///
    /// # Errors
    /// If it is larger than the adapter allows, or the device fails.
    pub(crate) fn filled<T: NoUninit>(
        &self,
        what: &'static str,
        contents: &[T],
    ) -> Result<wgpu::Buffer, GpuError> {
        let bytes: &[u8] = bytemuck::cast_slice(contents);
        let size = array_size(bytes.len());
        self.count(what, size)?;
        let buffer = self.buffer(what, size, ARRAY, true);
        // Fails if the device is lost or its memory is full; the caller that makes the arrays checks both.
        let mut view = buffer.get_mapped_range_mut(..).map_err(|error| self.device.fault(&error))?;
        view.slice(..bytes.len()).copy_from_slice(bytes);
        drop(view);
        buffer.unmap();
        Ok(buffer)
    }

    /// An array of zeros.
    ///
    /// # Errors
    /// As [`Self::filled`].
    pub(crate) fn zeros(&self, what: &'static str, bytes: usize) -> Result<wgpu::Buffer, GpuError> {
        let size = array_size(bytes);
        self.count(what, size)?;
        Ok(self.buffer(what, size, ARRAY, false))
    }

    /// Arrays of zeros for the two sides of an instant: two that alternate, or one and the same.
    ///
    /// # Errors
    /// As [`Self::filled`].
    pub(crate) fn sides(&self, what: &'static str, bytes: usize, alternate: bool) -> Result<Sides, GpuError> {
        let one = self.zeros(what, bytes)?;
        let other = if alternate { self.zeros(what, bytes)? } else { one.clone() };
        Ok([one, other])
    }

    /// A small array for reading the same place at once.
    pub(crate) fn uniform(&self, what: &'static str, bytes: usize) -> wgpu::Buffer {
        self.buffer(what, bytes as u64, BufferUsages::UNIFORM | BufferUsages::COPY_DST, false)
    }

    fn buffer(
        &self,
        what: &'static str,
        size: u64,
        usage: BufferUsages,
        mapped_at_creation: bool,
    ) -> wgpu::Buffer {
        let descriptor = wgpu::BufferDescriptor { label: Some(what), size, usage, mapped_at_creation };
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

/// An array whose contents change with their number: it grows by half at least, and never shrinks.
pub(crate) struct Growing {
    what: &'static str,
    buffer: wgpu::Buffer,
}

impl Growing {
    /// # Errors
    /// See [`Memory::zeros`].
    pub(crate) fn new(memory: &Memory<'_>, what: &'static str) -> Result<Self, GpuError> {
        Ok(Self { what, buffer: memory.zeros(what, 0)? })
    }

    /// The array as it is until it grows.
    pub(crate) fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }

    /// Makes room for `bytes` bytes; contents are lost if the array grows.
    ///
    /// # Errors
    /// See [`Memory::zeros`].
    pub(crate) fn reserve(&mut self, memory: &Memory<'_>, bytes: usize) -> Result<(), GpuError> {
        let needed = array_size(bytes);
        memory.count(self.what, needed)?;
        if self.buffer.size() < needed {
            let size = grown(self.buffer.size(), needed, memory.device.adapter().largest_buffer);
            self.buffer = memory.buffer(self.what, size, ARRAY, false);
        }
        Ok(())
    }

    /// Holds contents at its start.
    ///
    /// # Errors
    /// As [`Memory::zeros`].
    pub(crate) fn fill<T: NoUninit>(&mut self, memory: &Memory<'_>, contents: &[T]) -> Result<(), GpuError> {
        self.reserve(memory, size_of_val(contents))?;
        memory.device.queue.write_buffer(&self.buffer, 0, bytemuck::cast_slice(contents));
        Ok(())
    }
}

/// Usages of arrays.
const ARRAY: BufferUsages = BufferUsages::STORAGE.union(BufferUsages::COPY_DST).union(BufferUsages::COPY_SRC);

/// Returns the bytes of an array, at least as many as the largest element of any kernel takes: a held node.
fn array_size(bytes: usize) -> u64 {
    (bytes as u64).max(48).next_multiple_of(16)
}

/// Returns the bytes of a buffer, a multiple of 16, that replaces a smaller one. The new buffer is half
/// larger, up to the largest that the adapter allows, or has the bytes needed.
pub(crate) fn grown(size: u64, needed: u64, largest: u64) -> u64 {
    let roomy = (size * 3 / 2).next_multiple_of(16);
    roomy.min(largest - largest % 16).max(needed.next_multiple_of(16))
}

/// An array that has two sides: at an instant one of them is now, the other one is next. Where a kernel
/// changes it in place both are the same.
pub(crate) type Sides = [wgpu::Buffer; 2];

/// An array as a kernel sees it.
#[derive(Clone, Copy)]
pub(crate) enum Binding<'a> {
    /// No kernel that is bound here uses this number.
    Nothing,
    /// Array whose present side is read.
    ReadNow(&'a Sides),
    /// Array whose present side is read and written.
    WriteNow(&'a Sides),
    /// Array whose other side is written.
    WriteNext(&'a Sides),
    /// Array to read.
    Read(&'a wgpu::Buffer),
    /// Array to read and write.
    Write(&'a wgpu::Buffer),
    /// Uniform for all invocations.
    Uniform(&'a wgpu::Buffer),
    /// Uniform for all invocations, `size` bytes from an offset on that each dispatch gives.
    Moving(&'a wgpu::Buffer, u64),
}

impl<'a> Binding<'a> {
    fn ty(self) -> Option<wgpu::BindingType> {
        let storage = |read_only| wgpu::BufferBindingType::Storage { read_only };
        let (ty, has_dynamic_offset) = match self {
            Self::Nothing => return None,
            Self::Read(_) | Self::ReadNow(_) => (storage(true), false),
            Self::Write(_) | Self::WriteNow(_) | Self::WriteNext(_) => (storage(false), false),
            Self::Uniform(_) => (wgpu::BufferBindingType::Uniform, false),
            Self::Moving(..) => (wgpu::BufferBindingType::Uniform, true),
        };
        Some(wgpu::BindingType::Buffer { ty, has_dynamic_offset, min_binding_size: None })
    }

    /// Returns the resource to bind where `side` is now.
    fn resource(self, side: usize) -> Option<wgpu::BindingResource<'a>> {
        let buffer = match self {
            Self::Nothing => return None,
            Self::Read(buffer) | Self::Write(buffer) | Self::Uniform(buffer) => buffer,
            Self::ReadNow(sides) | Self::WriteNow(sides) => &sides[side],
            Self::WriteNext(sides) => &sides[1 - side],
            Self::Moving(buffer, size) => {
                let size = wgpu::BufferSize::new(size);
                return Some(wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer, offset: 0, size }));
            }
        };
        Some(buffer.as_entire_binding())
    }

    fn is_array(self) -> bool {
        !matches!(self, Self::Nothing | Self::Uniform(_) | Self::Moving(..))
    }

    fn has_sides(self) -> bool {
        matches!(self, Self::ReadNow(_) | Self::WriteNow(_) | Self::WriteNext(_))
    }
}

/// A group of bindings with its layout, in the order of their numbers.
pub(crate) struct Bound {
    layout: wgpu::BindGroupLayout,
    /// Bind groups for each side that may be now.
    groups: [wgpu::BindGroup; 2],
    /// Number of arrays.
    arrays: u32,
}

impl Bound {
    pub(crate) fn new(device: &Device, bindings: &[Binding<'_>]) -> Self {
        let gpu = &device.device;
        let entries: Vec<wgpu::BindGroupLayoutEntry> = (0..)
            .zip(bindings)
            .filter_map(|(binding, what)| {
                let (visibility, ty) = (ShaderStages::COMPUTE, what.ty()?);
                Some(wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None })
            })
            .collect();
        let layout =
            gpu.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries });
        let group = |side: usize| {
            let entries: Vec<wgpu::BindGroupEntry<'_>> = (0..)
                .zip(bindings)
                .filter_map(|(binding, what)| {
                    Some(wgpu::BindGroupEntry { binding, resource: what.resource(side)? })
                })
                .collect();
            gpu.create_bind_group(&wgpu::BindGroupDescriptor {
                label: None,
                layout: &layout,
                entries: &entries,
            })
        };
        let one = group(0);
        let other = if bindings.iter().any(|what| what.has_sides()) { group(1) } else { one.clone() };
        let arrays = bindings.iter().filter(|what| what.is_array()).count() as u32;
        Self { layout, groups: [one, other], arrays }
    }
}

/// A kernel with the arrays it works on; group 0 is the instant's.
pub(crate) struct Kernel {
    pipeline: wgpu::ComputePipeline,
    /// Bind groups for each side that may be now.
    bound: [Vec<wgpu::BindGroup>; 2],
    /// Groups of invocations along two dimensions.
    dispatch: [u32; 2],
}

/// Returns the groups that a number of invocations fills, along two dimensions.
pub(crate) fn groups(invocations: usize) -> [u32; 2] {
    let groups = (invocations as u64).div_ceil(u64::from(GROUP)).max(1);
    let rows = groups.div_ceil(u64::from(MOST_GROUPS));
    [groups.div_ceil(rows) as u32, rows as u32]
}

impl Kernel {
    /// Makes a kernel from snippets of WGSL whose entry is `main`, with constants before them.
    ///
    /// # Errors
    /// If it works on more arrays, or in larger groups, than the adapter allows.
    pub(crate) fn new(
        device: &Device,
        name: &str,
        constants: &[(&str, usize)],
        snippets: &[&str],
        bound: &[&Bound],
        invocations: usize,
    ) -> Result<Self, GpuError> {
        let own_group = constants.iter().find(|(name, _)| *name == GROUP_NAME);
        let group = own_group.map_or(GROUP, |&(_, group)| group as u32);
        device.allows(bound.iter().map(|bound| bound.arrays).sum(), group)?;
        let mut source = match own_group {
            Some(_) => String::new(),
            None => format!("const {GROUP_NAME} = {GROUP}u;\n"),
        };
        for (name, value) in constants {
            source += &format!("const {name} = {value}u;\n");
        }
        source += include_str!("shaders/number.wgsl");
        source += &snippets.join("\n");
        let gpu = &device.device;
        device.count_kernel();
        let module = trusted(gpu, name, source);
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
            compilation_options: wgpu::PipelineCompilationOptions {
                // Every kernel writes what it reads of the memory that a group shares.
                zero_initialize_workgroup_memory: false,
                ..Default::default()
            },
            cache: None,
        });
        let bound = [0, 1].map(|side| bound.iter().skip(1).map(|bound| bound.groups[side].clone()).collect());
        Ok(Self { pipeline, bound, dispatch: groups(invocations) })
    }

    /// Runs in `count` groups from now on.
    pub(crate) fn dispatch_groups(&mut self, count: u32) {
        self.dispatch = [count, 1];
    }

    /// Works with other arrays of a group, bound alike.
    pub(crate) fn rebind(&mut self, group: usize, to: &Bound) {
        for (bound, to) in self.bound.iter_mut().zip(&to.groups) {
            bound[group - 1] = to.clone();
        }
    }

    /// Runs for `invocations` invocations from now on.
    pub(crate) fn resize(&mut self, invocations: usize) {
        self.dispatch = groups(invocations);
    }

    /// Runs for the instant at an offset, with `side` of arrays that have two.
    pub(crate) fn run(&self, pass: &mut wgpu::ComputePass<'_>, instant: &Bound, offset: u32, side: usize) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &instant.groups[0], &[offset]);
        for (index, group) in (1..).zip(&self.bound[side]) {
            pass.set_bind_group(index, group, &[]);
        }
        pass.dispatch_workgroups(self.dispatch[0], self.dispatch[1], 1);
    }
}

/// A module without the checks that wgpu adds for programs of strangers: of places in arrays, and counters
/// that end every loop. Without them steps of tetrahedra take 10 to 20 % less time on an NVIDIA H100.
#[expect(unsafe_code, reason = "wgpu has checked and unchecked modules, and no third kind")]
fn trusted(gpu: &wgpu::Device, name: &str, source: String) -> wgpu::ShaderModule {
    let source = wgpu::ShaderSource::Wgsl(source.into());
    let descriptor = wgpu::ShaderModuleDescriptor { label: Some(name), source };
    // SAFETY: the text is Pliant's own. Loops end at counts, and places in arrays come from lists. The CPU
    // has made these lists, or kernels have made them from such lists. Queues of contact hold each row, face
    // and node once and have room for all. No whole number is divided by zero.
    unsafe { gpu.create_shader_module_trusted(descriptor, wgpu::ShaderRuntimeChecks::unchecked()) }
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
    fn an_array_grows_by_half_at_least_and_never_shrinks() {
        let Ok(device) = Device::open(None) else { return };
        let memory = Memory::new(&device);
        let mut array = Growing::new(&memory, "the cells").unwrap();
        let mut size_for = |bytes| {
            array.reserve(&memory, bytes).unwrap();
            array.buffer().size()
        };
        assert_eq!([1600, 1616, 16, 2400, 1 << 20].map(&mut size_for), [1600, 2400, 2400, 2400, 1 << 20]);
    }

    #[test]
    fn a_buffer_grows_in_multiples_of_16_up_to_the_largest() {
        let sizes = [(1600, 1616, 4001), (1600, 1616, 2005), (1600, 2000, 2005), (1600, 3201, 4001)];
        let found = sizes.map(|(size, needed, largest)| grown(size, needed, largest));
        assert_eq!(found, [2400, 2000, 2000, 3216]);
    }

    #[test]
    fn groups_fill_two_dimensions() {
        assert_eq!((groups(0), groups(128), groups(129)), ([1, 1], [1, 1], [2, 1]));
        let [columns, rows] = groups(65_536 * 128);
        assert!(columns <= MOST_GROUPS && columns * rows >= 65_536);
    }
}
