// parameter(1), parameter(2): c₁₀ and c₀₁ [Pa].

fn isochoric_stress(d: Deformation, a: vec3f, b: vec3f) -> Symmetric {
    return isotropic_stress(d, parameter(1), parameter(2));
}
