// The motion of nodes.

struct Hold {
    // The constraint on each component, FREE without.
    owner: vec4u,
    // What the factor of its motion multiplies [m].
    amplitude: vec4f,
}

const FREE = 0xffffffffu;

@group(1) @binding(0) var<storage, read_write> displacement: array<vec4f>;
// Those before the instant …
@group(1) @binding(1) var<storage, read_write> increment: array<vec4f>;
// … and those after it.
@group(1) @binding(2) var<storage, read_write> next_increment: array<vec4f>;
// Inertia [kg], α [1/s], mass [kg], and which of `holds`.
@group(1) @binding(3) var<storage, read> nodes: array<vec4f>;
@group(1) @binding(4) var<storage, read> holds: array<Hold>;

// Moves a node on by an increment, and where it is held to its place.
fn go(node: u32, by: vec3f, held: u32) {
    var u = displacement[node].xyz + by;
    if held != FREE {
        let hold = holds[held];
        for (var c = 0u; c < 3u; c++) {
            if hold.owner[c] != FREE {
                u[c] = hold.amplitude[c] * table[instant.row + 2u * hold.owner[c] + 1u];
            }
        }
    }
    displacement[node] = vec4f(u, 0.0);
    increment[node] = vec4f(by, 0.0);
    clear(node);
}
