// Contacts: where nodes would go, rows of nodes and of points between them, and their impulses; twin of
// touching.rs. Ways in the step are kept apart from places, so that gaps and slips lose no digits.

@group(2) @binding(0) var<storage, read> displacement: array<vec4f>;
// Two vectors for each node that touches. They have its place at rest [m], in single precision and as the
// remainder. Their fourth components are its number, and its first contact in `lists`.
@group(2) @binding(8) var<storage, read> surface: array<vec4f>;
// Rigid things; contacts; weights of the points on faces.
@group(2) @binding(9) var<storage, read> things: array<f32>;
// The contacts of nodes; faces; the contacts of faces, with their place in `rows` and their edges. Then the
// entries where the faces of each colour begin, and the places of the forces of each contact.
@group(2) @binding(10) var<storage, read> lists: array<u32>;
// Two vectors for each node that touches. The first has its way [m] without contact, with NEAR and the
// components that are free. The second has the way [m] that contacts add, and by how much a force moves the
// node [m/N].
@group(2) @binding(11) var<storage, read_write> states: array<vec4f>;
// The first vector of a contact at a node has its predicted gap [m], later the force on the node [N]. The
// first vector of a contact on a face has the force, and the number of its points that take part. Then come
// three vectors for each side of the thing at the node, or FACE_ROW for each point of the face. Of these
// three, one has the normal and the gap without contact [m]. The next has the slip without contact [m] and
// the impulse [N]. The last has the force against the slip [N], and a mark if the row takes part. A point of
// a face also has its weights. Candidates for pairs come last, with the same vectors and their weights.
@group(2) @binding(12) var<storage, read_write> rows: array<vec4f>;
// The force of contacts on each node of the model [N].
@group(2) @binding(13) var<storage, read_write> contact_forces: array<vec4f>;
// Bits of the deepest gap [m]; how many nodes, and how many faces of each colour, take part in this step;
// then which.
@group(2) @binding(14) var<storage, read_write> queue: array<atomic<u32>>;

const NEAR = 8u;

// Error of a gap over the distance from the middle of its thing.
const ROUND_OFF = 5e-7;

const DEEPEST = 0u;
const NODES_TOLD = 1u;
const FACES_TOLD = 2u;
const QUEUED_NODES = FACES_TOLD + COLOURS;
const QUEUED_FACES = QUEUED_NODES + TOUCHING;

fn thing_number(at: u32) -> f32 {
    return things[at];
}

fn passage_number(at: u32) -> f32 {
    return table[instant.row + at];
}

// How a contact is.
struct Touch {
    passage: Passage,
    // Distance that is kept, and what a point may be away from that and still count as near [m].
    offset: f32,
    margin: f32,
    // How far a node may be away, besides, whose faces come near [m].
    beyond: f32,
    // Its points on a face.
    first_point: u32,
    points: u32,
}

fn touch_of(contact: u32) -> Touch {
    let at = CONTACTS + 8u * contact;
    let passage = passage_of(u32(things[at]), u32(things[at + 1u]));
    return Touch(
        passage, things[at + 3u], things[at + 4u], things[at + 5u], u32(things[at + 6u]), u32(things[at + 7u]),
    );
}

fn friction_of(contact: u32) -> f32 {
    return things[CONTACTS + 8u * contact + 2u];
}

// The weights of the corners of a face at one of its points.
fn weights_of(point: u32) -> vec3f {
    let at = POINTS + 3u * point;
    return vec3f(things[at], things[at + 1u], things[at + 2u]);
}

fn node_of(n: u32) -> u32 {
    return bitcast<u32>(surface[2u * n].w);
}

fn first_contact(n: u32) -> u32 {
    return bitcast<u32>(surface[2u * n + 1u].w);
}

// The place of a node relative to a thing, before the step [m].
fn place_at(n: u32, passage: Passage) -> vec3f {
    let main = surface[2u * n].xyz - passage.place;
    let rest = surface[2u * n + 1u].xyz - passage.rest_of_place;
    return main + (rest + displacement[node_of(n)].xyz);
}

fn is_near(n: u32) -> bool {
    return u32(states[2u * n].w) >= NEAR;
}

// By how much a force moves each component of a node [m/N].
fn mobility_of(n: u32) -> vec3f {
    let free = u32(states[2u * n].w);
    let components = vec3f(f32(free & 1u), f32(free >> 1u & 1u), f32(free >> 2u & 1u));
    return states[2u * n + 1u].w * components;
}

