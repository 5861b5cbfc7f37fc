// Averages of the change of volume or of pressures, twin of forces/averaged.rs.

// Of each cell, weighted by a quarter of its volume.
@group(1) @binding(4) var<storage, read_write> cell_values: array<f32>;
// Of each node of the solid.
@group(1) @binding(5) var<storage, read_write> node_values: array<f32>;
// The cells' nodes, numbered in the solid.
@group(1) @binding(6) var<storage, read> local_nodes: array<vec4u>;
// The cells at each node.
@group(1) @binding(7) var<storage, read> local_offsets: array<u32>;
@group(1) @binding(8) var<storage, read> local_cells: array<u32>;
// One over a quarter of the volumes there [1/m³].
@group(1) @binding(9) var<storage, read> inverse_volume: array<f32>;
// What relaxing pressures remember, as in `History::pressures`.
@group(1) @binding(10) var<storage, read_write> pressures: array<f32>;

// The mean of a cell's nodes.
fn node_mean(cell: u32) -> f32 {
    let nodes = local_nodes[cell];
    let sum = node_values[nodes.x] + node_values[nodes.y] + node_values[nodes.z] + node_values[nodes.w];
    return 0.25 * sum;
}
