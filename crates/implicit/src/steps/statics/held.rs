//! Check that every part of a model is held, made before the first step: a free part has no state at rest.

use nalgebra::{Matrix6, RowVector6, SymmetricEigen, Vector3};
use pliant_geometry::DisjointSets;
use pliant_mechanics::model::Motion;
use pliant_mechanics::tie::Tie;

use crate::model::assembly::Assembly;
use crate::model::error::SolveError;

/// Checks that every part of a model is held. None of its six rigid motions may leave constraints and springs
/// unmoved.
///
/// # Errors
/// If a part is free: one of its nodes, and the number of rigid motions in which it is free.
pub fn check_held(model: &Assembly) -> Result<(), SolveError> {
    let (mut part, used) = parts(model);
    let turning = model.turning();
    let mut held = Holding::new(model, &mut part);
    held.add_constraints(&turning);
    held.add_loosely_turned();
    let held = held.sums;
    // Of bars along a line the turn about it moves nothing: it needs no holding.
    let mut moved = Holding::new(model, &mut part);
    for node in (0..used.len()).filter(|&node| used[node]) {
        moved.add_node(node, 0..if turning[node] { 6 } else { 3 });
    }
    let moved = moved.sums;
    for node in 0..used.len() {
        if used[node] && part.root(node) == node {
            let free_modes = free_modes(held[node], moved[node]);
            if free_modes > 0 {
                return Err(SolveError::FreeBody { node: node as u32, free_modes });
            }
        }
    }
    Ok(())
}

/// The parts of a model that hang together, and which of its nodes cells have.
fn parts(model: &Assembly) -> (DisjointSets, Vec<bool>) {
    let nodes = model.rest.len();
    let mut part = DisjointSets::new(nodes);
    let mut used = vec![false; nodes];
    let facets = model.facets.iter().map(|facet| &facet.nodes[..]);
    for nodes in facets.chain(model.solid_cells()) {
        for &node in nodes {
            used[node as usize] = true;
            part.join(nodes[0] as usize, node as usize);
        }
    }
    for constraint in model.constraints.iter().filter(|constraint| matches!(constraint.motion, Motion::Rigid))
    {
        for &node in &constraint.nodes {
            part.join(constraint.nodes[0] as usize, node as usize);
        }
    }
    for (node, row) in model.ties.iter().flat_map(Tie::rows) {
        for (followed, _) in row {
            part.join(node as usize, followed as usize);
        }
    }
    (part, used)
}

/// Per part, at its root: Σ of the squares of what its rigid motions (about the root, in mean edges) do to
/// what holds it.
struct Holding<'a> {
    model: &'a Assembly,
    part: &'a mut DisjointSets,
    /// A mean edge [m].
    length: f64,
    sums: Vec<Matrix6<f64>>,
}

impl<'a> Holding<'a> {
    fn new(model: &'a Assembly, part: &'a mut DisjointSets) -> Self {
        Self { model, part, length: model.mean_edge(), sums: vec![Matrix6::zeros(); model.rest.len()] }
    }

    /// Row of the motions of a node's component under the six rigid motions about the node `first`.
    fn row_of(&self, node: usize, component: usize, first: usize) -> RowVector6<f64> {
        let arm = (self.model.place(node) - self.model.place(first)) / self.length;
        if component < 3 {
            let along = Vector3::ith(component, 1.0);
            let turning = arm.cross(&along);
            RowVector6::new(along.x, along.y, along.z, turning.x, turning.y, turning.z)
        } else {
            RowVector6::from_fn(|_, c| f64::from(u8::from(c == component)))
        }
    }

    /// A node is held in these components.
    fn add_node(&mut self, node: usize, components: impl IntoIterator<Item = usize>) {
        let first = self.part.root(node);
        for component in components {
            let row = self.row_of(node, component, first);
            self.sums[first] += row.transpose() * row;
        }
    }

    /// Constraints and springs hold.
    fn add_constraints(&mut self, turning: &[bool]) {
        let model = self.model;
        // The mean of a face holds what its nodes together do.
        for constraint in &model.constraints {
            let Motion::Mean { weights, .. } = &constraint.motion else { continue };
            let first = self.part.root(constraint.nodes[0] as usize);
            for component in (0..3).filter(|&c| constraint.components[c]) {
                let rows = constraint.nodes.iter().map(|&node| self.row_of(node as usize, component, first));
                let row = rows.zip(weights).fold(RowVector6::zeros(), |sum, (row, w)| sum + row * *w);
                self.sums[first] += row.transpose() * row;
            }
        }
        for constraint in model.constraints.iter().filter(|constraint| !constraint.motion.is_collective()) {
            for &node in &constraint.nodes {
                let components = if turning[node as usize] { 6 } else { 3 };
                self.add_node(node as usize, (0..components).filter(|&c| constraint.components[c]));
            }
        }
        for spring in &model.springs {
            self.add_node(spring.node as usize, 0..3);
        }
    }

    /// A membrane may hang from a line and be turned by its loads: its nodes count as if they could not turn.
    fn add_loosely_turned(&mut self) {
        let model = self.model;
        for &node in model.facets.iter().filter(|facet| !facet.turns()).flat_map(|facet| &facet.nodes) {
            self.add_node(node as usize, 3..6);
        }
    }
}

/// Number of rigid motions of a part that move something and are held by nothing.
fn free_modes(mut held: Matrix6<f64>, moved: Matrix6<f64>) -> usize {
    let SymmetricEigen { eigenvalues, eigenvectors } = SymmetricEigen::new(moved);
    let limit = 1e-10 * eigenvalues.max().max(1.0);
    for (value, motion) in eigenvalues.iter().zip(eigenvectors.column_iter()) {
        if *value < limit {
            held += motion * motion.transpose();
        }
    }
    let values = SymmetricEigen::new(held).eigenvalues;
    let limit = 1e-10 * values.max().max(1.0);
    values.iter().filter(|&&value| value < limit).count()
}
