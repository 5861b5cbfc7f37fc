// Finds the impulses of all rows, by projected Gauss–Seidel. Rows of nodes come first, all at once. Rows on
// faces of a colour follow at once, since such faces share no node. Rows of pairs come last. So the order
// within a colour changes no bit. Then nodes find the adjacent sides of things. One group works, since all
// wait for each other.

var<workgroup> change: atomic<u32>;
var<workgroup> told: u32;

// The largest number of the group.
fn largest(local: u32, own: f32) -> f32 {
    atomicMax(&change, bitcast<u32>(own));
    storageBarrier();
    workgroupBarrier();
    if local == 0u {
        told = atomicExchange(&change, 0u);
    }
    return bitcast<f32>(workgroupUniformLoad(&told));
}

@compute @workgroup_size(SOLVERS)
fn main(@builtin(local_invocation_index) local: u32) {
    if local == 0u {
        atomicStore(&change, 0u);
        told = select(0u, atomicLoad(&queue[DEEPEST]), end() > instant.index);
    }
    let deepest = bitcast<f32>(workgroupUniformLoad(&told));
    let nodes = atomicLoad(&queue[NODES_TOLD]);
    order_pairs(local, deepest);
    var is_found = deepest <= 0.0;
    for (var round = 0u; round < ROUNDS && !is_found; round++) {
        var is_relaxed = false;
        for (var done = 0u; done < PASSES && !is_relaxed; done++) {
            var most = 0.0;
            for (var k = local; k < nodes; k += SOLVERS) {
                most = max(most, solve_node(atomicLoad(&queue[QUEUED_NODES + k])));
            }
            for (var colour = 0u; colour < COLOURS; colour++) {
                storageBarrier();
                let faces = atomicLoad(&queue[FACES_TOLD + colour]);
                for (var k = local; k < faces; k += SOLVERS) {
                    let face = atomicLoad(&queue[QUEUED_FACES + lists[COLOURS_AT + colour] + k]);
                    most = max(most, solve_face(face));
                }
            }
            most = max(most, solve_pairs(local));
            is_relaxed = largest(local, most) < FOUND * deepest;
        }
        var moved = 0.0;
        for (var k = local; k < nodes; k += SOLVERS) {
            moved = max(moved, settle(atomicLoad(&queue[QUEUED_NODES + k]), FOUND * deepest));
        }
        is_found = largest(local, moved) <= FOUND * deepest;
    }
    for (var colour = 0u; colour < COLOURS; colour++) {
        let faces = atomicLoad(&queue[FACES_TOLD + colour]);
        for (var k = local; k < faces; k += SOLVERS) {
            sum_face(atomicLoad(&queue[QUEUED_FACES + lists[COLOURS_AT + colour] + k]));
        }
    }
    storageBarrier();
    forget_pairs(local);
    for (var k = local; k < QUEUED_NODES; k += SOLVERS) {
        atomicStore(&queue[k], 0u);
    }
}

// Finds the impulses of all rows of a face. The largest way of any [m].
fn solve_face(face: u32) -> f32 {
    let record = FACES_AT + 5u * face;
    let corners = vec3u(lists[record], lists[record + 1u], lists[record + 2u]);
    var most = 0.0;
    for (var entry = lists[record + 4u]; entry < lists[record + 9u]; entry++) {
        let friction = friction_of(lists[FACE_CONTACTS + 3u * entry]);
        let at = lists[FACE_CONTACTS + 3u * entry + 1u];
        let end = at + 1u + FACE_ROW * u32(rows[at].w);
        for (var row = at + 1u; row < end; row += FACE_ROW) {
            most = max(most, solve_row(row, vec4u(corners, 0u), rows[row + 3u], 3u, friction));
        }
    }
    return most;
}

// Sums the forces of the rows of a face.
fn sum_face(face: u32) {
    let record = FACES_AT + 5u * face;
    for (var entry = lists[record + 4u]; entry < lists[record + 9u]; entry++) {
        let at = lists[FACE_CONTACTS + 3u * entry + 1u];
        let end = at + 1u + FACE_ROW * u32(rows[at].w);
        var force = vec3f(0.0);
        for (var row = at + 1u; row < end; row += FACE_ROW) {
            force += row_force(row);
        }
        rows[at] = vec4f(force, rows[at].w);
    }
}
