//! Draws subjects into any render pass: a window's or one off screen.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use pliant_geometry::Vector3;
use wgpu::util::{BufferInitDescriptor, DeviceExt};

use crate::camera::{Camera, Projection};
use crate::colour::{ColourMap, linear};
use crate::layers::Layers;
use crate::lines::{Line, MOST_EDGES};
use crate::occlusion::{Occlusion, OcclusionMap, REACH, ROWS, textures};
use crate::regions::{Kind as CellKind, Regions, light};
use crate::section::{Corner, Section};
use crate::style::{MISSING, PLAIN, Style, Texture};
use crate::subject::Subject;
use crate::vertex::staged;

/// The render target.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Target {
    /// Format of its colours.
    pub format: wgpu::TextureFormat,
    /// Format of its depth.
    pub depth: wgpu::TextureFormat,
    /// Samples a pixel.
    pub samples: u32,
}

/// The pipelines.
#[derive(Debug)]
pub struct Renderer {
    device: wgpu::Device,
    target: Target,
    occlusion: Occlusion,
    view: wgpu::BindGroupLayout,
    shape: wgpu::BindGroupLayout,
    normals: wgpu::BindGroupLayout,
    background: wgpu::RenderPipeline,
    opaque: wgpu::RenderPipeline,
    clipped: wgpu::RenderPipeline,
    glass: wgpu::RenderPipeline,
    clipped_glass: wgpu::RenderPipeline,
    wireframe: wgpu::RenderPipeline,
    fibres: wgpu::RenderPipeline,
    mark: wgpu::RenderPipeline,
    section: wgpu::RenderPipeline,
    ghost: wgpu::RenderPipeline,
    compute: wgpu::ComputePipeline,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct View {
    projection_view: [[f32; 4]; 4],
    right: [f32; 4],
    up: [f32; 4],
    towards: [f32; 4],
    eye: [f32; 4],
    plane: [f32; 4],
    range: [f32; 4],
    plain: [f32; 4],
    missing: [f32; 4],
    ghost: [f32; 4],
    top: [f32; 4],
    bottom: [f32; 4],
    edge: [f32; 4],
    line: [f32; 4],
    skin: [f32; 4],
    occlusion: [f32; 4],
}

/// Cover of the edges of cells.
const EDGES: f32 = 0.55;
/// Coverage of the shape at rest where it faces away.
const GHOST: f32 = 0.85;
/// Half the width of a fibre and of an edge of the marked cell, over the height of the picture.
const WIDTHS: [f32; 2] = [0.0026, 0.0034];
/// Distance by which lines are lifted towards the eye, over the size of the body.
const LIFT: f64 = 0.004;
/// Strength of the texture on tissue and under colours of values.
const SKIN: [f32; 2] = [1.0, 0.45];
/// Invocations of a group of the kernel of normals.
const GROUP: u32 = 256;

fn layout(
    device: &wgpu::Device,
    bindings: &[(wgpu::ShaderStages, wgpu::BufferBindingType)],
) -> wgpu::BindGroupLayout {
    let entry = |(binding, &(visibility, ty)): (usize, &_)| wgpu::BindGroupLayoutEntry {
        binding: binding as u32,
        visibility,
        ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
        count: None,
    };
    let entries: Vec<_> = bindings.iter().enumerate().map(entry).collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries })
}

