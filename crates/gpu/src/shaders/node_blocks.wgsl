// A step in one kernel. A block of neighbouring nodes reads the displacements of all nodes of the cells there
// into shared memory, and finds the forces of these cells. It adds up the forces on its own nodes and moves
// these nodes from one side to the other: other blocks still read the old side. Cells at borders are
// evaluated by several blocks, each with its own history.

struct Block {
    // Its copies of cells.
    first_cell: u32,
    cells: u32,
    // All its nodes; its own ones come first.
    first_node: u32,
    // How many, in the lower 16 bits, and how many are its own.
    nodes: u32,
}

@group(2) @binding(0) var<storage, read> displacement: array<vec4f>;
@group(2) @binding(1) var<storage, read> increment: array<vec4f>;
@group(2) @binding(2) var<storage, read_write> moved_displacement: array<vec4f>;
@group(2) @binding(5) var<storage, read_write> moved_increment: array<vec4f>;
// Forces on nodes, for the kernel that moves them.
@group(2) @binding(7) var<storage, read_write> left: array<vec4i>;
@group(3) @binding(4) var<storage, read> blocks: array<Block>;
// With TAKES and LEAVES.
@group(3) @binding(5) var<storage, read> block_nodes: array<u32>;
// The corners of each cell among the nodes of its block, some to a number, in rows of all cells.
@group(3) @binding(6) var<storage, read> corners: array<u32>;

// An earlier kernel has left forces of another solid on the node …
const TAKES = 0x80000000u;
// … and a later one will move it.
const LEAVES = 0x40000000u;
const NODE = 0x3fffffffu;

const PER_WORD = 32u / CORNER_BITS;

var<workgroup> near: array<f32, 3u * MOST_NODES>;
var<workgroup> forces: array<atomic<i32>, 4u * MOST_OWN>;
var<private> own: u32;

fn local_node(cell: u32, corner: u32) -> u32 {
    let word = corners[corner / PER_WORD * CELLS + cell];
    return extractBits(word, CORNER_BITS * (corner % PER_WORD), CORNER_BITS);
}

fn displacement_of(cell: u32, corner: u32) -> vec3f {
    let at = 3u * local_node(cell, corner);
    return vec3f(near[at], near[at + 1u], near[at + 2u]);
}

// The force of a cell on one of its nodes [N], and the energy its hourglass control holds [J].
fn give(cell: u32, corner: u32, force: vec4f) {
    let node = local_node(cell, corner);
    if node < own {
        atomicAdd(&forces[4u * node], whole(force.x * PER_FORCE));
        atomicAdd(&forces[4u * node + 1u], whole(force.y * PER_FORCE));
        atomicAdd(&forces[4u * node + 2u], whole(force.z * PER_FORCE));
        if force.w != 0.0 {
            atomicAdd(&forces[4u * node + 3u], whole(force.w * PER_ENERGY));
        }
    }
}

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let index = group.y * groups.x + group.x;
    var block = Block(0u, 0u, 0u, 0u);
    if index < BLOCKS {
        block = blocks[index];
    }
    // Where an earlier instant is not sound all stands still; one that is found not to be so now is whole on
    // its own side.
    let is_sound = group_end(local) >= instant.index;
    let all = extractBits(block.nodes, 0u, 16u);
    own = extractBits(block.nodes, 16u, 16u);
    for (var n = local; n < all; n += GROUP) {
        let u = displacement[block_nodes[block.first_node + n] & NODE];
        near[3u * n] = u.x;
        near[3u * n + 1u] = u.y;
        near[3u * n + 2u] = u.z;
    }
    for (var k = local; k < 4u * own; k += GROUP) {
        atomicStore(&forces[k], 0);
    }
    workgroupBarrier();
    if is_sound {
        for (var k = local; k < block.cells; k += GROUP) {
            compute(block.first_cell + k);
        }
    }
    workgroupBarrier();
    var done = vec4f(0.0);
    if is_sound {
        for (var n = local; n < own; n += GROUP) {
            done += settle(n, block_nodes[block.first_node + n]);
        }
    }
    if does(MOVES) {
        let sum = total(local, done);
        if local == 0u && index < BLOCKS {
            pass_over(FIRST_BLOCK + index, sum);
        }
    }
}

// Moves a node of the block, or leaves its force to a later kernel. Returns the work done.
fn settle(n: u32, entry: u32) -> vec4f {
    let node = entry & NODE;
    var force = vec4i(
        atomicLoad(&forces[4u * n]), atomicLoad(&forces[4u * n + 1u]), atomicLoad(&forces[4u * n + 2u]),
        atomicLoad(&forces[4u * n + 3u]),
    );
    if (entry & TAKES) != 0u {
        force += left[node];
    }
    if (entry & LEAVES) != 0u || !does(MOVES) {
        left[node] = force;
        return vec4f(0.0);
    }
    let m = motion(node, force_of(force).xyz);
    moved_displacement[node] = vec4f(placed(displacement[node].xyz + m.next, m.held), 0.0);
    moved_increment[3u * node] = vec4f(m.next, 0.0);
    moved_increment[3u * node + 1u] = vec4f(m.internal, 0.0);
    moved_increment[3u * node + 2u] = increment[3u * node + 1u];
    return work(m, nodes[node].y);
}
