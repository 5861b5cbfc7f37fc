//! The uniform-strain hexahedron of Flanagan and Belytschko (1981) in total-Lagrangian form (Joldes, Wittek
//! and Miller 2008). It has mean gradients and the exact volume by 2×2×2 Gauss points; the centroid gradient
//! fails the patch test. A stiffness acts against the four hourglass patterns. The shear modulus scales this
//! stiffness, so that the element does not lock.

use super::Rest;
use crate::tensor::{Vector, add, dot, scale, sub};

/// Reference coordinates (ξ, η, ζ) of the corners, in the node order of VTK.
pub const HEX_CORNERS: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];

/// The ends of the three edges at each corner, in the order in which a valid cell has them right-handed.
pub const HEX_EDGES: [[usize; 3]; 8] =
    [[1, 3, 4], [2, 0, 5], [3, 1, 6], [0, 2, 7], [7, 5, 0], [4, 6, 1], [5, 7, 2], [6, 4, 3]];

/// Flatness below which a hexahedron is judged by its corners: its volume over the volume at rest. For a
/// uniform-strain hexahedron it is also divided by √(1 + |C − I|²/2), which is about its least stretch. At
/// glued edges stresses grow without end, and corners fold at moderate strains, the more the finer the mesh.
/// Forces still agree with other codes (the reference cubes at 20 and 30 %).
pub const FLAT_HEX: f64 = 0.25;

/// A hexahedron at rest.
#[derive(Clone, Copy, Debug)]
pub struct Hex8 {
    /// Volume and mean gradients.
    pub rest: Rest<8>,
    /// The four hourglass vectors γ: orthogonal to every linear field.
    pub hourglass: [[f64; 8]; 4],
    /// The moments Y_c = Σ_a Γ_ca X_a of the patterns' signs [m], about the first node: γ_ca = Γ_ca −
    /// B_a·Y_c.
    pub moments: [Vector<f64>; 4],
    /// Smallest Jacobian determinant at the corners over the mean one; ≤ 0 for a folded cell.
    pub worst_corner: f64,
    /// κ² [1/m²]: at no corner does F differ from the mean one by more than κ |q|, with q_c = Σ_a γ_ca u_a.
    pub corner_reach: f64,
}

/// The rest quantities of a hexahedron from its nodes [m].
pub fn hex8(x: &[Vector<f64>; 8]) -> Hex8 {
    let gauss = 1.0 / 3.0_f64.sqrt();
    let mut volume = 0.0;
    let mut gradient = [[0.0; 3]; 8];
    for corner in HEX_CORNERS {
        let (determinant, derivative) = shape_derivatives(x, corner.map(|c| c * gauss));
        volume += determinant;
        for (mean, b) in gradient.iter_mut().zip(derivative) {
            for (m, b) in mean.iter_mut().zip(b) {
                *m += determinant * b;
            }
        }
    }
    for b in gradient.iter_mut().flatten() {
        *b /= volume;
    }
    let moments = hourglass_moments(x);
    let hourglass = hourglass_vectors(&moments, &gradient);
    let corners = HEX_CORNERS.map(|corner| shape_derivatives(x, corner));
    let worst = corners.iter().map(|corner| corner.0).fold(f64::INFINITY, f64::min);
    Hex8 {
        rest: Rest { volume, gradient },
        hourglass,
        moments,
        worst_corner: worst * 8.0 / volume.abs(),
        corner_reach: corner_reach(&corners.map(|corner| corner.1), &gradient, &hourglass),
    }
}

/// Returns κ². At a corner ∂N_a/∂X less its mean gives zero for linear fields. This difference is therefore
/// Σ_c γ_ca W_c, and κ bounds the norm of every W. The largest eigenvalue of WᵀW is at most the mean of all
/// and √2 times their scatter.
fn corner_reach(corners: &[[Vector<f64>; 8]; 8], mean: &[Vector<f64>; 8], hourglass: &[[f64; 8]; 4]) -> f64 {
    let gamma = nalgebra::SMatrix::<f64, 4, 8>::from_fn(|c, a| hourglass[c][a]);
    let inverse = (gamma * gamma.transpose()).try_inverse();
    let reach = |corner: &[Vector<f64>; 8]| {
        let off = nalgebra::SMatrix::<f64, 8, 3>::from_fn(|a, i| corner[a][i] - mean[a][i]);
        let w = inverse? * (gamma * off);
        let square = w.transpose() * w;
        let centre = square.trace() / 3.0;
        let scatter = (square.norm_squared() / 3.0 - centre * centre).max(0.0).sqrt();
        Some(centre + std::f64::consts::SQRT_2 * scatter)
    };
    // A cell so flat that nothing is known is always looked at.
    corners.iter().map(|corner| reach(corner).unwrap_or(f64::MAX)).fold(0.0, f64::max)
}

