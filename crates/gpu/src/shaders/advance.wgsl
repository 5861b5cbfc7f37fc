// Continues from an evaluated instant.

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let node = number(group, groups, local);
    if node < NODES && end() > instant.index {
        go(node, next_increment[3u * node].xyz, next_increment[3u * node + 1u].xyz, hold_of(nodes[node].w));
    }
}
