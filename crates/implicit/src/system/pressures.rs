//! Pressures that follow faces and fill volumes.

use super::System;
use super::facets::Pressure;
use crate::curved::mapping::CarriedPoints;
use crate::model::assembly::Assembly;
use crate::model::state::State;
use crate::system::conditions::add_gradient;
use nalgebra::Vector3;
use pliant_linear::sparse::NONE;
use pliant_mechanics::load::{Face, Load, LoadKind, NO_NODE, Spread, face_areas};
use pliant_mechanics::mapping::{Configuration, Mapping};
use pliant_mechanics::model::{Enclosed, Motion};
use pliant_mechanics::tensor::scale;
use pliant_shells::rotation::skew;
use pliant_shells::symmetrise;
use std::sync::Arc;

impl System {
    /// Subtracts S(m)/2 for the moments m on nodes, whose axes stay in space: their covariant derivative.
    pub(super) fn turn_moments(&mut self, factor: f64) {
        for node in 0..self.model.rest.len() {
            let at = 6 * node + 3;
            let moment = Vector3::from_fn(|c, _| self.external[at + c] + factor * self.controlled[at + c]);
            if moment == Vector3::zeros() {
                continue;
            }
            let half = skew(&moment) * 0.5;
            let equation = |c: usize| self.equations.number[at + c];
            for (row, column) in [(0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1)] {
                if equation(row) != NONE && equation(column) != NONE {
                    self.matrix.add_entry(equation(row), equation(column), -half[(row, column)]);
                }
            }
        }
    }

    /// Loads on nodes, and pressures on facets.
    pub(super) fn nodal_loads(&mut self, state: &State, time: f64) {
        let model = Arc::clone(&self.model);
        self.external.fill(0.0);
        self.controlled.fill(0.0);
        self.pressure.fill(Pressure::default());
        for load in &model.loads {
            let factor = load.curve.value(time);
            let target = if load.controlled { &mut self.controlled } else { &mut self.external };
            let mut add = |node: u32, first: usize, force: [f64; 3]| {
                for c in 0..3 {
                    target[6 * node as usize + first + c] += factor * force[c];
                }
            };
            let points =
                load.surface.map(|surface| CarriedPoints::new(&model, self.surface.as_ref(), surface));
            let mut apply = |at: u32, force: [f64; 3]| match points {
                None => add(at, 0, force),
                Some(points) => points.add_force(state, at as usize, force, &mut |node, force, moment| {
                    add(node, 0, force);
                    add(node, 3, moment);
                }),
            };
            match &load.kind {
                LoadKind::Forces(forces) => forces.iter().for_each(|&(at, force)| apply(at, force)),
                LoadKind::Pressure { faces, pressure } => {
                    let position = |at: u32| match points {
                        None => Configuration::position(state, at),
                        Some(points) => points.position(state, at as usize),
                    };
                    for face in faces {
                        for (at, area) in face_areas(face, position) {
                            apply(at, scale(area, -*pressure));
                        }
                    }
                }
                LoadKind::Moments(moments) => moments.iter().for_each(|&(node, moment)| add(node, 3, moment)),
                LoadKind::Gravity { body, acceleration } => {
                    for node in model.bodies[*body].nodes.clone() {
                        add(node, 0, scale(*acceleration, model.mass[node as usize]));
                    }
                }
                LoadKind::ShellPressure { facets, pressure, spread } => {
                    for &facet in facets {
                        let own = &mut self.pressure[facet as usize];
                        let own = match spread {
                            Spread::Lumped => &mut own.lumped,
                            Spread::Curved => &mut own.curved,
                        };
                        own[usize::from(load.controlled)] += factor * pressure;
                    }
                }
            }
        }
    }

    /// Adds how pressures on faces of solids change with their nodes, its symmetric part unless both halves are kept: all of it where
    /// the faces close or end at held nodes.
    pub(super) fn press_faces(&mut self, state: &State, time: f64, moved: &[f64]) {
        let model = Arc::clone(&self.model);
        for (number, (load, faces, pressure)) in pressing(&model).enumerate() {
            let places = std::mem::take(&mut self.face_places[number]);
            let factor = if load.controlled { state.load_factor } else { 1.0 } * load.curve.value(time);
            for (face, places) in faces.iter().zip(&places) {
                self.press_face(face, places, factor * pressure, state, moved);
            }
            self.face_places[number] = places;
        }
    }

    /// The same for one face, at its places.
    pub(super) fn press_face(
        &mut self,
        face: &Face,
        places: &[u32],
        pressure: f64,
        state: &State,
        moved: &[f64],
    ) {
        let nodes = corners(face);
        let symmetric = self.matrix.mirror.is_empty();
        let tangent = pressure_change(face, nodes.len(), state, pressure, symmetric);
        self.add_at(nodes, places, &tangent, moved);
    }

