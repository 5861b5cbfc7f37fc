//! Finite rotations as quaternions and rotation vectors: the maps between them and the derivative of the logarithm.
//! A *spin* δω turns R into exp(S(δω)) R, in space. Felippa and Haugen (2005), appendix; Caselli and Bisegna (2013).

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

/// S(a): S(a) b = a × b.
pub(crate) fn skew(a: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -a.z, a.y, a.z, 0.0, -a.x, -a.y, a.x, 0.0)
}

/// The rotation vector [rad] of a rotation, of length at most π; accurate for small and large angles.
pub(crate) fn logarithm(rotation: &UnitQuaternion<f64>) -> Vector3<f64> {
    let sign = if rotation.w < 0.0 { -1.0 } else { 1.0 };
    let (vector, scalar) = (sign * rotation.imag(), sign * rotation.w);
    let sine = vector.norm();
    // 2 atan2(s, w)/s tends to 2/w.
    if sine < 1e-8 { vector * (2.0 / scalar) } else { vector * (2.0 * sine.atan2(scalar) / sine) }
}

/// exp(S(a)) as a quaternion.
pub(crate) fn exponential(a: &Vector3<f64>) -> UnitQuaternion<f64> {
    let half = 0.5 * a.norm();
    let factor = if half < 1e-4 { 0.5 * (1.0 - half * half / 6.0) } else { 0.5 * half.sin() / half };
    UnitQuaternion::new_normalize(Quaternion::from_parts(half.cos(), factor * a))
}

/// (1 − (θ/2) cot(θ/2))/θ².
pub(crate) fn eta(angle: f64) -> f64 {
    let squared = angle * angle;
    if angle < 0.05 {
        1.0 / 12.0 + squared / 720.0 + squared * squared / 30240.0
    } else {
        (1.0 - 0.5 * angle / (0.5 * angle).tan()) / squared
    }
}

/// (dη/dθ)/θ.
pub(crate) fn mu(angle: f64) -> f64 {
    let squared = angle * angle;
    // The closed form loses all digits to cancellation as θ⁶/θ⁶; the series leaves out θ⁶.
    if angle < 0.2 {
        1.0 / 360.0 + squared / 7560.0 + squared * squared / 201_600.0
    } else {
        let (sine, cosine) = angle.sin_cos();
        (squared + 4.0 * cosine + angle * sine - 4.0)
            / (4.0 * squared * squared * (0.5 * angle).sin().powi(2))
    }
}

/// H = I − S(θ)/2 + η S(θ)²: the change δθ = H δω of a rotation vector θ under a spin δω.
pub(crate) fn spin_to_vector(theta: &Vector3<f64>) -> Matrix3<f64> {
    let s = skew(theta);
    Matrix3::identity() - 0.5 * s + eta(theta.norm()) * s * s
}

/// ∂(Hᵀ m)/∂θ H for a fixed m: how a moment that is conjugate to spins changes with the spin.
pub(crate) fn moment_correction(theta: &Vector3<f64>, moment: &Vector3<f64>) -> Matrix3<f64> {
    let s = skew(theta);
    let angle = theta.norm();
    let outer = Matrix3::from_diagonal_element(theta.dot(moment)) + theta * moment.transpose()
        - 2.0 * moment * theta.transpose();
    (eta(angle) * outer + mu(angle) * s * s * moment * theta.transpose() - 0.5 * skew(moment))
        * spin_to_vector(theta)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logarithm_undoes_the_exponential_up_to_half_a_turn() {
        for length in [0.0, 1e-10, 1e-5, 0.3, 2.0, 3.1] {
            let a = Vector3::new(1.0, -2.0, 0.5).normalize() * length;
            assert!((logarithm(&exponential(&a)) - a).norm() < 1e-14, "{length}");
        }
    }

    /// Series and closed form meet to what cancellation leaves of the latter.
    #[test]
    fn series_meet_the_closed_forms() {
        let h = 1e-4;
        for angle in [0.0499, 0.0501, 0.199, 0.201, 1.0, 2.0] {
            let slope = (eta(angle + h) - eta(angle - h)) / (2.0 * h * angle);
            assert!((slope - mu(angle)).abs() < 1e-6, "{angle}: {slope} {}", mu(angle));
        }
    }
}
