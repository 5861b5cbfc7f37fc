// Surfaces by vertex pulling. Only the buffer of the points changes from frame to frame.

struct View {
    projection_view: mat4x4<f32>,
    // Unit vectors of the camera; `eye.w` is 1 in perspective, else the eye is infinitely far along
    // `towards`.
    right: vec4<f32>,
    up: vec4<f32>,
    towards: vec4<f32>,
    eye: vec4<f32>,
    // Everything on the side of the normal is cut away.
    plane: vec4<f32>,
    // First value, 1 / span; 1 for colours of values, 2 for colours of labels; whether colours are coded as
    // sRGB here.
    range: vec4<f32>,
    plain: vec4<f32>,
    // Of a point without a value among others that have one.
    missing: vec4<f32>,
    ghost: vec4<f32>,
    top: vec4<f32>,
    bottom: vec4<f32>,
    // Strength of the edges.
    edge: vec4<f32>,
    // Widths of the picture a height; half the width of fibres and of marks over the height; how far lines
    // are lifted [m].
    line: vec4<f32>,
    // Of the texture: 1 / size of the body [1/m], strength.
    skin: vec4<f32>,
    // Strength, reach [m], pixels of the map that the reach has at the eye's unit of distance, depth of the
    // target over the reach.
    occlusion: vec4<f32>,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> colours: array<vec4<f32>, 256>;
// Data of each kind of cells. `light` is the light of its colour (−1 for the colour of the value, −2 for
// tissue) and the opacity. `finish` is the strength and the exponent of the highlight, and the variation of
// the colour.
struct Kind {
    light: vec4<f32>,
    finish: vec4<f32>,
}

@group(0) @binding(2) var<storage, read> kinds: array<Kind>;

// Position [m] and value of each point.
@group(1) @binding(0) var<storage, read> points: array<vec4<f32>>;
// Three vertices, and a word of bits. Bits 0 to 2: these edges are drawn. Bit 3: the triangle is of a
// section. Bit 4: it is of an obstacle or tool. Bit 5: the obstacle or tool holds bodies inside. Bits 8 to
// 31: number of the kind.
@group(1) @binding(1) var<storage, read> triangles: array<vec4<u32>>;
// The point of each vertex.
@group(1) @binding(2) var<storage, read> vertices: array<u32>;
// Normal of each vertex.
@group(1) @binding(3) var<storage, read> normals: array<vec4<f32>>;

// Position at rest [m] of each point.
@group(1) @binding(6) var<storage, read> rest: array<vec4<f32>>;

struct Corner {
    @builtin(position) clip: vec4<f32>,
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) value: f32,
    @location(3) corner: vec3<f32>,
    @location(4) @interpolate(flat) edges: u32,
    // At rest, over the size of the body.
    @location(5) rest: vec3<f32>,
    // The position within the triangle, also where the middle of a pixel is not: there the other one lies
    // beyond it, on outlines far.
    @location(6) @interpolate(perspective, centroid) place: vec3<f32>,
}

@vertex
fn surface(@builtin(vertex_index) index: u32) -> Corner {
    let triangle = triangles[index / 3u];
    let vertex = triangle[index % 3u];
    let node = vertices[vertex];
    return corner_at(points[node], normals[vertex].xyz, index, triangle.w, rest[node].xyz);
}

// Moves the shape at rest a little away from the eye: the body hides it where both have the same position.
@vertex
fn resting(@builtin(vertex_index) index: u32) -> Corner {
    let triangle = triangles[index / 3u];
    let vertex = triangle[index % 3u];
    let node = vertices[vertex];
    var result = corner_at(points[node], normals[vertex].xyz, index, triangle.w, rest[node].xyz);
    let away = result.position - towards_eye(result.position) * 2.0 * view.line.w;
    let clip = view.projection_view * vec4(away, 1.0);
    result.clip.z = clip.z / clip.w * result.clip.w;
    return result;
}

