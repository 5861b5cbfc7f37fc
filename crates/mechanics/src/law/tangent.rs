//! The tangent of a law, D = ∂S/∂ε with the engineering strains ε = (E₁₁, E₂₂, E₃₃, 2E₁₂, 2E₂₃, 2E₁₃).
//! Central differences along δF = F⁻ᵀ δE give δC = 2 δE up to terms that cancel. Right for every law, to 1e-9
//! of its largest entry: only the stress of a law is needed. Twelve stresses a tangent.

use super::{AnyLaw, Deformation, Split};
use crate::tensor::{Symmetric, Tensor, Vector};

/// Size of the differences of strain: truncation and round-off both near 1e-10.
pub(super) const DIFFERENCE: f64 = 1e-5;

/// Rows and columns of the components 11, 22, 33, 12, 23, 13.
const COMPONENTS: [[usize; 2]; 6] = [[0, 0], [1, 1], [2, 2], [0, 1], [1, 2], [0, 2]];

impl AnyLaw {
    /// D [Pa] of a part of the stress, in the order 11, 22, 33, 12, 23, 13, symmetric. `h` is the
    /// displacement gradient; its J must be positive.
    pub fn tangent(
        &self,
        h: &Tensor<f64>,
        fibres: &[Vector<f64>],
        part: impl Fn(Split<Symmetric<f64>>) -> Symmetric<f64>,
    ) -> [[f64; 6]; 6] {
        let f = Deformation::from_displacement_gradient(h).gradient;
        let inverse_transposed = f.cofactor().scaled(1.0 / f.determinant());
        by_differences(|component, sign| {
            // δε = DIFFERENCE in one component, the shears half in each of two places.
            let [i, j] = COMPONENTS[component];
            let mut strain = Tensor::ZERO;
            strain.0[i][j] = 0.5 * DIFFERENCE;
            strain.0[j][i] += 0.5 * DIFFERENCE;
            let mut change = Tensor::ZERO;
            for (out, row) in change.0.iter_mut().zip(inverse_transposed.0) {
                // The rows of F⁻ᵀ δE; δE is symmetric.
                *out = strain.apply(row);
            }
            let moved = Deformation::from_displacement_gradient(&h.plus_scaled(&change, sign));
            part(self.stress(&moved, fibres)).0
        })
    }
}

/// The symmetric matrix of the central differences of stresses [Pa], from those at a component of strain
/// moved by ± [`DIFFERENCE`].
pub(super) fn by_differences<const N: usize>(stress: impl Fn(usize, f64) -> [f64; N]) -> [[f64; N]; N] {
    let column = |component: usize| {
        let (ahead, behind) = (stress(component, 1.0), stress(component, -1.0));
        std::array::from_fn(|row| (ahead[row] - behind[row]) / (2.0 * DIFFERENCE))
    };
    let columns: [[f64; N]; N] = std::array::from_fn(column);
    std::array::from_fn(|p| std::array::from_fn(|q| 0.5 * (columns[p][q] + columns[q][p])))
}
