// The mean of the cells' values at each node, weighted by volume.

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let node = number(group, groups, local);
    if group_end(local) < instant.index || node >= LOCAL_NODES {
        return;
    }
    var sum = 0.0;
    for (var k = local_offsets[node]; k < local_offsets[node + 1u]; k++) {
        sum += cell_values[local_cells[k]];
    }
    node_values[node] = averaged(sum * inverse_volume[node], node);
}
