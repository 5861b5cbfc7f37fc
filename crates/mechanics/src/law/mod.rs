//! Constitutive laws: energy and second Piola–Kirchhoff stress from the deformation gradient.
//!
//! A law is a small struct of parameters. Its methods are generic over the number type, so that the same
//! lines run as reference and as fast path. Most laws are a sum of an isochoric and a volumetric energy and
//! implement [`SplitLaw`], the others [`Law`] itself. The history of viscoelasticity wraps a law (see
//! [`prony`](crate::prony)) and is no law. A new law needs its file and its WGSL twin here. It also needs a
//! line in the registry below, and a line in the samples that tests run.

mod arruda_boyce;
mod check;
mod corotational;
mod coupled_neo_hookean;
mod deformation;
mod demiray;
mod elastic_constants;
mod fung_orthotropic;
mod gent;
mod holzapfel_gasser_ogden;
mod logarithmic_neo_hookean;
mod mooney_rivlin;
mod neo_hookean;
mod ogden;
mod orthotropic;
mod own;
pub mod plane_stress;
mod polynomial;
mod principal;
mod shader;
mod shear_growth;
mod split;
mod st_venant_kirchhoff;
mod tangent;
mod transversely_isotropic;
mod veronda_westmann;
mod volumetric;
mod yeoh;

#[cfg(test)]
mod battery;
#[doc(hidden)]
pub mod samples;

use schemars::{JsonSchema, Schema};
use serde::de::DeserializeOwned;

use crate::Number;
use crate::tensor::{Symmetric, Tensor, Vector};
pub use arruda_boyce::ArrudaBoyce;
pub use corotational::Corotational;
pub use coupled_neo_hookean::CoupledNeoHookean;
pub use deformation::Deformation;
pub use demiray::Demiray;
pub use elastic_constants::ElasticConstants;
pub use fung_orthotropic::FungOrthotropic;
pub use gent::Gent;
pub use holzapfel_gasser_ogden::HolzapfelGasserOgden;
pub use logarithmic_neo_hookean::LogarithmicNeoHookean;
pub use mooney_rivlin::MooneyRivlin;
pub use neo_hookean::NeoHookean;
pub use ogden::{Ogden, OgdenTerm};
pub use orthotropic::Orthotropic;
pub use own::{Own, OwnLaw};
pub use polynomial::Polynomial;
pub use shader::Shader;
pub use shear_growth::ShearGrowth;
pub use split::{Compressibility, Matrix, SplitLaw};
pub use st_venant_kirchhoff::StVenantKirchhoff;
pub use transversely_isotropic::{FibreConvention, TransverselyIsotropic};
pub use veronda_westmann::VerondaWestmann;
pub use volumetric::{Volumetric, VolumetricEnergy};
pub use yeoh::Yeoh;

/// The most families of fibres that a law has.
pub const MOST_FAMILIES: usize = 2;

/// A quantity split into the part that changes shape and the part that changes volume.
#[derive(Clone, Copy, Debug)]
pub struct Split<T> {
    /// The part from the isochoric energy (for an unsplit law: the part that carries the shear modulus).
    pub isochoric: T,
    /// The part from the volumetric energy.
    pub volumetric: T,
}

/// Isotropic moduli of a law at rest [Pa].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmallStrainModuli {
    /// Shear modulus of the matrix [Pa].
    pub shear: f64,
    /// Bulk modulus [Pa]; infinite of a law that keeps the volume, for walls in plane stress.
    pub bulk: f64,
}

impl SmallStrainModuli {
    /// Young's modulus [Pa].
    pub fn young(&self) -> f64 {
        // 9κμ/(3κ + μ), which an infinite κ leaves at 3μ.
        3.0 * self.shear / (1.0 + self.shear / (3.0 * self.bulk))
    }

    /// Poisson's ratio; ½ with an infinite bulk modulus.
    pub fn poisson(&self) -> f64 {
        let ratio = self.shear / (3.0 * self.bulk);
        (0.5 - ratio) / (1.0 + ratio)
    }
}

/// Error in a parameter of a law.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{message}")]
pub struct ParameterError {
    /// The key at fault, as in a scene file.
    pub key: &'static str,
    /// The error, with the number.
    pub message: String,
    /// Remedy.
    pub help: String,
}

/// A law that a scene can name.
pub(crate) trait NamedLaw: Law {
    /// Parameters from the user, each with unit and range.
    type Parameters: DeserializeOwned + JsonSchema;

    /// Checks and converts the user's parameters.
    ///
    /// # Errors
    /// If one is out of range.
    fn new(parameters: &Self::Parameters) -> Result<Self, ParameterError>;
}

