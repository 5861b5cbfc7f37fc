// Pressure on a facet: a third of p A n to each corner, and `Patch::pressure_forces` on the curved triangle.

// Where the pressures of each facet begin; of each its load, and the pressure [Pa] on the flat and on the
// curved triangle.
@group(2) @binding(0) var<storage, read> starts: array<u32>;
@group(2) @binding(1) var<storage, read> pressures: array<vec4f>;
// Of each corner its normal at rest in the axes of the facet, and which of its two control points are on
// straight edges.
@group(2) @binding(2) var<storage, read> normals: array<vec4f>;
// Weights of the products of control points.
@group(2) @binding(3) var<storage, read> weights: array<f32>;
// Force and moment of pressure on each corner.
@group(2) @binding(4) var<storage, read_write> given: array<vec4f>;

// g(c) and its derivative, of an edge that becomes an arc.
fn reach(c: f32) -> vec2f {
    if c < 0.1 {
        return vec2f(6.0606061, 0.0);
    }
    let below = c * (1.0 + c);
    return vec2f(2.0 / (3.0 * below), -2.0 * (1.0 + 2.0 * c) / (3.0 * below * below));
}

fn press(facet: u32, placed: Placed, corner: array<vec2f, 3>) {
    var flat = 0.0;
    var curved = 0.0;
    for (var k = starts[facet]; k < starts[facet + 1u]; k++) {
        let own = pressures[k];
        let factor = table[instant.row + bitcast<u32>(own.x)];
        // A load of any size does nothing while its factor is zero.
        if factor != 0.0 {
            flat += factor * own.y;
            curved += factor * own.z;
        }
    }
    var points: array<vec3f, 9>;
    var force: array<vec3f, 3>;
    var moment: array<vec3f, 3>;
    let mean = (placed.moved[0] + placed.moved[1]) / 3.0;
    points[0] = vec3f(corner[0], 0.0) - mean;
    points[1] = vec3f(corner[1], 0.0) + placed.moved[0] - mean;
    points[2] = vec3f(corner[2], 0.0) + placed.moved[1] - mean;
    let lumped = cross(points[1] - points[0], points[2] - points[0]) * (flat / 6.0);
    for (var i = 0u; i < 3u; i++) {
        force[i] = lumped;
    }
    if curved != 0.0 {
        add_curved(facet, curved, placed.rotation, &points, &force, &moment);
    }
    for (var i = 0u; i < 3u; i++) {
        let at = 2u * (3u * facet + i);
        given[at] = vec4f(placed.axes * force[i], 0.0);
        given[at + 1u] = vec4f(placed.axes * moment[i], 0.0);
    }
}

fn add_curved(
    facet: u32,
    pressure: f32,
    rotation: array<vec4f, 3>,
    points: ptr<function, array<vec3f, 9>>,
    force: ptr<function, array<vec3f, 3>>,
    moment: ptr<function, array<vec3f, 3>>,
) {
    var starting = array<u32, 6>(0u, 1u, 1u, 2u, 2u, 0u);
    var ending = array<u32, 6>(1u, 0u, 2u, 1u, 0u, 2u);
    var turns = rotation;
    var normal: array<vec3f, 3>;
    for (var i = 0u; i < 3u; i++) {
        normal[i] = turned(turns[i], normals[3u * facet + i].xyz);
    }
    let straight = bitcast<u32>(normals[3u * facet].w);
    for (var k = 0u; k < 6u; k++) {
        let start = (*points)[starting[k]];
        let e = (*points)[ending[k]] - start;
        let n = normal[starting[k]];
        let t = e - dot(e, n) * n;
        let along = select(reach(length(t) / length(e)).x * t, e / 3.0, (straight >> k & 1u) == 1u);
        (*points)[3u + k] = start + along;
    }
    var control: array<vec3f, 9>;
    var pair = 0u;
    for (var b = 0u; b < 9u; b++) {
        for (var c = b + 1u; c < 9u; c++) {
            let both = cross((*points)[b], (*points)[c]);
            for (var a = 0u; a < 9u; a++) {
                control[a] += both * weights[pair];
                pair += 1u;
            }
        }
    }
    for (var i = 0u; i < 3u; i++) {
        (*force)[i] += pressure * control[i];
    }
    for (var k = 0u; k < 6u; k++) {
        let f = control[3u + k];
        let e = (*points)[ending[k]] - (*points)[starting[k]];
        let n = normal[starting[k]];
        var by_e = f / 3.0;
        var by_n = vec3f();
        if (straight >> k & 1u) == 0u {
            let s = dot(e, n);
            let up = dot(f, n);
            let t = e - s * n;
            let size = length(t);
            let whole = length(e);
            let c = size / whole;
            let g = reach(c);
            by_e = g.x * (f - up * n);
            by_n = -g.x * (up * e + s * f);
            if g.y != 0.0 {
                let pull = g.y * dot(t, f);
                by_e += pull * (t / (size * whole) - e * (c / (whole * whole)));
                by_n -= t * (pull * s / (size * whole));
            }
        }
        (*force)[starting[k]] += pressure * (f - by_e);
        (*force)[ending[k]] += pressure * by_e;
        (*moment)[starting[k]] += pressure * cross(n, by_n);
    }
}
