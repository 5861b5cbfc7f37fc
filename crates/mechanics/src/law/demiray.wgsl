// parameter(1): μ/2 [Pa]; parameter(2): exponent b.

fn isochoric_stress(d: Deformation, a: vec3f, b: vec3f) -> Symmetric {
    let x = isochoric_first_invariant_minus_3(d);
    return first_invariant_stress(d, parameter(1) * exponential(parameter(2) * x));
}
