//! Second derivatives of barriers. Nearest points at parameters y minimise the distance d = |Σ c(y) x|. Hence
//! ∂²d/∂x² = f_xx − f_xy f_yy⁻¹ f_yx. Let directions y have orthonormal tangents t, and let g be the slope of
//! c and n the normal. Then this matrix is Σ (c⊗s)(c⊗s)ᵀ/d over tangents s along which no nearest point goes.
//! Each direction subtracts (g⊗n)(c⊗t)ᵀ + (c⊗t)(g⊗n)ᵀ + d (g⊗n)(g⊗n)ᵀ. A barrier pushes, b' ≤ 0, so that its
//! stiffness keeps the positive part of −∂²d/∂x². Slopes g of different directions are orthogonal. The
//! positive part then has rank one for each, in closed form.

use nalgebra::{Matrix2, Matrix3, SMatrix, SVector, Vector3};

use super::collisions::Mollified;
use super::distance::{Mollifier, Nearest, Region};

/// Three rows and columns for each of four nodes.
pub type Matrix12 = SMatrix<f64, 12, 12>;
type Vector12 = SVector<f64, 12>;

/// c ⊗ v.
pub(super) fn spread(coefficients: &[f64; 4], v: &Vector3<f64>) -> Vector12 {
    Vector12::from_fn(|k, _| coefficients[k / 3] * v[k % 3])
}

/// c cᵀ ⊗ M.
pub(super) fn block(c: &[f64; 4], m: &Matrix3<f64>) -> Matrix12 {
    Matrix12::from_fn(|i, j| c[i / 3] * c[j / 3] * m[(i % 3, j % 3)])
}

/// A way that both nearest points go together on their primitives.
struct Direction {
    /// The unit tangent t.
    tangent: Vector3<f64>,
    /// The slope g of coefficients [1/m] along it.
    slope: [f64; 4],
}

/// Slopes of coefficients, one for each parameter of the nearest points.
fn slopes(near: &Nearest) -> ([[f64; 4]; 2], usize) {
    let none = [0.0; 4];
    let c = &near.coefficients;
    match near.region {
        Region::Face => ([[0.0, 1.0, -1.0, 0.0], [0.0, 1.0, 0.0, -1.0]], 2),
        Region::Edges => ([[-1.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, -1.0]], 2),
        Region::Edge => {
            // The two of a sign are the ends of the edge.
            let positive = c.iter().filter(|&&c| c > 0.0).count();
            let is_end = |c: f64| if positive == 2 { c > 0.0 } else { c < 0.0 };
            let mut slope = none;
            let mut sign = 1.0;
            for (slope, _) in slope.iter_mut().zip(c).filter(|(_, c)| is_end(**c)) {
                *slope = sign;
                sign = -1.0;
            }
            ([slope, none], 1)
        }
        Region::Point => ([none; 2], 0),
    }
}

/// Directions with orthonormal tangents and orthogonal slopes; none of primitives that are degenerate.
fn directions(points: &[Vector3<f64>; 4], near: &Nearest) -> [Option<Direction>; 2] {
    let (slopes, count) = slopes(near);
    let ways = slopes.map(|slope| -> Vector3<f64> { (0..4).map(|i| points[i] * slope[i]).sum() });
    if count < 2 {
        let length = ways[0].norm();
        let along = || Direction { tangent: ways[0] / length, slope: slopes[0].map(|c| c / length) };
        return [(length > 0.0).then(along), None];
    }
    // Of slopes C and tangents G: the eigenvectors of L⁻¹ C L⁻ᵀ with G = L Lᵀ.
    let dot = |a: &[f64; 4], b: &[f64; 4]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    let gram = Matrix2::from_fn(|i, j| ways[i].dot(&ways[j]));
    let Some(factor) = gram.cholesky() else { return [None, None] };
    let Some(inverse) = factor.l().try_inverse() else { return [None, None] };
    let of_slopes = Matrix2::from_fn(|i, j| dot(&slopes[i], &slopes[j]));
    let whitened = inverse * of_slopes * inverse.transpose();
    let parameters = inverse.transpose() * whitened.symmetric_eigen().eigenvectors;
    [0, 1].map(|k| {
        let [p, q] = [parameters[(0, k)], parameters[(1, k)]];
        Some(Direction {
            tangent: ways[0] * p + ways[1] * q,
            slope: std::array::from_fn(|i| slopes[0][i] * p + slopes[1][i] * q),
        })
    })
}

