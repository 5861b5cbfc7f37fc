// The motion of nodes: what resists it, and what holds them.

struct Hold {
    // The constraint on each component, FREE without.
    owner: vec4u,
    // What the two factors of its motion multiply [m].
    first: vec4f,
    second: vec4f,
}

const FREE = 0xffffffffu;

// Inertia [kg], α [1/s], mass [kg], and one more than which of `holds` or zero, with GRIPPED.
@group(2) @binding(3) var<storage, read> nodes: array<vec4f>;
@group(2) @binding(4) var<storage, read> holds: array<Hold>;

// Marks a node that a grip pulls at.
const GRIPPED = 0x80000000u;

// Which of `holds` a node has, or FREE.
fn hold_of(tag: f32) -> u32 {
    return (bitcast<u32>(tag) & ~GRIPPED) - 1u;
}

// A component of a motion: its increment in the step, or with `then` 1 its value after the step [m].
fn moved_by(hold: Hold, c: u32, then: u32) -> f32 {
    let at = instant.row + 4u * hold.owner[c] + then;
    return hold.first[c] * table[at] + hold.second[c] * table[at + 2u];
}

// Where a node is to go, and where it is held its place.
fn placed(place: vec3f, held: u32) -> vec3f {
    var u = place;
    if held != FREE {
        let hold = holds[held];
        for (var c = 0u; c < 3u; c++) {
            if hold.owner[c] != FREE {
                u[c] = moved_by(hold, c, 1u);
            }
        }
    }
    return u;
}
