// Each node adds up the slots of its cells, in their order.

@group(1) @binding(0) var<storage, read> slots: array<vec4f>;
@group(1) @binding(1) var<storage, read> slot_offsets: array<u32>;
@group(1) @binding(2) var<storage, read> slots_of: array<u32>;

fn internal_force(node: u32) -> vec4f {
    var sum = vec4f(0.0);
    for (var k = slot_offsets[node]; k < slot_offsets[node + 1u]; k++) {
        sum += slots[slots_of[k]];
    }
    return sum;
}

fn clear(node: u32) {}
