//! The matrix: its pattern, what is added to it, and its solution.

use super::System;
use super::pressures::corners;
use super::pressures::pressing;
use crate::model::assembly::Assembly;
use crate::model::error::SolveError;
use crate::solid::Stars;
use pliant_linear::sparse::{Cell, LowerMatrix, NONE};
use pliant_linear::{Factors, LinearError, LinearReport, LinearSolver, Workspace, ZERO_PIVOT};
use pliant_mechanics::load::{Face, Load};
use pliant_mechanics::model::Solid;
use pliant_shells::Facet;
use std::sync::Arc;
use std::time::Instant;

impl System {
    /// Nodes of a cell, those that follow others replaced by these, and how many components each has.
    pub(super) fn expanded(&self, nodes: &[u32], turns: bool) -> (Vec<u32>, usize) {
        let expanded = self.followers.as_ref().and_then(|followers| followers.expanded(nodes, turns));
        expanded.unwrap_or_else(|| (nodes.to_vec(), if turns { 6 } else { 3 }))
    }

    /// The pattern of the matrix, with the pairs of nodes that contacts couple.
    pub(super) fn pattern(&self) -> LowerMatrix {
        let model = &self.model;
        let facets = model.facets.iter().map(|facet| &facet.nodes[..]);
        let stars = self.stars.iter().flatten().flat_map(|stars| stars.nodes.iter().map(Vec::as_slice));
        let pairs = self.touching.as_ref().map_or(&[][..], |touching| touching.pairs());
        // Contacts on curved surfaces couple rotations, too.
        let is_curved = self.touching.as_ref().is_some_and(|touching| touching.is_curved());
        let (pairs, turning) = if is_curved { (&[][..], pairs) } else { (pairs, &[][..]) };
        let turning = turning.iter().map(|pair| &pair[..]);
        let Some(followers) = &self.followers else {
            let cells = facets.chain(model.solid_cells()).chain(stars).chain(turning);
            return LowerMatrix::new(&self.equations, cells, pairs);
        };
        let solids = model.solid_cells().chain(stars).map(|nodes| self.expanded(nodes, false));
        let turns = followers.turning_nodes().map(|nodes| self.expanded(&nodes, false));
        let shells = facets.map(|nodes| self.expanded(nodes, true));
        let expanded: Vec<(Vec<u32>, usize)> = shells.chain(solids).chain(turns).collect();
        let cells = expanded.iter().map(|(nodes, _)| nodes.as_slice()).chain(turning);
        LowerMatrix::new(&self.equations, cells, pairs)
    }

    /// Finds the pattern of the matrix and the places of cells in it.
    pub(super) fn find_pattern(&mut self) -> Result<(), SolveError> {
        let mut matrix = self.pattern();
        if self.solver == LinearSolver::Unsymmetric {
            matrix.keep_mirror();
        }
        let system = self;
        let model = Arc::clone(&system.model);
        let placed = |nodes: &[u32], turns: bool| {
            let (nodes, components) = system.expanded(nodes, turns);
            matrix.places(&system.equations, &nodes, components)
        };
        let of_facets = model.facets.iter().map(|facet| placed(&facet.nodes, true)).collect();
        let is_bound = |facet: &Facet| {
            system
                .followers
                .as_ref()
                .is_some_and(|followers| followers.expanded(&facet.nodes, true).is_some())
        };
        let bound = model.facets.iter().map(is_bound).collect();
        let places = |nodes: &[u32]| placed(nodes, false);
        let of_solid = |(solid, stars): (&Solid, &Option<Stars>)| {
            let cells = (0..solid.cells.len()).map(|cell| places(solid.cells.nodes(cell)));
            let stars = stars.iter().flat_map(|stars| &stars.nodes).map(|nodes| places(nodes));
            [cells.collect(), stars.collect()]
        };
        let of_load = |(_, faces, _): (&Load, &Vec<Face>, f64)| {
            faces.iter().map(|face| places(corners(face))).collect()
        };
        let of_faces = pressing(&model).map(of_load).collect();
        let of_solids = model.solids.iter().zip(&system.stars).map(of_solid).collect();
        (system.places, system.bound) = (of_facets, bound);
        (system.face_places, system.solid_places) = (of_faces, of_solids);
        let (device, before) = (system.device.as_ref(), system.workspace.as_mut());
        let workspace = Workspace::new(system.solver, device, &system.equations, &matrix, before);
        system.workspace = Some(workspace.map_err(linear_error)?);
        system.matrix = matrix;
        Ok(())
    }

