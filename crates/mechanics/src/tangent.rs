//! The stiffest mode of a cell in a deformed state. With one evaluation point K_ab = V B_aᵀ A B_b, A = ∂P/∂F, and the
//! eigenvalues of K other than zero are those of V Lᵀ A L, where L Lᵀ = G = Σ B_a⊗B_a: a 9×9 problem for any number
//! of nodes. A comes from the law's stress by central differences, so that it is right for every law: nothing about
//! stiffening is assumed. The instantaneous response bounds that of a relaxing law.

use nalgebra::SMatrix;

use crate::law::{AnyLaw, Deformation};
use crate::tensor::{Symmetric, Tensor, Vector, add, scale};

/// Size of the differences of F: truncation and round-off both near 1e-10.
const DIFFERENCE: f64 = 1e-5;

/// Σ B_a ⊗ B_a [1/m²].
pub(crate) fn gradient_square(gradient: &[Vector<f64>]) -> Symmetric<f64> {
    gradient.iter().fold(Symmetric::ZERO, |sum, &b| sum + Symmetric::dyad(b))
}

/// The largest eigenvalue of K/V [Pa/m²] of a cell with displacement gradient `h` and Σ B_a ⊗ B_a = `square`.
/// Not a number where the law is not defined.
pub(crate) fn stiffest_mode(
    law: &AnyLaw,
    fibre: Vector<f64>,
    h: &Tensor<f64>,
    square: &Symmetric<f64>,
) -> f64 {
    let size = square.trace();
    let columns = cholesky_columns(&(*square * (1.0 / size)));
    let mut matrix = SMatrix::<f64, 9, 9>::zeros();
    for i in 0..3 {
        for (p, &column) in columns.iter().enumerate() {
            let moved = |by: f64| {
                let mut moved = *h;
                moved.0[i] = add(moved.0[i], scale(column, by));
                first_piola_kirchhoff(law, fibre, &moved)
            };
            let (ahead, behind) = (moved(DIFFERENCE), moved(-DIFFERENCE));
            for k in 0..3 {
                for (q, column) in columns.iter().enumerate() {
                    let change = |c: usize| (ahead.0[k][c] - behind.0[k][c]) * column[c];
                    matrix[(3 * k + q, 3 * i + p)] = (change(0) + change(1) + change(2)) / (2.0 * DIFFERENCE);
                }
            }
        }
    }
    if matrix.iter().any(|x| !x.is_finite()) {
        return f64::NAN;
    }
    let symmetric = (matrix + matrix.transpose()) * 0.5;
    size * symmetric.symmetric_eigenvalues().max()
}

fn first_piola_kirchhoff(law: &AnyLaw, fibre: Vector<f64>, h: &Tensor<f64>) -> Tensor<f64> {
    let deformation = Deformation::from_displacement_gradient(h);
    let stress = law.stress(&deformation, fibre);
    deformation.gradient.times_symmetric(&(stress.isochoric + stress.volumetric))
}

/// The columns of the lower triangle L with L Lᵀ = S.
fn cholesky_columns(s: &Symmetric<f64>) -> [Vector<f64>; 3] {
    let [xx, yy, zz, xy, yz, xz] = s.0;
    let a = xx.sqrt();
    let (b, c) = (xy / a, xz / a);
    let d = (yy - b * b).sqrt();
    let e = (yz - b * c) / d;
    [[a, b, c], [0.0, d, e], [0.0, 0.0, (zz - c * c - e * e).sqrt()]]
}
