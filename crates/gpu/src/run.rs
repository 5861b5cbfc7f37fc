//! Instants of a run as the device sees them, and their submission.

use std::marker::PhantomData;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use pliant_contact::pose::Leg;
use pliant_contact::touch::Contacts;
use pliant_explicit::{DampingFactors, Lengths, StepError};
use pliant_mechanics::load::LoadKind;
use pliant_mechanics::model::Model;

use crate::contacts::{add_passages, passage_numbers};
use crate::kernel::{Binding, Bound, Memory};
use crate::transfer::Four;
use crate::{Device, GpuError};

/// Most instants in a submission.
const MOST: usize = 128;

/// A submission takes about this long [s] at most: systems reset a device that a program occupies for
/// seconds.
const LONGEST_SUBMISSION: f64 = 0.2;

/// Returns the number of instants in a submission, by the time [s] of one instant, once known.
pub(crate) fn room(pace: Option<f64>) -> usize {
    pace.map_or(16.0, |pace| LONGEST_SUBMISSION / pace).clamp(1.0, MOST as f64) as usize
}

/// Reason why steps could not be taken.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StepFailure {
    /// The run has come to an end.
    #[error(transparent)]
    Step(#[from] StepError),
    /// The device fails.
    #[error(transparent)]
    Device(#[from] GpuError),
}

impl StepFailure {
    /// Returns advice on what to try.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Step(error) => error.remedy(),
            Self::Device(error) => error.remedy(),
        }
    }
}

/// Actions of kernels at an instant.
pub(crate) mod flags {
    pub(crate) const MOVES: u32 = 1;
    pub(crate) const MEASURES: u32 = 2;
    pub(crate) const STARTS: u32 = 4;
}

/// Numbers of an instant; twin of the one in instant.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(crate) struct Instant {
    pub index: u32,
    pub row: u32,
    pub flags: u32,
    pub before: f32,
    pub ratio: f32,
    pub push: f32,
    pub per_push: f32,
    pub half_mean: f32,
    pub per_two_steps: f32,
    pub inverse_ratio: f32,
    pub per_two_means: f32,
    pub dissipation: f32,
    pub extrapolation: f32,
    pub stiffness: f32,
    pub padding: [u32; 2],
}

impl Instant {
    pub(crate) fn new(index: u32, flags: u32, lengths: Lengths, damping: DampingFactors) -> Self {
        let push = lengths.next * lengths.mean();
        Self {
            index,
            row: 0,
            flags,
            before: lengths.before as f32,
            ratio: lengths.ratio() as f32,
            push: push as f32,
            per_push: (1.0 / push) as f32,
            half_mean: (0.5 * lengths.mean()) as f32,
            per_two_steps: (0.5 / lengths.next) as f32,
            inverse_ratio: (1.0 / lengths.ratio()) as f32,
            per_two_means: (0.5 / lengths.mean()) as f32,
            dissipation: damping.dissipation as f32,
            extrapolation: damping.extrapolation as f32,
            stiffness: damping.stiffness as f32,
            padding: [0; 2],
        }
    }
}

/// Instants of the next submission, each with its row of a table of numbers found in double precision on the
/// CPU.
pub(crate) struct Rows<I> {
    instants: wgpu::Buffer,
    table: wgpu::Buffer,
    /// Bytes from one instant to the next.
    spacing: usize,
    bytes: Vec<u8>,
    numbers: Vec<f32>,
    /// Numbers in a row of the table.
    pub stride: usize,
    count: usize,
    kind: PhantomData<I>,
}

impl<I: Pod> Rows<I> {
    /// Makes rows of `stride` numbers.
    ///
    /// # Errors
    /// If the table is too large.
    pub(crate) fn new(memory: &Memory<'_>, device: &Device, stride: usize) -> Result<Self, GpuError> {
        let alignment = device.device.limits().min_uniform_buffer_offset_alignment as usize;
        let spacing = size_of::<I>().next_multiple_of(alignment);
        Ok(Self {
            instants: memory.uniform("the instants", spacing * MOST),
            table: memory.zeros("the factors of motions and loads", stride * MOST * size_of::<f32>())?,
            spacing,
            bytes: vec![],
            numbers: vec![],
            stride,
            count: 0,
            kind: PhantomData,
        })
    }

    /// The instant as a kernel sees it.
    pub(crate) fn instant(&self) -> Binding<'_> {
        Binding::Moving(&self.instants, size_of::<I>() as u64)
    }

    /// The table as a kernel sees it.
    pub(crate) fn table(&self) -> Binding<'_> {
        Binding::Read(&self.table)
    }

    /// Adds an instant, made from where its row begins; `fill` adds the numbers of the row.
    pub(crate) fn push(&mut self, instant: impl FnOnce(u32) -> I, fill: impl FnOnce(&mut Vec<f32>)) {
        let row = self.numbers.len();
        fill(&mut self.numbers);
        debug_assert_eq!(self.numbers.len(), row + self.stride);
        self.bytes.resize(self.count * self.spacing, 0);
        self.bytes.extend_from_slice(bytemuck::bytes_of(&instant(row as u32)));
        self.count += 1;
    }

    /// Returns the number of instants.
    pub(crate) fn len(&self) -> usize {
        self.count
    }

    /// Submits them: `encode` adds the kernels of each to the pass, from its place and the offset of its
    /// numbers.
    pub(crate) fn submit(
        &mut self,
        device: &Device,
        mut encode: impl FnMut(&mut wgpu::ComputePass<'_>, usize, u32),
    ) -> wgpu::SubmissionIndex {
        device.queue.write_buffer(&self.instants, 0, &self.bytes);
        device.queue.write_buffer(&self.table, 0, bytemuck::cast_slice(&self.numbers));
        let mut encoder = device.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        for place in 0..self.count {
            encode(&mut pass, place, (place * self.spacing) as u32);
        }
        drop(pass);
        self.bytes.clear();
        self.numbers.clear();
        self.count = 0;
        device.queue.submit([encoder.finish()])
    }
}

