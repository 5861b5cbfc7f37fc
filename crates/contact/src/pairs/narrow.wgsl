// Places of points relative to triangles, and crossings of edges; twin of narrow.rs and of `Pairs::find`. The
// module around it gives: `between(a, b)`, the way [m] from node b to node a before the step; `ring_of(k)`,
// the other corners, in order, of a triangle around a node, for every second k; `corners_of(row)`, the
// triangle of a candidate; `at_border(row, corners)`, true if all the given corners of the triangle are at
// borders; `take_pair(row, nodes, weights, normal, distance)`, which notes a pair in the place of its
// candidate; `leave_pair(row)`, which notes that there is no pair; and exact.wgsl.
//
// Places are ways from one of the nodes, so that single precision keeps the digits of gaps.

// Round-off of a distance, over the lengths that it comes from.
const ROUNDING = 1e-6;
// Relative difference up to which distances are the same.
const SAME = 1e-5;

const NO_ROW = 0xffffffffu;
const FAR = 1e30;

// The origin and a triangle.
struct Above {
    normal: vec3f,
    // Height over the plane [m].
    height: f32,
    // Weights of the point beneath, or of the closest point of the triangle if the point is far beside the
    // triangle.
    weights: vec3f,
    // The way from there [m].
    way: vec3f,
    // True if the origin is above or beneath the triangle.
    is_inner: bool,
}

fn unit(v: vec3f) -> vec3f {
    let size = norm(v);
    return select(vec3f(0.0), v / max(size, 1e-37), size > 0.0);
}

// How far along an edge the point next to the origin is, from 0 to 1.
fn along_edge(a: vec3f, b: vec3f) -> f32 {
    let way = b - a;
    let squared = dot(way, way);
    return select(0.0, clamp(-dot(a, way) / max(squared, 1e-37), 0.0, 1.0), squared > 0.0);
}

// The weights of the point of the border of a triangle that is next to the origin.
fn closest_of_border(a: vec3f, b: vec3f, c: vec3f) -> vec3f {
    let along = vec3f(along_edge(a, b), along_edge(b, c), along_edge(c, a));
    let from_ab = norm(mix(a, b, along.x));
    let from_bc = norm(mix(b, c, along.y));
    let from_ca = norm(mix(c, a, along.z));
    if from_ab <= from_bc && from_ab <= from_ca {
        return vec3f(1.0 - along.x, along.x, 0.0);
    }
    if from_bc <= from_ca {
        return vec3f(0.0, 1.0 - along.y, along.y);
    }
    return vec3f(along.z, 0.0, 1.0 - along.z);
}

// Finds the place of the origin relative to a triangle. Points beside the triangle by up to `beside` of its
// height count as inner ones.
fn above(a: vec3f, b: vec3f, c: vec3f, beside: f32) -> Above {
    let area = cross(b - a, c - a);
    let normal = unit(area);
    let height = -dot(normal, a);
    let parts = vec3f(dot(area, cross(b, c)), dot(area, cross(c, a)), dot(area, cross(a, b)));
    let squared = dot(area, area);
    let weights = parts / max(squared, 1e-37);
    if squared > 0.0 && all(weights >= vec3f(-beside)) {
        return Above(normal, height, weights, normal * height, true);
    }
    let closest = closest_of_border(a, b, c);
    return Above(normal, height, closest, -(closest.x * a + closest.y * b + closest.z * c), false);
}

// True if the origin counts as inner though it is a little beside the triangle.
fn is_beside(here: Above) -> bool {
    return here.is_inner && any(here.weights < vec3f(0.0));
}

// The outward normal of a node, from the triangles around it, from one to another.
fn node_outward(node: u32, first: u32, end: u32) -> vec3f {
    var area = vec3f(0.0);
    for (var k = first; k < end; k += 2u) {
        let others = ring_of(k);
        area += cross(between(others.x, node), between(others.y, node));
    }
    return unit(area);
}

