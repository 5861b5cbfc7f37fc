// Corners of hexahedra that turn inside out while the cell as a whole does not. Rows at rest from
// FIRST_CORNER on: X_a − X_0 [m] of all nodes but the first. An inversion smaller than round-off is left to
// the next instants.

// Flatness below which a cell is judged by its corners, as in forces/corners.rs.
const FLAT: f32 = 0.25;

fn is_folded(cell: u32) -> bool {
    var x: array<vec3f, 8>;
    let origin = displacement_of(cell, 0u);
    for (var a = 1u; a < 8u; a++) {
        x[a] = row(FIRST_CORNER + a - 1u, cell).xyz + (displacement_of(cell, a) - origin);
    }
    // The ends of the three edges at each corner, right-handed.
    var edges = array<vec3u, 8>(
        vec3u(1u, 3u, 4u), vec3u(2u, 0u, 5u), vec3u(3u, 1u, 6u), vec3u(0u, 2u, 7u),
        vec3u(7u, 5u, 0u), vec3u(4u, 6u, 1u), vec3u(5u, 7u, 2u), vec3u(6u, 4u, 3u),
    );
    var folded = false;
    for (var corner = 0u; corner < 8u; corner++) {
        let ends = edges[corner];
        let a = x[ends.x] - x[corner];
        let b = x[ends.y] - x[corner];
        let c = x[ends.z] - x[corner];
        folded = folded || dot(cross(a, b), c) < -1e-5 * length(a) * length(b) * length(c);
    }
    return folded;
}
