//! The book of energies: sums over the nodes at an instant become work done so far, and are judged for
//! balance.

use pliant_mechanics::Energies;
use pliant_mechanics::model::Model;

use crate::lanes::LaneNumber;
use crate::state::Work;

/// The balance is judged once an energy exceeds this fraction of Σ V (λ+2μ): below it, round-off counts.
pub fn balance_floor<R: LaneNumber>() -> f64 {
    // 1e-9 in double and 1e-6 in single precision.
    (R::EPSILON * 10.0).max(1e-9)
}

/// A run ends if its energies are off balance by more than this fraction of the largest one …
pub const BALANCE_LIMIT: f64 = 0.05;

/// … for this many steps in a row. A shock unbalances the few steps in which the struck nodes move but their
/// stress wave is not yet resolved. A stable vibration with more than 5 % of its energy in the step error
/// (ωΔt > 0.45) passes through zero every seventh step. Only a growing vibration stays off balance.
pub const BALANCE_STEPS: u32 = 20;

/// Sums over the nodes at one instant [J], [W].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sums {
    /// ½ Σ m v².
    pub kinetic: f64,
    /// Σ α m v² [W].
    pub damping_power: f64,
    /// ½ Σ f_int · Δu with the increments before this instant.
    pub internal_before: f64,
    /// ½ Σ f_int · Δu with the increments after this instant.
    pub internal_after: f64,
    /// ½ Σ f · Δu of loads and reactions, with the increments before.
    pub external_before: f64,
    /// ½ Σ f · Δu of loads and reactions, with the increments after.
    pub external_after: f64,
}

impl Sums {
    pub(crate) fn merge(self, b: &Self) -> Self {
        Self {
            kinetic: self.kinetic + b.kinetic,
            damping_power: self.damping_power + b.damping_power,
            internal_before: self.internal_before + b.internal_before,
            internal_after: self.internal_after + b.internal_after,
            external_before: self.external_before + b.external_before,
            external_after: self.external_after + b.external_after,
        }
    }

    /// True if the kinetic energy and the sums after the instant are finite.
    pub fn is_finite(&self) -> bool {
        self.kinetic.is_finite() && self.internal_after.is_finite() && self.external_after.is_finite()
    }
}

/// Energy [J] above which the balance of a model is judged.
pub fn model_balance_floor<R: LaneNumber>(model: &Model) -> f64 {
    let stiffness: f64 = (model.solids.iter())
        .map(|solid| {
            let volume: f64 = (0..solid.cells.len()).map(|cell| solid.cells.volume(cell)).sum();
            volume * solid.longitudinal_modulus()
        })
        .sum();
    balance_floor::<R>() * stiffness
}

impl Work {
    /// Begins with the kinetic energy [J] given at the start, the energy [J] stored there and ⅛ Δt² Σ m|a|².
    pub fn begin(&mut self, kinetic: f64, stored: f64, shock: f64) {
        (self.external, self.internal, self.at_start) = (kinetic + stored, stored, shock);
    }

    /// Continues with another model: a law that is stiffer at once strikes the body as a load would. The
    /// balance is judged again once it has held. `gained` is the kinetic energy [J] of mass that came.
    pub fn shake(&mut self, gained: f64) {
        self.external += gained;
        (self.shaken, self.steps_off_balance) = (true, 0);
    }

    /// Enters the sums of an instant, `before` seconds after the one before; `None` at the start. A change of
    /// the step length there adds the energy `change` [J]. Judged above `floor`. What was entered before
    /// (`again`) is not entered twice.
    pub fn settle(
        &mut self,
        sums: &Sums,
        hourglass: f64,
        change: f64,
        before: Option<f64>,
        floor: f64,
        again: bool,
    ) -> Energies {
        if let (Some(before), false) = (before, again) {
            self.internal += sums.internal_before;
            self.external += sums.external_before;
            self.damping += 0.5 * (self.damping_power + sums.damping_power) * before;
        }
        self.damping_power = sums.damping_power;
        self.pending_internal = sums.internal_after;
        self.pending_external = sums.external_after;
        self.pending_change = change;
        let internal = self.internal - hourglass;
        self.largest = self.largest.max(sums.kinetic).max(internal).max(self.external.abs());
        // Left is ⅛ Δt⁻² Σ m|a|² of now: small where the step resolves the motion, growing where it is
        // unstable.
        let missing = if before.is_none() {
            0.0
        } else {
            let held = sums.kinetic + self.internal + self.damping + self.at_start;
            (held - self.external - self.step_changes).abs()
        };
        let balance = missing / self.largest.max(floor);
        let off = self.largest > floor && balance > BALANCE_LIMIT;
        if !again {
            self.shaken &= off;
            self.steps_off_balance = if off && !self.shaken { self.steps_off_balance + 1 } else { 0 };
        }
        Energies {
            kinetic: sums.kinetic,
            internal,
            damping: self.damping,
            hourglass,
            external: self.external,
            step_changes: self.step_changes,
            balance,
        }
    }

    /// Ends an instant whose sums are entered.
    pub fn advance(&mut self) {
        self.internal += self.pending_internal;
        self.external += self.pending_external;
        self.step_changes += self.pending_change;
    }

    /// Passes over several whole instants at once, `step` seconds apart, with their sums: internal and
    /// external work [J] and damping power [W].
    pub fn pass_over(&mut self, internal: f64, external: f64, damping_power: f64, step: f64) {
        self.internal += internal;
        self.external += external;
        self.damping += (0.5 * self.damping_power + damping_power) * step;
        // The trapezoid of the last instant is complete.
        self.damping_power = 0.0;
    }

    /// True if the energies were off balance at the last instant.
    pub fn is_off_balance(&self) -> bool {
        self.steps_off_balance > 0
    }

    /// True if the energies were off balance for too many steps in a row to continue.
    pub fn has_lost_balance(&self) -> bool {
        self.steps_off_balance >= BALANCE_STEPS
    }
}
