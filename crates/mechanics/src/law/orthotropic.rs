//! Orthotropic law, two families of fibres: Ψ = μ/2 (Ī₁ − 3) + ½ Σ eₖ (Īₖ − 1)², k = 4 … 7, + U(J). Here Ī₄,
//! Ī₅ belong to the first family a, and Ī₆, Ī₇ to the second b. Fibres resist compression as well as tension.
//! The axes of orthotropy are a and b if these are at right angles. Leaves out: the coupling invariant a·C̄b.

use schemars::JsonSchema;
use serde::Deserialize;

use super::split::fibre_stiffness;
use super::{Deformation, Matrix, ParameterError, SplitLaw, Volumetric, check};
use crate::Number;
use crate::tensor::{Symmetric, Vector};

/// Neo-Hookean matrix with two families of fibres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orthotropic {
    /// Shear modulus μ of the matrix [Pa].
    pub shear: f64,
    /// Moduli e₄ and e₅ of the first family [Pa].
    pub first: [f64; 2],
    /// Moduli e₆ and e₇ of the second family [Pa].
    pub second: [f64; 2],
    /// Volumetric energy.
    pub volumetric: Volumetric,
}

/// Parameters of the orthotropic law: Ψ = μ/2 (Ī₁ − 3) + ½ Σ eₖ (Īₖ − 1)² + U(J), k = 4 … 7. The families are
/// `fibre` and `second-fibre` of the law or the body.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct OrthotropicParameters {
    /// The moduli of the matrix.
    #[serde(flatten)]
    pub matrix: Matrix,
    /// Modulus e₄ of the first family, on Ī₄ − 1 [Pa].
    #[serde(default)]
    #[schemars(range(min = 0.0))]
    pub e4: f64,
    /// Modulus e₅ of the first family, on Ī₅ − 1 [Pa].
    #[serde(default)]
    #[schemars(range(min = 0.0))]
    pub e5: f64,
    /// Modulus e₆ of the second family, on Ī₆ − 1 [Pa].
    #[serde(default)]
    #[schemars(range(min = 0.0))]
    pub e6: f64,
    /// Modulus e₇ of the second family, on Ī₇ − 1 [Pa].
    #[serde(default)]
    #[schemars(range(min = 0.0))]
    pub e7: f64,
}

impl SplitLaw for Orthotropic {
    type Parameters = OrthotropicParameters;

    const WGSL: &'static str = include_str!("orthotropic.wgsl");

    fn new(parameters: &OrthotropicParameters) -> Result<Self, ParameterError> {
        let OrthotropicParameters { matrix, e4, e5, e6, e7 } = *parameters;
        let (shear, volumetric) = matrix.parts()?;
        let modulus = |key, value| check::not_negative(key, value, "0 leaves the term out");
        Ok(Self {
            shear,
            first: [modulus("e4", e4)?, modulus("e5", e5)?],
            second: [modulus("e6", e6)?, modulus("e7", e7)?],
            volumetric,
        })
    }

    #[inline(always)]
    fn isochoric_energy<R: Number>(&self, deformation: &Deformation<R>, fibres: &[Vector<R>]) -> R {
        let mut energy = R::of(0.5 * self.shear) * deformation.isochoric_first_invariant_minus_3();
        for (a, [e, f]) in [(fibres[0], self.first), (fibres[1], self.second)] {
            let [x, y] = deformation.fibre_strains(a);
            energy += R::of(0.5 * e) * x * x + R::of(0.5 * f) * y * y;
        }
        energy
    }

    #[inline(always)]
    fn isochoric_stress<R: Number>(
        &self,
        deformation: &Deformation<R>,
        fibres: &[Vector<R>],
    ) -> Symmetric<R> {
        let mut stress = deformation.first_invariant_stress(R::of(0.5 * self.shear));
        for (a, [e, f]) in [(fibres[0], self.first), (fibres[1], self.second)] {
            let [x, y] = deformation.fibre_strains(a);
            stress = stress + deformation.fibre_stresses(a, [R::of(e) * x, R::of(f) * y]);
        }
        stress
    }

    fn shader_parameters(&self) -> Vec<f64> {
        let ([e4, e5], [e6, e7]) = (self.first, self.second);
        vec![0.5 * self.shear, e4, e5, e6, e7]
    }

    fn volumetric(&self) -> Volumetric {
        self.volumetric
    }

    fn shear(&self) -> f64 {
        self.shear
    }

    fn families(&self) -> usize {
        2
    }

    fn fibre_stiffness(&self) -> f64 {
        // To first order Ī₅ − 1 = 2 (Ī₄ − 1).
        let ([e4, e5], [e6, e7]) = (self.first, self.second);
        fibre_stiffness(e4 + 4.0 * e5) + fibre_stiffness(e6 + 4.0 * e7)
    }
}
