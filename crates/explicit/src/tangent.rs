//! The stiffest modes of a cell in a deformed state. With one evaluation point K_ab = V B_aᵀ A B_b, A = ∂P/∂F, and the
//! eigenvalues of K other than zero are those of V Lᵀ A L, where L Lᵀ = G = Σ B_a⊗B_a: a 9×9 problem for any number
//! of nodes. A comes from the law's stress by central differences, so that it is right for every law: nothing about
//! stiffening is assumed. The instantaneous response bounds that of a relaxing law. A triangle of a membrane is taken in its own frame,
//! where it has no gradient across: of the nine modes those have no stiffness.

use nalgebra::{SMatrix, SVector};

use pliant_mechanics::element::{Cord, Pull, Rest};
use pliant_mechanics::law::Deformation;
use pliant_mechanics::law::plane_stress::InPlane;
use pliant_mechanics::model::{Cells, Solid};
use pliant_mechanics::tensor::{Symmetric, Tensor, Vector, add, scale};

/// Size of the differences of F: truncation and round-off both near 1e-10.
const DIFFERENCE: f64 = 1e-5;

/// Σ B_a ⊗ B_a [1/m²].
pub(crate) fn gradient_square(gradient: &[Vector<f64>]) -> Symmetric<f64> {
    gradient.iter().fold(Symmetric::ZERO, |sum, &b| sum + Symmetric::dyad(b))
}

/// How stiff a cell is, per volume [Pa/m²].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Stiffness {
    /// The largest eigenvalue of K/V, over all modes.
    pub mode: f64,
    /// The largest over the modes n⊗y of plane waves. In a mesh it is they that neighbours share, while alone a cell is
    /// often stiffest in a change of volume, all directions at once: compressed along one of them it hardly changes.
    pub wave: f64,
}

