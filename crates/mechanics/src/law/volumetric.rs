//! The volumetric energy U(J) of the split laws; its stress is S = J U′(J) C⁻¹. All have the bulk modulus κ
//! at rest.
//!
//! | name | U(J) | J U′(J) | J² U″(J) | |
//! |---|---|---|---|---|
//! | `quadratic` | κ/2 (J − 1)² | κ J (J − 1) | κ J² | finite at J → 0, hence weak against inversion |
//! | `quad-log` | κ/2 ((J² − 1)/2 − ln J) | κ/2 (J² − 1) | κ/2 (J² + 1) | infinite at J → 0 |
//! | `ln-squared` | κ/2 ln² J | κ ln J | κ (1 − ln J) | infinite at J → 0; not convex beyond J = e |
//! | `j-ln-j` | κ (J ln J − J + 1) | κ J ln J | κ J | finite at J → 0, its slope is not |
//!
//! The energies of the last three lose digits to cancellation at small volume changes (not the stresses):
//! read them in double precision. The form is chosen at run time, the same for all lanes; a kernel for each
//! form would be four times the code.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Deformation, Shader};
use crate::Number;
use crate::tensor::Symmetric;

/// Form of the energy U(J) of a change of volume.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum VolumetricEnergy {
    /// κ/2 (J − 1)²; finite at J → 0.
    #[default]
    Quadratic,
    /// κ/2 ((J² − 1)/2 − ln J); infinite at J → 0.
    QuadLog,
    /// κ/2 ln² J; infinite at J → 0, but not convex beyond J = e.
    LnSquared,
    /// κ (J ln J − J + 1); finite at J → 0, its slope is not.
    JLnJ,
}

/// A volumetric energy with its modulus.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Volumetric {
    /// Its form.
    pub energy: VolumetricEnergy,
    /// Bulk modulus κ at rest [Pa].
    pub bulk: f64,
}

impl Volumetric {
    /// κ/2 (J − 1)².
    pub fn quadratic(bulk: f64) -> Self {
        Self { energy: VolumetricEnergy::Quadratic, bulk }
    }

    /// U(J) [J/m³].
    #[inline(always)]
    pub fn energy<R: Number>(&self, deformation: &Deformation<R>) -> R {
        let (j, x) = (deformation.volume_ratio, deformation.volume_change);
        let half = R::of(0.5);
        R::of(self.bulk)
            * match self.energy {
                VolumetricEnergy::Quadratic => half * x * x,
                VolumetricEnergy::QuadLog => half * (x + half * x * x - x.ln_1p()),
                VolumetricEnergy::LnSquared => half * x.ln_1p() * x.ln_1p(),
                VolumetricEnergy::JLnJ => j * x.ln_1p() - x,
            }
    }

    /// J U′(J) [Pa], the Kirchhoff pressure (positive in tension).
    #[inline(always)]
    pub(crate) fn kirchhoff_pressure<R: Number>(&self, deformation: &Deformation<R>) -> R {
        let (j, x) = (deformation.volume_ratio, deformation.volume_change);
        R::of(self.bulk)
            * match self.energy {
                VolumetricEnergy::Quadratic => j * x,
                VolumetricEnergy::QuadLog => R::of(0.5) * x * (j + R::ONE),
                VolumetricEnergy::LnSquared => x.ln_1p(),
                VolumetricEnergy::JLnJ => j * x.ln_1p(),
            }
    }

    /// S = J U′(J) C⁻¹ [Pa].
    #[inline(always)]
    pub fn stress<R: Number>(&self, deformation: &Deformation<R>) -> Symmetric<R> {
        deformation.inverse_cauchy_green * self.kirchhoff_pressure(deformation)
    }

    /// A law with this energy in WGSL. `snippets` are its other text, `parameters` those from index 1 on.
    pub(super) fn shader(&self, snippets: &[&str], parameters: &[f64]) -> Shader {
        let pressure = match self.energy {
            VolumetricEnergy::Quadratic => "j * x",
            VolumetricEnergy::QuadLog => "0.5 * x * (j + 1.0)",
            VolumetricEnergy::LnSquared => "ln_1p(x)",
            VolumetricEnergy::JLnJ => "j * ln_1p(x)",
        };
        let pressure =
            format!("fn relative_kirchhoff_pressure(j: f32, x: f32) -> f32 {{\n    return {pressure};\n}}\n");
        let shared = [pressure.as_str(), include_str!("volumetric.wgsl")];
        Shader::new(&[&shared, snippets].concat(), &[&[self.bulk], parameters].concat())
    }

    /// J² U″(J) [Pa] at a volume ratio: κ at rest; what the volume adds to ρc² of the deformed solid.
    pub fn stiffness(&self, volume_ratio: f64) -> f64 {
        let j = volume_ratio;
        self.bulk
            * match self.energy {
                VolumetricEnergy::Quadratic => j * j,
                VolumetricEnergy::QuadLog => 0.5 * (j * j + 1.0),
                VolumetricEnergy::LnSquared => 1.0 - j.ln(),
                VolumetricEnergy::JLnJ => j,
            }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tensor::Tensor;

    const ALL: [VolumetricEnergy; 4] = [
        VolumetricEnergy::Quadratic,
        VolumetricEnergy::QuadLog,
        VolumetricEnergy::LnSquared,
        VolumetricEnergy::JLnJ,
    ];

    fn stretched(j: f64) -> Deformation<f64> {
        Deformation::from_displacement_gradient(&Tensor([[j - 1.0, 0.0, 0.0], [0.0; 3], [0.0; 3]]))
    }

    #[test]
    fn pressure_and_stiffness_are_the_derivatives_of_the_energy() {
        let h = 1e-4;
        for energy in ALL {
            let volumetric = Volumetric { energy, bulk: 5.0 };
            for j in [0.4, 0.9, 1.0, 1.3, 2.0] {
                let slope = |f: &dyn Fn(f64) -> f64| {
                    (8.0 * (f(j + h) - f(j - h)) - (f(j + 2.0 * h) - f(j - 2.0 * h))) / (12.0 * h)
                };
                let derivative = |j: f64| volumetric.kirchhoff_pressure(&stretched(j)) / j;
                // Fourth order: truncation h⁴ U⁽⁵⁾/30, below 1e-12 but for κ/J⁵ at J = 0.4; round-off near
                // 1e-11.
                let first = slope(&|j| volumetric.energy(&stretched(j)));
                assert!((first - derivative(j)).abs() < 1e-9, "{energy:?} at {j}");
                let second = slope(&derivative);
                assert!((j * j * second - volumetric.stiffness(j)).abs() < 1e-9, "{energy:?} at {j}");
            }
            assert_eq!(volumetric.stiffness(1.0), 5.0);
        }
    }
}
