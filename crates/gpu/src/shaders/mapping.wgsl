// Points that nodes carry, x = X + Σ wᵢ uᵢ, each with a value, as a renderer draws them.

// What the values are: SIZE or a component of the displacement, or GIVEN.
@group(0) @binding(0) var<uniform> shown: vec4u;
@group(1) @binding(0) var<storage, read> displacement: array<vec4f>;
// First entry of each point.
@group(1) @binding(1) var<storage, read> offsets: array<u32>;
// Nodes, and bits of their weights.
@group(1) @binding(2) var<storage, read> entries: array<vec2u>;
@group(1) @binding(3) var<storage, read> rest: array<vec4f>;
@group(1) @binding(4) var<storage, read> given: array<f32>;
@group(1) @binding(5) var<storage, read_write> points: array<vec4f>;

const SIZE = 3u;
const GIVEN = 4u;

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let point = number(group, groups, local);
    if point >= POINTS {
        return;
    }
    var u = vec3f(0.0);
    for (var k = offsets[point]; k < offsets[point + 1u]; k++) {
        u += bitcast<f32>(entries[k].y) * displacement[entries[k].x].xyz;
    }
    var value = given[point];
    if shown.x == SIZE {
        value = length(u);
    } else if shown.x < SIZE {
        value = u[shown.x];
    }
    points[point] = vec4f(rest[point].xyz + u, value);
}