// Writes the row of a point that is predicted to go by `moved` [m] from a place relative to the thing.
// Returns its gap [m].
fn measure(at: u32, touch: Touch, place: vec3f, moved: vec3f, tag: f32) -> f32 {
    let near = meet(touch.passage, touch.offset, place, moved);
    let gap = near.distance - touch.offset;
    rows[at] = vec4f(near.normal, gap);
    rows[at + 1u] = vec4f(moved - carried(touch.passage, place), 0.0);
    rows[at + 2u] = vec4f(0.0, 0.0, 0.0, tag);
    return gap;
}

// Takes part in finding the deepest gap. Depths [m] above zero compare as their bits do, but the bits of -0
// would be above all.
fn tell_depth(depth: f32) {
    if depth > 0.0 {
        atomicMax(&queue[DEEPEST], bitcast<u32>(depth));
    }
}

// Finds the impulse of a row as others stand now. By how much its point has moved [m].
fn solve_row(at: u32, nodes: vec4u, weights: vec4f, count: u32, friction: f32) -> f32 {
    var place = vec3f(0.0);
    var mobility = vec3f(0.0);
    for (var k = 0u; k < count; k++) {
        place += weights[k] * states[2u * nodes[k] + 1u].xyz;
        mobility += weights[k] * weights[k] * mobility_of(nodes[k]);
    }
    let normal = rows[at].xyz;
    let along = dot(mobility * normal, normal);
    if along <= 0.0 {
        return 0.0;
    }
    let gap = rows[at].w + dot(normal, place);
    let before = rows[at + 1u].w;
    let push = max(before - gap / along, 0.0);
    var more = normal * (push - before);
    if friction > 0.0 && (push > 0.0 || before > 0.0) {
        let drag_before = rows[at + 2u].xyz;
        var slip = rows[at + 1u].xyz + place + mobility * more;
        slip -= normal * dot(normal, slip);
        let squared = dot(slip, slip);
        var drag = drag_before;
        if squared > 0.0 {
            let across = dot(mobility * slip, slip) / squared;
            if across > 0.0 {
                drag -= slip / across;
            }
        }
        let limit = friction * push;
        let size = length(drag);
        if size > limit {
            drag *= limit / size;
        }
        more += drag - drag_before;
        rows[at + 2u] = vec4f(drag, rows[at + 2u].w);
    }
    rows[at + 1u].w = push;
    if all(more == vec3f(0.0)) {
        return 0.0;
    }
    for (var k = 0u; k < count; k++) {
        let state = 2u * nodes[k] + 1u;
        states[state] += vec4f(weights[k] * mobility_of(nodes[k]) * more, 0.0);
    }
    return length(mobility * more);
}

// The force of a row on its point [N].
fn row_force(at: u32) -> vec3f {
    return rows[at].xyz * rows[at + 1u].w + rows[at + 2u].xyz;
}

// Where the row of a side of the thing of a contact at a node begins.
fn side_at(entry: u32, side: u32) -> u32 {
    return ROWS * entry + 1u + 3u * side;
}

// Leaves out all rows of a contact at a node.
fn clear_sides(entry: u32) {
    for (var side = 0u; side < SIDES; side++) {
        let at = side_at(entry, side);
        rows[at + 1u].w = 0.0;
        rows[at + 2u] = vec4f(0.0);
    }
}

// Finds the impulses of all rows of a node. The largest way of any [m].
fn solve_node(n: u32) -> f32 {
    var most = 0.0;
    for (var entry = first_contact(n); entry < first_contact(n + 1u); entry++) {
        for (var side = 0u; side < SIDES; side++) {
            let at = side_at(entry, side);
            if rows[at + 2u].w > 0.0 {
                most = max(most, solve_row(at, vec4u(n), vec4f(1.0, 0.0, 0.0, 0.0), 1u, friction_of(lists[entry])));
            }
        }
    }
    return most;
}

// Finds the impulses of the rows of a node alone, until they move it by no more than a length [m]. The
// largest way of any [m].
fn push_alone(n: u32, found: f32) -> f32 {
    var largest = 0.0;
    for (var done = 0u; done < PASSES; done++) {
        let most = solve_node(n);
        largest = max(largest, most);
        if most <= found {
            break;
        }
    }
    return largest;
}

