// Takes followers along with the nodes that they follow, u = Σ w u; where they are held they have moved.

@group(1) @binding(0) var<storage, read_write> displacement: array<vec4f>;

fn each(follower: u32) {
    var u = vec3f(0.0);
    for (var k = row_offsets[follower]; k < row_offsets[follower + 1u]; k++) {
        u += weights(k) * displacement[followed(k)].xyz;
    }
    displacement[followers[follower]] = vec4f(u, 0.0);
}