    /// Makes room in the pattern for the contacts that act or soon may.
    pub(crate) fn make_room(&mut self) -> Result<(), SolveError> {
        let Some(touching) = &mut self.touching else { return Ok(()) };
        if !touching.grow(&self.equations, &self.matrix, self.followers.as_ref()) {
            return Ok(());
        }
        self.set_pattern()
    }

    /// Values of the older matrix whose factors precondition the next one, if there is one.
    pub(crate) fn factored(&self) -> Option<&[f64]> {
        self.workspace.as_ref()?.factored()
    }

    /// Takes the factors of a matrix with these values as preconditioner of the next one.
    pub(crate) fn precondition_with(&mut self, values: Vec<f64>) {
        if let Some(workspace) = &mut self.workspace {
            workspace.precondition_with(values, &mut self.matrix);
        }
    }

    /// Takes a pattern with these pairs of nodes for contacts.
    pub(crate) fn take_pairs(&mut self, pairs: Vec<[u32; 2]>) -> Result<(), SolveError> {
        match &mut self.touching {
            Some(touching) if touching.pairs != pairs => touching.pairs = pairs,
            _ => return Ok(()),
        }
        self.set_pattern()
    }

    /// Takes a pattern with the pairs of nodes that contacts have.
    pub(super) fn set_pattern(&mut self) -> Result<(), SolveError> {
        let older = std::mem::take(&mut self.matrix);
        self.find_pattern()?;
        if !self.damper.is_empty() {
            self.damper = self.matrix.carried(&older, &self.damper);
        }
        Ok(())
    }

    /// Adds a stiffness of translations; its place is that of a solid, of its cells (0) or stars (1), by number.
    pub(super) fn add_stiffness(
        &mut self,
        nodes: &[u32],
        [solid, kind, at]: [usize; 3],
        tangent: &[f64],
        moved: &[f64],
    ) {
        let places = std::mem::take(&mut self.solid_places[solid][kind][at]);
        self.add_at(nodes, &places, tangent, moved);
        self.solid_places[solid][kind][at] = places;
    }

    /// Adds a stiffness of translations at its places.
    pub(super) fn add_at(&mut self, nodes: &[u32], places: &[u32], tangent: &[f64], moved: &[f64]) {
        let expanded = self.followers.as_ref().and_then(|followers| followers.expanded(nodes, false));
        match (expanded, &self.followers) {
            (Some(own), Some(followers)) => {
                let whole = followers.condensed(nodes, 3, &own, tangent);
                self.add_block(&own.0, own.1, places, &whole, moved);
            }
            _ => self.add_block(nodes, 3, places, tangent, moved),
        }
    }

    /// Adds a stiffness of the first components of nodes at its places, and what prescribed increments make of it.
    pub(super) fn add_block(
        &mut self,
        nodes: &[u32],
        components: usize,
        places: &[u32],
        tangent: &[f64],
        moved: &[f64],
    ) {
        self.matrix.add(&self.equations, &Cell { nodes, components, places, entries: tangent });
        let component = |i: usize| 6 * nodes[i / components] as usize + i % components;
        let size = components * nodes.len();
        for (column, entries) in tangent.chunks_exact(size).enumerate() {
            let by = moved[component(column)];
            if by == 0.0 {
                continue;
            }
            for (row, entry) in entries.iter().enumerate() {
                let equation = self.equations.number[component(row)];
                if equation != NONE {
                    self.coupling[equation as usize] += entry * by;
                }
            }
        }
    }