/// How stiff a cell with displacement gradient `h` and Σ B_a ⊗ B_a = `square` is. Not a number where the law is not
/// defined.
pub(crate) fn stiffness(solid: &Solid, cell: usize, h: &Tensor<f64>, square: &Symmetric<f64>) -> Stiffness {
    let size = square.trace();
    if let Cells::Bar(block, cord) = &solid.cells {
        return of_bar(solid, &block.rest[cell], cord, h);
    }
    let columns = cholesky_columns(&(*square * (1.0 / size)));
    let mut matrix = SMatrix::<f64, 9, 9>::zeros();
    for i in 0..3 {
        for (p, &column) in columns.iter().enumerate().filter(|(_, column)| **column != [0.0; 3]) {
            let moved = |by: f64| {
                let mut moved = *h;
                moved.0[i] = add(moved.0[i], scale(column, by));
                first_piola_kirchhoff(solid, cell, &moved)
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
        return Stiffness { mode: f64::NAN, wave: f64::NAN };
    }
    let symmetric = (matrix + matrix.transpose()) * 0.5;
    let mode = match solid.cells {
        // Without the modes that have a gradient across.
        Cells::Membrane(..) => {
            let own = |k: usize| 3 * (k / 2) + k % 2;
            SMatrix::<f64, 6, 6>::from_fn(|i, k| symmetric[(own(i), own(k))]).symmetric_eigenvalues().max()
        }
        _ => symmetric.symmetric_eigenvalues().max(),
    };
    Stiffness { mode: size * mode, wave: size * stiffest_wave(&symmetric) }
}

/// Of a bar, as if it were taut: E/(λ₀ L²) along it, or P/(λ L²) across, twice for its two nodes, with λ₀ the slack.
fn of_bar(solid: &Solid, rest: &Rest<2>, cord: &Cord, h: &Tensor<f64>) -> Stiffness {
    let Pull { length, stress: [stress, _], .. } =
        cord.pull(rest, h.apply(rest.between()), solid.material.law.small_strain().young());
    let along = solid.longitudinal_modulus() / rest.length().powi(2);
    let mode = 2.0 * along.max(stress / (rest.length() * length));
    Stiffness { mode, wave: mode }
}

/// Directions in which the search for the stiffest wave begins: axes and diagonals of the square.
const BEGINNINGS: [Vector<f64>; 9] = [
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.0, 1.0, 1.0],
    [0.0, 1.0, -1.0],
    [1.0, 0.0, 1.0],
    [1.0, 0.0, -1.0],
    [1.0, 1.0, 0.0],
    [1.0, -1.0, 0.0],
];
/// Turns of the search.
const TURNS: usize = 4;

/// max (n⊗y):A:(n⊗y) over unit n and y, by turns: for one of them kept, the other is an eigenvector of a 3×3 matrix.
fn stiffest_wave(a: &SMatrix<f64, 9, 9>) -> f64 {
    let along = |y: &SVector<f64, 3>| {
        SMatrix::<f64, 3, 3>::from_fn(|i, k| {
            (0..3).map(|p| (0..3).map(|q| a[(3 * i + p, 3 * k + q)] * y[p] * y[q]).sum::<f64>()).sum()
        })
    };
    let across = |n: &SVector<f64, 3>| {
        SMatrix::<f64, 3, 3>::from_fn(|p, q| {
            (0..3).map(|i| (0..3).map(|k| a[(3 * i + p, 3 * k + q)] * n[i] * n[k]).sum::<f64>()).sum()
        })
    };
    let begin = BEGINNINGS.map(|y| SVector::from(y).normalize());
    let sizes = begin.map(|y| largest_eigenvalue(&along(&y)));
    let best = (0..begin.len()).max_by(|&a, &b| sizes[a].total_cmp(&sizes[b])).unwrap_or(0);
    let (mut y, mut largest) = (begin[best], sizes[best]);
    for _ in 0..TURNS {
        let matrix = along(&y);
        let n = eigenvector(&matrix, largest_eigenvalue(&matrix));
        let matrix = across(&n);
        let value = largest_eigenvalue(&matrix);
        y = eigenvector(&matrix, value);
        largest = largest.max(value);
    }
    largest
}

/// The largest root of the characteristic polynomial by Cardano's formula in cosines.
fn largest_eigenvalue(a: &SMatrix<f64, 3, 3>) -> f64 {
    let mean = a.trace() / 3.0;
    let deviator = a - SMatrix::identity() * mean;
    let size = (deviator.norm_squared() / 6.0).sqrt();
    if size <= f64::EPSILON * mean.abs() {
        return mean;
    }
    let half_determinant = (deviator / size).determinant() / 2.0;
    mean + 2.0 * size * (half_determinant.clamp(-1.0, 1.0).acos() / 3.0).cos()
}

/// A unit eigenvector: what the two rows of A − λ I that differ most in direction leave over.
fn eigenvector(a: &SMatrix<f64, 3, 3>, eigenvalue: f64) -> SVector<f64, 3> {
    let left = a - SMatrix::identity() * eigenvalue;
    let row = |i: usize| left.column(i).into_owned();
    let crosses = [row(0).cross(&row(1)), row(1).cross(&row(2)), row(2).cross(&row(0))];
    let longest = crosses.into_iter().max_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()));
    // Of an eigenvalue met twice any vector across the one row serves; the search goes on from an axis.
    longest.and_then(|v| v.try_normalize(f64::MIN_POSITIVE)).unwrap_or_else(SVector::x)
}

fn first_piola_kirchhoff(solid: &Solid, cell: usize, h: &Tensor<f64>) -> Tensor<f64> {
    let law = &solid.material.law;
    if let Cells::Membrane(..) = &solid.cells {
        // Columns of H are the changes of the axes of the frame.
        let changes = [0, 1].map(|i| [0, 1, 2].map(|k| h.0[k][i]));
        let plane = InPlane::from_changes(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], &changes);
        let [xx, yy, xy] = law.plane_stress(plane.strain_twice, &solid.law_fibres(cell)).stress;
        let stress = Symmetric([xx, yy, 0.0, xy, 0.0, 0.0]);
        return Tensor::IDENTITY.plus_scaled(h, 1.0).times_symmetric(&stress);
    }
    let deformation = Deformation::from_displacement_gradient(h);
    let stress = law.stress(&deformation, solid.fibres(cell));
    deformation.gradient.times_symmetric(&(stress.isochoric + stress.volumetric))
}

/// The columns of the lower triangle L with L Lᵀ = S.
fn cholesky_columns(s: &Symmetric<f64>) -> [Vector<f64>; 3] {
    let [xx, yy, zz, xy, yz, xz] = s.0;
    let a = xx.sqrt();
    let (b, c) = (xy / a, xz / a);
    let d = (yy - b * b).sqrt();
    let e = (yz - b * c) / d;
    [[a, b, c], [0.0, d, e], [0.0, 0.0, (zz - c * c - e * e).max(0.0).sqrt()]]
}
