//! Principal values and directions of a symmetric tensor by cyclic Jacobi rotations: no branch, no
//! convergence test, equal values welcome. Five rounds: each squares the off-diagonal part at least, 10⁻¹
//! becomes 10⁻¹⁶ in four.

use crate::Number;
use crate::tensor::{Symmetric, Vector};

const ROUNDS: usize = 5;

/// Keeps 0/0 from happening where a tensor is diagonal already; far below any strain.
const TINY: f64 = 1e-30;

/// Principal values, and the unit direction of each.
#[inline(always)]
pub(super) fn principal<R: Number>(s: &Symmetric<R>) -> ([R; 3], [Vector<R>; 3]) {
    let [xx, yy, zz, xy, yz, xz] = s.0;
    let (o, l) = (R::ZERO, R::ONE);
    let mut turning = Turning {
        diagonal: [xx, yy, zz],
        beside: [yz, xz, xy],
        directions: [[l, o, o], [o, l, o], [o, o, l]],
    };
    for _ in 0..ROUNDS {
        turning.annihilate(0, 1, 2);
        turning.annihilate(0, 2, 1);
        turning.annihilate(1, 2, 0);
    }
    (turning.diagonal, turning.directions)
}

/// A tensor on its way to its principal axes.
struct Turning<R> {
    diagonal: [R; 3],
    /// The off-diagonal entries, each at the index that is neither its row nor its column.
    beside: [R; 3],
    /// The axes so far.
    directions: [Vector<R>; 3],
}

impl<R: Number> Turning<R> {
    /// Turns the axes p and q until the entry between them is zero; r is the third axis (Golub and Van Loan
    /// 8.5.2).
    #[inline(always)]
    fn annihilate(&mut self, p: usize, q: usize, r: usize) {
        let between = self.beside[r];
        let difference = self.diagonal[q] - self.diagonal[p];
        let root = (difference * difference + R::of(4.0) * between * between).sqrt();
        let whole = difference + (root + R::of(TINY)).copysign(difference);
        let tangent = R::of(2.0) * between / whole;
        let cosine = R::ONE / (R::ONE + tangent * tangent).sqrt();
        let sine = tangent * cosine;
        self.diagonal[p] -= tangent * between;
        self.diagonal[q] += tangent * between;
        self.beside[r] = R::ZERO;
        let (pr, qr) = (self.beside[q], self.beside[p]);
        self.beside[q] = cosine * pr - sine * qr;
        self.beside[p] = sine * pr + cosine * qr;
        let (a, b) = (self.directions[p], self.directions[q]);
        for k in 0..3 {
            self.directions[p][k] = cosine * a[k] - sine * b[k];
            self.directions[q][k] = sine * a[k] + cosine * b[k];
        }
    }
}

#[cfg(test)]
mod tests {
    use pliant_testing::Random;

    use super::*;
    use crate::Real;
    use crate::tensor::{dot, scale, sub};

    fn check<R: Real>(s: [f64; 6]) {
        let size = s.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
        let tensor = Symmetric([0, 1, 2, 3, 4, 5].map(|k| R::of(s[k])));
        let (values, directions) = principal(&tensor);
        for i in 0..3 {
            let residual = sub(tensor.apply(directions[i]), scale(directions[i], values[i]));
            // Fifteen rotations, each with a few roundings of the size of the tensor.
            assert!(dot(residual, residual).to_f64().sqrt() <= 30.0 * R::EPSILON * size, "{s:?}");
            for j in 0..3 {
                let expected = f64::from(u8::from(i == j));
                let product = dot(directions[i], directions[j]).to_f64();
                assert!((product - expected).abs() <= 30.0 * R::EPSILON, "{s:?}");
            }
        }
    }

    #[test]
    fn principal_axes_of_any_tensor_even_with_equal_values() {
        let mut numbers = Random::new(1);
        let mut random = || numbers.number();
        for _ in 0..2000 {
            let s = [0; 6].map(|_| random());
            // As it is, tiny, nearly spherical, and of rank one (two equal values).
            let (size, rank_one) = (s.map(|x| 1e-6 * x), [s[0], s[1], s[2]]);
            let nearly = [1.0 + 1e-9 * s[0], 1.0 + 1e-9 * s[1], 1.0, 1e-9 * s[3], 1e-12 * s[4], 0.0];
            for tensor in [s, size, nearly, Symmetric::dyad(rank_one).0] {
                check::<f64>(tensor);
                check::<f32>(tensor);
            }
        }
        check::<f64>([0.0; 6]);
        check::<f64>([2.0, 2.0, 2.0, 0.0, 0.0, 0.0]);
        check::<f64>([0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
    }
}
