//! The co-rotated linear law in closed form. P = 2μ (F − R) + λ tr(Rᵀ F − I) R is the exact gradient of its
//! energy (McAdams et al. 2011, ACM TOG 30:37). Its tangent is therefore symmetric. The cost is a sixth of
//! the differences that other laws take.

use nalgebra::{Matrix3, Vector3};
use pliant_mechanics::law::Corotational;
use pliant_mechanics::tensor::{Tensor, Vector};

use pliant_shells::Broken;
use pliant_shells::rotation::skew;

/// Adds the forces of a point of weight `w` [m³], and its stiffness where that is wanted; its energy [J/m³].
///
/// # Errors
/// If two principal stretches sum to nothing, so that the rotation has no derivative.
pub(super) fn add_point<const N: usize>(
    law: &Corotational,
    h: &Tensor<f64>,
    shape: &[Vector<f64>; N],
    w: f64,
    force: &mut [f64],
    tangent: Option<&mut [f64]>,
) -> Result<f64, Broken> {
    let f = Matrix3::from_fn(|i, j| h.0[i][j]) + Matrix3::identity();
    let (lambda, mu) = (law.lame, law.shear);
    let r = rotation(&f);
    let s = r.tr_mul(&f);
    let trace = s.trace() - 3.0;
    let stress = 2.0 * mu * (f - r) + lambda * trace * r;
    for (of_node, b) in force.chunks_exact_mut(3).zip(shape) {
        let nodal = stress * Vector3::from(*b) * w;
        of_node.iter_mut().zip(&nodal).for_each(|(entry, by)| *entry += by);
    }
    if let Some(k) = tangent {
        let spread = Matrix3::from_diagonal_element(s.trace()) - s;
        let inverse = spread.try_inverse().ok_or_else(|| Broken::Inverted(f.determinant()))?;
        for (b, gradient) in shape.iter().enumerate() {
            let gradient = Vector3::from(*gradient).transpose();
            for c in 0..3 {
                let df = Vector3::ith(c, 1.0) * gradient;
                let a = r.tr_mul(&df);
                let axial = Vector3::new(a[(2, 1)] - a[(1, 2)], a[(0, 2)] - a[(2, 0)], a[(1, 0)] - a[(0, 1)]);
                let dr = r * skew(&(inverse * axial));
                let dp = (2.0 * mu * (df - dr) + lambda * (a.trace() * r + trace * dr)) * w;
                let column = &mut k[(3 * b + c) * 3 * N..][..3 * N];
                for (of_node, g) in column.chunks_exact_mut(3).zip(shape) {
                    let nodal = dp * Vector3::from(*g);
                    of_node.iter_mut().zip(&nodal).for_each(|(entry, by)| *entry += by);
                }
            }
        }
    }
    Ok(mu * (f - r).norm_squared() + 0.5 * lambda * trace * trace)
}

/// The rotation of the polar decomposition of a matrix with positive determinant: Newton's iteration R ← (R +
/// R⁻ᵀ)/2, scaled (Higham 1986), to round-off.
fn rotation(f: &Matrix3<f64>) -> Matrix3<f64> {
    let mut r = *f;
    for _ in 0..40 {
        let Some(inverse) = r.try_inverse() else { return r };
        let scale = (inverse.norm() / r.norm()).sqrt();
        let next = 0.5 * (scale * r + inverse.transpose() / scale);
        let still = (next - r).norm() < 1e-15 * next.norm();
        r = next;
        if still {
            break;
        }
    }
    r
}
