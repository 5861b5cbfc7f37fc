// Forces of tetrahedra whose pressure is averaged.

fn compute(cell: u32) {
    let shape = shape_of(cell);
    let h = displacement_gradient(cell, shape);
    let d = deformation(h);
    let force = give_forces(cell, averaged_piola(cell, h, d), shape);
    note(d.volume_ratio, d.strain_twice, force);
}
