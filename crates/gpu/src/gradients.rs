//! Conjugate gradients of implicit steps, in single precision, preconditioned by inverted blocks of the nodes
//! and by rigid motions of aggregates.
//!
//! Kernels are compiled once; another pattern changes sizes and arrays. The CPU sends the lower half of the
//! matrix; a kernel makes rows of blocks from this half. The coarse matrix is inverted in full, pivot by
//! pivot. An iteration takes four kernels (three without aggregates): A p; x, r and z = D⁻¹ r with the forces
//! on aggregates; their motions; p. Sums are found group by group, and every group that needs a sum adds up
//! the sums of the groups in the same order. The device itself decides where to stop: commands submitted
//! after that do nothing. So bits depend on no number of submissions.
//!
//! `pliant-linear` takes the result as a correction under a residual in double precision.

use std::time::Instant;

use pliant_linear::{
    BlockPattern, BlockValues, DeviceError, DeviceSolver, DeviceTimes, LinearDevice, Pass, PassEnd,
};
use wgpu::{BufferAddress, BufferUsages};

use crate::kernel::{Binding, Bound, GROUP, Growing, Kernel, Memory, Sides, grown};
use crate::transfer::Transfer;
use crate::{Device, GpuError};

/// The most aggregates, about: their full inverse is read in every iteration and takes a kernel for each.
const AGGREGATES: usize = 160;
/// Iterations of the first submission of all, and the least of one.
const FIRST: usize = 32;
const LEAST: usize = 8;
/// The most iterations of a submission: drivers end those that take seconds.
const MOST: usize = 64;
/// Bytes of a place in the uniform of pivots: what offsets are multiples of.
const PLACE: usize = 256;

const SIZES: &str = include_str!("shaders/gradients/sizes.wgsl");
const SUMS: &str =
    concat!(include_str!("shaders/gradients/progress.wgsl"), include_str!("shaders/gradients/sum.wgsl"));
/// Names, what comes before, and texts: a matrix, the inverse of its coarse part, an iteration.
const KERNELS: [[&str; 3]; 7] = [
    ["expand", "", include_str!("shaders/gradients/expand.wgsl")],
    ["scatter", "", include_str!("shaders/gradients/scatter.wgsl")],
    ["invert", "", include_str!("shaders/gradients/invert.wgsl")],
    ["multiply", SUMS, include_str!("shaders/gradients/multiply.wgsl")],
    ["update", SUMS, include_str!("shaders/gradients/update.wgsl")],
    ["coarse", SUMS, include_str!("shaders/gradients/coarse.wgsl")],
    ["turn", SUMS, include_str!("shaders/gradients/turn.wgsl")],
];

impl LinearDevice for Device {
    fn aggregates(&self) -> usize {
        AGGREGATES
    }

    fn solver(&self) -> Result<Box<dyn DeviceSolver>, DeviceError> {
        Ok(Box::new(Gradients::new(self).map_err(failed)?))
    }
}

fn failed(error: GpuError) -> DeviceError {
    DeviceError(format!("{error}; {}", error.remedy()))
}

/// Progress of a pass, as its kernels see it; twin of progress.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
struct Progress {
    product: f32,
    residual: f32,
    goal: f32,
    done: u32,
    most: u32,
    started: u32,
    end: u32,
    unused: u32,
}

/// Sizes of a pattern, and a pivot; twin of sizes.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
struct Sizes {
    pivot: u32,
    nodes: u32,
    aggregates: u32,
    chunks: u32,
    entries: u32,
    lower: u32,
    pairs: u32,
    coarse: u32,
}

impl Sizes {
    fn of(pattern: &BlockPattern<'_>) -> Self {
        let nodes = pattern.nodes() as u32;
        let last = pattern.source.iter().filter(|&&at| at != u32::MAX).max();
        Self {
            pivot: 0,
            nodes,
            aggregates: pattern.aggregates() as u32,
            chunks: (6 * nodes).div_ceil(GROUP),
            entries: pattern.source.len() as u32,
            lower: last.map_or(1, |&last| last + 1),
            pairs: pattern.touching.as_ref().map_or(0, Vec::len) as u32,
            coarse: u32::from(pattern.touching.is_some()),
        }
    }

