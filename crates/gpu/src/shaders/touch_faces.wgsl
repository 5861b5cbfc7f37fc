// Measures the gaps of points on faces whose corners may touch something.

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let face = number(group, groups, local);
    if face >= FACES || end() <= instant.index {
        return;
    }
    let record = FACES_AT + 5u * face;
    let corners = vec3u(lists[record], lists[record + 1u], lists[record + 2u]);
    let are_near = is_near(corners.x) && is_near(corners.y) && is_near(corners.z);
    var deepest = 0.0;
    var takes_part = false;
    for (var entry = lists[record + 4u]; entry < lists[record + 9u]; entry++) {
        let at = lists[FACE_CONTACTS + 3u * entry + 1u];
        var count = 0u;
        if are_near {
            let touch = touch_of(lists[FACE_CONTACTS + 3u * entry]);
            var places = array<vec3f, 3>();
            var moved = array<vec3f, 3>();
            var way = 0.0;
            for (var k = 0u; k < 3u; k++) {
                places[k] = place_at(corners[k], touch.passage);
                moved[k] = states[2u * corners[k]].xyz;
                way = max(way, length(moved[k]));
            }
            let middle = (places[0] + places[1] + places[2]) / 3.0;
            let around = max(
                max(distance(places[0], middle), distance(places[1], middle)), distance(places[2], middle),
            );
            let room = touch.offset + way + touch.margin + touch.passage.travel;
            // The distances of two points differ by no more than the distance between the points.
            if near_after(touch.passage, middle - touch.passage.shift).distance <= room + around {
                let nearest = takes_nearest(touch.passage.thing);
                let edges = lists[FACE_CONTACTS + 3u * entry + 2u];
                var local = array<vec3f, 3>();
                for (var k = 0u; k < 3u && nearest; k++) {
                    local[k] = (places[k] - touch.passage.shift) * touch.passage.turned_after;
                }
                for (var point = 0u; point < touch.points; point++) {
                    var weights = vec3f(0.0);
                    if nearest {
                        weights = nearest_point(touch.passage.thing, point, edges, local);
                        if all(weights == vec3f(0.0)) {
                            continue;
                        }
                    } else {
                        weights = weights_of(touch.first_point + point);
                    }
                    let place = weights.x * places[0] + weights.y * places[1] + weights.z * places[2];
                    let goes = weights.x * moved[0] + weights.y * moved[1] + weights.z * moved[2];
                    let row = at + 1u + FACE_ROW * count;
                    let gap = measure(row, touch, place, goes, 1.0);
                    rows[row + 3u] = vec4f(weights, 0.0);
                    if gap < touch.margin {
                        count += 1u;
                        deepest = max(deepest, -gap);
                        takes_part = true;
                    }
                }
            }
        }
        rows[at] = vec4f(0.0, 0.0, 0.0, f32(count));
    }
    if takes_part {
        let colour = lists[record + 3u];
        tell_depth(deepest);
        let place = lists[COLOURS_AT + colour] + atomicAdd(&queue[FACES_TOLD + colour], 1u);
        atomicStore(&queue[QUEUED_FACES + place], face);
    }
}
