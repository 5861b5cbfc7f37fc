// What all linear tetrahedra share.

// ∂u/∂X, from displacements relative to the first node.
fn displacement_gradient(cell: u32, shape: Shape) -> mat3x3f {
    let origin = displacement_of(cell, 0u);
    return outer(displacement_of(cell, 1u) - origin, shape.b1)
        + outer(displacement_of(cell, 2u) - origin, shape.b2)
        + outer(displacement_of(cell, 3u) - origin, shape.b3);
}