/// The eight Gauss points of a hexahedron at rest.
#[derive(Clone, Copy, Debug)]
pub struct GaussPoints {
    /// Gradients of the shape functions at each point [1/m].
    pub gradient: [[Vector<f64>; 8]; 8],
    /// Volume that belongs to each point [m³].
    pub weight: [f64; 8],
}

/// The Gauss points of a hexahedron from its nodes [m].
pub fn gauss_points(x: &[Vector<f64>; 8]) -> GaussPoints {
    let gauss = 1.0 / 3.0_f64.sqrt();
    let points = HEX_CORNERS.map(|corner| shape_derivatives(x, corner.map(|c| c * gauss)));
    GaussPoints { gradient: points.map(|(_, gradient)| gradient), weight: points.map(|(weight, _)| weight) }
}

/// det ∂X/∂ξ and ∂N_a/∂X at a point of the reference cube.
fn shape_derivatives(x: &[Vector<f64>; 8], at: Vector<f64>) -> (f64, [Vector<f64>; 8]) {
    let local = HEX_CORNERS.map(|c| {
        let f = [1.0 + c[0] * at[0], 1.0 + c[1] * at[1], 1.0 + c[2] * at[2]];
        [c[0] * f[1] * f[2] / 8.0, f[0] * c[1] * f[2] / 8.0, f[0] * f[1] * c[2] / 8.0]
    });
    let mut jacobian = nalgebra::Matrix3::<f64>::zeros();
    for (node, d) in x.iter().zip(local) {
        for i in 0..3 {
            for j in 0..3 {
                jacobian[(i, j)] += node[i] * d[j];
            }
        }
    }
    let determinant = jacobian.determinant();
    let inverse = jacobian.try_inverse().unwrap_or_else(nalgebra::Matrix3::zeros);
    let gradient = local.map(|d| {
        let mut b = [0.0; 3];
        for (i, entry) in b.iter_mut().enumerate() {
            *entry = (0..3).map(|j| d[j] * inverse[(j, i)]).sum();
        }
        b
    });
    (determinant, gradient)
}

/// Γ_ca: the patterns ηζ, ξζ, ξη and ξηζ at the corners.
const SIGNS: [[f64; 8]; 4] = {
    let mut signs = [[0.0; 8]; 4];
    let mut corner = 0;
    while corner < 8 {
        let [xi, eta, zeta] = HEX_CORNERS[corner];
        signs[0][corner] = eta * zeta;
        signs[1][corner] = xi * zeta;
        signs[2][corner] = xi * eta;
        signs[3][corner] = xi * eta * zeta;
        corner += 1;
    }
    signs
};

/// Y_c = Σ_a Γ_ca X_a; the signs sum to zero, so that places can be taken relative to the first node.
fn hourglass_moments(x: &[Vector<f64>; 8]) -> [Vector<f64>; 4] {
    SIGNS.map(|signs| {
        let mut moment = [0.0; 3];
        for (node, sign) in x.iter().zip(signs) {
            moment = add(moment, scale(sub(*node, x[0]), sign));
        }
        moment
    })
}

/// γ_ca = Γ_ca − B_a · Y_c.
fn hourglass_vectors(moments: &[Vector<f64>; 4], gradient: &[Vector<f64>; 8]) -> [[f64; 8]; 4] {
    let mut vectors = SIGNS;
    for (vector, moment) in vectors.iter_mut().zip(moments) {
        for (v, &b) in vector.iter_mut().zip(gradient) {
            *v -= dot(b, *moment);
        }
    }
    vectors
}
