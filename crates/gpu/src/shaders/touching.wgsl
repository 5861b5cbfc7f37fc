// Contacts with rigid things: where nodes would go, rows of nodes and of points between them, and their impulses; twin of touching.rs. Ways in
// the step are kept apart from places, so that gaps and slips lose no digits.

@group(2) @binding(0) var<storage, read> displacement: array<vec4f>;
// Two of each node that touches: its place at rest [m], as what a number holds and the rest; its number, and its first contact in `lists`.
@group(2) @binding(8) var<storage, read> surface: array<vec4f>;
// Rigid things; contacts; weights of the points on faces.
@group(2) @binding(9) var<storage, read> things: array<f32>;
// The contacts of nodes; faces; the contacts of faces, with their place in `rows`; where the faces of each colour begin; places of the forces of
// each contact.
@group(2) @binding(10) var<storage, read> lists: array<u32>;
// Two of each node that touches: its way [m] without contact, with NEAR and the components that are free; what contacts add to it
// [m], and by how much a force moves it [m/N].
@group(2) @binding(11) var<storage, read_write> states: array<vec4f>;
// Of a contact at a node, or on a face, the force on it [N] and how many points of the face take part; then three of each point: its normal and
// gap [m]; its slip without contact [m] and its impulse [N]; the force against its slip [N], and whether it takes part, or its place among
// the points of a face.
@group(2) @binding(12) var<storage, read_write> rows: array<vec4f>;
// The force of contacts on each node of the model [N].
@group(2) @binding(13) var<storage, read_write> contact_forces: array<vec4f>;
// Bits of the deepest gap [m]; how many nodes, and how many faces of each colour, take part in this step; then which.
@group(2) @binding(14) var<storage, read_write> queue: array<atomic<u32>>;

const NEAR = 8u;

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

// The place of a node less that of a thing, before the step [m].
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

// Writes the row of a point that is predicted to go by `moved` [m] from a place less that of the thing. Its gap [m].
fn measure(at: u32, touch: Touch, place: vec3f, moved: vec3f, tag: f32) -> f32 {
    let near = meet(touch.passage, touch.offset, place, moved);
    let gap = near.distance - touch.offset;
    rows[at] = vec4f(near.normal, gap);
    rows[at + 1u] = vec4f(moved - carried(touch.passage, place), 0.0);
    rows[at + 2u] = vec4f(0.0, 0.0, 0.0, tag);
    return gap;
}

// Finds the impulse of a row as others stand now. By how much its point has moved [m].
fn solve_row(at: u32, nodes: vec3u, weights: vec3f, count: u32, friction: f32) -> f32 {
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

// Finds the impulses of all rows of a node. The largest way of any [m].
fn solve_node(n: u32) -> f32 {
    var most = 0.0;
    for (var entry = first_contact(n); entry < first_contact(n + 1u); entry++) {
        let at = 4u * entry + 1u;
        if rows[at + 2u].w > 0.0 {
            most = max(most, solve_row(at, vec3u(n), vec3f(1.0, 0.0, 0.0), 1u, friction_of(lists[entry])));
        }
    }
    return most;
}

// Lifts a node that is still in a thing, and gives it the force of its contacts.
fn lift(n: u32) {
    let mobility = mobility_of(n);
    let moved = states[2u * n].xyz;
    var more = states[2u * n + 1u].xyz;
    for (var entry = first_contact(n); entry < first_contact(n + 1u); entry++) {
        let touch = touch_of(lists[entry]);
        let place = place_at(n, touch.passage);
        let near = near_after(touch.passage, place + (moved + more - touch.passage.shift));
        let along = mobility * near.normal;
        var force = row_force(4u * entry + 1u);
        var gap = near.distance - touch.offset;
        if gap < 0.0 {
            gap -= LEFT * min(distance_before(touch.passage, place) - touch.offset, 0.0);
        }
        if gap < 0.0 && dot(along, near.normal) > 0.0 {
            let push = -gap / dot(along, near.normal);
            more += along * push;
            force += near.normal * push;
        }
        rows[4u * entry] = vec4f(force, 0.0);
    }
    let is_free = mobility > vec3f(0.0);
    let force = select(vec3f(0.0), more, is_free) / select(vec3f(1.0), mobility, is_free);
    contact_forces[node_of(n)] = vec4f(force, 0.0);
}
