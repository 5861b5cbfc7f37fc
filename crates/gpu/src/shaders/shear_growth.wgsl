// How much stiffer in shear a state is than the law at rest; twin of shear_growth.rs of pliant-mechanics,
// which has the formulas.

struct Growth {
    factor: f32,
    // G.
    gradient: Symmetric,
}

// ε², δ², and half of the difference of F from which a derivative of the stress is taken. This half is the
// cube root of the spacing of numbers.
const SMALL_SQUARE = 1e-2;
const BEND_SQUARE = 1e-2;
const GROWTH_DIFFERENCE = 4.9215667e-3;

// The part of the stress at a displacement gradient that has a part in G.
fn shape_stress(h: mat3x3f, cell: u32) -> Symmetric {
    let split = law_stress(deformation(h), fibre(0u, cell), fibre(1u, cell));
    if HOURGLASS_GROWS == 1u {
        return split.isochoric;
    }
    return symmetric_sum(split.isochoric, split.volumetric);
}

fn full(s: Symmetric) -> mat3x3f {
    return gradient_times(mat3x3f(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0), s);
}

// From the elastic stress [Pa] and the shear modulus at rest [Pa]. G is found where it counts.
fn growth(d: Deformation, h: mat3x3f, stress: Symmetric, shear: f32, cell: u32, counts: bool) -> Growth {
    let x = d.strain_twice;
    var deviator = gradient_times(full(stress), symmetric_sum(x, SYMMETRIC_IDENTITY));
    let mean = (deviator[0].x + deviator[1].y + deviator[2].z) / 3.0;
    deviator -= mean * mat3x3f(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
    let rows = transpose(deviator);
    let product = dot(rows[0], deviator[0]) + dot(rows[1], deviator[1]) + dot(rows[2], deviator[2]);
    let stress_square = max(product, 1e-30);
    let q = d.isochoric_factor;
    let trace = symmetric_trace(x);
    let strain = q * q * (strain_square(x) - trace * trace / 3.0);
    let judged = strain + SMALL_SQUARE;
    let ratio = sqrt(stress_square / judged) / shear;
    let above = max(ratio - 1.0, 0.0);
    let share = above * above / (above * above + BEND_SQUARE);
    let factor = 1.0 + share * above;
    if !(ratio > 1.0) || !counts {
        return Growth(factor, Symmetric(vec3f(0.0), vec3f(0.0)));
    }
    let slope = share * (above * above + 3.0 * BEND_SQUARE) / (above * above + BEND_SQUARE) * ratio;
    let norm = sqrt(stress_square);
    let way = (GROWTH_DIFFERENCE / norm) * (d.gradient * deviator);
    let ahead = shape_stress(h + way, cell);
    let behind = shape_stress(h - way, cell);
    // Twice T S, with the mean of both stresses.
    let twice = gradient_times(deviator, symmetric_sum(ahead, behind));
    let of_stress = symmetric_plus_scaled(
        Symmetric(vec3f(twice[0].x, twice[1].y, twice[2].z), vec3f(twice[1].x, twice[2].y, twice[2].x)),
        symmetric_plus_scaled(ahead, behind, -1.0), 0.5 * norm / GROWTH_DIFFERENCE,
    );
    let shape = Symmetric(x.diagonal - trace / 3.0, x.shear);
    let of_strain = symmetric_plus_scaled(
        symmetric_scaled(shape, 2.0 * q * q), d.inverse_cauchy_green, -2.0 / 3.0 * strain,
    );
    let over = symmetric_scaled(of_stress, 1.0 / stress_square);
    return Growth(factor, symmetric_scaled(symmetric_plus_scaled(over, of_strain, -1.0 / judged), slope));
}