/// The positive part [1/m] of −∂²d/∂x².
pub(super) fn bent(points: &[Vector3<f64>; 4], near: &Nearest) -> Matrix12 {
    let mut sum = Matrix12::zeros();
    let size = near.coefficients.iter().map(|c| c * c).sum::<f64>();
    for Direction { tangent, slope } in directions(points, near).into_iter().flatten() {
        let squared = slope.iter().map(|c| c * c).sum::<f64>();
        // Of the matrix 0, |c||g|; |c||g|, d |g|² on the unit vectors along c⊗t and g⊗n.
        let half = 0.5 * near.distance * squared;
        let value = half + (half * half + size * squared).sqrt();
        let vector = spread(&near.coefficients, &tangent) * squared + spread(&slope, &near.normal) * value;
        let length = squared * (size * squared + value * value);
        sum.ger(value / length, &vector, &vector, 1.0);
    }
    sum
}

/// ∂²d/∂x² [1/m].
fn second_derivative(points: &[Vector3<f64>; 4], near: &Nearest) -> Matrix12 {
    let c = &near.coefficients;
    let mut free = Matrix3::identity() - near.normal * near.normal.transpose();
    let mut sum = Matrix12::zeros();
    for Direction { tangent, slope } in directions(points, near).into_iter().flatten() {
        free -= tangent * tangent.transpose();
        let (across, along) = (spread(&slope, &near.normal), spread(c, &tangent));
        sum.ger(-1.0, &across, &along, 1.0);
        sum.ger(-1.0, &along, &across, 1.0);
        sum.ger(-near.distance, &across, &across, 1.0);
    }
    sum + block(c, &(free / near.distance))
}

/// Returns the positive part [N/m] of the stiffness of edges that are nearly parallel: m B'' ∇d∇dᵀ + m B'
/// ∂²d + ∇m∇Bᵀ + ∇B∇mᵀ + B ∂²m. Here B'' [N/m] is the curvature of the pair.
pub(super) fn of_parallel(
    points: &[Vector3<f64>; 4],
    near: &Nearest,
    curvature: f64,
    with: &Mollified,
) -> Matrix12 {
    let mollifier = Mollifier::of(points, with.threshold);
    let along = spread(&near.coefficients, &near.normal);
    let aside = Vector12::from_fn(|k, _| mollifier.gradient[k / 3][k % 3]);
    let mut sum = second_derivative(points, near) * (-with.force * mollifier.value);
    sum.ger(curvature, &along, &along, 1.0);
    sum.ger(-with.force, &along, &aside, 1.0);
    sum.ger(-with.force, &aside, &along, 1.0);
    sum += mollifier.second_derivative(points, with.threshold) * with.energy;
    positive(&sum)
}

/// The positive part of a symmetric matrix.
fn positive(of: &Matrix12) -> Matrix12 {
    let eigen = of.symmetric_eigen();
    let mut sum = Matrix12::zeros();
    for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value > 0.0 {
            sum.ger(*value, &vector, &vector, 1.0);
        }
    }
    sum
}

impl Mollifier {
    /// ∂²m/∂x² [1/m²] of edges whose threshold is e [m⁴].
    fn second_derivative(&self, [a, b, c, d]: &[Vector3<f64>; 4], threshold: f64) -> Matrix12 {
        let (first, second) = (b - a, d - c);
        let x = first.cross(&second).norm_squared() / threshold;
        if x >= 1.0 || threshold <= 0.0 {
            return Matrix12::zeros();
        }
        // Of |e₁ × e₂|² = |e₁|² |e₂|² − (e₁·e₂)².
        let flat = |e: &Vector3<f64>| (Matrix3::identity() * e.norm_squared() - e * e.transpose()) * 2.0;
        let (of_first, other) = (flat(&second), flat(&first));
        let both = first * second.transpose() * 4.0
            - second * first.transpose() * 2.0
            - Matrix3::identity() * (2.0 * first.dot(&second));
        let slope = 2.0 * (1.0 - x) / threshold;
        let sign = [-1.0, 1.0, -1.0, 1.0];
        let mut sum = Matrix12::from_fn(|i, j| {
            let (row, column) = (i / 3, j / 3);
            let at = (i % 3, j % 3);
            let part = match (row < 2, column < 2) {
                (true, true) => of_first[at],
                (false, false) => other[at],
                (true, false) => both[at],
                (false, true) => both[(at.1, at.0)],
            };
            slope * sign[row] * sign[column] * part
        });
        // m'' = −2/e², and ∇|e₁ × e₂|² = ∇m/m'.
        let gradient = Vector12::from_fn(|k, _| self.gradient[k / 3][k % 3]);
        sum.ger(-2.0 / (threshold * threshold * slope * slope), &gradient, &gradient, 1.0);
        sum
    }
}

/// The positive part [1/m] of −∂n/∂x at a wall, by its normals n at h [m] ahead and behind along each axis.
pub(super) fn of_wall(normals: [[Vector3<f64>; 2]; 3], h: f64) -> Matrix3<f64> {
    let slopes = normals.map(|[ahead, behind]| (behind - ahead) / (2.0 * h));
    let matrix = Matrix3::from_columns(&slopes);
    let eigen = ((matrix + matrix.transpose()) * 0.5).symmetric_eigen();
    let values = eigen.eigenvalues.map(|value| value.max(0.0));
    eigen.eigenvectors * Matrix3::from_diagonal(&values) * eigen.eigenvectors.transpose()
}

