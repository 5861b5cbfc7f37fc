// Forces of tetrahedra whose pressure is averaged.

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let cell = number(group, groups, local);
    if cell >= CELLS || end() < instant.index {
        return;
    }
    let h = displacement_gradient(cell);
    let d = deformation(h);
    let force = give_forces(cell, averaged_piola(cell, h, d));
    note(d.volume_ratio, d.strain_twice, force);
}
