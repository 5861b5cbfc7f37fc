// parameter(1): number of terms; then for each its α/2 and 2μ/α [Pa].

fn isochoric_stress(d: Deformation, a: vec3f, b: vec3f) -> Symmetric {
    let axes = principal(isochoric_strain_twice(d));
    let logarithms = vec3f(ln_1p(axes.values.x), ln_1p(axes.values.y), ln_1p(axes.values.z));
    var kirchhoff = vec3f(0.0);
    for (var term = 0u; term < u32(parameter(1)); term++) {
        let powers = parameter(2 + 2 * term) * logarithms;
        kirchhoff += parameter(3 + 2 * term) * vec3f(exp_m1(powers.x), exp_m1(powers.y), exp_m1(powers.z));
    }
    let mean = (kirchhoff.x + kirchhoff.y + kirchhoff.z) / 3.0;
    // λ² = λ̄²/q.
    let values = d.isochoric_factor * (kirchhoff - mean) / (1.0 + axes.values);
    let first = symmetric_scaled(symmetric_dyad(axes.directions[0]), values.x);
    let second = symmetric_plus_scaled(first, symmetric_dyad(axes.directions[1]), values.y);
    return symmetric_plus_scaled(second, symmetric_dyad(axes.directions[2]), values.z);
}
