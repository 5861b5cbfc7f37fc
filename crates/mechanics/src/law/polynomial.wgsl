// parameter(1) to parameter(5): c₁₀, c₀₁, 2c₂₀, c₁₁, 2c₀₂ [Pa].

fn isochoric_stress(d: Deformation, a: vec3f, b: vec3f) -> Symmetric {
    let i = isochoric_invariants_minus_3(d);
    let w1 = parameter(1) + parameter(3) * i.x + parameter(4) * i.y;
    let w2 = parameter(2) + parameter(4) * i.x + parameter(5) * i.y;
    return isotropic_stress(d, w1, w2);
}
