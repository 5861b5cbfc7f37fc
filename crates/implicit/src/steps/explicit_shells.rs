//! Explicit steps of shells: central differences.

use std::sync::Arc;

use nalgebra::Vector3;
use pliant_mechanics::model::Solid;
use pliant_shells::rotation::exponential;

use crate::model::assembly::Assembly;
use crate::model::error::SolveError;
use crate::model::state::AssemblyState;
use crate::solid::highest_frequency_squared;
use crate::steps::forces::Forces;
use crate::system::Phases;

/// Central differences: velocities stand half a step before positions.
pub struct ExplicitShells {
    forces: Forces,
    step: f64,
    /// Mass-proportional damping [1/s] of each node.
    damping: Vec<f64>,
    pending: Vec<f64>,
    /// No step was taken so far: the state may be off the curves of prescribed components.
    fresh: bool,
}

impl ExplicitShells {
    /// The longest stable step [s] about rest: 2/√(ω² + max k/m) of the stiffest element and the stiffest
    /// springs on a node, a lower bound of the model's.
    pub fn stable_step(model: &Assembly) -> f64 {
        let shells = model.facets.iter().map(|facet| facet.highest_frequency_squared());
        let of_solid = |solid: &Solid| {
            let cells = (0..solid.cells.len()).map(|cell| highest_frequency_squared(solid, cell));
            cells.fold(0.0, f64::max)
        };
        let solids = model.solids.iter().map(of_solid);
        let highest = shells.chain(solids).fold(0.0, f64::max);
        let mut springs = vec![0.0; model.rest.len()];
        for spring in &model.springs {
            springs[spring.node as usize] += spring.stiffness;
        }
        let held = springs.iter().zip(&model.mass).filter(|(_, mass)| **mass > 0.0);
        2.0 / (highest + held.map(|(stiffness, mass)| stiffness / mass).fold(0.0, f64::max)).sqrt()
    }

    /// A solver with steps of a length [s]. Pressures change the stable step, and are not looked at.
    ///
    /// # Errors
    /// If the step is longer than is stable, or damping is proportional to stiffness.
    pub fn new(model: impl Into<Arc<Assembly>>, step: f64) -> Result<Self, SolveError> {
        let model = model.into();
        if !(step > 0.0 && step <= Self::stable_step(&model)) {
            return Err(SolveError::Impossible(
                "the step is longer than the stable one (`ExplicitShells::stable_step`); shorten it or use the implicit solver",
            ));
        }
        if model.collective().is_some() {
            return Err(SolveError::Impossible(
                "explicit shells do not support constraints of means, rigid parts or volumes; use the \
                 implicit solver",
            ));
        }
        if !model.turns.is_empty() {
            return Err(SolveError::Impossible(
                "explicit shells do not support rotations that follow a solid; use the implicit solver",
            ));
        }
        if model.stiffness_damping > 0.0 {
            return Err(SolveError::Impossible(
                "damping by stiffness needs the implicit solver; damp by mass instead",
            ));
        }
        Ok(Self {
            pending: vec![0.0; 6 * model.rest.len()],
            damping: model.damping(),
            forces: Forces::new(model),
            step,
            fresh: true,
        })
    }

    /// Makes one step: [`evaluate`](Self::evaluate), then [`go`](Self::go).
    ///
    /// # Errors
    /// If an element collapses or folds over.
    pub fn advance(&mut self, state: &mut AssemblyState) -> Result<(), SolveError> {
        self.evaluate(state)?;
        self.go(state);
        Ok(())
    }

    /// The first half of a step: the forces at a state, for whoever wants to look at them before it moves.
    ///
    /// # Errors
    /// If an element collapses or folds over.
    pub fn evaluate(&mut self, state: &AssemblyState) -> Result<(), SolveError> {
        self.forces.evaluate(state)
    }

    /// The forces last evaluated.
    pub fn forces(&self) -> &Forces {
        &self.forces
    }

    /// Mutable forces, to take hold of nodes and to push them.
    pub fn forces_mut(&mut self) -> &mut Forces {
        &mut self.forces
    }

    /// Time spent in the parts of the solver so far.
    pub fn phases(&self) -> Phases {
        self.forces.system.phases
    }

    /// The second half of a step: moves the state on with the forces that were evaluated at it.
    pub fn go(&mut self, state: &mut AssemblyState) {
        let (h, model) = (self.step, Arc::clone(&self.forces.system.model));
        if std::mem::take(&mut self.fresh) {
            self.forces.system.catch_up(state, state.time + h);
        }
        let system = &self.forces.system;
        system.prescribed(state.time, state.time + h, &mut self.pending);
        for (node, damping) in self.damping.iter().enumerate() {
            if model.mass[node] == 0.0 {
                continue;
            }
            // (1 + αh/2) v⁺ = (1 − αh/2) v + h f/m.
            let half = 0.5 * damping * h;
            let (kept, gained) = ((1.0 - half) / (1.0 + half), h / (1.0 + half));
            let velocity = |first: usize, now: Vector3<f64>, mass: f64| {
                Vector3::from_fn(|c, _| {
                    let at = 6 * node + first + c;
                    if system.stiffness.equations.number[at] == pliant_linear::sparse::NONE {
                        return self.pending[at] / h;
                    }
                    kept * now[c] + gained * (system.forces.external[at] - system.forces.internal[at]) / mass
                })
            };
            let (v, w) = (
                velocity(0, state.velocity[node], model.mass[node]),
                velocity(3, state.spin[node], model.rotary_inertia[node]),
            );
            (state.velocity[node], state.spin[node]) = (v, w);
            state.position[node] += h * v;
            state.rotation[node] = exponential(&(h * w)) * state.rotation[node];
        }
        state.time += h;
    }
}
