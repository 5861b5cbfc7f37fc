// Nodes move where they lie.

@group(2) @binding(0) var<storage, read_write> displacement: array<vec4f>;
// Those before the instant …
@group(2) @binding(1) var<storage, read_write> increment: array<vec4f>;
// … and those after it.
@group(2) @binding(2) var<storage, read_write> next_increment: array<vec4f>;

// Moves a node on by an increment.
fn go(node: u32, by: vec3f, held: u32) {
    displacement[node] = vec4f(placed(displacement[node].xyz + by, held), 0.0);
    increment[node] = vec4f(by, 0.0);
    clear(node);
}
