//! The number type of a kernel: `f64` for the reference, `f32` for the fast path.
//! Laws and elements are written once against it.

use std::fmt::Debug;
use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use serde::Serialize;
use serde::de::DeserializeOwned;

/// Number type of laws, tensors and elements: a real number, or a lane of them side by side.
pub trait Number:
    Copy
    + Debug
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + AddAssign
    + Sub<Output = Self>
    + SubAssign
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Zero.
    const ZERO: Self;
    /// One.
    const ONE: Self;
    /// The nearest representable number.
    fn of(value: f64) -> Self;
    /// self × factor + term, rounded once where the processor can.
    fn mul_add(self, factor: Self, term: Self) -> Self;
    /// One over the cube root of a positive number, to three units in the last place; meaningless for others.
    fn inverse_cbrt(self) -> Self;
    /// Cube root of a positive number, to four units in the last place; meaningless for others.
    #[inline(always)]
    fn cbrt(self) -> Self {
        let y = self.inverse_cbrt();
        self * y * y
    }
    /// Natural logarithm of 1 + self, accurate near zero.
    fn ln_1p(self) -> Self;
    /// Exponential function.
    fn exp(self) -> Self;
    /// Exponential function minus 1, accurate near zero.
    fn exp_m1(self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// The larger of two numbers; either of them if one is not a number.
    fn max(self, other: Self) -> Self;
    /// The magnitude of self with the sign of `sign`.
    fn copysign(self, sign: Self) -> Self;
    /// Numbers found from others lane by lane in double precision.
    fn lane_by_lane<const N: usize, const M: usize>(
        given: [Self; N],
        find: impl Fn([f64; N]) -> [f64; M],
    ) -> [Self; M];
}

/// A real number: single or double precision.
pub trait Real: Number + Default + PartialOrd + Serialize + DeserializeOwned + Sum {
    /// Relative spacing of the numbers near one.
    const EPSILON: f64;
    /// The word for it in reports: `single` or `double`.
    const PRECISION: &'static str;
    /// Converts to `f64`, exactly.
    fn to_f64(self) -> f64;
}

/// Takes a step of Householder's method of third order: with r = 1 − x y³, y ← y (1 + r/3 + 2r²/9). It leaves
/// 14/3 of the third power of the relative error.
#[inline(always)]
pub fn closer_to_inverse_cbrt<N: Number>(x: N, y: N) -> N {
    let r = (x * y).mul_add(-(y * y), N::ONE);
    (y * r).mul_add(r.mul_add(N::of(2.0 / 9.0), N::of(1.0 / 3.0)), y)
}

macro_rules! real {
    ($type:ty, $precision:literal, $guess:expr, $iterations:literal) => {
        impl Real for $type {
            const EPSILON: f64 = <$type>::EPSILON as f64;
            const PRECISION: &'static str = $precision;
            #[inline(always)]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
        }

        impl Number for $type {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            #[inline(always)]
            fn of(value: f64) -> Self {
                value as Self
            }
            #[inline(always)]
            fn mul_add(self, factor: Self, term: Self) -> Self {
                // Not the library's: without the instruction it takes a hundred times as long.
                self * factor + term
            }
            #[inline(always)]
            fn inverse_cbrt(self) -> Self {
                // Minus a third of the exponent as first guess (4 % off), then two or three steps without a
                // division.
                // Below 0 and for NaN, where there is no root to find, the difference wraps.
                let mut y = Self::from_bits($guess.wrapping_sub(self.to_bits() / 3));
                for _ in 0..$iterations {
                    y = closer_to_inverse_cbrt(self, y);
                }
                y
            }
            #[inline(always)]
            fn ln_1p(self) -> Self {
                self.ln_1p()
            }
            #[inline(always)]
            fn exp(self) -> Self {
                self.exp()
            }
            #[inline(always)]
            fn exp_m1(self) -> Self {
                self.exp_m1()
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                self.sqrt()
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                self.max(other)
            }
            #[inline(always)]
            fn copysign(self, sign: Self) -> Self {
                self.copysign(sign)
            }
            fn lane_by_lane<const N: usize, const M: usize>(
                given: [Self; N],
                find: impl Fn([f64; N]) -> [f64; M],
            ) -> [Self; M] {
                find(given.map(f64::from)).map(|number| number as Self)
            }
        }
    };
}

real!(f32, "single", 1_419_916_000_u32, 2);
real!(f64, "double", 1_430_188_294_u64 << 32, 3);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cube_roots_are_accurate_over_all_volume_ratios() {
        // Three units in the last place: the rounding of the last iteration.
        let check = |x: f64| {
            let (double, single) = (Number::cbrt(x) / x.cbrt() - 1.0, x as f32);
            assert!(double.abs() < 3.0 * f64::EPSILON, "{x}: {double:e}");
            let single = f64::from(Number::cbrt(single)) / f64::from(single).cbrt() - 1.0;
            assert!(single.abs() < 3.0 * f64::from(f32::EPSILON), "{x}: {single:e}");
        };
        (1..4000).for_each(|n| check(f64::from(n) * 1e-3));
        [1e-20, 1e20].into_iter().for_each(check);
    }

    /// Inverted and blown-up cells ask for such roots; their energy ends the run. Fails in the profile `dev`,
    /// which checks overflow.
    #[test]
    fn cube_roots_of_what_has_none_are_no_overflow() {
        for x in [-1e-3, f64::NAN, f64::NEG_INFINITY] {
            let _ = (Number::cbrt(x), Number::cbrt(x as f32));
        }
    }
}