/// A hyperelastic law.
pub trait Law: Copy + Send + Sync + 'static {
    /// True if the volumetric stress is J U′(J) C⁻¹, of an energy of J alone. Elements that average the
    /// change of volume stand on it: without it they compute another law.
    const VOLUMETRIC_ENERGY: bool = true;

    /// Strain energy per reference volume [J/m³]. `fibres` are the unit directions of the families at rest.
    fn energy<R: Number>(&self, deformation: &Deformation<R>, fibres: &[Vector<R>]) -> Split<R>;

    /// Second Piola–Kirchhoff stress [Pa].
    fn stress<R: Number>(&self, deformation: &Deformation<R>, fibres: &[Vector<R>]) -> Split<Symmetric<R>>;

    /// Returns the whole stress.
    #[inline(always)]
    fn whole_stress<R: Number>(&self, deformation: &Deformation<R>, fibres: &[Vector<R>]) -> Symmetric<R> {
        let Split { isochoric, volumetric } = self.stress(deformation, fibres);
        isochoric + volumetric
    }

    /// Returns the stress in WGSL, whose text is in the file next to the law's; `None` for a law for the CPU
    /// only.
    fn shader(&self) -> Option<Shader>;

    /// Families of fibres, each with a direction in every cell.
    fn families(&self) -> usize {
        0
    }

    /// True if the law is the same in all directions.
    fn is_isotropic(&self) -> bool {
        self.families() == 0
    }

    /// True if the shear stiffness never rises above the stiffness at rest, as [`ShearGrowth`] measures it.
    fn keeps_shear_stiffness(&self) -> bool {
        false
    }

    /// Moduli at rest, without the fibres; of a law without isotropic matrix the largest shear modulus.
    fn small_strain(&self) -> SmallStrainModuli;

    /// An upper bound of ρc² over all directions at rest [Pa]: λ + 2μ, plus the part of fibres. With this
    /// bound the element bound of the critical step is rigorous. By Cauchy and Schwarz the nuclear norm of Σ
    /// v_a⊗B_a is at most |v| |B|. A positive form is largest over that ball at some n⊗m.
    fn longitudinal_modulus(&self) -> f64 {
        let SmallStrainModuli { shear, bulk } = self.small_strain();
        bulk + 4.0 / 3.0 * shear + self.fibre_modulus()
    }

    /// An upper bound of what fibres add to ρc² at rest, over all directions [Pa].
    fn fibre_modulus(&self) -> f64 {
        0.0
    }
}

