//! Finite rotations as quaternions and rotation vectors: the maps between them and the derivative of the
//! logarithm. A *spin* δω turns R into exp(S(δω)) R, in space. Felippa and Haugen (2005), appendix; Caselli
//! and Bisegna (2013).

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

/// S(a): S(a) b = a × b.
pub fn skew(a: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -a.z, a.y, a.z, 0.0, -a.x, -a.y, a.x, 0.0)
}

/// Coefficients of the series of arcsin(x)/x in x².
pub(crate) const ARCSINE: [f64; 13] = {
    let (mut terms, mut k) = ([1.0; 13], 0);
    while k < 12 {
        let odd = (2 * k + 1) as f64;
        terms[k + 1] = terms[k] * odd * odd / ((odd + 1.0) * (odd + 2.0));
        k += 1;
    }
    terms
};

/// |B₂ₙ|/(2n)! from n = 1 on, with Bernoulli's numbers.
pub(crate) const BERNOULLI: [f64; 8] = [
    1.0 / 12.0,
    1.0 / 720.0,
    1.0 / 30_240.0,
    1.0 / 1_209_600.0,
    1.0 / 47_900_160.0,
    691.0 / 1_307_674_368_000.0,
    1.0 / 74_724_249_600.0,
    3_617.0 / 10_670_622_842_880_000.0,
];

/// The angle [rad] below which the series of [`eta`] and [`mu`] leave out less than a rounding.
const SERIES: f64 = 0.6;

/// The sine squared of half the angle below which [`logarithm`] takes a series, for most nodes of shells. A
/// series takes a third of the time of an arctangent. The angle is then below half a radian.
pub const SMALL: f64 = 0.06;

/// Σ cₖ xᵏ.
#[inline(always)]
fn series(x: f64, coefficients: impl DoubleEndedIterator<Item = f64>) -> f64 {
    coefficients.rev().fold(0.0, |sum, c| sum * x + c)
}

/// The rotation vector [rad] of a rotation, of length at most π; accurate for small and large angles.
pub fn logarithm(rotation: &UnitQuaternion<f64>) -> Vector3<f64> {
    let sign = if rotation.w < 0.0 { -1.0 } else { 1.0 };
    let (vector, scalar) = (sign * rotation.imag(), sign * rotation.w);
    let squared = vector.norm_squared();
    let size = squared + scalar * scalar;
    if squared < SMALL * size {
        return vector * (2.0 * series(squared / size, ARCSINE.into_iter()) / size.sqrt());
    }
    let sine = squared.sqrt();
    vector * (2.0 * sine.atan2(scalar) / sine)
}

/// exp(S(a)) as a quaternion.
pub fn exponential(a: &Vector3<f64>) -> UnitQuaternion<f64> {
    let half = 0.5 * a.norm();
    let factor = if half < 1e-4 { 0.5 * (1.0 - half * half / 6.0) } else { 0.5 * half.sin() / half };
    UnitQuaternion::new_normalize(Quaternion::from_parts(half.cos(), factor * a))
}

/// (1 − (θ/2) cot(θ/2))/θ².
pub fn eta(angle: f64) -> f64 {
    let squared = angle * angle;
    if angle < SERIES {
        series(squared, BERNOULLI.into_iter())
    } else {
        (1.0 - 0.5 * angle / (0.5 * angle).tan()) / squared
    }
}

/// (dη/dθ)/θ.
pub fn mu(angle: f64) -> f64 {
    let squared = angle * angle;
    // The closed form loses all digits to cancellation as θ⁶/θ⁶.
    if angle < SERIES {
        series(squared, (1..BERNOULLI.len()).map(|n| 2.0 * n as f64 * BERNOULLI[n]))
    } else {
        let (sine, cosine) = angle.sin_cos();
        (squared + 4.0 * cosine + angle * sine - 4.0)
            / (4.0 * squared * squared * (0.5 * angle).sin().powi(2))
    }
}

/// H = I − S(θ)/2 + η S(θ)²: the change δθ = H δω of a rotation vector θ under a spin δω.
pub fn spin_to_vector(theta: &Vector3<f64>) -> Matrix3<f64> {
    let s = skew(theta);
    Matrix3::identity() - 0.5 * s + eta(theta.norm()) * s * s
}

/// ∂(Hᵀ m)/∂θ H for a fixed m: how a moment that is conjugate to spins changes with the spin.
#[cfg(test)]
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
        for length in [0.0, 1e-10, 1e-5, 0.3, 0.49, 0.496, 2.0, 3.1] {
            let a = Vector3::new(1.0, -2.0, 0.5).normalize() * length;
            assert!((logarithm(&exponential(&a)) - a).norm() < 1e-14, "{length}");
            // Many turns after each other leave a quaternion that is not quite of length 1.
            let long = UnitQuaternion::new_unchecked(exponential(&a).into_inner() * (1.0 + 1e-9));
            assert!((logarithm(&long) - a).norm() < 1e-14, "{length}");
        }
    }

    /// Series and closed form meet to what cancellation leaves of the latter.
    #[test]
    fn series_meet_the_closed_forms() {
        let [before, after] = [SERIES * (1.0 - 1e-15), SERIES];
        assert!((eta(before) - eta(after)).abs() < 1e-15 && (mu(before) - mu(after)).abs() < 1e-13);
        let h = 1e-4;
        for angle in [0.1, 0.5999, 0.6001, 1.0, 2.0] {
            let slope = (eta(angle + h) - eta(angle - h)) / (2.0 * h * angle);
            assert!((slope - mu(angle)).abs() < 1e-8, "{angle}: {slope} {}", mu(angle));
        }
    }
}
