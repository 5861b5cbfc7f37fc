// The number of an invocation, in groups that fill up to two dimensions.
fn number(group: vec3u, groups: vec3u, local: u32) -> u32 {
    return (group.y * groups.x + group.x) * GROUP + local;
}
