// The pass over the nodes: coming increments, reactions and energies.

// Of each node that is held [N].
@group(2) @binding(5) var<storage, read_write> reactions: array<vec4f>;

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let node = number(group, groups, local);
    let index = group.y * groups.x + group.x;
    let is_counted = local == 0u && GROUP * index < NODES;
    var first = vec4f(0.0);
    var second = vec4f(0.0);
    if group_end(local) > instant.index && node < NODES {
        let gathered = internal_force(node);
        let m = motion(node, gathered.xyz);
        if does(MOVES) {
            first = work(m, nodes[node].y);
            go(node, m.next, m.internal, m.held);
        } else {
            let found = kinetic_and_power(m, nodes[node].y);
            first = vec4f(
                0.5 * found.x, found.y, 0.5 * dot(m.internal, m.before), 0.5 * dot(m.internal, m.next),
            );
            second = vec4f(
                0.5 * dot(m.applied, m.before), 0.5 * dot(m.applied, m.next), gathered.w,
                0.5 * m.inertia * dot(m.gain, m.gain),
            );
            next_increment[3u * node] = vec4f(m.next, 0.0);
            next_increment[3u * node + 1u] = vec4f(m.internal, 0.0);
        }
        if m.held != FREE {
            reactions[m.held] = vec4f(m.reaction, 0.0);
        }
        if does(STARTS) {
            increment[3u * node] = vec4f(m.before, 0.0);
        }
    }
    let sum = total(local, first);
    if does(MOVES) {
        if is_counted {
            pass_over(index, sum);
        }
    } else {
        let more = total(local, second);
        if is_counted {
            sums[3u * index] = sum;
            sums[3u * index + 1u] = more;
        }
    }
}
