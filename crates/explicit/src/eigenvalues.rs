//! Largest eigenvalues of small symmetric matrices, without a branch, so that many are found side by side.
//!
//! *Nine rows*: Householder's reflections leave a tridiagonal matrix. Laguerre's iteration finds the largest
//! root of its characteristic polynomial. All roots are real, so from above it falls to the largest root and
//! never below (Wilkinson, *The Algebraic Eigenvalue Problem*, 1965, ch. 7). *Three rows*: Newton's method
//! finds the cosine of a third of an angle, from above.

use pliant_mechanics::Number;
use pliant_mechanics::tensor::{Symmetric, Vector, add, cross, dot, scale};

/// Rows of the matrix of a cell: three directions of displacement by three of its gradient.
pub(crate) const ROWS: usize = 9;

/// Turns of Laguerre's iteration. Near a simple root each turn cubes the error. A root met six times out of
/// nine, the worst case, leaves half of the error.
const TURNS_OF_LAGUERRE: usize = 9;
/// Turns of Newton's method, from at most 8 % above a cosine.
const TURNS_OF_NEWTON: usize = 4;
/// Beside numbers of any unit it is nothing, and keeps a quotient finite.
const TINY: f64 = 1e-100;

/// The largest eigenvalue of a symmetric matrix of nine rows, found from above. The matrix is overwritten.
#[inline(always)]
pub(crate) fn largest_of_nine<N: Number>(matrix: &mut [[N; ROWS]; ROWS]) -> N {
    let (diagonal, squares) = tridiagonal(matrix);
    let count = N::of(ROWS as f64);
    let others = N::of((ROWS - 1) as f64);
    let mut trace = N::ZERO;
    let mut norm = N::ZERO;
    for &a in &diagonal {
        trace += a;
        norm += a * a;
    }
    for &b in &squares {
        norm += b + b;
    }
    // No eigenvalue is further above the mean than √8 standard deviations.
    let mean = trace / count;
    let spread = ((norm / count - mean * mean).max(N::ZERO) * others).sqrt();
    let close = N::of(1e-14) * (norm.sqrt() + N::of(TINY));
    let mut x = mean + spread + close;
    for _ in 0..TURNS_OF_LAGUERRE {
        let [slope, bend] = logarithmic_derivatives(x, close, &diagonal, &squares);
        let root = (others * (count * bend - slope * slope).max(N::ZERO)).sqrt();
        x -= count / (slope + root);
    }
    x
}

/// p′/p and −(p′/p)′ of the characteristic polynomial p at an x above all its roots by no less than `close`.
#[inline(always)]
fn logarithmic_derivatives<N: Number>(
    x: N,
    close: N,
    diagonal: &[N; ROWS],
    squares: &[N; ROWS - 1],
) -> [N; 2] {
    // d of each row is (x − a) − b²/d of the row before, and p is the product of all.
    let (mut inverse, mut first, mut second) = (N::ZERO, N::ZERO, N::ZERO);
    let (mut slope, mut bend) = (N::ZERO, N::ZERO);
    for row in 0..ROWS {
        let before = if row == 0 { N::ZERO } else { squares[row - 1] * inverse };
        inverse = N::ONE / (x - diagonal[row] - before).max(close);
        // d′/d and d″/d.
        (first, second) =
            ((N::ONE + before * first) * inverse, before * (second - (first + first) * first) * inverse);
        slope += first;
        bend += first * first - second;
    }
    [slope, bend]
}

/// Returns the diagonal, and the squares of the entries next to the diagonal, of a tridiagonal matrix with
/// the same eigenvalues.
#[inline(always)]
fn tridiagonal<N: Number>(m: &mut [[N; ROWS]; ROWS]) -> ([N; ROWS], [N; ROWS - 1]) {
    let mut squares = [N::ZERO; ROWS - 1];
    for k in 0..ROWS - 2 {
        let mut v = [N::ZERO; ROWS];
        let mut square = N::ZERO;
        for i in k + 1..ROWS {
            v[i] = m[i][k];
            square += v[i] * v[i];
        }
        let norm = square.sqrt();
        let first = v[k + 1];
        v[k + 1] = first + norm.copysign(first);
        // 2/|v|²; where v is zero nothing is reflected.
        let twice = N::ONE / (square + (first * v[k + 1] - first * first) + N::of(TINY));
        let mut w = [N::ZERO; ROWS];
        let mut along = N::ZERO;
        for i in k + 1..ROWS {
            let mut product = N::ZERO;
            for j in k + 1..ROWS {
                product += m[i][j] * v[j];
            }
            w[i] = product * twice;
            along += v[i] * w[i];
        }
        let half = N::of(0.5) * twice * along;
        for i in k + 1..ROWS {
            w[i] -= half * v[i];
        }
        for i in k + 1..ROWS {
            for j in k + 1..ROWS {
                m[i][j] -= v[i] * w[j] + w[i] * v[j];
            }
        }
        squares[k] = square;
    }
    squares[ROWS - 2] = m[ROWS - 1][ROWS - 2] * m[ROWS - 1][ROWS - 2];
    let mut diagonal = [N::ZERO; ROWS];
    for (row, a) in diagonal.iter_mut().enumerate() {
        *a = m[row][row];
    }
    (diagonal, squares)
}