struct Cut {
    point: vec4<f32>,
    rest: vec3<f32>,
    // As of triangles.
    edges: u32,
}

// Corners of a section, one after the other.
@group(1) @binding(4) var<storage, read> corners: array<Cut>;

@vertex
fn section(@builtin(vertex_index) index: u32) -> Corner {
    let cut = corners[index];
    return corner_at(cut.point, view.plane.xyz, index, cut.edges | 8u, cut.rest);
}

fn corner_at(point: vec4<f32>, normal: vec3<f32>, index: u32, edges: u32, rest: vec3<f32>) -> Corner {
    var result: Corner;
    result.clip = view.projection_view * vec4(point.xyz, 1.0);
    result.position = point.xyz;
    result.place = point.xyz;
    result.normal = normal;
    result.value = point.w;
    let own = index % 3u;
    result.corner = vec3(select(0.0, 1.0, own == 0u), select(0.0, 1.0, own == 1u), select(0.0, 1.0, own == 2u));
    result.edges = edges;
    result.rest = rest * view.skin.x;
    return result;
}

fn towards_eye(position: vec3<f32>) -> vec3<f32> {
    return select(view.towards.xyz, normalize(view.eye.xyz - position), view.eye.w > 0.5);
}

// Light of the value: a colour of the map, or tissue if nothing has a value.
fn colour_of(value: f32) -> vec3<f32> {
    if view.range.z < 0.5 {
        return view.plain.rgb;
    }
    if value > 1.0e30 {
        return view.missing.rgb;
    }
    let part = clamp((value - view.range.x) * view.range.y, 0.0, 1.0) * 255.0;
    let low = u32(floor(part));
    let high = min(low + 1u, 255u);
    return mix(colours[low].rgb, colours[high].rgb, part - f32(low));
}

fn is_thing(at: Corner) -> bool {
    return (at.edges & 16u) != 0u;
}

fn is_cut(at: Corner) -> bool {
    return (at.edges & 8u) != 0u;
}

// The normal on the visible side. Near outlines the smooth normal of a visible face may point away from the
// eye. Such a normal is turned only as far as the outline. Turned around, it would light the face differently
// from its neighbours.
fn seen_normal(at: Corner, front: bool, eye: vec3<f32>) -> vec3<f32> {
    let own = normalize(at.normal);
    let is_front = select(front, dot(own, eye) >= 0.0, is_cut(at));
    let normal = select(-own, own, is_front);
    return normalize(normal - min(dot(normal, eye) - 1.0e-3, 0.0) * eye);
}

// Things are drawn from outside, so that a half-space is transparent from its back. Things that hold bodies
// are drawn from inside. The margin keeps outlines of round things whole.
fn is_behind(at: Corner) -> bool {
    let facing = dot(normalize(at.normal), towards_eye(at.position));
    return is_thing(at) && select((facing < -0.2), (facing > 0.0), (at.edges & 32u) != 0u);
}

// Whether it has the colour of tissue: by itself, or because there are no values.
fn is_tissue(at: Corner) -> bool {
    let light = kinds[at.edges >> 8u].light.r;
    return light < -1.5 || (light < -0.5 && view.range.z < 0.5);
}

fn no_colour(at: Corner) -> bool {
    return is_tissue(at) || (kinds[at.edges >> 8u].light.r < 0.0 && at.value > 1.0e30);
}

// Light of the fixed colour, or else of the value.
fn colour_at(at: Corner) -> vec3<f32> {
    let own = kinds[at.edges >> 8u].light.rgb;
    if own.r >= 0.0 {
        return own;
    }
    return select(colour_of(at.value), view.plain.rgb, is_tissue(at));
}

// Thin glass is thicker when it is seen from the side.
fn opacity_at(at: Corner, facing: f32) -> f32 {
    let own = kinds[at.edges >> 8u].light.a;
    let grazing = 1.0 - facing;
    return mix(own, sqrt(own), grazing * grazing);
}

