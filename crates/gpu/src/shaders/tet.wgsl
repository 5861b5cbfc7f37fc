// What all linear tetrahedra share. Rows at rest: B₁ with the volume, B₂, B₃.

const FIBRES = 3u;

// ∂u/∂X, from displacements relative to the first node.
fn displacement_gradient(cell: u32) -> mat3x3f {
    let nodes = cell_nodes[cell];
    let origin = displacement_of(nodes.x);
    return outer(displacement_of(nodes.y) - origin, row(0u, cell).xyz)
        + outer(displacement_of(nodes.z) - origin, row(1u, cell).xyz)
        + outer(displacement_of(nodes.w) - origin, row(2u, cell).xyz);
}

// f_a = V P B_a; the first node takes what makes the sum zero. Returns the sum of their sizes.
fn give_forces(cell: u32, piola: mat3x3f) -> vec3f {
    let nodes = cell_nodes[cell];
    let first = row(0u, cell);
    let f1 = first.w * (piola * first.xyz);
    let f2 = first.w * (piola * row(1u, cell).xyz);
    let f3 = first.w * (piola * row(2u, cell).xyz);
    give(cell, 0u, nodes.x, vec4f(-(f1 + f2 + f3), 0.0));
    give(cell, 1u, nodes.y, vec4f(f1, 0.0));
    give(cell, 2u, nodes.z, vec4f(f2, 0.0));
    give(cell, 3u, nodes.w, vec4f(f3, 0.0));
    return abs(f1) + abs(f2) + abs(f3);
}
