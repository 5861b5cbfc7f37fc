// Stops at an instant from which nodes may go farther than the lists of candidates allow: these are made anew before anything happens. A way can
// double in a step.

@group(2) @binding(1) var<storage, read> increment: array<vec4f>;

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
    let way = length(increment[node].xyz) * select(instant.ratio, instant.before, does(STARTS));
    if distance(displacement[node].xyz, listed[n].xyz) + 2.0 * way > abs(listed[n].w) {
        atomicMin(&findings[UNLISTED], instant.index);
    }
}
