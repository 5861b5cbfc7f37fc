// parameter(0), parameter(1): μ and λ [Pa].

fn law_stress(d: Deformation, a: vec3f, b: vec3f) -> Split {
    let shape = symmetric_commuting_product(d.inverse_cauchy_green, d.strain_twice);
    let pressure = parameter(1) * ln_1p(d.volume_change);
    return Split(symmetric_scaled(shape, parameter(0)), symmetric_scaled(d.inverse_cauchy_green, pressure));
}

fn law_pressure(volume_change: f32) -> f32 {
    return parameter(1) * ln_1p(volume_change) / (1.0 + volume_change);
}
