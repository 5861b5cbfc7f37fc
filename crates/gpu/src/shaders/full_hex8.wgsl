// Forces of hexahedra with eight Gauss points and one mean dilatation. Rows at rest: the eight B_a of each
// point, with the point's volume beside the first; 1/V beside the second of the first point.

const FIRST_CORNER = 64u;

@group(1) @binding(4) var<storage, read_write> pressures: array<f32>;

fn compute(cell: u32) {
    var u: array<vec3f, 8>;
    let origin = displacement_of(cell, 0u);
    for (var a = 1u; a < 8u; a++) {
        u[a] = displacement_of(cell, a) - origin;
    }
    var gradient: array<mat3x3f, 8>;
    var change = 0.0;
    for (var point = 0u; point < 8u; point++) {
        var h = mat3x3f();
        for (var a = 1u; a < 8u; a++) {
            h += outer(u[a], row(point * 8u + a, cell).xyz);
        }
        gradient[point] = h;
        change += row(point * 8u, cell).w * volume_change(h);
    }
    // v/V − 1.
    let swelling = change * row(1u, cell).w;
    let pressure = relaxed_pressure(swelling, cell);
    var force = array<vec3f, 8>();
    for (var point = 0u; point < 8u; point++) {
        let d = deformation(gradient[point]);
        let elastic = law_stress(d, fibre(0u, cell), fibre(1u, cell));
        let stress = relaxed_isochoric(elastic.isochoric, cell, point * (SLOTS / 8u));
        let weight = row(point * 8u, cell).w;
        let piola = weight * (gradient_times(d.gradient, stress) + pressure * cofactor(d.gradient));
        for (var a = 0u; a < 8u; a++) {
            force[a] += piola * row(point * 8u + a, cell).xyz;
        }
        note(d.volume_ratio, d.strain_twice, abs(force[0]) + abs(force[7]));
    }
    if 1.0 + swelling < FLAT && is_folded(cell) {
        atomicMin(&findings[BROKEN], instant.index);
    }
    for (var a = 0u; a < 8u; a++) {
        give(cell, a, vec4f(force[a], 0.0));
    }
}
