// Pairs of points of surfaces: candidates, and rows of those that are found.

// A head; four numbers of each contact and its rows; triangles around nodes, by their other corners; nodes
// with triangles; edges; all candidates.
@group(2) @binding(16) var<storage, read> candidates: array<u32>;
// Place [m] of each node that touches when candidates were listed, and how far it may go until they are
// listed again [m]. This distance is negative if the node is in no list, and zero without pairs.
@group(2) @binding(17) var<storage, read> listed: array<vec4f>;
// Number of pairs found; first row of each node that is not placed yet; the pairs found. Then the pairs that
// take part, level by level, and the ends of levels.
@group(2) @binding(18) var<storage, read_write> pair_queue: array<atomic<u32>>;

// Places in the head.
const POINTS_TOLD = 0u;
const CROSSINGS_TOLD = 1u;
const POINTS_LISTED = 2u;
const CROSSINGS_LISTED = 3u;
const ROWS_LISTED = 4u;
const MOST_ROWS = 5u;

// Numbers of a contact.
const OF_CONTACT = 9u;
const OFFSET = 0u;
const LIMIT = 1u;
const DEPTH = 2u;
const FRICTION = 3u;
// From where to where its rows go: of nodes, then of edges.
const RANGES = 4u;
// Where the distances [m] are that its nodes keep, by their own numbers; zero: all keep the offset.
const KEPT = 8u;

const FOUND_PAIRS = 0u;
const CLAIMS = 1u;
const QUEUED_PAIRS = CLAIMS + TOUCHING;
const PLACED = 0x80000000u;

fn contact_number(contact: u32, which: u32) -> f32 {
    return bitcast<f32>(candidates[OF_CONTACT * (contact + 1u) + which]);
}

fn record_of(row: u32) -> u32 {
    return candidates[ROWS_LISTED] + 5u * row;
}

fn pair_nodes(row: u32) -> vec4u {
    let at = record_of(row);
    return vec4u(candidates[at], candidates[at + 1u], candidates[at + 2u], candidates[at + 3u]);
}

// Which corners are at borders, a bit each; 8 if its force acts against the first surface of the contact; and
// the contact from bit 4 on.
fn pair_info(row: u32) -> u32 {
    return candidates[record_of(row) + 4u];
}

// Where a row begins in `rows`: as others, with its weights.
fn pair_at(row: u32) -> u32 {
    return PAIR_ROWS + 4u * row;
}

fn is_listed(n: u32) -> bool {
    return listed[n].w > 0.0;
}

fn ring_of(k: u32) -> vec2u {
    return vec2u(candidates[k], candidates[k + 1u]);
}

fn corners_of(row: u32) -> vec3u {
    return pair_nodes(row).yzw;
}

fn at_border(row: u32, corners: vec3<bool>) -> bool {
    let info = pair_info(row);
    let are = vec3<bool>((info & 1u) != 0u, (info & 2u) != 0u, (info & 4u) != 0u);
    return all(are | !corners);
}

fn between(a: u32, b: u32) -> vec3f {
    let main = surface[2u * a].xyz - surface[2u * b].xyz;
    let rest = surface[2u * a + 1u].xyz - surface[2u * b + 1u].xyz;
    return main + (rest + (displacement[node_of(a)].xyz - displacement[node_of(b)].xyz));
}

fn leave_pair(row: u32) {
    let at = pair_at(row);
    rows[at + 1u].w = 0.0;
    rows[at + 2u] = vec4f(0.0);
}

// The distance [m] that two points keep: a node and a point of a triangle, or points of two edges.
fn kept_by(row: u32, contact: u32, nodes: vec4u, weights: vec4f) -> f32 {
    let offset = contact_number(contact, OFFSET);
    let head = OF_CONTACT * (contact + 1u);
    let at = candidates[head + KEPT];
    if at == 0u {
        return offset;
    }
    var own = vec4f(0.0);
    for (var k = 0u; k < 4u; k++) {
        own[k] = weights[k] * bitcast<f32>(candidates[at + nodes[k]]);
    }
    let is_node = row < candidates[head + RANGES + 1u];
    let first = own.x + select(own.y, 0.0, is_node);
    return clamp(min(first, first - (own.x + own.y + own.z + own.w)), 0.0, offset);
}

fn take_pair(row: u32, nodes: vec4u, weights: vec4f, normal: vec3f, distance: f32) {
    let contact = pair_info(row) >> 4u;
    if distance <= -contact_number(contact, DEPTH) || distance >= contact_number(contact, LIMIT) {
        return;
    }
    // Ways from the first node: the weights sum up to nothing.
    var place = vec3f(0.0);
    var moved = weights.x * states[2u * nodes.x].xyz;
    for (var k = 1u; k < 4u; k++) {
        place += weights[k] * between(nodes[k], nodes.x);
        moved += weights[k] * states[2u * nodes[k]].xyz;
    }
    let at = pair_at(row);
    rows[at] = vec4f(normal, dot(normal, place + moved) - kept_by(row, contact, nodes, weights));
    rows[at + 1u] = vec4f(moved, 0.0);
    rows[at + 2u] = vec4f(0.0, 0.0, 0.0, 1.0);
    rows[at + 3u] = weights;
}
