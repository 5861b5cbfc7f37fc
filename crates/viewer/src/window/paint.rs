//! Drawing of bodies in the window: the renderer in a paint callback of egui.

use std::sync::Arc;

use eframe::egui_wgpu::{self, CallbackResources, CallbackTrait, ScreenDescriptor};
use eframe::{egui, wgpu};
use pliant_geometry::Vector3;
use pliant_picture::{Camera, Drawn, Regions, Renderer, Section, Style, Subject, Target};

/// Samples a pixel.
pub const SAMPLES: u32 = 4;

/// State of the paint callback, kept among egui's resources.
struct Stageset {
    renderer: Renderer,
    drawn: Drawn,
    section: Section,
    subject: Arc<Subject>,
    /// Buffer of points that the solver wrote on the device, if it is drawn from there.
    bound: Option<wgpu::Buffer>,
}

/// One frame for the device.
pub struct Paint {
    /// Points on the window's device, drawn from there.
    pub on_device: Option<wgpu::Buffer>,
    /// The cell that is marked.
    pub critical: Option<u32>,
    pub points: Arc<Vec<Vector3>>,
    pub values: Arc<Vec<f64>>,
    pub camera: Camera,
    pub style: Style,
    pub regions: Regions,
    pub aspect: f64,
    /// Set if points or values are other than at the last paint.
    pub fresh: bool,
}

impl CallbackTrait for Paint {
    fn prepare(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        _screen: &ScreenDescriptor,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut CallbackResources,
    ) -> Vec<wgpu::CommandBuffer> {
        let Some(Stageset { renderer, drawn, section, subject, bound }) = resources.get_mut() else {
            return Vec::new();
        };
        if bound.is_some() && self.on_device.is_none() {
            (*drawn, *bound) = (Drawn::new(device, renderer, subject), None);
            drawn.set(queue, &self.points, &self.values);
        }
        match &self.on_device {
            Some(points) => {
                if bound.as_ref() != Some(points) {
                    drawn.bind_positions(device, renderer, points);
                    *bound = Some(points.clone());
                }
                if self.fresh {
                    drawn.reach(&self.points);
                }
            }
            None if self.fresh => drawn.set(queue, &self.points, &self.values),
            None => {}
        }
        drawn.set_regions(queue, subject, &self.regions, self.style.labels);
        if self.style.critical {
            drawn.mark(queue, subject, self.critical);
        }
        if let Some(plane) = &self.style.clip {
            section.cut(subject, &self.points, &self.values, plane);
            drawn.set_section(device, queue, renderer, section);
        }
        drawn.prepare(renderer, queue, encoder, &self.camera, &self.style, self.aspect);
        Vec::new()
    }

    fn paint(
        &self,
        _info: egui::PaintCallbackInfo,
        pass: &mut wgpu::RenderPass<'static>,
        resources: &CallbackResources,
    ) {
        if let Some(Stageset { renderer, drawn, .. }) = resources.get() {
            drawn.draw(renderer, pass, &self.style);
        }
    }
}

/// Copies a subject to the device. The first subject compiles the pipelines.
pub fn place(state: &egui_wgpu::RenderState, target: Target, subject: &Arc<Subject>) {
    let resources = &mut state.renderer.write().callback_resources;
    let known = resources.remove::<Stageset>();
    let renderer = known.map_or_else(|| Renderer::new(&state.device, target), |stageset| stageset.renderer);
    let drawn = Drawn::new(&state.device, &renderer, subject);
    let stageset =
        Stageset { renderer, drawn, section: Section::default(), subject: subject.clone(), bound: None };
    resources.insert(stageset);
}
