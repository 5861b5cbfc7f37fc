//! Laws for GPUs: each is a snippet of WGSL next to its Rust twin. This file joins a law with the functions
//! that it calls.

/// The stress of a law in WGSL.
///
/// The text needs only `fn parameter(index: u32) -> f32`, which the module around it defines. It gives
/// `law_stress(deformation(h), a, b)`: the two parts of the second Piola–Kirchhoff stress [Pa]. Its arguments
/// are the displacement gradient and the directions of the fibres (any, where the law has no fibres). If [the
/// law's energy has a volumetric part](super::AnyLaw::has_volumetric_energy), the text also gives
/// `law_pressure(volume_change)`: U′(J) [Pa].
#[derive(Clone, Debug, PartialEq)]
pub struct Shader {
    /// WGSL; the same for all parameters of a law and a volumetric energy.
    pub source: String,
    /// Values that `parameter` returns, by index. At least one.
    pub parameters: Vec<f32>,
}

impl Shader {
    /// From the law's own snippets and parameters.
    pub(super) fn new(snippets: &[&str], parameters: &[f64]) -> Self {
        let shared = [include_str!("numbers.wgsl"), include_str!("deformation.wgsl")];
        Self {
            source: [&shared, snippets].concat().join("\n"),
            parameters: parameters.iter().map(|&p| p as f32).collect(),
        }
    }
}
