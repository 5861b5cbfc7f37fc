// Nothing touches the nodes.
fn contact_force(node: u32) -> vec3f {
    return vec3f(0.0);
}
