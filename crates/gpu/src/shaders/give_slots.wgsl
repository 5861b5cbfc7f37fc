// The force on a follower goes to slots of the nodes that it follows, one for each entry of its row. The
// energy in the fourth component goes to the first slot.

@group(1) @binding(0) var<storage, read_write> slots: array<vec4f>;
@group(1) @binding(4) var<storage, read> slot_offsets: array<u32>;
@group(1) @binding(5) var<storage, read> slots_of: array<u32>;

fn each(follower: u32) {
    var force = vec4f(0.0);
    for (var k = slot_offsets[follower]; k < slot_offsets[follower + 1u]; k++) {
        force += slots[slots_of[k]];
    }
    for (var k = row_offsets[follower]; k < row_offsets[follower + 1u]; k++) {
        slots[FIRST_GIVEN + k] = vec4f(weights(k) * force.xyz, force.w);
        force.w = 0.0;
    }
}
