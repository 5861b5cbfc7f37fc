// Functions of one number to a few units in the last place, with relative accuracy near zero too: WGSL
// requires little of its `log` and `exp`. NaN stays NaN.

// x^(−1/3) of a positive number, meaningless for others. The first guess is minus a third of the exponent (4
// % off). Two steps follow along the series of (1 − e)^(−1/3), e = 1 − x y³, without a division.
fn inverse_cbrt(x: f32) -> f32 {
    var y = bitcast<f32>(0x54a2fa8cu - bitcast<u32>(x) / 3u);
    for (var step = 0; step < 2; step++) {
        let e = fma(-x * y * y, y, 1.0);
        y = fma(y * e, fma(e, fma(e, 14.0 / 81.0, 2.0 / 9.0), 1.0 / 3.0), y);
    }
    return y;
}

// Cube root of a positive number, meaningless for others.
fn cbrt(x: f32) -> f32 {
    let y = inverse_cbrt(x);
    return x * y * y;
}

// ln(1 + x), meaningless for x ≤ −1. With 1 + x = 2ᵏ (1 + f) and s = f/(2 + f): ln(1 + f) = f − f²/2 + s
// (f²/2 + R(s²)). The coefficients of R are from logf of FreeBSD's msun.
fn ln_1p(x: f32) -> f32 {
    var f = x;
    var k = 0.0;
    if !(x > -0.29 && x < 0.41) {
        // 2ᵏ is the nearest power of two: the exponent of √2 (1 + x).
        let u = 1.0 + x;
        let exponent = bitcast<i32>(u * 1.4142135) >> 23u;
        f = fma(u, bitcast<f32>((254 - exponent) << 23u), -1.0);
        k = f32(exponent - 127);
    }
    let s = f / (2.0 + f);
    let z = s * s;
    let r = z * fma(z, fma(z, fma(z, 0.24279079, 0.28498787), 0.40000972), 0.66666663);
    let half_square = 0.5 * f * f;
    return fma(k, 0.6931472, f - (half_square - s * (half_square + r)));
}

// 2ⁿ and eʳ − 1 with x = n ln 2 + r, |r| ≤ ln 2/2, so that eˣ = 2ⁿ eʳ. Beyond x = 88.3 2ⁿ is infinite. NaN is
// returned as NaN: a compiler may turn the lower bound into a maximum, which loses NaN.
fn power_and_rest(x: f32) -> vec2f {
    if (bitcast<u32>(x) & 0x7fffffffu) > 0x7f800000u {
        return vec2f(x);
    }
    let n = i32(round(clamp(x * 1.442695, -126.0, 128.0)));
    // ln 2 in two parts, the first 22713/2¹⁵: the product is exact, and whole, so that no compiler adds the
    // parts up again.
    let r = (select(x, -87.0, x < -87.0) - f32(n * 22713) / 32768.0) - f32(n) * 1.4286068e-6;
    // Taylor: what follows r⁷ is below 2e-9 r.
    let high = fma(r, fma(r, fma(r, 1.0 / 5040.0, 1.0 / 720.0), 1.0 / 120.0), 1.0 / 24.0);
    let series = fma(r, fma(r, high, 1.0 / 6.0), 0.5);
    return vec2f(bitcast<f32>((n + 127) << 23u), fma(r * r, series, r));
}

// eˣ.
fn exponential(x: f32) -> f32 {
    let parts = power_and_rest(x);
    return parts.x * (1.0 + parts.y);
}

// eˣ − 1.
fn exp_m1(x: f32) -> f32 {
    let parts = power_and_rest(x);
    return fma(parts.x, parts.y, parts.x - 1.0);
}
