// The volumetric energy U(J), twin of volumetric.rs, which adds `relative_kirchhoff_pressure(j, x)`: J
// U′(J)/κ, x = J − 1. parameter(0): bulk modulus κ [Pa]. The law's own follow.

// S = J U′(J) C⁻¹ [Pa].
fn volumetric_stress(d: Deformation) -> Symmetric {
    let pressure = parameter(0) * relative_kirchhoff_pressure(d.volume_ratio, d.volume_change);
    return symmetric_scaled(d.inverse_cauchy_green, pressure);
}

// U′(J) [Pa].
fn law_pressure(volume_change: f32) -> f32 {
    let j = 1.0 + volume_change;
    return parameter(0) * relative_kirchhoff_pressure(j, volume_change) / j;
}
