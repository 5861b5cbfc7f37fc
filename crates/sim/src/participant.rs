//! A participant under way: bodies that one stepper advances together, with their state. Its stepper and
//! number type stay hidden here.

use pliant_contact::pose::Leg;
#[cfg(feature = "gpu")]
use pliant_explicit::State;
use pliant_explicit::{Clock, Wanted};
#[cfg(feature = "gpu")]
use pliant_gpu::GpuStepper;
use pliant_mechanics::StopFlag;
use pliant_mechanics::grip::Grip;
use pliant_mechanics::tensor::Vector;

use crate::failure::Failure;
use crate::instant::Instant;
use crate::reals::RealsMut;
use crate::snapshot::Snapshot;
use crate::solver::LoadStepProgress;

/// Bodies that one stepper advances together.
pub(crate) trait Participant: Instant + Send {
    /// Finds forces, and with them all that can be asked, at the instant.
    ///
    /// # Errors
    /// If forces can't be found there.
    fn evaluate(&mut self, wanted: Wanted) -> Result<(), Failure>;

    /// Takes a number of steps from an evaluated instant, not more than its stride. `watch` gets progress
    /// reports, if the steps take long.
    ///
    /// # Errors
    /// If a step can't be taken.
    fn advance(&mut self, steps: u64, watch: &mut dyn FnMut(LoadStepProgress)) -> Result<(), Failure>;

    /// The most steps it takes in one go: more than one where the state lies on a device.
    fn stride(&self) -> u64 {
        1
    }

    /// The GPU's stepper with its state; `None` of a participant on the CPU.
    #[cfg(feature = "gpu")]
    fn on_device(&mut self) -> Option<(&mut GpuStepper, &mut State<f32>)> {
        None
    }

    /// Takes hold of points: these grips and no others act from the next evaluation on. False of a stepper
    /// that knows none.
    fn grip(&mut self, grips: &[Grip]) -> bool;

    /// Takes forces [N], one a node, or none: they and no others act from the next evaluation on. Only where
    /// its method takes some.
    fn push(&mut self, forces: &[Vector<f64>]);

    /// Drives a tool or a jaw from the step on whose forces are found next; only participants with contacts
    /// have one.
    fn drive(&mut self, _rigid: usize, _leg: Leg) {}

    /// The stiffness [N/m] up to which a grip leaves steps stable; infinite where they are stable with any.
    fn stiffest(&self, grip: &Grip) -> f64;

    /// Velocity [m/s] of a node over the step that has ended.
    fn last_velocity(&self, node: usize) -> [f64; 3];

    /// The point of a grip now [m], and its force on the body [N].
    fn pulled(&self, grip: &Grip) -> [[f64; 3]; 2];

    /// Says where coupled nodes of its contacts go between two times [s], from one place [m] to another; only
    /// explicit solids have some.
    fn lead_coupled_surfaces(&mut self, _times: [f64; 2], _ways: &[[Vector<f64>; 2]]) {}

    /// Impulses [N s] on each coupled node since it was led.
    fn coupled_impulses(&self) -> &[Vector<f64>] {
        &[]
    }

    /// The displacements that [`Instant::displacements`] shows, for a participant that takes the place of
    /// this one.
    fn displacements_mut(&mut self) -> Option<RealsMut<'_>> {
        None
    }

    /// True if it can go back to a state of its part; else the caller makes it anew.
    fn goes_back_to(&self, snapshot: &Snapshot) -> bool;

    /// Goes back to a state that it [can](Self::goes_back_to), with the clock of explicit steps and their
    /// length [s].
    ///
    /// # Errors
    /// If equations are too many.
    fn go_back(&mut self, snapshot: &Snapshot, steps: Option<(Clock, f64)>) -> Result<(), Failure>;

    /// Looks at a flag within steps that take long; such a step fails as [interrupted](crate::INTERRUPTED).
    fn stop_on(&mut self, _flag: &StopFlag) {}

    /// Brings the state back to ordinary memory, whole.
    ///
    /// # Errors
    /// If a device fails.
    fn bring_back(&mut self) -> Result<(), Failure> {
        Ok(())
    }

    /// Returns the state and the other data that a restart needs, after [`advance`](Self::advance).
    fn snapshot(&self) -> Snapshot;

    /// Adds to a snapshot the data that only a checkpoint has: the residuals of iterations so far.
    fn add_log(&self, _snapshot: &mut Snapshot) {}

    /// Forgets what it notes of iterations after the present state.
    fn cut_log(&mut self) {}

    /// Clock of its steps; `None` for a stepper whose increments do not give velocities.
    fn clock(&self) -> Option<Clock> {
        None
    }

    /// A fingerprint of the motion: the same bits have the same one.
    fn fingerprint(&self) -> u64;

    /// Returns true, after a step that failed, if the state found on the way is worth showing. The time is
    /// then the time of that state.
    fn keeps_what_it_found(&mut self) -> bool {
        false
    }
}
