//! Bending of a flat triangle: the discrete Kirchhoff triangle of Batoz, Bathe and Ho (1980), IJNME 15:1771.
//! Its deflection is cubic along edges and not defined inside; curvatures are.
//! Leaves out: shear of the thickness, so thick shells (thickness over a tenth of the span).

use nalgebra::SMatrix;

use super::{Corners, Differences, Matrix9, PlaneStress};

/// (L2, L3) in the middle of the edges: three points that integrate quadratics exactly.
pub(crate) const MIDSIDES: [[f64; 2]; 3] = [[0.5, 0.0], [0.5, 0.5], [0.0, 0.5]];

/// Curvatures (βx,x, βy,y, βx,y + βy,x) [1/m] over (w, θx, θy) at a point with area coordinates (L2, L3).
/// Strain at a height z is z times the curvatures.
pub(crate) fn curvature(corners: &Corners, [xi, eta]: [f64; 2]) -> SMatrix<f64, 3, 9> {
    let d = Differences::new(corners);
    // k = 4, 5, 6 stand for the edges 23, 31, 12.
    let edges = [(d.x23, d.y23), (d.x31, d.y31), (d.x12, d.y12)];
    let [(p4, t4, q4, r4), (p5, t5, q5, r5), (p6, t6, q6, r6)] = edges.map(|(x, y)| {
        let squared = x * x + y * y;
        (-6.0 * x / squared, -6.0 * y / squared, 3.0 * x * y / squared, 3.0 * y * y / squared)
    });
    let (a, b) = (1.0 - 2.0 * xi, 1.0 - 2.0 * eta);
    let hx_xi = [
        p6 * a + (p5 - p6) * eta,
        q6 * a - (q5 + q6) * eta,
        -4.0 + 6.0 * (xi + eta) + r6 * a - eta * (r5 + r6),
        -p6 * a + eta * (p4 + p6),
        q6 * a - eta * (q6 - q4),
        -2.0 + 6.0 * xi + r6 * a + eta * (r4 - r6),
        -eta * (p5 + p4),
        eta * (q4 - q5),
        -eta * (r5 - r4),
    ];
    let hy_xi = [
        t6 * a + eta * (t5 - t6),
        1.0 + r6 * a - eta * (r5 + r6),
        -q6 * a + eta * (q5 + q6),
        -t6 * a + eta * (t4 + t6),
        -1.0 + r6 * a + eta * (r4 - r6),
        -q6 * a - eta * (q4 - q6),
        -eta * (t4 + t5),
        eta * (r4 - r5),
        -eta * (q4 - q5),
    ];
    let hx_eta = [
        -p5 * b - xi * (p6 - p5),
        q5 * b - xi * (q5 + q6),
        -4.0 + 6.0 * (xi + eta) + r5 * b - xi * (r5 + r6),
        xi * (p4 + p6),
        xi * (q4 - q6),
        -xi * (r6 - r4),
        p5 * b - xi * (p4 + p5),
        q5 * b + xi * (q4 - q5),
        -2.0 + 6.0 * eta + r5 * b + xi * (r4 - r5),
    ];
    let hy_eta = [
        -t5 * b - xi * (t6 - t5),
        1.0 + r5 * b - xi * (r5 + r6),
        -q5 * b + xi * (q5 + q6),
        xi * (t4 + t6),
        xi * (r4 - r6),
        -xi * (q4 - q6),
        t5 * b - xi * (t4 + t5),
        -1.0 + r5 * b + xi * (r4 - r5),
        -q5 * b - xi * (q4 - q5),
    ];
    let inverse = 1.0 / d.double_area();
    SMatrix::from_fn(|row, i| {
        inverse
            * match row {
                0 => d.y31 * hx_xi[i] + d.y12 * hx_eta[i],
                1 => -d.x31 * hy_xi[i] - d.x12 * hy_eta[i],
                _ => -d.x31 * hx_xi[i] - d.x12 * hx_eta[i] + d.y31 * hy_xi[i] + d.y12 * hy_eta[i],
            }
    })
}

/// Mean curvatures [1/m] over (w, θx, θy).
pub(crate) fn mean_curvature(corners: &Corners) -> SMatrix<f64, 3, 9> {
    MIDSIDES.iter().fold(SMatrix::zeros(), |sum, &point| sum + curvature(corners, point) / 3.0)
}

/// Stiffness of the discrete Kirchhoff triangle; three points are exact.
pub fn discrete_kirchhoff(corners: &Corners, elastic: &PlaneStress, thickness: f64) -> Matrix9 {
    let stiffness = elastic.matrix * (thickness.powi(3) / 12.0);
    let weight = super::area(corners) / 3.0;
    MIDSIDES.iter().fold(Matrix9::zeros(), |sum, &point| {
        let b = curvature(corners, point);
        sum + b.transpose() * stiffness * b * weight
    })
}