/// The largest eigenvalue of a symmetric tensor.
#[inline(always)]
pub(crate) fn largest_of_three<N: Number>(tensor: &Symmetric<N>) -> N {
    let mean = tensor.trace() * N::of(1.0 / 3.0);
    let deviator = tensor.plus_scaled(&Symmetric::IDENTITY, -mean);
    let size = (deviator.double_dot(&deviator) * N::of(1.0 / 6.0)).sqrt() + N::of(TINY);
    let unit = deviator * (N::ONE / size);
    // cos 3θ of the largest eigenvalue mean + 2 size cos θ.
    let [xx, yy, zz, xy, yz, xz] = unit.0;
    let determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
    let triple = (determinant * N::of(0.5)).max(-N::ONE);
    // t = cos θ is the largest root of 4t³ − 3t − cos 3θ; ½ + √((1 + cos 3θ)/6) lies above it.
    let above = (N::ONE + triple).max(N::ZERO) * N::of(1.0 / 6.0);
    let mut t = N::of(0.5) + above.sqrt();
    for _ in 0..TURNS_OF_NEWTON {
        let square = t * t;
        let value = t * (N::of(4.0) * square - N::of(3.0)) - triple;
        // Where the two largest eigenvalues meet, value and slope are zero at ½.
        t = (t - value / (N::of(12.0) * square - N::of(3.0)).max(N::of(1e-7))).max(N::of(0.5));
    }
    mean + (size + size) * t
}

/// A unit eigenvector of an eigenvalue; of one met twice, this vector instead.
#[inline(always)]
pub(crate) fn eigenvector<N: Number>(tensor: &Symmetric<N>, eigenvalue: N, instead: Vector<N>) -> Vector<N> {
    let [a, b, c] = tensor.plus_scaled(&Symmetric::IDENTITY, -eigenvalue).full().0;
    // Each product is the eigenvector times a number. The sign of this number follows the first product, or
    // the sum of the earlier ones.
    let mut sum = cross(a, b);
    for product in [cross(b, c), cross(c, a)] {
        let sign = N::ONE.copysign(dot(sum, product));
        sum = add(sum, scale(product, sign));
    }
    // Far below what the products of another eigenvalue leave.
    let scale_of = tensor.double_dot(tensor);
    let sum = add(sum, scale(instead, N::of(1e-15) * scale_of + N::of(TINY)));
    scale(sum, N::ONE / dot(sum, sum).sqrt())
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, SMatrix};

    use super::*;

    /// Numbers between −1 and 1, the same in every run.
    fn random() -> impl FnMut() -> f64 {
        let mut seed = 7_u64;
        move || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        }
    }

    fn sorted(values: &nalgebra::Vector3<f64>) -> [f64; 3] {
        let mut values = [values.x, values.y, values.z];
        values.sort_by(f64::total_cmp);
        values
    }

    fn of_nine(matrix: &SMatrix<f64, ROWS, ROWS>) -> f64 {
        largest_of_nine(&mut std::array::from_fn(|i| std::array::from_fn(|j| matrix[(i, j)])))
    }

    #[test]
    fn the_largest_of_nine_rows_is_that_of_another_library() {
        let mut random = random();
        for size in [1e-6, 1.0, 1e9] {
            for _ in 0..50 {
                let any = SMatrix::<f64, ROWS, ROWS>::from_fn(|_, _| size * random());
                let matrix = any + any.transpose();
                let (found, known) = (of_nine(&matrix), matrix.symmetric_eigenvalues().max());
                assert!((found / known - 1.0).abs() < 1e-10, "{found:e} for {known:e}");
            }
        }
    }

    /// Six equal eigenvalues at the top are the worst case: the result exceeds them by the rest of the error
    /// at the start.
    #[test]
    fn one_met_several_times_is_found_from_above() {
        let mut random = random();
        for times in 1..=ROWS {
            let vectors = SMatrix::<f64, ROWS, ROWS>::from_fn(|_, _| random()).qr().q();
            let values = SMatrix::<f64, ROWS, ROWS>::from_fn(|i, j| match i == j {
                true if i < times => 3.0,
                true => 1.0 + 0.1 * i as f64,
                false => 0.0,
            });
            let found = of_nine(&(vectors * values * vectors.transpose()));
            assert!((3.0 - 1e-9..3.0 + 2e-3).contains(&found), "{times} times: {found}");
        }
        assert!(of_nine(&SMatrix::zeros()).abs() < 1e-90);
    }

    #[test]
    fn the_largest_of_three_rows_and_its_vector_are_those_of_another_library() {
        let mut random = random();
        let mut tensors: Vec<[f64; 6]> = (0..200).map(|_| std::array::from_fn(|_| 1e4 * random())).collect();
        // Two equal ones below and above, and three.
        tensors.extend([
            [3.0, 1.0, 1.0, 0.0, 0.0, 0.0],
            [3.0, 3.0, 1.0, 0.0, 0.0, 0.0],
            [2.0, 2.0, 2.0, 0.0, 0.0, 0.0],
        ]);
        // Two equal ones at the top, in any directions.
        tensors.extend((0..200).map(|_| {
            let axis = [random(), random(), random()];
            Symmetric([3e4, 3e4, 3e4, 0.0, 0.0, 0.0]).plus_scaled(&Symmetric::dyad(axis), -1e4).0
        }));
        for tensor in tensors.into_iter().map(Symmetric) {
            let full = tensor.full().0;
            let known = Matrix3::from_fn(|i, j| full[i][j]).symmetric_eigenvalues();
            let (found, size) = (largest_of_three(&tensor), known.amax());
            // Where the two largest are one, their cosine is a double root, which has half of the digits.
            let [_, middle, largest] = sorted(&known);
            let are_apart = largest - middle > 1e-6 * size;
            let digits = if are_apart { 1e-12 } else { 1e-8 };
            assert!((found - largest).abs() < digits * size, "{found} for {known}");
            let vector = eigenvector(&tensor, found, [1.0, 0.0, 0.0]);
            let left = tensor.plus_scaled(&Symmetric::IDENTITY, -found).apply(vector);
            assert!(!are_apart || dot(left, left).sqrt() < 1e-6 * size, "{vector:?} leaves {left:?}");
        }
    }
}