// A key light over the left shoulder, a fill from the right, sky above and ground below (all of them turn
// with the camera).
fn lit(albedo: vec3<f32>, normal: vec3<f32>, eye: vec3<f32>, finish: vec2<f32>, light: f32) -> vec3<f32> {
    let key = normalize(view.right.xyz * -0.45 + view.up.xyz * 0.65 + view.towards.xyz * 0.75);
    let fill = normalize(view.right.xyz * 0.8 + view.up.xyz * 0.05 + view.towards.xyz * 0.5);
    let sky = 0.5 + 0.5 * dot(normal, view.up.xyz);
    // Both lights have a size, the fill a large one: folds receive less of each.
    let direct = max(dot(normal, key), 0.0) * 0.62 * (0.5 + 0.5 * light) + max(dot(normal, fill), 0.0) * 0.16 * light;
    let ambient = mix(0.22, 0.40, sky) * light;
    let half_way = normalize(key + eye);
    let shine = pow(max(dot(normal, half_way), 0.0), finish.y) * finish.x;
    let grazing = 1.0 - max(dot(normal, eye), 0.0);
    let outline = 1.0 - 0.35 * grazing * grazing * grazing;
    return (albedo * (ambient + direct) + vec3(shine)) * outline;
}

// Cover of the edges of cells.
fn edge_cover(corner: vec3<f32>, edges: u32) -> f32 {
    // Distance to each edge in pixels; edges that are not drawn are far away.
    let width = fwidth(corner);
    var distance = corner / max(width, vec3(1.0e-6));
    distance += vec3(
        select(1.0e3, 0.0, (edges & 1u) != 0u),
        select(1.0e3, 0.0, (edges & 2u) != 0u),
        select(1.0e3, 0.0, (edges & 4u) != 0u),
    );
    let nearest = min(distance.x, min(distance.y, distance.z));
    // Where edges are closer than pixels they would cover everything.
    let dense = clamp(1.6 - 2.0 * max(width.x, max(width.y, width.z)), 0.0, 1.0);
    return (1.0 - smoothstep(0.35, 1.15, nearest)) * dense;
}

fn coded(colour: vec3<f32>) -> vec3<f32> {
    let bounded = clamp(colour, vec3(0.0), vec3(1.0));
    let low = bounded * 12.92;
    let high = 1.055 * pow(bounded, vec3(1.0 / 2.4)) - 0.055;
    let coded = select(high, low, bounded <= vec3(0.0031308));
    return select(bounded, coded, view.range.w > 0.5);
}

fn shade(at: Corner, front: bool) -> vec4<f32> {
    let eye = towards_eye(at.position);
    let normal = seen_normal(at, front, eye);
    let albedo = colour_at(at);
    let finish = kinds[at.edges >> 8u].finish;
    let light = light_at(at.place);
    var colour = lit(albedo, normal, eye, finish.xy, light);
    // Derivatives over pixels are taken where all pixels pass.
    let bumpy = uneven(at, normal);
    if view.skin.y > 0.0 && !is_thing(at) {
        colour = moist(albedo * mottled(at.rest, is_tissue(at), finish.z), bumpy, eye, finish.xy, light);
    }
    // Colours of values and labels in a section match the legend, whatever light falls on it.
    if is_cut(at) && view.range.z > 0.5 && !is_tissue(at) {
        colour = albedo;
    }
    let edges = edge_cover(at.corner, at.edges) * view.edge.a;
    return vec4(coded(mix(colour, view.edge.rgb, edges)), opacity_at(at, dot(normal, eye)));
}

// Random unit-ish vector of a lattice point (PCG hash: Jarzynski and Olano 2020).
fn random(cell: vec3<i32>) -> vec3<f32> {
    var v = bitcast<vec3<u32>>(cell) * 1664525u + 1013904223u;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v ^= v >> vec3(16u);
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    return vec3<f32>(v >> vec3(8u)) * (2.0 / 16777215.0) - 1.0;
}

