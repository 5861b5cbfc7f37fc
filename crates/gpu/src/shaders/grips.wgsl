// The forces of grips, k (p − x) with x = Σ wᵢ (Xᵢ + uᵢ): from p − Σ wᵢ Xᵢ, found in double precision, so that no digits are lost.

@group(1) @binding(0) var<storage, read> displacement: array<vec4f>;

@compute @workgroup_size(GROUP)
fn main(@builtin(local_invocation_index) local: u32) {
    let count = grip_count();
    for (var grip = local; grip < count; grip += GROUP) {
        let spring = grips[1u + grip];
        var stretch = spring.xyz;
        for (var k = 0u; k < grip_entries(); k++) {
            let entry = grips[1u + 2u * count + k];
            if bitcast<u32>(entry.z) == grip {
                stretch -= entry.y * displacement[bitcast<u32>(entry.x)].xyz;
            }
        }
        grips[1u + count + grip] = vec4f(spring.w * stretch, 0.0);
    }
}
