// A law from its `isochoric_stress` and its volumetric energy, twin of split.rs.

// Second Piola–Kirchhoff stress [Pa]; a and b are the unit directions of the fibres at rest.
fn law_stress(d: Deformation, a: vec3f, b: vec3f) -> Split {
    return Split(isochoric_stress(d, a, b), volumetric_stress(d));
}
