// The cells of a solid. Arrays have a row of all cells for each number of a cell, so that neighbours read
// side by side.

struct Solid {
    parameters: array<vec4f, PARAMETERS>,
    // 1 − Σ a of the isochoric and the volumetric series; then (d, g) of each term of both.
    series: array<vec4f, SERIES>,
}

// Nodes, four to a row.
@group(1) @binding(0) var<storage, read> cell_nodes: array<vec4u>;
// What the element needs of the shape at rest, then the directions of the fibres.
@group(1) @binding(1) var<storage, read> rest: array<vec4f>;
// What relaxing laws remember, as in `History::cells`.
@group(1) @binding(2) var<storage, read_write> history: array<f32>;
@group(1) @binding(3) var<uniform> solid: Solid;

fn parameter(index: u32) -> f32 {
    return solid.parameters[index / 4u][index % 4u];
}

fn row(index: u32, cell: u32) -> vec4f {
    return rest[index * CELLS + cell];
}

fn fibre(family: u32, cell: u32) -> vec3f {
    if family < FAMILIES {
        return row(FIBRES + family, cell).xyz;
    }
    return vec3f(1.0, 0.0, 0.0);
}

// a ⊗ b.
fn outer(a: vec3f, b: vec3f) -> mat3x3f {
    return mat3x3f(a * b.x, a * b.y, a * b.z);
}

// |C − I|².
fn strain_square(strain_twice: Symmetric) -> f32 {
    let diagonal = dot(strain_twice.diagonal, strain_twice.diagonal);
    return diagonal + 2.0 * dot(strain_twice.shear, strain_twice.shear);
}

// Notes a broken cell: det F in its middle or at a corner not above zero, or a force that is not a number.
// And how far it is deformed, if that is asked.
fn note(volume_ratio: f32, strain_twice: Symmetric, force: vec3f) {
    if !(volume_ratio > 0.0 && dot(force, vec3f(1.0)) < 3e38) {
        atomicMin(&findings[BROKEN], instant.index);
    }
    if does(MEASURES) {
        let ratio = bitcast<u32>(max(volume_ratio, 0.0));
        if ratio < atomicLoad(&findings[LEAST_VOLUME_RATIO]) {
            atomicMin(&findings[LEAST_VOLUME_RATIO], ratio);
        }
        let strain = bitcast<u32>(strain_square(strain_twice));
        if strain > atomicLoad(&findings[LARGEST_STRAIN]) {
            atomicMax(&findings[LARGEST_STRAIN], strain);
        }
    }
}
