// The rigid motion of an aggregate under the forces on all, and the power of its own.
@group(1) @binding(0) var<storage, read> now: Progress;
@group(2) @binding(0) var<storage, read> inverse: array<f32>;
@group(2) @binding(1) var<storage, read> force: array<f32>;
@group(2) @binding(2) var<storage, read_write> motion: array<f32>;
@group(2) @binding(3) var<storage, read_write> powers: array<f32>;

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let aggregate = group.y * groups.x + group.x;
    let going = now.end == 0u && aggregate < sizes.aggregates;
    let stride = sizes.aggregates * sizes.aggregates;
    var shift = vec3f();
    var turn = vec3f();
    if going {
        for (var other = local; other < sizes.aggregates; other += GROUP) {
            for (var j = 0u; j < 6u; j++) {
                let f = force[6u * other + j];
                let at = 6u * j * stride + aggregate * sizes.aggregates + other;
                shift += f * vec3f(inverse[at], inverse[at + stride], inverse[at + 2u * stride]);
                turn += f * vec3f(inverse[at + 3u * stride], inverse[at + 4u * stride], inverse[at + 5u * stride]);
            }
        }
    }
    let a = sum(local, vec4f(shift, 0.0)).xyz;
    let b = sum(local, vec4f(turn, 0.0)).xyz;
    if local == 0u && going {
        var power = 0.0;
        for (var c = 0u; c < 3u; c++) {
            motion[6u * aggregate + c] = a[c];
            motion[6u * aggregate + 3u + c] = b[c];
            power += a[c] * force[6u * aggregate + c] + b[c] * force[6u * aggregate + 3u + c];
        }
        powers[aggregate] = power;
    }
}
