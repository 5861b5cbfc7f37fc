//! The number types that solids are solved in.

use crate::dynamic_relaxation::RelaxedIn;
use crate::stepper::SteppedIn;

/// A number type that solids are solved in: `f32` or `f64`.
///
/// A function that is generic over it is compiled in every crate that calls it. Large functions, such as the
/// solvers, are entered by functions of these traits that are not generic. Their machine code lies in this
/// library alone.
pub trait Scalar: SteppedIn + RelaxedIn {}

impl<R: SteppedIn + RelaxedIn> Scalar for R {}
