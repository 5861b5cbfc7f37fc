// Rigid shapes with their signed distance; twin of shape.rs and grid.rs. The module around it gives
// `thing_number`, and shader.rs the kinds and exact.wgsl.

// What a shape is at a point: its distance [m], negative inside, and the direction in which the distance
// grows.
struct Near {
    distance: f32,
    normal: vec3f,
}

fn thing_vector(at: u32) -> vec3f {
    return vec3f(thing_number(at), thing_number(at + 1u), thing_number(at + 2u));
}

// A ball of a radius, from its centre.
fn around(from_centre: vec3f, radius: f32) -> Near {
    let distance = norm(from_centre);
    var normal = vec3f(1.0, 0.0, 0.0);
    if distance > 0.0 {
        normal = from_centre / distance;
    }
    return Near(distance - radius, normal);
}

// A cylinder along z, of half its length.
fn cylinder(point: vec3f, radius: f32, half: f32) -> Near {
    let q = flat_norm(point.xy);
    var radial = vec2f(1.0, 0.0);
    if q > 0.0 {
        radial = point.xy / q;
    }
    let up = select(1.0, -1.0, point.z < 0.0);
    let beyond = vec2f(q - radius, abs(point.z) - half);
    let outside = max(beyond, vec2f(0.0));
    var distance = flat_norm(outside);
    var flat = vec2f(0.0, 1.0);
    if distance > 0.0 {
        flat = outside / distance;
    } else {
        distance = max(beyond.x, beyond.y);
        flat = select(flat, vec2f(1.0, 0.0), beyond.x > beyond.y);
    }
    return Near(distance, vec3f(radial * flat.x, up * flat.y));
}

fn cuboid(point: vec3f, half: vec3f) -> Near {
    let beyond = abs(point) - half;
    let outside = max(beyond, vec3f(0.0));
    let distance = norm(outside);
    let signs = select(vec3f(1.0), vec3f(-1.0), point < vec3f(0.0));
    if distance > 0.0 {
        return Near(distance, outside * signs / distance);
    }
    if beyond.x >= beyond.y && beyond.x >= beyond.z {
        return Near(beyond.x, vec3f(signs.x, 0.0, 0.0));
    }
    if beyond.y >= beyond.z {
        return Near(beyond.y, vec3f(0.0, signs.y, 0.0));
    }
    return Near(beyond.z, vec3f(0.0, 0.0, signs.z));
}

// In the half-plane of the distance from the axis and the height, the nearest point of the base or of the
// slope.
fn cone(point: vec3f, radius: f32, height: f32) -> Near {
    let q = vec2f(flat_norm(point.xy), point.z);
    let rim = vec2f(radius, 0.0);
    let slope = vec2f(-radius, height);
    let on_base = vec2f(min(q.x, radius), 0.0);
    let on_slope = rim + slope * clamp(dot(q - rim, slope) / dot(slope, slope), 0.0, 1.0);
    let is_inside = q.y > 0.0 && q.x / radius + q.y / height < 1.0;
    let is_at_base = flat_norm(q - on_base) < flat_norm(q - on_slope);
    let away = q - select(on_slope, on_base, is_at_base);
    let distance = flat_norm(away);
    let sign = select(1.0, -1.0, is_inside);
    // On the surface: across the slope or down.
    var flat = select(vec2f(height, radius) / flat_norm(vec2f(height, radius)), vec2f(0.0, -1.0), is_at_base || all(on_slope == rim));
    if distance > 0.0 {
        flat = away * (sign / distance);
    }
    var radial = vec2f(1.0, 0.0);
    if q.x > 0.0 {
        radial = point.xy / q.x;
    }
    return Near(sign * distance, vec3f(radial * flat.x, flat.y));
}

// Linear in between the points of a grid; beyond it the distance to the point of the surface that is nearest
// to its rim.
fn sampled(at: u32, point: vec3f) -> Near {
    let origin = thing_vector(at + 4u);
    let spacing = thing_number(at + 7u);
    let per_metre = thing_number(at + 8u);
    let counts = vec3u(thing_vector(at + 9u));
    let values = bitcast<u32>(thing_number(at + 12u));
    let along = (point - origin) * per_metre;
    let inner = clamp(along, vec3f(0.0), vec3f(counts - vec3u(1u)));
    let cell = min(vec3u(inner), counts - vec3u(2u));
    let part = inner - vec3f(cell);
    let first = values + (cell.z * counts.y + cell.y) * counts.x + cell.x;
    // The four edges along x, then the two lines between them along y.
    let starts = vec4u(0u, counts.x, counts.x * counts.y, counts.x * counts.y + counts.x) + vec4u(first);
    var lows = vec4f(0.0);
    var highs = vec4f(0.0);
    for (var k = 0u; k < 4u; k++) {
        lows[k] = thing_number(starts[k]);
        highs[k] = thing_number(starts[k] + 1u);
    }
    let rises = highs - lows;
    let edges = lows + rises * part.x;
    let lines = edges.xz + (edges.yw - edges.xz) * part.y;
    let rise = rises.xz + (rises.yw - rises.xz) * part.y;
    let across = edges.yw - edges.xz;
    let slope = vec3f(
        rise.x + (rise.y - rise.x) * part.z, across.x + (across.y - across.x) * part.z, lines.y - lines.x,
    );
    var distance = lines.x + (lines.y - lines.x) * part.z;
    // Times the spacing.
    let steepness = norm(slope);
    var normal = vec3f(0.0, 0.0, 1.0);
    if steepness > 0.0 {
        normal = slope / steepness;
    }
    // Chords make the function flatter than a distance: within a step of the surface, about where its tangent
    // reaches zero.
    let close = max(1.0 - abs(distance) * per_metre, 0.0);
    let missing = clamp(1.0 - steepness * per_metre, 0.0, FLATTEST);
    distance += distance * close * missing * (1.0 + missing);
    if all(inner == along) {
        return Near(distance, normal);
    }
    let beyond = (along - inner) * spacing;
    if distance <= 0.0 {
        // Beyond the grid the shape continues as a plane.
        return Near(distance + dot(normal, beyond), normal);
    }
    let from_surface = beyond + normal * distance;
    let far = norm(from_surface);
    return Near(far, select(normal, from_surface / far, far > 0.0));
}

// The distance of a point [m] of its frame from a shape, whose numbers begin at a place, and the direction
// away from it. Kinds that no thing has are left out, for devices that run all branches.
fn shape_near(at: u32, point: vec3f) -> Near {
    let kind = u32(thing_number(at));
    let a = thing_number(at + 4u);
    let b = thing_number(at + 5u);
    if HAS_SPHERE && kind == SPHERE {
        return around(point, a);
    }
    if HAS_CAPSULE && kind == CAPSULE {
        return around(point - vec3f(0.0, 0.0, clamp(point.z, -0.5 * b, 0.5 * b)), a);
    }
    if HAS_CYLINDER && kind == CYLINDER {
        return cylinder(point, a, 0.5 * b);
    }
    if HAS_CUBOID && kind == CUBOID {
        return cuboid(point, 0.5 * thing_vector(at + 4u));
    }
    if HAS_CONE && kind == CONE {
        return cone(point, a, b);
    }
    if HAS_GRID && kind == GRID {
        return sampled(at, point);
    }
    return Near(point.z, vec3f(0.0, 0.0, 1.0));
}
