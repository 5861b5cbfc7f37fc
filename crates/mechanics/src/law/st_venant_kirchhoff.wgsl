// parameter(0): μ [Pa]; parameter(1): λ/2 [Pa]. No `law_pressure`: tr E is no function of J.

fn law_stress(d: Deformation, a: vec3f, b: vec3f) -> Split {
    let volumetric = symmetric_scaled(SYMMETRIC_IDENTITY, parameter(1) * symmetric_trace(d.strain_twice));
    return Split(symmetric_scaled(d.strain_twice, parameter(0)), volumetric);
}
