//! The solvers of a scene behind one face, so that one run loop serves them all.

use pliant_mechanics::stability::Monitor;
use pliant_mechanics::{
    CentralDifference, DynamicRelaxation, Equilibrium, Observable, Real, RelaxationSettings, State,
};

use crate::build::Built;
use crate::format::{RunTable, SolverName};
use crate::output::FailureSummary;
use crate::plan::Plan;

/// Brings a state from instant to instant.
pub(crate) trait Solver<R> {
    /// Makes all that can be asked belong to the state's instant.
    fn evaluate(&mut self, state: &mut State<R>) -> Result<(), FailureSummary>;

    /// Goes on to the next instant.
    fn advance(&mut self, state: &mut State<R>) -> Result<(), FailureSummary>;

    /// Energy [J] above which the balance is judged.
    fn balance_floor(&self) -> f64;

    /// As what an observer may ask.
    fn observable(&self) -> &dyn Observable<R>;

    /// What a restart needs beside the state, after [`advance`](Self::advance): nothing where
    /// [`evaluate`](Self::evaluate) finds everything anew.
    fn equilibrium(&self) -> Option<Equilibrium<R>> {
        None
    }

    /// Takes that up again.
    fn resume(&mut self, _equilibrium: Equilibrium<R>) {}
}

/// The solver that a scene asks for.
pub(crate) fn solver<'m, R: Real>(
    run: &RunTable,
    built: &'m Built,
    plan: &Plan,
) -> Result<Box<dyn Solver<R> + 'm>, pliant_mechanics::model::Contradiction> {
    Ok(match run.solver {
        SolverName::Explicit => {
            let stepper = CentralDifference::new(&built.model, plan.step)?;
            // Where every node is held there is no limit to watch.
            Box::new(if plan.limit.step.is_finite() {
                let on_unstable = run.on_unstable.unwrap_or_default();
                stepper.watched(Monitor::new(&built.model, plan.limit.step, on_unstable))
            } else {
                stepper
            })
        }
        SolverName::QuasiStatic => {
            let precise = RelaxationSettings::default().tolerance;
            let tolerance =
                run.tolerance.unwrap_or(if R::EPSILON > 1e-10 { 100.0 * precise } else { precise });
            let settings = RelaxationSettings { tolerance, ..RelaxationSettings::default() };
            Box::new(LoadSteps {
                relaxation: DynamicRelaxation::new(&built.model, settings)?,
                step: plan.step,
            })
        }
    })
}

impl<R: Real> Solver<R> for CentralDifference<'_, R> {
    fn evaluate(&mut self, state: &mut State<R>) -> Result<(), FailureSummary> {
        CentralDifference::evaluate(self, state).map_err(|error| FailureSummary::from(&error))
    }

    /// A whole step, in its parts.
    fn advance(&mut self, state: &mut State<R>) -> Result<(), FailureSummary> {
        CentralDifference::advance(self, state);
        while !state.is_between_steps() {
            Solver::evaluate(self, state)?;
            CentralDifference::advance(self, state);
        }
        Ok(())
    }

    fn balance_floor(&self) -> f64 {
        CentralDifference::balance_floor(self)
    }

    fn observable(&self) -> &dyn Observable<R> {
        self
    }
}

/// Equilibria at the ends of equal load steps.
struct LoadSteps<'m, R> {
    relaxation: DynamicRelaxation<'m, R>,
    /// Time between equilibria [s].
    step: f64,
}

impl<R: Real> Solver<R> for LoadSteps<'_, R> {
    fn evaluate(&mut self, _state: &mut State<R>) -> Result<(), FailureSummary> {
        Ok(())
    }

    fn advance(&mut self, state: &mut State<R>) -> Result<(), FailureSummary> {
        let next = (state.time / self.step).round() + 1.0;
        self.relaxation
            .solve(state, next * self.step)
            .map(|_| ())
            .map_err(|error| FailureSummary::from(&error))
    }

    fn balance_floor(&self) -> f64 {
        0.0
    }

    fn observable(&self) -> &dyn Observable<R> {
        &self.relaxation
    }

    fn equilibrium(&self) -> Option<Equilibrium<R>> {
        Some(self.relaxation.equilibrium())
    }

    fn resume(&mut self, equilibrium: Equilibrium<R>) {
        self.relaxation.resume(equilibrium);
    }
}
