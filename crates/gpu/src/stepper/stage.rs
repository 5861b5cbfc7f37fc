//! Stage of the state on a device, and steps it may take before the next evaluation.

use pliant_explicit::stability::Stability;
use pliant_explicit::{Deformed, State, StepControl};

/// Most steps between two evaluated instants, with energies, deformation of the cells and checks.
const EVALUATE_EVERY: u64 = 100;

/// Evaluations are more frequent where the deformation changes by more than this factor from one to the next.
const CALM: f64 = 1.02;

/// Stage of the state on the device.
#[expect(clippy::large_enum_variant, reason = "a stepper has one")]
pub(super) enum Stage {
    /// No state was uploaded.
    Empty,
    /// A state was uploaded to a side of the arrays.
    Uploaded { side: usize },
    /// Candidates for contact are listed for the uploaded state.
    Listed { side: usize },
    /// An instant was evaluated; others may have followed.
    Evaluated(Progress),
}

impl Stage {
    fn progress(&self) -> Option<&Progress> {
        match self {
            Self::Evaluated(progress) => Some(progress),
            _ => None,
        }
    }

    /// Number of instants after the evaluated one.
    pub(super) fn instants(&self) -> u32 {
        self.progress().map_or(0, |progress| progress.instants)
    }

    /// Whole steps of a state after the evaluated instant.
    pub(super) fn steps(&self, state: &State<f32>) -> u64 {
        self.progress().map_or(0, |progress| state.steps - progress.steps)
    }

    /// Side of the arrays that holds the present instant.
    pub(super) fn side(&self) -> usize {
        match self {
            Self::Empty => 0,
            Self::Uploaded { side } | Self::Listed { side } => *side,
            Self::Evaluated(progress) => progress.side(),
        }
    }
}

/// The last evaluated instant, and the instants after it.
#[derive(Clone, Copy)]
pub(super) struct Progress {
    /// Side of the arrays, whole steps, time [s] and stability at the evaluated instant.
    side: usize,
    steps: u64,
    time: f64,
    stability: Stability,
    /// Number of instants after the evaluated one.
    pub(super) instants: u32,
    /// True if the state's energies contain the work of these instants. Then the present instant must be
    /// evaluated before further steps. The device adds to the same sums until an evaluation, so this work
    /// would be entered twice.
    pub(super) entered: bool,
}

impl Progress {
    /// Makes the progress at a state that was just evaluated, its arrays on a side.
    pub(super) fn new(state: &State<f32>, side: usize) -> Self {
        let State { steps, time, stability, .. } = *state;
        Self { side, steps, time, stability, instants: 0, entered: false }
    }

    /// Side of the arrays that holds the present instant. The step after an evaluation moves nodes in place,
    /// each later one changes sides.
    pub(super) fn side(&self) -> usize {
        (self.side + self.instants.saturating_sub(1) as usize) % 2
    }

    /// Moves the clock on by an instant.
    pub(super) fn count(&mut self, control: &mut StepControl, state: &mut State<f32>) {
        // The evaluation has noted the step that begins there.
        if self.instants > 0 && state.is_between_steps() {
            control.note(state);
        }
        control.count(state);
        self.instants += 1;
    }

    /// Sets the clock to the instant `to` after the evaluated one.
    pub(super) fn go_back(&mut self, control: &mut StepControl, state: &mut State<f32>, to: u32) {
        (state.steps, state.time, state.stability) = (self.steps, self.time, self.stability);
        self.instants = 0;
        while self.instants < to {
            self.count(control, state);
        }
    }
}

/// Number of whole steps that may pass until the next evaluation.
pub(super) struct Interval {
    /// Deformation of the cells at the last evaluation.
    pub(super) deformed: Deformed,
    /// Steps until the energies must be known.
    stride: u64,
    /// Steps to the next check of the critical time step.
    to_check: u64,
}

impl Default for Interval {
    fn default() -> Self {
        Self { deformed: Deformed::default(), stride: 1, to_check: 1 }
    }
}

impl Interval {
    /// Most steps that may pass.
    pub(super) fn steps(&self) -> u64 {
        self.stride.min(self.to_check)
    }

    /// Grows where the deformation hardly changed since the last evaluation, else shrinks.
    pub(super) fn adapt(&mut self, deformed: Deformed, to_check: u64) {
        let calm = !deformed.differs(&self.deformed, CALM);
        self.stride = if calm { (2 * self.stride).min(EVALUATE_EVERY) } else { (self.stride / 2).max(1) };
        (self.deformed, self.to_check) = (deformed, to_check);
    }
}
