// Forces and energies as whole multiples of small ones: in which order they are added does not matter.

// A whole number of at most LIMIT, so that all cells at a node together stay in range. Larger numbers are cut
// off, and the overflow is noted.
fn whole(number: f32) -> i32 {
    if !(abs(number) <= LIMIT) {
        atomicMin(&findings[OVERFLOWN], instant.index);
    }
    return i32(round(clamp(number, -LIMIT, LIMIT)));
}

// A force [N] and an energy [J].
fn force_of(sum: vec4i) -> vec4f {
    return vec4f(vec3f(sum.xyz) / PER_FORCE, f32(sum.w) / PER_ENERGY);
}
