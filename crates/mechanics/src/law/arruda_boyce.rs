//! Arruda–Boyce law (eight-chain model, 1993), series of five terms:
//! Ψ = μ Σ Cᵢ/λₘ^(2i−2) (Ī₁ⁱ − 3ⁱ) + U(J), C = 1/2, 1/20, 11/1050, 19/7000, 519/673750.
//! The shear modulus at rest is 2 W₁(3) = μ (1 + 3/(5 λₘ²) + 99/(175 λₘ⁴) + …), larger than μ.
//!
//! Computed as a polynomial of x = Ī₁ − 3, whose coefficients are all positive: nothing cancels at small
//! strain.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Compressibility, Deformation, ParameterError, SplitLaw, Volumetric, check};
use crate::Number;
use crate::tensor::{Symmetric, Vector};

/// Network of chains that lock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArrudaBoyce {
    /// Coefficients of the powers 1 to 5 of Ī₁ − 3 [Pa].
    pub coefficients: [f64; 5],
    /// Volumetric energy.
    pub volumetric: Volumetric,
}

/// Parameters of the Arruda–Boyce law: Ψ = μ Σ Cᵢ/λₘ^(2i−2) (Ī₁ⁱ − 3ⁱ) + U(J), five terms.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub struct ArrudaBoyceParameters {
    /// Modulus μ of the series [Pa]; the shear modulus at rest is larger, μ (1 + 3/(5 λₘ²) + …).
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub shear_modulus: f64,
    /// Stretch λₘ at which the chains are straight.
    #[schemars(extend("exclusiveMinimum" = 1.0))]
    pub locking_stretch: f64,
    /// The resistance to a change of volume.
    #[serde(flatten)]
    pub compressibility: Compressibility,
}

/// The coefficients Cᵢ: Taylor series of the inverse Langevin function.
const SERIES: [f64; 5] = [1.0 / 2.0, 1.0 / 20.0, 11.0 / 1050.0, 19.0 / 7000.0, 519.0 / 673_750.0];

/// Binomial coefficients (i over k), rows i = 1 to 5, columns k = 1 to 5.
const BINOMIAL: [[f64; 5]; 5] = [
    [1.0, 0.0, 0.0, 0.0, 0.0],
    [2.0, 1.0, 0.0, 0.0, 0.0],
    [3.0, 3.0, 1.0, 0.0, 0.0],
    [4.0, 6.0, 4.0, 1.0, 0.0],
    [5.0, 10.0, 10.0, 5.0, 1.0],
];

impl SplitLaw for ArrudaBoyce {
    type Parameters = ArrudaBoyceParameters;

    const WGSL: &'static str = include_str!("arruda_boyce.wgsl");

    fn new(parameters: &ArrudaBoyceParameters) -> Result<Self, ParameterError> {
        let modulus = check::positive("shear-modulus", parameters.shear_modulus, " Pa")?;
        let lock = parameters.locking_stretch;
        if !(lock > 1.0 && lock.is_finite()) {
            let message = format!("`locking-stretch` must be greater than 1, found {lock}");
            let help = "chains that are straight at rest cannot be stretched";
            return Err(ParameterError { key: "locking-stretch", message, help: help.into() });
        }
        // (3 + x)ⁱ − 3ⁱ = Σₖ (i over k) 3^(i−k) xᵏ, k = 1 … i.
        let mut coefficients = [0.0; 5];
        for (i, (term, binomial)) in SERIES.iter().zip(&BINOMIAL).enumerate() {
            for k in 0..=i {
                coefficients[k] +=
                    modulus * term / lock.powi(2 * i as i32) * binomial[k] * 3_f64.powi((i - k) as i32);
            }
        }
        let volumetric = parameters.compressibility.volumetric(2.0 * coefficients[0])?;
        Ok(Self { coefficients, volumetric })
    }

    #[inline(always)]
    fn isochoric_energy<R: Number>(&self, deformation: &Deformation<R>, _fibres: &[Vector<R>]) -> R {
        let x = deformation.isochoric_first_invariant_minus_3();
        let [a, b, c, d, e] = self.coefficients;
        x * (R::of(a) + x * (R::of(b) + x * (R::of(c) + x * (R::of(d) + x * R::of(e)))))
    }

    #[inline(always)]
    fn isochoric_stress<R: Number>(
        &self,
        deformation: &Deformation<R>,
        _fibres: &[Vector<R>],
    ) -> Symmetric<R> {
        let x = deformation.isochoric_first_invariant_minus_3();
        let [a, b, c, d, e] = self.coefficients;
        let slope = x * (R::of(3.0 * c) + x * (R::of(4.0 * d) + x * R::of(5.0 * e)));
        deformation.first_invariant_stress(R::of(a) + x * (R::of(2.0 * b) + slope))
    }

    fn shader_parameters(&self) -> Vec<f64> {
        let [a, b, c, d, e] = self.coefficients;
        vec![a, 2.0 * b, 3.0 * c, 4.0 * d, 5.0 * e]
    }

    fn volumetric(&self) -> Volumetric {
        self.volumetric
    }

    fn shear(&self) -> f64 {
        2.0 * self.coefficients[0]
    }
}
