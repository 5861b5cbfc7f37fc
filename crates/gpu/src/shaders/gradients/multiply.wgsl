// A p, and the sums of p·A p of groups.
@group(1) @binding(0) var<storage, read> now: Progress;
@group(2) @binding(0) var<storage, read> row_start: array<u32>;
@group(2) @binding(1) var<storage, read> column: array<u32>;
@group(2) @binding(2) var<storage, read> value: array<f32>;
@group(2) @binding(3) var<storage, read> p: array<f32>;
@group(2) @binding(4) var<storage, read_write> ap: array<f32>;
@group(2) @binding(5) var<storage, read_write> curvatures: array<f32>;

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let index = number(group, groups, local);
    var own = 0.0;
    if now.end == 0u && index < 6u * sizes.nodes {
        let node = index / 6u;
        var all = 0.0;
        for (var at = row_start[node]; at < row_start[node + 1u]; at++) {
            let base = 6u * column[at];
            let row = 36u * at + index % 6u;
            all += value[row] * p[base] + value[row + 6u] * p[base + 1u] + value[row + 12u] * p[base + 2u]
                + value[row + 18u] * p[base + 3u] + value[row + 24u] * p[base + 4u] + value[row + 30u] * p[base + 5u];
        }
        ap[index] = all;
        own = all * p[index];
    }
    let whole = sum(local, vec4f(own, 0.0, 0.0, 0.0)).x;
    let chunk = group.y * groups.x + group.x;
    if local == 0u && chunk < sizes.chunks && now.end == 0u {
        curvatures[chunk] = whole;
    }
}
