//! Strides of steps: submitted, waited for, checked, and taken back where one failed.

use std::sync::Arc;
use std::time::Instant as Clock;

use pliant_explicit::{CentralDifference, Deformed, Lengths, State, StepError};

use super::results::Results;
use super::{GpuStepper, Origin, force_kernels};
use crate::GpuError;
use crate::contacts::DeviceContacts;
use crate::run::{Instant, StepFailure, UNLISTED, flags, room};
use crate::transfer::Four;

impl GpuStepper {
    /// Goes whole steps on without looking; the last submission, which may not be done yet. Where bodies touch each other, one number is
    /// read back to see whether the device has stopped for lists of candidates.
    pub(super) fn go(
        &mut self,
        state: &mut State<f32>,
        steps: u64,
    ) -> Result<Option<wgpu::SubmissionIndex>, GpuError> {
        let end = state.steps + steps;
        let mut last = self.go_to(state, end)?;
        while let Some(at) = self.unlisted()? {
            self.go_back(state, at);
            self.list()?;
            last = self.go_to(state, end)?;
        }
        Ok(last)
    }

    /// The instant at which the device waits for lists of candidates, unless it has failed before.
    pub(super) fn unlisted(&mut self) -> Result<Option<u32>, GpuError> {
        if !self.contacts.as_ref().is_some_and(DeviceContacts::has_pairs) {
            return Ok(None);
        }
        let mut found = u32::MAX;
        let findings = &self.instants.findings;
        self.transfer.read::<u32>(&self.device, findings, UNLISTED + 1, |all| found = all[UNLISTED])?;
        Ok((found != u32::MAX).then_some(found))
    }

    /// Lists candidates for contact anew.
    pub(super) fn list(&mut self) -> Result<(), GpuError> {
        self.listed = true;
        let Some(contacts) = self.contacts.as_mut().filter(|own| own.has_pairs()) else { return Ok(()) };
        let (nodes, device) = (&self.nodes, &self.device);
        let (from, mut listed) = (&nodes.displacement[self.side], Ok(()));
        self.transfer
            .read::<Four>(device, from, nodes.count, |all| listed = contacts.list(device, nodes, all))?;
        self.instants.go_on(device);
        listed
    }

    /// Goes on to a number of whole steps without looking.
    pub(super) fn go_to(
        &mut self,
        state: &mut State<f32>,
        end: u64,
    ) -> Result<Option<wgpu::SubmissionIndex>, GpuError> {
        let mut from_look = std::mem::take(&mut self.evaluated);
        if from_look {
            state.work.advance();
        }
        self.entered = false;
        let mut side = self.side;
        let mut running: Option<(wgpu::SubmissionIndex, usize)> = None;
        let mut begun = Clock::now();
        while state.steps < end {
            let most = room(self.pace);
            while state.steps < end && self.instants.len() < most {
                let lengths = match self.since {
                    0 => self.lengths,
                    _ => Lengths { before: self.lengths.next, next: self.lengths.next },
                };
                let damping = self.damping_factors(state, lengths.before);
                let instant = Instant::new(self.since, flags::MOVES, lengths, damping);
                let of = (self.model.as_ref(), &state.driven[..]);
                self.instants.push(of, state.time, lengths.next, instant);
                self.count(state);
            }
            let count = self.instants.len();
            if !from_look || count > 1 {
                self.relax(self.lengths.next);
            }
            let submitted = self.submit_steps(from_look, side);
            side = self.side;
            from_look = false;
            // One submission waits while another runs.
            if let Some((earlier, count)) = running.replace((submitted.clone(), count)) {
                self.wait_for(earlier, &mut begun, count)?;
            } else if self.pace.is_none() {
                self.wait_for(submitted, &mut begun, count)?;
            }
        }
        self.device.check()?;
        Ok(running.map(|(last, _)| last))
    }

    /// Waits for a submission of some instants, and notes how long one takes.
    pub(super) fn wait_for(
        &mut self,
        submission: wgpu::SubmissionIndex,
        begun: &mut Clock,
        instants: usize,
    ) -> Result<(), GpuError> {
        self.device.wait_for(submission)?;
        self.pace = Some(begun.elapsed().as_secs_f64() / instants as f64);
        *begun = Clock::now();
        Ok(())
    }

    /// Moves the clock on by an instant. Whole steps that begin without a look are noted here.
    pub(super) fn count(&mut self, state: &mut State<f32>) {
        if self.since > 0 {
            // The step after a look moves nodes in place.
            self.side = 1 - self.side;
            if state.is_between_steps() {
                self.control.note(state);
            }
        }
        self.control.count(state);
        self.since += 1;
    }

