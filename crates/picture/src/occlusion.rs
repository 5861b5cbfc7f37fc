//! Ambient occlusion: the part of the light from all sides that arrives, in a map of the screen made before
//! each picture.

use std::ops::Range;

/// Rows of the map, whatever the size of the picture: light from all sides changes slowly.
pub(crate) const ROWS: u32 = 240;
/// Largest number of columns, which every device supports.
const WIDEST: u32 = 2048;
/// Distance over which things take light away, over the height of the picture.
pub(crate) const REACH: f64 = 0.07;
/// Positions, whose differences count; normals; light and depth.
const PLACES: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;
const FACINGS: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
const LIGHT: wgpu::TextureFormat = wgpu::TextureFormat::Rg16Float;
const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// The pipelines.
#[derive(Debug)]
pub(crate) struct Occlusion {
    surface: wgpu::RenderPipeline,
    section: wgpu::RenderPipeline,
    occlusion: wgpu::RenderPipeline,
    smoothed: wgpu::RenderPipeline,
    two: wgpu::BindGroupLayout,
    one: wgpu::BindGroupLayout,
}

/// Makes the bind group layout of `count` textures for fragments.
pub(crate) fn textures(device: &wgpu::Device, count: u32) -> wgpu::BindGroupLayout {
    let entry = |binding| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::FRAGMENT,
        ty: wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: false },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        },
        count: None,
    };
    let entries: Vec<_> = (0..count).map(entry).collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries })
}

impl Occlusion {
    /// Compiles the pipelines. `view` and `shape` are the layouts of the view and of the drawn shape.
    pub fn new(
        device: &wgpu::Device,
        module: &wgpu::ShaderModule,
        view: &wgpu::BindGroupLayout,
        shape: &wgpu::BindGroupLayout,
    ) -> Self {
        let [two, one] = [2, 1].map(|count| textures(device, count));
        let pipeline = |vertex: &str, fragment: &str, group: &wgpu::BindGroupLayout, targets: &[_]| {
            let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(fragment),
                bind_group_layouts: &[Some(view), Some(group)],
                immediate_size: 0,
            });
            let targets: Vec<_> = (targets.iter())
                .map(|&format: &wgpu::TextureFormat| Some(wgpu::ColorTargetState::from(format)))
                .collect();
            device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some(fragment),
                layout: Some(&layout),
                vertex: wgpu::VertexState {
                    module,
                    entry_point: Some(vertex),
                    compilation_options: Default::default(),
                    buffers: &[],
                },
                primitive: Default::default(),
                depth_stencil: (targets.len() > 1).then_some(wgpu::DepthStencilState {
                    format: DEPTH,
                    depth_write_enabled: Some(true),
                    depth_compare: Some(wgpu::CompareFunction::Less),
                    stencil: Default::default(),
                    bias: Default::default(),
                }),
                multisample: Default::default(),
                fragment: Some(wgpu::FragmentState {
                    module,
                    entry_point: Some(fragment),
                    compilation_options: Default::default(),
                    targets: &targets,
                }),
                multiview_mask: None,
                cache: None,
            })
        };
        Self {
            surface: pipeline("surface", "solid", shape, &[PLACES, FACINGS]),
            section: pipeline("section", "solid_cut", shape, &[PLACES, FACINGS]),
            occlusion: pipeline("background", "occlusion", &two, &[LIGHT]),
            smoothed: pipeline("background", "smoothed", &one, &[LIGHT]),
            two,
            one,
        }
    }
}

/// Returns the columns and rows of a map for pictures of this ratio of width to height.
fn size(aspect: f64) -> [u32; 2] {
    [(f64::from(ROWS) * aspect).round().clamp(1.0, f64::from(WIDEST)) as u32, ROWS]
}

/// The map of a subject, for pictures of one ratio of width to height.
#[derive(Debug)]
pub(crate) struct OcclusionMap {
    size: [u32; 2],
    places: wgpu::TextureView,
    facings: wgpu::TextureView,
    depth: wgpu::TextureView,
    rough: wgpu::TextureView,
    light: wgpu::TextureView,
    of_surface: wgpu::BindGroup,
    of_rough: wgpu::BindGroup,
    /// For the pass that draws.
    pub group: wgpu::BindGroup,
}

impl OcclusionMap {
    /// Without content yet.
    pub fn new(device: &wgpu::Device, pipelines: &Occlusion, aspect: f64) -> Self {
        let size = size(aspect);
        let texture = |format| {
            let texture = device.create_texture(&wgpu::TextureDescriptor {
                label: Some("occlusion"),
                size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            });
            texture.create_view(&Default::default())
        };
        let group = |layout, views: &[&wgpu::TextureView]| {
            let entries: Vec<_> = (views.iter().zip(0..))
                .map(|(view, binding)| wgpu::BindGroupEntry {
                    binding,
                    resource: wgpu::BindingResource::TextureView(view),
                })
                .collect();
            device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
        };
        let [places, facings, depth, rough, light] = [PLACES, FACINGS, DEPTH, LIGHT, LIGHT].map(texture);
        let of_surface = group(&pipelines.two, &[&places, &facings]);
        let [of_rough, of_light] = [&rough, &light].map(|view| group(&pipelines.one, &[view]));
        Self { size, places, facings, depth, rough, light, of_surface, of_rough, group: of_light }
    }

    /// True if the map suits pictures of this ratio of width to height.
    pub fn fits(&self, aspect: f64) -> bool {
        self.size == size(aspect)
    }

    /// Makes the map: of the surface and of the section.
    pub fn make(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        pipelines: &Occlusion,
        view: &wgpu::BindGroup,
        shape: &wgpu::BindGroup,
        [surface, section]: [Range<u32>; 2],
    ) {
        let colour = |view| {
            Some(wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })
        };
        {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("solid"),
                color_attachments: &[colour(&self.places), colour(&self.facings)],
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
            pass.set_bind_group(0, view, &[]);
            pass.set_bind_group(1, shape, &[]);
            pass.set_pipeline(&pipelines.surface);
            pass.draw(surface, 0..1);
            pass.set_pipeline(&pipelines.section);
            pass.draw(section, 0..1);
        }
        for (pipeline, group, target) in [
            (&pipelines.occlusion, &self.of_surface, &self.rough),
            (&pipelines.smoothed, &self.of_rough, &self.light),
        ] {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("occlusion"),
                color_attachments: &[colour(target)],
                ..Default::default()
            });
            pass.set_bind_group(0, view, &[]);
            pass.set_bind_group(1, group, &[]);
            pass.set_pipeline(pipeline);
            pass.draw(0..3, 0..1);
        }
    }
}
