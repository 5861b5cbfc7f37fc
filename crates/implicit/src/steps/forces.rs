//! Forces on the nodes of a model at a state, without a solver: for reactions, energies and displays of a
//! run.

use std::sync::Arc;

use pliant_mechanics::model::Enclosed;

use crate::model::assembly::{Assembly, Spring};
use crate::model::error::SolveError;
use crate::model::state::AssemblyState;
use crate::system::System;

/// Forces and moments on the nodes of a model at the state last evaluated.
pub struct Forces {
    pub(crate) system: System,
    /// Forces of contacts, six a node; empty for none.
    contact: Vec<f64>,
}

impl Forces {
    /// For a model; nothing is known before the first evaluation.
    pub fn new(model: impl Into<Arc<Assembly>>) -> Self {
        Self { system: System::forces_only(model.into()), contact: Vec::new() }
    }

    /// Finds the forces at a state and its time.
    ///
    /// # Errors
    /// If an element collapses or folds over.
    pub fn evaluate(&mut self, state: &AssemblyState) -> Result<(), SolveError> {
        self.system.stand(&state.history);
        self.system.evaluate(state, state.time, None)?;
        let system = &mut self.system;
        for (load, controlled) in system.forces.external.iter_mut().zip(&system.forces.controlled) {
            *load += state.load_factor * controlled;
        }
        system.forces.external.iter_mut().zip(&self.contact).for_each(|(load, force)| *load += force);
        Ok(())
    }

    /// Takes hold of nodes: from the next evaluation on only these springs act, besides the springs of the
    /// model. Their forces are loads.
    pub fn grip(&mut self, springs: &[Spring]) {
        self.system.grip(springs);
    }

    /// Takes forces [N] on nodes: they and no others act from the next evaluation on, as loads.
    pub fn push(&mut self, forces: &[(u32, [f64; 3])]) {
        self.system.push(forces);
    }

    /// Takes the forces of contacts, six numbers a node: they are loads from the next evaluation on.
    pub fn touch(&mut self, forces: &[f64]) {
        self.contact.clear();
        self.contact.extend_from_slice(forces);
        self.system.give_back(&mut self.contact);
    }

    /// Force [N] and moment [N m] that elements and springs resist with, six numbers a node.
    pub fn internal(&self) -> &[f64] {
        &self.system.forces.internal
    }

    /// Force [N] and moment [N m] of all loads, six numbers a node.
    pub fn loads(&self) -> &[f64] {
        &self.system.forces.external
    }

    /// Resistance of a node beyond its loads [N].
    pub fn resisting(&self, node: u32) -> [f64; 3] {
        let at = 6 * node as usize;
        [at, at + 1, at + 2].map(|at| self.system.forces.internal[at] - self.system.forces.external[at])
    }

    /// The enclosed volume of a constraint of volume at the state last evaluated, which is given. With it
    /// come the force [N] and moment [N m] of its pressure by components, six a node. `None` for other
    /// constraints. The pressure balances the resistance of its nodes by least squares, and is exact in
    /// equilibrium.
    pub fn enclosed(
        &self,
        constraint: usize,
        state: &AssemblyState,
    ) -> Option<(Enclosed, Vec<(usize, f64)>)> {
        self.system.enclosed(constraint, state)
    }

    /// Energy stored in elements and springs [J], and the work of stresses that relax.
    pub fn strain_energy(&self) -> f64 {
        self.system.forces.energy
    }

    /// Part of the stored energy in hourglass control [J].
    pub fn hourglass_energy(&self) -> f64 {
        self.system.forces.hourglass
    }
}