#[cfg(test)]
mod tests {
    use pliant_testing::Random;

    use super::*;
    use crate::barrier::ccd::Kind;
    use crate::barrier::law::Barrier;

    /// The barrier of the pairs, which are at most 3.5 m apart: κ A = 1 N.
    const LAW: Barrier = Barrier { distance: 4.0 };

    fn threshold([a, b, c, d]: &[Vector3<f64>; 4]) -> f64 {
        Mollifier::threshold([(b - a).norm_squared(), (d - c).norm_squared()])
    }

    /// The gradient of the energy of a pair, with the nearest points and the mollifier that it is made of.
    fn gradient(kind: Kind, points: &[Vector3<f64>; 4], threshold: f64) -> (Vector12, Nearest, Mollifier) {
        let near = kind.nearest(points);
        let mollifier = Mollifier::of(points, threshold);
        let of_distance = spread(&near.coefficients, &near.normal);
        let of_mollifier = Vector12::from_fn(|k, _| mollifier.gradient[k / 3][k % 3]);
        let gradient = of_distance * (LAW.slope(near.distance) * mollifier.value)
            + of_mollifier * LAW.energy(near.distance);
        (gradient, near, mollifier)
    }

    /// The second derivative of the energy by differences of its gradient; none where the region changes.
    fn by_differences(kind: Kind, points: &[Vector3<f64>; 4], threshold: f64) -> Option<Matrix12> {
        let h = 1e-6;
        let region = kind.nearest(points).region;
        let mut sum = Matrix12::zeros();
        for k in 0..12 {
            let at = |by: f64| {
                let mut moved = *points;
                moved[k / 3][k % 3] += by;
                gradient(kind, &moved, threshold)
            };
            let [ahead, behind] = [at(h), at(-h)];
            if [&ahead, &behind].iter().any(|one| one.1.region != region) {
                return None;
            }
            sum.set_column(k, &((ahead.0 - behind.0) / (2.0 * h)));
        }
        Some((sum + sum.transpose()) * 0.5)
    }

    /// In each region the stiffness is the curvature along the distance and the positive part of the
    /// remaining differences of forces. For edges that are nearly parallel it is the positive part of the
    /// whole (A10).
    #[test]
    fn stiffness_is_the_positive_part_of_differences_of_forces() {
        let mut random = Random::new(12);
        let (mut counts, mut worst) = ([0; 5], [0.0_f64; 5]);
        for number in 0..4000 {
            let kind = if number % 2 == 0 { Kind::EdgeEdge } else { Kind::PointTriangle };
            let mut points: [Vector3<f64>; 4] = std::array::from_fn(|_| Vector3::from(random.vector()));
            if number % 8 == 0 {
                let turn = Vector3::from(random.vector()) * 0.03;
                points[3] = points[2] + (points[1] - points[0]) * (1.0 + 0.5 * random.number()) + turn;
            }
            let rest = if kind == Kind::EdgeEdge { threshold(&points) } else { 0.0 };
            let (_, near, mollifier) = gradient(kind, &points, rest);
            // Where distances are small, or edges quite parallel, third derivatives are large.
            let far = near.distance > 0.1 && mollifier.value > 0.01;
            let Some(whole) = by_differences(kind, &points, rest).filter(|_| far) else { continue };
            let [energy, force] = [LAW.energy(near.distance), -LAW.slope(near.distance)];
            let curvature = LAW.curvature(near.distance) * mollifier.value;
            let along = spread(&near.coefficients, &near.normal);
            let along = along * along.transpose() * curvature;
            let with = Mollified { threshold: rest, gradient: mollifier.gradient, energy, force };
            let (found, wanted, case) = match mollifier.value {
                1.0 => (
                    along + bent(&points, &near) * force,
                    along + positive(&(whole - along)),
                    near.region as usize,
                ),
                _ => (of_parallel(&points, &near, curvature, &with), positive(&whole), 4),
            };
            counts[case] += 1;
            worst[case] = worst[case].max((found - wanted).amax() / whole.amax());
            let least = found.symmetric_eigenvalues().min() / found.amax();
            assert!(least > -1e-12, "{number} {case}: {least:e}, {} {:?}", near.distance, near.region);
        }
        println!("{counts:?} pairs of each kind, off by {worst:?} of the largest entry");
        assert!(counts.iter().all(|&count| count > 100), "{counts:?}");
        assert!(worst.iter().all(|&off| off < 1e-6), "{worst:?}");
    }
}
