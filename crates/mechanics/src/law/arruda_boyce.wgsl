// parameter(1) to parameter(5): coefficients of the powers 0 to 4 of Ī₁ − 3 in W₁ [Pa].

fn isochoric_stress(d: Deformation, a: vec3f, b: vec3f) -> Symmetric {
    let x = isochoric_first_invariant_minus_3(d);
    let slope = fma(x, fma(x, fma(x, parameter(5), parameter(4)), parameter(3)), parameter(2));
    return first_invariant_stress(d, fma(x, slope, parameter(1)));
}
