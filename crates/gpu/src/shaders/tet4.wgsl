// Forces of linear tetrahedra.

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
    let d = deformation(displacement_gradient(cell));
    let stress = relaxed_stress(law_stress(d, fibre(0u, cell), fibre(1u, cell)), cell);
    let force = give_forces(cell, gradient_times(d.gradient, stress));
    note(d.volume_ratio, d.strain_twice, force);
}
