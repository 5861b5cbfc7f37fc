// A block of neighbouring cells works in shared memory: displacements of its nodes are read once, forces are added up in
// the order of the cells, and one sum a node is written.

struct Block {
    first_cell: u32,
    cells: u32,
    first_node: u32,
    nodes: u32,
}

@group(2) @binding(0) var<storage, read> displacement: array<vec4f>;
@group(2) @binding(1) var<storage, read_write> slots: array<vec4f>;
@group(3) @binding(0) var<storage, read> blocks: array<Block>;
// The nodes of all blocks.
@group(3) @binding(1) var<storage, read> block_nodes: array<u32>;
// The corners of each cell among the nodes of its block, four to a number, in rows of all cells.
@group(3) @binding(2) var<storage, read> corners: array<u32>;
// First entry of each node of a block …
@group(3) @binding(3) var<storage, read> given_offsets: array<u32>;
// … in the corners there: corner × GROUP + cell, two to a number.
@group(3) @binding(4) var<storage, read> given: array<u32>;

var<workgroup> moved: array<f32, 3u * MOST_NODES>;
var<workgroup> forces: array<f32, 3u * CORNERS * GROUP>;
var<workgroup> energies: array<f32, GROUP>;
var<private> place: u32;

fn local_node(cell: u32, corner: u32) -> u32 {
    return extractBits(corners[corner / 4u * CELLS + cell], 8u * (corner % 4u), 8u);
}

fn displacement_of(cell: u32, corner: u32) -> vec3f {
    let at = 3u * local_node(cell, corner);
    return vec3f(moved[at], moved[at + 1u], moved[at + 2u]);
}

// The force of a cell on one of its nodes [N], and the energy its hourglass control holds [J].
fn give(cell: u32, corner: u32, force: vec4f) {
    let at = 3u * (corner * GROUP + place);
    forces[at] = force.x;
    forces[at + 1u] = force.y;
    forces[at + 2u] = force.z;
    if corner == 0u {
        energies[place] = force.w;
    }
}

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    place = local;
    let index = group.y * groups.x + group.x;
    var block = Block(0u, 0u, 0u, 0u);
    if index < arrayLength(&blocks) {
        block = blocks[index];
    }
    for (var n = local; n < block.nodes; n += GROUP) {
        let u = displacement[block_nodes[block.first_node + n]];
        moved[3u * n] = u.x;
        moved[3u * n + 1u] = u.y;
        moved[3u * n + 2u] = u.z;
        load_rest(n, block.first_node + n);
    }
    workgroupBarrier();
    if local < block.cells && end() >= instant.index {
        compute(block.first_cell + local);
    }
    workgroupBarrier();
    for (var n = local; n < block.nodes; n += GROUP) {
        let node = block.first_node + n;
        var sum = vec4f(0.0);
        for (var k = given_offsets[node]; k < given_offsets[node + 1u]; k++) {
            let at = 3u * extractBits(given[k / 2u], 16u * (k % 2u), 16u);
            sum += vec4f(forces[at], forces[at + 1u], forces[at + 2u], 0.0);
        }
        if n == 0u && does(MEASURES) {
            for (var cell = 0u; cell < block.cells; cell++) {
                sum.w += energies[cell];
            }
        }
        slots[FIRST_SLOT + node] = sum;
    }
}
