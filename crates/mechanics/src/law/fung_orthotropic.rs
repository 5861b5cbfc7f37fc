//! Orthotropic exponential law of Fung (1979): Ψ = c/2 (e^Q − 1) + U(J), Q = d·Dd + Σ sₘ (2Eₘ)². Here d =
//! (E₁₁, E₂₂, E₃₃), and m are the shears 12, 23, 13 of the Green–Lagrange strain E in the material axes. The
//! stress is S = c e^Q ½ ∂Q/∂E + S_vol. The law is not split: E is the whole strain, so that the exponential
//! resists a change of volume too. Strains of a few tens of percent stiffen it by orders of magnitude. The
//! exponential overflows to infinity, which stops a run with an error.

use schemars::JsonSchema;
use serde::Deserialize;

use super::principal::principal;
use super::{
    Deformation, Law, NamedLaw, ParameterError, Shader, SmallStrainModuli, Split, Volumetric,
    VolumetricEnergy, check,
};
use crate::Number;
use crate::tensor::{Symmetric, Tensor, Vector, cast, dot};

/// Exponential of a quadratic form of the strain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FungOrthotropic {
    /// Modulus c [Pa].
    pub modulus: f64,
    /// The form D of the normal strains, symmetric, positive definite.
    pub normal: Symmetric<f64>,
    /// The coefficients s of the shears 12, 23, 13.
    pub shear: [f64; 3],
    /// Material axes, one per row.
    pub axes: Tensor<f64>,
    /// Volumetric energy.
    pub volumetric: Volumetric,
}

/// Parameters of the Fung law: Ψ = c/2 (e^Q − 1) + U(J), Q = d·Dd + Σ sₘ (2Eₘ)², d = (E₁₁, E₂₂, E₃₃), m = 12,
/// 23, 13.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(crate) struct FungOrthotropicParameters {
    /// Modulus c [Pa].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub modulus: f64,
    /// Rows of the form D of the normal strains: symmetric, positive definite.
    pub normal: [[f64; 3]; 3],
    /// Coefficients s of the shears 12, 23, 13, each greater than 0.
    pub shear: [f64; 3],
    /// Material axes 1, 2, 3 at rest: unit vectors at right angles; by default x, y, z.
    pub axes: Option<[[f64; 3]; 3]>,
    /// Modulus κ of the volumetric energy U(J) [Pa]; the exponential adds to the bulk modulus.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub bulk_modulus: f64,
    /// Form of the energy U(J) of a change of volume.
    #[serde(default)]
    pub volumetric: VolumetricEnergy,
}

impl FungOrthotropic {
    /// ½ ∂Q/∂E in the material axes, from C − I there.
    #[inline(always)]
    fn half_slope<R: Number>(&self, strain_twice: &Symmetric<R>) -> Symmetric<R> {
        let [xx, yy, zz, xy, yz, xz] = strain_twice.0;
        let half = R::of(0.5);
        let form = Symmetric(cast_six(self.normal));
        let [a, b, c] = form.apply([half * xx, half * yy, half * zz]);
        let [s, t, u]: Vector<R> = cast(self.shear);
        Symmetric([a, b, c, s * xy, t * yz, u * xz])
    }

    /// C − I in the material axes, ½ ∂Q/∂E there, and Q = ∂Q/∂E : ½E (a form of second degree).
    #[inline(always)]
    fn exponent<R: Number>(&self, deformation: &Deformation<R>) -> (R, Symmetric<R>) {
        let strain_twice = deformation.strain_twice.push_forward(&self.axes_as());
        let slope = self.half_slope(&strain_twice);
        let ([xx, yy, zz, xy, yz, xz], s) = (strain_twice.0, slope.0);
        let q = R::of(0.5) * dot([xx, yy, zz], [s[0], s[1], s[2]]) + dot([xy, yz, xz], [s[3], s[4], s[5]]);
        (q, slope)
    }

    #[inline(always)]
    fn axes_as<R: Number>(&self) -> Tensor<R> {
        let rows = self.axes.0;
        Tensor([cast(rows[0]), cast(rows[1]), cast(rows[2])])
    }
}

#[inline(always)]
fn cast_six<R: Number>(s: Symmetric<f64>) -> [R; 6] {
    let s = s.0;
    [R::of(s[0]), R::of(s[1]), R::of(s[2]), R::of(s[3]), R::of(s[4]), R::of(s[5])]
}

