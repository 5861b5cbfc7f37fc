// The forces of contacts on nodes [N].

@group(2) @binding(7) var<storage, read> contact_forces: array<vec4f>;

fn contact_force(node: u32) -> vec3f {
    return contact_forces[node].xyz;
}
