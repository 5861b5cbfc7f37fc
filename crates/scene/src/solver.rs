//! The solvers of a scene behind one face, so that one run loop serves them all.

use std::time::Duration;

use pliant_explicit::stability::Monitor;
use pliant_explicit::{
    CentralDifference, Clock, DynamicRelaxation, Equilibrium, Iteration, Observable, RelaxationSettings,
    Scalar, State,
};
use pliant_gpu::{Device, DeviceMapping, GpuStepper, PointValue, Wanted};
use pliant_mechanics::grip::Grip;
use pliant_mechanics::model::Contradiction;

use serde::{Deserialize, Serialize};

use crate::assemble::Built;
use crate::format::{RunTable, SolverName};
use crate::output::FailureSummary;
use crate::plan::Plan;

/// The place of a point at rest [m], and its nodes with their weights.
pub(crate) type MappedPoint = ([f64; 3], Vec<(u32, f64)>);

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

/// What the equations of an implicit or a static run took.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Effort {
    /// Iterations of Newton's method in all.
    pub newton_iterations: u64,
    /// Linear equations solved.
    pub solutions: u64,
    /// Iterations of conjugate gradients in all; 0 with factors.
    pub linear_iterations: u64,
    /// Residual of the last solution by conjugate gradients over its right-hand side; 0 with factors.
    pub linear_residual: f64,
    /// Residual of the last step over the largest of loads, internal and inertial forces; `None` where it was not checked.
    pub residual: Option<f64>,
    /// Steps that were halved.
    pub halved: u64,
    /// Wall time of forces and stiffness of the cells [s].
    pub seconds_cells: f64,
    /// Wall time of factorising, or of making the preconditioner [s].
    pub seconds_factors: f64,
    /// Wall time of solving with them [s].
    pub seconds_solution: f64,
    /// Beginning of the first unstable equilibrium [s], seen from a negative pivot.
    pub unstable_from: Option<f64>,
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
    fn evaluate(&mut self, state: &mut State<R>, wanted: Wanted) -> Result<(), FailureSummary>;

    /// Goes so many steps on from an instant that was evaluated, not more than its stride; tells now and then how far it
    /// is, if that takes long.
    fn advance(
        &mut self,
        state: &mut State<R>,
        steps: u64,
        watch: &mut dyn FnMut(LoadStepProgress),
    ) -> Result<(), FailureSummary>;

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
    ) -> Option<Result<u64, FailureSummary>> {
        None
    }

    /// What finds points on the device where the state lies, from their places at rest [m], nodes and weights; `None` of a solver
    /// whose state lies in ordinary memory.
    fn map(
        &self,
        _points: &mut dyn Iterator<Item = MappedPoint>,
    ) -> Option<Result<DeviceMapping, FailureSummary>> {
        None
    }

    /// Brings points on the device to the state's instant.
    fn apply(&self, _mapping: &DeviceMapping, _value: PointValue) {}

    /// Takes hold of points: these grips and no others act from the next evaluation on. False of a solver that knows none.
    fn hold(&mut self, grips: &[Grip]) -> bool {
        grips.is_empty()
    }

    /// Makes the state complete, as a checkpoint needs it.
    fn bring_back(&mut self, _state: &mut State<R>) -> Result<(), FailureSummary> {
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

/// Watches the largest stable step of an explicit run; where every node is held there is no limit to watch.
fn monitor(run: &RunTable, built: &Built, plan: &Plan) -> Option<Monitor> {
    let on_unstable = run.on_unstable.unwrap_or_default();
    let limit = plan.limits.as_ref()?.limit.step;
    limit.is_finite().then(|| Monitor::new(&built.model, limit, on_unstable))
}

/// The solver that a scene asks for, on the processor.
pub(crate) fn on_processor<R: Scalar>(
    run: &RunTable,
    built: &Built,
    plan: &Plan,
) -> Result<Box<dyn Solver<R>>, FailureSummary> {
    // Refused when the model was built.
    let contradicting = |error: Contradiction| FailureSummary::input(&error);
    Ok(match run.solver {
        SolverName::Explicit => {
            let stepper = CentralDifference::new(built.model.clone(), plan.step).map_err(contradicting)?;
            match monitor(run, built, plan) {
                Some(monitor) => Box::new(stepper.watched(monitor)),
                None => Box::new(stepper),
            }
        }
        // Refused when the model was built.
        SolverName::Implicit | SolverName::Static => {
            return Err(FailureSummary::input(&"this solver has a participant of its own"));
        }
        SolverName::QuasiStatic => {
            let settings = match run.tolerance {
                Some(tolerance) => RelaxationSettings { tolerance, ..RelaxationSettings::default() },
                None => RelaxationSettings::usual::<R>(),
            };
            let tolerance = settings.tolerance;
            Box::new(LoadSteps {
                relaxation: DynamicRelaxation::new(built.model.clone(), settings).map_err(contradicting)?,
                plan: plan.clone(),
                tolerance,
            })
        }
    })
}

/// The solver that a scene asks for, on a graphics processor, from a state on.
pub(crate) fn on_device(
    run: &RunTable,
    built: &Built,
    plan: &Plan,
    device: &Device,
    state: &State<f32>,
) -> Result<Box<dyn Solver<f32>>, FailureSummary> {
    let stepper = GpuStepper::new(device, built.model.clone(), plan.step, run.design);
    let mut stepper = stepper.map_err(|error| FailureSummary::device(&error, None))?;
    if let Some(monitor) = monitor(run, built, plan) {
        stepper = stepper.watched(monitor);
    }
    stepper.upload(state);
    Ok(Box::new(stepper))
}

/// Most steps in one go on a graphics processor, so that a run can be stopped and shows how far it is.
const STRIDE: u64 = 1024;

impl Solver<f32> for GpuStepper {
    fn evaluate(&mut self, state: &mut State<f32>, wanted: Wanted) -> Result<(), FailureSummary> {
        GpuStepper::evaluate(self, state, wanted)
            .map_err(|failure| FailureSummary::step(&failure, state.time))
    }

    fn advance(
        &mut self,
        state: &mut State<f32>,
        steps: u64,
        _watch: &mut dyn FnMut(LoadStepProgress),
    ) -> Result<(), FailureSummary> {
        GpuStepper::advance(self, state, steps).map_err(|failure| FailureSummary::step(&failure, state.time))
    }

    fn stride(&self) -> u64 {
        STRIDE
    }

    fn advance_without_read_back(
        &mut self,
        state: &mut State<f32>,
        steps: u64,
        within: Duration,
    ) -> Option<Result<u64, FailureSummary>> {
        let advanced = GpuStepper::advance_without_read_back(self, state, steps, within);
        Some(advanced.map_err(|failure| FailureSummary::step(&failure, state.time)))
    }

    fn map(
        &self,
        points: &mut dyn Iterator<Item = MappedPoint>,
    ) -> Option<Result<DeviceMapping, FailureSummary>> {
        Some(GpuStepper::map(self, points).map_err(|error| FailureSummary::device(&error, None)))
    }

    fn apply(&self, mapping: &DeviceMapping, value: PointValue) {
        GpuStepper::apply(self, mapping, value);
    }

    fn hold(&mut self, grips: &[Grip]) -> bool {
        GpuStepper::hold(self, grips).is_ok()
    }

    fn bring_back(&mut self, state: &mut State<f32>) -> Result<(), FailureSummary> {
        GpuStepper::bring_back(self, state).map_err(|failure| FailureSummary::step(&failure, state.time))
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
    fn evaluate(&mut self, state: &mut State<R>, _wanted: Wanted) -> Result<(), FailureSummary> {
        CentralDifference::evaluate(self, state).map_err(|error| FailureSummary::from(&error))
    }

    /// A whole step, in its parts.
    fn advance(
        &mut self,
        state: &mut State<R>,
        _steps: u64,
        _watch: &mut dyn FnMut(LoadStepProgress),
    ) -> Result<(), FailureSummary> {
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
    plan: Plan,
    /// Relative residual of an equilibrium.
    tolerance: f64,
}

impl<R: Scalar> Solver<R> for LoadSteps<R> {
    /// At the start the equilibrium of what acts there already; others are found when they are gone to.
    fn evaluate(&mut self, state: &mut State<R>, _wanted: Wanted) -> Result<(), FailureSummary> {
        let begun = self.relaxation.begin(state);
        begun.map_err(|error| FailureSummary::load_step(&error, 0, self.plan.steps))
    }

    fn advance(
        &mut self,
        state: &mut State<R>,
        _steps: u64,
        watch: &mut dyn FnMut(LoadStepProgress),
    ) -> Result<(), FailureSummary> {
        let number = self.plan.number_from(state.time);
        let (of, tolerance) = (self.plan.steps, self.tolerance);
        let mut told = |iteration: Iteration| watch(LoadStepProgress { number, of, iteration, tolerance });
        self.relaxation
            .solve_watched(state, self.plan.end_of(number), &mut told)
            .map(|_| ())
            .map_err(|error| FailureSummary::load_step(&error, number, of))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{built, scene};

    #[test]
    fn a_load_step_tells_how_far_it_is() {
        let more = "[run]\nsolver = 'quasi-static'\nload-steps = 2\n[constraint.top]\ntype = 'move'\nbody = 'cube'\n\
                    nodes = { set = 'z-max' }\nby = [0, 0, 0.01]\n";
        let (scene, built) = (scene(more), built(more));
        let plan = crate::plan(&scene, &built).unwrap();
        let mut solver = on_processor::<f64>(&scene.run, &built, &plan).unwrap();
        let mut state = State::at_rest(&built.model);
        for number in [1, 2] {
            let mut told = Vec::new();
            solver.advance(&mut state, 1, &mut |progress| told.push(progress)).unwrap();
            assert!(told.len() > 10 && told.iter().all(|p| (p.number, p.of) == (number, 2)));
            let fractions: Vec<f64> = told.iter().map(|p| p.iteration.fraction).collect();
            assert!(fractions.is_sorted() && fractions[0] == 0.0, "{fractions:?}");
            let last = told.last().unwrap();
            assert!(last.iteration.fraction > 0.5 && last.iteration.fraction < 1.0, "{last:?}");
            assert!(
                (last.iteration.span[1] - state.time).abs() < 1e-15
                    && last.iteration.residual > last.tolerance
            );
        }
    }
}
