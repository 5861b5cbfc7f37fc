// The force on a follower is added to those on the nodes that it follows, and is zero from then on.

@group(1) @binding(0) var<storage, read_write> forces: array<atomic<Sum>>;

fn each(follower: u32) {
    let own = 4u * followers[follower];
    for (var c = 0u; c < 4u; c++) {
        let force = f32(atomicLoad(&forces[own + c]));
        if force == 0.0 {
            continue;
        }
        for (var k = row_offsets[follower]; k < row_offsets[follower + 1u]; k++) {
            atomicAdd(&forces[4u * rows[k].x + c], part(weight(k) * force));
        }
        atomicStore(&forces[own + c], Sum(0));
    }
}
