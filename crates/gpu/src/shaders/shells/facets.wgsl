// Forces and moments of a facet on its corners: `facet_packs` of pliant-shells, from displacements instead of
// positions, so that small strains keep their digits. With H = Σ u ⊗ ∇N in the axes at rest, C − I = H + Hᵀ +
// HᵀH gives U − I. The frame is the least rotation to the normal and the polar rotation in the plane.

// Of each node its displacement [m] and its rotation from rest.
@group(1) @binding(0) var<storage, read> places: array<vec4f>;
// The nodes of each facet.
@group(1) @binding(1) var<storage, read> corners: array<vec4u>;
// What facets have at rest, number by number: half of the stiffness, tension, gradients, corners, axes.
@group(1) @binding(2) var<storage, read> rest: array<f32>;
// Force and moment on each corner [N, N m].
@group(1) @binding(3) var<storage, read_write> forces: array<vec4f>;

const TENSION = 171u;
const GRADIENT = 189u;
const CORNER = 195u;
const AXES = 201u;

fn at_rest(entry: u32, facet: u32) -> f32 {
    return rest[entry * FACETS + facet];
}

fn three(entry: u32, facet: u32) -> vec3f {
    return vec3f(at_rest(entry, facet), at_rest(entry + 1u, facet), at_rest(entry + 2u, facet));
}

// Where a facet is, in its axes at rest.
struct Placed {
    axes: mat3x3f,
    // Displacements of the second and the third corner relative to the first.
    moved: array<vec3f, 2>,
    // Rotations of the nodes.
    rotation: array<vec4f, 3>,
}

