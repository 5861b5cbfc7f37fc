// What belongs to one instant of shells; twin of `Instant` in shells.rs.
struct Instant {
    // Its number since the last read-back.
    index: u32,
    // Where its row of the table begins.
    row: u32,
    // 1: the instant that was read back, whose step has no other before it.
    first: u32,
    // The length of a step [s].
    step: f32,
}

@group(0) @binding(0) var<uniform> instant: Instant;
// The first instant at which a facet is broken; all stands still there.
@group(0) @binding(1) var<storage, read_write> broken: atomic<u32>;
// For each instant of a submission the factors of loads, then velocities and spins of moved nodes.
@group(0) @binding(2) var<storage, read> table: array<f32>;

// Quaternions: vector, scalar.
fn product(a: vec4f, b: vec4f) -> vec4f {
    return vec4f(a.w * b.xyz + b.w * a.xyz + cross(a.xyz, b.xyz), a.w * b.w - dot(a.xyz, b.xyz));
}

fn turned(q: vec4f, v: vec3f) -> vec3f {
    let t = 2.0 * cross(q.xyz, v);
    return v + q.w * t + cross(q.xyz, t);
}