// Gradient noise of about −1 to 1 (Perlin 2002): its gradient and its value.
fn noise(place: vec3<f32>) -> vec4<f32> {
    let cell = floor(place);
    let w = place - cell;
    let u = w * w * w * (w * (w * 6.0 - 15.0) + 10.0);
    let du = 30.0 * w * w * (w * (w - 2.0) + 1.0);
    let i = vec3<i32>(cell);
    let ga = random(i);
    let gb = random(i + vec3(1, 0, 0));
    let gc = random(i + vec3(0, 1, 0));
    let gd = random(i + vec3(1, 1, 0));
    let ge = random(i + vec3(0, 0, 1));
    let gf = random(i + vec3(1, 0, 1));
    let gg = random(i + vec3(0, 1, 1));
    let gh = random(i + vec3(1, 1, 1));
    let va = dot(ga, w);
    let vb = dot(gb, w - vec3(1.0, 0.0, 0.0));
    let vc = dot(gc, w - vec3(0.0, 1.0, 0.0));
    let vd = dot(gd, w - vec3(1.0, 1.0, 0.0));
    let ve = dot(ge, w - vec3(0.0, 0.0, 1.0));
    let vf = dot(gf, w - vec3(1.0, 0.0, 1.0));
    let vg = dot(gg, w - vec3(0.0, 1.0, 1.0));
    let vh = dot(gh, w - vec3(1.0, 1.0, 1.0));
    let k = vec3(vb - va, vc - va, ve - va);
    let kxy = va - vb - vc + vd;
    let kyz = va - vc - ve + vg;
    let kzx = va - vb - ve + vf;
    let kxyz = -va + vb + vc - vd + ve - vf - vg + vh;
    let value = va + dot(u, k) + u.x * u.y * kxy + u.y * u.z * kyz + u.z * u.x * kzx + u.x * u.y * u.z * kxyz;
    let slope = ga + u.x * (gb - ga) + u.y * (gc - ga) + u.z * (ge - ga)
        + u.x * u.y * (ga - gb - gc + gd) + u.y * u.z * (ga - gc - ge + gg) + u.z * u.x * (ga - gb - ge + gf)
        + u.x * u.y * u.z * (-ga + gb + gc - gd + ge - gf - gg + gh)
        + du * (k + u.yzx * vec3(kxy, kyz, kzx) + u.zxy * vec3(kzx, kxy, kyz) + u.yzx * u.zxy * kxyz);
    return vec4(slope, value);
}

// Sum of octaves of noise from a frequency on. Octaves finer than pixels are left out.
fn octaves(place: vec3<f32>, lowest: f32, count: i32, pixel: f32) -> vec4<f32> {
    var sum = vec4(0.0);
    var frequency = lowest;
    var height = 1.0;
    for (var octave = 0; octave < count; octave++) {
        let seen = 1.0 - smoothstep(0.25, 0.6, frequency * pixel);
        let own = noise(place * frequency + f32(octave) * 17.3);
        sum += height * seen * vec4(own.xyz * frequency, own.w);
        frequency *= 2.03;
        height *= 0.5;
    }
    return sum;
}

// The normal of the uneven surface: heights over the body at rest, their slope carried to the deformed
// surface (Mikkelsen 2010).
fn uneven(at: Corner, normal: vec3<f32>) -> vec3<f32> {
    let px = dpdx(at.position);
    let py = dpdy(at.position);
    let rx = dpdx(at.rest);
    let ry = dpdy(at.rest);
    if view.skin.y == 0.0 {
        return normal;
    }
    let pixel = max(length(rx), length(ry));
    let swells = octaves(at.rest, 5.0, 2, pixel);
    let grain = octaves(at.rest, 34.0, 3, pixel);
    let slope = (swells.xyz * 0.020 + grain.xyz * 0.0035) * view.skin.y / view.skin.x;
    let r1 = cross(py, normal);
    let r2 = cross(normal, px);
    let area = dot(px, r1);
    let gradient = sign(area) * (dot(slope, rx) * r1 + dot(slope, ry) * r2);
    return normalize(abs(area) * normal - gradient);
}


