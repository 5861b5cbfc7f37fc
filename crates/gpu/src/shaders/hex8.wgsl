// Forces of uniform-strain hexahedra with hourglass control. Rows at rest: the eight B_a. Their fourth
// components are, in order, the volume, the stiffness k [N/m] of the control, 3/2 κ² [1/m²] and a shear
// modulus [Pa]. The stiffness k grows from this modulus. Then the four patterns γ at each node. Corners are
// looked at where the patterns are large enough to invert one; forces/corners.rs of pliant-explicit says why.

const FIRST_CORNER = 16u;

fn compute(cell: u32) {
    let volume = row(0u, cell).w;
    let stiffness = row(1u, cell).w;
    let origin = displacement_of(cell, 0u);
    var h = mat3x3f();
    // Columns: q_c = Σ γ_ca u_a.
    var q = mat4x3f();
    for (var a = 1u; a < 8u; a++) {
        let u = displacement_of(cell, a) - origin;
        h += outer(u, row(a, cell).xyz);
        let gamma = row(8u + a, cell);
        q += mat4x3f(u * gamma.x, u * gamma.y, u * gamma.z, u * gamma.w);
    }
    let d = deformation(h);
    let elastic = law_stress(d, fibre(0u, cell), fibre(1u, cell));
    var piola = volume * gradient_times(d.gradient, relaxed_stress(elastic, cell));
    let square = dot(q[0], q[0]) + dot(q[1], q[1]) + dot(q[2], q[2]) + dot(q[3], q[3]);
    var energy = 0.5 * stiffness * square;
    q = stiffness * q;
    if HOURGLASS_GROWS != 0u {
        let whole = symmetric_sum(elastic.isochoric, elastic.volumetric);
        let grown = growth(d, h, whole, row(3u, cell).w, cell, square > 0.0);
        piola += energy * gradient_times(d.gradient, grown.gradient);
        energy *= grown.factor;
        q = grown.factor * q;
    }
    var first = vec3f(0.0);
    var size = vec3f(0.0);
    for (var a = 1u; a < 8u; a++) {
        let f = piola * row(a, cell).xyz;
        first -= f;
        let whole = f + q * row(8u + a, cell);
        size += abs(whole);
        give(cell, a, vec4f(whole, 0.0));
    }
    give(cell, 0u, vec4f(first + q * row(8u, cell), energy));
    var ratio = d.volume_ratio;
    let strain = strain_square(d.strain_twice);
    let flat = ratio * ratio < FLAT * FLAT * (1.0 + 0.5 * strain);
    if flat && row(2u, cell).w * square * (1.0 + strain) >= ratio * ratio && is_folded(cell) {
        ratio = min(ratio, 0.0);
    }
    note(ratio, d.strain_twice, size);
}
