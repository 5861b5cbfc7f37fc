// Nothing acts on the nodes.
fn external_force(node: u32, mass: f32) -> vec3f {
    return vec3f(0.0);
}
