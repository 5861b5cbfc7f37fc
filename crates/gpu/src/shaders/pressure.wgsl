// Pressure on deformed faces, twin of load.rs: forces of their corners. A corner is a fixed combination of
// nodes: one node, or several where a body carries the surface.

@group(1) @binding(0) var<storage, read> displacement: array<vec4f>;
// First entry of each corner in `corner_nodes`, four corners a face.
@group(1) @binding(1) var<storage, read> corner_offsets: array<u32>;
// A node and its weight.
@group(1) @binding(2) var<storage, read> corner_nodes: array<vec2u>;
// Places of corners at rest, from the first one [m]. The fourth components are pressure [Pa], load, and the
// number of corners.
@group(1) @binding(3) var<storage, read> corner_rest: array<vec4f>;
@group(1) @binding(4) var<storage, read_write> corner_forces: array<vec4f>;

fn carried(corner: u32) -> vec3f {
    var u = vec3f(0.0);
    for (var k = corner_offsets[corner]; k < corner_offsets[corner + 1u]; k++) {
        let entry = corner_nodes[k];
        u += bitcast<f32>(entry.y) * displacement[entry.x].xyz;
    }
    return u;
}

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let face = number(group, groups, local);
    if face >= FACES {
        return;
    }
    let first = 4u * face;
    let load = bitcast<u32>(corner_rest[first + 1u].w);
    let factor = table[instant.row + LOADS + load];
    // Of any size, even without limit.
    var pull = 0.0;
    if factor != 0.0 {
        pull = -corner_rest[first].w * factor;
    }
    let origin = carried(first);
    var x = array<vec3f, 4>();
    let corners = bitcast<u32>(corner_rest[first + 2u].w);
    for (var k = 1u; k < corners; k++) {
        x[k] = corner_rest[first + k].xyz + (carried(first + k) - origin);
    }
    if corners == 3u {
        let third = pull / 6.0 * cross(x[1], x[2]);
        for (var k = 0u; k < 3u; k++) {
            corner_forces[first + k] = vec4f(third, 0.0);
        }
        return;
    }
    // Two by two Gauss points.
    var signs = array<vec2f, 4>(vec2f(-1.0, -1.0), vec2f(1.0, -1.0), vec2f(1.0, 1.0), vec2f(-1.0, 1.0));
    var areas = array<vec3f, 4>();
    for (var point = 0u; point < 4u; point++) {
        let at = 0.57735027 * signs[point];
        var along_xi = vec3f(0.0);
        var along_eta = vec3f(0.0);
        for (var k = 1u; k < 4u; k++) {
            let c = signs[k];
            along_xi += (0.25 * c.x * (1.0 + c.y * at.y)) * x[k];
            along_eta += (0.25 * c.y * (1.0 + c.x * at.x)) * x[k];
        }
        let normal = cross(along_xi, along_eta);
        for (var k = 0u; k < 4u; k++) {
            let c = signs[k];
            areas[k] += (0.25 * (1.0 + c.x * at.x) * (1.0 + c.y * at.y)) * normal;
        }
    }
    for (var k = 0u; k < 4u; k++) {
        corner_forces[first + k] = vec4f(pull * areas[k], 0.0);
    }
}
