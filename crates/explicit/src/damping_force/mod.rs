//! Damping forces of explicit steps, from the internal forces f, f₁ and f₂ of the instant and of the last two
//! before it:
//!
//! ```text
//! D = η (f − f*) + β (f − f₁)/Δt⁻,   f* = f₁ + r (f₁ − f₂),   r = Δt⁻/Δt⁻⁻.
//! ```
//!
//! The increments become Δuⁿ⁺¹ = Δuⁿ + Δt²/m (R − f − D). D costs no evaluation of forces. It has no sum over
//! a body, as f has none, and is zero in rigid translation.
//!
//! *η dissipates the highest modes.* Lightly damped bodies otherwise go into parametric resonance. A slow
//! vibration changes their stiffness, and modes near the critical time step grow from round-off until cells
//! invert. The force f* extrapolates the internal forces, so with equal steps its part of D is η δ²f. At η =
//! 1/27 this is the explicit scheme of Hulbert and Chung (1996) with ρ_b = ½, and at η = 0 central
//! differences. Let a mode have the frequency ω, and Ω = ω Δt. Its characteristic polynomial is z (z − 1)² +
//! Ω² ((1 + η) z² − 2 η z + η). A resolved mode loses ½ η Ω⁴ of its amplitude in a step, so the scheme is
//! accurate to second order: 2.5e-7 at Ω = 0.1, 0.25 % at Ω = 1, 2.8 % at 0.9 of the critical time step. The
//! critical time step falls by the factor 1/√(1 + 4 η), 1 %. The moment of the force is of fourth order in
//! the angle of a step. `docs/lab/performance.md` compares this force with shorter steps.
//!
//! *β damps by stiffness*: β ḟ by the difference to the instant before. For any law and element this is β K v
//! with the tangent K and the velocities half a step ago. A mode of angular frequency ω is damped with the
//! ratio ξ = βω/2. The scheme is stable while ω² Δt² + 2 β ω² Δt ≤ 4, that is up to Δt = (2/ω) (√(1 + ξ²) −
//! ξ) ([`damped`]; Belytschko, Liu and Moran 2000, 6.2). Nodal forces turn with a body. So a rigid rotation
//! of angular velocity Ω is damped at the rate β Ω². A turning body has the stress of the time β later. A
//! stress that a relaxing law loses counts as a change of its forces, too.

use pliant_mechanics::tensor::Vector;

use crate::lanes::LaneNumber;

/// η.
pub const DISSIPATION: f64 = 0.005;

/// The critical time step [s] with damping by stiffness β [s], from the one without.
pub(crate) fn damped(limit: f64, damping: f64) -> f64 {
    if damping == 0.0 || limit.is_infinite() {
        return limit;
    }
    limit * limit / (damping.hypot(limit) + damping)
}

/// The critical time step [s] without damping by stiffness β [s], from the one with it.
pub(crate) fn undamped(limit: f64, damping: f64) -> f64 {
    if damping == 0.0 { limit } else { (limit * (limit + 2.0 * damping)).sqrt() }
}

/// Factors of the damping forces at an instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DampingFactors {
    /// η.
    pub dissipation: f64,
    /// r.
    pub extrapolation: f64,
    /// β/Δt⁻.
    pub stiffness: f64,
}

/// Internal forces of the last two instants, from which the damping force comes.
#[derive(Clone, Copy)]
pub(crate) struct Past<'a, R> {
    dissipation: R,
    extrapolation: R,
    stiffness: R,
    /// f₁ and f₂ [N].
    forces: [&'a [Vector<R>]; 2],
}

impl<'a, R: LaneNumber> Past<'a, R> {
    /// The forces [N] that a state has kept, the later ones first.
    pub(crate) fn of(forces: &'a [Vec<Vector<R>>; 2], factors: DampingFactors) -> Self {
        let DampingFactors { dissipation, extrapolation, stiffness } = factors;
        let [dissipation, extrapolation, stiffness] = [dissipation, extrapolation, stiffness].map(R::of);
        let [last, before] = forces;
        Self { dissipation, extrapolation, stiffness, forces: [last, before] }
    }

    /// The forces on the nodes from `first` on.
    pub(crate) fn from(self, first: usize) -> Self {
        Self { forces: self.forces.map(|forces| &forces[first..]), ..self }
    }

    /// D [N] on nodes from their internal forces [N].
    #[inline(always)]
    pub(crate) fn damp(&self, internal: &[Vector<R>], to: &mut [Vector<R>]) {
        let [last, before] = self.forces.map(|forces| forces[..internal.len()].as_flattened());
        let pairs =
            to.as_flattened_mut().iter_mut().zip(internal.as_flattened()).zip(last.iter().zip(before));
        for ((to, &force), (&last, &before)) in pairs {
            let change = force - last;
            *to =
                self.dissipation * (change - self.extrapolation * (last - before)) + self.stiffness * change;
        }
    }
}

#[cfg(test)]
mod tests;
