//! The rotation nearest to a matrix.

use nalgebra::{Matrix3, Rotation3, Vector3};

/// The rotation R with the largest tr(Rᵀ M), by the singular values of M (Kabsch 1976); none for M = 0.
///
/// ```
/// use nalgebra::{Matrix3, Rotation3, Vector3};
/// use pliant_mechanics::rotation::nearest_rotation;
/// let turn = Rotation3::new(Vector3::new(0.3, -0.2, 0.9));
/// let stretched = turn.matrix() * Matrix3::from_diagonal(&Vector3::new(1.5, 0.8, 1.1));
/// assert!((nearest_rotation(&stretched).matrix() - turn.matrix()).norm() < 1e-14);
/// ```
pub fn nearest_rotation(moment: &Matrix3<f64>) -> Rotation3<f64> {
    if *moment == Matrix3::zeros() {
        return Rotation3::identity();
    }
    let svd = moment.svd(true, true);
    let (Some(u), Some(vt)) = (svd.u, svd.v_t) else { return Rotation3::identity() };
    let sign = (u * vt).determinant().signum();
    let r = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * vt;
    Rotation3::from_matrix_unchecked(r)
}