    /// Adds how the pressures in enclosures change with their nodes.
    pub(super) fn press_enclosures(&mut self, state: &State, moved: &[f64]) {
        if self.conditions.is_empty() {
            return;
        }
        let model = Arc::clone(&self.model);
        let conditions = std::mem::take(&mut self.conditions);
        let resisting =
            |at: usize| self.internal[at] - self.external[at] - state.load_factor * self.controlled[at];
        let all = conditions.pressures(&model, &self.equations, resisting);
        let symmetric = self.matrix.mirror.is_empty();
        for (own, enclosure, pressure) in all {
            for face in &enclosure.faces {
                let face = face.map(|at| if at == NO_NODE { at } else { own.nodes[at as usize] });
                let places = self.matrix.places(&self.equations, corners(&face), 3);
                self.press_face(&face, &places, -pressure, state, moved);
            }
            for &facet in &enclosure.facets {
                let Some(surface) = &self.surface else { break };
                let patch = surface.patch(&model, state, facet);
                let mut tangent = patch.pressure_change() * -pressure;
                if symmetric {
                    symmetrise(&mut tangent);
                } else {
                    // The covariant derivative of the moments.
                    let forces = patch.pressure_forces() * pressure;
                    for first in [3, 9, 15] {
                        let moment = Vector3::new(forces[first], forces[first + 1], forces[first + 2]);
                        let mut own = tangent.fixed_view_mut::<3, 3>(first, first);
                        own -= skew(&moment) * 0.5;
                    }
                }
                let places = std::mem::take(&mut self.places[facet as usize]);
                self.add_block(&model.facets[facet as usize].nodes, 6, &places, tangent.as_slice(), moved);
                self.places[facet as usize] = places;
            }
        }
        self.conditions = conditions;
    }

    /// What a constraint of volume encloses at the state last evaluated, with the pressure that balances what its nodes resist with, and the
    /// forces of that, component by component; `None` of other constraints.
    pub(crate) fn enclosed(&self, constraint: usize, state: &State) -> Option<(Enclosed, Vec<(usize, f64)>)> {
        let own = &self.model.constraints[constraint];
        let Motion::Volume { enclosure, .. } = &own.motion else { return None };
        let mut all: Vec<(usize, f64)> = Vec::new();
        let surface = self.surface.as_ref();
        let volume = add_gradient(&self.model, surface, own, enclosure, state, &mut |component, value| {
            if self.equations.number[component] != NONE {
                all.push((component, value));
            }
        });
        // Entries of one component together.
        all.sort_by_key(|&(component, _)| component);
        all.dedup_by(|next, own| {
            let same = next.0 == own.0;
            own.1 += if same { next.1 } else { 0.0 };
            same
        });
        let along = |&(at, g): &(usize, f64)| g * (self.internal[at] - self.external[at]);
        let squared: f64 = all.iter().map(|(_, g)| g * g).sum();
        let pressure = all.iter().map(along).sum::<f64>() / squared;
        all.iter_mut().for_each(|(_, g)| *g *= pressure);
        Some((Enclosed { volume, pressure }, all))
    }
}

/// The pressures on faces of solids. How those on carried surfaces change with the state is left out of the stiffness.
pub(super) fn pressing(model: &Assembly) -> impl Iterator<Item = (&Load, &Vec<Face>, f64)> {
    model.loads.iter().filter_map(|load| match &load.kind {
        LoadKind::Pressure { faces, pressure } if load.surface.is_none() => Some((load, faces, *pressure)),
        _ => None,
    })
}

/// The nodes of a face of a solid.
pub(super) fn corners(face: &Face) -> &[u32] {
    if face[3] == NO_NODE { &face[..3] } else { face }
}

/// The derivative of p ∫ N_a n dA of a face by the places of its nodes, column by column: what the pressure pushes against the
/// outward normal; its symmetric part alone if that is wanted. By differences, exact: the areas are of second order in each place.
pub(super) fn pressure_change(
    face: &Face,
    count: usize,
    state: &State,
    pressure: f64,
    symmetric: bool,
) -> Vec<f64> {
    let size = 3 * count;
    let mut tangent = vec![0.0; size * size];
    let place = |node: u32| -> [f64; 3] { state.position[node as usize].into() };
    let [first, second] = [face[0], face[2]].map(|node| state.position[node as usize]);
    let h = 0.1 * (second - first).norm();
    for (b, &moved) in face[..count].iter().enumerate() {
        for k in 0..3 {
            let areas = |by: f64| {
                let shifted = |node: u32| {
                    let mut at = place(node);
                    at[k] += if node == moved { by } else { 0.0 };
                    at
                };
                face_areas(face, shifted).collect::<Vec<_>>()
            };
            for (a, (ahead, behind)) in areas(h).into_iter().zip(areas(-h)).enumerate() {
                for i in 0..3 {
                    tangent[(3 * b + k) * size + 3 * a + i] =
                        pressure * (ahead.1[i] - behind.1[i]) / (2.0 * h);
                }
            }
        }
    }
    for (i, j) in (0..size).flat_map(|j| (0..j).map(move |i| (i, j))).filter(|_| symmetric) {
        let mean = 0.5 * (tangent[j * size + i] + tangent[i * size + j]);
        (tangent[j * size + i], tangent[i * size + j]) = (mean, mean);
    }
    tangent
}
