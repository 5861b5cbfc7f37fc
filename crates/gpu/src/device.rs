//! Adapters and the one that is opened.

use std::sync::{Arc, Mutex, PoisonError};

use crate::GpuError;

/// Kinds of adapters, the best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// A card with memory of its own.
    Discrete,
    /// Shares its memory with the processor.
    Integrated,
    /// Part of a virtual machine.
    Virtual,
    /// Something else.
    Other,
    /// The processor in disguise: right, but slower than Pliant's own kernels for it.
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

/// An adapter and what matters of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Adapter {
    /// Its name.
    pub name: String,
    /// What it is.
    pub kind: Kind,
    /// `vulkan`, `metal` or `dx12`.
    pub backend: String,
    /// Its driver, with version.
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
    fn new(adapter: &wgpu::Adapter) -> Self {
        let (info, limits, features) = (adapter.get_info(), adapter.limits(), adapter.features());
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

/// Those that can compute, the best first.
fn found() -> Vec<(Adapter, wgpu::Adapter)> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
    descriptor.backends &= wgpu::Backends::PRIMARY;
    let backends = descriptor.backends;
    let instance = wgpu::Instance::new(descriptor);
    let mut found: Vec<(Adapter, wgpu::Adapter)> = pollster::block_on(instance.enumerate_adapters(backends))
        .into_iter()
        .map(|adapter| (Adapter::new(&adapter), adapter))
        .collect();
    found.sort_by_key(|(adapter, _)| adapter.kind);
    found
}

/// All adapters, the best first.
pub fn adapters() -> Vec<Adapter> {
    found().into_iter().map(|(adapter, _)| adapter).collect()
}

/// An open adapter.
#[derive(Clone, Debug)]
pub struct Device {
    adapter: Adapter,
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    /// The first thing that went wrong since it was opened.
    fault: Arc<Mutex<Option<GpuError>>>,
}

impl Device {
    /// Opens the best adapter, or the best one whose name contains `name` (in any case of letters).
    ///
    /// # Errors
    /// If there is none, or it can't be opened.
    pub fn open(name: Option<&str>) -> Result<Self, GpuError> {
        let mut found = found();
        let names: Vec<String> = found.iter().map(|(adapter, _)| adapter.name.clone()).collect();
        if let Some(name) = name {
            let name = name.to_lowercase();
            found.retain(|(adapter, _)| adapter.name.to_lowercase().contains(&name));
        }
        let Some((adapter, handle)) = found.into_iter().next() else {
            return Err(match name {
                Some(name) if !names.is_empty() => {
                    GpuError::UnknownAdapter { asked: name.to_owned(), found: names }
                }
                _ => GpuError::NoAdapter,
            });
        };
        let wanted = wgpu::Features::SHADER_FLOAT32_ATOMIC | wgpu::Features::TIMESTAMP_QUERY;
        let request = wgpu::DeviceDescriptor {
            label: Some("pliant"),
            required_features: handle.features() & wanted,
            required_limits: handle.limits(),
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(handle.request_device(&request)).map_err(|error| {
            GpuError::Refused { adapter: adapter.name.clone(), reason: error.to_string() }
        })?;
        let fault = Arc::new(Mutex::new(None));
        let opened = Self { adapter, device, queue, fault };
        opened.listen();
        Ok(opened)
    }

    /// What it is.
    pub fn adapter(&self) -> &Adapter {
        &self.adapter
    }

    /// The handles of wgpu, for work beside the stepper's on the same device.
    pub fn wgpu(&self) -> (&wgpu::Device, &wgpu::Queue) {
        (&self.device, &self.queue)
    }

    /// Notes what the driver reports, the first thing only: what follows are its consequences.
    fn listen(&self) {
        let note = {
            let (fault, adapter) = (self.fault.clone(), self.adapter.name.clone());
            move |error: &dyn Fn(String) -> GpuError| {
                let mut fault = fault.lock().unwrap_or_else(PoisonError::into_inner);
                fault.get_or_insert_with(|| error(adapter.clone()));
            }
        };
        let on_error = note.clone();
        self.device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            on_error(&|adapter| match &error {
                wgpu::Error::OutOfMemory { .. } => GpuError::OutOfMemory { adapter, needed: 0 },
                other => GpuError::Internal { adapter, reason: other.to_string() },
            });
        }));
        self.device.set_device_lost_callback(move |reason, message| {
            if reason != wgpu::DeviceLostReason::Destroyed {
                note(&|adapter| GpuError::Lost { adapter, reason: message.clone() });
            }
        });
    }

    /// # Errors
    /// What the driver has reported first, if anything.
    pub fn check(&self) -> Result<(), GpuError> {
        match &*self.fault.lock().unwrap_or_else(PoisonError::into_inner) {
            None => Ok(()),
            Some(fault) => Err(fault.clone()),
        }
    }

    /// # Errors
    /// If a kernel can't work on so many arrays.
    pub(crate) fn needs(&self, arrays: u32) -> Result<(), GpuError> {
        let most = self.device.limits().max_storage_buffers_per_shader_stage;
        if most < arrays {
            let what = format!("{arrays} arrays a kernel (it has {most})");
            return Err(GpuError::Lacks { adapter: self.adapter.name.clone(), what });
        }
        Ok(())
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
        let waited = self.device.poll(how);
        self.check()?;
        waited
            .map(|_| ())
            .map_err(|error| GpuError::Lost { adapter: self.adapter.name.clone(), reason: error.to_string() })
    }
}
