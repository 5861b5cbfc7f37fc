//! Forces and stiffness of the cells of solids, and of pressures on their faces.

use pliant_mechanics::load::{Face, Load, LoadKind, NO_NODE, face_areas};
use pliant_mechanics::model::Solid;
use rayon::prelude::*;

use super::{CHUNK, Sums};
use crate::model::assembly::Assembly;
use crate::model::error::SolveError;
use crate::model::state::AssemblyState;
use crate::solid::relaxation::Relaxation;
use crate::solid::{Response, Stars};

/// Data of cells of solids besides the model.
pub(super) struct Solids {
    /// Places in the matrix of the cells of each solid, and of its stars.
    places: Vec<[Vec<Vec<u32>>; 2]>,
    /// Places in the matrix of the faces of each load that presses on solids.
    face_places: Vec<Vec<Vec<u32>>>,
    /// The averages of each solid that has some.
    stars: Vec<Option<Stars>>,
    /// Relaxation of stresses in the step or at the instant.
    pub(super) relaxation: Relaxation,
    /// Responses of a chunk of cells.
    results: Vec<Response>,
}

impl Solids {
    pub(super) fn new(model: &Assembly) -> Self {
        Self {
            places: Vec::new(),
            face_places: Vec::new(),
            stars: model.solids.iter().map(Stars::of).collect(),
            relaxation: Relaxation::of(model),
            results: vec![Response::none(); CHUNK],
        }
    }

    /// The nodes of all stars, one after the other.
    pub(super) fn stars(&self) -> impl Iterator<Item = &[u32]> {
        self.stars.iter().flatten().flat_map(|stars| stars.nodes.iter().map(Vec::as_slice))
    }

    /// Takes the places of cells, of stars and of faces that are pressed.
    pub(super) fn take_places(&mut self, model: &Assembly, places: impl Fn(&[u32]) -> Vec<u32>) {
        let of_solid = |(solid, stars): (&Solid, &Option<Stars>)| {
            let cells = (0..solid.cells.len()).map(|cell| places(solid.cells.nodes(cell)));
            let stars = stars.iter().flat_map(|stars| &stars.nodes).map(|nodes| places(nodes));
            [cells.collect(), stars.collect()]
        };
        let of_load = |(_, faces, _): (&Load, &Vec<Face>, f64)| {
            faces.iter().map(|face| places(corners(face))).collect()
        };
        self.face_places = pressing(model).map(of_load).collect();
        self.places = model.solids.iter().zip(&self.stars).map(of_solid).collect();
    }

    /// Adds forces and, with prescribed increments, the stiffness of all cells.
    pub(super) fn add(
        &mut self,
        model: &Assembly,
        state: &AssemblyState,
        moved: Option<&[f64]>,
        sums: &mut Sums<'_>,
    ) -> Result<(), SolveError> {
        sums.forces.energy += self.relaxation.work(&state.history);
        let mut first_cell = model.facets.len();
        for (index, solid) in model.solids.iter().enumerate() {
            self.add_solid(model, (index, solid), state, moved, sums).map_err(|broken| match broken {
                SolveError::Broken { cell, why } => SolveError::Broken { cell: first_cell + cell, why },
                other => other,
            })?;
            first_cell += solid.cells.len();
        }
        Ok(())
    }

    /// Adds the forces of one solid, and its stiffness if wanted. The number of a broken cell counts from the
    /// first cell of the solid.
    fn add_solid(
        &mut self,
        model: &Assembly,
        (index, solid): (usize, &Solid),
        state: &AssemblyState,
        moved: Option<&[f64]>,
        sums: &mut Sums<'_>,
    ) -> Result<(), SolveError> {
        let displacement = |node: u32| model.displacement(&state.position, node);
        let Self { places, stars, relaxation, results, .. } = self;
        let (stars, count) = (&mut stars[index], solid.cells.len());
        if let Some(stars) = stars {
            sums.forces.energy += stars.find(solid, displacement);
        }
        for first in (0..count).step_by(CHUNK) {
            let last = (first + CHUNK).min(count);
            results[..last - first].par_iter_mut().with_min_len(16).enumerate().for_each(|(at, result)| {
                let pressure = stars.as_ref().map(|stars| stars.pressure(first + at));
                let lag = relaxation.of_cell(index, solid, first + at);
                result.fill(solid, first + at, pressure, lag, displacement, moved.is_some());
            });
            let broken = (first..last).zip(&*results).find_map(|(cell, result)| Some((cell, result.broken?)));
            if let Some((cell, why)) = broken {
                return Err(SolveError::Broken { cell, why });
            }
            for (cell, result) in (first..last).zip(&*results) {
                let nodes = solid.cells.nodes(cell);
                sums.forces.energy += result.energy;
                sums.forces.hourglass += result.hourglass;
                sums.forces.add_cell(nodes, &result.force);
                if let Some(moved) = moved {
                    sums.add_stiffness(nodes, &places[index][0][cell], &result.tangent, moved);
                }
            }
        }
        if let (Some(stars), Some(moved)) = (stars, moved) {
            for (star, nodes) in stars.nodes.iter().enumerate() {
                let tangent = &mut results[0].tangent;
                stars.stiffness(star, solid, displacement, tangent);
                sums.add_stiffness(nodes, &places[index][1][star], tangent, moved);
            }
        }
        Ok(())
    }

    /// Adds the change of pressures on faces with their nodes. Without both halves of the matrix it adds the
    /// symmetric part, which is the whole where faces close or end at held nodes.
    pub(super) fn add_faces(
        &self,
        model: &Assembly,
        state: &AssemblyState,
        time: f64,
        moved: &[f64],
        sums: &mut Sums<'_>,
    ) {
        for ((load, faces, pressure), places) in pressing(model).zip(&self.face_places) {
            let factor = if load.controlled { state.load_factor } else { 1.0 } * load.curve.value(time);
            for (face, places) in faces.iter().zip(places) {
                press_face(face, places, factor * pressure, state, moved, sums);
            }
        }
    }
}

/// Adds how the pressure on one face changes with its nodes, at its places.
pub(super) fn press_face(
    face: &Face,
    places: &[u32],
    pressure: f64,
    state: &AssemblyState,
    moved: &[f64],
    sums: &mut Sums<'_>,
) {
    let nodes = corners(face);
    let tangent = pressure_change(face, nodes.len(), state, pressure, sums.stiffness.is_symmetric());
    sums.add_stiffness(nodes, places, &tangent, moved);
}

/// The pressures on faces of solids. How those on carried surfaces change with the state is left out of the
/// stiffness.
fn pressing(model: &Assembly) -> impl Iterator<Item = (&Load, &Vec<Face>, f64)> {
    model.loads.iter().filter_map(|load| match &load.kind {
        LoadKind::Pressure { faces, pressure } if load.surface.is_none() => Some((load, faces, *pressure)),
        _ => None,
    })
}

/// The nodes of a face of a solid.
pub(super) fn corners(face: &Face) -> &[u32] {
    if face[3] == NO_NODE { &face[..3] } else { face }
}

/// The derivative of p ∫ N_a n dA of a face by the positions of its nodes, column by column. The pressure
/// acts against the outward normal. If wanted, only its symmetric part. The derivative is made by
/// differences, which are exact: the areas are of second order in each position.
fn pressure_change(
    face: &Face,
    count: usize,
    state: &AssemblyState,
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
