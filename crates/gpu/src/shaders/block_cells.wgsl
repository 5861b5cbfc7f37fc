// A block of neighbouring cells works in shared memory. Displacements of its nodes are read once, forces are
// added up in the order of the cells, and one sum a node is written.

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
// … in the corners there: corner × GROUP + cell, eight to an entry; places left over name the last force,
// which is zero.
@group(3) @binding(4) var<storage, read> given: array<vec4u>;

var<workgroup> moved: array<f32, 3u * MOST_NODES>;
var<workgroup> forces: array<f32, 3u * (CORNERS * GROUP + 1u)>;
var<workgroup> energies: array<f32, GROUP>;
var<private> place: u32;
// The corners of its cell.
var<private> own_corners: vec2u;

fn local_node(cell: u32, corner: u32) -> u32 {
    return extractBits(select(own_corners.x, own_corners.y, corner >= 4u), 8u * (corner % 4u), 8u);
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

fn force_at(corner: u32) -> vec3f {
    return vec3f(forces[3u * corner], forces[3u * corner + 1u], forces[3u * corner + 2u]);
}

// The sum of the forces at two corners.
fn of_two(corners: u32) -> vec3f {
    return force_at(corners & 0xffffu) + force_at(corners >> 16u);
}

fn of_eight(corners: vec4u) -> vec3f {
    return (of_two(corners.x) + of_two(corners.y)) + (of_two(corners.z) + of_two(corners.w));
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
    // Values that are read later are asked for at once.
    if local < block.cells {
        own_corners.x = corners[block.first_cell + local];
        if CORNERS > 4u {
            own_corners.y = corners[CELLS + block.first_cell + local];
        }
    }
    var ends_of_given = vec2u(0u);
    var first_given = vec4u(0u);
    if local < block.nodes {
        let node = block.first_node + local;
        ends_of_given = vec2u(given_offsets[node], given_offsets[node + 1u]);
        first_given = given[ends_of_given.x];
    }
    let is_sound = group_end(local) >= instant.index;
    if local < 3u {
        forces[3u * CORNERS * GROUP + local] = 0.0;
    }
    for (var n = local; n < block.nodes; n += GROUP) {
        let u = displacement[block_nodes[block.first_node + n]];
        moved[3u * n] = u.x;
        moved[3u * n + 1u] = u.y;
        moved[3u * n + 2u] = u.z;
        load_rest(n, block.first_node + n);
    }
    workgroupBarrier();
    if local < block.cells && is_sound {
        compute(block.first_cell + local);
    }
    workgroupBarrier();
    for (var n = local; n < block.nodes; n += GROUP) {
        let node = block.first_node + n;
        if n != local {
            ends_of_given = vec2u(given_offsets[node], given_offsets[node + 1u]);
            first_given = given[ends_of_given.x];
        }
        var sum = vec4f(of_eight(first_given), 0.0);
        for (var k = ends_of_given.x + 1u; k < ends_of_given.y; k++) {
            sum += vec4f(of_eight(given[k]), 0.0);
        }
        if n == 0u && does(MEASURES) {
            for (var cell = 0u; cell < block.cells; cell++) {
                sum.w += energies[cell];
            }
        }
        slots[FIRST_SLOT + node] = sum;
    }
}
