//! Solids on a GPU: their solver, steps without read-backs, and points that the device computes.

use std::sync::Arc;
use std::time::Duration;

use pliant_explicit::{Clock, Observable, State, Wanted};
use pliant_gpu::{DeviceMapping, GpuError, GpuStepper, PointValue, StepFailure};
use pliant_mechanics::grip::Grip;

use crate::failure::{Failure, FailureKind};
use crate::part::{Method, Part};
use crate::solver::{LoadStepProgress, Solver};

/// The place of a point at rest [m], and its nodes with their weights.
pub type MappedPoint = ([f64; 3], Vec<(u32, f64)>);

/// A simulation whose bodies all go together on one GPU.
pub struct OnDevice<'a> {
    pub(crate) stepper: &'a mut GpuStepper,
    pub(crate) state: &'a mut State<f32>,
    /// True if forces belong to the simulation's instant.
    pub(crate) evaluated: &'a mut bool,
}

impl OnDevice<'_> {
    /// Takes up to `steps` steps without reading anything back, as many as take about `within`. Returns their
    /// number.
    ///
    /// # Errors
    /// If the device fails; a step that fails is reported at the next evaluation.
    pub fn advance_without_read_back(&mut self, steps: u64, within: Duration) -> Result<u64, Failure> {
        let advanced = self.stepper.advance_without_read_back(self.state, steps, within);
        *self.evaluated = false;
        advanced.map_err(|failure| Failure::step(&failure, self.state.time))
    }

    /// The mapping that finds points, from their places at rest [m], nodes and weights, on the device.
    ///
    /// # Errors
    /// If the device has no room for it.
    pub fn map(&self, points: impl Iterator<Item = MappedPoint>) -> Result<DeviceMapping, Failure> {
        self.stepper.map(points).map_err(|error| Failure::device(&error, None))
    }

    /// Brings points on the device to the instant.
    pub fn apply(&self, mapping: &DeviceMapping, value: PointValue) {
        self.stepper.apply(mapping, value);
    }
}

impl Failure {
    /// A device that failed, at a time of the simulation.
    pub(crate) fn device(error: &GpuError, time: Option<f64>) -> Self {
        Self::new(FailureKind::Device, format!("{error}; {}", error.remedy()), time)
    }

    /// Steps on a device that could not be taken.
    pub(crate) fn step(failure: &StepFailure, time: f64) -> Self {
        match failure {
            StepFailure::Step(error) => error.into(),
            StepFailure::Device(error) => Self::device(error, Some(time)),
        }
    }
}

/// The solver of a participant on a GPU, from a state on; `None` of a participant on the CPU.
pub(crate) fn on_device(part: &Part, state: &State<f32>) -> Option<Result<Box<dyn Solver<f32>>, Failure>> {
    let Method::Explicit(settings) = &part.method else { return None };
    let device = settings.device.as_ref()?;
    let (model, step, design) = (Arc::clone(&part.model), part.steps.step, settings.design);
    let stepper = match &settings.contacts {
        Some(contacts) => GpuStepper::with_contacts(device, model, Arc::clone(contacts), step, design),
        None => GpuStepper::new(device, model, step, design),
    };
    Some(stepper.map_err(|error| Failure::device(&error, None)).map(|stepper| {
        let mut stepper = stepper.dissipating();
        if let Some(monitor) = settings.monitor(&part.model) {
            stepper = stepper.watched(monitor);
        }
        stepper.upload(state);
        Box::new(stepper) as Box<dyn Solver<f32>>
    }))
}

/// Most steps that a GPU takes before a run reports progress and can be stopped.
const STRIDE: u64 = 1024;

impl Solver<f32> for GpuStepper {
    fn evaluate(&mut self, state: &mut State<f32>, wanted: Wanted) -> Result<(), Failure> {
        GpuStepper::evaluate(self, state, wanted).map_err(|failure| Failure::step(&failure, state.time))
    }

    fn advance(
        &mut self,
        state: &mut State<f32>,
        steps: u64,
        _watch: &mut dyn FnMut(LoadStepProgress),
    ) -> Result<(), Failure> {
        GpuStepper::advance(self, state, steps).map_err(|failure| Failure::step(&failure, state.time))
    }

    fn stride(&self) -> u64 {
        STRIDE
    }

    fn on_device(&mut self) -> Option<&mut GpuStepper> {
        Some(self)
    }

    fn grip(&mut self, grips: &[Grip]) -> bool {
        GpuStepper::grip(self, grips).is_ok()
    }

    fn bring_back(&mut self, state: &mut State<f32>) -> Result<(), Failure> {
        GpuStepper::bring_back(self, state).map_err(|failure| Failure::step(&failure, state.time))
    }

    fn clock(&self, state: &State<f32>) -> Option<Clock> {
        Some(GpuStepper::clock(self, state))
    }

    fn go_on(&mut self, clock: &Clock, step: f64, state: &State<f32>) {
        GpuStepper::go_on(self, clock, step, state);
    }

    fn goes_back(&self) -> bool {
        false
    }

    fn balance_floor(&self) -> f64 {
        GpuStepper::balance_floor(self)
    }

    fn observable(&self) -> &dyn Observable<f32> {
        self
    }
}
