//! Rollback points: states of a run that are kept in memory. A run whose explicit step fails goes back to one
//! of them and halves its steps.
//!
//! A run keeps two points, so that the chosen one lies at least [`EVERY`] steps before the failure. An
//! instability has grown for a while before it is noticed. The points are part of checkpoints, so a resumed
//! run goes back to the same states.

use pliant_sim::{Failure, Simulation, State, World};

use crate::progressed::Progressed;

/// Steps from one point to the next, of the participant that takes the most.
const EVERY: u64 = 1000;
/// Points that are kept.
const KEPT: usize = 2;
/// Balance of the energies from which on an instant is no point.
const BALANCED: f64 = 0.01;

/// An instant of a run to go back to.
#[derive(Clone, Debug)]
pub(crate) struct Point {
    pub progressed: Progressed,
    pub state: State,
}

/// The points of a run, the earliest first.
pub(crate) struct RollbackPoints {
    /// Common steps from one point to the next.
    every: u64,
    points: Vec<Point>,
}

impl RollbackPoints {
    /// Makes the rollback points of a world, with the points of the run that it resumes; `None` if no
    /// participant cuts its steps.
    pub fn new(world: &World, points: Vec<Point>) -> Option<Self> {
        let most = world.parts.iter().map(|part| part.steps.number).max()?;
        let common = world.parts.iter().map(|part| part.steps.number).min()?;
        let every = (EVERY * common.max(1) / most.max(1)).max(1);
        world.cuts_steps().then_some(Self { every, points })
    }

    /// True if the instant after a step becomes a point; the first instant always does.
    pub fn is_due(&self, simulation: &Simulation) -> bool {
        self.points.is_empty()
            || simulation.steps().is_multiple_of(self.every) && simulation.energies().balance < BALANCED
    }

    /// Common steps to the next instant that may become one.
    pub fn stride(&self, simulation: &Simulation) -> u64 {
        self.every - simulation.steps() % self.every
    }

    /// Keeps a point.
    pub fn keep(&mut self, point: Point) {
        if self.points.len() == KEPT {
            self.points.remove(0);
        }
        self.points.push(point);
    }

    /// The point to go back to after a failure, with halved steps; `None` where shorter steps do not help, or
    /// were halved often enough.
    pub fn take(&mut self, world: &World, failure: &Failure) -> Option<Point> {
        let point = self.points.first_mut().filter(|_| world.shorter_steps_may_avoid(failure))?;
        if !point.state.halve_steps(world) {
            return None;
        }
        self.points.truncate(1);
        self.points.first().cloned()
    }

    /// Returns the points.
    pub fn points(&self) -> &[Point] {
        &self.points
    }
}