/// Instants of solids, with the factors of constraints and loads, and the ways of obstacles and tools, at
/// each.
pub(crate) struct Instants {
    /// Bindings that all kernels read.
    pub bound: Bound,
    rows: Rows<Instant>,
    pub findings: wgpu::Buffer,
    grips: wgpu::Buffer,
    contacts: Option<Arc<Contacts>>,
}

/// Places of numbers in a row of the table.
pub(crate) fn table_constants(model: &Model) -> [(&'static str, usize); 3] {
    let loads = 4 * model.constraints.len();
    let gravity = loads + model.loads.len();
    [("LOADS", loads), ("GRAVITY", gravity), ("PASSAGES", gravity + 3 * model.bodies.len())]
}

/// Makes the bindings that all kernels read.
fn bind(device: &Device, rows: &Rows<Instant>, findings: &wgpu::Buffer, grips: &wgpu::Buffer) -> Bound {
    Bound::new(device, &[rows.instant(), Binding::Write(findings), rows.table(), Binding::Write(grips)])
}

/// Findings before any instant.
const NOTHING: [u32; 5] = [u32::MAX, u32::MAX, f32::to_bits(1.0), 0, u32::MAX];

/// Entry of the findings with the first instant that waits for lists of candidates for contact.
pub(crate) const UNLISTED: usize = 4;

impl Instants {
    /// # Errors
    /// If an array is too large.
    pub(crate) fn new(
        memory: &Memory<'_>,
        device: &Device,
        model: &Model,
        contacts: Option<Arc<Contacts>>,
    ) -> Result<Self, GpuError> {
        let stride = 4 * model.constraints.len() + model.loads.len() + 3 * model.bodies.len();
        let stride = stride + passage_numbers(contacts.as_deref());
        let rows = Rows::new(memory, device, stride)?;
        let findings = memory.filled("the findings", &NOTHING)?;
        let grips = memory.zeros("the grips", 0)?;
        let bound = bind(device, &rows, &findings, &grips);
        Ok(Self { bound, rows, findings, grips, contacts })
    }

    /// Sets the grips, in the form that instant.wgsl reads.
    ///
    /// # Errors
    /// If there are too many.
    pub(crate) fn grip(&mut self, device: &Device, grips: &[Four]) -> Result<(), GpuError> {
        if self.grips.size() < size_of_val(grips) as u64 {
            self.grips = Memory::new(device).filled("the grips", grips)?;
            self.bound = bind(device, &self.rows, &self.findings, &self.grips);
        } else {
            device.queue.write_buffer(&self.grips, 0, bytemuck::cast_slice(grips));
        }
        Ok(())
    }

    /// Forgets what was found.
    pub(crate) fn forget(&self, device: &Device) {
        device.queue.write_buffer(&self.findings, 0, bytemuck::cast_slice(&NOTHING));
    }

    /// Forgets how far cells were deformed.
    pub(crate) fn forget_deformation(&self, device: &Device) {
        device.queue.write_buffer(&self.findings, 8, bytemuck::cast_slice(&NOTHING[2..UNLISTED]));
    }

    /// Continues where candidates for contact were to be listed anew.
    pub(crate) fn go_on(&self, device: &Device) {
        let place = (UNLISTED * size_of::<u32>()) as u64;
        device.queue.write_buffer(&self.findings, place, bytemuck::cast_slice(&NOTHING[UNLISTED..]));
    }

    /// Adds an instant at a time [s], `next` seconds before the one after it, with the tools that are driven.
    pub(crate) fn push(
        &mut self,
        (model, driven): (&Model, &[(u32, Leg)]),
        time: f64,
        next: f64,
        instant: Instant,
    ) {
        let Self { rows, contacts, .. } = self;
        let fill = |numbers: &mut Vec<f32>| {
            for constraint in &model.constraints {
                let [now, then] = [time, time + next].map(|t| constraint.motion.factors(t));
                for (now, then) in now.into_iter().zip(then) {
                    numbers.extend([(then - now) as f32, then as f32]);
                }
            }
            let mut gravity = vec![[0.0; 3]; model.bodies.len()];
            for load in &model.loads {
                let factor = load.curve.value(time);
                numbers.push(factor as f32);
                if let LoadKind::Gravity { body, acceleration } = load.kind {
                    for (sum, a) in gravity[body].iter_mut().zip(acceleration) {
                        *sum += factor * a;
                    }
                }
            }
            numbers.extend(gravity.as_flattened().iter().map(|&g| g as f32));
            if let Some(contacts) = contacts {
                add_passages(contacts, driven, [time, time + next], numbers);
            }
        };
        rows.push(|row| Instant { row, ..instant }, fill);
    }

    /// Returns the number of instants.
    pub(crate) fn len(&self) -> usize {
        self.rows.len()
    }

    /// Submits them: `encode` adds the kernels of each to the pass, from what they read, its place and the
    /// offset of its numbers.
    pub(crate) fn submit(
        &mut self,
        device: &Device,
        mut encode: impl FnMut(&mut wgpu::ComputePass<'_>, &Bound, usize, u32),
    ) -> wgpu::SubmissionIndex {
        let Self { rows, bound, .. } = self;
        rows.submit(device, |pass, place, offset| encode(pass, bound, place, offset))
    }
}
