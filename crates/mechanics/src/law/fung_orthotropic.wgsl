// parameter(1): modulus c [Pa]; parameter(2) to parameter(7): the form D, 11, 22, 33, 12, 23, 13;
// parameter(8) to parameter(10): the coefficients s of the shears 12, 23, 13; parameter(11) to parameter(19):
// the material axes, one after the other.

fn parameters_from(index: u32) -> vec3f {
    return vec3f(parameter(index), parameter(index + 1), parameter(index + 2));
}

// F S Fᵀ.
fn push_forward(s: Symmetric, f: mat3x3f) -> Symmetric {
    let t = gradient_times(f, s) * transpose(f);
    return Symmetric(vec3f(t[0].x, t[1].y, t[2].z), vec3f(t[1].x, t[2].y, t[2].x));
}

fn law_stress(d: Deformation, a: vec3f, b: vec3f) -> Split {
    let axes = mat3x3f(parameters_from(11), parameters_from(14), parameters_from(17));
    let strain_twice = push_forward(d.strain_twice, transpose(axes));
    // ½ ∂Q/∂E, and Q = ∂Q/∂E : ½E.
    let strain = 0.5 * strain_twice.diagonal;
    let form = Symmetric(parameters_from(2), parameters_from(5));
    let slope = Symmetric(symmetric_apply(form, strain), parameters_from(8) * strain_twice.shear);
    let q = dot(strain, slope.diagonal) + dot(strain_twice.shear, slope.shear);
    let stress = symmetric_scaled(slope, parameter(1) * exponential(q));
    return Split(push_forward(stress, axes), volumetric_stress(d));
}
