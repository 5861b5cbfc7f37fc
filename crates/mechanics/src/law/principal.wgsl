// Principal values and directions of a symmetric tensor by cyclic Jacobi rotations, twin of principal.rs.

// A tensor on its way to its principal axes.
struct Principal {
    values: vec3f,
    // The off-diagonal entries 23, 13, 12.
    beside: vec3f,
    // The axes so far, one per column.
    directions: mat3x3f,
}

// Far below any strain. Also far above the root of the smallest number, so that no square of an entry of this
// size is lost. Avoids 0/0 where a tensor is diagonal already.
const TINY: f32 = 1e-18;

// Turns the first two axes until the entry between them is zero. Then renames the axes (2, 3, 1), so that
// each pair has its turn.
fn turned(t: Principal) -> Principal {
    let between = t.beside.z;
    let difference = t.values.y - t.values.x;
    let root = sqrt(fma(difference, difference, 4.0 * between * between)) + TINY;
    let tangent = 2.0 * between / (difference + select(root, -root, difference < 0.0));
    let cosine = 1.0 / sqrt(fma(tangent, tangent, 1.0));
    let sine = tangent * cosine;
    let shift = tangent * between;
    let a = t.directions[0];
    let b = t.directions[1];
    return Principal(
        vec3f(t.values.y + shift, t.values.z, t.values.x - shift),
        vec3f(cosine * t.beside.y - sine * t.beside.x, 0.0, sine * t.beside.y + cosine * t.beside.x),
        mat3x3f(sine * a + cosine * b, t.directions[2], cosine * a - sine * b),
    );
}

fn principal(s: Symmetric) -> Principal {
    let still = mat3x3f(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
    var t = Principal(s.diagonal, s.shear.yzx, still);
    // Five rounds of three pairs.
    for (var turn = 0; turn < 15; turn++) {
        t = turned(t);
    }
    return t;
}
