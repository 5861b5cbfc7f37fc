//! Adapters and the one that is opened.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use crate::GpuError;

/// Kinds of adapters, the best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// A card with memory of its own.
    Discrete,
    /// Shares its memory with the CPU.
    Integrated,
    /// Part of a virtual machine.
    Virtual,
    /// Something else.
    Other,
    /// Software on the CPU: correct, but slower than Pliant's own CPU kernels.
    Software,
}

impl std::fmt::Display for Kind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(match self {
            Self::Discrete => "discrete",
            Self::Integrated => "integrated",
            Self::Virtual => "virtual",
            Self::Other => "other",
            Self::Software => "software",
        })
    }
}

/// Adapter with its relevant properties.
#[derive(Clone, Debug, PartialEq)]
pub struct Adapter {
    /// Name of the adapter.
    pub name: String,
    /// The adapter.
    pub kind: Kind,
    /// `vulkan`, `metal` or `dx12`.
    pub backend: String,
    /// Driver of the adapter, with version.
    pub driver: String,
    /// The largest array a kernel can work on [B].
    pub largest_buffer: u64,
    /// Memory that a group of invocations shares [B].
    pub shared_memory: u32,
    /// Most invocations in a group.
    pub group_size: u32,
    /// True if it adds floating-point numbers atomically.
    pub float_atomics: bool,
    /// True if it measures times on the device.
    pub timestamps: bool,
}

impl Adapter {
    fn new(info: wgpu::AdapterInfo, limits: &wgpu::Limits, features: wgpu::Features) -> Self {
        Self {
            name: info.name,
            kind: match info.device_type {
                wgpu::DeviceType::DiscreteGpu => Kind::Discrete,
                wgpu::DeviceType::IntegratedGpu => Kind::Integrated,
                wgpu::DeviceType::VirtualGpu => Kind::Virtual,
                wgpu::DeviceType::Other => Kind::Other,
                wgpu::DeviceType::Cpu => Kind::Software,
            },
            backend: info.backend.to_string(),
            driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
            largest_buffer: limits.max_storage_buffer_binding_size.min(limits.max_buffer_size),
            shared_memory: limits.max_compute_workgroup_storage_size,
            group_size: limits.max_compute_invocations_per_workgroup,
            float_atomics: features.contains(wgpu::Features::SHADER_FLOAT32_ATOMIC),
            timestamps: features.contains(wgpu::Features::TIMESTAMP_QUERY),
        }
    }
}

/// Finds the adapters that can compute, the best first.
fn found() -> (wgpu::Instance, Vec<(Adapter, wgpu::Adapter)>) {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
    descriptor.backends &= wgpu::Backends::PRIMARY;
    let backends = descriptor.backends;
    let instance = wgpu::Instance::new(descriptor);
    let mut found: Vec<(Adapter, wgpu::Adapter)> = pollster::block_on(instance.enumerate_adapters(backends))
        .into_iter()
        .map(|adapter| (Adapter::new(adapter.get_info(), &adapter.limits(), adapter.features()), adapter))
        .collect();
    found.sort_by_key(|(adapter, _)| adapter.kind);
    (instance, found)
}

/// Lists all adapters, the best first.
pub fn adapters() -> Vec<Adapter> {
    found().1.into_iter().map(|(adapter, _)| adapter).collect()
}

/// An open adapter.
#[derive(Clone, Debug)]
pub struct Device {
    adapter: Adapter,
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    instance: wgpu::Instance,
    handle: wgpu::Adapter,
    faults: Faults,
    read_backs: Arc<AtomicU64>,
    kernels: Arc<AtomicU64>,
}

/// Errors of a device since it was opened.
#[derive(Clone, Debug)]
struct Faults {
    adapter: String,
    /// The first thing: what follows are its consequences. Only that the device is lost explains all.
    first: Arc<Mutex<Option<GpuError>>>,
    /// Size of the arrays of the last model [B].
    needed: Arc<AtomicU64>,
}

