//! Load steps by a displacement, a volume or an arc length.

use std::sync::Arc;

use pliant_linear::dot;
use pliant_mechanics::load::{Load, LoadKind};

use super::{Attempt, Statics, Step};
use crate::model::assembly::Assembly;
use crate::model::error::SolveError;
use crate::model::state::AssemblyState;

impl Statics {
    /// The next equilibrium under a control, which finds the factor of the controlled loads. Other loads and
    /// prescribed motions reach a time [s] evenly. A step that fails is halved.
    ///
    /// # Errors
    /// If no load is controlled, the controlled component is held, a balloon is open, or no equilibrium is
    /// found. The state then is unchanged.
    pub fn control(
        &mut self,
        state: &mut AssemblyState,
        control: Control,
        until: f64,
    ) -> Result<Step, SolveError> {
        self.attempts.clear();
        if !self.system.model.loads.iter().any(|load| load.controlled) {
            return Err(SolveError::Impossible("no load is marked as controlled"));
        }
        if matches!(control, Control::Volume { .. }) {
            for load in self.system.model.loads.iter().filter(|load| load.controlled) {
                if let LoadKind::ShellPressure { facets, .. } = &load.kind {
                    self.system.model.check_closed(facets)?;
                }
            }
        }
        self.begin(state, until);
        self.system.begin_history(state);
        let before = state.clone();
        self.halved(state, control, until, self.settings.halvings).map_err(|attempt| {
            *state = before;
            attempt.error
        })
    }

    /// Two halves of what a control prescribes from a state on.
    pub(super) fn halves(&self, control: Control, state: &AssemblyState) -> [Control; 2] {
        match control {
            Control::Displacement { node, component, by } => {
                [Control::Displacement { node, component, by: 0.5 * by }; 2]
            }
            Control::ArcLength { length } => [Control::ArcLength { length: 0.5 * length }; 2],
            Control::Volume { volume } => {
                let now = controlled_volume(&self.system.model, state);
                [Control::Volume { volume: 0.5 * (now + volume) }, control]
            }
        }
    }

    /// Difference of the controlled quantity from its target (squared for an arc length); sets its gradient.
    pub(super) fn constraint(
        &mut self,
        control: Control,
        state: &AssemblyState,
        start: &AssemblyState,
    ) -> f64 {
        self.gradient.fill(0.0);
        match control {
            Control::Displacement { node, component, by } => {
                self.gradient[6 * node as usize + component] = 1.0;
                state.position[node as usize][component] - start.position[node as usize][component] - by
            }
            Control::ArcLength { length } => {
                let mut squared = 0.0;
                for (gradient, (now, then)) in
                    self.gradient.chunks_exact_mut(6).zip(state.position.iter().zip(&start.position))
                {
                    let moved = now - then;
                    squared += moved.norm_squared();
                    gradient[..3].copy_from_slice((2.0 * moved).as_slice());
                }
                squared - length * length
            }
            Control::Volume { volume } => {
                let model = Arc::clone(&self.system.model);
                for load in model.loads.iter().filter(|load| load.controlled) {
                    let LoadKind::ShellPressure { facets, .. } = &load.kind else { continue };
                    for &facet in facets {
                        let nodes = model.facets[facet as usize].nodes;
                        let x = nodes.map(|node| state.position[node as usize]);
                        for i in 0..3 {
                            let slope = x[(i + 1) % 3].cross(&x[(i + 2) % 3]) / 6.0;
                            for c in 0..3 {
                                self.gradient[6 * nodes[i] as usize + c] += slope[c];
                            }
                        }
                    }
                }
                controlled_volume(&model, state) - volume
            }
        }
    }

    pub(super) fn allowed_gap(&self, control: Option<Control>) -> f64 {
        1e-9 * match control {
            None => f64::INFINITY,
            Some(Control::Displacement { by, .. }) => by.abs(),
            Some(Control::ArcLength { length }) => length * length,
            Some(Control::Volume { volume }) => volume.abs(),
        }
    }

    /// The change of the load factor that keeps the control; adds the response to it to the solution.
    pub(super) fn controlled_factor(
        &mut self,
        control: Control,
        gap: f64,
        first: bool,
    ) -> Result<f64, Attempt> {
        let system = &mut self.system;
        let fatal = |error| Attempt { error, retry: false };
        system.gather(&system.forces.controlled, &mut self.controlled);
        system.respond(&self.controlled, &mut self.response).map_err(fatal)?;
        let components = &system.stiffness.equations.component;
        let along = |x: &[f64], whole: &[f64]| -> f64 {
            components.iter().zip(x).map(|(&c, x)| whole[c as usize] * x).sum()
        };
        let factor = match control {
            Control::ArcLength { length } if first => {
                // The predictor: along the response, onwards.
                let translations = components.iter().zip(&self.response).filter(|(c, _)| **c % 6 < 3);
                let size = translations.map(|(_, r)| r * r).sum::<f64>().sqrt();
                let onwards = along(&self.response, &self.direction);
                if onwards < 0.0 { -length / size } else { length / size }
            }
            _ => {
                let slope = along(&self.response, &self.gradient);
                -(gap + along(&self.solution, &self.gradient) + dot(&self.pending, &self.gradient)) / slope
            }
        };
        if !factor.is_finite() {
            return Err(fatal(SolveError::Impossible(
                "the controlled loads do not change the controlled quantity; control a free node that the \
                 loads move",
            )));
        }
        for (solution, response) in self.solution.iter_mut().zip(&self.response) {
            *solution += factor * response;
        }
        Ok(factor)
    }
}

/// Quantity that fixes the factor of the controlled loads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Control {
    /// A component (0 to 2) of a node moves by a distance [m].
    Displacement {
        /// The node.
        node: u32,
        /// x, y or z as 0, 1, 2.
        component: usize,
        /// Distance [m] from where the node is.
        by: f64,
    },
    /// The length √Σ|Δx|² [m] by which all translations together move, onwards from the last step.
    ArcLength {
        /// The length [m].
        length: f64,
    },
    /// The facets of the controlled pressure enclose a volume [m³].
    Volume {
        /// The volume [m³].
        volume: f64,
    },
}

/// The volume [m³] that the facets of controlled pressures enclose.
pub(super) fn controlled_volume(model: &Assembly, state: &AssemblyState) -> f64 {
    let volume = |load: &Load| match &load.kind {
        LoadKind::ShellPressure { facets, .. } => model.enclosed_volume(facets, &state.position),
        _ => 0.0,
    };
    model.loads.iter().filter(|load| load.controlled).map(volume).sum()
}
