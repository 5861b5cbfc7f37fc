//! Conjugate gradients of implicit steps, in single precision: inverted blocks of the nodes, and with them rigid motions of aggregates.
//!
//! The CPU sends the lower half of the matrix; a kernel makes rows of blocks of it. The coarse matrix is inverted in full, pivot by pivot. An
//! iteration takes four kernels (three without aggregates): A p; x, r and z = D⁻¹ r with the forces on aggregates; their motions; p.
//! Sums are found group by group, and every group that needs a sum adds up those of the groups in the same order. The device itself decides
//! where to stop: what was submitted after that does nothing. So bits depend on no number of submissions.
//!
//! `pliant-implicit` takes what comes back as a correction under a residual in double precision.

use std::time::Instant;

use pliant_implicit::{
    BlockPattern, BlockValues, DeviceError, DeviceSolver, DeviceTimes, LinearDevice, Pass, PassEnd,
};
use wgpu::{BufferAddress, BufferUsages};

use crate::kernel::{Binding, Bound, GROUP, Kernel, Memory, Sides};
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

impl LinearDevice for Device {
    fn aggregates(&self) -> usize {
        AGGREGATES
    }

    fn solver(&self, pattern: &BlockPattern<'_>) -> Result<Box<dyn DeviceSolver>, DeviceError> {
        Ok(Box::new(Gradients::new(self, pattern).map_err(failed)?))
    }
}

fn failed(error: GpuError) -> DeviceError {
    DeviceError(format!("{error}; {}", error.remedy()))
}

/// How far a pass is, as its kernels see it; twin of progress.wgsl.
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

/// The arrays of the preconditioner's coarse part.
#[derive(Debug)]
struct CoarseArrays {
    blocks: wgpu::Buffer,
    arm: wgpu::Buffer,
    inverse: Sides,
}

/// Equations of a pattern on a device.
struct Gradients {
    device: Device,
    nodes: usize,
    aggregates: usize,
    lower: wgpu::Buffer,
    inverse: wgpu::Buffer,
    coarse: Option<CoarseArrays>,
    x: wgpu::Buffer,
    r: wgpu::Buffer,
    p: wgpu::Buffer,
    ap: wgpu::Buffer,
    progress: Sides,
    /// Pivots, and nothing for kernels without one.
    pivots: Bound,
    expand: Kernel,
    scatter: Option<Kernel>,
    invert: Option<Kernel>,
    multiply: Kernel,
    update: Kernel,
    solve_coarse: Option<Kernel>,
    turn: Kernel,
    upload: Upload,
    transfer: Transfer,
    /// Iterations of the last pass.
    last: usize,
    times: DeviceTimes,
}

impl std::fmt::Debug for Gradients {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Gradients").field("device", &self.device.adapter().name).finish_non_exhaustive()
    }
}

impl Gradients {
    fn new(device: &Device, pattern: &BlockPattern<'_>) -> Result<Self, GpuError> {
        let memory = Memory::new(device);
        device.fill(|| memory.bytes(), || Self::make(device, &memory, pattern))
    }

