//! The solvers of solids in large strain behind one trait.

use std::sync::Arc;
use std::time::Duration;

use pliant_explicit::{
    CentralDifference, Clock, DynamicRelaxation, Equilibrium, Iteration, Observable, RelaxationSettings,
    Scalar, State,
};
use pliant_gpu::{DeviceMapping, GpuStepper, PointValue, Wanted};
use pliant_mechanics::grip::Grip;
use pliant_mechanics::model::Contradiction;
use serde::{Deserialize, Serialize};

use crate::failure::Failure;
use crate::part::{Method, Part};
use crate::participant::MappedPoint;
use crate::steps::Steps;

/// How far a load step is.
#[derive(Clone, Copy, Debug)]
pub struct LoadStepProgress {
    /// Its number, counted from 1.
    pub number: u64,
    /// How many load steps there are.
    pub of: u64,
    /// The search for its equilibrium.
    pub iteration: Iteration,
    /// The relative residual at which it is found.
    pub tolerance: f64,
}

/// What a solver needs beside the state to go on.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) enum Memory<R> {
    /// Nothing.
    #[default]
    Nothing,
    /// The equilibrium last found.
    Equilibrium(Equilibrium<R>),
}

impl<R> Memory<R> {
    /// Whether it is one of a model with so many nodes.
    pub(crate) fn fits(&self, nodes: usize) -> bool {
        match self {
            Self::Nothing => true,
            Self::Equilibrium(equilibrium) => {
                equilibrium.residual.len() == nodes && equilibrium.way.fits(nodes)
            }
        }
    }
}

/// How good the equilibria of a quasi-static run are.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Equilibria {
    /// Equilibria found, that of the start and parts of load steps included.
    pub found: u64,
    /// Estimated error of the external work [J], a sum of trapezia between them; `None` where a first one says nothing of its own.
    pub external_error: Option<f64>,
    /// Estimated error of the displacements over the largest one, at worst.
    pub displacement_error: f64,
}

/// Brings the state of solids in large strain from instant to instant.
pub(crate) trait Solver<R>: Send {
    /// Makes what can be asked belong to the state's instant, and of the state what is wanted.
    fn evaluate(&mut self, state: &mut State<R>, wanted: Wanted) -> Result<(), Failure>;

    /// Goes so many steps on from an instant that was evaluated, not more than its stride; tells now and then how far it
    /// is, if that takes long.
    fn advance(
        &mut self,
        state: &mut State<R>,
        steps: u64,
        watch: &mut dyn FnMut(LoadStepProgress),
    ) -> Result<(), Failure>;

    /// The most steps it takes in one go: more than one where the state is far away.
    fn stride(&self) -> u64 {
        1
    }

    /// Goes up to `steps` steps on without looking, as many as take about `within`: nothing comes back to ordinary memory. How many;
    /// `None` of a solver whose state lies there.
    fn advance_without_read_back(
        &mut self,
        _state: &mut State<R>,
        _steps: u64,
        _within: Duration,
    ) -> Option<Result<u64, Failure>> {
        None
    }

    /// What finds points on the device where the state lies, from their places at rest [m], nodes and weights; `None` of a solver
    /// whose state lies in ordinary memory.
    fn map(&self, _points: &mut dyn Iterator<Item = MappedPoint>) -> Option<Result<DeviceMapping, Failure>> {
        None
    }

    /// Brings points on the device to the state's instant.
    fn apply(&self, _mapping: &DeviceMapping, _value: PointValue) {}

    /// Takes hold of points: these grips and no others act from the next evaluation on. False of a solver that knows none.
    fn hold(&mut self, grips: &[Grip]) -> bool {
        grips.is_empty()
    }

    /// Makes the state complete, as a checkpoint needs it.
    fn bring_back(&mut self, _state: &mut State<R>) -> Result<(), Failure> {
        Ok(())
    }

    /// Energy [J] above which the balance is judged.
    fn balance_floor(&self) -> f64;

    /// As what an observer may ask.
    fn observable(&self) -> &dyn Observable<R>;

    /// What a restart needs beside the state, after [`advance`](Self::advance): nothing where
    /// [`evaluate`](Self::evaluate) finds everything anew.
    fn memory(&self) -> Memory<R> {
        Memory::Nothing
    }

    /// Takes that up again.
    fn resume(&mut self, _memory: Memory<R>) {}

    /// How its steps are counted, of a solver whose increments tell velocities.
    fn clock(&self, _state: &State<R>) -> Option<Clock> {
        None
    }

    /// Goes on where another solver, with steps of length `step` [s], has stood at a state.
    fn go_on(&mut self, _clock: &Clock, _step: f64, _state: &State<R>) {}

    /// How good its equilibria are; `None` of one that finds none by dynamic relaxation.
    fn equilibria(&self) -> Option<Equilibria> {
        None
    }
}

/// The solver of a participant on the CPU.
pub(crate) fn on_cpu<R: Scalar>(part: &Part) -> Result<Box<dyn Solver<R>>, Failure> {
    let model = || Arc::clone(&part.model);
    let contradicting = |error: Contradiction| Failure::input(&error);
    Ok(match &part.method {
        Method::Explicit(settings) => {
            let stepper = CentralDifference::new(model(), part.steps.step).map_err(contradicting)?;
            match settings.monitor(&part.model) {
                Some(monitor) => Box::new(stepper.watched(monitor)),
                None => Box::new(stepper),
            }
        }
        Method::QuasiStatic { tolerance, .. } => {
            let settings = match *tolerance {
                Some(tolerance) => RelaxationSettings { tolerance, ..RelaxationSettings::default() },
                None => RelaxationSettings::usual::<R>(),
            };
            let tolerance = settings.tolerance;
            Box::new(LoadSteps {
                relaxation: DynamicRelaxation::new(model(), settings).map_err(contradicting)?,
                steps: part.steps.clone(),
                tolerance,
            })
        }
        Method::ExplicitShells(_) | Method::Static(..) | Method::Implicit(..) => {
            return Err(Failure::input(&"shells and solved equations have a participant of their own"));
        }
    })
}

