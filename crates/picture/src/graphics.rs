//! The device that draws.

use std::sync::{Arc, Mutex, PoisonError};

use crate::error::PictureError;

/// An open GPU.
#[derive(Clone, Debug)]
pub struct Graphics {
    /// Its handle.
    pub device: wgpu::Device,
    /// Queue for work on the device.
    pub queue: wgpu::Queue,
    adapter: String,
    fault: Arc<Mutex<Option<String>>>,
}

impl Graphics {
    /// Opens the best adapter that draws: GPUs first, software drivers last. The variables `WGPU_BACKEND` and
    /// `VK_DRIVER_FILES` restrict the choice.
    ///
    /// # Errors
    /// If none exists, or it does not open.
    pub fn open() -> Result<Self, PictureError> {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
        descriptor.backends &= wgpu::Backends::PRIMARY;
        let backends = descriptor.backends;
        let instance = wgpu::Instance::new(descriptor);
        let mut found: Vec<wgpu::Adapter> = pollster::block_on(instance.enumerate_adapters(backends));
        found.sort_by_key(|adapter| match adapter.get_info().device_type {
            wgpu::DeviceType::DiscreteGpu => 0,
            wgpu::DeviceType::IntegratedGpu => 1,
            wgpu::DeviceType::VirtualGpu => 2,
            wgpu::DeviceType::Other => 3,
            wgpu::DeviceType::Cpu => 4,
        });
        let adapter = found.into_iter().next().ok_or(PictureError::NoAdapter)?;
        let name = adapter.get_info().name;
        let request = wgpu::DeviceDescriptor {
            label: Some("pliant pictures"),
            required_limits: adapter.limits(),
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&request))
            .map_err(|error| PictureError::Refused { adapter: name.clone(), reason: error.to_string() })?;
        Ok(Self::of(device, queue, name))
    }

    /// Takes up a device that someone else opened.
    pub fn of(device: wgpu::Device, queue: wgpu::Queue, adapter: String) -> Self {
        let fault = Arc::<Mutex<Option<String>>>::default();
        let noted = fault.clone();
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            noted.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert_with(|| error.to_string());
        }));
        Self { device, queue, adapter, fault }
    }

    /// The name of the GPU.
    pub fn adapter(&self) -> &str {
        &self.adapter
    }

    /// Returns the error of the device since it was opened, if any.
    pub(crate) fn check(&self) -> Result<(), PictureError> {
        match self.fault.lock().unwrap_or_else(PoisonError::into_inner).clone() {
            Some(reason) => Err(PictureError::Device { adapter: self.adapter.clone(), reason }),
            None => Ok(()),
        }
    }

    pub(crate) fn failed(&self, reason: impl ToString) -> PictureError {
        PictureError::Device { adapter: self.adapter.clone(), reason: reason.to_string() }
    }
}
