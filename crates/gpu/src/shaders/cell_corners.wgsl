// The nodes of cells, read where they lie.

@group(2) @binding(0) var<storage, read> displacement: array<vec4f>;

fn node_of(cell: u32, corner: u32) -> u32 {
    return cell_nodes[corner / 4u * CELLS + cell][corner % 4u];
}

fn displacement_of(cell: u32, corner: u32) -> vec3f {
    return displacement[node_of(cell, corner)].xyz;
}
