// parameter(1): μ/2 [Pa]; parameter(2) to parameter(5): e₄, e₅, e₆, e₇ [Pa].

fn isochoric_stress(d: Deformation, a: vec3f, b: vec3f) -> Symmetric {
    let matrix = first_invariant_stress(d, parameter(1));
    let first = fibre_stresses(d, a, vec2f(parameter(2), parameter(3)) * fibre_strains(d, a));
    let second = fibre_stresses(d, b, vec2f(parameter(4), parameter(5)) * fibre_strains(d, b));
    return symmetric_sum(matrix, symmetric_sum(first, second));
}