impl Renderer {
    /// Compiles the shaders for a target.
    pub fn new(device: &wgpu::Device, target: Target) -> Self {
        use wgpu::{BufferBindingType, ShaderStages};
        let read = BufferBindingType::Storage { read_only: true };
        let write = BufferBindingType::Storage { read_only: false };
        let uniform = (ShaderStages::VERTEX_FRAGMENT, BufferBindingType::Uniform);
        let view = layout(device, &[uniform, (ShaderStages::FRAGMENT, read), (ShaderStages::FRAGMENT, read)]);
        let shape = layout(device, &[(ShaderStages::VERTEX, read); 7]);
        let normals =
            layout(device, &[read, read, read, write, read, read].map(|kind| (ShaderStages::COMPUTE, kind)));
        let source = concat!(include_str!("shader.wgsl"), include_str!("occlusion.wgsl"));
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("shader"),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        });
        let occlusion = Occlusion::new(device, &module, &view, &shape);
        let pipelines = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("surface"),
            bind_group_layouts: &[Some(&view), Some(&shape), Some(&textures(device, 1))],
            immediate_size: 0,
        });
        let drawing = Drawing { device, module: &module, layout: &pipelines, target };
        let pipeline = |vertex, fragment, kind| drawing.pipeline(vertex, fragment, kind);
        Self {
            device: device.clone(),
            target,
            occlusion,
            background: pipeline("background", "sky", Kind::Behind),
            opaque: pipeline("surface", "opaque", Kind::Solid),
            clipped: pipeline("surface", "clipped", Kind::Solid),
            glass: pipeline("surface", "opaque", Kind::Glass),
            clipped_glass: pipeline("surface", "clipped", Kind::Glass),
            wireframe: pipeline("surface", "wireframe", Kind::Wire),
            fibres: pipeline("line", "stroke", Kind::Line),
            mark: pipeline("line", "stroke", Kind::Mark),
            section: pipeline("section", "opaque", Kind::Cut),
            ghost: pipeline("resting", "ghost", Kind::Veil),
            compute: kernel(device, &normals),
            view,
            shape,
            normals,
        }
    }
}

/// Order and blending of drawn things.
enum Kind {
    Behind,
    Solid,
    Wire,
    /// Section that may be transparent, and partly hides the things behind it.
    Cut,
    Glass,
    Veil,
    Line,
    /// Seen through everything.
    Mark,
}

impl Kind {
    /// Returns true if the depth is kept for later drawing, and the comparison with the depth drawn before.
    fn depth(&self) -> (bool, wgpu::CompareFunction) {
        match self {
            Self::Behind | Self::Mark => (false, wgpu::CompareFunction::Always),
            Self::Solid | Self::Wire | Self::Cut => (true, wgpu::CompareFunction::Less),
            Self::Veil | Self::Line | Self::Glass => (false, wgpu::CompareFunction::Less),
        }
    }

    /// Returns the blending with the colour behind, if any.
    fn blend(&self) -> Option<wgpu::BlendState> {
        use wgpu::BlendFactor::{One, OneMinusSrcAlpha, SrcAlpha, Zero};
        let sum = |src_factor, dst_factor| wgpu::BlendComponent {
            src_factor,
            dst_factor,
            operation: wgpu::BlendOperation::Add,
        };
        let color = sum(SrcAlpha, OneMinusSrcAlpha);
        match self {
            Self::Behind | Self::Solid => None,
            // A partly covering surface counts by its coverage, except for a veil.
            Self::Veil => Some(wgpu::BlendState { color, alpha: sum(Zero, One) }),
            _ => Some(wgpu::BlendState { color, alpha: sum(One, OneMinusSrcAlpha) }),
        }
    }
}

/// Common parts of the pipelines that draw.
struct Drawing<'a> {
    device: &'a wgpu::Device,
    module: &'a wgpu::ShaderModule,
    layout: &'a wgpu::PipelineLayout,
    target: Target,
}

