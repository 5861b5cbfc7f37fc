// Finds pairs among the candidates, of a node or of two edges each, and measures their gaps.

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let index = number(group, groups, local);
    let points = candidates[POINTS_TOLD];
    if index >= points + candidates[CROSSINGS_TOLD] || end() <= instant.index {
        return;
    }
    var first = 0u;
    var after = 0u;
    if index < points {
        let at = candidates[POINTS_LISTED] + 6u * index;
        let contact = candidates[at + 1u];
        first = candidates[at + 2u];
        after = candidates[at + 3u];
        let ring = vec2u(candidates[at + 4u], candidates[at + 5u]);
        let limit = contact_number(contact, LIMIT);
        let depth = contact_number(contact, DEPTH);
        let reach = limit - contact_number(contact, OFFSET);
        find_above(candidates[at], ring, first, after, max(limit, depth), reach, depth);
    } else {
        let at = candidates[CROSSINGS_LISTED] + 5u * (index - points);
        first = candidates[at + 4u];
        after = first + 1u;
        let across = vec4u(candidates[at], candidates[at + 1u], candidates[at + 2u], candidates[at + 3u]);
        find_crossing(first, pair_nodes(first), across);
    }
    for (var row = first; row < after; row++) {
        if rows[pair_at(row) + 2u].w > 0.0 {
            tell_depth(-rows[pair_at(row)].w);
            let place = atomicAdd(&pair_queue[FOUND_PAIRS], 1u);
            atomicStore(&pair_queue[QUEUED_PAIRS + place], row);
        }
    }
}
