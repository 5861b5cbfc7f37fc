//! Prescribed motions: the increment of a step is the difference of curves, so that a step keeps all digits.
//! A state may also be off its curves: at rest under curves that do not begin at 0, or after its scene was
//! changed. The difference is then added by the end of a step.

use nalgebra::Vector3;
use pliant_mechanics::model::{Constraint, Enclosure, Motion, fill};
use pliant_shells::EdgeRule;
use pliant_shells::rotation::{exponential, logarithm};

use crate::curved::surface::CurvedSurface;
use crate::model::assembly::Assembly;
use crate::model::state::AssemblyState;
use crate::system::conditions::add_gradient;

/// A distance that counts as none, over the mean edge: what round-off adds up to over many steps.
const ARRIVED: f64 = 1e-10;

/// Distances of prescribed components from their curves, which come in evenly between two times.
#[derive(Clone, Debug)]
pub(crate) struct Gap {
    /// Translations [m] and rotation vectors [rad], six a node.
    by: Vec<f64>,
    times: [f64; 2],
}

impl Gap {
    /// The gap of a state that has come in by a time [s]; `None` if the state is where its curves say.
    pub(crate) fn of(
        model: &Assembly,
        state: &AssemblyState,
        until: f64,
        lag: impl Fn(usize) -> Vector3<f64>,
    ) -> Option<Self> {
        let by = missing(model, state, lag);
        let edge = model.mean_edge();
        let arrived = |(at, gap): (usize, &f64)| gap.abs() <= ARRIVED * if at % 6 < 3 { edge } else { 1.0 };
        let closed = by.iter().enumerate().all(arrived);
        (!closed).then_some(Self { by, times: [state.time, until] })
    }

    /// Adds the part of the gap that comes in between two times [s] to increments, six a node.
    pub(crate) fn add(&self, from: f64, to: f64, increments: &mut [f64]) {
        let [begin, end] = self.times;
        let part = ((to.min(end) - from.max(begin)) / (end - begin)).max(0.0);
        if part > 0.0 {
            increments.iter_mut().zip(&self.by).for_each(|(entry, by)| *entry += part * by);
        }
    }
}

impl Assembly {
    /// Puts prescribed nodes, with all that follows them, where their motions are at the time of a state, at
    /// rest. A run in time begins so. Nodes with a prescribed mean shift together. Nodes around a prescribed
    /// volume move along its gradient; others stay.
    pub fn place_prescribed(&self, state: &mut AssemblyState) {
        let gap = missing(self, state, |_| Vector3::zeros());
        state.advance(&gap, 1.0);
        let held = self.held_components();
        for constraint in &self.constraints {
            let missing =
                constraint.missing_mean(state.time, |node| self.displacement(&state.position, node));
            constraint.nodes.iter().for_each(|&node| state.position[node as usize] += Vector3::from(missing));
            if let Motion::Volume { enclosure, by, curve } = &constraint.motion {
                self.fill(constraint, enclosure, by * curve.value(state.time), &held, state);
            }
        }
        self.take_along(state);
    }

    /// Grows what a constraint encloses by a volume [m³] beyond that at rest: its free nodes move along the
    /// gradient of the volume.
    fn fill(
        &self,
        constraint: &Constraint,
        enclosure: &Enclosure,
        growth: f64,
        held: &[bool],
        state: &mut AssemblyState,
    ) {
        let surface = (!enclosure.facets.is_empty()).then(|| CurvedSurface::new(self, EdgeRule::Arc));
        let volume = |state: &AssemblyState, gradient: &mut [f64]| {
            gradient.fill(0.0);
            add_gradient(self, surface.as_ref(), constraint, enclosure, state, &mut |at, value| {
                if at % 6 < 3 && !held[at] {
                    gradient[at] += value;
                }
            })
        };
        let mut gradient = vec![0.0; 6 * self.rest.len()];
        let wanted = volume(&AssemblyState::at_rest(self), &mut gradient) + growth;
        fill(state, wanted, &mut gradient, volume, AssemblyState::advance);
    }

    /// Flags of the components that a constraint fixes or moves by itself, six a node.
    pub fn held_components(&self) -> Vec<bool> {
        let mut held = vec![false; 6 * self.rest.len()];
        for constraint in self.constraints.iter().filter(|constraint| !constraint.motion.is_collective()) {
            for &node in &constraint.nodes {
                let components = &mut held[6 * node as usize..6 * node as usize + 6];
                components.iter_mut().zip(constraint.components).for_each(|(held, holds)| *held |= holds);
            }
        }
        held
    }
}

/// Translations [m] and rotation vectors [rad], six a node, by which prescribed components are away from
/// their curves at the time of a state. They lie on a straight way. `lag` is the way [m] by which the nodes
/// of a constraint lag behind it. Nodes that are fixed stay where they start. Rotations about some axes only
/// are not followed beyond rest.
fn missing(model: &Assembly, state: &AssemblyState, lag: impl Fn(usize) -> Vector3<f64>) -> Vec<f64> {
    let mut gaps = vec![0.0; 6 * model.rest.len()];
    for (number, constraint) in model.constraints.iter().enumerate() {
        if matches!(constraint.motion, Motion::Fixed) || constraint.motion.is_collective() {
            continue;
        }
        let lag = lag(number);
        for (index, &node) in constraint.nodes.iter().enumerate() {
            let place = constraint.motion.place(index, state.time);
            let [shift, turn] =
                [0, 3].map(|first| Vector3::new(place[first], place[first + 1], place[first + 2]));
            let shift = shift + lag - Vector3::from(model.displacement(&state.position, node));
            let rotation = &state.rotation[node as usize];
            let turn = match constraint.components[3..] {
                // At rest all turns begin, whole ones and more included.
                _ if rotation.angle() == 0.0 => turn,
                [true, true, true] => logarithm(&(exponential(&turn) * rotation.inverse())),
                _ => Vector3::zeros(),
            };
            for c in (0..6).filter(|&c| constraint.components[c]) {
                gaps[6 * node as usize + c] = if c < 3 { shift[c] } else { turn[c - 3] };
            }
        }
    }
    gaps
}
