//! Pictures off screen.

use pliant_geometry::Vector3;

use crate::camera::Camera;
use crate::error::PictureError;
use crate::graphics::Graphics;
use crate::picture::Picture;
use crate::regions::Regions;
use crate::renderer::{Drawn, Renderer, Target};
use crate::section::Section;
use crate::style::Style;
use crate::subject::Subject;

/// A subject at an instant.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frame {
    /// Position of each point [m].
    pub points: Vec<Vector3>,
    /// Value at each point, or empty.
    pub values: Vec<f64>,
    /// The cell that is marked, as [`critical_cell`](crate::critical_cell) counts.
    pub critical: Option<u32>,
}

/// Off screen, in four samples a pixel. Colours are mixed in coded form, as in windows, so that transparent
/// bodies look the same in both.
const TARGET: Target =
    Target { format: wgpu::TextureFormat::Rgba8Unorm, depth: wgpu::TextureFormat::Depth32Float, samples: 4 };

/// Takes pictures of one subject, all of one size.
#[derive(Debug)]
pub struct Offscreen<'s> {
    graphics: Graphics,
    subject: &'s Subject,
    renderer: Renderer,
    drawn: Drawn,
    section: Section,
    size: [u32; 2],
    samples: wgpu::TextureView,
    depth: wgpu::TextureView,
    resolved: wgpu::Texture,
    read: wgpu::Buffer,
}

/// Rows of a picture in a buffer begin at multiples of this [B].
const ROW: u32 = wgpu::COPY_BYTES_PER_ROW_ALIGNMENT;

impl<'s> Offscreen<'s> {
    /// Prepares pictures of this width and height in pixels.
    ///
    /// # Errors
    /// If the GPU does not support this size, or fails.
    pub fn new(
        graphics: &Graphics,
        subject: &'s Subject,
        [width, height]: [u32; 2],
    ) -> Result<Self, PictureError> {
        let device = &graphics.device;
        let largest = device.limits().max_texture_dimension_2d;
        if !(1..=largest).contains(&width) || !(1..=largest).contains(&height) {
            let adapter = graphics.adapter().to_owned();
            return Err(PictureError::Size { adapter, width, height, largest });
        }
        let renderer = Renderer::new(device, TARGET);
        let texture = |format, sample_count, usage| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: None,
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage,
                view_formats: &[],
            })
        };
        let attached = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let samples = texture(TARGET.format, TARGET.samples, attached).create_view(&Default::default());
        let depth = texture(TARGET.depth, TARGET.samples, attached).create_view(&Default::default());
        let resolved = texture(TARGET.format, 1, attached | wgpu::TextureUsages::COPY_SRC);
        let read = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("pixels"),
            size: u64::from((4 * width).next_multiple_of(ROW)) * u64::from(height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let drawn = Drawn::new(device, &renderer, subject);
        graphics.check()?;
        Ok(Self {
            graphics: graphics.clone(),
            subject,
            renderer,
            drawn,
            section: Section::default(),
            size: [width, height],
            samples,
            depth,
            resolved,
            read,
        })
    }

    /// Takes a picture.
    ///
    /// # Errors
    /// If the GPU fails.
    pub fn draw(
        &mut self,
        frame: &Frame,
        camera: &Camera,
        style: &Style,
        regions: &Regions,
    ) -> Result<Picture, PictureError> {
        let Graphics { device, queue, .. } = &self.graphics;
        let [width, height] = self.size;
        self.drawn.set(queue, &frame.points, &frame.values);
        if let Some(plane) = &style.clip {
            self.section.cut(self.subject, &frame.points, &frame.values, plane);
            self.drawn.set_section(device, queue, &self.renderer, &self.section);
        }
        self.drawn.set_regions(queue, self.subject, regions, style.labels);
        self.drawn.mark(queue, self.subject, frame.critical);
        let mut encoder = device.create_command_encoder(&Default::default());
        let aspect = f64::from(width) / f64::from(height);
        self.drawn.prepare(&self.renderer, queue, &mut encoder, camera, style, aspect);
        let resolved = self.resolved.create_view(&Default::default());
        {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("picture"),
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &self.samples,
                    depth_slice: None,
                    resolve_target: Some(&resolved),
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                        store: wgpu::StoreOp::Discard,
                    },
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
            self.drawn.draw(&self.renderer, &mut pass, style);
        }
        let row = (4 * width).next_multiple_of(ROW);
        encoder.copy_texture_to_buffer(
            self.resolved.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &self.read,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row),
                    rows_per_image: Some(height),
                },
            },
            wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        );
        queue.submit([encoder.finish()]);
        self.pixels(row as usize)
    }

    fn pixels(&self, row: usize) -> Result<Picture, PictureError> {
        let graphics = &self.graphics;
        let (send, receive) = std::sync::mpsc::channel();
        self.read.slice(..).map_async(wgpu::MapMode::Read, move |result| {
            // Nobody listens only where waiting has failed already.
            let _ = send.send(result);
        });
        graphics.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|error| graphics.failed(error))?;
        let mapped = receive.recv().map_err(|error| graphics.failed(error))?;
        mapped.map_err(|error| graphics.failed(error))?;
        graphics.check()?;
        let [width, height] = self.size;
        let mut rgba = Vec::with_capacity(4 * width as usize * height as usize);
        {
            let bytes = self.read.slice(..).get_mapped_range().map_err(|error| graphics.failed(error))?;
            bytes.chunks(row).for_each(|line| rgba.extend_from_slice(&line[..4 * width as usize]));
        }
        self.read.unmap();
        Ok(Picture { width, height, rgba })
    }
}
