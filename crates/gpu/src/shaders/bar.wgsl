// Forces of bars, twin of forces/bar.rs. Rows at rest: the second node from the first, with the length as the
// fourth number. Then the length less the length without force, E over the length without force, the cross
// section, and the least stress (0 of a thread).

fn compute(cell: u32) {
    let first = row(0u, cell);
    let second = row(1u, cell);
    let moved = displacement_of(cell, 1u) - displacement_of(cell, 0u);
    let between = first.xyz;
    let now = between + moved;
    let length = length(now);
    let longer = dot(moved, 2.0 * between + moved) / (first.w + length) + second.x;
    let nothing = Symmetric(vec3f(0.0), vec3f(0.0));
    let elastic = Symmetric(vec3f(max(longer * second.y, second.w), 0.0, 0.0), vec3f(0.0));
    let stress = max(relaxed_stress(Split(elastic, nothing), cell).diagonal.x, second.w);
    let f = now * (stress * second.z / max(length, 1e-6 * first.w));
    give(cell, 0u, vec4f(-f, 0.0));
    give(cell, 1u, vec4f(f, 0.0));
    note(1.0, nothing, abs(f));
}