// Finds the contacts of a node among the triangles of its candidates, from one row to another. `ring` is the
// range of the triangles around the node. No contact is farther than `within` [m]. `reach` and `depth` [m]
// are the values of the lists.
fn find_above(node: u32, ring: vec2u, first: u32, end: u32, within: f32, reach: f32, depth: f32) {
    var outward = vec3f(0.0);
    var is_oriented = false;
    var nearest = FAR;
    var nearest_row = NO_ROW;
    var nearest_way = vec3f(0.0);
    var nearest_normals = vec3f(0.0);
    var nearest_weights = vec3f(0.0);
    var beneath_row = NO_ROW;
    var beneath = -FAR;
    var beneath_normal = vec3f(0.0);
    var beneath_weights = vec3f(0.0);
    var over = FAR;
    var hidden = FAR;
    var faces = false;
    for (var row = first; row < end; row++) {
        leave_pair(row);
        let corners = corners_of(row);
        let a = between(corners.x, node);
        let b = between(corners.y, node);
        let c = between(corners.z, node);
        if any(min(min(a, b), c) > vec3f(within)) || any(max(max(a, b), c) < vec3f(-within)) {
            continue;
        }
        var here = above(a, b, c, BESIDE);
        if abs(here.height) > within {
            continue;
        }
        if !is_oriented {
            outward = node_outward(node, ring.x, ring.y);
            is_oriented = true;
        }
        if is_beside(here) && dot(here.normal, outward) > -FACING {
            here = above(a, b, c, 0.0);
        }
        let faces_away = dot(here.normal, outward) > FACING;
        if here.is_inner {
            if faces_away {
                hidden = min(hidden, abs(here.height));
            } else if here.height >= -ON * depth {
                over = min(over, here.height);
                take_pair(row, vec4u(node, corners), vec4f(1.0, -here.weights), here.normal, here.height);
            } else if beneath < here.height {
                beneath_row = row;
                beneath = here.height;
                beneath_normal = here.normal;
                beneath_weights = here.weights;
            }
            continue;
        }
        let distance = norm(here.way);
        let same = SAME * nearest + ROUNDING * reach;
        if nearest == FAR || distance < nearest - same {
            nearest = distance;
            nearest_row = row;
            nearest_way = here.way;
            nearest_normals = here.normal;
            nearest_weights = here.weights;
            faces = !faces_away;
        } else if distance <= nearest + same {
            nearest_normals += here.normal;
            faces = faces || !faces_away;
        }
    }
    if faces && nearest < min(over, hidden) * (1.0 - SAME) - ROUNDING * reach {
        // A node in the plane of a triangle, but outside the triangle, is not beneath it.
        let least = (SAME * nearest + ROUNDING * reach) * norm(nearest_normals);
        let is_behind = dot(nearest_way, nearest_normals) < -least;
        // A node behind a border is beside the surface.
        if !(is_behind && at_border(nearest_row, nearest_weights != vec3f(0.0))) {
            let sign = select(1.0, -1.0, is_behind);
            let normal = select(unit(nearest_normals), sign * unit(nearest_way), nearest > ON * depth);
            let distance = sign * nearest;
            if distance >= -ON * depth {
                over = distance;
                let corners = corners_of(nearest_row);
                take_pair(nearest_row, vec4u(node, corners), vec4f(1.0, -nearest_weights), normal, distance);
            } else if beneath < distance {
                beneath_row = nearest_row;
                beneath = distance;
                beneath_normal = normal;
                beneath_weights = nearest_weights;
            }
        }
    }
    if beneath_row == NO_ROW {
        return;
    }
    // A node inside leaves by the shortest way.
    let leaves_elsewhere = -beneath > hidden && -beneath > SLIGHT * depth;
    if leaves_elsewhere || -beneath < over {
        for (var row = first; row < end; row++) {
            leave_pair(row);
        }
    }
    if !leaves_elsewhere && -beneath < over {
        let nodes = vec4u(node, corners_of(beneath_row));
        take_pair(beneath_row, nodes, vec4f(1.0, -beneath_weights), beneath_normal, beneath);
    }
}

// True if a way leads along a normal, or hardly against it.
fn is_before(normal: vec3f, way: vec3f) -> bool {
    return dot(normal, way) >= -FLAT * norm(way);
}

// Finds where two edges from a to b and from c to d touch from outside, with the nodes across them of their
// triangles.
fn find_crossing(row: u32, nodes: vec4u, across: vec4u) {
    leave_pair(row);
    // From the first end of each.
    let along = between(nodes.y, nodes.x);
    let other = between(nodes.w, nodes.z);
    let apart = between(nodes.x, nodes.z);
    let area = cross(along, other);
    let crossed = dot(area, area);
    let squares = vec2f(dot(along, along), dot(other, other));
    // Edges that are nearly parallel touch at their ends.
    if crossed <= PARALLEL * squares.x * squares.y {
        return;
    }
    let weights = vec2f(dot(cross(other, apart), area), dot(cross(along, apart), area)) / crossed;
    if any(weights < vec2f(0.0)) || any(weights > vec2f(1.0)) {
        return;
    }
    let of_first = array<vec3f, 2>(between(across.x, nodes.x), between(across.y, nodes.x));
    let of_second = array<vec3f, 2>(between(across.z, nodes.z), between(across.w, nodes.z));
    let outward = edge_outward(other, of_second[0], of_second[1], across.z == across.w);
    var normal = area / root(crossed);
    if dot(normal, outward) < 0.0 {
        normal = -normal;
    }
    if dot(normal, edge_outward(along, of_first[0], of_first[1], across.x == across.y)) >= 0.0 {
        return;
    }
    for (var k = 0u; k < 2u; k++) {
        if !is_before(-normal, of_second[k]) || !is_before(normal, of_first[k]) {
            return;
        }
    }
    let distance = dot(normal, apart);
    // An overlap may exceed the length by which one edge continues past the crossing. The edges then separate
    // past its end.
    let ends = min(weights, vec2f(1.0) - weights) * vec2f(root(squares.x), root(squares.y));
    if distance > -min(ends.x, ends.y) {
        take_pair(row, nodes, vec4f(1.0 - weights.x, weights.x, weights.y - 1.0, -weights.y), normal, distance);
    }
}

// Returns the sum of the outward normals of the triangles of an edge. The arguments are the ways from its
// first end to its other end and to the opposite nodes.
fn edge_outward(along: vec3f, left: vec3f, right: vec3f, is_border: bool) -> vec3f {
    return unit(cross(along, left)) + select(unit(cross(along, -right)), vec3f(0.0), is_border);
}
