//! How a participant is stepped, from the tables of its scene.

use std::sync::Arc;

use pliant_explicit::stability::OnUnstable;
use pliant_implicit::{DynamicSettings, Integrator, StaticSettings};
use pliant_linear::{LinearSolver, Preconditioner};
use pliant_sim::{Explicit, ImplicitBodies, LongSteps, Method, Precision, ShortSteps};

use crate::plan::Plan;
use crate::world::Part;
#[cfg(feature = "gpu")]
use pliant_format::tables::DesignName;
use pliant_format::tables::{
    IntegratorName, LinearName, LinearTable, OnUnstableName, PrecisionName, PreconditionerName, RunTable,
    SolverName,
};
#[cfg(feature = "gpu")]
use pliant_sim::gpu::Design;

/// Iterations of Newton's method at most in contact, if none are given. The longest step of a lens that snaps out of its tube takes 160 to 210;
/// halved before its end it would take them twice.
const IN_CONTACT: usize = 300;
/// Iterations from which on a lagged factorisation is made anew.
const RENEW_AFTER: usize = 10;

impl Part {
    /// The same without its tables.
    pub(crate) fn simulated(&self) -> pliant_sim::Part {
        let Self { name, scene, built, plan } = self;
        let (run, precision) = (&scene.run, plan.target.precision);
        let method = match &built.implicit {
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
        };
        pliant_sim::Part {
            name: name.clone(),
            model: Arc::clone(&built.model),
            method,
            steps: plan.steps.clone(),
        }
    }
}

/// The number type of a word.
pub(crate) fn precision(name: PrecisionName) -> Precision {
    match name {
        PrecisionName::Single => Precision::Single,
        PrecisionName::Double => Precision::Double,
    }
}

fn on_unstable(name: OnUnstableName) -> OnUnstable {
    match name {
        OnUnstableName::Substep => OnUnstable::Substep,
        OnUnstableName::Stop => OnUnstable::Stop,
        OnUnstableName::Report => OnUnstable::Report,
    }
}

/// The design of a word.
#[cfg(feature = "gpu")]
pub(crate) fn design(name: DesignName) -> Design {
    match name {
        DesignName::Gather => Design::Gather,
        DesignName::Blocks => Design::Blocks,
        DesignName::FloatAtomics => Design::FloatAtomics,
        DesignName::Fast => Design::Fast,
    }
}

/// How shells, and solids whose equations are solved, are stepped.
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
    let usual = if bodies.model.touching.is_some() { IN_CONTACT } else { usual };
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
