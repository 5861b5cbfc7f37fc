// Points of a face that are kept out of a ball or a capsule; twin of `FacePoints::Nearest` in face_points.rs.

// A part of a whole from 0 to 1; zero of none.
fn share(part: f32, whole: f32) -> f32 {
    if whole > 0.0 {
        return part / whole;
    }
    return 0.0;
}

// The weights of the corners of a triangle at its point nearest to another one (Ericson 2005, section 5.1.5).
fn nearest_weights(a: vec3f, b: vec3f, c: vec3f, p: vec3f) -> vec3f {
    let ab = b - a;
    let ac = c - a;
    let d1 = dot(ab, p - a);
    let d2 = dot(ac, p - a);
    if d1 <= 0.0 && d2 <= 0.0 {
        return vec3f(1.0, 0.0, 0.0);
    }
    let d3 = dot(ab, p - b);
    let d4 = dot(ac, p - b);
    if d3 >= 0.0 && d4 <= d3 {
        return vec3f(0.0, 1.0, 0.0);
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = share(d1, d1 - d3);
        return vec3f(1.0 - t, t, 0.0);
    }
    let d5 = dot(ab, p - c);
    let d6 = dot(ac, p - c);
    if d6 >= 0.0 && d5 <= d6 {
        return vec3f(0.0, 0.0, 1.0);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = share(d2, d2 - d6);
        return vec3f(1.0 - t, 0.0, t);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let t = share(d4 - d3, (d4 - d3) + (d5 - d6));
        return vec3f(0.0, 1.0 - t, t);
    }
    let sum = va + vb + vc;
    let v = share(vb, sum);
    let w = share(vc, sum);
    return vec3f(1.0 - v - w, v, w);
}

// True if the points of faces at a thing are the nearest ones.
fn takes_nearest(thing: u32) -> bool {
    let kind = u32(thing_number(thing));
    return (HAS_SPHERE && kind == SPHERE || HAS_CAPSULE && kind == CAPSULE) && thing_number(thing + 1u) > 0.0;
}

// The weights of a point within a face that is nearest to an end of the segment, on the side of that end;
// else zero.
fn weights_within(corners: array<vec3f, 3>, end: f32) -> vec3f {
    let weights = nearest_weights(corners[0], corners[1], corners[2], vec3f(0.0, 0.0, end));
    let height = dot(weights, vec3f(corners[0].z, corners[1].z, corners[2].z));
    return select(vec3f(0.0), weights, all(weights > vec3f(0.0)) && height * end >= 0.0);
}

// Returns the place on an edge, from 0 to 1, that is nearest to the segment. The first of three lies along
// the segment, the others are nearest to its ends. Zero if there is no such place.
fn part_of_edge(edge: vec3f, along: vec3f, half: f32, which: u32) -> f32 {
    let squared = dot(along, along);
    let across = dot(along.xy, along.xy);
    let beside = clamp(share(-dot(edge.xy, along.xy), across), 0.0, 1.0);
    let height = edge.z + along.z * beside;
    if which == 0u {
        return select(0.0, beside, across > 0.0 && abs(height) < half);
    }
    let end = select(half, -half, which == 1u);
    if across < ALONG * squared || height * end >= half * half {
        return share(end * along.z - dot(edge, along), squared);
    }
    return 0.0;
}

// Returns the weights of the corners at a point of a face, with the corners in the frame of the thing. The
// bits of `edges` are the edges that no face before this one has. Zero where there is no point.
fn nearest_point(thing: u32, point: u32, edges: u32, corners: array<vec3f, 3>) -> vec3f {
    var half = 0.0;
    if HAS_CAPSULE && u32(thing_number(thing)) == CAPSULE {
        half = 0.5 * thing_number(thing + 5u);
    }
    let ends = select(1u, 2u, half > 0.0);
    if point < ends {
        return weights_within(corners, select(half, -half, point + 1u < ends));
    }
    // Of a ball there is one point of an edge, that nearest to its centre.
    let points = select(1u, 3u, half > 0.0);
    let first = (point - ends) / points;
    let second = (first + 1u) % 3u;
    var weights = vec3f(0.0);
    if (edges >> first & 1u) == 1u {
        var places = corners;
        let along = places[second] - places[first];
        let which = select(2u, (point - ends) % points, points > 1u);
        let part = part_of_edge(places[first], along, half, which);
        if part > 0.0 && part < 1.0 {
            weights[first] = 1.0 - part;
            weights[second] = part;
        }
    }
    return weights;
}
