// Normals of vertices: the sum of the vector areas of the triangles around each, gathered so that no atomics
// are needed.

@group(0) @binding(0) var<storage, read> points: array<vec4<f32>>;
@group(0) @binding(1) var<storage, read> triangles: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> vertices: array<u32>;
@group(0) @binding(3) var<storage, read_write> normals: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> offsets: array<u32>;
@group(0) @binding(5) var<storage, read> around: array<u32>;

@compute @workgroup_size(256)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let vertex = id.x;
    if vertex >= arrayLength(&vertices) {
        return;
    }
    var sum = vec3(0.0);
    for (var at = offsets[vertex]; at < offsets[vertex + 1u]; at++) {
        let triangle = triangles[around[at]];
        let a = points[vertices[triangle.x]].xyz;
        let b = points[vertices[triangle.y]].xyz;
        let c = points[vertices[triangle.z]].xyz;
        sum += cross(b - a, c - a);
    }
    // Scaled first: areas of tiny triangles would vanish when squared.
    let largest = max(abs(sum.x), max(abs(sum.y), abs(sum.z)));
    let normal = select(vec3(0.0, 0.0, 1.0), normalize(sum / max(largest, 1.0e-37)), largest > 0.0);
    normals[vertex] = vec4(normal, 0.0);
}
