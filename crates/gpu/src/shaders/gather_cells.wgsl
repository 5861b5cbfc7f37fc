// Each cell has slots of its own for its forces.

@group(2) @binding(1) var<storage, read_write> slots: array<vec4f>;

// The force of a cell on one of its nodes [N], and the energy its hourglass control holds [J].
fn give(cell: u32, corner: u32, force: vec4f) {
    slots[FIRST_SLOT + corner * CELLS + cell] = force;
}
