//! How far an equilibrium is from the exact one, by its slowest mode.

use super::{ADAPT, FASTEST, HIGHEST, PATIENCE};

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

/// What a search in single precision knows of its displacements.
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

    /// Whether displacements, asked for at an equilibrium of the forces, are good enough, or won't become so.
    pub(super) fn suffices(&mut self, tolerance: f64) -> bool {
        self.waited += 1;
        self.waited > PATIENCE || self.mean() <= tolerance
    }

    pub(super) fn hold_back(&mut self, slowest: f64) -> f64 {
        let first = *self.slowest.get_or_insert(slowest);
        if first > 0.0 { slowest.min(FASTEST * first) } else { slowest }
    }
}

/// The next estimate of the slowest mode's squared frequency.
pub(super) fn follow(slowest: f64, sums: &Extremes) -> f64 {
    let estimate = sums.stiffness / sums.mass;
    if !(estimate.is_finite() && estimate > 0.0) {
        return slowest;
    }
    let estimate = estimate.min(HIGHEST);
    if slowest == 0.0 { estimate } else { estimate.clamp(slowest * ADAPT[0], slowest * ADAPT[1]) }
}
