// parameter(0), parameter(1): μ and λ [Pa].

fn law_stress(d: Deformation, a: vec3f, b: vec3f) -> Split {
    let shape = symmetric_commuting_product(d.inverse_cauchy_green, d.strain_twice);
    let pressure = d.volume_ratio * law_pressure(d.volume_change);
    return Split(symmetric_scaled(shape, parameter(0)), symmetric_scaled(d.inverse_cauchy_green, pressure));
}

fn law_pressure(volume_change: f32) -> f32 {
    return parameter(1) * volume_change;
}
