// parameter(1): μ/2 [Pa]; parameter(2): 1/Jₘ.

fn isochoric_stress(d: Deformation, a: vec3f, b: vec3f) -> Symmetric {
    let used = isochoric_first_invariant_minus_3(d) * parameter(2);
    return first_invariant_stress(d, parameter(1) / max(1.0 - used, 0.0));
}
