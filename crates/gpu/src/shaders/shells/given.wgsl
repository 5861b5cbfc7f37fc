@group(2) @binding(0) var<storage, read> given: array<vec4f>;

fn pressed(at: u32) -> vec3f {
    return given[at].xyz;
}
