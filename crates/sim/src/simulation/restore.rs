//! Returns of a simulation to other states, and its exchange for another setup.

use std::sync::Arc;

use super::state::OwnState;
use super::{Setup, Simulation, SimulationState, resume, take_place_of};
use crate::coupled_surfaces::Meetings;
use crate::failure::{Failure, FailureKind};
use crate::penalty::Springs;

impl Simulation {
    /// Goes to an earlier or later state of this setup. Hands let go; forces of [`push`](Self::push) stay.
    ///
    /// # Errors
    /// If it is of another setup, or a device fails. The simulation then stays as it was.
    pub fn restore(&mut self, state: SimulationState) -> Result<(), Failure> {
        state.check(&self.setup)?;
        self.go_back(state)?;
        self.participants.iter_mut().for_each(|participant| participant.cut_log());
        self.grip(&[]);
        Ok(())
    }

    /// Goes back to a state that fits the setup.
    pub(super) fn go_back(
        &mut self,
        SimulationState(parts, between): SimulationState,
    ) -> Result<(), Failure> {
        let springs = Springs::new(&self.setup.ties, &self.setup.parts, between.ties)?;
        let meetings = Meetings::new(
            &self.setup.coupled_surfaces,
            &self.setup.parts,
            &self.ratios,
            between.coupled_surfaces,
        )?;
        self.put_back(&parts, |_, _| true)?;
        (self.springs, self.meetings, self.evaluated) = (springs, meetings, false);
        Ok(())
    }

    /// Brings some participants back to states of their parts. Participants that can't go back are made anew.
    /// Where one can't be made, nothing changes.
    pub(super) fn put_back(
        &mut self,
        states: &[OwnState],
        chosen: impl Fn(&Self, usize) -> bool,
    ) -> Result<(), Failure> {
        let mut made = Vec::new();
        for (part, state) in states.iter().enumerate() {
            if chosen(self, part) && !self.participants[part].goes_back_to(&state.snapshot) {
                made.push((part, resume(&self.setup.parts[part], state.clone())?));
            }
        }
        for (part, state) in states.iter().enumerate() {
            if chosen(self, part) && self.participants[part].goes_back_to(&state.snapshot) {
                self.participants[part].go_back(&state.snapshot, state.steps())?;
            }
        }
        for (part, anew) in made {
            let mut before = std::mem::replace(&mut self.participants[part], anew);
            take_place_of(&mut self.participants[part], &mut before);
            if let Some(flag) = &self.stop {
                self.participants[part].stop_on(flag);
            }
            self.push_part(part);
        }
        Ok(())
    }

    /// Continues from the present state with other values (laws, loads, steps). Hands let go; forces of
    /// [`push`](Self::push) stay. Returns false, and nothing changes, where the other setup has other meshes,
    /// solvers or number types.
    ///
    /// # Errors
    /// Errors of [`state`](Self::state), or if a stepper can't be made. The simulation then stays as it was.
    pub fn exchange(&mut self, setup: impl Into<Arc<Setup>>) -> Result<bool, Failure> {
        let state = self.state()?;
        match Self::continued(setup, state, &self.setup)? {
            Some(other) => {
                let mut before = std::mem::replace(self, other);
                for (participant, before) in self.participants.iter_mut().zip(&mut before.participants) {
                    take_place_of(participant, before);
                }
                if let Some(flag) = &before.stop {
                    self.stop_on(flag);
                }
                self.pushed = before.pushed;
                (0..self.participants.len()).for_each(|part| self.push_part(part));
                Ok(true)
            }
            None => Ok(false),
        }
    }

    /// The state of each participant as bytes of a checkpoint; with ties or contacts between participants,
    /// theirs after them.
    ///
    /// # Errors
    /// If a device fails, or a state can't be encoded.
    pub fn encode(&mut self) -> Result<Vec<Vec<u8>>, Failure> {
        let state = self.state()?;
        state
            .encode()
            .map_err(|error| Failure::new(FailureKind::Output, error.to_string(), Some(self.time())))
    }
}
