//! Numbers side by side, as wide as the processor's registers: kernels written once, for any [`pulp::Simd`].
//! Multiplications and additions are fused where the processor can.

use std::ops::{Add, Mul, Neg, Sub};

use pulp::Simd;

/// Numbers in a pack: the widest registers in double precision.
pub const PACK: usize = 8;

/// One number of each cell of a pack.
pub type Pack = [f64; PACK];

/// Numbers of neighbouring cells in a register.
#[derive(Clone, Copy, Debug)]
pub struct Lane<S: Simd> {
    simd: S,
    numbers: S::f64s,
}

impl<S: Simd> Lane<S> {
    /// Loads the numbers of one register of a pack.
    #[inline(always)]
    pub fn load(simd: S, pack: &Pack, register: usize) -> Self {
        Self { simd, numbers: S::as_simd_f64s(&pack[..]).0[register] }
    }

    /// Writes them into a pack.
    #[inline(always)]
    pub fn store(self, pack: &mut Pack, register: usize) {
        S::as_mut_simd_f64s(&mut pack[..]).0[register] = self.numbers;
    }

    /// One number in all lanes.
    #[inline(always)]
    pub fn splat(simd: S, number: f64) -> Self {
        Self { simd, numbers: simd.splat_f64s(number) }
    }

    /// Half of each number.
    #[inline(always)]
    pub fn half(self) -> Self {
        self * Self::splat(self.simd, 0.5)
    }

    /// This over another.
    #[inline(always)]
    pub fn over(self, other: Self) -> Self {
        Self { simd: self.simd, numbers: self.simd.div_f64s(self.numbers, other.numbers) }
    }

    /// Its square root.
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        Self { simd: self.simd, numbers: self.simd.sqrt_f64s(self.numbers) }
    }

    /// Selects the first of two numbers in lanes where this is less than another number, and else the second.
    #[inline(always)]
    pub fn if_less(self, than: Self, then: Self, other: Self) -> Self {
        let mask = self.simd.less_than_f64s(self.numbers, than.numbers);
        Self { simd: self.simd, numbers: self.simd.select_f64s(mask, then.numbers, other.numbers) }
    }

    /// a b + this.
    #[inline(always)]
    pub fn plus(self, a: Self, b: Self) -> Self {
        Self { simd: self.simd, numbers: self.simd.mul_add_e_f64s(a.numbers, b.numbers, self.numbers) }
    }

    /// This − a b.
    #[inline(always)]
    pub fn less(self, a: Self, b: Self) -> Self {
        Self { simd: self.simd, numbers: self.simd.negate_mul_add_e_f64s(a.numbers, b.numbers, self.numbers) }
    }
}

impl<S: Simd> Add for Lane<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { simd: self.simd, numbers: self.simd.add_f64s(self.numbers, other.numbers) }
    }
}

impl<S: Simd> Sub for Lane<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { simd: self.simd, numbers: self.simd.sub_f64s(self.numbers, other.numbers) }
    }
}

impl<S: Simd> Mul for Lane<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self { simd: self.simd, numbers: self.simd.mul_f64s(self.numbers, other.numbers) }
    }
}

impl<S: Simd> Neg for Lane<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { simd: self.simd, numbers: self.simd.neg_f64s(self.numbers) }
    }
}

/// Three lanes: a vector of each cell.
pub type Three<S> = [Lane<S>; 3];

/// A 3 × 3 matrix of each cell, row by row.
pub type Square<S> = [Three<S>; 3];

/// Three of anything, by their numbers. The closures of `map` and `from_fn` would stay calls, without the
/// instructions of a kernel.
#[inline(always)]
pub fn three<T>(of: impl Fn(usize) -> T) -> [T; 3] {
    [of(0), of(1), of(2)]
}

/// A B.
#[inline(always)]
pub fn times<S: Simd>(a: &Square<S>, b: &Square<S>) -> Square<S> {
    let entry = |row: &Three<S>, j: usize| (row[0] * b[0][j]).plus(row[1], b[1][j]).plus(row[2], b[2][j]);
    let row = |i: usize| [entry(&a[i], 0), entry(&a[i], 1), entry(&a[i], 2)];
    [row(0), row(1), row(2)]
}

/// A Bᵀ.
#[inline(always)]
pub fn times_transposed<S: Simd>(a: &Square<S>, b: &Square<S>) -> Square<S> {
    let row = |i: usize| [dot(&a[i], &b[0]), dot(&a[i], &b[1]), dot(&a[i], &b[2])];
    [row(0), row(1), row(2)]
}

/// A v.
#[inline(always)]
pub fn apply<S: Simd>(a: &Square<S>, v: &Three<S>) -> Three<S> {
    [dot(&a[0], v), dot(&a[1], v), dot(&a[2], v)]
}

/// a · b.
#[inline(always)]
pub fn dot<S: Simd>(a: &Three<S>, b: &Three<S>) -> Lane<S> {
    (a[0] * b[0]).plus(a[1], b[1]).plus(a[2], b[2])
}

/// a × b.
#[inline(always)]
pub fn cross<S: Simd>(a: &Three<S>, b: &Three<S>) -> Three<S> {
    let entry = |i: usize, j: usize| (a[i] * b[j]).less(a[j], b[i]);
    [entry(1, 2), entry(2, 0), entry(0, 1)]
}

/// Aᵀ.
#[inline(always)]
pub fn transpose<S: Simd>(a: &Square<S>) -> Square<S> {
    let row = |i: usize| [a[0][i], a[1][i], a[2][i]];
    [row(0), row(1), row(2)]
}

/// A + B.
#[inline(always)]
pub fn sum<S: Simd>(a: &Square<S>, b: &Square<S>) -> Square<S> {
    let row = |i: usize| [a[i][0] + b[i][0], a[i][1] + b[i][1], a[i][2] + b[i][2]];
    [row(0), row(1), row(2)]
}

/// A − B.
#[inline(always)]
pub fn difference<S: Simd>(a: &Square<S>, b: &Square<S>) -> Square<S> {
    let row = |i: usize| [a[i][0] - b[i][0], a[i][1] - b[i][1], a[i][2] - b[i][2]];
    [row(0), row(1), row(2)]
}

/// (A + Aᵀ)/2.
#[inline(always)]
pub fn symmetric<S: Simd>(a: &Square<S>) -> Square<S> {
    let mean = |i: usize, j: usize| (a[i][j] + a[j][i]).half();
    let (xy, xz, yz) = (mean(0, 1), mean(0, 2), mean(1, 2));
    [[a[0][0], xy, xz], [xy, a[1][1], yz], [xz, yz, a[2][2]]]
}

/// Adds half of S(v), S(v) b = v × b.
#[inline(always)]
pub fn add_half_skew<S: Simd>(a: &mut Square<S>, v: &Three<S>) {
    let [x, y, z] = three(|k| v[k].half());
    (a[0][1], a[1][0]) = (a[0][1] - z, a[1][0] + z);
    (a[0][2], a[2][0]) = (a[0][2] + y, a[2][0] - y);
    (a[1][2], a[2][1]) = (a[1][2] - x, a[2][1] + x);
}
