// Does nothing: what it takes to begin a kernel.

@group(1) @binding(0) var<storage, read> source: array<vec4f>;
@group(1) @binding(1) var<storage, read_write> result: array<vec4f>;

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if source[0].x < -1.0 {
        result[id.x] = source[id.x];
    }
}