    /// Binds the input of all kernels: these sizes with each pivot.
    fn bind(self, device: &Device, memory: &Memory<'_>) -> Bound {
        let place = |pivot: u32| {
            let mut place = [0_u32; PLACE / 4];
            place[..8].copy_from_slice(&bytemuck::cast::<Self, [u32; 8]>(Self { pivot, ..self }));
            place
        };
        let places: Vec<_> = (0..self.aggregates.max(1)).map(place).collect();
        let uniform = memory.uniform("the sizes", PLACE * places.len());
        device.queue.write_buffer(&uniform, 0, bytemuck::cast_slice(&places));
        Bound::new(device, &[Binding::Moving(&uniform, size_of::<Self>() as u64)])
    }

    /// Invocations of each of the [`KERNELS`].
    fn invocations(self) -> [usize; 7] {
        let [nodes, aggregates, entries, pairs] =
            [self.nodes, self.aggregates, self.entries, self.pairs].map(|count| count as usize);
        let groups = aggregates * GROUP as usize;
        [entries, 36 * pairs, aggregates * aggregates, 6 * nodes, groups, groups, 6 * nodes]
    }

    /// Bytes of a matrix on its way.
    fn upload(self) -> u64 {
        let [nodes, lower, pairs] = [self.nodes, self.lower, self.pairs].map(u64::from);
        4 * lower + (144 + 16) * nodes + 144 * pairs
    }
}

/// Arrays of the kernels.
struct Arrays {
    lower: Growing,
    source: Growing,
    value: Growing,
    row_start: Growing,
    column: Growing,
    inverse: Growing,
    start: Growing,
    home: Growing,
    arm: Growing,
    x: Growing,
    r: Growing,
    z: Growing,
    p: Growing,
    ap: Growing,
    curvatures: Growing,
    products: Growing,
    force: Growing,
    motion: Growing,
    powers: Growing,
    blocks: Growing,
    pairs: Growing,
    coarse: [Growing; 2],
    progress: Sides,
}

impl Arrays {
    /// Makes arrays without a pattern.
    fn new(memory: &Memory<'_>) -> Result<Self, GpuError> {
        let new = |what| Growing::new(memory, what);
        let coarse = || new("the inverse of the aggregates");
        Ok(Self {
            lower: new("the entries of the matrix")?,
            source: new("the places of the matrix")?,
            value: new("the blocks of the matrix")?,
            row_start: new("the rows of the matrix")?,
            column: new("the columns of the matrix")?,
            inverse: new("the inverses of the nodes")?,
            start: new("the aggregates")?,
            home: new("the aggregates of the nodes")?,
            arm: new("the arms of the nodes")?,
            x: new("the solution")?,
            r: new("the residual")?,
            z: new("its correction")?,
            p: new("the direction")?,
            ap: new("its product")?,
            curvatures: new("the curvatures")?,
            products: new("the products")?,
            force: new("the forces on the aggregates")?,
            motion: new("the motions of the aggregates")?,
            powers: new("the powers of the aggregates")?,
            blocks: new("the blocks of the aggregates")?,
            pairs: new("the pairs of aggregates")?,
            coarse: [coarse()?, coarse()?],
            progress: memory.sides("the progress", size_of::<Progress>(), true)?,
        })
    }

    /// Sets the pattern.
    ///
    /// # Errors
    /// If an array is too large.
    fn take(
        &mut self,
        memory: &Memory<'_>,
        pattern: &BlockPattern<'_>,
        sizes: Sizes,
    ) -> Result<(), GpuError> {
        let [nodes, aggregates] = [pattern.nodes(), pattern.aggregates()];
        self.source.fill(memory, pattern.source)?;
        self.row_start.fill(memory, pattern.row_start)?;
        self.column.fill(memory, pattern.column)?;
        self.start.fill(memory, pattern.aggregate_start)?;
        self.home.fill(memory, &homes(pattern))?;
        self.lower.reserve(memory, 4 * sizes.lower as usize)?;
        self.value.reserve(memory, 4 * pattern.source.len())?;
        self.inverse.reserve(memory, 144 * nodes)?;
        self.arm.reserve(memory, 16 * nodes)?;
        for vector in [&mut self.x, &mut self.r, &mut self.z, &mut self.p, &mut self.ap] {
            vector.reserve(memory, 24 * nodes)?;
        }
        self.curvatures.reserve(memory, 4 * sizes.chunks as usize)?;
        self.products.reserve(memory, 8 * aggregates)?;
        for six in [&mut self.force, &mut self.motion] {
            six.reserve(memory, 24 * aggregates)?;
        }
        self.powers.reserve(memory, 4 * aggregates)?;
        let Some(pairs) = &pattern.touching else { return Ok(()) };
        self.pairs.fill(memory, pairs)?;
        self.blocks.reserve(memory, 144 * pairs.len())?;
        for side in &mut self.coarse {
            side.reserve(memory, 144 * aggregates * aggregates)?;
        }
        Ok(())
    }