impl Drawing<'_> {
    fn pipeline(&self, vertex: &str, fragment: &str, kind: Kind) -> wgpu::RenderPipeline {
        let (write, compare) = kind.depth();
        self.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(fragment),
            layout: Some(self.layout),
            vertex: wgpu::VertexState {
                module: self.module,
                entry_point: Some(vertex),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState {
                cull_mode: matches!(kind, Kind::Veil).then_some(wgpu::Face::Back),
                ..Default::default()
            },
            depth_stencil: Some(wgpu::DepthStencilState {
                format: self.target.depth,
                depth_write_enabled: Some(write),
                depth_compare: Some(compare),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: wgpu::MultisampleState { count: self.target.samples, ..Default::default() },
            fragment: Some(wgpu::FragmentState {
                module: self.module,
                entry_point: Some(fragment),
                compilation_options: Default::default(),
                targets: &[Some(wgpu::ColorTargetState {
                    format: self.target.format,
                    blend: kind.blend(),
                    write_mask: wgpu::ColorWrites::ALL,
                })],
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}

/// The kernel of normals.
fn kernel(device: &wgpu::Device, normals: &wgpu::BindGroupLayout) -> wgpu::ComputePipeline {
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("normals"),
        bind_group_layouts: &[Some(normals)],
        immediate_size: 0,
    });
    device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("normals"),
        layout: Some(&layout),
        module: &device.create_shader_module(wgpu::include_wgsl!("normals.wgsl")),
        entry_point: Some("main"),
        compilation_options: Default::default(),
        cache: None,
    })
}

/// A subject on the device.
#[derive(Debug)]
pub struct Drawn {
    triangles: wgpu::Buffer,
    vertices: wgpu::Buffer,
    offsets: wgpu::Buffer,
    around: wgpu::Buffer,
    /// Deformed pose, and pose at rest.
    poses: [Pose; 2],
    view: wgpu::Buffer,
    colours: wgpu::Buffer,
    /// Light, opacity and finish of each kind of cells, for these regions and with or without colours of
    /// labels.
    lights: wgpu::Buffer,
    kinds: Vec<CellKind>,
    regions: Regions,
    labels: bool,
    /// Layers of transparent surfaces, if any.
    layers: Option<Layers>,
    occlusion: OcclusionMap,
    view_group: wgpu::BindGroup,
    map: ColourMap,
    section: wgpu::Buffer,
    section_corners: u32,
    /// True if the eye is on the side of the section that is left.
    seen_from_behind: bool,
    /// Edges of the marked cell, bars, fibres on the surface, fibres in the section.
    lines: wgpu::Buffer,
    first: [Line; MOST_EDGES],
    marked: Option<u32>,
    mark_lines: u32,
    /// Bars, then fibres on the surface.
    strokes: Vec<Line>,
    bars: u32,
    section_fibres: u32,
    /// Lines along which it cuts shells, after these.
    section_shells: u32,
    /// Corners of the surface.
    corners: u32,
    /// Number of triangles of the subject. A list in another order lies behind them on the device.
    triangle_count: u32,
    vertex_count: u32,
    /// From the middle of the body at rest to its farthest point so far [m].
    size: f64,
    /// Distance from the middle of the body at rest to its farthest point at rest [m].
    rest_size: f64,
    middle: Vector3,
    /// Position and value of each point, as last written.
    staged: Vec<[f32; 4]>,
}

/// Points of a state and their normals.
#[derive(Debug)]
struct Pose {
    points: wgpu::Buffer,
    normals: wgpu::Buffer,
    draw: wgpu::BindGroup,
    compute: wgpu::BindGroup,
}

/// A buffer of at least one entry, as bindings want it.
fn storage<T: Pod>(device: &wgpu::Device, content: &[T]) -> wgpu::Buffer {
    let zero = [T::zeroed()];
    let contents = bytemuck::cast_slice(if content.is_empty() { &zero } else { content });
    let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
    device.create_buffer_init(&BufferInitDescriptor { label: None, contents, usage })
}

fn group(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    buffers: &[&wgpu::Buffer],
) -> wgpu::BindGroup {
    let entries: Vec<_> = (buffers.iter().zip(0..))
        .map(|(buffer, binding)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
        .collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}

impl Drawn {
    /// Brings a subject to the device, at rest.
    pub fn new(device: &wgpu::Device, renderer: &Renderer, subject: &Subject) -> Self {
        let list = vec![[0; 4]; subject.triangles.len()];
        let triangles = storage(device, &[&subject.triangles[..], &list].concat());
        let vertices = storage(device, &subject.vertices);
        let offsets = storage(device, &subject.offsets);
        let around = storage(device, &subject.around);
        let rest_points: Vec<[f32; 4]> = subject.points.iter().map(|point| staged(point, f64::NAN)).collect();
        let section = storage::<Corner>(device, &[]);
        let strokes = [&subject.bars[..], &subject.fibres.surface].concat();
        let first = [Line::default(); MOST_EDGES];
        let lines = storage(device, &[&first[..], &strokes].concat());
        let rest = storage(device, &rest_points);
        let pose = |points: wgpu::Buffer| {
            let normals = storage(device, &vec![[0.0_f32; 4]; subject.vertices.len()]);
            let draw = group(
                device,
                &renderer.shape,
                &[&points, &triangles, &vertices, &normals, &section, &lines, &rest],
            );
            let compute = group(
                device,
                &renderer.normals,
                &[&points, &triangles, &vertices, &normals, &offsets, &around],
            );
            Pose { points, normals, draw, compute }
        };
        let poses = [pose(storage(device, &rest_points)), pose(rest.clone())];
        let view = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("view"),
            size: size_of::<View>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let map = ColourMap::default();
        let colours = storage(device, &map.table());
        let kinds = subject.kinds.clone();
        let regions = Regions::default();
        let lights = storage(device, &lights_of(&kinds, &regions, false));
        let view_group = group(device, &renderer.view, &[&view, &colours, &lights]);
        let (middle, size) = bounds(subject);
        Self {
            triangles,
            vertices,
            offsets,
            around,
            poses,
            view,
            colours,
            lights,
            kinds,
            regions,
            labels: false,
            layers: None,
            occlusion: OcclusionMap::new(device, &renderer.occlusion, 1.0),
            view_group,
            map,
            section,
            section_corners: 0,
            seen_from_behind: false,
            lines,
            first,
            marked: None,
            mark_lines: 0,
            strokes,
            bars: subject.bars.len() as u32,
            section_fibres: 0,
            section_shells: 0,
            corners: 3 * subject.outer as u32,
            triangle_count: subject.triangles.len() as u32,
            vertex_count: subject.vertices.len() as u32,
            size,
            rest_size: size,
            middle,
            staged: rest_points,
        }
    }

    /// Sets points [m] and a value at each. Without values the colour is tissue; non-finite values are grey.
    pub fn set(&mut self, queue: &wgpu::Queue, points: &[Vector3], values: &[f64]) {
        self.stage(points, values);
        queue.write_buffer(&self.poses[0].points, 0, bytemuck::cast_slice(&self.staged));
    }

    /// Takes note of how far points [m] reach that are drawn from a buffer of someone else's.
    pub fn reach(&mut self, points: &[Vector3]) {
        self.stage(points, &[]);
    }

    fn stage(&mut self, points: &[Vector3], values: &[f64]) {
        let mut reach = 0.0_f64;
        for (index, (stored, point)) in self.staged.iter_mut().zip(points).enumerate() {
            *stored = staged(point, values.get(index).copied().unwrap_or(f64::NAN));
            reach = reach.max((point - self.middle).norm_squared());
        }
        self.size = self.size.max(reach.sqrt());
    }

    /// Sets how regions look; `labels` where colours show labels.
    pub fn set_regions(&mut self, queue: &wgpu::Queue, subject: &Subject, regions: &Regions, labels: bool) {
        if (&self.regions, self.labels) == (regions, labels) {
            return;
        }
        self.regions.clone_from(regions);
        self.labels = labels;
        let lights = lights_of(&self.kinds, regions, labels);
        queue.write_buffer(&self.lights, 0, bytemuck::cast_slice(&lights));
        let opacities: Vec<f32> = lights.iter().map(|[light, _]| light[3]).collect();
        self.layers = Layers::new(subject, &opacities);
        if let Some(layers) = &self.layers {
            let behind = u64::from(self.triangle_count) * size_of::<[u32; 4]>() as u64;
            queue.write_buffer(&self.triangles, behind, bytemuck::cast_slice(&layers.list));
        }
    }

    /// Draws from an external buffer with four numbers per point (position [m], value), such as a solver's on
    /// the same device.
    pub fn bind_positions(&mut self, device: &wgpu::Device, renderer: &Renderer, points: &wgpu::Buffer) {
        let Self { triangles, vertices, offsets, around, .. } = &*self;
        let normals = &self.poses[0].normals;
        let compute =
            group(device, &renderer.normals, &[points, triangles, vertices, normals, offsets, around]);
        self.poses[0].points = points.clone();
        self.poses[0].compute = compute;
        self.bind_shape(device, renderer);
    }

    /// Updates the bindings after one of the buffers changes.
    fn bind_shape(&mut self, device: &wgpu::Device, renderer: &Renderer) {
        let rest = self.poses[1].points.clone();
        let Self { triangles, vertices, section, lines, .. } = &*self;
        let bound = [&self.poses[0], &self.poses[1]].map(|pose| {
            let buffers = [&pose.points, triangles, vertices, &pose.normals, section, lines, &rest];
            group(device, &renderer.shape, &buffers)
        });
        for (pose, draw) in self.poses.iter_mut().zip(bound) {
            pose.draw = draw;
        }
    }

    /// Marks a cell (see [`critical_cell`](crate::critical_cell)), or none.
    pub fn mark(&mut self, queue: &wgpu::Queue, subject: &Subject, cell: Option<u32>) {
        if cell == self.marked {
            return;
        }
        let edges = cell.map(|cell| subject.outline(cell)).unwrap_or_default();
        self.first[..edges.len()].copy_from_slice(&edges);
        queue.write_buffer(&self.lines, 0, bytemuck::cast_slice(&self.first));
        (self.marked, self.mark_lines) = (cell, edges.len() as u32);
    }

    /// Sets the triangles and fibres of a section; none for no section.
    pub fn set_section(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        renderer: &Renderer,
        section: &Section,
    ) {
        self.section_corners = section.corners.len() as u32;
        (self.section_fibres, self.section_shells) =
            (section.fibres.len() as u32, section.shells.len() as u32);
        let lines = [&section.fibres[..], &section.shells].concat();
        let fits = |buffer: &wgpu::Buffer, bytes: usize| buffer.size() >= bytes as u64;
        let before = (MOST_EDGES + self.strokes.len()) * size_of::<Line>();
        let cut: &[u8] = bytemuck::cast_slice(&lines);
        let corners: &[u8] = bytemuck::cast_slice(&section.corners);
        if fits(&self.section, corners.len()) && fits(&self.lines, before + cut.len()) {
            queue.write_buffer(&self.section, 0, corners);
            queue.write_buffer(&self.lines, before as u64, cut);
            return;
        }
        self.section = storage(device, &section.corners);
        self.lines = storage(device, &[&self.first[..], &self.strokes, &lines].concat());
        self.bind_shape(device, renderer);
    }

    /// Computes normals, writes the view and finds where less light arrives, for a picture with this ratio of
    /// width to height.
    pub fn prepare(
        &mut self,
        renderer: &Renderer,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        camera: &Camera,
        style: &Style,
        aspect: f64,
    ) {
        if style.map != self.map {
            self.map = style.map;
            queue.write_buffer(&self.colours, 0, bytemuck::cast_slice(&self.map.table()));
        }
        self.seen_from_behind = style.clip.is_some_and(|plane| plane.distance(&camera.eye()) < 0.0);
        let reach = (camera.target - self.middle).norm() + 1.5 * self.size.max(1e-12);
        let mut view = view(camera, style, aspect, reach, !renderer.target.format.is_srgb());
        view.line[3] = (LIFT * self.rest_size) as f32;
        view.skin[0] = (1.0 / self.rest_size.max(1e-12)) as f32;
        queue.write_buffer(&self.view, 0, bytemuck::bytes_of(&view));
        if let Some(layers) = &mut self.layers {
            let parallel = (view.eye[3] < 0.5).then_some([0, 1, 2].map(|axis| view.towards[axis]));
            let before = u64::from(self.triangle_count) + layers.opaque as u64;
            let glass = layers.sort(&self.staged, [0, 1, 2].map(|axis| view.eye[axis]), parallel);
            let place = before * size_of::<[u32; 4]>() as u64;
            queue.write_buffer(&self.triangles, place, bytemuck::cast_slice(glass));
        }
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&renderer.compute);
            let poses = if style.ghost { 2 } else { 1 };
            for pose in &self.poses[..poses] {
                pass.set_bind_group(0, &pose.compute, &[]);
                pass.dispatch_workgroups(self.vertex_count.div_ceil(GROUP), 1, 1);
            }
        }
        if style.is_occluded() {
            if !self.occlusion.fits(aspect) {
                self.occlusion = OcclusionMap::new(&renderer.device, &renderer.occlusion, aspect);
            }
            let section = if style.clip.is_some() { self.section_corners } else { 0 };
            let [opaque, _] = self.opaque_and_glass();
            let shape = &self.poses[0].draw;
            self.occlusion.make(encoder, &renderer.occlusion, &self.view_group, shape, [opaque, 0..section]);
        }
    }

    /// Returns the corners of the opaque surface, and the corners of the transparent one.
    fn opaque_and_glass(&self) -> [Range<u32>; 2] {
        let list = 3 * self.triangle_count;
        match &self.layers {
            None => [0..self.corners, 0..0],
            Some(layers) => {
                let middle = list + 3 * layers.opaque as u32;
                [list..middle, middle..list + 3 * layers.list.len() as u32]
            }
        }
    }

    /// Draws, after [`Self::prepare`].
    pub fn draw(&self, renderer: &Renderer, pass: &mut wgpu::RenderPass<'_>, style: &Style) {
        pass.set_bind_group(0, &self.view_group, &[]);
        pass.set_bind_group(1, &self.poses[0].draw, &[]);
        pass.set_bind_group(2, &self.occlusion.group, &[]);
        pass.set_pipeline(&renderer.background);
        pass.draw(0..3, 0..1);
        let [opaque, glass] = self.opaque_and_glass();
        let solid = if style.wireframe {
            &renderer.wireframe
        } else if style.clip.is_some() {
            &renderer.clipped
        } else {
            &renderer.opaque
        };
        pass.set_pipeline(solid);
        pass.draw(opaque, 0..1);
        let first = MOST_EDGES as u32;
        pass.set_pipeline(&renderer.fibres);
        pass.draw(6 * first..6 * (first + self.bars), 2..3);
        // A section partly hides the things behind it, and is itself behind the things seen from the other
        // side.
        let is_cut = style.clip.is_some() && !style.wireframe;
        let cut = |pass: &mut wgpu::RenderPass<'_>, turned: bool| {
            if is_cut && turned == self.seen_from_behind {
                pass.set_pipeline(&renderer.section);
                pass.draw(0..self.section_corners, 0..1);
            }
        };
        cut(pass, true);
        if !glass.is_empty() {
            let pipeline = match (style.wireframe, style.clip) {
                (true, _) => &renderer.wireframe,
                (false, Some(_)) => &renderer.clipped_glass,
                (false, None) => &renderer.glass,
            };
            pass.set_pipeline(pipeline);
            pass.draw(glass, 0..1);
        }
        cut(pass, false);
        pass.set_pipeline(&renderer.fibres);
        let surface = first + self.strokes.len() as u32;
        let fibres = surface + self.section_fibres;
        if style.fibres {
            let last = if style.clip.is_some() { fibres } else { surface };
            pass.draw(6 * (first + self.bars)..6 * last, 0..1);
        }
        if is_cut {
            pass.draw(6 * fibres..6 * (fibres + self.section_shells), 0..1);
        }
        if style.ghost {
            pass.set_bind_group(1, &self.poses[1].draw, &[]);
            pass.set_pipeline(&renderer.ghost);
            pass.draw(0..self.corners, 0..1);
            pass.set_bind_group(1, &self.poses[0].draw, &[]);
        }
        if style.critical {
            pass.set_pipeline(&renderer.mark);
            pass.draw(0..6 * self.mark_lines, 1..2);
        }
    }
}

