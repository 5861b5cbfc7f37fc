//! Its steps on a GPU.

#[cfg(feature = "gpu")]
use nalgebra::UnitQuaternion;
use pliant_explicit::Wanted;
#[cfg(feature = "gpu")]
use pliant_gpu::GpuShells;
use pliant_implicit::Spring;

use super::*;
use crate::failure::Failure;
use crate::participant::Participant;

/// Explicit shells on a GPU, and the forces [N] on their nodes from outside.
pub(super) struct ShellsOnDevice {
    pub(super) stepper: GpuShells,
    pub(super) pushed: Vec<(u32, [f64; 3])>,
}

/// Most steps that a GPU takes before a run reports progress and can be stopped.
pub(super) const STRIDE: u64 = 1024;

impl Assembled {
    /// Takes a number of steps from an evaluated instant. Where a facet is broken on the device, the CPU
    /// decides. It fails with the facet, or takes the step for which single precision is not enough. The
    /// device then tries one step, and twice as many each time that it takes all.
    pub(super) fn advance_with_device(&mut self, steps: u64) -> Result<(), Failure> {
        let end = self.done + steps;
        let mut tried = steps;
        loop {
            let goal = end.min(self.done + tried);
            self.advance_on_device(goal - self.done)?;
            tried *= 2;
            if self.done < goal {
                self.evaluate(Wanted::Energies)?;
                self.advance_on_processor()?;
                if let Some(device) = &mut self.device {
                    device.stepper.upload(&self.state);
                }
                tried = 1;
            }
            if self.done == end {
                return Ok(());
            }
            self.evaluate(Wanted::Energies)?;
        }
    }

    /// Takes a number of steps on the device from an evaluated instant, or the steps before a facet is broken
    /// there. Adds up the external work, except for the forces at the end of the last step: the next
    /// evaluation finds them. The instant before is therefore set one step back, without forces.
    pub(super) fn advance_on_device(&mut self, steps: u64) -> Result<(), Failure> {
        let Some(ShellsOnDevice { stepper, pushed }) = &mut self.device else { return Ok(()) };
        let pull = |spring: &Spring| {
            let stretch = spring.anchor - self.state.position[spring.node as usize];
            (spring.node, (stretch * spring.stiffness).into())
        };
        let acting: Vec<_> = pushed.iter().copied().chain(self.springs.iter().map(pull)).collect();
        stepper.push(&acting);
        let moved = stepper
            .advance(&mut self.state, steps)
            .map_err(|error| Failure::device(&error, Some(self.time)))?;
        self.energies.external += moved.work;
        if let Some((forces, state)) = self.before.as_mut().filter(|_| moved.steps > 0) {
            forces.fill(0.0);
            state.clone_from(&self.state);
            for node in 0..state.position.len() {
                state.position[node] -= self.steps.step * state.velocity[node];
                let turn = UnitQuaternion::from_scaled_axis(-self.steps.step * state.spin[node]);
                state.rotation[node] = turn * state.rotation[node];
            }
        }
        self.done += moved.steps;
        self.time = self.state.time;
        (self.evaluated, self.entered) = (false, false);
        Ok(())
    }
}
