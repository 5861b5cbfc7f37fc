// Tetrahedra at rest, from where the nodes of their block lie.

// Of the nodes of all blocks, from the first of each [m].
@group(3) @binding(5) var<storage, read> block_rest: array<f32>;

var<workgroup> resting: array<f32, 3u * MOST_NODES>;

struct Shape {
    b1: vec3f,
    b2: vec3f,
    b3: vec3f,
    volume: f32,
}

fn load_rest(to: u32, node: u32) {
    for (var c = 0u; c < 3u; c++) {
        resting[3u * to + c] = block_rest[3u * node + c];
    }
}

fn rest_of(cell: u32, corner: u32) -> vec3f {
    let at = 3u * local_node(cell, corner);
    return vec3f(resting[at], resting[at + 1u], resting[at + 2u]);
}

fn shape_of(cell: u32) -> Shape {
    let origin = rest_of(cell, 0u);
    let a = rest_of(cell, 1u) - origin;
    let b = rest_of(cell, 2u) - origin;
    let c = rest_of(cell, 3u) - origin;
    let area = cross(b, c);
    let determinant = dot(a, area);
    let inverse = 1.0 / determinant;
    return Shape(inverse * area, inverse * cross(c, a), inverse * cross(a, b), determinant / 6.0);
}
