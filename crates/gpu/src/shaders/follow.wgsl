// Takes followers along with the nodes that they follow, u = Σ w u.

@group(1) @binding(0) var<storage, read_write> displacement: array<vec4f>;

fn each(follower: u32) {
    var u = vec3f(0.0);
    for (var k = row_offsets[follower]; k < row_offsets[follower + 1u]; k++) {
        u += weight(k) * displacement[rows[k].x].xyz;
    }
    displacement[followers[follower]] = vec4f(u, 0.0);
}
