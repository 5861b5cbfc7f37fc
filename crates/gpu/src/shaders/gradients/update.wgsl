// Updates x += α p, r −= α A p and z = D⁻¹ r of an aggregate. Finds its r·r and r·z, and the force on its
// rigid motions.
@group(1) @binding(0) var<storage, read> now: Progress;
@group(2) @binding(0) var<storage, read> curvatures: array<f32>;
@group(2) @binding(1) var<storage, read> start: array<u32>;
@group(2) @binding(2) var<storage, read> inverse: array<f32>;
@group(2) @binding(3) var<storage, read> p: array<f32>;
@group(2) @binding(4) var<storage, read> ap: array<f32>;
@group(2) @binding(5) var<storage, read_write> x: array<f32>;
@group(2) @binding(6) var<storage, read_write> r: array<f32>;
@group(2) @binding(7) var<storage, read_write> z: array<f32>;
@group(2) @binding(8) var<storage, read_write> products: array<vec2f>;
@group(3) @binding(0) var<storage, read> arm: array<vec4f>;
@group(3) @binding(1) var<storage, read_write> force: array<f32>;

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let aggregate = group.y * groups.x + group.x;
    let going = now.end == 0u && aggregate < sizes.aggregates;
    var share = 0.0;
    for (var chunk = local; chunk < sizes.chunks; chunk += GROUP) {
        share += curvatures[chunk];
    }
    let curvature = sum(local, vec4f(share, 0.0, 0.0, 0.0)).x;
    let alpha = select(0.0, now.product / curvature, now.started != 0u && curvature > 0.0);
    var first = 0u;
    var last = 0u;
    if going {
        first = start[aggregate];
        last = start[aggregate + 1u];
    }
    var pushed = vec3f();
    var turned = vec3f();
    var squared = 0.0;
    var preconditioned = 0.0;
    for (var node = first + local; node < last; node += GROUP) {
        let at = 6u * node;
        var left: array<f32, 6>;
        var own: array<f32, 6>;
        for (var c = 0u; c < 6u; c++) {
            x[at + c] += alpha * p[at + c];
            left[c] = r[at + c] - alpha * ap[at + c];
            r[at + c] = left[c];
            squared += left[c] * left[c];
            for (var i = 0u; i < 6u; i++) {
                own[i] += inverse[36u * node + 6u * c + i] * left[c];
            }
        }
        for (var c = 0u; c < 6u; c++) {
            z[at + c] = own[c];
            preconditioned += own[c] * left[c];
        }
        if sizes.coarse != 0u {
            let f = vec3f(left[0], left[1], left[2]);
            pushed += f;
            turned += vec3f(left[3], left[4], left[5]) + cross(arm[node].xyz, f);
        }
    }
    let a = sum(local, vec4f(pushed, squared));
    let b = sum(local, vec4f(turned, preconditioned));
    if local == 0u && going {
        products[aggregate] = vec2f(a.w, b.w);
        if sizes.coarse != 0u {
            for (var c = 0u; c < 3u; c++) {
                force[6u * aggregate + c] = a[c];
                force[6u * aggregate + 3u + c] = b[c];
            }
        }
    }
}
