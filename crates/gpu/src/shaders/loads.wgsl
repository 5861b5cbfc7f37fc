// Loads and gravity on the nodes.

// First entry of each node in `loads`.
@group(3) @binding(0) var<storage, read> load_offsets: array<u32>;
// A dead force [N] and its load, or CORNER with the corner of a face, its weight and a bit for each
// component that acts.
@group(3) @binding(1) var<storage, read> loads: array<vec4f>;
// The pressure forces of the corners of all faces [N].
@group(3) @binding(2) var<storage, read> corner_forces: array<vec4f>;
// The body of each node.
@group(3) @binding(3) var<storage, read> bodies: array<u32>;

const CORNER = 0xffffffffu;

fn external_force(node: u32, mass: f32) -> vec3f {
    let gravity = instant.row + GRAVITY + 3u * bodies[node];
    var force = mass * vec3f(table[gravity], table[gravity + 1u], table[gravity + 2u]);
    for (var k = load_offsets[node]; k < load_offsets[node + 1u]; k++) {
        let entry = loads[k];
        let load = bitcast<u32>(entry.w);
        if load == CORNER {
            let acts = (vec3u(bitcast<u32>(entry.z)) >> vec3u(0u, 1u, 2u)) & vec3u(1u);
            force += entry.y * vec3f(acts) * corner_forces[bitcast<u32>(entry.x)].xyz;
        } else {
            // A load of any size, even without limit, does nothing while its factor is zero.
            let factor = table[instant.row + LOADS + load];
            if factor != 0.0 {
                force += factor * entry.xyz;
            }
        }
    }
    return force;
}
