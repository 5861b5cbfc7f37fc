// Stops at an instant at which nodes are farther from their places in the lists of candidates than the lists
// allow. The lists are made anew before anything happens.

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let n = number(group, groups, local);
    if n >= TOUCHING || end() <= instant.index || listed[n].w == 0.0 {
        return;
    }
    let node = node_of(n);
    if distance(displacement[node].xyz, listed[n].xyz) > abs(listed[n].w) {
        atomicMin(&findings[UNLISTED], instant.index);
    }
}
