// J − 1 of tetrahedra, as their share in the average.

fn compute(cell: u32) {
    let shape = shape_of(cell);
    cell_values[cell] = 0.25 * shape.volume * volume_change(displacement_gradient(cell, shape));
}
