//! Co-rotated linear law: Ψ = μ |F − R|² + λ/2 tr²(U − I), with F = R U the polar decomposition (McAdams et
//! al. 2011, ACM TOG 30:37). In principal stretches Ψ = μ Σ (λᵢ − 1)² + λ/2 (Σ λᵢ − 3)². This is linear
//! elasticity in a frame that turns with the material, for small strains under large rotations. Softer in
//! compression than tissue; its energy stays finite at J → 0. The stress is S = Σ (2μ (λᵢ − 1) + λ tr(U −
//! I))/λᵢ Nᵢ⊗Nᵢ. With β a principal value of C − I, λ − 1 = β/(1 + √(1 + β)) keeps the digits of small
//! strains.

use schemars::JsonSchema;
use serde::Deserialize;

use super::principal::principal;
use super::{Deformation, ElasticConstants, Law, NamedLaw, ParameterError, Shader, SmallStrainModuli, Split};
use crate::Number;
use crate::tensor::{Symmetric, Vector};

/// Hooke's law in the Biot strain U − I.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corotational {
    /// Shear modulus μ [Pa].
    pub shear: f64,
    /// Lamé's first constant λ [Pa].
    pub lame: f64,
}

/// Parameters of the co-rotated linear law: Ψ = μ |U − I|² + λ/2 tr²(U − I), λ = κ − 2μ/3. For small strains.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(crate) struct CorotationalParameters {
    /// The two moduli.
    #[serde(flatten)]
    pub elastic: ElasticConstants,
}

impl Corotational {
    /// From Young's modulus [Pa] and Poisson's ratio.
    pub fn from_young(young: f64, poisson: f64) -> Self {
        let shear = young / (2.0 * (1.0 + poisson));
        Self { shear, lame: 2.0 * shear * poisson / (1.0 - 2.0 * poisson) }
    }
}

/// λᵢ − 1 from the principal values of C − I.
#[inline(always)]
fn stretches_minus_1<R: Number>(strains: [R; 3]) -> [R; 3] {
    let minus_1 = |strain: R| strain / (R::ONE + (R::ONE + strain).sqrt());
    [minus_1(strains[0]), minus_1(strains[1]), minus_1(strains[2])]
}

impl NamedLaw for Corotational {
    type Parameters = CorotationalParameters;

    fn new(parameters: &CorotationalParameters) -> Result<Self, ParameterError> {
        let SmallStrainModuli { shear, bulk } = parameters.elastic.compressible_moduli()?;
        Ok(Self { shear, lame: bulk - 2.0 / 3.0 * shear })
    }
}

impl Law for Corotational {
    // tr(U − I) is no function of J.
    const VOLUMETRIC_ENERGY: bool = false;

    #[inline(always)]
    fn energy<R: Number>(&self, deformation: &Deformation<R>, _fibres: &[Vector<R>]) -> Split<R> {
        let [a, b, c] = stretches_minus_1(principal(&deformation.strain_twice).0);
        let trace = a + b + c;
        Split {
            isochoric: R::of(self.shear) * (a * a + b * b + c * c),
            volumetric: R::of(0.5 * self.lame) * trace * trace,
        }
    }

    #[inline(always)]
    fn stress<R: Number>(&self, deformation: &Deformation<R>, _fibres: &[Vector<R>]) -> Split<Symmetric<R>> {
        let (strains, directions) = principal(&deformation.strain_twice);
        let stretches = stretches_minus_1(strains);
        let pressure = R::of(self.lame) * (stretches[0] + stretches[1] + stretches[2]);
        let mut stress = Split { isochoric: Symmetric::ZERO, volumetric: Symmetric::ZERO };
        for (stretch, direction) in stretches.into_iter().zip(directions) {
            let dyad = Symmetric::dyad(direction) * (R::ONE / (R::ONE + stretch));
            stress.isochoric = stress.isochoric + dyad * (R::of(2.0 * self.shear) * stretch);
            stress.volumetric = stress.volumetric + dyad * pressure;
        }
        stress
    }

    fn shader(&self) -> Option<Shader> {
        let snippets = &[include_str!("principal.wgsl"), include_str!("corotational.wgsl")];
        Some(Shader::new(snippets, &[2.0 * self.shear, self.lame]))
    }

    fn small_strain(&self) -> SmallStrainModuli {
        SmallStrainModuli { shear: self.shear, bulk: self.lame + 2.0 / 3.0 * self.shear }
    }
}
