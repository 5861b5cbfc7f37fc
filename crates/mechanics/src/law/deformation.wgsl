// Tensors, and what the laws need of a deformation; twin of tensor.rs and deformation.rs, which have the
// formulas. Isotropic stresses are products C⁻¹ M here; deformation.rs writes the same tensors as sums of I −
// C⁻¹, I and C − I. A mat3x3f has columns, so that h * v is H v.

// A symmetric tensor: (11, 22, 33) and (12, 23, 13).
struct Symmetric {
    diagonal: vec3f,
    shear: vec3f,
}

const SYMMETRIC_IDENTITY = Symmetric(vec3f(1.0), vec3f(0.0));

fn symmetric_sum(a: Symmetric, b: Symmetric) -> Symmetric {
    return Symmetric(a.diagonal + b.diagonal, a.shear + b.shear);
}

fn symmetric_scaled(s: Symmetric, factor: f32) -> Symmetric {
    return Symmetric(s.diagonal * factor, s.shear * factor);
}

// a + factor b.
fn symmetric_plus_scaled(a: Symmetric, b: Symmetric, factor: f32) -> Symmetric {
    return Symmetric(fma(b.diagonal, vec3f(factor), a.diagonal), fma(b.shear, vec3f(factor), a.shear));
}

fn symmetric_trace(s: Symmetric) -> f32 {
    return s.diagonal.x + s.diagonal.y + s.diagonal.z;
}

// S v.
fn symmetric_apply(s: Symmetric, v: vec3f) -> vec3f {
    return s.diagonal * v + s.shear.xxz * v.yxx + s.shear.zyy * v.zzy;
}

// a ⊗ a.
fn symmetric_dyad(a: vec3f) -> Symmetric {
    return Symmetric(a * a, a.xyx * a.yzz);
}

// S⁻¹ det S.
fn symmetric_cofactor(s: Symmetric) -> Symmetric {
    let d = s.diagonal;
    let o = s.shear;
    return Symmetric(d.yxx * d.zzy - o.yzx * o.yzx, o.zxx * o.yzy - o * d.zxy);
}

// A B for two tensors that commute, so that the product is symmetric too.
fn symmetric_commuting_product(a: Symmetric, b: Symmetric) -> Symmetric {
    let both = a.shear * b.shear;
    return Symmetric(
        a.diagonal * b.diagonal + both.xxz + both.zyy,
        a.diagonal.xyx * b.shear + a.shear * b.diagonal.yzz + a.shear.zxx * b.shear.yzy,
    );
}

// F S.
fn gradient_times(f: mat3x3f, s: Symmetric) -> mat3x3f {
    let d = s.diagonal;
    let o = s.shear;
    return f * mat3x3f(d.x, o.x, o.z, o.x, d.y, o.y, o.z, o.y, d.z);
}

// The cofactor matrix: F⁻ᵀ det F.
fn cofactor(f: mat3x3f) -> mat3x3f {
    return mat3x3f(cross(f[1], f[2]), cross(f[2], f[0]), cross(f[0], f[1]));
}

// J − 1 of F = I + H, without cancellation.
fn volume_change(h: mat3x3f) -> f32 {
    let minors = fma(h[0].x, h[1].y, -h[1].x * h[0].y)
        + fma(h[1].y, h[2].z, -h[2].y * h[1].z)
        + fma(h[0].x, h[2].z, -h[2].x * h[0].z);
    return h[0].x + h[1].y + h[2].z + minors + dot(h[0], cross(h[1], h[2]));
}

// C − I = H + Hᵀ + Hᵀ H.
fn green_lagrange_twice(h: mat3x3f) -> Symmetric {
    return Symmetric(
        2.0 * vec3f(h[0].x, h[1].y, h[2].z) + vec3f(dot(h[0], h[0]), dot(h[1], h[1]), dot(h[2], h[2])),
        vec3f(h[1].x + h[0].y, h[2].y + h[1].z, h[2].x + h[0].z)
            + vec3f(dot(h[0], h[1]), dot(h[1], h[2]), dot(h[0], h[2])),
    );
}

// A deformation at one point and its measures.
struct Deformation {
    // F.
    gradient: mat3x3f,
    // C − I.
    strain_twice: Symmetric,
    // C⁻¹.
    inverse_cauchy_green: Symmetric,
    // J.
    volume_ratio: f32,
    // J − 1.
    volume_change: f32,
    // q = J^(−2/3).
    isochoric_factor: f32,
    // q − 1.
    isochoric_change: f32,
}

