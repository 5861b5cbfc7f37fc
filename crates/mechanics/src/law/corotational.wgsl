// parameter(0): 2μ [Pa]; parameter(1): λ [Pa]. No `law_pressure`: tr(U − I) is no function of J.

fn along_axes(axes: Principal, values: vec3f) -> Symmetric {
    let first = symmetric_scaled(symmetric_dyad(axes.directions[0]), values.x);
    let second = symmetric_plus_scaled(first, symmetric_dyad(axes.directions[1]), values.y);
    return symmetric_plus_scaled(second, symmetric_dyad(axes.directions[2]), values.z);
}

fn law_stress(d: Deformation, a: vec3f, b: vec3f) -> Split {
    let axes = principal(d.strain_twice);
    let stretches = axes.values / (1.0 + sqrt(1.0 + axes.values));
    let inverse = 1.0 / (1.0 + stretches);
    let pressure = parameter(1) * (stretches.x + stretches.y + stretches.z);
    let shape = along_axes(axes, parameter(0) * stretches * inverse);
    return Split(shape, along_axes(axes, pressure * inverse));
}
