// The forces of cells are added up already, as whole numbers; the next instant begins at zero.

@group(1) @binding(0) var<storage, read_write> forces: array<atomic<i32>>;

fn internal_force(node: u32) -> vec4f {
    let place = 4u * node;
    return force_of(vec4i(
        atomicLoad(&forces[place]), atomicLoad(&forces[place + 1u]), atomicLoad(&forces[place + 2u]),
        atomicLoad(&forces[place + 3u]),
    ));
}

fn clear(node: u32) {
    for (var c = 0u; c < 4u; c++) {
        atomicStore(&forces[4u * node + c], 0);
    }
}
