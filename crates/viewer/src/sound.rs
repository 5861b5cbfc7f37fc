//! Sound states of the last moments of a run. After a failed step, the run continues from one of these
//! states: hands let go, or without hands the steps are halved. Older states lie farther from each other, so
//! that they cover the whole run.

use std::collections::VecDeque;

use pliant_sim::SimulationState;

use crate::hand::Hold;

/// Simulated time [s] from one to the next.
const EVERY: f64 = 0.25;
/// Largest number of steps between states.
const MOST_STEPS: u64 = 1000;
/// Largest number of states, besides the one at the start.
const MOST: usize = 16;
/// Memory [bytes] that all of them take, about.
const MEMORY: usize = 256 << 20;
/// Approximate memory [bytes] of a state for each node. It holds displacements, increments, the internal
/// forces of the last two instants and the history of laws.
const NODE: usize = 250;

/// A state of a run, with the data of that instant.
#[derive(Clone)]
pub(crate) struct Sound {
    pub state: SimulationState,
    /// Steps done.
    pub steps: u64,
    pub hold: Hold,
    /// Moves that were recorded.
    pub moves: usize,
}

/// Sound states of a run of one world, the newest last.
#[derive(Default)]
pub(crate) struct SoundStates {
    first: Option<Sound>,
    later: VecDeque<Sound>,
    /// Steps done where the run went back last.
    back_at: u64,
    /// True if the state to which the run last went back was the first one.
    at_first: bool,
    /// True if a hand acted since the run began or last went back.
    touched: bool,
    /// Steps done when they last did.
    touched_at: Option<u64>,
}

/// Steps of a length [s] from one state to the next.
fn apart(step: f64) -> u64 {
    ((EVERY / step).ceil() as u64).clamp(1, MOST_STEPS)
}

impl SoundStates {
    /// Records that a hand acts after `steps` steps.
    pub fn touch(&mut self, steps: u64) {
        (self.touched, self.touched_at) = (true, Some(steps));
    }

    /// True if a state is due after `steps` steps of length `step` [s].
    pub fn is_due(&self, steps: u64, step: f64) -> bool {
        let apart = apart(step);
        let newest = self.later.back().or(self.first.as_ref());
        newest.is_none_or(|newest| steps >= newest.steps.max(self.back_at) + apart)
    }

    /// Keeps a state of a model with `nodes` nodes.
    pub fn keep(&mut self, sound: Sound, nodes: usize) {
        if self.first.is_none() {
            self.first = Some(sound);
            return;
        }
        self.later.push_back(sound);
        if self.later.len() > (MEMORY / (NODE * nodes.max(1))).clamp(1, MOST) {
            self.thin();
        }
    }

    /// Forgets the state whose neighbours lie nearest to each other for its age.
    fn thin(&mut self) {
        let newest = self.later.back().map_or(0, |sound| sound.steps);
        let start = self.first.as_ref().map_or(0, |sound| sound.steps);
        let steps = |at: usize| self.later[at].steps;
        let gap = |&at: &usize| {
            let before = if at > 0 { steps(at - 1) } else { start };
            (steps(at + 1) - before) as f64 / (newest - steps(at)).max(1) as f64
        };
        let crowded = (0..self.later.len() - 1).min_by(|a, b| gap(a).total_cmp(&gap(b)));
        crowded.map(|at| self.later.remove(at));
    }

    /// Returns the newest state with at most `steps` steps of length `step` [s], and forgets the later ones.
    /// If all states have more steps, the oldest one is returned. The start counts only if the run was near
    /// it.
    pub fn before(&mut self, steps: u64, step: f64) -> Option<Sound> {
        let older = self.later.partition_point(|sound| sound.steps <= steps);
        let start = self.first.as_ref()?;
        let from_start = older == 0 && (self.later.is_empty() || steps < start.steps + apart(step));
        self.later.truncate(if from_start { 0 } else { older.max(1) });
        let sound = self.later.back().or(self.first.as_ref())?.clone();
        self.back_at = sound.steps;
        Some(sound)
    }

    /// True if a run of `steps` steps of length `step` [s] is at most the distance of two states from its
    /// start.
    pub(crate) fn has_just_begun(&self, steps: u64, step: f64) -> bool {
        self.first.as_ref().is_some_and(|first| steps <= first.steps + apart(step))
    }

    /// The state to halve the steps from: the newest but one, or the first. `None` where hands did something
    /// since then: they let go instead.
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

    /// Returns the state to go back to after a break: the newest one that the run has not gone back to.
    /// `None` if no hand acted and the run breaks all the same.
    pub fn take(&mut self) -> Option<Sound> {
        let newest = self.later.pop_back();
        let is_lost = newest.is_none() && self.at_first && !self.touched;
        let sound = newest.or_else(|| self.first.clone()).filter(|_| !is_lost)?;
        (self.at_first, self.touched, self.back_at) =
            (sound.steps == self.first.as_ref()?.steps, false, sound.steps);
        Some(sound)
    }
}
