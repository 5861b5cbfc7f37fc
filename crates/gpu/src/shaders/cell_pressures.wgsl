// The cells' own pressures from the mean change of volume of their nodes, as their share in the next average.

fn compute(cell: u32) {
    cell_values[cell] = 0.25 * shape_of(cell).volume * relaxed_pressure(node_mean(cell), cell);
}
