//! The two commonest laws with the quadratic volumetric energy, written in code: `AnyLaw::NeoHookean(NeoHookean { shear,
//! bulk })`. What runs is [`SplitNeoHookean`] and [`FibredNeoHookean`].

use super::{AnyLaw, FibredNeoHookean, SplitNeoHookean, Volumetric};

/// The moduli of a neo-Hookean solid, Ψ = μ/2 (Ī₁ − 3) + κ/2 (J − 1)².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NeoHookean {
    /// Shear modulus μ [Pa].
    pub shear: f64,
    /// Bulk modulus κ [Pa].
    pub bulk: f64,
}

/// The moduli of a neo-Hookean solid with one family of fibres, η/2 (Ī₄ − 1)² added.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransverselyIsotropic {
    /// The matrix.
    pub matrix: NeoHookean,
    /// Fibre modulus η [Pa].
    pub fibre: f64,
}

#[expect(non_snake_case, reason = "they read as the variants they make")]
impl AnyLaw {
    /// The split neo-Hookean law with these moduli.
    pub fn NeoHookean(NeoHookean { shear, bulk }: NeoHookean) -> Self {
        Self::SplitNeoHookean(SplitNeoHookean { shear, volumetric: Volumetric::quadratic(bulk) })
    }

    /// The transversely isotropic law with these moduli.
    pub fn TransverselyIsotropic(TransverselyIsotropic { matrix, fibre }: TransverselyIsotropic) -> Self {
        let NeoHookean { shear, bulk } = matrix;
        Self::FibredNeoHookean(FibredNeoHookean { shear, fibre, volumetric: Volumetric::quadratic(bulk) })
    }
}
