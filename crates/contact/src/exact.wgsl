// Roots, lengths and sines to the last digits. A device may find a root with errors of some units in the last
// place, which bend normals and shift gaps. A step of Newton's method removes these errors if `fma` is one
// operation, and is harmless otherwise. The device's sine may have an absolute error of 2⁻¹¹, and has 2⁻²¹ on
// GPUs of NVIDIA. Both are larger than the turn of a thing in a step.

const HALF_TURN = 3.1415927;

fn root(x: f32) -> f32 {
    let found = sqrt(x);
    return select(found, found + 0.5 * fma(-found, found, x) / found, found > 0.0);
}

fn norm(v: vec3f) -> f32 {
    return root(dot(v, v));
}

fn flat_norm(v: vec2f) -> f32 {
    return root(dot(v, v));
}

// Of an angle from 0 to π, by Taylor's series up to x¹¹: 6e-8 at π/2.
fn sine(angle: f32) -> f32 {
    let x = min(angle, HALF_TURN - angle);
    let z = x * x;
    let high = fma(z, fma(z, -1.0 / 39916800.0, 1.0 / 362880.0), -1.0 / 5040.0);
    return x * fma(z, fma(z, fma(z, high, 1.0 / 120.0), -1.0 / 6.0), 1.0);
}
