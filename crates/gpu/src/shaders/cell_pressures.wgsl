// The cells' own pressures from the mean change of volume of their nodes, as their share in the next average.

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let cell = number(group, groups, local);
    if cell >= CELLS || end() < instant.index {
        return;
    }
    cell_values[cell] = 0.25 * row(0u, cell).w * relaxed_pressure(node_mean(cell), cell);
}
