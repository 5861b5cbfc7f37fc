//! Points evaluated together: elements fill in deformations, the law answers with stresses. So an element is compiled once
//! for each number type and a law once for each, not every law again in every element; the choice of the law costs one
//! branch per batch.

use super::BATCH;
use crate::Real;
use crate::law::{AnyLaw, Deformation, Law, Split, with_law};
use crate::tensor::{Symmetric, Tensor, Vector};

/// Deformations of up to [`BATCH`] points and their elastic stresses.
pub(super) struct Batch<R> {
    pub deformation: [Deformation<R>; BATCH],
    /// Second Piola–Kirchhoff stress [Pa].
    pub elastic: [Split<Symmetric<R>>; BATCH],
}

impl<R: Real> Batch<R> {
    pub(super) fn new() -> Self {
        Self {
            deformation: [Deformation::from_displacement_gradient(&Tensor::ZERO); BATCH],
            elastic: [Split { isochoric: Symmetric::ZERO, volumetric: Symmetric::ZERO }; BATCH],
        }
    }

    /// The stresses of the first `count` points. `fibres` has their directions, as many a point as the law
    /// has families.
    pub(super) fn evaluate(&mut self, law: &AnyLaw, count: usize, fibres: &[Vector<R>]) {
        let (deformation, elastic) = (&self.deformation[..count], &mut self.elastic[..count]);
        with_law!(law, law => stresses(law, deformation, fibres, elastic));
    }
}

#[inline(never)]
fn stresses<R: Real, L: Law>(
    law: &L,
    deformations: &[Deformation<R>],
    fibres: &[Vector<R>],
    stresses: &mut [Split<Symmetric<R>>],
) {
    let families = law.families();
    for (point, (stress, deformation)) in stresses.iter_mut().zip(deformations).enumerate() {
        *stress = law.stress(deformation, &fibres[point * families..(point + 1) * families]);
    }
}

/// U'(J) [Pa] of a law whose volumetric stress is J U'(J) C⁻¹, from its stress in a pure dilation F = J^(1/3) I.
/// Takes J − 1.
pub(crate) fn pressure<R: Real>(law: &AnyLaw, volume_change: R) -> R {
    let j = R::ONE + volume_change;
    let c = j.cbrt();
    // c − 1 = x/(c² + c + 1), without cancellation.
    let stretch = volume_change / (c * c + c + R::ONE);
    let mut h = Tensor::ZERO;
    for i in 0..3 {
        h.0[i][i] = stretch;
    }
    // S = J U' C⁻¹ with C⁻¹ = c⁻² I.
    let deformation = [Deformation::from_displacement_gradient(&h)];
    let mut stress = [Split { isochoric: Symmetric::ZERO, volumetric: Symmetric::ZERO }];
    with_law!(law, law => stresses(law, &deformation, &[[R::ONE, R::ZERO, R::ZERO]; 2], &mut stress));
    stress[0].volumetric.0[0] * c * c / j
}