    fn make(device: &Device, memory: &Memory<'_>, pattern: &BlockPattern<'_>) -> Result<Self, GpuError> {
        let (nodes, aggregates) = (pattern.nodes(), pattern.aggregates());
        let chunks = (6 * nodes).div_ceil(GROUP as usize);
        let entries = pattern.source.len();
        let most = pattern.source.iter().filter(|&&at| at != u32::MAX).max();
        let lower_entries = most.map_or(1, |&last| last as usize + 1);
        let pairs = pattern.touching.as_deref().unwrap_or_default();

        let vector = |what| memory.zeros(what, 24 * nodes);
        let lower = memory.zeros("the entries of the matrix", 4 * lower_entries)?;
        let value = memory.zeros("the blocks of the matrix", 4 * entries)?;
        let source = memory.filled("the places of the matrix", pattern.source)?;
        let row_start = memory.filled("the rows of the matrix", pattern.row_start)?;
        let column = memory.filled("the columns of the matrix", pattern.column)?;
        let inverse = memory.zeros("the inverses of the nodes", 144 * nodes)?;
        let start = memory.filled("the aggregates", pattern.aggregate_start)?;
        let [x, r, z] = [vector("the solution")?, vector("the residual")?, vector("its correction")?];
        let [p, ap] = [vector("the direction")?, vector("its product")?];
        let curvatures = memory.zeros("the curvatures", 4 * chunks)?;
        let products = memory.zeros("the products", 8 * aggregates)?;
        let force = memory.zeros("the forces on the aggregates", 24 * aggregates)?;
        let motion = memory.zeros("the motions of the aggregates", 24 * aggregates)?;
        let powers = memory.zeros("the powers of the aggregates", 4 * aggregates)?;
        let home = memory.filled("the aggregates of the nodes", &homes(pattern))?;
        let progress = memory.sides("the progress", size_of::<Progress>(), true)?;
        let arm = memory.zeros("the arms of the nodes", 16 * nodes)?;
        let coarse = match &pattern.touching {
            None => None,
            Some(pairs) => Some(CoarseArrays {
                blocks: memory.zeros("the blocks of the aggregates", 144 * pairs.len())?,
                arm: arm.clone(),
                inverse: memory.sides(
                    "the inverse of the aggregates",
                    144 * aggregates * aggregates,
                    true,
                )?,
            }),
        };

        let pivot = memory.uniform("the pivots", PLACE * aggregates);
        let numbers: Vec<[u32; PLACE / 4]> = (0..aggregates as u32).map(|own| [own; PLACE / 4]).collect();
        device.queue.write_buffer(&pivot, 0, bytemuck::cast_slice(&numbers));
        let bind = |bindings: &[Binding<'_>]| Bound::new(device, bindings);
        let pivots = bind(&[Binding::Moving(&pivot, 16)]);
        let now = bind(&[Binding::ReadNow(&progress)]);
        let constants = [
            ("NODES", nodes),
            ("AGGREGATES", aggregates),
            ("CHUNKS", chunks),
            ("ENTRIES", entries),
            ("LOWER", lower_entries),
            ("PAIRS", pairs.len()),
            ("COARSE", usize::from(coarse.is_some())),
        ];
        let plain = |name, snippet, arrays: &Bound, count| {
            Kernel::new(device, name, &constants, &[snippet], &[&pivots, arrays], count)
        };
        let summing = |name, snippet, arrays: &[&Bound], count| {
            let snippets = [
                include_str!("shaders/gradients/progress.wgsl"),
                include_str!("shaders/gradients/sum.wgsl"),
                snippet,
            ];
            Kernel::new(device, name, &constants, &snippets, &[&[&pivots], arrays].concat(), count)
        };
        let expand = plain(
            "expand",
            include_str!("shaders/gradients/expand.wgsl"),
            &bind(&[Binding::Read(&lower), Binding::Read(&source), Binding::Write(&value)]),
            entries,
        )?;
        let (mut scatter, mut invert, mut solve_coarse) = (None, None, None);
        if let Some(CoarseArrays { blocks, inverse, .. }) = &coarse {
            let (count, pairs) = (pairs.len(), memory.filled("the pairs of aggregates", pairs)?);
            scatter = Some(plain(
                "scatter",
                include_str!("shaders/gradients/scatter.wgsl"),
                &bind(&[Binding::Read(blocks), Binding::Read(&pairs), Binding::Write(&inverse[0])]),
                36 * count,
            )?);
            invert = Some(plain(
                "invert",
                include_str!("shaders/gradients/invert.wgsl"),
                &bind(&[Binding::ReadNow(inverse), Binding::WriteNext(inverse)]),
                aggregates * aggregates,
            )?);
            let last = &inverse[aggregates % 2];
            let arrays = bind(&[
                Binding::Read(last),
                Binding::Read(&force),
                Binding::Write(&motion),
                Binding::Write(&powers),
            ]);
            let mut kernel =
                summing("coarse", include_str!("shaders/gradients/coarse.wgsl"), &[&now, &arrays], 1)?;
            kernel.dispatch_groups(aggregates as u32);
            solve_coarse = Some(kernel);
        }
        let arrays = bind(&[
            Binding::Read(&row_start),
            Binding::Read(&column),
            Binding::Read(&value),
            Binding::Read(&p),
            Binding::Write(&ap),
            Binding::Write(&curvatures),
        ]);
        let multiply = summing(
            "multiply",
            include_str!("shaders/gradients/multiply.wgsl"),
            &[&now, &arrays],
            6 * nodes,
        )?;
        let arrays = bind(&[
            Binding::Read(&curvatures),
            Binding::Read(&start),
            Binding::Read(&inverse),
            Binding::Read(&p),
            Binding::Read(&ap),
            Binding::Write(&x),
            Binding::Write(&r),
            Binding::Write(&z),
            Binding::Write(&products),
        ]);
        let forces = bind(&[Binding::Read(&arm), Binding::Write(&force)]);
        let mut update =
            summing("update", include_str!("shaders/gradients/update.wgsl"), &[&now, &arrays, &forces], 1)?;
        update.dispatch_groups(aggregates as u32);
        let both = bind(&[Binding::ReadNow(&progress), Binding::WriteNext(&progress)]);
        let arrays = bind(&[
            Binding::Read(&curvatures),
            Binding::Read(&products),
            Binding::Read(&z),
            Binding::Write(&p),
        ]);
        let motions = bind(&[
            Binding::Read(&arm),
            Binding::Read(&motion),
            Binding::Read(&powers),
            Binding::Read(&home),
        ]);
        let snippet = include_str!("shaders/gradients/turn.wgsl");
        let turn = summing("turn", snippet, &[&both, &arrays, &motions], 6 * nodes)?;
        let bytes = 4 * lower_entries + 144 * nodes + 16 * nodes + 144 * pairs.len();
        Ok(Self {
            upload: Upload::new(device, bytes as u64),
            device: device.clone(),
            nodes,
            aggregates,
            lower,
            inverse,
            coarse,
            x,
            r,
            p,
            ap,
            progress,
            pivots,
            expand,
            scatter,
            invert,
            multiply,
            update,
            solve_coarse,
            turn,
            transfer: Transfer::default(),
            last: FIRST,
            times: DeviceTimes::default(),
        })
    }

    fn take_values(&mut self, values: &BlockValues<'_>) -> Result<(), GpuError> {
        let mut encoder = self.device.device.create_command_encoder(&Default::default());
        let mut parts = vec![
            (&self.lower, bytemuck::cast_slice(values.lower)),
            (&self.inverse, bytemuck::cast_slice(values.inverse)),
        ];
        if let Some(CoarseArrays { blocks, arm, inverse }) = &self.coarse {
            parts.push((arm, bytemuck::cast_slice(values.arm)));
            parts.push((blocks, bytemuck::cast_slice(values.coarse)));
            encoder.clear_buffer(&inverse[0], 0, None);
        }
        self.upload.copy(&self.device, &mut encoder, &parts)?;
        let mut pass = encoder.begin_compute_pass(&Default::default());
        self.expand.run(&mut pass, &self.pivots, 0, 0);
        if let (Some(scatter), Some(invert)) = (&self.scatter, &self.invert) {
            scatter.run(&mut pass, &self.pivots, 0, 0);
            for pivot in 0..self.aggregates {
                invert.run(&mut pass, &self.pivots, (PLACE * pivot) as u32, pivot % 2);
            }
        }
        drop(pass);
        self.device.queue.submit([encoder.finish()]);
        self.upload.again();
        self.device.check()
    }

    /// The kernels after A p.
    fn finish_iteration(&self, pass: &mut wgpu::ComputePass<'_>, side: usize) {
        self.update.run(pass, &self.pivots, 0, side);
        if let Some(coarse) = &self.solve_coarse {
            coarse.run(pass, &self.pivots, 0, side);
        }
        self.turn.run(pass, &self.pivots, 0, side);
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
        self.device.queue.write_buffer(&self.r, 0, bytemuck::cast_slice(right));
        self.device.queue.write_buffer(&self.progress[0], 0, bytemuck::bytes_of(&start));
        let mut encoder = self.device.device.create_command_encoder(&Default::default());
        for vector in [&self.x, &self.p, &self.ap] {
            encoder.clear_buffer(vector, 0, None);
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
                self.multiply.run(&mut pass, &self.pivots, 0, side);
                self.finish_iteration(&mut pass, side);
                side = 1 - side;
            }
            drop(pass);
            let submission = self.device.queue.submit([encoder.finish()]);
            self.device.wait_for(submission)?;
            let read = Instant::now();
            self.times.iterations += read - begun;
            let mut progress = Progress::default();
            let bytes = (24 * self.nodes) as BufferAddress;
            let parts = [(&self.progress[side], size_of::<Progress>() as BufferAddress), (&self.x, bytes)];
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
    let nodes = groups.flat_map(|(own, ends): (u32, _)| (ends[0]..ends[1]).map(move |_| own));
    nodes.zip(&pattern.free).map(|(own, &free)| [own, free]).collect()
}

/// A place in ordinary memory that the device copies from; it stays, since a new one of some megabytes takes longer than the copy.
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