/// The middle of a subject at rest [m], and how far its surface reaches from there [m].
fn bounds(subject: &Subject) -> (Vector3, f64) {
    let used = subject.surface_points();
    let end = |begin: f64, farther: fn(&Vector3, &Vector3) -> Vector3| {
        used.iter().fold(Vector3::repeat(begin), |end, &p| farther(&end, &subject.points[p as usize]))
    };
    let low = end(f64::INFINITY, Vector3::inf);
    let high = end(f64::NEG_INFINITY, Vector3::sup);
    match used.is_empty() {
        true => (Vector3::zeros(), 1.0),
        false => (0.5 * (low + high), 0.5 * (high - low).norm()),
    }
}

fn four(v: &Vector3, w: f64) -> [f32; 4] {
    [v.x as f32, v.y as f32, v.z as f32, w as f32]
}

fn colour(bytes: [u8; 3], alpha: f32) -> [f32; 4] {
    let [r, g, b] = bytes.map(linear);
    [r, g, b, alpha]
}

fn lights_of(kinds: &[CellKind], regions: &Regions, labels: bool) -> Vec<[[f32; 4]; 2]> {
    kinds.iter().map(|&kind| light(kind, regions.coat(kind), labels)).collect()
}

/// Returns the strength of the occlusion, its reach [m] and the scale of its map. The scale is the pixels of
/// the reach at a distance of a metre, or everywhere in parallel projection. The last number is the distance
/// of the target over the reach.
fn occlusion(camera: &Camera, style: &Style) -> [f32; 4] {
    let reach = REACH * camera.height;
    let pixels = REACH * f64::from(ROWS);
    let pixels = match camera.projection {
        Projection::Perspective => pixels * camera.distance(),
        Projection::Orthographic => pixels,
    };
    let strength = f64::from(u8::from(style.is_occluded()));
    [strength, reach, pixels, camera.distance() / reach].map(|x| x as f32)
}

