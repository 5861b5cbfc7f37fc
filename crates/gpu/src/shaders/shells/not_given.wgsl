fn pressed(at: u32) -> vec3f {
    return vec3f();
}
