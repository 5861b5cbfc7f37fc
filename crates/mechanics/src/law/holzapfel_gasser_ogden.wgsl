// parameter(1): c/2 [Pa]; parameter(2): k₁ [Pa]; parameter(3): k₂; parameter(4): dispersion κ; parameter(5):
// 1 − 3κ; parameter(6): families, 1 or 2.

fn family_stress(d: Deformation, a: vec3f) -> Symmetric {
    let spread = parameter(4) * isochoric_first_invariant_minus_3(d);
    let tension = max(fma(parameter(5), fibre_strain(d, a), spread), 0.0);
    let p = parameter(2) * tension * exponential(parameter(3) * tension * tension);
    return symmetric_sum(first_invariant_stress(d, parameter(4) * p), fibre_stress(d, a, parameter(5) * p));
}

fn isochoric_stress(d: Deformation, a: vec3f, b: vec3f) -> Symmetric {
    var stress = symmetric_sum(first_invariant_stress(d, parameter(1)), family_stress(d, a));
    if parameter(6) > 1.0 {
        stress = symmetric_sum(stress, family_stress(d, b));
    }
    return stress;
}
