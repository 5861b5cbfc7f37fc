//! The tool or constraint that drives a blocked step.

use nalgebra::Vector3;
use pliant_mechanics::model::{Constraint, Motion};

use super::System;
use crate::model::error::SolveError;
use crate::model::state::AssemblyState;

impl System {
    /// An error of a step that began at a state; where the step is blocked, with what drives it there, its
    /// force and the gap.
    pub(crate) fn blocked_at(&mut self, state: &AssemblyState, error: SolveError) -> SolveError {
        let SolveError::Blocked { time, part, iterations, .. } = error else { return error };
        self.stand(&state.history);
        if let Some(contact) = &mut self.contact {
            contact.stand(state);
        }
        if self.evaluate(state, state.time, None).is_err() {
            return error;
        }
        let gap = self.contact.as_ref().and_then(|contact| contact.step.least_gap()).unwrap_or(f64::INFINITY);
        let driver = self.hardest_driver([state.time, time]);
        if driver.is_none() && self.conditions.are_closed() {
            // Nothing is driven: loads press what does not come to rest.
            return SolveError::NotConverged { time, node: 0, residuals: Vec::new(), broken: None };
        }
        SolveError::Blocked { time, driver, part, gap, iterations }
    }

    /// The tool or constraint that pushes hardest among those that move between two times [s], with its force
    /// [N] at the state last evaluated.
    fn hardest_driver(&self, [from, to]: [f64; 2]) -> Option<(String, f64)> {
        let resisting = |at: usize| self.forces.internal[at] - self.forces.external[at];
        let held = |constraint: &Constraint| {
            let goes = |index: usize| constraint.motion.increment(index, from, to) != [0.0; 6];
            if matches!(constraint.motion, Motion::Fixed) || !(0..constraint.nodes.len()).any(goes) {
                return None;
            }
            let along =
                |c: usize| constraint.nodes.iter().map(|&node| resisting(6 * node as usize + c)).sum();
            let force = Vector3::from_fn(|c, _| if constraint.components[c] { along(c) } else { 0.0 });
            Some((constraint.name.clone(), force.norm()))
        };
        let constraints = self.model.constraints.iter().filter_map(|constraint| match &constraint.motion {
            Motion::Mean { by, curve, .. } => {
                let goes = *by != [0.0; 3] && curve.value(from) != curve.value(to);
                let force = constraint.mean_force(|node| [0, 1, 2].map(|c| resisting(6 * node as usize + c)));
                goes.then(|| (constraint.name.clone(), Vector3::from(force).norm()))
            }
            motion if motion.is_collective() => None,
            _ => held(constraint),
        });
        let tools = self.contact.iter().flat_map(|contact| contact.pushing([from, to]));
        constraints.chain(tools).fold(None, |hardest: Option<(String, f64)>, next| match hardest {
            Some(hardest) if hardest.1 >= next.1 => Some(hardest),
            _ => Some(next),
        })
    }
}