    /// Binds the arrays of each of the [`KERNELS`], besides the sizes.
    fn bind(&self, device: &Device, sizes: Sizes) -> [Vec<Bound>; 7] {
        let bind = |bindings: &[Binding<'_>]| Bound::new(device, bindings);
        let read = |array| Binding::Read(Growing::buffer(array));
        let write = |array| Binding::Write(Growing::buffer(array));
        let now = || bind(&[Binding::ReadNow(&self.progress)]);
        let coarse = self.coarse.each_ref().map(|side| side.buffer().clone());
        let last = &coarse[sizes.aggregates as usize % 2];
        let expand = bind(&[read(&self.lower), read(&self.source), write(&self.value)]);
        let scatter = bind(&[read(&self.blocks), read(&self.pairs), Binding::Write(&coarse[0])]);
        let invert = bind(&[Binding::ReadNow(&coarse), Binding::WriteNext(&coarse)]);
        let multiply = bind(&[
            read(&self.row_start),
            read(&self.column),
            read(&self.value),
            read(&self.p),
            write(&self.ap),
            write(&self.curvatures),
        ]);
        let update = bind(&[
            read(&self.curvatures),
            read(&self.start),
            read(&self.inverse),
            read(&self.p),
            read(&self.ap),
            write(&self.x),
            write(&self.r),
            write(&self.z),
            write(&self.products),
        ]);
        let forces = bind(&[read(&self.arm), write(&self.force)]);
        let solve = bind(&[Binding::Read(last), read(&self.force), write(&self.motion), write(&self.powers)]);
        let both = bind(&[Binding::ReadNow(&self.progress), Binding::WriteNext(&self.progress)]);
        let turn = bind(&[read(&self.curvatures), read(&self.products), read(&self.z), write(&self.p)]);
        let motions = bind(&[read(&self.arm), read(&self.motion), read(&self.powers), read(&self.home)]);
        [
            vec![expand],
            vec![scatter],
            vec![invert],
            vec![now(), multiply],
            vec![now(), update, forces],
            vec![now(), solve],
            vec![both, turn, motions],
        ]
    }
}

/// Equations on a device: one pattern after the other, by kernels that are compiled once.
struct Gradients {
    device: Device,
    sizes: Sizes,
    arrays: Arrays,
    /// The sizes with each pivot.
    pivots: Bound,
    kernels: [Kernel; 7],
    upload: Upload,
    transfer: Transfer,
    /// Iterations of the last pass.
    last: usize,
    times: DeviceTimes,
    /// True if a pattern found no room.
    torn: bool,
}

impl std::fmt::Debug for Gradients {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Gradients").field("device", &self.device.adapter().name).finish_non_exhaustive()
    }
}

impl Gradients {
    fn new(device: &Device) -> Result<Self, GpuError> {
        let memory = Memory::new(device);
        device.fill(|| memory.bytes(), || Self::make(device, &memory))
    }

    fn make(device: &Device, memory: &Memory<'_>) -> Result<Self, GpuError> {
        let (sizes, arrays) = (Sizes::default(), Arrays::new(memory)?);
        let pivots = sizes.bind(device, memory);
        let bound = arrays.bind(device, sizes);
        let [expand, scatter, invert, multiply, update, coarse, turn] = std::array::from_fn(|number| {
            let [name, before, snippet] = KERNELS[number];
            let bound: Vec<&Bound> = std::iter::once(&pivots).chain(&bound[number]).collect();
            Kernel::new(device, name, &[], &[SIZES, before, snippet], &bound, 0)
        });
        Ok(Self {
            kernels: [expand?, scatter?, invert?, multiply?, update?, coarse?, turn?],
            upload: Upload::new(device, sizes.upload()),
            device: device.clone(),
            sizes,
            arrays,
            pivots,
            transfer: Transfer::default(),
            last: FIRST,
            times: DeviceTimes::default(),
            torn: false,
        })
    }