    /// Takes the matrix as it now is for the coming solutions; returns its negative pivots.
    pub(crate) fn prepare(&mut self) -> Result<usize, SolveError> {
        if self.stop.is_asked() {
            return Err(SolveError::Stopped);
        }
        let start = Instant::now();
        self.conditions.pin(&mut self.matrix);
        let Some(workspace) = &mut self.workspace else { return Ok(0) };
        let pivots = workspace.prepare(&self.matrix).map_err(linear_error)?;
        self.phases.preparation += start.elapsed();
        if pivots.smallest < ZERO_PIVOT {
            let component = self.equations.component[pivots.weakest] as usize;
            const NAMES: [&str; 6] =
                ["x", "y", "z", "rotation about x", "rotation about y", "rotation about z"];
            return Err(SolveError::Singular {
                node: (component / 6) as u32,
                component: NAMES[component % 6],
                pivot: pivots.smallest,
            });
        }
        if self.conditions.has_rows() {
            let mut conditions = std::mem::take(&mut self.conditions);
            let prepared = conditions.prepare(|right, solution| self.solve_pinned(right, solution));
            self.conditions = conditions;
            prepared?;
        }
        Ok(pivots.negative)
    }

    /// Solves with the matrix prepared.
    pub(crate) fn solve(&mut self, right: &[f64], solution: &mut [f64]) -> Result<(), SolveError> {
        solution.fill(0.0);
        self.solve_from(right, solution)
    }

    /// The same with means and volumes that stay as they are.
    pub(crate) fn respond(&mut self, right: &[f64], solution: &mut [f64]) -> Result<(), SolveError> {
        solution.fill(0.0);
        self.solve_pinned(right, solution)?;
        self.conditions.correct(solution, false);
        Ok(())
    }

    /// Solves with the matrix prepared; conjugate gradients start from a multiple of the solution given, and leave what they reached there if
    /// iterations run out.
    pub(crate) fn solve_from(&mut self, right: &[f64], solution: &mut [f64]) -> Result<(), SolveError> {
        let result = self.solve_pinned(right, solution);
        self.conditions.correct(solution, true);
        result
    }

    /// Solves with the matrix as it is, with the springs that hold means and volumes.
    pub(super) fn solve_pinned(&mut self, right: &[f64], solution: &mut [f64]) -> Result<(), SolveError> {
        let start = Instant::now();
        let Some(workspace) = &mut self.workspace else { return Ok(()) };
        let result = workspace.solve(&self.matrix, right, solution);
        if let Ok(report) | Err(LinearError::Stalled(report)) = &result {
            self.last_solution = *report;
        }
        (self.phases.device, self.phases.left_to_cpu) = workspace.of_device();
        self.phases.solution += start.elapsed();
        self.phases.solutions += 1;
        self.phases.iterations += self.last_solution.iterations;
        result.map(|_| ()).map_err(linear_error)
    }
}

/// Bytes that the factors of a model's equations take, without what contacts couple: found by the order of elimination, without numbers.
///
/// # Errors
/// If there are more equations than can be numbered, or the order has no room.
pub fn bytes_of_factors(model: &Arc<Assembly>) -> Result<u64, SolveError> {
    let matrix = System::forces_only(Arc::clone(model)).pattern();
    Factors::bytes(&matrix).map_err(linear_error)
}

pub(super) fn linear_error(error: LinearError) -> SolveError {
    match error {
        LinearError::TooLarge => SolveError::Impossible(
            "the equations are too many for the direct solver; use conjugate gradients",
        ),
        LinearError::OutOfMemory(needed) => SolveError::OutOfMemory(needed),
        LinearError::Device(error) => SolveError::Device(error),
        LinearError::NotFinite => SolveError::Impossible("the stiffness is not finite; use smaller steps"),
        LinearError::Indefinite(iterations) => SolveError::Indefinite { iterations },
        LinearError::Stalled(LinearReport { iterations, residual }) => {
            SolveError::Stalled { iterations, residual }
        }
    }
}
