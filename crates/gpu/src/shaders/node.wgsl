// The coming increments by central differences, reactions and energies; twin of stepper.rs, which has the formulas.

// Of each node that is held [N].
@group(1) @binding(5) var<storage, read_write> reactions: array<vec4f>;
// Of each group: kinetic energy, damping power, internal work before and after; external work before and after, energy of
// hourglass control, shock; then internal and external work and damping power of all instants that were passed over.
@group(1) @binding(6) var<storage, read_write> sums: array<vec4f>;

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

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let node = number(group, groups, local);
    var first = vec4f(0.0);
    var second = vec4f(0.0);
    if node < NODES && end() > instant.index {
        let of_node = nodes[node];
        let inertia = of_node.x;
        let damping = of_node.y;
        let held = bitcast<u32>(of_node.w);
        let gathered = internal_force(node);
        let internal = gathered.xyz;
        var applied = external_force(node, of_node.z);
        var before = increment[node].xyz;
        var shock = vec3f(0.0);
        if does(STARTS) {
            let half = 0.5 * instant.before * instant.before;
            let acceleration = (applied - internal) / inertia - damping * before;
            before = instant.before * before - half * acceleration;
            shock = half / instant.before * acceleration;
        }
        var same_speed = before * instant.ratio;
        let a = damping * instant.half_mean;
        var next = ((1.0 - a) * same_speed + instant.push / inertia * (applied - internal)) / (1.0 + a);
        if held != FREE {
            let hold = holds[held];
            var reaction = vec3f(0.0);
            for (var c = 0u; c < 3u; c++) {
                if hold.owner[c] == FREE {
                    continue;
                }
                if does(STARTS) {
                    before[c] = 0.0;
                    same_speed[c] = 0.0;
                    shock[c] = 0.0;
                }
                next[c] = hold.amplitude[c] * table[instant.row + 2u * hold.owner[c]];
                let velocity = (same_speed[c] + next[c]) * instant.per_two_steps;
                let acceleration = (next[c] - same_speed[c]) * instant.per_push + damping * velocity;
                reaction[c] = inertia * acceleration + internal[c] - applied[c];
                applied[c] += reaction[c];
            }
            reactions[held] = vec4f(reaction, 0.0);
        }
        if does(STARTS) {
            increment[node] = vec4f(before, 0.0);
        }
        let velocity = (same_speed + next) * instant.per_two_steps;
        let twice_kinetic = inertia * dot(velocity, velocity);
        let power = damping * twice_kinetic;
        if does(MOVES) {
            let both = 0.5 * (before + next);
            first = vec4f(dot(internal, both), dot(applied, both), power, 0.0);
            go(node, next, held);
        } else {
            first = vec4f(0.5 * twice_kinetic, power, 0.5 * dot(internal, before), 0.5 * dot(internal, next));
            second.x = 0.5 * dot(applied, before);
            second.y = 0.5 * dot(applied, next);
            second.z = gathered.w;
            second.w = 0.5 * inertia * dot(shock, shock);
            next_increment[node] = vec4f(next, 0.0);
        }
    }
    let own = 3u * (group.y * groups.x + group.x);
    let sum = total(local, first);
    if does(MOVES) {
        if local == 0u && own < arrayLength(&sums) {
            sums[own + 2u] = select(sums[own + 2u], vec4f(0.0), instant.index == 1u) + sum;
        }
    } else {
        let more = total(local, second);
        if local == 0u && own < arrayLength(&sums) {
            sums[own] = sum;
            sums[own + 1u] = more;
        }
    }
}