// From the displacement gradient H = ∂u/∂X; meaningless for J ≤ 0.
fn deformation(h: mat3x3f) -> Deformation {
    let strain_twice = green_lagrange_twice(h);
    let x = volume_change(h);
    let j = 1.0 + x;
    let inverse = symmetric_cofactor(symmetric_sum(strain_twice, SYMMETRIC_IDENTITY));
    // c = J^(1/3): q − 1 = −x (c + 1) c⁻²/(c² + c + 1).
    let root = inverse_cbrt(j);
    let q = root * root;
    let c = j * q;
    let isochoric_change = -x * (c + 1.0) * q / fma(c, c, c + 1.0);
    return Deformation(
        mat3x3f(h[0] + vec3f(1.0, 0.0, 0.0), h[1] + vec3f(0.0, 1.0, 0.0), h[2] + vec3f(0.0, 0.0, 1.0)),
        strain_twice,
        symmetric_scaled(inverse, 1.0 / (j * j)),
        j,
        x,
        1.0 + isochoric_change,
        isochoric_change,
    );
}

// A stress split into the part that changes shape and the part that changes volume.
struct Split {
    isochoric: Symmetric,
    volumetric: Symmetric,
}

// Ī₁ − 3.
fn isochoric_first_invariant_minus_3(d: Deformation) -> f32 {
    return fma(d.isochoric_factor, symmetric_trace(d.strain_twice), 3.0 * d.isochoric_change);
}

// C̄ − I.
fn isochoric_strain_twice(d: Deformation) -> Symmetric {
    let strain = symmetric_scaled(d.strain_twice, d.isochoric_factor);
    return Symmetric(strain.diagonal + d.isochoric_change, strain.shear);
}

// Ī₁ − 3 and Ī₂ − 3.
fn isochoric_invariants_minus_3(d: Deformation) -> vec2f {
    let t = isochoric_first_invariant_minus_3(d);
    let b = isochoric_strain_twice(d);
    let square = dot(b.diagonal, b.diagonal) + 2.0 * dot(b.shear, b.shear);
    return vec2f(t, fma(0.5, t * t - square, 2.0 * t));
}

// Ī₄ − 1 of the unit fibre a.
fn fibre_strain(d: Deformation, a: vec3f) -> f32 {
    return fma(d.isochoric_factor, dot(a, symmetric_apply(d.strain_twice, a)), d.isochoric_change);
}

// Ī₄ − 1 and Ī₅ − 1 of the unit fibre a.
fn fibre_strains(d: Deformation, a: vec3f) -> vec2f {
    let ba = symmetric_apply(isochoric_strain_twice(d), a);
    let strain = dot(a, ba);
    return vec2f(strain, fma(2.0, strain, dot(ba, ba)));
}

// C⁻¹ (M − ⅓ tr M I) for a polynomial M of C.
fn inverse_times_deviator(d: Deformation, m: Symmetric) -> Symmetric {
    let product = symmetric_commuting_product(d.inverse_cauchy_green, m);
    return symmetric_plus_scaled(product, d.inverse_cauchy_green, -symmetric_trace(m) / 3.0);
}

// S of an energy of Ī₁.
fn first_invariant_stress(d: Deformation, w1: f32) -> Symmetric {
    return symmetric_scaled(inverse_times_deviator(d, d.strain_twice), 2.0 * w1 * d.isochoric_factor);
}

// S of an energy of Ī₁ and Ī₂.
fn isotropic_stress(d: Deformation, w1: f32, w2: f32) -> Symmetric {
    let q = d.isochoric_factor;
    let x = d.strain_twice;
    let i1 = 3.0 + isochoric_first_invariant_minus_3(d);
    let linear = symmetric_scaled(x, w1 + (i1 - 2.0 * q) * w2);
    let m = symmetric_plus_scaled(linear, symmetric_commuting_product(x, x), -q * w2);
    return symmetric_scaled(inverse_times_deviator(d, m), 2.0 * q);
}

// S of an energy of Ī₄ of the unit fibre a.
fn fibre_stress(d: Deformation, a: vec3f, w4: f32) -> Symmetric {
    let i4 = 1.0 + dot(a, symmetric_apply(d.strain_twice, a));
    let direction = symmetric_plus_scaled(symmetric_dyad(a), d.inverse_cauchy_green, -i4 / 3.0);
    return symmetric_scaled(direction, 2.0 * w4 * d.isochoric_factor);
}

// S of an energy of Ī₄ and Ī₅ of the unit fibre a.
fn fibre_stresses(d: Deformation, a: vec3f, w: vec2f) -> Symmetric {
    let q = d.isochoric_factor;
    let ca = a + symmetric_apply(d.strain_twice, a);
    let both = Symmetric(2.0 * a * ca, a.xyx * ca.yzz + a.yzz * ca.xyx);
    let direction = symmetric_plus_scaled(both, d.inverse_cauchy_green, -dot(ca, ca) * 2.0 / 3.0);
    return symmetric_plus_scaled(fibre_stress(d, a, w.x), direction, 2.0 * w.y * q * q);
}
