//! Vectors and tensors of three dimensions, generic over the number type of the kernel. Only what laws and
//! elements need; everything is inlined. Written out component by component: `array::map` is often left as a
//! call in the inner loop, which costs a third of the speed of a tet.

use std::ops::{Add, Mul, Neg, Sub};

use serde::{Deserialize, Serialize};

use crate::{Number, Real};

/// A vector in space.
pub type Vector<R> = [R; 3];

/// a + b.
#[inline(always)]
pub fn add<R: Number>(a: Vector<R>, b: Vector<R>) -> Vector<R> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// a − b.
#[inline(always)]
pub fn sub<R: Number>(a: Vector<R>, b: Vector<R>) -> Vector<R> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// s a.
#[inline(always)]
pub fn scale<R: Number>(a: Vector<R>, s: R) -> Vector<R> {
    [a[0] * s, a[1] * s, a[2] * s]
}

/// a · b.
#[inline(always)]
pub fn dot<R: Number>(a: Vector<R>, b: Vector<R>) -> R {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}

/// a × b.
#[inline(always)]
pub fn cross<R: Number>(a: Vector<R>, b: Vector<R>) -> Vector<R> {
    [minor(a[1], b[2], a[2], b[1]), minor(a[2], b[0], a[0], b[2]), minor(a[0], b[1], a[1], b[0])]
}

/// a b − c d.
#[inline(always)]
fn minor<R: Number>(a: R, b: R, c: R, d: R) -> R {
    a.mul_add(b, -(c * d))
}

/// A vector in another number type.
#[inline(always)]
pub fn cast<A: Real, B: Number>(a: Vector<A>) -> Vector<B> {
    [B::of(a[0].to_f64()), B::of(a[1].to_f64()), B::of(a[2].to_f64())]
}

/// A tensor of second order, rows first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tensor<R>(pub [[R; 3]; 3]);

impl<R: Number> Tensor<R> {
    /// The zero tensor.
    pub const ZERO: Self = Self([[R::ZERO; 3]; 3]);

    /// The identity.
    pub const IDENTITY: Self =
        Self([[R::ONE, R::ZERO, R::ZERO], [R::ZERO, R::ONE, R::ZERO], [R::ZERO, R::ZERO, R::ONE]]);

    /// a ⊗ b added to the tensor.
    #[inline(always)]
    pub fn add_outer(&mut self, a: Vector<R>, b: Vector<R>) {
        for (row, ai) in self.0.iter_mut().zip(a) {
            for (entry, bj) in row.iter_mut().zip(b) {
                *entry = ai.mul_add(bj, *entry);
            }
        }
    }

    /// T a.
    #[inline(always)]
    pub fn apply(&self, a: Vector<R>) -> Vector<R> {
        [dot(self.0[0], a), dot(self.0[1], a), dot(self.0[2], a)]
    }

    /// The transpose.
    #[inline(always)]
    pub fn transpose(&self) -> Self {
        let t = &self.0;
        Self([[t[0][0], t[1][0], t[2][0]], [t[0][1], t[1][1], t[2][1]], [t[0][2], t[1][2], t[2][2]]])
    }

    /// The determinant.
    #[inline(always)]
    pub fn determinant(&self) -> R {
        dot(self.0[0], cross(self.0[1], self.0[2]))
    }

    /// The cofactor matrix: T⁻ᵀ det T.
    #[inline(always)]
    pub fn cofactor(&self) -> Self {
        let [a, b, c] = self.0;
        Self([cross(b, c), cross(c, a), cross(a, b)])
    }

    /// T + s A.
    #[inline(always)]
    pub fn plus_scaled(&self, a: &Self, s: R) -> Self {
        let mut sum = *self;
        for (row, other) in sum.0.iter_mut().zip(a.0) {
            *row = [other[0].mul_add(s, row[0]), other[1].mul_add(s, row[1]), other[2].mul_add(s, row[2])];
        }
        sum
    }

    /// s T.
    #[inline(always)]
    pub fn scaled(&self, s: R) -> Self {
        let t = &self.0;
        Self([scale(t[0], s), scale(t[1], s), scale(t[2], s)])
    }

    /// The sum of the principal minors of order two.
    #[inline(always)]
    pub fn second_invariant(&self) -> R {
        let t = &self.0;
        minor(t[0][0], t[1][1], t[0][1], t[1][0])
            + minor(t[1][1], t[2][2], t[1][2], t[2][1])
            + minor(t[0][0], t[2][2], t[0][2], t[2][0])
    }

    /// The trace.
    #[inline(always)]
    pub fn trace(&self) -> R {
        self.0[0][0] + self.0[1][1] + self.0[2][2]
    }

    /// T S with a symmetric S.
    #[inline(always)]
    pub fn times_symmetric(&self, s: &Symmetric<R>) -> Self {
        let [xx, yy, zz, xy, yz, xz] = s.0;
        let columns = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
        let mut product = Self::ZERO;
        for (out, row) in product.0.iter_mut().zip(self.0) {
            *out = [dot(row, columns[0]), dot(row, columns[1]), dot(row, columns[2])];
        }
        product
    }
}

/// A symmetric tensor in the order 11, 22, 33, 12, 23, 13.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Symmetric<R>(pub [R; 6]);