    fn take_pattern(&mut self, pattern: &BlockPattern<'_>) -> Result<(), GpuError> {
        let device = self.device.clone();
        let memory = Memory::new(&device);
        let arrange = || {
            self.sizes = Sizes::of(pattern);
            self.arrays.take(&memory, pattern, self.sizes)?;
            self.pivots = self.sizes.bind(&device, &memory);
            let bound = self.arrays.bind(&device, self.sizes);
            for ((kernel, bound), count) in self.kernels.iter_mut().zip(&bound).zip(self.sizes.invocations())
            {
                (1..).zip(bound).for_each(|(group, bound)| kernel.rebind(group, bound));
                kernel.resize(count);
            }
            let (size, needed) = (self.upload.size(), self.sizes.upload());
            if size < needed {
                let size = grown(size, needed, device.adapter().largest_buffer);
                self.upload = Upload::new(&device, size);
            }
            Ok(())
        };
        device.fill(|| memory.bytes(), arrange)
    }

    fn take_values(&mut self, values: &BlockValues<'_>) -> Result<(), GpuError> {
        let Arrays { lower, inverse, arm, blocks, coarse, .. } = &self.arrays;
        let mut encoder = self.device.device.create_command_encoder(&Default::default());
        let mut parts = vec![
            (lower.buffer(), bytemuck::cast_slice(values.lower)),
            (inverse.buffer(), bytemuck::cast_slice(values.inverse)),
        ];
        if self.is_coarse() {
            parts.push((arm.buffer(), bytemuck::cast_slice(values.arm)));
            parts.push((blocks.buffer(), bytemuck::cast_slice(values.coarse)));
            encoder.clear_buffer(coarse[0].buffer(), 0, None);
        }
        self.upload.copy(&self.device, &mut encoder, &parts)?;
        let [expand, scatter, invert, ..] = &self.kernels;
        let mut pass = encoder.begin_compute_pass(&Default::default());
        expand.run(&mut pass, &self.pivots, 0, 0);
        if self.is_coarse() {
            scatter.run(&mut pass, &self.pivots, 0, 0);
            for pivot in 0..self.sizes.aggregates as usize {
                invert.run(&mut pass, &self.pivots, (PLACE * pivot) as u32, pivot % 2);
            }
        }
        drop(pass);
        self.device.queue.submit([encoder.finish()]);
        self.upload.again();
        self.device.check()
    }

    /// True if the motions of aggregates are solved for.
    fn is_coarse(&self) -> bool {
        self.sizes.coarse != 0
    }

    /// The kernels after A p.
    fn finish_iteration(&self, pass: &mut wgpu::ComputePass<'_>, side: usize) {
        let [.., update, coarse, turn] = &self.kernels;
        update.run(pass, &self.pivots, 0, side);
        if self.is_coarse() {
            coarse.run(pass, &self.pivots, 0, side);
        }
        turn.run(pass, &self.pivots, 0, side);
    }

    fn pass(
        &mut self,
        right: &[f32],
        solution: &mut [f32],
        goal: f32,
        iterations: usize,
    ) -> Result<Pass, GpuError> {
        let mut begun = Instant::now();
        let most = u32::try_from(iterations).unwrap_or(u32::MAX);
        let start = Progress { goal: goal * goal, most, ..Progress::default() };
        let Arrays { x, r, p, ap, progress: places, .. } = &self.arrays;
        let [_, _, _, multiply, ..] = &self.kernels;
        self.device.queue.write_buffer(r.buffer(), 0, bytemuck::cast_slice(right));
        self.device.queue.write_buffer(&places[0], 0, bytemuck::bytes_of(&start));
        let mut encoder = self.device.device.create_command_encoder(&Default::default());
        for vector in [x, p, ap] {
            encoder.clear_buffer(vector.buffer(), 0, None);
        }
        let (mut side, mut count) = (0, (self.last + self.last / 8 + 1).clamp(LEAST, MOST));
        let mut first = true;
        loop {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            if first {
                self.finish_iteration(&mut pass, side);
                side = 1 - side;
                first = false;
            }
            for _ in 0..count {
                multiply.run(&mut pass, &self.pivots, 0, side);
                self.finish_iteration(&mut pass, side);
                side = 1 - side;
            }
            drop(pass);
            let submission = self.device.queue.submit([encoder.finish()]);
            self.device.wait_for(submission)?;
            let read = Instant::now();
            self.times.iterations += read - begun;
            let mut progress = Progress::default();
            let bytes = 24 * BufferAddress::from(self.sizes.nodes);
            let parts = [(&places[side], size_of::<Progress>() as BufferAddress), (x.buffer(), bytes)];
            self.transfer.read_all(&self.device, &parts, |parts| {
                progress = bytemuck::pod_read_unaligned(parts[0]);
                solution.copy_from_slice(bytemuck::cast_slice(parts[1]));
            })?;
            begun = Instant::now();
            self.times.read_back += begun - read;
            let end = match progress.end {
                0 => {
                    encoder = self.device.device.create_command_encoder(&Default::default());
                    count = (count / 2).clamp(LEAST, MOST);
                    continue;
                }
                1 => PassEnd::Reached,
                2 => PassEnd::OutOfIterations,
                _ => PassEnd::Indefinite,
            };
            self.last = progress.done as usize;
            return Ok(Pass { iterations: self.last, end });
        }
    }
}

