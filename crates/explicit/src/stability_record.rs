//! The record of a run's critical time step, and of the steps that were cut: part of the state.

use pliant_mechanics::count;
use pliant_mechanics::model::Model;
use serde::{Deserialize, Serialize};

use crate::damping_force::{DISSIPATION, DampingFactors};
use crate::forces::Deformed;
use crate::foresight::Foresight;
use crate::substeps::{MOST_HALVINGS, MOST_SUBSTEPS};

/// Record of the cuts of a run's steps, and of the limits that its checks found. The state holds this record,
/// so a copy of the state continues with the same bits.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stability {
    /// Parts of the step under way, or of the last one.
    pub substeps: u32,
    /// Parts of the step under way already done; 0 between steps.
    pub done: u32,
    /// Checks of the limit.
    #[serde(deserialize_with = "count::read")]
    pub checks: u64,
    /// Critical time steps computed since the beginning.
    #[serde(deserialize_with = "count::read")]
    pub critical_steps: u32,
    /// The last check.
    pub last: Option<StepLimit>,
    /// The check with the smallest limit.
    pub smallest: Option<StepLimit>,
    /// Steps at the start of which the limit was known to be below the whole step.
    #[serde(deserialize_with = "count::read")]
    pub steps_below: u64,
    /// Number of times that whole steps were given up for substeps.
    #[serde(deserialize_with = "count::read")]
    pub cuts: u32,
    /// Time [s] of the first cut.
    pub first_cut: Option<f64>,
    /// Time [s] at which the last step that was cut began.
    pub last_cut: Option<f64>,
    /// The most parts of a step.
    #[serde(deserialize_with = "count::read")]
    pub most_substeps: u32,
    /// Substeps beyond one a step, in all.
    #[serde(deserialize_with = "count::read")]
    pub extra_steps: u64,
    /// Number of times that the steps were halved after a failure.
    pub halvings: u32,
    /// Steps done when the limit last asked for as many parts as there are.
    pub(crate) needed_at: u64,
    /// Ratio of the last two steps, by which internal forces are extrapolated; none before the first force is
    /// known.
    pub(crate) extrapolation: Option<f64>,
    /// The last critical time step and the steps done then; its state is
    /// [`State::reference`](crate::State::reference).
    pub(crate) reference: Option<(f64, u64)>,
    /// Deformation at the last check.
    pub(crate) deformed: Deformed,
    /// Steps done at the last check.
    pub(crate) checked_at: u64,
    /// Checks that are passed over.
    pub(crate) foresight: Foresight,
}

impl Default for Stability {
    fn default() -> Self {
        Self {
            substeps: 1,
            done: 0,
            checks: 0,
            critical_steps: 0,
            halvings: 0,
            needed_at: 0,
            extrapolation: None,
            reference: None,
            last: None,
            smallest: None,
            steps_below: 0,
            cuts: 0,
            first_cut: None,
            last_cut: None,
            most_substeps: 1,
            extra_steps: 0,
            deformed: Deformed::default(),
            checked_at: 0,
            foresight: Foresight::default(),
        }
    }
}

impl Stability {
    /// True if the record fits a state between two steps of a model, after `steps` steps.
    pub fn fits(&self, model: &Model, steps: u64) -> bool {
        let known = |found: &StepLimit| {
            model.solids.get(found.solid).is_some_and(|solid| found.cell < solid.cells.len())
                && found.limit > 0.0
        };
        let before = [
            Some(self.needed_at),
            Some(self.checked_at),
            self.reference.map(|(_, at)| at),
            self.foresight.noted_at(),
        ];
        self.done == 0
            && before.into_iter().flatten().all(|at| at <= steps)
            && self.halvings <= MOST_HALVINGS
            && (1..=MOST_SUBSTEPS << self.halvings).contains(&self.substeps)
            && self.last.iter().chain(&self.smallest).all(known)
    }

    /// Returns the factors of the damping forces after a step of `before` [s], with damping by stiffness [s].
    /// `dissipates` adds dissipation of the highest modes. All factors are zero before the first force is
    /// known.
    pub fn damping_factors(&self, dissipates: bool, damping: f64, before: f64) -> DampingFactors {
        let dissipation = if dissipates { DISSIPATION } else { 0.0 };
        let known =
            |extrapolation| DampingFactors { dissipation, extrapolation, stiffness: damping / before };
        self.extrapolation.map_or_else(DampingFactors::default, known)
    }

    /// Forgets the limits of another model. Steps stay cut as they are until the first check.
    pub(crate) fn forget(&mut self) {
        let unseen = Self::default();
        (self.checks, self.last, self.smallest) = (unseen.checks, unseen.last, unseen.smallest);
        (self.reference, self.deformed, self.checked_at) =
            (unseen.reference, unseen.deformed, unseen.checked_at);
        (self.foresight, self.extrapolation) = (unseen.foresight, unseen.extrapolation);
    }

    /// Records a check and the deformation it was made at.
    pub(crate) fn note(&mut self, limit: StepLimit, deformed: Deformed, steps: u64) {
        self.checks += 1;
        self.foresight.note(limit.limit, steps, deformed);
        (self.last, self.deformed, self.checked_at) = (Some(limit), deformed, steps);
        if self.smallest.is_none_or(|smallest| limit.limit < smallest.limit) {
            self.smallest = Some(limit);
        }
    }

    /// Records a check that was passed over: the last limit stands.
    pub(crate) fn pass(&mut self, deformed: Deformed, steps: u64) {
        (self.deformed, self.checked_at) = (deformed, steps);
    }

    /// Records into how many parts the step that begins now is cut.
    pub(crate) fn note_substeps(&mut self, substeps: u32, time: f64) {
        if substeps > 1 {
            self.cuts += u32::from(self.substeps == 1);
            self.first_cut.get_or_insert(time);
            self.last_cut = Some(time);
            self.most_substeps = self.most_substeps.max(substeps);
            self.extra_steps += u64::from(substeps) - 1;
        }
    }
}

/// The limit at an instant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepLimit {
    /// Time [s].
    pub time: f64,
    /// The largest stable step [s], estimated or true.
    pub limit: f64,
    /// The solid of the cell that sets it.
    pub solid: usize,
    /// The cell in that solid.
    pub cell: usize,
}