// A rotation vector, and its η.
fn logarithm(rotation: vec4f) -> vec4f {
    var q = rotation * inverseSqrt(dot(rotation, rotation));
    if q.w < 0.0 {
        q = -q;
    }
    let sine = length(q.xyz);
    let cosine = q.w;
    // Halved until the series of the arc sine holds.
    var factor = 2.0;
    for (var k = 0u; k < 3u; k++) {
        if dot(q.xyz, q.xyz) >= 0.06 {
            q = vec4f(q.xyz, 1.0 + q.w) * inverseSqrt(2.0 + 2.0 * q.w);
            factor *= 2.0;
        }
    }
    let x = dot(q.xyz, q.xyz);
    let arc = 1.0 + x * (0.16666667 + x * (0.075 + x * (0.044642857 + x * (0.030381944 + x * (0.022372159 + x * 0.017352764)))));
    let theta = q.xyz * (factor * arc);
    let square = dot(theta, theta);
    var eta = 0.083333333 + square * (1.3888889e-3 + square * (3.3068783e-5 + square * (8.2671958e-7 + square * 2.0876757e-8)));
    if square >= 0.36 {
        eta = (1.0 - 0.5 * sqrt(square) * cosine / sine) / square;
    }
    return vec4f(theta, eta);
}

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let facet = number(group, groups, local);
    if facet >= FACETS || atomicLoad(&broken) <= instant.index {
        return;
    }
    let nodes = corners[facet];
    var placed: Placed;
    placed.axes = mat3x3f(three(AXES, facet), three(AXES + 3u, facet), three(AXES + 6u, facet));
    let origin = places[2u * nodes[0]].xyz;
    for (var i = 0u; i < 3u; i++) {
        let own = places[2u * nodes[i] + 1u];
        placed.rotation[i] = vec4f(own.xyz * placed.axes, own.w);
        if i > 0u {
            placed.moved[i - 1u] = (places[2u * nodes[i]].xyz - origin) * placed.axes;
        }
    }
    var gradient: array<vec2f, 3>;
    var corner: array<vec2f, 3>;
    for (var i = 0u; i < 3u; i++) {
        gradient[i] = vec2f(at_rest(GRADIENT + 2u * i, facet), at_rest(GRADIENT + 2u * i + 1u, facet));
        corner[i] = vec2f(at_rest(CORNER + 2u * i, facet), at_rest(CORNER + 2u * i + 1u, facet));
    }

    // U − I = (C − I + (1 + J − t) I)/t, t = tr U, J = det U = 1 + j.
    let h1 = placed.moved[0] * gradient[1].x + placed.moved[1] * gradient[2].x;
    let h2 = placed.moved[0] * gradient[1].y + placed.moved[1] * gradient[2].y;
    let c11 = 2.0 * h1.x + dot(h1, h1);
    let c22 = 2.0 * h2.y + dot(h2, h2);
    let c12 = h1.y + h2.x + dot(h1, h2);
    let square = 1.0 + (c11 + c22 + c11 * c22 - c12 * c12);
    // Written so that NaN is broken, too.
    var sound = square > 0.0 && square < 1e30;
    let j = (c11 + c22 + c11 * c22 - c12 * c12) / (1.0 + sqrt(max(square, 0.0)));
    let y = c11 + c22 + 2.0 * j;
    let trace = sqrt(max(4.0 + y, 1e-30));
    let shift = j - y / (2.0 + trace);
    let stretch = vec3f(c11 + shift, c22 + shift, c12) / trace;

    var f1 = vec3f(1.0 + h1.x, h1.y, h1.z);
    var f2 = vec3f(h2.x, 1.0 + h2.y, h2.z);
    var normal = vec3f(f1.y * f2.z - f1.z * f2.y, f1.z * f2.x - f1.x * f2.z, f1.x * f2.y - f1.y * f2.x);
    normal *= inverseSqrt(max(dot(normal, normal), 1e-30));
    // Beyond a right angle the least rotation is that from the opposite normal, after half a turn about the
    // first axis.
    let over = normal.z < 0.0;
    if over {
        f1 = vec3f(f1.x, -f1.yz);
        f2 = vec3f(f2.x, -f2.yz);
        normal = vec3f(normal.x, -normal.yz);
    }
    let k = 1.0 / (1.0 + normal.z);
    let p1 = vec3f(1.0 - normal.x * normal.x * k, -normal.x * normal.y * k, -normal.x);
    let p2 = vec3f(-normal.x * normal.y * k, 1.0 - normal.y * normal.y * k, -normal.y);
    var plane = vec2f(dot(p1, f1) + dot(p2, f2), dot(p2, f1) - dot(p1, f2));
    plane *= inverseSqrt(max(dot(plane, plane), 1e-30));
    var middle: vec2f;
    if plane.x >= 0.0 {
        let cosine = sqrt(0.5 + 0.5 * plane.x);
        middle = vec2f(cosine, 0.5 * plane.y / cosine);
    } else {
        let sine = select(-1.0, 1.0, plane.y >= 0.0) * sqrt(0.5 - 0.5 * plane.x);
        middle = vec2f(0.5 * plane.y / sine, sine);
    }
    var frame = vec4f(-normal.y, normal.x, 0.0, 1.0 + normal.z) * inverseSqrt(2.0 + 2.0 * normal.z);
    frame = product(frame, vec4f(0.0, 0.0, middle.y, middle.x));
    if over {
        frame = product(vec4f(1.0, 0.0, 0.0, 0.0), frame);
    }

    var d: array<f32, 18>;
    var turn: array<vec4f, 3>;
    var now: array<vec2f, 3>;
    for (var i = 0u; i < 3u; i++) {
        let own = corner[i];
        let moved = vec2f(stretch.x * own.x + stretch.z * own.y, stretch.z * own.x + stretch.y * own.y);
        now[i] = own + moved;
        turn[i] = logarithm(product(vec4f(-frame.xyz, frame.w), placed.rotation[i]));
        let theta = turn[i].xyz;
        sound = sound && length(theta.xy) < 2.0 && length(theta) < 3.0;
        d[6u * i] = moved.x;
        d[6u * i + 1u] = moved.y;
        d[6u * i + 3u] = theta.x;
        d[6u * i + 4u] = theta.y;
        d[6u * i + 5u] = theta.z;
    }
    if !sound {
        atomicMin(&broken, instant.index);
        return;
    }
    var raw: array<f32, 18>;
    for (var i = 0u; i < 18u; i++) {
        raw[i] = at_rest(TENSION + i, facet);
    }
    var entry = facet;
    for (var i = 0u; i < 18u; i++) {
        for (var j = 0u; j <= i; j++) {
            let stiffness = rest[entry];
            entry += FACETS;
            raw[i] += stiffness * d[j];
            if j < i {
                raw[j] += stiffness * d[i];
            }
        }
    }

    // Moments conjugate to spins: Hᵀ m. Forces lose what has a resultant.
    var force: array<vec3f, 3>;
    var moment: array<vec3f, 3>;
    var mean = vec3f();
    var whole = vec3f();
    for (var i = 0u; i < 3u; i++) {
        let f = vec3f(raw[6u * i], raw[6u * i + 1u], raw[6u * i + 2u]);
        let m = vec3f(raw[6u * i + 3u], raw[6u * i + 4u], raw[6u * i + 5u]);
        let across = cross(turn[i].xyz, m);
        force[i] = f;
        moment[i] = m + 0.5 * across + turn[i].w * cross(turn[i].xyz, across);
        mean += f / 3.0;
        whole += moment[i] + cross(vec3f(now[i], 0.0), f);
    }
    let a = now[1] - now[0];
    let b = now[2] - now[0];
    let double_area = a.x * b.y - a.y * b.x;
    for (var i = 0u; i < 3u; i++) {
        let side = (now[(i + 2u) % 3u] - now[(i + 1u) % 3u]) / double_area;
        let own = gradient[i] / trace;
        let lean = vec3f(-own.y * whole.z, own.x * whole.z, side.x * whole.x + side.y * whole.y);
        let at = 2u * (3u * facet + i);
        forces[at] = vec4f(placed.axes * turned(frame, force[i] - mean - lean), 0.0);
        forces[at + 1u] = vec4f(placed.axes * turned(frame, moment[i]), 0.0);
    }
    press(facet, placed, corner);
}
