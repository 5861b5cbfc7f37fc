//! The search for an equilibrium, and how far this is from the exact one, by its slowest mode.

use super::PATIENCE;

/// A_m.
const HIGHEST: f64 = 4.0;
/// Largest relative change of A₀ an iteration, down and up.
const ADAPT: [f64; 2] = [0.90, 1.02];
/// Growth at the most of the estimate of the slowest mode where the residual is rough.
const FASTEST: f64 = 1.5;
/// The motion starts anew where the residual grows by this factor over its least.
const RUNAWAY: f64 = 10.0;
/// Reports over which an error of displacements is averaged in single precision.
pub(super) const AVERAGED: usize = 10;

/// Sums and extremes over the nodes of one task.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Extremes {
    pub(super) stiffness: f64,
    pub(super) mass: f64,
    pub(super) largest_residual: f64,
    pub(super) residual_node: usize,
    pub(super) largest_force: f64,
    pub(super) finite: bool,
}

impl Extremes {
    pub(super) fn merge(self, b: &Self) -> Self {
        let worse = b.largest_residual > self.largest_residual;
        Self {
            stiffness: self.stiffness + b.stiffness,
            mass: self.mass + b.mass,
            largest_residual: if worse { b.largest_residual } else { self.largest_residual },
            residual_node: if worse { b.residual_node } else { self.residual_node },
            largest_force: self.largest_force.max(b.largest_force),
            finite: self.finite && b.finite,
        }
    }

    pub(super) fn relative_residual(&self) -> f64 {
        if self.largest_residual == 0.0 { 0.0 } else { self.largest_residual / self.largest_force }
    }
}

/// Estimates that the search of a load step keeps.
pub(super) struct Search {
    /// The estimate of the slowest mode's squared frequency.
    pub(super) slowest: f64,
    pub(super) accuracy: Accuracy,
    /// The least residual since the motion started anew.
    least: f64,
    /// The greatest residual, and the least one under the whole load.
    greatest: f64,
    reached: f64,
}

impl Default for Search {
    fn default() -> Self {
        Self {
            slowest: 0.0,
            accuracy: Accuracy::default(),
            least: f64::INFINITY,
            greatest: 0.0,
            reached: f64::INFINITY,
        }
    }
}

impl Search {
    /// Notes a residual; `ramped` is set under the whole load. Returns true if the motion is to start anew.
    pub(super) fn runs_away(&mut self, residual: f64, ramped: bool) -> bool {
        let runs_away = ramped && residual > RUNAWAY * self.least;
        self.least = if runs_away { residual } else { self.least.min(residual) };
        self.greatest = self.greatest.max(residual);
        if ramped {
            self.reached = self.reached.min(residual);
        }
        runs_away
    }

    /// The part of the way to a tolerance that is done.
    pub(super) fn fraction(&self, tolerance: f64) -> f64 {
        ((self.greatest / self.reached).ln() / (self.greatest / tolerance).ln()).clamp(0.0, 1.0)
    }

    /// c for the next iteration, after sums whose residual may be rough.
    pub(super) fn damping(&mut self, sums: &Extremes, rough: bool) -> f64 {
        self.slowest = follow(self.slowest, sums);
        if rough {
            self.slowest = self.accuracy.hold_back(self.slowest);
        }
        2.0 * (self.slowest * HIGHEST / (self.slowest + HIGHEST)).sqrt()
    }
}

/// Estimates of the displacement error that a search in single precision keeps.
#[derive(Default)]
pub(super) struct Accuracy {
    /// The last parts of the way that were left.
    pub(super) left: Vec<f64>,
    /// The estimate of the slowest mode's squared frequency where the residual became rough.
    pub(super) slowest: Option<f64>,
    /// Iterations at which the residual was low enough.
    pub(super) waited: usize,
}

impl Accuracy {
    pub(super) fn note(&mut self, left: f64) {
        if self.left.len() == AVERAGED {
            self.left.remove(0);
        }
        self.left.push(left);
    }

    pub(super) fn mean(&self) -> f64 {
        self.left.iter().sum::<f64>().abs() / self.left.len().max(1) as f64
    }

    /// True if the displacements, at an equilibrium of the forces, are accurate enough, or if the search has
    /// waited too long.
    pub(super) fn suffices(&mut self, tolerance: f64) -> bool {
        self.waited += 1;
        self.waited > PATIENCE || self.mean() <= tolerance
    }

    fn hold_back(&mut self, slowest: f64) -> f64 {
        let first = *self.slowest.get_or_insert(slowest);
        if first > 0.0 { slowest.min(FASTEST * first) } else { slowest }
    }
}

/// The next estimate of the slowest mode's squared frequency.
fn follow(slowest: f64, sums: &Extremes) -> f64 {
    let estimate = sums.stiffness / sums.mass;
    if !(estimate.is_finite() && estimate > 0.0) {
        return slowest;
    }
    let estimate = estimate.min(HIGHEST);
    if slowest == 0.0 { estimate } else { estimate.clamp(slowest * ADAPT[0], slowest * ADAPT[1]) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_estimate_of_the_slowest_mode_moves_slowly() {
        let sums = |ratio| Extremes { stiffness: ratio, mass: 1.0, ..Extremes::default() };
        assert_eq!(follow(0.0, &sums(0.3)), 0.3);
        assert_eq!(follow(1.0, &sums(0.3)), 0.9);
        assert_eq!(follow(1.0, &sums(3.0)), 1.02);
        assert_eq!(follow(1.0, &sums(-1.0)), 1.0);
    }
}
