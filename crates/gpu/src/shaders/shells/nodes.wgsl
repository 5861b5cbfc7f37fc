// The step of a node: (1 + αh/2) v⁺ = (1 − αh/2) v + h f/m, and the same of spins. Held components keep still
// or take the velocities of their motion.

// Of each node its displacement [m], and its rotation from rest.
@group(1) @binding(0) var<storage, read_write> places: array<vec4f>;
// Velocity [m/s] and spin [rad/s] half a step before; with the spin the work [J] of forces from outside since
// the last read-back.
@group(1) @binding(1) var<storage, read_write> rates: array<vec4f>;
// Factors (1 − αh/2)/(1 + αh/2), h/m/(1 + αh/2) and h/I/(1 + αh/2), and bits. The bits are the six held
// components, then a mark that the node has no mass.
@group(1) @binding(2) var<storage, read> kinds: array<vec4f>;
// Where in a row of the table the motion of each node is; all bits: nowhere.
@group(1) @binding(3) var<storage, read> motions: array<u32>;
// Where the corners of each node begin, and the corners, by facets.
@group(1) @binding(4) var<storage, read> corner_starts: array<u32>;
@group(1) @binding(5) var<storage, read> corners: array<u32>;
@group(1) @binding(6) var<storage, read> forces: array<vec4f>;
// Where the loads of each node begin; of each its number and its force, then its moment.
@group(1) @binding(7) var<storage, read> load_starts: array<u32>;
@group(1) @binding(8) var<storage, read> loads: array<vec4f>;
// The force on each node from outside the model.
@group(1) @binding(9) var<storage, read> pushes: array<vec4f>;

fn held(bits: u32, first: u32) -> vec3<bool> {
    let own = bits >> first;
    return vec3<bool>((own & 1u) != 0u, (own & 2u) != 0u, (own & 4u) != 0u);
}

// exp(S(a)) for less than a turn.
fn exponential(a: vec3f) -> vec4f {
    let x = 0.25 * dot(a, a);
    let sine = 1.0 - x / 6.0 * (1.0 - x / 20.0 * (1.0 - x / 42.0 * (1.0 - x / 72.0 * (1.0 - x / 110.0))));
    let cosine = 1.0 - x / 2.0 * (1.0 - x / 12.0 * (1.0 - x / 30.0 * (1.0 - x / 56.0 * (1.0 - x / 90.0))));
    return vec4f(0.5 * sine * a, cosine);
}

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let node = number(group, groups, local);
    if node >= NODES || atomicLoad(&broken) <= instant.index {
        return;
    }
    let kind = kinds[node];
    let bits = bitcast<u32>(kind.w);
    if (bits & 64u) != 0u {
        return;
    }
    var internal_force = vec3f();
    var internal_moment = vec3f();
    var force = pushes[node].xyz;
    var moment = vec3f();
    for (var k = corner_starts[node]; k < corner_starts[node + 1u]; k++) {
        let at = 2u * corners[k];
        internal_force += forces[at].xyz;
        internal_moment += forces[at + 1u].xyz;
        force += pressed(at);
        moment += pressed(at + 1u);
    }
    for (var k = load_starts[node]; k < load_starts[node + 1u]; k++) {
        let own = loads[2u * k];
        let factor = table[instant.row + bitcast<u32>(own.w)];
        // A load of any size does nothing while its factor is zero.
        if factor != 0.0 {
            force += factor * own.xyz;
            moment += factor * loads[2u * k + 1u].xyz;
        }
    }
    var velocity_held = vec3f();
    var spin_held = vec3f();
    let motion = motions[node];
    if motion != 0xffffffffu {
        let at = instant.row + motion;
        velocity_held = vec3f(table[at], table[at + 1u], table[at + 2u]);
        spin_held = vec3f(table[at + 3u], table[at + 4u], table[at + 5u]);
    }
    let velocity = rates[2u * node].xyz;
    let spin = rates[2u * node + 1u];
    let free_velocity = kind.x * velocity + kind.y * (force - internal_force);
    let free_spin = kind.x * spin.xyz + kind.z * (moment - internal_moment);
    let next = select(free_velocity, velocity_held, held(bits, 0u));
    let next_spin = select(free_spin, spin_held, held(bits, 3u));
    // By the trapezoidal rule: half in the step before, half in the one after.
    var way = next;
    var angle = next_spin;
    if instant.first == 0u {
        way += velocity;
        angle += spin.xyz;
    }
    let outside = select(force, internal_force, held(bits, 0u));
    let outside_moment = select(moment, internal_moment, held(bits, 3u));
    let work = 0.5 * instant.step * (dot(outside, way) + dot(outside_moment, angle));
    let before = select(spin.w, 0.0, instant.first == 1u);
    rates[2u * node] = vec4f(next, 0.0);
    rates[2u * node + 1u] = vec4f(next_spin, before + work);
    places[2u * node] += vec4f(instant.step * next, 0.0);
    let rotation = product(exponential(instant.step * next_spin), places[2u * node + 1u]);
    places[2u * node + 1u] = rotation * inverseSqrt(dot(rotation, rotation));
}
