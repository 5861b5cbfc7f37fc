// The forces of grips, k (p − x) with x = Σ wᵢ (Xᵢ + uᵢ). They follow from p − Σ wᵢ Xᵢ, found in double
// precision, so that no digits are lost. A group finds the force of one grip.

@group(1) @binding(0) var<storage, read> displacement: array<vec4f>;

var<workgroup> moved: array<vec3f, GROUP>;

@compute @workgroup_size(GROUP)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let grip = group.x;
    let count = grip_count();
    var sum = vec3f(0.0);
    for (var k = local; k < grip_entries(); k += GROUP) {
        let entry = grips[1u + 2u * count + k];
        if bitcast<u32>(entry.z) == grip {
            sum += entry.y * displacement[bitcast<u32>(entry.x)].xyz;
        }
    }
    moved[local] = sum;
    for (var half = GROUP / 2u; half > 0u; half /= 2u) {
        workgroupBarrier();
        if local < half {
            moved[local] += moved[local + half];
        }
    }
    if local == 0u && grip < count {
        let spring = grips[1u + grip];
        grips[1u + count + grip] = vec4f(spring.w * (spring.xyz - moved[0]), 0.0);
    }
}
