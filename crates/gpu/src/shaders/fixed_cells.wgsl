// Cells add their forces to those of the nodes, as whole multiples of a small force: the order does not matter.

@group(2) @binding(1) var<storage, read_write> forces: array<atomic<i32>>;

// The force of a cell on one of its nodes [N], and the energy its hourglass control holds [J].
fn give(cell: u32, corner: u32, force: vec4f) {
    let place = 4u * node_of(cell, corner);
    atomicAdd(&forces[place], whole(force.x * PER_FORCE));
    atomicAdd(&forces[place + 1u], whole(force.y * PER_FORCE));
    atomicAdd(&forces[place + 2u], whole(force.z * PER_FORCE));
    if force.w != 0.0 {
        atomicAdd(&forces[place + 3u], whole(force.w * PER_ENERGY));
    }
}
