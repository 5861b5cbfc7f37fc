//! The pattern of the equations, and their solution.

use std::sync::Arc;
use std::time::Instant;

use pliant_linear::sparse::LowerMatrix;
use pliant_linear::{Factors, LinearSolver};

use super::System;
use super::followers::Followers;
use super::stiffness::linear_error;
use crate::model::assembly::Assembly;
use crate::model::error::SolveError;

/// Nodes of a cell, with nodes that follow others replaced by the nodes they follow, and the number of
/// components of each.
fn expanded(followers: Option<&Followers>, nodes: &[u32], turns: bool) -> (Vec<u32>, usize) {
    let expanded = followers.and_then(|followers| followers.expanded(nodes, turns));
    expanded.unwrap_or_else(|| (nodes.to_vec(), if turns { 6 } else { 3 }))
}

impl System {
    /// The pattern of the matrix, with the pairs of nodes that contacts couple.
    fn pattern(&self) -> LowerMatrix {
        let (model, equations) = (&self.model, &self.stiffness.equations);
        let facets = model.facets.iter().map(|facet| &facet.nodes[..]);
        let stars = self.solids.stars();
        let pairs = self.contact.as_ref().map_or(&[][..], |contact| contact.pairs());
        // Contacts on curved surfaces couple rotations, too.
        let is_curved = self.contact.as_ref().is_some_and(|contact| contact.is_curved());
        let (pairs, turning) = if is_curved { (&[][..], pairs) } else { (pairs, &[][..]) };
        let turning = turning.iter().map(|pair| &pair[..]);
        let Some(followers) = &self.followers else {
            let cells = facets.chain(model.solid_cells()).chain(stars).chain(turning);
            return LowerMatrix::new(equations, cells, pairs);
        };
        let expanded = |nodes: &[u32], turns: bool| expanded(Some(followers), nodes, turns);
        let solids = model.solid_cells().chain(stars).map(|nodes| expanded(nodes, false));
        let turns = followers.turning_nodes().map(|nodes| expanded(&nodes, false));
        let shells = facets.map(|nodes| expanded(nodes, true));
        let expanded: Vec<(Vec<u32>, usize)> = shells.chain(solids).chain(turns).collect();
        let cells = expanded.iter().map(|(nodes, _)| nodes.as_slice()).chain(turning);
        LowerMatrix::new(equations, cells, pairs)
    }

    /// Finds the pattern of the matrix and the places of cells in it.
    pub(super) fn find_pattern(&mut self) -> Result<(), SolveError> {
        let mut matrix = self.pattern();
        if self.stiffness.solver == LinearSolver::Unsymmetric {
            matrix.keep_mirror();
        }
        let Self { model, facets, solids, stiffness, followers, .. } = self;
        let placed = |nodes: &[u32], turns: bool| {
            let (nodes, components) = expanded(followers.as_ref(), nodes, turns);
            matrix.places(&stiffness.equations, &nodes, components)
        };
        facets.take_places(model, followers.as_ref(), |nodes| placed(nodes, true));
        solids.take_places(model, |nodes| placed(nodes, false));
        stiffness.take_pattern(matrix)
    }

    /// Makes room in the pattern for the contacts that act or soon may.
    pub(crate) fn make_room(&mut self) -> Result<(), SolveError> {
        let Some(contact) = &mut self.contact else { return Ok(()) };
        if !contact.grow(&self.stiffness.equations, &self.stiffness.matrix, self.followers.as_ref()) {
            return Ok(());
        }
        self.find_pattern()
    }

    /// Takes a pattern with these pairs of nodes for contacts.
    pub(crate) fn take_pairs(&mut self, pairs: Vec<[u32; 2]>) -> Result<(), SolveError> {
        match &mut self.contact {
            Some(contact) if contact.pairs != pairs => contact.pairs = pairs,
            _ => return Ok(()),
        }
        self.find_pattern()
    }

    /// Takes the matrix as it now is for the coming solutions; returns its negative pivots.
    pub(crate) fn prepare(&mut self) -> Result<usize, SolveError> {
        if self.stop.is_asked() {
            return Err(SolveError::Stopped);
        }
        let Self { conditions, stiffness, phases, .. } = self;
        let start = Instant::now();
        conditions.pin(&mut stiffness.matrix);
        let negative = stiffness.prepare()?;
        phases.preparation += start.elapsed();
        if conditions.has_rows() {
            conditions.prepare(|right, solution| stiffness.solve(phases, right, solution))?;
        }
        Ok(negative)
    }

    /// Solves with the matrix prepared.
    pub(crate) fn solve(&mut self, right: &[f64], solution: &mut [f64]) -> Result<(), SolveError> {
        solution.fill(0.0);
        self.solve_from(right, solution)
    }

    /// Solves with the matrix prepared, while means and volumes keep their values.
    pub(crate) fn respond(&mut self, right: &[f64], solution: &mut [f64]) -> Result<(), SolveError> {
        solution.fill(0.0);
        self.stiffness.solve(&mut self.phases, right, solution)?;
        self.conditions.correct(solution, false);
        Ok(())
    }

    /// Solves with the matrix prepared; conjugate gradients start from a multiple of the solution given, and
    /// leave what they reached there if iterations run out.
    pub(crate) fn solve_from(&mut self, right: &[f64], solution: &mut [f64]) -> Result<(), SolveError> {
        let result = self.stiffness.solve(&mut self.phases, right, solution);
        self.conditions.correct(solution, true);
        result
    }
}

/// Bytes that the factors of a model's equations take, without what contacts couple: found by the order of
/// elimination, without numbers.
///
/// # Errors
/// If there are more equations than can be numbered, or the order has no room.
pub fn bytes_of_factors(model: &Arc<Assembly>) -> Result<u64, SolveError> {
    let matrix = System::forces_only(Arc::clone(model)).pattern();
    Factors::bytes(&matrix).map_err(linear_error)
}
