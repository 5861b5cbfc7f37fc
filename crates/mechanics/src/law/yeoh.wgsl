// parameter(1) to parameter(3): c₁, 2c₂, 3c₃ [Pa].

fn isochoric_stress(d: Deformation, a: vec3f, b: vec3f) -> Symmetric {
    let x = isochoric_first_invariant_minus_3(d);
    return first_invariant_stress(d, fma(x, fma(x, parameter(3), parameter(2)), parameter(1)));
}
