//! The number type of a kernel: `f64` for the reference, `f32` for the fast path.
//! Laws and elements are written once against it.

use std::fmt::Debug;
use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A real number that the kernels can run in.
pub trait Real:
    Copy
    + Debug
    + Default
    + PartialOrd
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
    + Sum
{
    /// Zero.
    const ZERO: Self;
    /// One.
    const ONE: Self;
    /// Relative spacing of the numbers near one.
    const EPSILON: f64;
    /// The word for it in reports: `single` or `double`.
    const PRECISION: &'static str;
    /// The nearest representable number.
    fn of(value: f64) -> Self;
    /// As `f64`, exactly.
    fn to_f64(self) -> f64;
    /// Cube root.
    fn cbrt(self) -> Self;
    /// Natural logarithm of 1 + self, accurate near zero.
    fn ln_1p(self) -> Self;
}

macro_rules! real {
    ($type:ty, $precision:literal) => {
        impl Real for $type {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const EPSILON: f64 = <$type>::EPSILON as f64;
            const PRECISION: &'static str = $precision;
            #[inline(always)]
            fn of(value: f64) -> Self {
                value as Self
            }
            #[inline(always)]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
            #[inline(always)]
            fn cbrt(self) -> Self {
                self.cbrt()
            }
            #[inline(always)]
            fn ln_1p(self) -> Self {
                self.ln_1p()
            }
        }
    };
}

real!(f32, "single");
real!(f64, "double");
