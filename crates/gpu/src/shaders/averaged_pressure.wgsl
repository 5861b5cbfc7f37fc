// F S_iso + p cof F with the pressure of the nodes.
fn averaged_piola(cell: u32, h: mat3x3f, d: Deformation) -> mat3x3f {
    let elastic = law_stress(d, fibre(0u, cell), fibre(1u, cell));
    let stress = relaxed_isochoric(elastic.isochoric, cell, 0u);
    return gradient_times(d.gradient, stress) + node_mean(cell) * cofactor(d.gradient);
}
