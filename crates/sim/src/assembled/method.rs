//! Its solver.

use pliant_contact::lag::Lag;
use pliant_implicit::{
    AssemblySolver, AssemblyState, Attempted, BackwardEuler, ContactSystem, ExplicitShells, Forces,
    SolveError, Statics,
};

/// A solver, and the forces at an instant: an explicit one finds them anyway.
pub(super) enum SolverMethod {
    Static(Box<Statics>, Forces),
    Implicit(Box<BackwardEuler>, Forces),
    Explicit(Box<ExplicitShells>),
}

impl SolverMethod {
    /// The forces last found.
    pub(super) fn forces(&self) -> &Forces {
        match self {
            Self::Static(_, forces) | Self::Implicit(_, forces) => forces,
            Self::Explicit(solver) => solver.forces(),
        }
    }

    /// The solver of equations; `None` for explicit steps.
    pub(super) fn equations(&self) -> Option<&dyn AssemblySolver> {
        match self {
            Self::Static(solver, _) => Some(&**solver),
            Self::Implicit(solver, _) => Some(&**solver),
            Self::Explicit(_) => None,
        }
    }

    pub(super) fn equations_mut(&mut self) -> Option<&mut dyn AssemblySolver> {
        match self {
            Self::Static(solver, _) => Some(&mut **solver),
            Self::Implicit(solver, _) => Some(&mut **solver),
            Self::Explicit(_) => None,
        }
    }

    /// Contacts; `None` without any.
    pub(super) fn contact(&self) -> Option<&ContactSystem> {
        self.equations().and_then(|solver| solver.contact())
    }

    pub(super) fn contact_mut(&mut self) -> Option<&mut ContactSystem> {
        self.equations_mut().and_then(|solver| solver.contact_mut())
    }

    /// Applies an action to the forces at an instant, and to the solver of equations.
    pub(super) fn act(
        &mut self,
        forces: impl FnOnce(&mut Forces),
        equations: impl FnOnce(&mut dyn AssemblySolver),
    ) {
        match self {
            Self::Static(solver, model_forces) => {
                equations(&mut **solver);
                forces(model_forces);
            }
            Self::Implicit(solver, model_forces) => {
                equations(&mut **solver);
                forces(model_forces);
            }
            Self::Explicit(solver) => forces(solver.forces_mut()),
        }
    }

    /// The attempts of the last step, one after the other.
    pub(super) fn attempts(&self) -> &[Attempted] {
        self.equations().map_or(&[], |solver| solver.attempts())
    }

    /// Returns the lags of moved nodes, with limited force, behind their motion.
    pub(super) fn lags(&self) -> &[Lag] {
        self.equations().map_or(&[], |solver| solver.lags())
    }

    /// Finds the forces at a state.
    pub(super) fn evaluate(&mut self, state: &AssemblyState) -> Result<(), SolveError> {
        match self {
            Self::Static(_, forces) | Self::Implicit(_, forces) => forces.evaluate(state),
            Self::Explicit(solver) => solver.evaluate(state),
        }
    }
}
