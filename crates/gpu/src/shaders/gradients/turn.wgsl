// The end of an iteration: p ← z + β p with the rigid motions of aggregates in z, and the decision to stop.
@group(1) @binding(0) var<storage, read> now: Progress;
@group(1) @binding(1) var<storage, read_write> next: Progress;
@group(2) @binding(0) var<storage, read> curvatures: array<f32>;
@group(2) @binding(1) var<storage, read> products: array<vec2f>;
@group(2) @binding(2) var<storage, read> z: array<f32>;
@group(2) @binding(3) var<storage, read_write> p: array<f32>;
@group(3) @binding(0) var<storage, read> arm: array<vec4f>;
@group(3) @binding(1) var<storage, read> motion: array<f32>;
@group(3) @binding(2) var<storage, read> powers: array<f32>;
// The aggregate of each node, and a bit for each component with an equation.
@group(3) @binding(3) var<storage, read> home: array<vec2u>;

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let index = number(group, groups, local);
    var share = vec4f();
    for (var chunk = local; chunk < sizes.chunks; chunk += GROUP) {
        share.x += curvatures[chunk];
    }
    for (var aggregate = local; aggregate < sizes.aggregates; aggregate += GROUP) {
        let own = products[aggregate];
        share.y += own.x;
        share.z += own.y;
        if sizes.coarse != 0u {
            share.z += powers[aggregate];
        }
    }
    let all = sum(local, share);
    let stiff = now.started == 0u || all.x > 0.0;
    if index == 0u {
        var after = now;
        if now.end == 0u {
            after.done += select(0u, now.started, stiff);
            after.started = 1u;
            after.product = all.z;
            after.residual = all.y;
            if !stiff || all.z < 0.0 {
                after.end = 3u;
            } else if all.y <= now.goal {
                after.end = 1u;
            } else if after.done >= now.most {
                after.end = 2u;
            }
        }
        next = after;
    }
    if now.end == 0u && index < 6u * sizes.nodes {
        let node = index / 6u;
        let c = index % 6u;
        let beta = select(0.0, all.z / now.product, now.started != 0u);
        var own = z[index];
        if sizes.coarse != 0u {
            let place = home[node];
            if ((place.y >> c) & 1u) != 0u {
                let base = 6u * place.x;
                let w = vec3f(motion[base + 3u], motion[base + 4u], motion[base + 5u]);
                own += motion[base + c];
                if c < 3u {
                    own += cross(w, arm[node].xyz)[c];
                }
            }
        }
        p[index] = own + beta * p[index];
    }
}