/// The uniforms of a picture.
fn view(camera: &Camera, style: &Style, aspect: f64, reach: f64, code: bool) -> View {
    let [right, up, towards] = camera.axes();
    let perspective = if camera.projection == Projection::Perspective { 1.0 } else { 0.0 };
    let [low, high] = style.range.unwrap_or([0.0, 1.0]);
    // Equal ends have no length: the one value gets a part of the map.
    let length = if high > low { 0.0 } else { low.abs().max(1.0) };
    let low = low - style.map.part_of_one_value() * length;
    let high = high.max(low + length);
    let [top, bottom] = style.background.colours();
    View {
        projection_view: camera.projection_view(aspect, reach).into(),
        right: four(&right, 0.0),
        up: four(&up, 0.0),
        towards: four(&towards, 0.0),
        eye: four(&camera.eye(), perspective),
        plane: style.clip.map_or([0.0, 0.0, 0.0, 1.0], |plane| four(&plane.normal, plane.offset)),
        range: [
            low as f32,
            (1.0 / (high - low).max(f64::MIN_POSITIVE)).min(f64::from(f32::MAX)) as f32,
            match style.range {
                _ if style.labels => 2.0,
                Some(_) => 1.0,
                None => 0.0,
            },
            if code { 1.0 } else { 0.0 },
        ],
        plain: colour(PLAIN, 1.0),
        missing: colour(MISSING, 1.0),
        ghost: colour(style.background.ghost(), GHOST),
        top: colour(top, 1.0),
        bottom: colour(bottom, 1.0),
        edge: colour([18, 20, 26], if style.edges { EDGES } else { 0.0 }),
        line: [aspect as f32, WIDTHS[0], WIDTHS[1], 0.0],
        skin: match style.texture {
            Texture::None => [0.0; 4],
            Texture::Skin => [0.0, SKIN[usize::from(style.tells())], 0.0, 0.0],
        },
        occlusion: occlusion(camera, style),
    }
}
