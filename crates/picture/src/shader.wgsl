// Surfaces by vertex pulling: no buffer but that of the points changes from frame to frame.

struct View {
    projection_view: mat4x4<f32>,
    // Unit vectors of the camera; `eye.w` is 1 in perspective, else the eye is infinitely far along `towards`.
    right: vec4<f32>,
    up: vec4<f32>,
    towards: vec4<f32>,
    eye: vec4<f32>,
    // What lies on the side of the normal is taken away.
    plane: vec4<f32>,
    // First value, 1 / span; whether there is a range; whether colours are coded as sRGB here.
    range: vec4<f32>,
    plain: vec4<f32>,
    ghost: vec4<f32>,
    top: vec4<f32>,
    bottom: vec4<f32>,
    // Strength of the edges.
    edge: vec4<f32>,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> colours: array<vec4<f32>, 256>;

// Position [m] and value of each point.
@group(1) @binding(0) var<storage, read> points: array<vec4<f32>>;
// Three vertices and the bits of the edges that are drawn.
@group(1) @binding(1) var<storage, read> triangles: array<vec4<u32>>;
// The point of each vertex.
@group(1) @binding(2) var<storage, read> vertices: array<u32>;
// Normal of each vertex.
@group(1) @binding(3) var<storage, read> normals: array<vec4<f32>>;

struct Corner {
    @builtin(position) clip: vec4<f32>,
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) value: f32,
    @location(3) corner: vec3<f32>,
    @location(4) @interpolate(flat) edges: u32,
}

@vertex
fn surface(@builtin(vertex_index) index: u32) -> Corner {
    let triangle = triangles[index / 3u];
    let vertex = triangle[index % 3u];
    let point = points[vertices[vertex]];
    return corner_at(point, normals[vertex].xyz, index, triangle.w);
}

// Corners of a section, one after the other.
@group(1) @binding(4) var<storage, read> corners: array<vec4<f32>>;
@group(1) @binding(5) var<storage, read> corner_edges: array<u32>;

@vertex
fn section(@builtin(vertex_index) index: u32) -> Corner {
    return corner_at(corners[index], view.plane.xyz, index, corner_edges[index / 3u]);
}

fn corner_at(point: vec4<f32>, normal: vec3<f32>, index: u32, edges: u32) -> Corner {
    var result: Corner;
    result.clip = view.projection_view * vec4(point.xyz, 1.0);
    result.position = point.xyz;
    result.normal = normal;
    result.value = point.w;
    let own = index % 3u;
    result.corner = vec3(select(0.0, 1.0, own == 0u), select(0.0, 1.0, own == 1u), select(0.0, 1.0, own == 2u));
    result.edges = edges;
    return result;
}

fn towards_eye(position: vec3<f32>) -> vec3<f32> {
    return select(view.towards.xyz, normalize(view.eye.xyz - position), view.eye.w > 0.5);
}

// Light of the value: a colour of the map, or that of tissue where there is none.
fn colour_of(value: f32) -> vec3<f32> {
    if view.range.z < 0.5 || value > 1.0e30 {
        return view.plain.rgb;
    }
    let part = clamp((value - view.range.x) * view.range.y, 0.0, 1.0) * 255.0;
    let low = u32(floor(part));
    let high = min(low + 1u, 255u);
    return mix(colours[low].rgb, colours[high].rgb, part - f32(low));
}

// A key light over the left shoulder, a fill from the right, sky above and ground below (all of them turn with the camera).
fn lit(albedo: vec3<f32>, normal: vec3<f32>, eye: vec3<f32>) -> vec3<f32> {
    let key = normalize(view.right.xyz * -0.45 + view.up.xyz * 0.65 + view.towards.xyz * 0.75);
    let fill = normalize(view.right.xyz * 0.8 + view.up.xyz * 0.05 + view.towards.xyz * 0.5);
    let sky = 0.5 + 0.5 * dot(normal, view.up.xyz);
    let direct = max(dot(normal, key), 0.0) * 0.62 + max(dot(normal, fill), 0.0) * 0.16;
    let ambient = mix(0.22, 0.40, sky);
    let half_way = normalize(key + eye);
    let shine = pow(max(dot(normal, half_way), 0.0), 40.0) * 0.10;
    let grazing = 1.0 - max(dot(normal, eye), 0.0);
    let outline = 1.0 - 0.35 * grazing * grazing * grazing;
    return (albedo * (ambient + direct) + vec3(shine)) * outline;
}

fn with_edges(colour: vec3<f32>, corner: vec3<f32>, edges: u32) -> vec3<f32> {
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
    let cover = (1.0 - smoothstep(0.35, 1.15, nearest)) * view.edge.a * dense;
    return mix(colour, view.edge.rgb, cover);
}

fn coded(colour: vec3<f32>) -> vec3<f32> {
    let bounded = clamp(colour, vec3(0.0), vec3(1.0));
    let low = bounded * 12.92;
    let high = 1.055 * pow(bounded, vec3(1.0 / 2.4)) - 0.055;
    let coded = select(high, low, bounded <= vec3(0.0031308));
    return select(bounded, coded, view.range.w > 0.5);
}

fn shade(at: Corner) -> vec4<f32> {
    let eye = towards_eye(at.position);
    var normal = normalize(at.normal);
    normal = select(-normal, normal, dot(normal, eye) >= 0.0);
    let colour = lit(colour_of(at.value), normal, eye);
    return vec4(coded(with_edges(colour, at.corner, at.edges)), 1.0);
}

@fragment
fn opaque(at: Corner) -> @location(0) vec4<f32> {
    return shade(at);
}

@fragment
fn clipped(at: Corner) -> @location(0) vec4<f32> {
    let colour = shade(at);
    if dot(view.plane.xyz, at.position) > view.plane.w {
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
    // Alpha tells what is covered by a body.
    return vec4(coded(mix(view.bottom.rgb, view.top.rgb, at.height)), 0.0);
}
