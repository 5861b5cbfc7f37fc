//! Loads on nodes, pressures that follow facets, and those that fill volumes.

use nalgebra::Vector3;
use pliant_linear::sparse::NONE;
use pliant_mechanics::load::{LoadKind, NO_NODE, Spread, face_areas};
use pliant_mechanics::mapping::{Configuration, Mapping};
use pliant_mechanics::model::{Enclosed, Motion};
use pliant_mechanics::tensor::scale;
use pliant_shells::rotation::skew;
use pliant_shells::symmetrise;

use super::facets::{Facets, Pressure};
use super::solids::{corners, press_face};
use super::stiffness::Stiffness;
use super::{Sums, System};
use crate::curved::mapping::CarriedPoints;
use crate::model::state::AssemblyState;
use crate::system::conditions::add_gradient;

impl System {
    /// Loads on nodes, and pressures on facets.
    pub(super) fn find_loads(&mut self, state: &AssemblyState, time: f64) {
        let Self { model, facets, forces, .. } = self;
        let Facets { surface, pressure: on_facets, .. } = facets;
        on_facets.fill(Pressure::default());
        for load in &model.loads {
            let factor = load.curve.value(time);
            let target = if load.controlled { &mut forces.controlled } else { &mut forces.external };
            let mut add = |node: u32, first: usize, force: [f64; 3]| {
                for c in 0..3 {
                    target[6 * node as usize + first + c] += factor * force[c];
                }
            };
            let points = load.surface.map(|number| CarriedPoints::new(model, surface.as_ref(), number));
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
                        let of_facet = &mut on_facets[facet as usize];
                        let pressures = match spread {
                            Spread::Lumped => &mut of_facet.lumped,
                            Spread::Curved => &mut of_facet.curved,
                        };
                        pressures[usize::from(load.controlled)] += factor * pressure;
                    }
                }
            }
        }
    }

    /// Adds how the pressures in enclosures change with their nodes.
    pub(super) fn press_enclosures(&mut self, state: &AssemblyState, moved: &[f64]) {
        if self.conditions.is_empty() {
            return;
        }
        let Self { model, facets, forces, stiffness, followers, conditions, .. } = self;
        let resisting = |at: usize| forces.resisting(at, state.load_factor);
        let pressures = conditions.pressures(model, &stiffness.equations, resisting);
        let symmetric = stiffness.is_symmetric();
        let mut sums = Sums { forces, stiffness, followers: followers.as_ref() };
        for (constraint, enclosure, pressure) in pressures {
            for face in &enclosure.faces {
                let face = face.map(|at| if at == NO_NODE { at } else { constraint.nodes[at as usize] });
                let Stiffness { equations, matrix, .. } = &*sums.stiffness;
                let places = matrix.places(equations, corners(&face), 3);
                press_face(&face, &places, -pressure, state, moved, &mut sums);
            }
            for &facet in &enclosure.facets {
                let Some(surface) = &facets.surface else { break };
                let patch = surface.patch(model, state, facet);
                let mut tangent = patch.pressure_change() * -pressure;
                if symmetric {
                    symmetrise(&mut tangent);
                } else {
                    // The covariant derivative of the moments.
                    let forces = patch.pressure_forces() * pressure;
                    for first in [3, 9, 15] {
                        let moment = Vector3::new(forces[first], forces[first + 1], forces[first + 2]);
                        let mut block = tangent.fixed_view_mut::<3, 3>(first, first);
                        block -= skew(&moment) * 0.5;
                    }
                }
                let (nodes, places) = (&model.facets[facet as usize].nodes, facets.places_of(facet));
                sums.stiffness.add_block((nodes, 6), places, tangent.as_slice(), moved);
            }
        }
    }

    /// The enclosed volume of a constraint of volume at the state last evaluated. With it come the pressure
    /// that balances the resistance of its nodes, and the forces of this pressure, component by component.
    /// `None` for other constraints.
    pub(crate) fn enclosed(
        &self,
        constraint: usize,
        state: &AssemblyState,
    ) -> Option<(Enclosed, Vec<(usize, f64)>)> {
        let enclosing = &self.model.constraints[constraint];
        let Motion::Volume { enclosure, .. } = &enclosing.motion else { return None };
        let mut gradient: Vec<(usize, f64)> = Vec::new();
        let surface = self.facets.surface.as_ref();
        let volume =
            add_gradient(&self.model, surface, enclosing, enclosure, state, &mut |component, value| {
                if self.stiffness.equations.number[component] != NONE {
                    gradient.push((component, value));
                }
            });
        // Entries of one component together.
        gradient.sort_by_key(|&(component, _)| component);
        gradient.dedup_by(|next, kept| {
            let same = next.0 == kept.0;
            kept.1 += if same { next.1 } else { 0.0 };
            same
        });
        let along = |&(at, g): &(usize, f64)| g * (self.forces.internal[at] - self.forces.external[at]);
        let squared: f64 = gradient.iter().map(|(_, g)| g * g).sum();
        let pressure = gradient.iter().map(along).sum::<f64>() / squared;
        gradient.iter_mut().for_each(|(_, g)| *g *= pressure);
        Some((Enclosed { volume, pressure }, gradient))
    }
}
