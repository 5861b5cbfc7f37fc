//! The parts that bodies are made of: constitutive laws with their history, elements at rest, motions,
//! constraints, loads, mappings of surfaces, energies. Steppers are elsewhere: `pliant-explicit`,
//! `pliant-implicit`, `pliant-gpu`. Knows nothing of files or windows. SI units throughout.
//!
//! A [`Model`] is constant. The stress of a law at a stretch of 10 %:
//!
//! ```
//! use pliant_mechanics::law::{AnyLaw, Deformation, NeoHookean, Volumetric};
//! use pliant_mechanics::tensor::Tensor;
//!
//! let law = AnyLaw::NeoHookean(NeoHookean { shear: 1000.0, volumetric: Volumetric::quadratic(10_000.0) });
//! let mut gradient = Tensor::ZERO;
//! gradient.0[0][0] = 0.1; // ∂u/∂X
//! let stress = law.stress(&Deformation::from_displacement_gradient(&gradient), &[]);
//! assert!(stress.isochoric.0[0] + stress.volumetric.0[0] > 1000.0); // S₁₁ [Pa]
//! ```

pub mod count;
pub mod curve;
pub mod element;
mod energies;
mod fingerprint;
mod followers;
pub mod grip;
pub mod harmonic;
pub mod law;
pub mod load;
pub mod mapping;
pub mod model;
pub mod order;
pub mod prony;
mod real;
pub mod rotation;
mod stop;
pub mod tensor;
pub mod tie;
pub mod tissue;

pub use energies::Energies;
pub use fingerprint::fingerprint;
pub use model::Model;
pub use real::{Number, Real, closer_to_inverse_cbrt};
pub use stop::StopFlag;