impl DeviceSolver for Gradients {
    fn arrange(&mut self, pattern: &BlockPattern<'_>) -> Result<(), DeviceError> {
        // Some arrays may have found no room: none of them is used again.
        if self.torn {
            *self = Self { times: self.times, ..Self::new(&self.device).map_err(failed)? };
        }
        self.torn = true;
        self.take_pattern(pattern).map_err(failed)?;
        self.torn = false;
        Ok(())
    }

    fn take(&mut self, values: &BlockValues<'_>) -> Result<(), DeviceError> {
        let begun = Instant::now();
        self.take_values(values).map_err(failed)?;
        self.times.upload += begun.elapsed();
        Ok(())
    }

    fn solve(
        &mut self,
        right: &[f32],
        solution: &mut [f32],
        goal: f32,
        iterations: usize,
    ) -> Result<Pass, DeviceError> {
        self.pass(right, solution, goal, iterations).map_err(failed)
    }

    fn times(&self) -> DeviceTimes {
        self.times
    }
}

/// The aggregate of each node, and which of its components have an equation.
fn homes(pattern: &BlockPattern<'_>) -> Vec<[u32; 2]> {
    let groups = (0..).zip(pattern.aggregate_start.windows(2));
    let nodes = groups.flat_map(|(aggregate, ends): (u32, _)| (ends[0]..ends[1]).map(move |_| aggregate));
    nodes.zip(&pattern.free).map(|(aggregate, &free)| [aggregate, free]).collect()
}

/// A place in ordinary memory that the device copies from; it stays, since a new one of some megabytes takes
/// longer than the copy.
struct Upload {
    staging: wgpu::Buffer,
}

impl Upload {
    fn new(device: &Device, size: u64) -> Self {
        let staging = device.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("the matrix on its way"),
            size: size.next_multiple_of(16),
            usage: BufferUsages::MAP_WRITE | BufferUsages::COPY_SRC,
            mapped_at_creation: true,
        });
        Self { staging }
    }

    /// Returns the capacity [B].
    fn size(&self) -> u64 {
        self.staging.size()
    }

    /// Copies to the starts of arrays, once the commands are submitted.
    fn copy(
        &self,
        device: &Device,
        encoder: &mut wgpu::CommandEncoder,
        parts: &[(&wgpu::Buffer, &[u8])],
    ) -> Result<(), GpuError> {
        // What was asked for after the last submission.
        device.wait()?;
        let mut view = self.staging.get_mapped_range_mut(..).map_err(|error| device.fault(&error))?;
        let mut at = 0;
        for (to, bytes) in parts {
            view.slice(at..at + bytes.len()).copy_from_slice(bytes);
            let (from, size) = (at as BufferAddress, bytes.len() as BufferAddress);
            encoder.copy_buffer_to_buffer(&self.staging, from, to, 0, size);
            at += bytes.len();
        }
        drop(view);
        self.staging.unmap();
        Ok(())
    }

    /// Asks for the place once more, when what was submitted is done.
    fn again(&self) {
        self.staging.map_async(wgpu::MapMode::Write, .., |_| {});
    }
}
