//! Energies of bodies at one instant.

use serde::{Deserialize, Serialize};

/// Energies at one instant [J].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Energies {
    /// ½ Σ m v².
    pub kinetic: f64,
    /// ∫ f_int · du without hourglass control: stored and viscous part together.
    pub internal: f64,
    /// Taken by mass-proportional damping.
    pub damping: f64,
    /// Held by hourglass control.
    pub hourglass: f64,
    /// Work of loads and prescribed motions, and the kinetic energy given at the start.
    pub external: f64,
    /// Energy that explicit steps of changing length added: Σ ⅛ (Δt⁻² − Δt⁺²) Σ m|a|² over the changes from
    /// Δt⁻ to Δt⁺.
    pub step_changes: f64,
    /// Balance |kinetic + internal + damping + hourglass − external − step changes| over the largest of these
    /// energies so far. The kinetic energy includes ⅛ Δt² Σ m|a|² of the start: with loads that set in at
    /// once this part remains for good.
    pub balance: f64,
}

impl Energies {
    /// The sum of energies, and the worst of their balances.
    pub fn total(energies: impl Iterator<Item = Self>) -> Self {
        let add = |a: Self, b: Self| Self {
            kinetic: a.kinetic + b.kinetic,
            internal: a.internal + b.internal,
            damping: a.damping + b.damping,
            hourglass: a.hourglass + b.hourglass,
            external: a.external + b.external,
            step_changes: a.step_changes + b.step_changes,
            balance: a.balance.max(b.balance),
        };
        energies.reduce(add).unwrap_or_default()
    }
}