impl<R: Number> Symmetric<R> {
    /// The zero tensor.
    pub const ZERO: Self = Self([R::ZERO; 6]);

    /// The identity.
    pub const IDENTITY: Self = Self([R::ONE, R::ONE, R::ONE, R::ZERO, R::ZERO, R::ZERO]);

    /// a ⊗ a.
    #[inline(always)]
    pub fn dyad(a: Vector<R>) -> Self {
        Self([a[0] * a[0], a[1] * a[1], a[2] * a[2], a[0] * a[1], a[1] * a[2], a[0] * a[2]])
    }

    /// Tᵀ T + T + Tᵀ: C − I from the displacement gradient T.
    #[inline(always)]
    pub fn green_lagrange_twice(h: &Tensor<R>) -> Self {
        let t = h.transpose().0;
        let entry = |i: usize, j: usize| h.0[i][j] + h.0[j][i] + dot(t[i], t[j]);
        Self([entry(0, 0), entry(1, 1), entry(2, 2), entry(0, 1), entry(1, 2), entry(0, 2)])
    }

    /// The trace.
    #[inline(always)]
    pub fn trace(&self) -> R {
        self.0[0] + self.0[1] + self.0[2]
    }

    /// a · S a.
    #[inline(always)]
    pub fn quadratic(&self, a: Vector<R>) -> R {
        dot(a, self.apply(a))
    }

    /// S a.
    #[inline(always)]
    pub fn apply(&self, a: Vector<R>) -> Vector<R> {
        let [xx, yy, zz, xy, yz, xz] = self.0;
        [dot([xx, xy, xz], a), dot([xy, yy, yz], a), dot([xz, yz, zz], a)]
    }

    /// The cofactor matrix (= adjugate, since symmetric): S⁻¹ det S.
    #[inline(always)]
    pub fn cofactor(&self) -> Self {
        let [xx, yy, zz, xy, yz, xz] = self.0;
        Self([
            minor(yy, zz, yz, yz),
            minor(xx, zz, xz, xz),
            minor(xx, yy, xy, xy),
            minor(xz, yz, xy, zz),
            minor(xy, xz, xx, yz),
            minor(xy, yz, xz, yy),
        ])
    }

    /// A B for two symmetric tensors that commute, so that the product is symmetric too.
    #[inline(always)]
    pub fn commuting_product(&self, b: &Self) -> Self {
        let [a0, a1, a2, a3, a4, a5] = self.0;
        let [b0, b1, b2, b3, b4, b5] = b.0;
        Self([
            dot([a0, a3, a5], [b0, b3, b5]),
            dot([a3, a1, a4], [b3, b1, b4]),
            dot([a5, a4, a2], [b5, b4, b2]),
            dot([a0, a3, a5], [b3, b1, b4]),
            dot([a3, a1, a4], [b5, b4, b2]),
            dot([a0, a3, a5], [b5, b4, b2]),
        ])
    }

    /// S + s A.
    #[inline(always)]
    pub fn plus_scaled(&self, a: &Self, s: R) -> Self {
        let mut sum = *self;
        for (entry, other) in sum.0.iter_mut().zip(a.0) {
            *entry = other.mul_add(s, *entry);
        }
        sum
    }

    /// S + s I.
    #[inline(always)]
    pub(crate) fn plus_isotropic(&self, s: R) -> Self {
        let [xx, yy, zz, xy, yz, xz] = self.0;
        Self([xx + s, yy + s, zz + s, xy, yz, xz])
    }

    /// A : B.
    #[inline(always)]
    pub fn double_dot(&self, b: &Self) -> R {
        let [xx, yy, zz, xy, yz, xz] = self.0;
        let shear = dot([xy, yz, xz], [b.0[3], b.0[4], b.0[5]]);
        dot([xx, yy, zz], [b.0[0], b.0[1], b.0[2]]) + shear + shear
    }

    /// Returns the full tensor.
    #[inline(always)]
    pub fn full(&self) -> Tensor<R> {
        let [xx, yy, zz, xy, yz, xz] = self.0;
        Tensor([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    }

    /// F S Fᵀ.
    #[inline(always)]
    pub fn push_forward(&self, f: &Tensor<R>) -> Self {
        let p = f.times_symmetric(self).0;
        let f = &f.0;
        Self([
            dot(p[0], f[0]),
            dot(p[1], f[1]),
            dot(p[2], f[2]),
            dot(p[0], f[1]),
            dot(p[1], f[2]),
            dot(p[0], f[2]),
        ])
    }
}

impl<R: Number> Add for Symmetric<R> {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        let (a, b) = (self.0, b.0);
        Self([a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5]])
    }
}

impl<R: Number> Sub for Symmetric<R> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        let (a, b) = (self.0, b.0);
        Self([a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3], a[4] - b[4], a[5] - b[5]])
    }
}

impl<R: Number> Neg for Symmetric<R> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        let a = self.0;
        Self([-a[0], -a[1], -a[2], -a[3], -a[4], -a[5]])
    }
}

impl<R: Number> Mul<R> for Symmetric<R> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, s: R) -> Self {
        let a = self.0;
        Self([a[0] * s, a[1] * s, a[2] * s, a[3] * s, a[4] * s, a[5] * s])
    }
}
