// Sums the forces of each contact on its surface [N], with a group for each contact.

@group(2) @binding(15) var<storage, read_write> sums_of_contacts: array<vec4f>;

var<workgroup> parts: array<vec3f, GROUP>;

@compute @workgroup_size(GROUP)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) local: u32) {
    let contact = group.x;
    var sum = vec3f(0.0);
    for (var k = lists[SUMS_AT + contact] + local; k < lists[SUMS_AT + contact + 1u]; k += GROUP) {
        sum += rows[lists[k]].xyz;
    }
    parts[local] = sum + force_of_pairs(contact, local);
    for (var half = GROUP / 2u; half > 0u; half /= 2u) {
        workgroupBarrier();
        if local < half {
            parts[local] += parts[local + half];
        }
    }
    if local == 0u {
        sums_of_contacts[contact] = vec4f(parts[0], 0.0);
    }
}
