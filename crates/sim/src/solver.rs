//! The solvers of solids in large strain behind one trait.

use std::sync::Arc;

use pliant_explicit::{
    CentralDifference, Clock, DynamicRelaxation, Equilibrium, Iteration, Observable, RelaxationSettings,
    Scalar, State, Wanted,
};
#[cfg(feature = "gpu")]
use pliant_gpu::GpuStepper;
use pliant_mechanics::StopFlag;
use pliant_mechanics::grip::Grip;
use pliant_mechanics::model::Contradiction;
use pliant_mechanics::tensor::Vector;
use serde::{Deserialize, Serialize};

use crate::failure::Failure;
use crate::participant_setup::{Method, ParticipantSetup};
use crate::steps::Steps;

/// Progress of a load step.
#[derive(Clone, Copy, Debug)]
pub struct LoadStepProgress {
    /// Its number, counted from 1.
    pub number: u64,
    /// Number of load steps.
    pub of: u64,
    /// The search for its equilibrium.
    pub iteration: Iteration,
    /// The relative residual at which it is found.
    pub tolerance: f64,
}

/// Data that a solver needs besides the state to continue.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) enum Memory<R> {
    /// No memory.
    #[default]
    Nothing,
    /// The equilibrium last found.
    Equilibrium(Equilibrium<R>),
}

impl<R> Memory<R> {
    /// True if the memory belongs to a model with this number of nodes.
    pub(crate) fn fits(&self, nodes: usize) -> bool {
        match self {
            Self::Nothing => true,
            Self::Equilibrium(equilibrium) => {
                equilibrium.residual.len() == nodes && equilibrium.way.fits(nodes)
            }
        }
    }
}

/// Quality of the equilibria of a quasi-static run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Equilibria {
    /// Equilibria found, including the start and parts of load steps.
    pub found: u64,
    /// Estimated error of the external work [J], which is a sum of trapezia between equilibria. `None` where
    /// a first equilibrium alone gives no estimate.
    pub external_error: Option<f64>,
    /// Estimated error of the displacements over the largest one, at worst.
    pub displacement_error: f64,
}

/// Brings the state of solids in large strain from instant to instant.
pub(crate) trait Solver<R>: Send {
    /// Computes all observable values at the state's instant, and brings back the wanted parts of the state.
    fn evaluate(&mut self, state: &mut State<R>, wanted: Wanted) -> Result<(), Failure>;

    /// Takes a number of steps from an evaluated instant, not more than its stride. `watch` gets progress
    /// reports, if the steps take long.
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

    /// The GPU's stepper; `None` of a solver on the CPU.
    #[cfg(feature = "gpu")]
    fn on_device(&mut self) -> Option<&mut GpuStepper> {
        None
    }

    /// Takes hold of points: these grips and no others act from the next evaluation on. False of a solver
    /// that knows none.
    fn grip(&mut self, grips: &[Grip]) -> bool {
        grips.is_empty()
    }

    /// Takes forces [N], one a node, or none: they and no others act from the next evaluation on. Only where
    /// the method takes some.
    fn push(&mut self, _forces: &[Vector<f64>]) {}

    /// Says where coupled nodes of contacts go between two times [s], from one place [m] to another.
    fn lead_coupled_surfaces(&mut self, _times: [f64; 2], _ways: &[[Vector<f64>; 2]]) {}

    /// Impulses [N s] on each coupled node since it was led.
    fn coupled_impulses(&self) -> &[Vector<f64>] {
        &[]
    }

    /// Makes the state complete, as a checkpoint needs it.
    fn bring_back(&mut self, _state: &mut State<R>) -> Result<(), Failure> {
        Ok(())
    }

    /// Energy [J] above which the balance is judged.
    fn balance_floor(&self) -> f64;

    /// Looks at a flag within steps that take long.
    fn stop_on(&mut self, _flag: &StopFlag) {}

    /// Returns the solver as a source of observable values.
    fn observable(&self) -> &dyn Observable<R>;

    /// True if it can continue from any state of ordinary memory.
    fn goes_back(&self) -> bool {
        true
    }

    /// Data that a restart needs besides the state, after [`advance`](Self::advance): nothing where
    /// [`evaluate`](Self::evaluate) finds everything anew.
    fn memory(&self) -> Memory<R> {
        Memory::Nothing
    }

    /// Takes that up again.
    fn resume(&mut self, _memory: Memory<R>) {}

    /// Clock of its steps; `None` for a solver whose increments do not give velocities.
    fn clock(&self, _state: &State<R>) -> Option<Clock> {
        None
    }

    /// Continues from a state of another solver with steps of length `step` [s].
    fn go_on(&mut self, _clock: &Clock, _step: f64, _state: &State<R>) {}

    /// Quality of its equilibria; `None` for a solver without dynamic relaxation.
    fn equilibria(&self) -> Option<Equilibria> {
        None
    }
}

/// The solver of a participant on the CPU.
pub(crate) fn on_cpu<R: Scalar>(part: &ParticipantSetup) -> Result<Box<dyn Solver<R>>, Failure> {
    let model = || Arc::clone(&part.model);
    let contradicting = |error: Contradiction| Failure::input(&error);
    Ok(match &part.method {
        Method::Explicit(settings) => {
            let stepper =
                CentralDifference::new(model(), part.steps.step).map_err(contradicting)?.dissipating();
            let stepper = match &settings.contacts {
                Some(contacts) => stepper.with_contacts(Arc::clone(contacts)),
                None => stepper,
            };
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
                relaxation: DynamicRelaxation::new(model(), settings)
                    .map_err(|error| Failure::input(&error))?,
                steps: part.steps.clone(),
                tolerance,
            })
        }
        Method::ExplicitShells(..) | Method::Static(..) | Method::Implicit(..) => {
            return Err(Failure::input(
                &"shells, and solids with the solver `static` or `implicit`, need a participant of their own",
            ));
        }
    })
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

    fn grip(&mut self, grips: &[Grip]) -> bool {
        CentralDifference::grip(self, grips);
        true
    }

    fn push(&mut self, forces: &[Vector<f64>]) {
        CentralDifference::push(self, forces);
    }

    fn lead_coupled_surfaces(&mut self, times: [f64; 2], ways: &[[Vector<f64>; 2]]) {
        CentralDifference::lead_coupled_surfaces(self, times, ways);
    }

    fn coupled_impulses(&self) -> &[Vector<f64>] {
        CentralDifference::coupled_impulses(self)
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
    /// Instants at which the load steps end.
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
        let mut report = |iteration: Iteration| watch(LoadStepProgress { number, of, iteration, tolerance });
        self.relaxation
            .solve_watched(state, self.steps.end_of(number), &mut report)
            .map(|_| ())
            .map_err(|error| Failure::load_step(&error, number, of))
    }

    fn push(&mut self, forces: &[Vector<f64>]) {
        self.relaxation.push(forces);
    }

    fn stop_on(&mut self, flag: &StopFlag) {
        self.relaxation.stop_on(flag);
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