impl Faults {
    fn note(&self, error: GpuError) {
        let mut first = self.first.lock().unwrap_or_else(PoisonError::into_inner);
        if first.is_none() || matches!(error, GpuError::Lost { .. }) {
            *first = Some(error);
        }
    }

    fn out_of_memory(&self) -> GpuError {
        let needed = self.needed.load(Ordering::Relaxed).div_ceil(1 << 20);
        GpuError::OutOfMemory { adapter: self.adapter.clone(), needed }
    }

    fn report(&self, error: &wgpu::Error) {
        self.note(match error {
            wgpu::Error::OutOfMemory { .. } => self.out_of_memory(),
            other => GpuError::Internal { adapter: self.adapter.clone(), reason: other.to_string() },
        });
    }
}

impl Device {
    /// Opens the best adapter, or the best one whose name contains `name` (in any case of letters).
    ///
    /// # Errors
    /// If there is no such adapter, or it can't be opened.
    pub fn open(name: Option<&str>) -> Result<Self, GpuError> {
        Self::open_within(name, |_, _| {})
    }

    /// Opens an adapter with lower limits, to test models on smaller devices.
    ///
    /// # Errors
    /// As [`Self::open`].
    #[doc(hidden)]
    pub fn open_within(
        name: Option<&str>,
        lessen: impl FnOnce(&mut wgpu::Limits, &mut wgpu::Features),
    ) -> Result<Self, GpuError> {
        let (instance, mut found) = found();
        let names: Vec<String> = found.iter().map(|(adapter, _)| adapter.name.clone()).collect();
        if let Some(name) = name {
            let name = name.to_lowercase();
            found.retain(|(adapter, _)| adapter.name.to_lowercase().contains(&name));
        }
        let Some((_, handle)) = found.into_iter().next() else {
            return Err(match name {
                Some(name) if !names.is_empty() => {
                    GpuError::UnknownAdapter { asked: name.to_owned(), found: names }
                }
                _ => GpuError::NoAdapter,
            });
        };
        let (mut limits, mut features) = (handle.limits(), handle.features());
        lessen(&mut limits, &mut features);
        let adapter = Adapter::new(handle.get_info(), &limits, features);
        let wanted = wgpu::Features::SHADER_FLOAT32_ATOMIC | wgpu::Features::TIMESTAMP_QUERY;
        let request = wgpu::DeviceDescriptor {
            label: Some("pliant"),
            required_features: features & wanted,
            required_limits: limits,
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(handle.request_device(&request)).map_err(|error| {
            GpuError::Refused { adapter: adapter.name.clone(), reason: error.to_string() }
        })?;
        let faults = Faults { adapter: adapter.name.clone(), first: Arc::default(), needed: Arc::default() };
        let on_error = faults.clone();
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| on_error.report(&error)));
        let on_loss = faults.clone();
        device.set_device_lost_callback(move |_, reason| {
            on_loss.note(GpuError::Lost { adapter: on_loss.adapter.clone(), reason });
        });
        Ok(Self {
            adapter,
            device,
            queue,
            instance,
            handle,
            faults,
            read_backs: Arc::default(),
            kernels: Arc::default(),
        })
    }

    /// The adapter.
    pub fn adapter(&self) -> &Adapter {
        &self.adapter
    }

    /// The handles of wgpu, for work beside the stepper's on the same device.
    pub fn wgpu(&self) -> (&wgpu::Device, &wgpu::Queue) {
        (&self.device, &self.queue)
    }

    /// Returns the origin of the device: a window that draws its arrays needs both.
    pub fn origin(&self) -> (&wgpu::Instance, &wgpu::Adapter) {
        (&self.instance, &self.handle)
    }

    /// Returns the number of read-backs to ordinary memory since the device was opened, by any user.
    pub fn read_backs(&self) -> u64 {
        self.read_backs.load(Ordering::Relaxed)
    }

    pub(crate) fn count_read_back(&self) {
        self.read_backs.fetch_add(1, Ordering::Relaxed);
    }

    /// Returns the number of kernels compiled since the device was opened, for any user.
    pub fn kernels(&self) -> u64 {
        self.kernels.load(Ordering::Relaxed)
    }

    pub(crate) fn count_kernel(&self) {
        self.kernels.fetch_add(1, Ordering::Relaxed);
    }

    /// Handles an error as if the driver had reported it.
    #[doc(hidden)]
    pub fn report(&self, error: &wgpu::Error) {
        self.faults.report(error);
    }

    /// # Errors
    /// The first error that the driver reported, if any.
    pub fn check(&self) -> Result<(), GpuError> {
        match &*self.faults.first.lock().unwrap_or_else(PoisonError::into_inner) {
            None => Ok(()),
            Some(fault) => Err(fault.clone()),
        }
    }

    /// The first error that the driver reported, or else `reason`.
    pub(crate) fn fault(&self, reason: &dyn std::fmt::Display) -> GpuError {
        self.check().err().unwrap_or_else(|| GpuError::Internal {
            adapter: self.adapter.name.clone(),
            reason: reason.to_string(),
        })
    }

    /// Runs `make`, which makes the arrays of a model; `needed` gives their bytes.
    ///
    /// # Errors
    /// If the memory is full or the device fails; these errors take precedence over errors of `make`.
    pub(crate) fn fill<T>(
        &self,
        needed: impl Fn() -> u64,
        make: impl FnOnce() -> Result<T, GpuError>,
    ) -> Result<T, GpuError> {
        let scope = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let made = make();
        let full = pollster::block_on(scope.pop());
        self.faults.needed.store(needed(), Ordering::Relaxed);
        if full.is_some() {
            return Err(self.faults.out_of_memory());
        }
        self.check()?;
        made
    }

    /// # Errors
    /// If a kernel can't work on `arrays` arrays, or in groups of `group` invocations.
    pub(crate) fn allows(&self, arrays: u32, group: u32) -> Result<(), GpuError> {
        let most = self.device.limits().max_storage_buffers_per_shader_stage;
        if most < arrays {
            return Err(self.lacks(format!("{arrays} arrays per kernel (it has {most})")));
        }
        let largest = self.adapter.group_size;
        if largest < group {
            return Err(self.lacks(format!("groups of {group} invocations (it allows {largest})")));
        }
        Ok(())
    }

    /// # Errors
    /// If groups of invocations share less memory [B].
    pub(crate) fn shares(&self, bytes: usize) -> Result<(), GpuError> {
        let most = self.adapter.shared_memory;
        if (most as usize) < bytes {
            return Err(self.lacks(format!("{bytes} bytes of shared memory (it has {most})")));
        }
        Ok(())
    }

    pub(crate) fn lacks(&self, what: String) -> GpuError {
        GpuError::Lacks { adapter: self.adapter.name.clone(), what }
    }

    /// Waits until everything submitted is done.
    ///
    /// # Errors
    /// If the device fails meanwhile.
    pub fn wait(&self) -> Result<(), GpuError> {
        self.poll(wgpu::PollType::wait_indefinitely())
    }

    /// Waits until a submission is done.
    pub(crate) fn wait_for(&self, submission: wgpu::SubmissionIndex) -> Result<(), GpuError> {
        self.poll(wgpu::PollType::Wait { submission_index: Some(submission), timeout: None })
    }

    fn poll(&self, how: wgpu::PollType) -> Result<(), GpuError> {
        // wgpu 30 panics if the driver reports a lost device during a wait, after it has called the callback.
        let waited = catch_unwind(AssertUnwindSafe(|| self.device.poll(how)));
        self.check()?;
        let reason = match waited {
            Ok(Ok(_)) => return Ok(()),
            Ok(Err(error)) => error.to_string(),
            Err(_) => "waiting for it failed".to_owned(),
        };
        Err(GpuError::Lost { adapter: self.adapter.name.clone(), reason })
    }
}
