// Nodes move where they lie.

@group(2) @binding(0) var<storage, read_write> displacement: array<vec4f>;
// Of each node its increment before the instant [m], and internal forces at the last instant and the one
// before it [N].
@group(2) @binding(1) var<storage, read_write> increment: array<vec4f>;
// The increment after the instant, and the internal force at it.
@group(2) @binding(2) var<storage, read_write> next_increment: array<vec4f>;

// Moves a node on by an increment, from an instant with an internal force.
fn go(node: u32, by: vec3f, internal: vec3f, held: u32) {
    displacement[node] = vec4f(placed(displacement[node].xyz + by, held), 0.0);
    increment[3u * node] = vec4f(by, 0.0);
    increment[3u * node + 2u] = increment[3u * node + 1u];
    increment[3u * node + 1u] = vec4f(internal, 0.0);
    clear(node);
}
