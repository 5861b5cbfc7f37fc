//! Stepping method of a participant, from the tables of its scene.

use std::sync::Arc;

use pliant_explicit::stability::OnUnstable;
use pliant_implicit::{DynamicSettings, Integrator, StaticSettings};
use pliant_linear::{LinearSolver, Preconditioner};
use pliant_sim::{Explicit, ImplicitBodies, LongSteps, Method, ShortSteps};

use crate::assemble::Built;
use crate::plan::Plan;
#[cfg(feature = "gpu")]
use crate::target::design;
use pliant_format::tables::{
    IntegratorName, LinearName, LinearTable, OnUnstableName, PreconditionerName, RunTable, SolverName,
};

/// Iterations of Newton's method at most in contact, if none are given. The longest step of a lens that snaps
/// out of its tube takes 160 to 210; halved before its end it would take them twice.
const IN_CONTACT: usize = 300;
/// Iterations from which on a lagged factorisation is made anew.
const RENEW_AFTER: usize = 10;

/// Returns the stepping method of the bodies of a participant.
pub(crate) fn method(built: &Built, run: &RunTable, plan: &Plan) -> Method {
    let precision = plan.target.precision;
    match &built.implicit {
        Some(bodies) => method_of(bodies, run, plan),
        None if run.solver == SolverName::QuasiStatic => {
            Method::QuasiStatic { precision, tolerance: run.tolerance }
        }
        None => Method::Explicit(Explicit {
            precision,
            on_unstable: on_unstable(run.on_unstable.unwrap_or_default()),
            critical_step: plan
                .limits
                .as_ref()
                .map_or(f64::INFINITY, |limits| limits.critical.assembled.step),
            contacts: built.contacts.clone(),
            start: built.pushed.clone(),
            #[cfg(feature = "gpu")]
            device: plan.target.device.clone(),
            #[cfg(feature = "gpu")]
            design: run.design.map(design),
        }),
    }
}

fn on_unstable(name: OnUnstableName) -> OnUnstable {
    match name {
        OnUnstableName::Substep => OnUnstable::Substep,
        OnUnstableName::Stop => OnUnstable::Stop,
        OnUnstableName::Report => OnUnstable::Report,
    }
}

/// Returns the stepping method of shells, and of solids whose equations are solved.
fn method_of(bodies: &Arc<ImplicitBodies>, run: &RunTable, plan: &Plan) -> Method {
    let bodies = Arc::clone(bodies);
    let table = run.linear.table();
    let linear = linear_solver(&table);
    match run.solver {
        SolverName::Static => {
            let mut settings = StaticSettings { linear, ..StaticSettings::default() };
            settings.tolerance = run.tolerance.unwrap_or(settings.tolerance);
            settings.iterations = iterations(&bodies, run, settings.iterations);
            Method::Static(bodies, settings)
        }
        SolverName::Implicit => {
            let mut settings = DynamicSettings { linear, ..DynamicSettings::new(plan.steps.step) };
            settings.tolerance = run.tolerance.unwrap_or(settings.tolerance);
            settings.iterations = iterations(&bodies, run, settings.iterations);
            settings.speed_tolerance = run.speed_tolerance;
            settings.accept_unconverged = run.accept_unconverged.unwrap_or(false);
            settings.accept_stalled = table.accept_stalled;
            if settings.iterations == 1 {
                settings = settings.real_time(linear);
            }
            settings.integrator = match run.integrator.unwrap_or_default() {
                IntegratorName::BackwardEuler => Integrator::BackwardEuler,
                IntegratorName::Bdf2 => Integrator::Bdf2,
            };
            let steps = LongSteps {
                settings,
                #[cfg(feature = "gpu")]
                device: plan.target.device.clone(),
            };
            Method::Implicit(bodies, steps)
        }
        SolverName::Explicit | SolverName::QuasiStatic => {
            let steps = ShortSteps {
                #[cfg(feature = "gpu")]
                device: plan.target.device.clone(),
            };
            Method::ExplicitShells(bodies, steps)
        }
    }
}

/// Iterations of Newton's method at most: those that are given, or the usual ones; more in contact.
fn iterations(bodies: &ImplicitBodies, run: &RunTable, usual: usize) -> usize {
    let usual = if bodies.model.contact.is_some() { IN_CONTACT } else { usual };
    run.iterations.map_or(usual, |n| n as usize)
}

fn linear_solver(table: &LinearTable) -> LinearSolver {
    match table.by {
        LinearName::Direct => LinearSolver::Direct,
        LinearName::Unsymmetric => LinearSolver::Unsymmetric,
        LinearName::ConjugateGradients => LinearSolver::ConjugateGradients {
            tolerance: table.tolerance,
            iterations: table.iterations as usize,
            preconditioner: match table.preconditioner {
                PreconditionerName::BlockJacobi => Preconditioner::BlockJacobi,
                PreconditionerName::Aggregates => Preconditioner::Aggregates,
                PreconditionerName::LaggedFactors => {
                    Preconditioner::LaggedFactors { renew_after: RENEW_AFTER }
                }
            },
        },
    }
}
