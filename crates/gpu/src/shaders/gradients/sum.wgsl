// Sums of four numbers over the invocations of a group, in one order; all of them get it.
var<workgroup> shares: array<vec4f, GROUP>;

fn sum(local: u32, own: vec4f) -> vec4f {
    workgroupBarrier();
    shares[local] = own;
    workgroupBarrier();
    for (var half = GROUP / 2u; half > 0u; half /= 2u) {
        if local < half {
            shares[local] += shares[local + half];
        }
        workgroupBarrier();
    }
    return shares[0];
}
