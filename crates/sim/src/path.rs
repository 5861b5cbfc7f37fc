//! A run by arc length.

use pliant_geometry::words::{counted, number};
use pliant_implicit::{Assembly, State};
use pliant_mechanics::count;
use serde::{Deserialize, Serialize};

use crate::bodies::{RunControl, Stop};

/// Progress of a run by arc length.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Path {
    /// Load factor at the step before.
    pub(crate) factor: f64,
    /// Its last change.
    pub(crate) change: f64,
    #[serde(deserialize_with = "count::read")]
    pub(crate) limit_points: u32,
    /// Reason why it ended before its last step.
    pub(crate) ended: Option<String>,
    /// Direction in which a kept path [continues](Statics::direction).
    pub(crate) direction: Vec<f64>,
}

impl Path {
    /// True if the path belongs to a model with this number of nodes.
    pub(crate) fn fits(&self, nodes: usize) -> bool {
        self.direction.is_empty() || self.direction.len() == 6 * nodes
    }

    /// Takes the load factor of the next equilibrium.
    pub(crate) fn go_on(&mut self, factor: f64) {
        let change = factor - self.factor;
        self.limit_points += u32::from(change * self.change < 0.0);
        (self.factor, self.change) = (factor, change);
    }

    /// Returns the reason why the path ends here, if it does.
    pub(crate) fn end(&self, stop: &Stop, state: &State, model: &Assembly) -> Option<String> {
        let limit = number(stop.load_factor.unwrap_or(f64::INFINITY));
        if stop.load_factor.is_some_and(|limit| self.factor.abs() >= limit) {
            return Some(format!("the load factor is {}, at least {limit} in size", number(self.factor)));
        }
        if let Some((node, component, by)) = stop.displacement {
            let moved = state.displacement(model, node as usize)[component];
            if moved * by.signum() >= by.abs() {
                return Some(format!("the node of `displacement` has moved by {} m", number(moved)));
            }
        }
        let passed = stop.limit_points.is_some_and(|limit| self.limit_points >= limit);
        passed.then(|| format!("{} passed", counted(self.limit_points as usize, "limit point")))
    }
}

/// Returns the control of the load step of a number (counted from 1).
pub(crate) fn part_of(control: RunControl, number: u64, of: u64) -> pliant_implicit::Control {
    match control {
        RunControl::Displacement { node, component, by } => {
            pliant_implicit::Control::Displacement { node, component, by: by / of as f64 }
        }
        RunControl::ArcLength { length, .. } => pliant_implicit::Control::ArcLength { length },
        RunControl::Volume { from, to } => {
            pliant_implicit::Control::Volume { volume: from + (to - from) * number as f64 / of as f64 }
        }
    }
}