@fragment
fn opaque(at: Corner, @builtin(front_facing) front: bool) -> @location(0) vec4<f32> {
    let colour = shade(at, front);
    if is_behind(at) || colour.a < 0.004 {
        discard;
    }
    return colour;
}

@fragment
fn clipped(at: Corner, @builtin(front_facing) front: bool) -> @location(0) vec4<f32> {
    let colour = shade(at, front);
    if is_behind(at) || dot(view.plane.xyz, at.place) > view.plane.w {
        discard;
    }
    return colour;
}

@fragment
fn ghost(at: Corner) -> @location(0) vec4<f32> {
    let eye = towards_eye(at.position);
    let facing = abs(dot(normalize(at.normal), eye));
    let rim = 1.0 - facing;
    let cover = view.ghost.a * (0.12 + 0.88 * rim * rim * rim);
    return vec4(coded(view.ghost.rgb), cover);
}

struct Sky {
    @builtin(position) clip: vec4<f32>,
    @location(0) height: f32,
}

// One triangle over the whole picture, behind everything.
@vertex
fn background(@builtin(vertex_index) index: u32) -> Sky {
    let x = f32(i32(index & 1u) * 4 - 1);
    let y = f32(i32(index >> 1u) * 4 - 1);
    var result: Sky;
    result.clip = vec4(x, y, 1.0, 1.0);
    result.height = 0.5 + 0.5 * y;
    return result;
}

@fragment
fn sky(at: Sky) -> @location(0) vec4<f32> {
    // Alpha marks the pixels that a body covers.
    return vec4(coded(mix(view.bottom.rgb, view.top.rgb, at.height)), 0.0);
}

// Lines between combinations of points, turned to the camera.
struct Line {
    nodes: array<u32, 8>,
    middle: array<f32, 8>,
    reach: array<f32, 8>,
}

@group(1) @binding(5) var<storage, read> lines: array<Line>;

struct Stroke {
    @builtin(position) clip: vec4<f32>,
    @location(0) position: vec3<f32>,
    // −1 to 1 across.
    @location(1) across: f32,
    @location(2) @interpolate(flat) mark: u32,
}

fn lifted(position: vec3<f32>) -> vec3<f32> {
    return position + towards_eye(position) * view.line.w;
}

@vertex
fn line(@builtin(vertex_index) index: u32, @builtin(instance_index) mark: u32) -> Stroke {
    var middle = vec3(0.0);
    var half_line = vec3(0.0);
    for (var slot = 0u; slot < 8u; slot++) {
        let point = points[lines[index / 6u].nodes[slot]].xyz;
        middle += lines[index / 6u].middle[slot] * point;
        half_line += lines[index / 6u].reach[slot] * point;
    }
    // Two triangles: corners 0 1 2, 2 1 3.
    var order = array(0u, 1u, 2u, 2u, 1u, 3u);
    let corner = order[index % 6u];
    let end = select(-1.0, 1.0, (corner & 1u) != 0u);
    let side = select(-1.0, 1.0, (corner & 2u) != 0u);
    let position = lifted(middle + end * half_line);
    let first = view.projection_view * vec4(lifted(middle - half_line), 1.0);
    let last = view.projection_view * vec4(lifted(middle + half_line), 1.0);
    let shape = vec2(view.line.x, 1.0);
    let along = (last.xy / last.w - first.xy / first.w) * shape;
    let unit = along / max(length(along), 1.0e-9);
    let width = 2.0 * select(view.line.y, view.line.z, mark != 0u);
    // Ends reach out a little, so that lines that meet close.
    let offset = width * (vec2(-unit.y, unit.x) * side + unit * end * 0.5) / shape;
    var result: Stroke;
    result.clip = select(first, last, end > 0.0);
    result.clip = vec4(result.clip.xy + offset * result.clip.w, result.clip.zw);
    result.position = position;
    result.across = side;
    result.mark = mark;
    return result;
}

