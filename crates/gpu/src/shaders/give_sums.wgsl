// The force on a follower is added to the forces on the nodes that it follows. The force along held
// components stays, and so does the energy in the fourth component.

@group(1) @binding(0) var<storage, read_write> forces: array<atomic<f32>>;

fn each(follower: u32) {
    let own = 4u * followers[follower];
    for (var c = 0u; c < 3u; c++) {
        let force = atomicExchange(&forces[own + c], 0.0);
        if force == 0.0 {
            continue;
        }
        for (var k = row_offsets[follower]; k < row_offsets[follower + 1u]; k++) {
            atomicAdd(&forces[4u * followed(k) + c], weights(k)[c] * force);
        }
    }
}
