//! Bending as in Comas (2010), section 8.3, with its typing errors corrected: a cubic deflection of nine
//! terms in the frame of the first edge. It serves only for comparison; see
//! [`Bending::Comas2010`](super::Bending::Comas2010).

use nalgebra::{SMatrix, Vector2};

use super::{Corners, Matrix9, PlaneStress, area};

/// (1, x, y, x², xy, y², x³, xy², y³) with its derivatives (p, p,y, −p,x).
fn row(at: Vector2<f64>) -> [[f64; 9]; 3] {
    let [x, y] = at.into();
    [
        [1.0, x, y, x * x, x * y, y * y, x * x * x, x * y * y, y * y * y],
        [0.0, 0.0, 1.0, 0.0, x, 2.0 * y, 0.0, 2.0 * x * y, 3.0 * y * y],
        [0.0, -1.0, 0.0, -2.0 * x, -y, 0.0, -3.0 * x * x, -y * y, 0.0],
    ]
}

/// Curvatures −(w,xx, w,yy, 2 w,xy) over the nine coefficients.
fn curvature(at: Vector2<f64>) -> SMatrix<f64, 3, 9> {
    let [x, y] = at.into();
    #[rustfmt::skip]
    let rows = [
        0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 6.0 * x, 0.0, 0.0,
        0.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 2.0 * x, 6.0 * y,
        0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 4.0 * y, 0.0,
    ];
    -SMatrix::<f64, 3, 9>::from_row_slice(&rows)
}

/// Stiffness of the element; not independent of the order of the corners.
///
/// Its 9 × 9 matrix of the polynomial at the corners has the determinant x₂⁵ y₃⁶. The matrix is singular only
/// if the area is zero; the stiffness is then not a number.
pub fn comas_2010(corners: &Corners, elastic: &PlaneStress, thickness: f64) -> Matrix9 {
    let [origin, second, _] = *corners;
    let along = (second - origin).normalize();
    let local = corners.map(|p| Vector2::new(along.dot(&(p - origin)), along.perp(&(p - origin))));
    let mut c = Matrix9::zeros();
    for (i, &corner) in local.iter().enumerate() {
        for (k, row) in row(corner).into_iter().enumerate() {
            c.set_row(3 * i + k, &row.into());
        }
    }
    let inverse = c.try_inverse().unwrap_or_else(|| Matrix9::repeat(f64::NAN));
    let stiffness = elastic.matrix * (thickness.powi(3) / 12.0);
    let weight = area(corners) / 3.0;
    let middles = [(0, 1), (1, 2), (2, 0)].map(|(i, j)| 0.5 * (local[i] + local[j]));
    let bending = middles.iter().fold(Matrix9::zeros(), |sum, &point| {
        let b = curvature(point) * inverse;
        sum + b.transpose() * stiffness * b * weight
    });
    // Rotations are given along x and y of the corners' coordinates.
    let mut turn = Matrix9::identity();
    for i in (0..9).step_by(3) {
        turn[(i + 1, i + 1)] = along.x;
        turn[(i + 1, i + 2)] = along.y;
        turn[(i + 2, i + 1)] = -along.y;
        turn[(i + 2, i + 2)] = along.x;
    }
    turn.transpose() * bending * turn
}
