// Central differences: the coming increment of a node from the one before; twin of stepper.rs, which has the
// formulas.

// Sums of each group: kinetic energy, damping power, internal work before and after. Then external work
// before and after, energy of hourglass control, ⅛ Δt⁻² Σ m|a|². Last, internal and external work and damping
// power of all instants that were passed over.
@group(2) @binding(6) var<storage, read_write> sums: array<vec4f>;

var<workgroup> terms: array<vec4f, GROUP>;

// The sum over a group.
fn total(local: u32, value: vec4f) -> vec4f {
    workgroupBarrier();
    terms[local] = value;
    for (var half = GROUP / 2u; half > 0u; half /= 2u) {
        workgroupBarrier();
        if local < half {
            terms[local] += terms[local + half];
        }
    }
    workgroupBarrier();
    return terms[0];
}

// Enters the work of a group at an instant that is passed over.
fn pass_over(group: u32, work: vec4f) {
    let at = 3u * group + 2u;
    sums[at] = select(sums[at], vec4f(0.0), instant.index == 1u) + work;
}

// A node at an instant.
struct Motion {
    inertia: f32,
    held: u32,
    // Increments before and after [m].
    before: vec3f,
    next: vec3f,
    // What the one before would be in a step as long as the one to come [m].
    same_speed: vec3f,
    internal: vec3f,
    // D of damping_force/mod.rs [N].
    lost: vec3f,
    // With the reaction of what holds it [N].
    applied: vec3f,
    reaction: vec3f,
    // ½ Δt⁻ a: from the velocity before the instant to the one at it [m/s].
    gain: vec3f,
}

// What grips pull with at a node [N].
fn grip_force(node: u32) -> vec3f {
    let forces = 1u + grip_count();
    let first = forces + grip_count();
    let end = first + grip_entries();
    // The first entry of the node: they are in the order of nodes.
    var k = first;
    for (var most = end; k < most;) {
        let middle = (k + most) / 2u;
        if bitcast<u32>(grips[middle].x) < node {
            k = middle + 1u;
        } else {
            most = middle;
        }
    }
    var force = vec3f(0.0);
    for (; k < end && bitcast<u32>(grips[k].x) == node; k++) {
        force += grips[k].y * grips[forces + bitcast<u32>(grips[k].z)].xyz;
    }
    return force;
}

fn motion(node: u32, internal: vec3f) -> Motion {
    let of_node = nodes[node];
    let inertia = of_node.x;
    let damping = of_node.y;
    let held = hold_of(of_node.w);
    var applied = external_force(node, of_node.z) + contact_force(node);
    if (bitcast<u32>(of_node.w) & GRIPPED) != 0u {
        applied += grip_force(node);
    }
    var before = increment[3u * node].xyz;
    var lost = vec3f(0.0);
    if instant.dissipation != 0.0 || instant.stiffness != 0.0 {
        let last = increment[3u * node + 1u].xyz;
        let change = internal - last;
        let expected = instant.extrapolation * (last - increment[3u * node + 2u].xyz);
        lost = instant.dissipation * (change - expected) + instant.stiffness * change;
    }
    var gain = vec3f(0.0);
    if does(STARTS) {
        let half = 0.5 * instant.before * instant.before;
        let acceleration = (applied - internal) / inertia - damping * before;
        before = instant.before * before - half * acceleration;
        gain = half / instant.before * acceleration;
    }
    var same_speed = before * instant.ratio;
    let a = damping * instant.half_mean;
    var next = ((1.0 - a) * same_speed + instant.push / inertia * (applied - internal - lost)) / (1.0 + a);
    var reaction = vec3f(0.0);
    if held != FREE {
        let hold = holds[held];
        for (var c = 0u; c < 3u; c++) {
            if hold.owner[c] == FREE {
                continue;
            }
            if does(STARTS) {
                before[c] = 0.0;
                same_speed[c] = 0.0;
                gain[c] = 0.0;
            }
            next[c] = moved_by(hold, c, 0u);
            let velocity = (same_speed[c] + next[c]) * instant.per_two_steps;
            let acceleration = (next[c] - same_speed[c]) * instant.per_push + damping * velocity;
            reaction[c] = inertia * acceleration + internal[c] + lost[c] - applied[c];
            applied[c] += reaction[c];
        }
    }
    if !does(STARTS) {
        gain = 0.5 * instant.before * instant.per_push * (next - same_speed);
    }
    return Motion(inertia, held, before, next, same_speed, internal, lost, applied, reaction, gain);
}

// Twice the kinetic energy [J], and the power of damping [W].
fn kinetic_and_power(m: Motion, damping: f32) -> vec2f {
    let velocity = (m.same_speed + m.next * instant.inverse_ratio) * instant.per_two_means;
    let twice_kinetic = m.inertia * dot(velocity, velocity);
    return vec2f(twice_kinetic, damping * twice_kinetic + dot(m.lost, velocity));
}

// Internal and external work and damping power of an instant that is passed over.
fn work(m: Motion, damping: f32) -> vec4f {
    let both = 0.5 * (m.before + m.next);
    return vec4f(dot(m.internal, both), dot(m.applied, both), kinetic_and_power(m, damping).y, 0.0);
}
