// parameter(1): W₁ = μ/2 [Pa].

fn isochoric_stress(d: Deformation, a: vec3f, b: vec3f) -> Symmetric {
    return first_invariant_stress(d, parameter(1));
}
