//! The target of a window without a screen. It has the samples and the depth that eframe uses and the bodies
//! need.

use eframe::egui::{self, FullOutput, ScreenshotCallback, TexturesDelta, ViewportCommand};
use eframe::egui_wgpu::capture::CaptureState;
use eframe::egui_wgpu::{RenderState, Renderer, RendererOptions, ScreenDescriptor};
use eframe::wgpu;
use egui_kittest::TestRenderer;
use pliant_sim::gpu::Device;

use crate::window::paint::SAMPLES;

const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// A picture on a device.
pub struct Screen {
    pub state: RenderState,
    device: Device,
    size: [u32; 2],
    colours: wgpu::TextureView,
    depth: wgpu::TextureView,
    capture: CaptureState,
}

impl Screen {
    pub fn new(device: &Device, size: [u32; 2]) -> Self {
        let ((instance, adapter), (gpu, queue)) = (device.origin(), device.wgpu());
        let options = RendererOptions {
            msaa_samples: SAMPLES,
            depth_stencil_format: Some(DEPTH),
            ..RendererOptions::PREDICTABLE
        };
        let renderer = Renderer::new(gpu, FORMAT, options);
        let [width, height] = size;
        let extent = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
        let texture = |format| {
            let texture = gpu.create_texture(&wgpu::TextureDescriptor {
                label: None,
                size: extent,
                mip_level_count: 1,
                sample_count: SAMPLES,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
                view_formats: &[],
            });
            texture.create_view(&wgpu::TextureViewDescriptor::default())
        };
        let (colours, depth) = (texture(FORMAT), texture(DEPTH));
        let capture = CaptureState::new(gpu, extent, FORMAT);
        let state = RenderState {
            adapter: adapter.clone(),
            available_adapters: Vec::new(),
            instance: instance.clone(),
            device: gpu.clone(),
            queue: queue.clone(),
            target_format: FORMAT,
            renderer: std::sync::Arc::new(egui::mutex::RwLock::new(renderer)),
        };
        Self { state, device: device.clone(), size, colours, depth, capture }
    }

    /// Returns the receiver of the textures of each frame.
    pub fn textures(&self) -> impl TestRenderer + use<> {
        Textures(self.state.clone())
    }

    /// Draws a frame, and passes the picture to the code that asked for it.
    pub fn paint(&mut self, context: &egui::Context, output: &FullOutput) {
        let pixels_per_point = context.pixels_per_point();
        let screen = ScreenDescriptor { size_in_pixels: self.size, pixels_per_point };
        let primitives = context.tessellate(output.shapes.clone(), pixels_per_point);
        let RenderState { device, queue, renderer, .. } = &self.state;
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut renderer = renderer.write();
        let before = renderer.update_buffers(device, queue, &mut encoder, &primitives, &screen);
        let picture = self.capture.texture.create_view(&wgpu::TextureViewDescriptor::default());
        let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.colours,
                resolve_target: Some(&picture),
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::WHITE),
                    store: wgpu::StoreOp::Store,
                },
                depth_slice: None,
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        renderer.render(&mut pass.forget_lifetime(), &primitives, &screen);
        let asked = asked(output);
        let copied = (!asked.is_empty()).then(|| self.capture.copy_textures(device, None, &mut encoder));
        queue.submit(before.into_iter().chain([encoder.finish()]));
        if let Some(copied) = copied {
            self.capture.read_screen_rgba(copied, asked);
        }
        device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        self.device.check().unwrap();
    }
}

/// Returns the requests for a picture in this frame.
fn asked(output: &FullOutput) -> Vec<ScreenshotCallback> {
    let commands = output.viewport_output.values().flat_map(|viewport| &viewport.commands);
    commands
        .filter_map(|command| match command {
            ViewportCommand::Screenshot(callback) => Some(callback.clone()),
            _ => None,
        })
        .collect()
}

/// Brings textures of egui to the device.
struct Textures(RenderState);

impl TestRenderer for Textures {
    fn handle_delta(&mut self, delta: &mut TexturesDelta) {
        let RenderState { device, queue, renderer, .. } = &self.0;
        let mut renderer = renderer.write();
        for (id, images) in delta.set.drain() {
            images.iter().for_each(|image| renderer.update_texture(device, queue, id, image));
        }
        delta.free.drain().for_each(|id| renderer.free_texture(&id));
    }
}
