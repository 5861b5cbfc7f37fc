//! Sound states of the last moments of a run. After a step that fails, the run continues from one of them: hands let go, or without hands
//! steps are halved.

use std::collections::VecDeque;

use pliant_sim::State;

use crate::hand::Hold;

/// Simulated time [s] from one to the next.
const EVERY: f64 = 0.25;
/// Steps from one to the next at most.
const MOST_STEPS: u64 = 1000;
/// How many there are at most, but for that at the start.
const MOST: usize = 8;
/// Memory [bytes] that all of them take, about.
const MEMORY: usize = 256 << 20;
/// Memory [bytes] that one takes for each node, about: displacements, increments, the internal forces of
/// the last two instants and what laws remember.
const NODE: usize = 250;

/// A state, and what the run was then.
#[derive(Clone)]
pub(crate) struct Sound {
    pub state: State,
    /// Steps done.
    pub steps: u64,
    pub hold: Hold,
    /// Moves that were recorded.
    pub moves: usize,
}

/// Those of a run as one world, the newest last.
#[derive(Default)]
pub(crate) struct SoundStates {
    first: Option<Sound>,
    later: VecDeque<Sound>,
    /// Steps done where the run went back last.
    back_at: u64,
    /// Whether that was the first one.
    at_first: bool,
    /// Whether hands did something since the run began or last went back.
    touched: bool,
    /// Steps done when they last did.
    touched_at: Option<u64>,
}

impl SoundStates {
    /// Hands do something after so many steps.
    pub fn touch(&mut self, steps: u64) {
        (self.touched, self.touched_at) = (true, Some(steps));
    }

    /// Whether a state is due after so many steps of a length [s].
    pub fn is_due(&self, steps: u64, step: f64) -> bool {
        let apart = ((EVERY / step).ceil() as u64).clamp(1, MOST_STEPS);
        let newest = self.later.back().or(self.first.as_ref());
        newest.is_none_or(|newest| steps >= newest.steps.max(self.back_at) + apart)
    }

    /// Keeps a state of so many nodes.
    pub fn keep(&mut self, sound: Sound, nodes: usize) {
        if self.first.is_none() {
            self.first = Some(sound);
            return;
        }
        if self.later.len() >= (MEMORY / (NODE * nodes.max(1))).clamp(1, MOST) {
            self.later.pop_front();
        }
        self.later.push_back(sound);
    }

    /// The newest state of no more than so many steps, and the ones after it are forgotten; the oldest that is kept where all have more.
    pub fn before(&mut self, steps: u64) -> Option<Sound> {
        while self.later.back().is_some_and(|newest| newest.steps > steps) {
            self.later.pop_back();
        }
        let sound = self.later.back().or(self.first.as_ref())?.clone();
        self.back_at = sound.steps;
        Some(sound)
    }

    /// The state to halve the steps from: the newest but one, or the first. `None` where hands did something since then: they let go instead.
    pub fn untouched(&mut self) -> Option<&mut Sound> {
        let place = self.later.len().checked_sub(2);
        let sound = place.map_or(self.first.as_mut(), |place| self.later.get_mut(place))?;
        if self.touched_at.is_some_and(|at| at >= sound.steps) {
            return None;
        }
        self.back_at = sound.steps;
        self.later.truncate(place.map_or(0, |place| place + 1));
        place.map_or(self.first.as_mut(), |place| self.later.get_mut(place))
    }

    /// The state to go back to after a break: the newest one that the run has not gone back to. `None` where hands did nothing and the run
    /// breaks all the same.
    pub fn take(&mut self) -> Option<Sound> {
        let newest = self.later.pop_back();
        let is_lost = newest.is_none() && self.at_first && !self.touched;
        let sound = newest.or_else(|| self.first.clone()).filter(|_| !is_lost)?;
        (self.at_first, self.touched, self.back_at) =
            (sound.steps == self.first.as_ref()?.steps, false, sound.steps);
        Some(sound)
    }
}
