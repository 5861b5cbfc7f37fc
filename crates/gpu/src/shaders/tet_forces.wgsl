// f_a = V P B_a; the first node takes what makes the sum zero. Returns the sum of their sizes.
fn give_forces(cell: u32, piola: mat3x3f, shape: Shape) -> vec3f {
    let f1 = shape.volume * (piola * shape.b1);
    let f2 = shape.volume * (piola * shape.b2);
    let f3 = shape.volume * (piola * shape.b3);
    give(cell, 0u, vec4f(-(f1 + f2 + f3), 0.0));
    give(cell, 1u, vec4f(f1, 0.0));
    give(cell, 2u, vec4f(f2, 0.0));
    give(cell, 3u, vec4f(f3, 0.0));
    return abs(f1) + abs(f2) + abs(f3);
}
