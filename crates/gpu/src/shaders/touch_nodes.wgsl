// Predicts where nodes go that may touch something in the step, and measures their gaps. Where only nodes
// touch rigid things, finds their forces.

@group(2) @binding(1) var<storage, read> increment: array<vec4f>;

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let n = number(group, groups, local);
    if n >= TOUCHING || end() <= instant.index {
        return;
    }
    if may_touch(n) {
        predict(n);
        let deepest = measure_node(n);
        if !IS_SHARED {
            var is_found = deepest <= 0.0;
            for (var round = 0u; round < ROUNDS && !is_found; round++) {
                push_alone(n, FOUND * deepest);
                is_found = settle(n, 0.0) <= FOUND * deepest;
            }
            lift(n);
        }
    } else {
        states[2u * n] = vec4f(0.0);
        states[2u * n + 1u] = vec4f(0.0);
        for (var entry = first_contact(n); entry < first_contact(n + 1u); entry++) {
            rows[ROWS * entry] = vec4f(0.0);
        }
        contact_forces[node_of(n)] = vec4f(0.0);
    }
}

// Whether a node may touch something in the step: a way can double in a step.
fn may_touch(n: u32) -> bool {
    if does(STARTS) || is_listed(n) {
        return true;
    }
    let way = length(increment[3u * node_of(n)].xyz) * instant.ratio;
    for (var entry = first_contact(n); entry < first_contact(n + 1u); entry++) {
        let touch = touch_of(lists[entry]);
        let room = touch.offset + 2.0 * way + touch.margin + touch.beyond + touch.passage.travel;
        let place = place_at(n, touch.passage) - touch.passage.shift;
        if near_after(touch.passage, place).distance < room {
            return true;
        }
    }
    return false;
}

// Of a force the part Δt⁺/(2 h) moves a node in the first step; the rest is in the increment before.
fn predict(n: u32) {
    let node = node_of(n);
    let m = motion(node, internal_force(node).xyz);
    let part = select(1.0, instant.ratio / (1.0 + instant.ratio), does(STARTS));
    var free = 7u;
    if m.held != FREE {
        let owner = holds[m.held].owner;
        for (var c = 0u; c < 3u; c++) {
            if owner[c] != FREE {
                free &= ~(1u << c);
            }
        }
    }
    let mobility = part * instant.push / (m.inertia * (1.0 + nodes[node].y * instant.half_mean));
    states[2u * n] = vec4f(m.next, f32(NEAR + free));
    states[2u * n + 1u] = vec4f(0.0, 0.0, 0.0, mobility);
}

// The gaps of a node; the deepest [m].
fn measure_node(n: u32) -> f32 {
    let moved = states[2u * n].xyz;
    var deepest = 0.0;
    var takes_part = false;
    for (var entry = first_contact(n); entry < first_contact(n + 1u); entry++) {
        let touch = touch_of(lists[entry]);
        let at = side_at(entry, 0u);
        clear_sides(entry);
        let gap = measure(at, touch, place_at(n, touch.passage), moved, 0.0);
        rows[ROWS * entry] = vec4f(0.0, 0.0, 0.0, gap);
        if gap < touch.margin {
            rows[at + 2u].w = 1.0;
            deepest = max(deepest, -gap);
            takes_part = true;
        }
    }
    if IS_SHARED && takes_part {
        tell_depth(deepest);
        atomicStore(&queue[QUEUED_NODES + atomicAdd(&queue[NODES_TOLD], 1u)], n);
    }
    return deepest;
}
