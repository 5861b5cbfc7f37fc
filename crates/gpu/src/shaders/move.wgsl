// The motion of nodes: what resists it, and what holds them.

struct Hold {
    // The constraint on each component, FREE without.
    owner: vec4u,
    // What the factor of its motion multiplies [m].
    amplitude: vec4f,
}

const FREE = 0xffffffffu;

// Inertia [kg], α [1/s], mass [kg], and which of `holds`.
@group(2) @binding(3) var<storage, read> nodes: array<vec4f>;
@group(2) @binding(4) var<storage, read> holds: array<Hold>;

// Where a node is to go, and where it is held its place.
fn placed(place: vec3f, held: u32) -> vec3f {
    var u = place;
    if held != FREE {
        let hold = holds[held];
        for (var c = 0u; c < 3u; c++) {
            if hold.owner[c] != FREE {
                u[c] = hold.amplitude[c] * table[instant.row + 2u * hold.owner[c] + 1u];
            }
        }
    }
    return u;
}
