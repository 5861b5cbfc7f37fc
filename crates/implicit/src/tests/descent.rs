//! A descent of an energy that does not fall.

use super::cantilever;
use crate::model::error::SolveError;
use crate::model::state::AssemblyState;
use crate::steps::descent::{Contacting, Limits, Vectors, descend};
use crate::system::System;
use crate::{AssemblySolver, Attempted, StaticSettings, Statics};

/// A solver whose energy grows by 1 J each time it is asked.
struct Stuck {
    solver: Statics,
    asked: u32,
}

impl AssemblySolver for Stuck {
    fn system(&self) -> &System {
        self.solver.system()
    }

    fn system_mut(&mut self) -> &mut System {
        self.solver.system_mut()
    }

    fn attempts(&self) -> &[Attempted] {
        self.solver.attempts()
    }

    fn tolerance(&self) -> f64 {
        self.solver.tolerance()
    }
}

impl Contacting for Stuck {
    const INERTIA: bool = false;

    fn vectors(&mut self) -> Vectors<'_> {
        self.solver.vectors()
    }

    fn evaluate(&mut self, state: &AssemblyState, time: f64, tangent: bool) -> Result<(), SolveError> {
        Contacting::evaluate(&mut self.solver, state, time, tangent)
    }

    fn find_residual(&mut self, state: &AssemblyState) -> (f64, f64) {
        Contacting::find_residual(&mut self.solver, state)
    }

    fn potential(&mut self) -> f64 {
        self.asked += 1;
        f64::from(self.asked)
    }

    fn complete(&mut self) {
        self.solver.complete();
    }

    fn part(&self) -> f64 {
        self.solver.part()
    }

    fn accepts(&self, _before: f64, _after: f64) -> bool {
        false
    }

    fn worst(&self) -> u32 {
        self.solver.worst()
    }
}

/// The state stays where it was found, and is taken where that is asked for: `accept-unconverged`.
#[test]
fn a_descent_that_fails_is_accepted_if_told_so() {
    let model = cantilever();
    let descent = |accept: bool| {
        let solver = Statics::new(model.clone(), StaticSettings::default()).unwrap();
        let limits = Limits { iterations: 30, lags: 0, close: None, accept, farthest: f64::INFINITY };
        let mut state = AssemblyState::at_rest(&model);
        let found = descend(&mut Stuck { solver, asked: 0 }, &mut state, 1.0, None, &limits, &mut |_, _| ());
        (found, state.position == AssemblyState::at_rest(&model).position)
    };
    let (accepted, stays) = descent(true);
    assert_eq!((accepted.ok(), stays), (Some(false), true));
    let (refused, stays) = descent(false);
    assert!(matches!(refused, Err(SolveError::Uphill { iterations: 1, .. })) && stays, "{refused:?}");
}
