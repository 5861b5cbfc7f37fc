//! Membrane of a flat triangle with rotations about its normal: Felippa's optimal ANDES element (2003), CMAME
//! 192:2125, and the constant-strain triangle.

use nalgebra::{Matrix3, SMatrix};

use super::{Corners, Differences, Matrix9, PlaneStress, area, gradients};

/// α_b: how much of the edges' normal displacement comes from drilling.
pub(super) const DRILLING_TO_EDGE: f64 = 1.5;

/// Mean strain (εxx, εyy, γxy) of the ANDES triangle over (u, v, θz), Lᵀ/(t A) with its lumping L of constant
/// stress.
pub(crate) fn andes_strain(corners: &Corners) -> SMatrix<f64, 3, 9> {
    let d = Differences::new(corners);
    let (x13, x21, x32) = (-d.x31, -d.x12, -d.x23);
    let (y13, y21, y32) = (-d.y31, -d.y12, -d.y23);
    let Differences { x12, x23, x31, y12, y23, y31 } = d;
    let (sixth, third) = (DRILLING_TO_EDGE / 6.0, DRILLING_TO_EDGE / 3.0);
    #[rustfmt::skip]
    let rows = [
        y23, 0.0, x32,
        0.0, x32, y23,
        sixth * y23 * (y13 - y21), sixth * x32 * (x31 - x12), third * (x31 * y13 - x12 * y21),
        y31, 0.0, x13,
        0.0, x13, y31,
        sixth * y31 * (y21 - y32), sixth * x13 * (x12 - x23), third * (x12 * y21 - x23 * y32),
        y12, 0.0, x21,
        0.0, x21, y12,
        sixth * y12 * (y32 - y13), sixth * x21 * (x23 - x31), third * (x23 * y32 - x31 * y13),
    ];
    SMatrix::<f64, 3, 9>::from_column_slice(&rows) / d.double_area()
}

/// Hierarchical rotations over (u, v, θz): nodal drilling less the mean rotation of the triangle.
fn hierarchical(d: &Differences) -> SMatrix<f64, 3, 9> {
    let inverse = 0.5 / d.double_area();
    let mean = [-d.x23, -d.y23, 0.0, -d.x31, -d.y31, 0.0, -d.x12, -d.y12, 0.0].map(|c| c * inverse);
    SMatrix::from_fn(|row, i| mean[i] + if i == 3 * row + 2 { 1.0 } else { 0.0 })
}

/// The higher-order part over the hierarchical rotations, with β₀ = max((1 − 4ν²)/2, 0.01) min(1, κ t²/A).
pub(crate) fn andes_higher(
    corners: &Corners,
    elastic: &PlaneStress,
    thickness: f64,
    adaptation: f64,
) -> Matrix3<f64> {
    let d = Differences::new(corners);
    let area = 0.5 * d.double_area();
    let optimal = (0.5 * (1.0 - 4.0 * elastic.poisson * elastic.poisson)).max(0.01);
    let beta = optimal * (adaptation * thickness * thickness / area).min(1.0);

    let Differences { x12, x23, x31, y12, y23, y31 } = d;
    let (x13, x21, x32) = (-x31, -x12, -x23);
    let (y13, y21, y32) = (-y31, -y12, -y23);
    let (l21, l32, l13) = (x12 * x12 + y12 * y12, x23 * x23 + y23 * y23, x31 * x31 + y31 * y31);
    // Strains along the edges to Cartesian ones.
    #[rustfmt::skip]
    let natural = Matrix3::new(
        y23 * y13 * l21, y31 * y21 * l32, y12 * y32 * l13,
        x23 * x13 * l21, x31 * x21 * l32, x12 * x32 * l13,
        (y23 * x31 + x32 * y13) * l21, (y31 * x12 + x13 * y21) * l32, (y12 * x23 + x21 * y32) * l13,
    ) / (4.0 * area * area);
    let elastic_natural = natural.transpose() * elastic.matrix * natural;
    // Strains along the edges at the corners, from the hierarchical rotations; βs 1, 2, 1, 0, 1, −1, −1, −1,
    // −2.
    let lengths = Matrix3::from_diagonal(&nalgebra::Vector3::new(1.0 / l21, 1.0 / l32, 1.0 / l13));
    let scale = lengths * (2.0 * area / 3.0);
    let q1 = scale * Matrix3::new(1.0, 2.0, 1.0, 0.0, 1.0, -1.0, -1.0, -1.0, -2.0);
    let q2 = scale * Matrix3::new(-2.0, -1.0, -1.0, 1.0, 1.0, 2.0, -1.0, 0.0, 1.0);
    let q3 = scale * Matrix3::new(1.0, -1.0, 0.0, -1.0, -2.0, -1.0, 2.0, 1.0, 1.0);
    [(q1 + q2) * 0.5, (q2 + q3) * 0.5, (q3 + q1) * 0.5]
        .iter()
        .fold(Matrix3::zeros(), |sum, q| sum + q.transpose() * elastic_natural * q)
        * (0.75 * beta * area * thickness)
}

/// The ANDES triangle: its basic and its higher-order part.
pub fn andes_opt(corners: &Corners, elastic: &PlaneStress, thickness: f64, adaptation: f64) -> Matrix9 {
    let t = hierarchical(&Differences::new(corners));
    let higher = t.transpose() * andes_higher(corners, elastic, thickness, adaptation) * t;
    let basic = andes_strain(corners);
    basic.transpose() * elastic.matrix * basic * (thickness * area(corners)) + higher
}

/// Constant strain (εxx, εyy, γxy) over (u, v, θz).
pub(super) fn strain(corners: &Corners) -> SMatrix<f64, 3, 9> {
    let mut b = SMatrix::zeros();
    for (i, g) in gradients(corners).iter().enumerate() {
        b[(0, 3 * i)] = g.x;
        b[(1, 3 * i + 1)] = g.y;
        b[(2, 3 * i)] = g.y;
        b[(2, 3 * i + 1)] = g.x;
    }
    b
}

/// The constant-strain triangle; `drilling` G t A/3 holds each node's rotation to the rotation of the
/// triangle.
pub fn constant_strain(corners: &Corners, elastic: &PlaneStress, thickness: f64, drilling: f64) -> Matrix9 {
    let volume = thickness * area(corners);
    let b = strain(corners);
    let t = hierarchical(&Differences::new(corners));
    b.transpose() * elastic.matrix * b * volume
        + t.transpose() * t * (drilling * elastic.shear * volume / 3.0)
}
