// Tetrahedra at rest, as they are stored: rows B₁ with the volume, B₂, B₃.

struct Shape {
    b1: vec3f,
    b2: vec3f,
    b3: vec3f,
    volume: f32,
}

fn shape_of(cell: u32) -> Shape {
    let first = row(0u, cell);
    return Shape(first.xyz, row(1u, cell).xyz, row(2u, cell).xyz, first.w);
}
