//! Peak rates of a device, measured: copies, multiply-adds, and kernel launches.
//!
//! A chain of the same kernel is submitted again and again, longer and longer until it takes [`ENOUGH`]. The
//! best of the repeats counts, since other work can only slow a chain down.

use std::time::{Duration, Instant};

use crate::kernel::{Binding, Bound, Kernel, Memory};
use crate::{Device, GpuError};

/// Bytes of the array that is copied, where the adapter allows as many.
const COPIED: u64 = 256 << 20;
/// Invocations that multiply and add.
const INVOCATIONS: usize = 1 << 18;
/// Rounds of each: eight multiply-adds on four numbers.
const ROUNDS: usize = 64;
/// Least duration of a chain.
const ENOUGH: Duration = Duration::from_millis(30);
/// The longest chain in a submission.
const LONGEST: usize = 1 << 14;

/// Peak rates of a device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviceRates {
    /// Bytes read and written in copying [1/s].
    pub copy: f64,
    /// Operations in multiply-adds in single precision [1/s], two each.
    pub multiply_add: f64,
    /// Wall time of an empty kernel in a chain [s].
    pub launch: f64,
}

impl DeviceRates {
    /// Measures the rates `repeats` times.
    ///
    /// # Errors
    /// If the device fails.
    pub fn measure(device: &Device, repeats: usize) -> Result<Self, GpuError> {
        let memory = Memory::new(device);
        let bytes = COPIED.min(device.adapter().largest_buffer) as usize;
        let numbers = vec![0.5_f32; bytes / size_of::<f32>()];
        let source = memory.filled("the array to copy", &numbers)?;
        let target = memory.zeros("its copy", bytes)?;
        let nothing = memory.uniform("nothing", 256);
        let instant = Bound::new(device, &[Binding::Moving(&nothing, 256)]);
        let arrays = Bound::new(device, &[Binding::Read(&source), Binding::Write(&target)]);
        let kernel = |name, snippet, invocations| {
            Kernel::new(device, name, &[("ROUNDS", ROUNDS)], &[snippet], &[&instant, &arrays], invocations)
        };
        let best = |kernel: Result<Kernel, GpuError>| -> Result<f64, GpuError> {
            let (kernel, mut best) = (kernel?, f64::INFINITY);
            for _ in 0..repeats.max(1) {
                best = best.min(seconds(device, &kernel, &instant)?);
            }
            Ok(best)
        };
        let copy = kernel("copy", include_str!("shaders/copy.wgsl"), bytes / 16);
        let arithmetic = kernel(
            "multiply and add",
            include_str!("shaders/multiply_add.wgsl"),
            INVOCATIONS.min(bytes / 16),
        );
        let empty = kernel("empty", include_str!("shaders/empty.wgsl"), 1);
        let operations = 2 * 4 * 8 * ROUNDS * INVOCATIONS.min(bytes / 16);
        Ok(Self {
            copy: 2.0 * bytes as f64 / best(copy)?,
            multiply_add: operations as f64 / best(arithmetic)?,
            launch: best(empty)?,
        })
    }
}

/// Wall time of a kernel in a chain long enough to forget its beginning [s].
fn seconds(device: &Device, kernel: &Kernel, instant: &Bound) -> Result<f64, GpuError> {
    let mut length = 1;
    loop {
        let started = Instant::now();
        let mut encoder = device.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        (0..length).for_each(|_| kernel.run(&mut pass, instant, 0, 0));
        drop(pass);
        device.queue.submit([encoder.finish()]);
        device.wait()?;
        let taken = started.elapsed();
        if taken >= ENOUGH || length >= LONGEST {
            return Ok(taken.as_secs_f64() / length as f64);
        }
        let each = taken.as_secs_f64() / length as f64;
        length = ((1.2 * ENOUGH.as_secs_f64() / each) as usize).clamp(length + 1, LONGEST);
    }
}