/// Declares the laws a scene can name: the one place where a name meets a type.
macro_rules! registry {
    ($($(#[$doc:meta])* $name:literal => $law:ident,)*) => {
        /// Any law of the registry, or [one's own](OwnLaw).
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum AnyLaw {
            $($(#[$doc])* $law($law),)*
            /// A law that a program gives.
            Own(Own),
        }

        impl AnyLaw {
            /// The names of all laws, as in a scene file.
            pub const NAMES: &[&str] = &[$($name),*];

            /// The schema of a law's parameters; `None` for an unknown name.
            pub fn schema(name: &str) -> Option<Schema> {
                match name {
                    $($name => Some(schemars::schema_for!(<$law as NamedLaw>::Parameters)),)*
                    _ => None,
                }
            }

            /// A law from its name and its parameters as JSON. An unknown name or a value of the wrong type
            /// is reported under the key `type`.
            pub fn from_json(name: &str, parameters: serde_json::Value) -> Result<Self, ParameterError> {
                let unreadable = |message: String| ParameterError {
                    key: "type",
                    message,
                    help: format!("known laws: {}", Self::NAMES.join(", ")),
                };
                match name {
                    $($name => {
                        let parameters = serde_json::from_value::<<$law as NamedLaw>::Parameters>(parameters)
                            .map_err(|error| unreadable(error.to_string()))?;
                        <$law as NamedLaw>::new(&parameters).map(Self::$law)
                    })*
                    _ => Err(unreadable(format!("there is no law `{name}`"))),
                }
            }

            /// Name in a scene file, or name of a user's [own law](OwnLaw).
            pub fn name(&self) -> &'static str {
                match self { $(Self::$law(_) => $name,)* Self::Own(law) => law.name() }
            }

            /// True if an element may average the change of volume; see [`Law::VOLUMETRIC_ENERGY`].
            pub fn has_volumetric_energy(&self) -> bool {
                match self {
                    $(Self::$law(_) => <$law as Law>::VOLUMETRIC_ENERGY,)*
                    Self::Own(law) => law.has_volumetric_energy(),
                }
            }
        }

        /// Runs `$body` with `$bound` the concrete law, so that a kernel is compiled for each.
        #[doc(hidden)]
        #[macro_export]
        macro_rules! with_law {
            ($any:expr, $bound:ident => $body:expr) => {
                match $any {
                    $($crate::law::AnyLaw::$law($bound) => $body,)*
                    $crate::law::AnyLaw::Own($bound) => $body,
                }
            };
        }
        pub use with_law;
    };
}

registry! {
    /// Split neo-Hookean, the default of soft tissue.
    "neo-hookean" => NeoHookean,
    /// Neo-Hookean with coupled shear and volume terms.
    "coupled-neo-hookean" => CoupledNeoHookean,
    /// Neo-Hookean with ln J in both terms.
    "logarithmic-neo-hookean" => LogarithmicNeoHookean,
    /// Hooke's law in the Green–Lagrange strain.
    "st-venant-kirchhoff" => StVenantKirchhoff,
    /// Hooke's law in a frame that turns with the material.
    "corotational" => Corotational,
    /// Linear in both invariants.
    "mooney-rivlin" => MooneyRivlin,
    /// Quadratic in both invariants.
    "polynomial" => Polynomial,
    /// Cubic in the first invariant.
    "yeoh" => Yeoh,
    /// Chains that lock, as a series.
    "arruda-boyce" => ArrudaBoyce,
    /// A logarithm that locks.
    "gent" => Gent,
    /// Exponential in the first invariant.
    "demiray" => Demiray,
    /// Exponential in the first invariant, linear in the second.
    "veronda-westmann" => VerondaWestmann,
    /// Powers of the principal stretches.
    "ogden" => Ogden,
    /// Neo-Hookean matrix with one family of fibres.
    "transversely-isotropic" => TransverselyIsotropic,
    /// Neo-Hookean matrix with two families of fibres.
    "orthotropic" => Orthotropic,
    /// Neo-Hookean matrix with dispersed fibres that carry tension only.
    "holzapfel-gasser-ogden" => HolzapfelGasserOgden,
    /// Exponential of a quadratic form of the strain.
    "fung-orthotropic" => FungOrthotropic,
}

impl AnyLaw {
    /// Strain energy per reference volume [J/m³]; see [`Law::energy`].
    pub fn energy(&self, deformation: &Deformation<f64>, fibres: &[Vector<f64>]) -> Split<f64> {
        with_law!(self, law => law.energy(deformation, fibres))
    }

    /// Second Piola–Kirchhoff stress [Pa]; see [`Law::stress`].
    pub fn stress<R: Number>(
        &self,
        deformation: &Deformation<R>,
        fibres: &[Vector<R>],
    ) -> Split<Symmetric<R>> {
        with_law!(self, law => law.stress(deformation, fibres))
    }

    /// The stress in WGSL; see [`Law::shader`].
    pub fn shader(&self) -> Option<Shader> {
        with_law!(self, law => law.shader())
    }

    /// Families of fibres, each with a direction in every cell.
    pub fn families(&self) -> usize {
        with_law!(self, law => Law::families(law))
    }

    /// True if the law is the same in all directions.
    pub fn is_isotropic(&self) -> bool {
        with_law!(self, law => Law::is_isotropic(law))
    }

    /// True if the shear stiffness never rises; see [`Law::keeps_shear_stiffness`].
    pub(crate) fn keeps_shear_stiffness(&self) -> bool {
        with_law!(self, law => Law::keeps_shear_stiffness(law))
    }

    /// Moduli at rest; see [`Law::small_strain`].
    pub fn small_strain(&self) -> SmallStrainModuli {
        with_law!(self, law => law.small_strain())
    }

    /// Upper bound of ρc² at rest [Pa]; see [`Law::longitudinal_modulus`].
    pub fn longitudinal_modulus(&self) -> f64 {
        with_law!(self, law => law.longitudinal_modulus())
    }

    /// Upper bound of the part of fibres in ρc² at rest [Pa]; see [`Law::fibre_modulus`].
    pub(crate) fn fibre_modulus(&self) -> f64 {
        with_law!(self, law => law.fibre_modulus())
    }

    /// U(J) [J/m³] at a J − 1, of a law with an energy of the volume alone
    /// ([`has_volumetric_energy`](Self::has_volumetric_energy)).
    pub fn volume_energy(&self, change: f64) -> f64 {
        let any = [[1.0, 0.0, 0.0]; MOST_FAMILIES];
        self.energy(&dilation(change), &any[..self.families()]).volumetric
    }

    /// U′(J) and U″(J) [Pa] at a J − 1 of such a law; U″ is the central difference of U′, right to 1e-9.
    pub fn volume_pressures(&self, change: f64) -> [f64; 2] {
        const DIFFERENCE: f64 = 1e-5;
        let any = [[1.0, 0.0, 0.0]; MOST_FAMILIES];
        // S = J U′ C⁻¹.
        let pressure = |change: f64| {
            let d = dilation(change);
            let stress = self.stress(&d, &any[..self.families()]).volumetric;
            stress.0[0] / (d.volume_ratio * d.inverse_cauchy_green.0[0])
        };
        let difference = pressure(change + DIFFERENCE) - pressure(change - DIFFERENCE);
        [pressure(change), difference / (2.0 * DIFFERENCE)]
    }
}

/// Returns the equal stretch in all directions that has a J − 1.
fn dilation(change: f64) -> Deformation<f64> {
    let c = (1.0 + change).cbrt();
    let (stretch, o) = (change / (c * c + c + 1.0), 0.0);
    Deformation::from_displacement_gradient(&Tensor([[stretch, o, o], [o, stretch, o], [o, o, stretch]]))
}
