//! The linear tetrahedron: constant gradients. Locks for nearly incompressible tissue; fine up to ν ≈ 0.4.

use super::Rest;
use crate::tensor::{Vector, cross, dot, scale, sub};

/// The rest quantities of a tetrahedron from its nodes [m].
pub fn tet4(x: &[Vector<f64>; 4]) -> Rest<4> {
    let [a, b, c] = [sub(x[1], x[0]), sub(x[2], x[0]), sub(x[3], x[0])];
    let determinant = dot(a, cross(b, c));
    let inverse = 1.0 / determinant;
    let [g1, g2, g3] = [cross(b, c), cross(c, a), cross(a, b)].map(|g| scale(g, inverse));
    let g0 = [-(g1[0] + g2[0] + g3[0]), -(g1[1] + g2[1] + g3[1]), -(g1[2] + g2[2] + g3[2])];
    Rest { volume: determinant / 6.0, gradient: [g0, g1, g2, g3] }
}
