//! Elements: the rest-shape quantities a kernel needs of a cell, computed once from its nodes.

mod bar;
mod hex8;
mod membrane;
mod tet4;

pub use bar::{Cord, Pull, bar};
pub use hex8::{FLAT_HEX, GaussPoints, HEX_CORNERS, HEX_EDGES, Hex8, gauss_points, hex8};
pub use membrane::{Axes, Sheet, membrane};
pub use tet4::tet4;

use crate::tensor::Vector;

/// A cell of `N` nodes at rest, evaluated at one point.
#[derive(Clone, Copy, Debug)]
pub struct Rest<const N: usize> {
    /// Volume [m³]; negative for an inverted cell.
    pub volume: f64,
    /// Mean gradients of the shape functions [1/m], B_a.
    pub gradient: [Vector<f64>; N],
}

impl<const N: usize> Rest<N> {
    /// Σ |B_a|² [1/m²].
    pub fn gradient_square_sum(&self) -> f64 {
        self.gradient.iter().flatten().map(|b| b * b).sum()
    }
}
