// Forces of linear tetrahedra.

fn compute(cell: u32) {
    let shape = shape_of(cell);
    let d = deformation(displacement_gradient(cell, shape));
    let stress = relaxed_stress(law_stress(d, fibre(0u, cell), fibre(1u, cell)), cell);
    let force = give_forces(cell, gradient_times(d.gradient, stress), shape);
    note(d.volume_ratio, d.strain_twice, force);
}
