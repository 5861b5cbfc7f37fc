// Nodes that follow others, with the rows of their ties.

@group(1) @binding(1) var<storage, read> followers: array<u32>;
// First entry of each …
@group(1) @binding(2) var<storage, read> row_offsets: array<u32>;
// … in the rows: bits of the weights along each component, and the followed node.
@group(1) @binding(3) var<storage, read> rows: array<vec4u>;

fn weights(entry: u32) -> vec3f {
    return bitcast<vec3f>(rows[entry].xyz);
}

fn followed(entry: u32) -> u32 {
    return rows[entry].w;
}

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let follower = number(group, groups, local);
    if follower < FOLLOWERS {
        each(follower);
    }
}
