// Lifts nodes out of things that rows have left in them, and gives nodes the forces of their contacts.

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let n = number(group, groups, local);
    if n < TOUCHING && end() > instant.index && is_near(n) {
        lift(n);
    }
}
