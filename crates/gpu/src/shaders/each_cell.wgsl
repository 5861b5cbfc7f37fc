// Each invocation takes a cell.

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let cell = number(group, groups, local);
    if group_end(local) < instant.index || cell >= CELLS {
        return;
    }
    compute(cell);
}