// Of the rows of a contact at a node, one without an impulse; zero if all have one.
fn idle(entry: u32) -> u32 {
    for (var side = 0u; side < SIDES; side++) {
        let at = side_at(entry, side);
        if rows[at + 2u].w == 0.0 || rows[at + 1u].w == 0.0 {
            return at;
        }
    }
    return 0u;
}

// Takes back the impulses of a contact at a node. Returns one of its rows, or zero without any.
fn take_back(n: u32, entry: u32) -> u32 {
    let mobility = mobility_of(n);
    var last = 0u;
    for (var side = 0u; side < SIDES; side++) {
        let at = side_at(entry, side);
        if rows[at + 2u].w > 0.0 && rows[at + 1u].w > 0.0 {
            states[2u * n + 1u] -= vec4f(mobility * row_force(at), 0.0);
            rows[at + 1u].w = 0.0;
            rows[at + 2u] = vec4f(0.0, 0.0, 0.0, rows[at + 2u].w);
            last = at;
        }
    }
    return last;
}

// The gap [m] of a node to a thing as the node lies now, without the penetration that may remain. Also the
// direction away from the thing.
fn gap_now(n: u32, touch: Touch, place: vec3f) -> Near {
    let goes = states[2u * n].xyz + states[2u * n + 1u].xyz;
    let near = near_after(touch.passage, place + (goes - touch.passage.shift));
    var gap = near.distance - touch.offset;
    if gap < 0.0 {
        gap -= LEFT * min(distance_before(touch.passage, place) - touch.offset, 0.0);
    }
    return Near(gap, near.normal);
}

// Sides of things beside a node, and their impulses; `least` [m] counts as its depth if it is not deeper. How
// far that moves it [m].
fn settle(n: u32, least: f32) -> f32 {
    var depth = least;
    for (var entry = first_contact(n); entry < first_contact(n + 1u); entry++) {
        depth = max(depth, -rows[ROWS * entry].w);
    }
    let before = states[2u * n + 1u].xyz;
    for (var entry = first_contact(n); entry < first_contact(n + 1u); entry++) {
        let touch = touch_of(lists[entry]);
        let place = place_at(n, touch.passage);
        let off = max(OFF * depth, ROUND_OFF * length(place));
        for (var looked = 0u; looked < LOOKED; looked++) {
            let more = states[2u * n + 1u].xyz;
            let gap = gap_now(n, touch, place);
            var at = 0u;
            if gap.distance < -off {
                at = idle(entry);
            } else if gap.distance > off {
                at = take_back(n, entry);
            }
            if at == 0u {
                break;
            }
            let slip = states[2u * n].xyz - carried(touch.passage, place);
            rows[at] = vec4f(gap.normal, gap.distance - dot(gap.normal, more));
            rows[at + 1u] = vec4f(slip, 0.0);
            rows[at + 2u] = vec4f(0.0, 0.0, 0.0, 1.0);
            push_alone(n, FOUND * depth);
        }
    }
    return distance(before, states[2u * n + 1u].xyz);
}

// Lifts a node that is still in a thing, and gives it the force of its contacts.
fn lift(n: u32) {
    let mobility = mobility_of(n);
    for (var entry = first_contact(n); entry < first_contact(n + 1u); entry++) {
        let touch = touch_of(lists[entry]);
        let place = place_at(n, touch.passage);
        var force = vec3f(0.0);
        for (var side = 0u; side < SIDES; side++) {
            force += row_force(side_at(entry, side));
        }
        var first = 0.0;
        // Where it goes freely it is out of the thing, or it would have a row.
        let goes_freely = all(states[2u * n + 1u].xyz == vec3f(0.0));
        for (var lifted = 0u; lifted < LIFTS && !goes_freely; lifted++) {
            let gap = gap_now(n, touch, place);
            first = select(first, gap.distance, lifted == 0u);
            let along = mobility * gap.normal;
            if gap.distance >= LIFTED * min(first, 0.0) || dot(along, gap.normal) <= 0.0 {
                break;
            }
            let push = -gap.distance / dot(along, gap.normal);
            states[2u * n + 1u] += vec4f(along * push, 0.0);
            force += gap.normal * push;
        }
        rows[ROWS * entry] = vec4f(force, 0.0);
    }
    let more = states[2u * n + 1u].xyz;
    let is_free = mobility > vec3f(0.0);
    let force = select(vec3f(0.0), more, is_free) / select(vec3f(1.0), mobility, is_free);
    contact_forces[node_of(n)] = vec4f(force, 0.0);
}
