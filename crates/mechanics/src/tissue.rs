//! Tissues of the literature, made from parameters as a scene gives them.
//!
//! ```
//! use pliant_mechanics::tissue::{elastic, soft_tissue};
//!
//! assert_eq!(elastic(soft_tissue()).density, 1000.0);
//! ```

use serde_json::{Value, json};

use crate::law::{AnyLaw, Deformation};
use crate::model::Material;
use crate::prony::{Prony, PronyPart, PronyTerm, PronyUpdate};
use crate::tensor::Tensor;

/// A law by its name and parameters in a scene file.
///
/// # Panics
/// If a parameter is wrong.
pub fn law(name: &str, parameters: Value) -> AnyLaw {
    AnyLaw::from_json(name, parameters).unwrap_or_else(|error| panic!("{error}"))
}

/// Brain-like tissue of the thesis: split neo-Hookean, E = 3000 Pa, ν = 0.45.
pub fn soft_tissue() -> AnyLaw {
    law("neo-hookean", json!({ "young-modulus": 3000.0, "poisson-ratio": 0.45 }))
}

/// Liver-like tissue without fibres: μ = 6568 Pa, ν = 0.45.
pub fn liver_matrix() -> AnyLaw {
    law("neo-hookean", json!({ "shear-modulus": 6568.0, "bulk-modulus": 6568.0 * 29.0 / 3.0 }))
}

/// Liver-like tissue with fibres of η = 13136 Pa in the energy convention.
pub fn liver() -> AnyLaw {
    let parameters =
        json!({ "shear-modulus": 6568.0, "bulk-modulus": 6568.0 * 29.0 / 3.0, "fibre-modulus": 13136.0 });
    law("transversely-isotropic", parameters)
}

/// Relaxation of the liver: half of the isochoric stress, τ = 0.58 s.
pub fn liver_relaxation(update: PronyUpdate) -> Prony {
    let term = PronyTerm { part: PronyPart::Isochoric, weight: 0.5, time: 0.58 };
    Prony::new(&[term], update).unwrap_or_else(|error| panic!("{error}"))
}

/// A law without history, of the density of water.
pub fn elastic(law: AnyLaw) -> Material {
    Material { law, prony: Prony::default(), density: 1000.0 }
}

/// The measures of a deformation gradient F.
pub fn deformation(gradient: [[f64; 3]; 3]) -> Deformation<f64> {
    let mut h = gradient;
    for (axis, row) in h.iter_mut().enumerate() {
        row[axis] -= 1.0;
    }
    Deformation::from_displacement_gradient(&Tensor(h))
}
