// Impulses of pairs, in the order of their rows. A row is in the level after the last one in which an earlier
// row has one of its nodes. So rows of a level share no node and are solved at once, with the same bits as
// one after the other.

var<workgroup> in_levels: atomic<u32>;
var<workgroup> pairs_told: u32;
var<workgroup> levels: u32;

// Orders the pairs that take part: whose gap is not too wide to close.
fn order_pairs(local: u32, deepest: f32) {
    if local == 0u {
        pairs_told = atomicLoad(&pair_queue[FOUND_PAIRS]);
        atomicStore(&in_levels, 0u);
        levels = 0u;
    }
    let count = workgroupUniformLoad(&pairs_told);
    let most = candidates[MOST_ROWS];
    let ordered = QUEUED_PAIRS + most;
    let ends = ordered + most;
    for (var k = local; k < count; k += SOLVERS) {
        let row = atomicLoad(&pair_queue[QUEUED_PAIRS + k]);
        if rows[pair_at(row)].w >= BAND * deepest {
            atomicStore(&pair_queue[QUEUED_PAIRS + k], NO_ROW);
        }
    }
    var before = NO_ROW;
    loop {
        storageBarrier();
        let now = told_ordered(local);
        if now == before {
            break;
        }
        before = now;
        // The earliest row claims a node.
        for (var k = local; k < count; k += SOLVERS) {
            let row = atomicLoad(&pair_queue[QUEUED_PAIRS + k]);
            if row != NO_ROW {
                let nodes = pair_nodes(row);
                for (var corner = 0u; corner < 4u; corner++) {
                    atomicMax(&pair_queue[CLAIMS + nodes[corner]], NO_ROW - row);
                }
            }
        }
        storageBarrier();
        for (var k = local; k < count; k += SOLVERS) {
            let row = atomicLoad(&pair_queue[QUEUED_PAIRS + k]);
            if row != NO_ROW {
                let nodes = pair_nodes(row);
                var has_all = true;
                for (var corner = 0u; corner < 4u; corner++) {
                    has_all = has_all && atomicLoad(&pair_queue[CLAIMS + nodes[corner]]) == NO_ROW - row;
                }
                if has_all {
                    atomicStore(&pair_queue[ordered + atomicAdd(&in_levels, 1u)], row);
                    atomicStore(&pair_queue[QUEUED_PAIRS + k], row | PLACED);
                }
            }
        }
        storageBarrier();
        for (var k = local; k < count; k += SOLVERS) {
            let row = atomicLoad(&pair_queue[QUEUED_PAIRS + k]);
            if row != NO_ROW && (row & PLACED) != 0u {
                let nodes = pair_nodes(row & ~PLACED);
                for (var corner = 0u; corner < 4u; corner++) {
                    atomicStore(&pair_queue[CLAIMS + nodes[corner]], 0u);
                }
                atomicStore(&pair_queue[QUEUED_PAIRS + k], NO_ROW);
            }
        }
        if local == 0u {
            let end = atomicLoad(&in_levels);
            if end > now {
                atomicStore(&pair_queue[ends + levels], end);
                levels += 1u;
            }
        }
    }
}

// How many rows have a level.
fn told_ordered(local: u32) -> u32 {
    if local == 0u {
        pairs_told = atomicLoad(&in_levels);
    }
    return workgroupUniformLoad(&pairs_told);
}

// Finds the impulses of all pairs. The largest way of any [m].
fn solve_pairs(local: u32) -> f32 {
    let ordered = QUEUED_PAIRS + candidates[MOST_ROWS];
    let ends = ordered + candidates[MOST_ROWS];
    let count = workgroupUniformLoad(&levels);
    var most = 0.0;
    var first = 0u;
    for (var level = 0u; level < count; level++) {
        storageBarrier();
        let end = atomicLoad(&pair_queue[ends + level]);
        for (var k = first + local; k < end; k += SOLVERS) {
            let row = atomicLoad(&pair_queue[ordered + k]);
            let at = pair_at(row);
            let friction = contact_number(pair_info(row) >> 4u, FRICTION);
            most = max(most, solve_row(at, pair_nodes(row), rows[at + 3u], 4u, friction));
        }
        first = end;
    }
    storageBarrier();
    return most;
}

fn forget_pairs(local: u32) {
    if local == 0u {
        atomicStore(&pair_queue[FOUND_PAIRS], 0u);
    }
}

// The part of an invocation in the force of a contact on its first surface [N].
fn force_of_pairs(contact: u32, local: u32) -> vec3f {
    var force = vec3f(0.0);
    let ranges = OF_CONTACT * (contact + 1u) + RANGES;
    for (var part = ranges; part < ranges + 4u; part += 2u) {
        for (var row = candidates[part] + local; row < candidates[part + 1u]; row += GROUP) {
            force += select(1.0, -1.0, (pair_info(row) & 8u) != 0u) * row_force(pair_at(row));
        }
    }
    return force;
}
