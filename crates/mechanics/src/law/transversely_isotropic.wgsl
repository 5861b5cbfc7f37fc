// parameter(1): μ/2 [Pa]; parameter(2): fibre modulus η [Pa].

fn isochoric_stress(d: Deformation, a: vec3f, b: vec3f) -> Symmetric {
    let matrix = first_invariant_stress(d, parameter(1));
    return symmetric_sum(matrix, fibre_stress(d, a, parameter(2) * fibre_strain(d, a)));
}
