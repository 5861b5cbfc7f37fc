//! Strides of steps: submitted, waited for, checked, and taken back where one failed.

use std::sync::Arc;
use std::time::Instant as Clock;

use pliant_explicit::{CentralDifference, Deformed, Lengths, State, StepError};

use super::GpuStepper;
use super::results::Results;
use super::stage::{Progress, Stage};
use crate::GpuError;
use crate::contacts::DeviceContacts;
use crate::kernel::Kernel;
use crate::run::{Instant, StepFailure, UNLISTED, flags, room};
use crate::transfer::Four;

impl GpuStepper {
    /// Takes whole steps without an evaluation. Returns the last submission, which may not be done yet. If
    /// bodies touch each other, one number is read back to see if the device has stopped for lists of
    /// candidates.
    pub(super) fn go(
        &mut self,
        state: &mut State<f32>,
        mut progress: Progress,
        steps: u64,
    ) -> Result<Option<wgpu::SubmissionIndex>, GpuError> {
        let last = self.go_and_list(state, &mut progress, state.steps + steps);
        // The clock has moved on even where the device fails.
        self.stage = Stage::Evaluated(progress);
        last
    }

    fn go_and_list(
        &mut self,
        state: &mut State<f32>,
        progress: &mut Progress,
        end: u64,
    ) -> Result<Option<wgpu::SubmissionIndex>, GpuError> {
        let mut last = self.go_to(state, progress, end)?;
        while let Some(at) = self.unlisted()? {
            progress.go_back(&mut self.control, state, at);
            self.list(progress.side())?;
            last = self.go_to(state, progress, end)?;
        }
        Ok(last)
    }

    /// The instant at which the device waits for lists of candidates, unless it has failed before.
    fn unlisted(&mut self) -> Result<Option<u32>, GpuError> {
        if !self.forces.contacts.as_ref().is_some_and(DeviceContacts::has_pairs) {
            return Ok(None);
        }
        let mut found = u32::MAX;
        let findings = &self.instants.findings;
        self.transfer
            .read::<u32>(&self.device, findings, UNLISTED + 1, |numbers| found = numbers[UNLISTED])?;
        Ok((found != u32::MAX).then_some(found))
    }

    /// Lists candidates for contact anew, from the displacements on a side.
    pub(super) fn list(&mut self, side: usize) -> Result<(), GpuError> {
        let Some(contacts) = self.forces.contacts.as_mut().filter(|contacts| contacts.has_pairs()) else {
            return Ok(());
        };
        let (nodes, device) = (&self.nodes, &self.device);
        let (from, mut listed) = (&nodes.displacement[side], Ok(()));
        self.transfer.read::<Four>(device, from, nodes.count, |displacements| {
            listed = contacts.list(device, nodes, displacements)
        })?;
        self.instants.go_on(device);
        listed
    }

    /// Advances to a number of whole steps without an evaluation.
    fn go_to(
        &mut self,
        state: &mut State<f32>,
        progress: &mut Progress,
        end: u64,
    ) -> Result<Option<wgpu::SubmissionIndex>, GpuError> {
        let mut running: Option<(wgpu::SubmissionIndex, usize)> = None;
        let mut begun = Clock::now();
        while state.steps < end {
            let (side, from_evaluated) = (progress.side(), progress.instants == 0);
            if from_evaluated {
                state.work.advance();
            }
            let most = room(self.pace);
            while state.steps < end && self.instants.len() < most {
                let lengths = match progress.instants {
                    0 => self.lengths,
                    _ => Lengths { before: self.lengths.next, next: self.lengths.next },
                };
                let damping = self.damping_factors(state, lengths.before);
                let instant = Instant::new(progress.instants, flags::MOVES, lengths, damping);
                let of = (self.model.as_ref(), &state.driven[..]);
                self.instants.push(of, state.time, lengths.next, instant);
                progress.count(&mut self.control, state);
            }
            let count = self.instants.len();
            if !from_evaluated || count > 1 {
                self.relax(self.lengths.next);
            }
            let submitted = self.submit_steps(from_evaluated, side);
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
    fn wait_for(
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

    /// Checks the limit where that is due, and chooses the parts of the step to come.
    pub(super) fn watch(
        &mut self,
        state: &mut State<f32>,
        deformed: &Deformed,
    ) -> Result<Result<(), StepError>, GpuError> {
        if self.control.is_due(state, deformed) && !self.control.pass(state, deformed) {
            let displacement = &mut state.displacement;
            self.transfer.read::<Four>(
                &self.device,
                &self.nodes.displacement[self.stage.side()],
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
            for (on_device, solid) in self.forces.solids.iter().zip(&self.model.solids) {
                on_device.set_step(&self.device, solid, step);
            }
        }
    }

    /// Submits the instants that are pushed, beginning at a side; the first instant may be an evaluated one.
    fn submit_steps(&mut self, from_evaluated: bool, mut side: usize) -> wgpu::SubmissionIndex {
        let Self { forces, kernels, .. } = self;
        let follow = forces.ties.as_ref().map(|ties| &ties.follow);
        self.instants.submit(&self.device, |pass, bound, place, offset| {
            let mut run = |kernel: &Kernel| kernel.run(pass, bound, offset, side);
            if from_evaluated && place == 0 {
                run(&kernels.advance);
                follow.into_iter().for_each(run);
                return;
            }
            forces.kernels(true).for_each(&mut run);
            if !forces.paths.moves {
                run(&kernels.pass);
                follow.into_iter().for_each(run);
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
                self.bring_back_at(state, overflown)?;
                Err(GpuError::Overflow { design: self.design.to_string(), time: state.time }.into())
            }
            _ => Ok(()),
        }
    }

    /// Reads the state back as it was at an instant after the evaluated one.
    fn bring_back_at(&mut self, state: &mut State<f32>, at: u32) -> Result<(), GpuError> {
        if let Stage::Evaluated(progress) = &mut self.stage {
            progress.go_back(&mut self.control, state, at);
        }
        self.bring_arrays_back(state)
    }

    /// Reads the state back as it was at an instant whose checks failed. The CPU then finds the cause.
    pub(super) fn fail(&mut self, state: &mut State<f32>, at: u32) -> StepFailure {
        if let Err(error) = self.bring_back_at(state, at) {
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
