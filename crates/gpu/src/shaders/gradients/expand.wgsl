// Both halves of the matrix from its lower one.
@group(1) @binding(0) var<storage, read> lower: array<f32>;
@group(1) @binding(1) var<storage, read> place: array<u32>;
@group(1) @binding(2) var<storage, read_write> value: array<f32>;

const NONE = 0xffffffffu;

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let at = number(group, groups, local);
    if at < sizes.entries {
        let base = place[at];
        value[at] = select(lower[min(base, sizes.lower - 1u)], 0.0, base == NONE);
    }
}
