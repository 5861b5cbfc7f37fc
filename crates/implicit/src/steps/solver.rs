//! Common parts of the solvers of a model's equations.

use pliant_contact::lag::Lag;
use pliant_mechanics::StopFlag;

use crate::model::assembly::Spring;
use crate::model::error::SolveError;
use crate::system::contact::ContactSystem;
use crate::system::{Phases, System};

/// An attempt to find an equilibrium.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Attempted {
    /// The time that it was to reach.
    pub time: f64,
    /// Factor of the controlled loads at its end.
    pub load_factor: f64,
    /// True if an equilibrium was found.
    pub found: bool,
    /// Norm of the residual [N] before each iteration and at the end.
    pub residuals: Vec<f64>,
    /// Tolerance of the residual at the end [N].
    pub allowed: f64,
}

impl Attempted {
    /// Iterations of Newton's method: at least one.
    pub fn iterations(&self) -> usize {
        self.residuals.len().saturating_sub(1).max(1)
    }
}

/// A solver of the equations of a model: [`Statics`](crate::Statics) or
/// [`BackwardEuler`](crate::BackwardEuler).
pub trait AssemblySolver {
    /// The equations.
    fn system(&self) -> &System;

    /// The equations, mutable.
    fn system_mut(&mut self) -> &mut System;

    /// The attempts of the last step, one after the other, with their relative residuals.
    fn attempts(&self) -> &[Attempted];

    /// The relative residual that is allowed.
    fn tolerance(&self) -> f64;

    /// Time spent in the parts of the solver so far.
    fn phases(&self) -> Phases {
        self.system().phases
    }

    /// Contacts, at the state of the last step; `None` without any.
    fn contact(&self) -> Option<&ContactSystem> {
        self.system().contact.as_deref()
    }

    /// Contacts, mutable; `None` without any.
    fn contact_mut(&mut self) -> Option<&mut ContactSystem> {
        self.system_mut().contact.as_deref_mut()
    }

    /// Takes a pattern of the equations with [`pairs`](ContactSystem::pairs) of nodes that contacts added in
    /// another solver. This solver then continues from there bit for bit.
    ///
    /// # Errors
    /// If the equations are too many for the solver chosen.
    fn take_contact_pairs(&mut self, pairs: Vec<[u32; 2]>) -> Result<(), SolveError> {
        self.system_mut().take_pairs(pairs)
    }

    /// Values of the older matrix whose factors precondition the next one, if there is one: without them
    /// another solver takes other iterations.
    fn factored(&self) -> Option<&[f64]> {
        self.system().stiffness.factored()
    }

    /// Takes the [factors](Self::factored) of another solver with the same [pairs](Self::take_contact_pairs):
    /// to continue with the same bits.
    fn precondition_with(&mut self, values: Vec<f64>) {
        self.system_mut().stiffness.precondition_with(values);
    }

    /// Looks at a flag from now on, before each solution, and stops where it asks.
    fn stop_on(&mut self, flag: &StopFlag) {
        self.system_mut().stop = flag.clone();
    }

    /// Lags of moved nodes whose force is limited, behind their motion, and of volumes [m³] whose pressure is
    /// limited, along the first axis. The order is by constraints.
    fn lags(&self) -> &[Lag] {
        &self.system().lags
    }

    /// Takes the lags of another solver, whose run this one continues.
    fn take_lags(&mut self, lags: Vec<Lag>) {
        self.system_mut().lags = lags;
    }

    /// Takes hold of nodes, as [`Forces::grip`](crate::Forces::grip).
    fn grip(&mut self, springs: &[Spring]) {
        self.system_mut().grip(springs);
    }

    /// Takes forces [N] on nodes, as [`Forces::push`](crate::Forces::push).
    fn push(&mut self, forces: &[(u32, [f64; 3])]) {
        self.system_mut().push(forces);
    }
}
