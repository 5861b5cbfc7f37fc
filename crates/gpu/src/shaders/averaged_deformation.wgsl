// The whole law at F̄ = (J̄/J)^(1/3) F.
fn averaged_piola(cell: u32, h: mat3x3f, d: Deformation) -> mat3x3f {
    let ratio = cbrt((1.0 + node_mean(cell)) / d.volume_ratio);
    let c = ratio - 1.0;
    let dilated = deformation(ratio * h + mat3x3f(c, 0.0, 0.0, 0.0, c, 0.0, 0.0, 0.0, c));
    let elastic = law_stress(dilated, fibre(0u, cell), fibre(1u, cell));
    return gradient_times(dilated.gradient, relaxed_stress(elastic, cell));
}