/// The solver of a participant on a GPU, from a state on; `None` of a participant on the CPU.
pub(crate) fn on_device(part: &Part, state: &State<f32>) -> Option<Result<Box<dyn Solver<f32>>, Failure>> {
    let Method::Explicit(settings) = &part.method else { return None };
    let device = settings.device.as_ref()?;
    let stepper = GpuStepper::new(device, Arc::clone(&part.model), part.steps.step, settings.design);
    Some(stepper.map_err(|error| Failure::device(&error, None)).map(|mut stepper| {
        if let Some(monitor) = settings.monitor(&part.model) {
            stepper = stepper.watched(monitor);
        }
        stepper.upload(state);
        Box::new(stepper) as Box<dyn Solver<f32>>
    }))
}

/// Most steps in one go on a GPU, so that a run can be stopped and shows how far it is.
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

    fn advance_without_read_back(
        &mut self,
        state: &mut State<f32>,
        steps: u64,
        within: Duration,
    ) -> Option<Result<u64, Failure>> {
        let advanced = GpuStepper::advance_without_read_back(self, state, steps, within);
        Some(advanced.map_err(|failure| Failure::step(&failure, state.time)))
    }

    fn map(&self, points: &mut dyn Iterator<Item = MappedPoint>) -> Option<Result<DeviceMapping, Failure>> {
        Some(GpuStepper::map(self, points).map_err(|error| Failure::device(&error, None)))
    }

    fn apply(&self, mapping: &DeviceMapping, value: PointValue) {
        GpuStepper::apply(self, mapping, value);
    }

    fn hold(&mut self, grips: &[Grip]) -> bool {
        GpuStepper::hold(self, grips).is_ok()
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

    fn balance_floor(&self) -> f64 {
        GpuStepper::balance_floor(self)
    }

    fn observable(&self) -> &dyn Observable<f32> {
        self
    }
}

impl<R: Scalar> Solver<R> for CentralDifference<R> {
    fn evaluate(&mut self, state: &mut State<R>, _wanted: Wanted) -> Result<(), Failure> {
        CentralDifference::evaluate(self, state).map_err(|error| Failure::from(&error))
    }

    /// A whole step, in its parts.
    fn advance(
        &mut self,
        state: &mut State<R>,
        _steps: u64,
        _watch: &mut dyn FnMut(LoadStepProgress),
    ) -> Result<(), Failure> {
        CentralDifference::advance(self, state);
        while !state.is_between_steps() {
            Solver::evaluate(self, state, Wanted::Energies)?;
            CentralDifference::advance(self, state);
        }
        Ok(())
    }

    fn hold(&mut self, grips: &[Grip]) -> bool {
        CentralDifference::hold(self, grips);
        true
    }

    fn clock(&self, state: &State<R>) -> Option<Clock> {
        Some(CentralDifference::clock(self, state))
    }

    fn go_on(&mut self, clock: &Clock, step: f64, state: &State<R>) {
        CentralDifference::go_on(self, clock, step, state);
    }

    fn balance_floor(&self) -> f64 {
        CentralDifference::balance_floor(self)
    }

    fn observable(&self) -> &dyn Observable<R> {
        self
    }
}

/// Equilibria at the start and at the ends of load steps.
struct LoadSteps<R> {
    relaxation: DynamicRelaxation<R>,
    /// Where they end.
    steps: Steps,
    /// Relative residual of an equilibrium.
    tolerance: f64,
}

impl<R: Scalar> Solver<R> for LoadSteps<R> {
    /// At the start the equilibrium of what acts there already; others are found when they are gone to.
    fn evaluate(&mut self, state: &mut State<R>, _wanted: Wanted) -> Result<(), Failure> {
        let begun = self.relaxation.begin(state);
        begun.map_err(|error| Failure::load_step(&error, 0, self.steps.number))
    }

    fn advance(
        &mut self,
        state: &mut State<R>,
        _steps: u64,
        watch: &mut dyn FnMut(LoadStepProgress),
    ) -> Result<(), Failure> {
        let number = self.steps.number_from(state.time);
        let (of, tolerance) = (self.steps.number, self.tolerance);
        let mut told = |iteration: Iteration| watch(LoadStepProgress { number, of, iteration, tolerance });
        self.relaxation
            .solve_watched(state, self.steps.end_of(number), &mut told)
            .map(|_| ())
            .map_err(|error| Failure::load_step(&error, number, of))
    }

    fn balance_floor(&self) -> f64 {
        0.0
    }

    fn observable(&self) -> &dyn Observable<R> {
        &self.relaxation
    }

    fn equilibria(&self) -> Option<Equilibria> {
        let way = self.relaxation.way();
        Some(Equilibria {
            found: way.equilibria,
            external_error: way.error,
            displacement_error: way.displacement_error,
        })
    }

    fn memory(&self) -> Memory<R> {
        Memory::Equilibrium(self.relaxation.equilibrium())
    }

    fn resume(&mut self, memory: Memory<R>) {
        if let Memory::Equilibrium(equilibrium) = memory {
            self.relaxation.resume(equilibrium);
        }
    }
}
