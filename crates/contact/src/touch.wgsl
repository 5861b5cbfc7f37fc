// The way of rigid things in a step; twin of `Passage` in touch.rs. The module around it gives
// `thing_number`, and `passage_number`.

struct Passage {
    // Where the numbers of the thing begin.
    thing: u32,
    // Half of its thinnest part [m].
    half_thinnest: f32,
    // Its position before the step [m]: what a number holds, and the rest.
    place: vec3f,
    rest_of_place: vec3f,
    // How its frame is turned before and after the step.
    turned_before: mat3x3f,
    turned_after: mat3x3f,
    // The way of its origin [m], how its turn in the step differs from none, and as a vector along its axis
    // [rad].
    shift: vec3f,
    turn: mat3x3f,
    angle: vec3f,
    // The largest way [m] of a point of the thing.
    travel: f32,
}

fn passage_vector(at: u32) -> vec3f {
    return vec3f(passage_number(at), passage_number(at + 1u), passage_number(at + 2u));
}

fn passage_matrix(at: u32) -> mat3x3f {
    return mat3x3f(passage_vector(at), passage_vector(at + 3u), passage_vector(at + 6u));
}

// Returns the passage of a thing, from the begins of the numbers of both.
fn passage_of(thing: u32, at: u32) -> Passage {
    return Passage(
        thing, thing_number(thing + 2u), passage_vector(at), passage_vector(at + 3u), passage_matrix(at + 6u),
        passage_matrix(at + 15u), passage_vector(at + 24u), passage_matrix(at + 27u), passage_vector(at + 36u),
        passage_number(at + 39u),
    );
}

// A point in the frame of the thing: outward, or inward where bodies are within.
fn near_local(thing: u32, point: vec3f) -> Near {
    let near = shape_near(thing, point);
    let sign = thing_number(thing + 1u);
    return Near(sign * near.distance, sign * near.normal);
}

// Returns the distance of a point from the thing at the end of the step, and the direction away from the
// thing. `place` is relative to the thing's position then.
fn near_after(passage: Passage, place: vec3f) -> Near {
    let near = near_local(passage.thing, place * passage.turned_after);
    return Near(near.distance, passage.turned_after * near.normal);
}

// Returns the distance of a point from the thing at the beginning of the step. `place` is relative to the
// thing's position then.
fn distance_before(passage: Passage, place: vec3f) -> f32 {
    return near_local(passage.thing, place * passage.turned_before).distance;
}

// A vector turned about an axis by an angle [rad].
fn rotated(by: vec3f, v: vec3f) -> vec3f {
    let angle = norm(by);
    if angle == 0.0 {
        return v;
    }
    let axis = by / angle;
    let half = sine(0.5 * angle);
    let across = cross(axis, v);
    return v + sine(angle) * across + 2.0 * half * half * cross(axis, across);
}

// Returns the distance of a point that is predicted to go by `moved`, and the direction away from the thing.
// `place` is relative to the thing's position before the step. The point is followed as in `Passage::meet`.
fn meet(passage: Passage, offset: f32, place: vec3f, moved: vec3f) -> Near {
    let relative = moved - passage.shift;
    let way = norm(moved) + passage.travel;
    let end = near_after(passage, place + relative);
    if way <= passage.half_thinnest && end.distance >= offset {
        return end;
    }
    let least = max(passage.half_thinnest, way / MOST_PARTS);
    var share = 0.0;
    while share < 1.0 {
        let local = rotated(-share * passage.angle, place + share * relative) * passage.turned_before;
        let near = near_local(passage.thing, local);
        let gap = near.distance - offset;
        if gap <= MEETS * passage.half_thinnest {
            let left = select(0.0, LEFT * min(gap, 0.0), share == 0.0);
            let normal = passage.turned_after * near.normal;
            if way <= passage.half_thinnest && dot(normal, end.normal) > ALIKE {
                return Near(end.distance - left, end.normal);
            }
            let on_surface = passage.turned_after * (local - near.normal * near.distance);
            let distance = dot(normal, place + relative - on_surface);
            if distance < offset {
                return Near(distance - left, normal);
            }
        }
        share += max(gap, least) / way;
    }
    return end;
}

// Returns the way [m] of a point of the thing. `place` is relative to the thing's position before the step.
fn carried(passage: Passage, place: vec3f) -> vec3f {
    return passage.shift + passage.turn * place;
}
