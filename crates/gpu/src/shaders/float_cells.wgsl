// Cells add their forces to the nodes, whoever comes first.

@group(2) @binding(1) var<storage, read_write> forces: array<atomic<f32>>;

// The force of a cell on one of its nodes [N], and the energy its hourglass control holds [J].
fn give(cell: u32, corner: u32, force: vec4f) {
    let place = 4u * node_of(cell, corner);
    atomicAdd(&forces[place], force.x);
    atomicAdd(&forces[place + 1u], force.y);
    atomicAdd(&forces[place + 2u], force.z);
    if force.w != 0.0 {
        atomicAdd(&forces[place + 3u], force.w);
    }
}
