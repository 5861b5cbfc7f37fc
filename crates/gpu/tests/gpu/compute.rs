//! A kernel of a test, from arrays to an array.

use pliant_gpu::Device;
use wgpu::util::{BufferInitDescriptor, DeviceExt};

/// Runs `main` of a module over `count` invocations in groups of 64. Bindings of group 0, in order: the
/// arrays `inputs` for reading, then an array of `outputs` numbers to write, which is returned.
pub fn compute(device: &Device, source: &str, count: usize, inputs: &[&[f32]], outputs: usize) -> Vec<f32> {
    let (gpu, queue) = device.wgpu();
    let module = gpu.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    let pipeline = gpu.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: None,
        layout: None,
        module: &module,
        entry_point: Some("main"),
        compilation_options: Default::default(),
        cache: None,
    });
    device.check().unwrap_or_else(|error| panic!("{error}\n{source}"));
    let mut buffers: Vec<wgpu::Buffer> = inputs
        .iter()
        .map(|input| {
            let contents = bytemuck::cast_slice(input);
            let usage = wgpu::BufferUsages::STORAGE;
            gpu.create_buffer_init(&BufferInitDescriptor { label: None, contents, usage })
        })
        .collect();
    let buffer = |usage| {
        let size = (outputs * size_of::<f32>()) as u64;
        gpu.create_buffer(&wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false })
    };
    let output = buffer(wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
    let read = buffer(wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);
    buffers.push(output.clone());
    let entries: Vec<wgpu::BindGroupEntry<'_>> = (0..)
        .zip(&buffers)
        .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
        .collect();
    let group = gpu.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries: &entries,
    });
    let mut encoder = gpu.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.dispatch_workgroups(count.div_ceil(64) as u32, 1, 1);
    drop(pass);
    encoder.copy_buffer_to_buffer(&output, 0, &read, 0, read.size());
    queue.submit([encoder.finish()]);
    read.map_async(wgpu::MapMode::Read, .., |mapped| mapped.expect("the results can be read"));
    device.wait().unwrap_or_else(|error| panic!("{error}"));
    let view = read.get_mapped_range(..).expect("the results are mapped");
    bytemuck::cast_slice(&view).to_vec()
}
