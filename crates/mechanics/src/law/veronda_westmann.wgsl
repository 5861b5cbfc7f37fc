// parameter(1): c₁c₂ [Pa]; parameter(2): c₂.

fn isochoric_stress(d: Deformation, a: vec3f, b: vec3f) -> Symmetric {
    let x = isochoric_first_invariant_minus_3(d);
    let w1 = parameter(1) * exponential(parameter(2) * x);
    return isotropic_stress(d, w1, -0.5 * parameter(1));
}
