// Each cell has slots of its own for its forces.

@group(2) @binding(0) var<storage, read> displacement: array<vec4f>;
@group(2) @binding(1) var<storage, read_write> slots: array<vec4f>;

fn displacement_of(node: u32) -> vec3f {
    return displacement[node].xyz;
}

// The force of a cell on one of its nodes [N], and the energy its hourglass control holds [J].
fn give(cell: u32, corner: u32, node: u32, force: vec4f) {
    slots[FIRST_SLOT + corner * CELLS + cell] = force;
}
