// Forces of triangles in plane stress, twin of forces/membrane.rs and plane_stress.rs. Rows at rest: the axes
// t and s, with the volume and λ + 2μ (0 of an incompressible law) as fourth components; B_1·t, B_1·s, B_2·t,
// B_2·s; λ/(λ + 2μ).

const MOST_SEARCHES = 40;
const SEARCHED = 7.6e-6;
const FLAT = 1e-3;

// √(1 + x) − 1.
fn root(x: f32) -> f32 {
    return x / (1.0 + sqrt(1.0 + x));
}

// H of Cholesky's factor with λ₃ − 1 across.
fn plane_gradient(factor: vec3f, change: f32) -> mat3x3f {
    return mat3x3f(factor.x, 0.0, 0.0, factor.z, factor.y, 0.0, 0.0, 0.0, change);
}

// λ₃ − 1 after a step of ln λ₃.
fn thinned(change: f32, step: f32) -> f32 {
    let factor = -2.0 * step / (2.0 + step);
    return fma(change, 1.0 + factor, factor);
}

fn compute(cell: u32) {
    let first = row(0u, cell);
    let second = row(1u, cell);
    let shape = row(2u, cell);
    let coupling = row(3u, cell).x;
    let modulus = second.w;
    let origin = displacement_of(cell, 0u);
    let u1 = displacement_of(cell, 1u) - origin;
    let u2 = displacement_of(cell, 2u) - origin;
    let du = u1 * shape.x + u2 * shape.z;
    let dv = u1 * shape.y + u2 * shape.w;
    let t = first.xyz;
    let s = second.xyz;
    let xx = 2.0 * dot(t, du) + dot(du, du);
    let yy = 2.0 * dot(s, dv) + dot(dv, dv);
    let xy = dot(t, dv) + dot(s, du) + dot(du, dv);
    let a = root(xx);
    let mixed = xy / (1.0 + a);
    let factor = vec3f(a, root(yy - mixed * mixed), mixed);
    let area_change = fma(factor.x, factor.y, factor.x + factor.y);
    let area = 1.0 + area_change;

    var change = -area_change / area;
    var d = deformation(plane_gradient(factor, change));
    var whole = Symmetric(vec3f(0.0), vec3f(0.0));
    if modulus == 0.0 {
        whole = law_stress(d, fibre(0u, cell), fibre(1u, cell)).isochoric;
    } else {
        var next = thinned(0.0, clamp(coupling * ln_1p(area_change), -1.0, 1.0));
        var slope = modulus;
        var last = 0.0;
        var moved = 0.0;
        for (var search = 0; search < MOST_SEARCHES; search++) {
            change = next;
            d = deformation(plane_gradient(factor, change));
            let stress = law_stress(d, fibre(0u, cell), fibre(1u, cell));
            whole = symmetric_sum(stress.isochoric, stress.volumetric);
            let across = (1.0 + change) * (1.0 + change) * whole.diagonal.z;
            let secant = ((across - last) * moved + slope * 1e-14) / (moved * moved + 1e-14);
            slope = max(secant, 0.1 * slope);
            last = across;
            let step = clamp(across / slope, -1.0, 1.0);
            next = thinned(change, step);
            moved = -step;
            if abs(across / slope) <= SEARCHED * max(abs(change), 1.2e-7) {
                break;
            }
        }
    }
    let pressure = coupling * (1.0 + change) * (1.0 + change) * whole.diagonal.z / (area * area);
    let elastic = Symmetric(
        vec3f(whole.diagonal.x - pressure * (1.0 + yy), whole.diagonal.y - pressure * (1.0 + xx), 0.0),
        vec3f(whole.shear.x + pressure * xy, 0.0, 0.0),
    );
    let nothing = Symmetric(vec3f(0.0), vec3f(0.0));
    let stress = relaxed_stress(Split(elastic, nothing), cell);
    let along = first.w * ((t + du) * stress.diagonal.x + (s + dv) * stress.shear.x);
    let across = first.w * ((t + du) * stress.shear.x + (s + dv) * stress.diagonal.y);
    let f1 = along * shape.x + across * shape.y;
    let f2 = along * shape.z + across * shape.w;
    give(cell, 0u, vec4f(-(f1 + f2), 0.0));
    give(cell, 1u, vec4f(f1, 0.0));
    give(cell, 2u, vec4f(f2, 0.0));
    note(select(area, 0.0, area < FLAT), d.strain_twice, abs(f1) + abs(f2));
}
