// The coarse matrix from its blocks: entry (i, j) of all blocks lies together, block by block, row by row.
@group(1) @binding(0) var<storage, read> blocks: array<f32>;
@group(1) @binding(1) var<storage, read> pairs: array<vec2u>;
@group(1) @binding(2) var<storage, read_write> coarse: array<f32>;

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let at = number(group, groups, local);
    if at < 36u * sizes.pairs {
        let pair = pairs[at / 36u];
        let i = at % 6u;
        let j = (at / 6u) % 6u;
        coarse[((6u * j + i) * sizes.aggregates + pair.x) * sizes.aggregates + pair.y] = blocks[at];
        if pair.x != pair.y {
            coarse[((6u * i + j) * sizes.aggregates + pair.y) * sizes.aggregates + pair.x] = blocks[at];
        }
    }
}
