//! The window uses the device of the solver, so that data on it are drawn there.

use std::sync::Arc;

use eframe::egui_wgpu::{RenderState, WgpuConfiguration, WgpuSetup, WgpuSetupExisting};
use pliant_geometry::Vector3;
use pliant_scene::World;
use pliant_sim::gpu::{Device, DevicePoints, PointValue};

use super::App;
use super::told::Told;
use crate::device::{INSPECTION, point_value};
use crate::session::Order;

/// Opens the window on the device of a world, if it has one.
pub(super) fn setup(world: &World) -> WgpuConfiguration {
    let mut configuration = WgpuConfiguration::default();
    if let Some(device) = world.device() {
        let ((instance, adapter), (device, queue)) = (device.origin(), device.wgpu());
        configuration.wgpu_setup = WgpuSetup::Existing(WgpuSetupExisting {
            instance: instance.clone(),
            adapter: adapter.clone(),
            device: device.clone(),
            queue: queue.clone(),
        });
    }
    configuration
}

/// The device of a world, if the window is on it.
pub(super) fn shared(state: &RenderState, world: &World) -> Option<Device> {
    world.device().cloned().filter(|device| *device.wgpu().0 == state.device)
}

impl App {
    /// The points of the newest frame, where they lie on the window's device.
    pub(super) fn on_device(&self) -> Option<&DevicePoints> {
        let device = self.device.as_ref()?;
        self.frame.on_device.as_ref().filter(|points| points.device().wgpu().0 == device.wgpu().0)
    }

    /// Has every frame in ordinary memory while a section is shown, or where the device is not the window's.
    pub(super) fn choose_memory(&mut self) {
        let elsewhere = self.frame.on_device.is_some() && self.on_device().is_none();
        let in_memory = self.port.cut.on || elsewhere;
        if in_memory != self.in_memory {
            self.in_memory = in_memory;
            self.order(Order::Memory(in_memory));
        }
    }

    /// Reads the points back once if they lie on the device, so that the mouse finds the current positions.
    pub(super) fn bring_points(&mut self) {
        let Some(points) = self.on_device().filter(|_| self.frame.playing) else { return };
        match points.read() {
            Ok(points) => {
                let place = |[x, y, z, _]: [f32; 4]| Vector3::new(x.into(), y.into(), z.into());
                self.port.points = Arc::new(points.into_iter().map(place).collect());
            }
            Err(error) => self.message = Some(Told::failure(error.to_string())),
        }
    }

    /// Returns the line about the device in the figures.
    pub(super) fn told_of_device(&self) -> Option<String> {
        let points = self.on_device()?;
        let name = &points.device().adapter().name;
        let rate = (1.0 / INSPECTION.as_secs_f64()).round();
        Some(match (self.in_memory, point_value(self.shown_name().as_deref())) {
            (true, _) => format!("on {name}; points are copied back for the section"),
            (false, PointValue::Given) => {
                format!("drawn on {name}; colours, energies and forces {rate} times a second")
            }
            (false, _) => format!("drawn on {name}; range, energies and forces {rate} times a second"),
        })
    }

    /// The field that is shown, with its component.
    fn shown_name(&self) -> Option<String> {
        let part = self.view.component.map(|part| format!(":{}", part.word())).unwrap_or_default();
        self.field().map(|field| format!("{}{part}", field.name()))
    }
}