    /// Looks at the limit where that is due, and chooses the parts of the step to come.
    pub(super) fn watch(
        &mut self,
        state: &mut State<f32>,
        deformed: &Deformed,
    ) -> Result<Result<(), StepError>, GpuError> {
        if self.control.is_due(state, deformed) && !self.control.pass(state, deformed) {
            let displacement = &mut state.displacement;
            self.transfer.read::<Four>(
                &self.device,
                &self.nodes.displacement[self.side],
                self.nodes.count,
                |fours| {
                    displacement.iter_mut().zip(fours).for_each(|(to, &[x, y, z, _])| *to = [x, y, z]);
                },
            )?;
            self.control.look(&self.model, &self.owners, state, deformed);
        }
        let below = self.control.choose(&self.model, state);
        self.control.note(state);
        Ok(below)
    }

    /// Relaxes from now on over steps of `step` seconds.
    pub(super) fn relax(&mut self, step: f64) {
        if self.relaxing != Some(step) {
            self.relaxing = Some(step);
            for (on_device, solid) in self.solids.iter().zip(&self.model.solids) {
                on_device.set_step(&self.device, solid, step);
            }
        }
    }

    /// Goes on from the instants that are pushed, at first with a side; the first of them may be an evaluated one.
    pub(super) fn submit_steps(&mut self, from_look: bool, mut side: usize) -> wgpu::SubmissionIndex {
        let nodes = &self.kernels;
        let forces = || force_kernels(&self.loads, &self.grips, &self.solids, &self.ties);
        let (moves, contacts) = (self.paths.moves, &self.contacts);
        let follow = self.ties.as_ref().map(|ties| &ties.follow);
        self.instants.submit(&self.device, |pass, bound, place, offset| {
            if from_look && place == 0 {
                nodes.advance.run(pass, bound, offset, side);
                follow.iter().for_each(|kernel| kernel.run(pass, bound, offset, side));
                return;
            }
            let before = contacts.iter().filter_map(|contacts| contacts.before.as_ref());
            before.for_each(|kernel| kernel.run(pass, bound, offset, side));
            forces().for_each(|kernel| kernel.run(pass, bound, offset, side));
            let touching = contacts.iter().flat_map(|contacts| &contacts.kernels);
            touching.for_each(|kernel| kernel.run(pass, bound, offset, side));
            if !moves {
                nodes.pass.run(pass, bound, offset, side);
                follow.iter().for_each(|kernel| kernel.run(pass, bound, offset, side));
            }
            side = 1 - side;
        })
    }

    /// # Errors
    /// If a check failed at an instant, where the device then stopped.
    pub(super) fn check(&mut self, state: &mut State<f32>, results: &Results) -> Result<(), StepFailure> {
        match (results.broken, results.overflown) {
            // The forces of a broken cell may be of any size.
            (Some(broken), overflown) if overflown.is_none_or(|other| broken <= other) => {
                Err(self.fail(state, broken))
            }
            (_, Some(overflown)) => {
                self.go_back(state, overflown);
                self.bring_arrays_back(state)?;
                Err(GpuError::Overflow { design: self.design.to_string(), time: state.time }.into())
            }
            _ => Ok(()),
        }
    }

    /// Sets the clock to one of the instants since the last look.
    pub(super) fn go_back(&mut self, state: &mut State<f32>, to: u32) {
        if let Some(Origin { side, steps, time, stability }) = self.origin {
            (state.steps, state.time, state.stability) = (steps, time, stability);
            self.side = side;
            self.since = 0;
            while self.since < to {
                self.count(state);
            }
        }
    }

    /// Reads the state back as it was at an instant whose checks failed. The CPU then finds the cause.
    pub(super) fn fail(&mut self, state: &mut State<f32>, at: u32) -> StepFailure {
        self.go_back(state, at);
        if let Err(error) = self.bring_arrays_back(state) {
            return error.into();
        }
        let mut copy = State { work: Default::default(), ..state.clone() };
        let found = CentralDifference::new(Arc::clone(&self.model), self.control.step())
            .map_err(|error| error.to_string())
            .and_then(|mut stepper| match stepper.evaluate(&mut copy) {
                Err(error) => Ok(error),
                Ok(()) => Err("a cell that it reports as broken is valid on the CPU".to_owned()),
            });
        match found {
            Ok(error) => error.into(),
            Err(reason) => GpuError::Internal { adapter: self.device.adapter().name.clone(), reason }.into(),
        }
    }
}