@fragment
fn stroke(at: Stroke) -> @location(0) vec4<f32> {
    let marked = at.mark == 1u;
    if dot(view.plane.xyz, at.position) > view.plane.w + view.line.w * 1.5 && !marked {
        discard;
    }
    // A core with a pale rim is seen on any colour.
    var core = select(vec3(0.012, 0.014, 0.022), vec3(0.80, 0.0, 0.24), marked);
    var edge = vec3(0.92);
    if at.mark == 2u {
        // A bar: pale as a ligament, with a dark rim.
        core = vec3(0.76, 0.60, 0.36);
        edge = vec3(0.05, 0.04, 0.03);
    }
    let rim = smoothstep(0.45, 0.75, abs(at.across));
    return vec4(coded(mix(core, edge, rim)), mix(0.95, 0.75, rim));
}

@fragment
fn wireframe(at: Corner) -> @location(0) vec4<f32> {
    let cover = edge_cover(at.corner, at.edges);
    let colour = select(colour_at(at), view.ghost.rgb, no_colour(at));
    if dot(view.plane.xyz, at.position) > view.plane.w || cover < 0.05 {
        discard;
    }
    return vec4(coded(colour), cover);
}

// Colours of tissue vary: paler and darker patches, and thin vessels below the surface.
fn mottled(rest: vec3<f32>, tissue: bool, perfusion: f32) -> vec3<f32> {
    let patches = octaves(rest, 2.3, 3, 0.0).w;
    let fine = octaves(rest, 19.0, 2, 0.0).w;
    let warped = rest + 0.07 * vec3(noise(rest * 5.0 + 3.1).w, noise(rest * 5.0 + 11.7).w, noise(rest * 5.0 + 23.9).w);
    let vessel = smoothstep(0.93, 1.0, 1.0 - abs(octaves(warped, 3.1, 2, 0.0).w)) * smoothstep(-0.2, 0.4, patches);
    let tone = clamp(0.5 + 0.55 * patches + 0.16 * fine, 0.0, 1.0);
    let tint = mix(vec3(0.52, 0.27, 0.25), vec3(0.88, 0.60, 0.54), tone);
    let full = mix(tint, vec3(0.50, 0.12, 0.13), 0.35 * vessel);
    // Under other colours only its lightness, so that they can be read.
    let light = vec3(0.86 + 0.2 * tone);
    // Organs keep their own colour, which is redder where more blood flows.
    let blood = mix(vec3(0.86, 0.68, 0.66), vec3(1.10, 1.08, 1.04), tone);
    let organ = mix(light, mix(blood, vec3(0.80, 0.34, 0.34), 0.5 * vessel), perfusion);
    return select(organ, full, tissue);
}

// Sharp reflections on uneven surfaces, and a film that shines when seen from the side.
fn moist(albedo: vec3<f32>, normal: vec3<f32>, eye: vec3<f32>, finish: vec2<f32>, light: f32) -> vec3<f32> {
    let key = normalize(view.right.xyz * -0.45 + view.up.xyz * 0.65 + view.towards.xyz * 0.75);
    let facing = max(dot(normal, normalize(key + eye)), 0.0);
    let glint = pow(facing, 180.0) * 0.50 + pow(facing, 28.0) * 0.09;
    let grazing = 1.0 - max(dot(normal, eye), 0.0);
    let film = 0.16 * grazing * grazing * grazing * grazing;
    return lit(albedo, normal, eye, finish, light) + vec3((glint + film) * view.skin.y);
}