/// D as a symmetric tensor, if it is symmetric and positive definite.
fn positive_form(rows: [[f64; 3]; 3]) -> Result<Symmetric<f64>, ParameterError> {
    let error = |message| {
        let help = "give the rows of a symmetric, positive definite form, for example [[1.2, 0.3, 0.2], [0.3, 0.9, 0.2], [0.2, 0.2, 0.7]]";
        Err(ParameterError { key: "normal", message, help: help.into() })
    };
    for (i, j) in [(0, 1), (1, 2), (0, 2)] {
        if rows[i][j] != rows[j][i] {
            let (a, b) = (rows[i][j], rows[j][i]);
            return error(format!(
                "`normal` must be symmetric, but D{0}{1} = {a} and D{1}{0} = {b}",
                i + 1,
                j + 1
            ));
        }
    }
    let form = Symmetric([rows[0][0], rows[1][1], rows[2][2], rows[0][1], rows[1][2], rows[0][2]]);
    let smallest = principal(&form).0.into_iter().fold(f64::INFINITY, f64::min);
    if smallest > 0.0 && form.0.iter().all(|d| d.is_finite()) {
        return Ok(form);
    }
    error(format!("`normal` must be positive definite, but has the principal value {smallest}"))
}

impl NamedLaw for FungOrthotropic {
    type Parameters = FungOrthotropicParameters;

    fn new(parameters: &FungOrthotropicParameters) -> Result<Self, ParameterError> {
        let modulus = check::positive("modulus", parameters.modulus, " Pa")?;
        let normal = positive_form(parameters.normal)?;
        for value in parameters.shear {
            check::positive("shear", value, "")?;
        }
        let axes = match parameters.axes {
            Some(axes) => Tensor(check::orthonormal("axes", axes)?),
            None => Tensor::IDENTITY,
        };
        let bulk = check::positive("bulk-modulus", parameters.bulk_modulus, " Pa")?;
        let volumetric = Volumetric { energy: parameters.volumetric, bulk };
        Ok(Self { modulus, normal, shear: parameters.shear, axes, volumetric })
    }
}

impl Law for FungOrthotropic {
    #[inline(always)]
    fn energy<R: Number>(&self, deformation: &Deformation<R>, _fibres: &[Vector<R>]) -> Split<R> {
        let (q, _) = self.exponent(deformation);
        Split {
            isochoric: R::of(0.5 * self.modulus) * q.exp_m1(),
            volumetric: self.volumetric.energy(deformation),
        }
    }

    #[inline(always)]
    fn stress<R: Number>(&self, deformation: &Deformation<R>, _fibres: &[Vector<R>]) -> Split<Symmetric<R>> {
        let (q, slope) = self.exponent(deformation);
        let stress = slope * (R::of(self.modulus) * q.exp());
        Split {
            isochoric: stress.push_forward(&self.axes_as().transpose()),
            volumetric: self.volumetric.stress(deformation),
        }
    }

    fn shader(&self) -> Option<Shader> {
        let parameters =
            [&[self.modulus], &self.normal.0[..], &self.shear, self.axes.0.as_flattened()].concat();
        Some(self.volumetric.shader(&[include_str!("fung_orthotropic.wgsl")], &parameters))
    }

    /// The shear modulus is the largest over all shears at rest, and the bulk modulus belongs to a pure
    /// dilation. The law has axes, though no fibres that differ from cell to cell.
    fn is_isotropic(&self) -> bool {
        false
    }

    fn small_strain(&self) -> SmallStrainModuli {
        let [xx, yy, zz, xy, yz, xz] = self.normal.0;
        let sum = xx + yy + zz + 2.0 * (xy + yz + xz);
        // Of normal strains without dilation: D between projections P = I − 1⊗1/3.
        let third = 1.0 / 3.0;
        let projection = Tensor([0, 1, 2].map(|i| [0, 1, 2].map(|j| f64::from(u8::from(i == j)) - third)));
        let normal = 0.5 * largest(principal(&self.normal.push_forward(&projection)).0);
        SmallStrainModuli {
            shear: self.modulus * normal.max(largest(self.shear)),
            bulk: self.volumetric.bulk + self.modulus * sum / 9.0,
        }
    }

    fn longitudinal_modulus(&self) -> f64 {
        // c d·Dd + c Σ s (2E)² for a strain sym(n⊗m) of norm 1 at most. The largest principal value of the
        // form bounds this term. A shear counts √2 E in the form.
        let normal = largest(principal(&self.normal).0);
        self.volumetric.bulk + self.modulus * normal.max(2.0 * largest(self.shear))
    }
}

fn largest(values: [f64; 3]) -> f64 {
    values.into_iter().fold(0.0, f64::max)
}
