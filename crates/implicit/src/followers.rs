//! Nodes whose translations are no unknowns of a system of equations, since others move them: tied nodes, and the nodes of rigid parts,
//! which go with six unknowns at the first of them. A cell at such nodes becomes a cell at the nodes that they follow, K ← Tᵀ K T; its
//! forces go there by Tᵀ. Other rotations stay with the node itself.
//!
//! In an increment a node goes by Σ w (d + θ × a): d and θ those of the nodes that it follows, a the arm from a first node of a rigid part,
//! 0 for a tie. Then it stands at x = X + Σ (w u + (R − 1) A), exactly. The second derivative of x by θ, exp(θ) a ≈ a + θ × a + θ × (θ × a)/2,
//! adds (f aᵀ + a fᵀ)/2 − (f·a) to the stiffness of θ, with f what cells resist with less what loads pull with.

use nalgebra::{Matrix3, Matrix3x6, Matrix6, SymmetricEigen, Vector3};
use pliant_mechanics::model::Motion;
use pliant_mechanics::tie::Tie;

use crate::Assembly;
use crate::rotation::skew;
use crate::sparse::{Equations, LowerMatrix, NONE};
use crate::state::State;

/// The nodes of a model that follow others.
pub(crate) struct Followers {
    /// The row of each node; [`NONE`] of the others.
    row_of: Vec<u32>,
    /// Each node with those that it follows.
    rows: Vec<(u32, Vec<Followed>)>,
    parts: Vec<RigidPart>,
}

/// A node that is followed.
#[derive(Clone, Copy)]
struct Followed {
    node: u32,
    weight: f64,
    /// The rigid part that it moves, and the arm [m] at rest and now; none for a tie.
    part: Option<usize>,
    rest: Vector3<f64>,
    arm: Vector3<f64>,
}

/// Nodes that move as one body.
struct RigidPart {
    /// The node whose unknowns are those of the part.
    first: u32,
    /// Axes about which a turn moves no node, that of nodes on a line: at rest and now.
    idle_at_rest: Vec<Vector3<f64>>,
    idle: Vec<Vector3<f64>>,
    /// Mean edge of the model [m].
    size: f64,
}

impl RigidPart {
    fn of(model: &Assembly, nodes: &[u32]) -> Self {
        let arms = nodes.iter().map(|&node| model.place(node as usize) - model.place(nodes[0] as usize));
        let inertia = arms.fold(Matrix3::zeros(), |sum, arm| {
            sum + Matrix3::from_diagonal_element(arm.norm_squared()) - arm * arm.transpose()
        });
        let SymmetricEigen { eigenvalues, eigenvectors } = SymmetricEigen::new(inertia);
        let limit = 1e-12 * eigenvalues.max();
        let axes = eigenvalues.iter().zip(eigenvectors.column_iter());
        let idle: Vec<_> =
            axes.filter(|(value, _)| **value <= limit).map(|(_, axis)| axis.into_owned()).collect();
        Self { first: nodes[0], idle_at_rest: idle.clone(), idle, size: model.mean_edge() }
    }
}

impl Followers {
    /// Those of ties alone, or with those of rigid parts; `None` if there are none.
    pub(crate) fn of(model: &Assembly, rigid: bool) -> Option<Self> {
        let mut parts = Vec::new();
        let mut part_of = vec![None; model.rest.len()];
        let mut rows: Vec<(u32, Vec<Followed>)> = Vec::new();
        let bound = model.constraints.iter().filter(|own| rigid && matches!(own.motion, Motion::Rigid));
        for constraint in bound {
            let part = parts.len();
            parts.push(RigidPart::of(model, &constraint.nodes));
            constraint.nodes.iter().for_each(|&node| part_of[node as usize] = Some(part));
        }
        let followed = |node: u32, weight: f64| match part_of[node as usize] {
            None => Followed { node, weight, part: None, rest: Vector3::zeros(), arm: Vector3::zeros() },
            Some(part) => {
                let RigidPart { first, .. } = parts[part];
                let rest = weight * (model.place(node as usize) - model.place(first as usize));
                Followed { node: first, weight, part: Some(part), rest, arm: rest }
            }
        };
        for (node, row) in model.ties.iter().flat_map(Tie::rows) {
            let mut own: Vec<Followed> = Vec::new();
            for next in row.map(|(node, weight)| followed(node, weight)) {
                match own.iter_mut().find(|known| known.part.is_some() && known.node == next.node) {
                    Some(known) => {
                        known.weight += next.weight;
                        known.rest += next.rest;
                        known.arm += next.arm;
                    }
                    None => own.push(next),
                }
            }
            rows.push((node, own));
        }
        for node in (0..model.rest.len() as u32)
            .filter(|&node| part_of[node as usize].is_some_and(|part: usize| parts[part].first != node))
        {
            rows.push((node, vec![followed(node, 1.0)]));
        }
        let mut row_of = vec![NONE; model.rest.len()];
        for ((node, _), number) in rows.iter().zip(0..) {
            row_of[*node as usize] = number;
        }
        (!rows.is_empty()).then_some(Self { row_of, rows, parts })
    }

    pub(crate) fn follows(&self, node: u32) -> bool {
        self.row_of[node as usize] != NONE
    }

    /// What a node follows; nothing, if it follows no other.
    fn followed(&self, node: u32) -> &[Followed] {
        match self.row_of[node as usize] {
            NONE => &[],
            row => &self.rows[row as usize].1,
        }
    }

    /// The nodes whose unknowns move a cell, and how many components of each; `None` if they are its own. Where nodes turn they keep their
    /// place for that.
    pub(crate) fn expanded(&self, nodes: &[u32], turns: bool) -> Option<(Vec<u32>, usize)> {
        let first = |node: &u32| self.parts.iter().any(|part| part.first == *node);
        if !nodes.iter().any(|node| self.follows(*node) || first(node)) {
            return None;
        }
        let mut all: Vec<u32> = nodes.iter().copied().filter(|&node| turns || !self.follows(node)).collect();
        for followed in nodes.iter().flat_map(|&node| self.followed(node)) {
            if !all.contains(&followed.node) {
                all.push(followed.node);
            }
        }
        let turns = turns || all.iter().any(first);
        Some((all, if turns { 6 } else { 3 }))
    }

    /// Tᵀ K T of a cell of so many components a node, on its [`expanded`](Self::expanded) nodes, column by column.
    pub(crate) fn condensed(
        &self,
        nodes: &[u32],
        components: usize,
        (expanded, wide): &(Vec<u32>, usize),
        tangent: &[f64],
    ) -> Vec<f64> {
        let place = |node: u32| wide * expanded.iter().position(|&known| known == node).unwrap_or(0);
        // Of each component the unknowns that move it.
        let moves = |i: usize| -> Vec<(usize, f64)> {
            let (node, c) = (nodes[i / components], i % components);
            let followed = self.followed(node);
            if c >= 3 || followed.is_empty() {
                return vec![(place(node) + c, 1.0)];
            }
            let mut all = Vec::with_capacity(followed.len());
            for Followed { node, weight, part, arm, .. } in followed {
                let at = place(*node);
                all.push((at + c, *weight));
                if part.is_some() {
                    let [next, last] = [(c + 1) % 3, (c + 2) % 3];
                    all.extend([(at + 3 + next, arm[last]), (at + 3 + last, -arm[next])]);
                }
            }
            all
        };
        let all: Vec<_> = (0..components * nodes.len()).map(moves).collect();
        let size = wide * expanded.len();
        let mut whole = vec![0.0; size * size];
        for (column, entries) in all.iter().zip(tangent.chunks_exact(all.len())) {
            for &(q, wq) in column {
                for (row, entry) in all.iter().zip(entries) {
                    for &(p, wp) in row {
                        whole[q * size + p] += wq * wp * entry;
                    }
                }
            }
        }
        whole
    }

    /// Takes translations along with an increment, six components a node.
    pub(crate) fn follow(&self, components: &mut [f64]) {
        for (node, row) in &self.rows {
            let along = |c: usize| {
                let of = |followed: &Followed| {
                    let Followed { node, weight, part, arm, .. } = followed;
                    let own = &components[6 * *node as usize..];
                    let [next, last] = [(c + 1) % 3, (c + 2) % 3];
                    let turned = if part.is_some() {
                        own[3 + next] * arm[last] - own[3 + last] * arm[next]
                    } else {
                        0.0
                    };
                    weight * own[c] + turned
                };
                row.iter().map(of).sum::<f64>()
            };
            let along = [0, 1, 2].map(along);
            components[6 * *node as usize..][..3].copy_from_slice(&along);
        }
    }

    /// Gives forces to the nodes that are followed, six components a node.
    pub(crate) fn give_back(&self, components: &mut [f64]) {
        for (node, row) in &self.rows {
            let own = &mut components[6 * *node as usize..][..3];
            let force = Vector3::from_column_slice(own);
            own.fill(0.0);
            row.iter().for_each(|followed| {
                followed.pull(&force, |c, f| components[6 * followed.node as usize + c] += f)
            });
        }
    }

    /// Puts the nodes that go with rigid parts where these are.
    pub(crate) fn place(&self, model: &Assembly, state: &mut State) {
        let moved = |followed: &Followed| {
            let node = followed.node as usize;
            followed.weight * (state.position[node] - model.place(node))
                + (state.rotation[node] * followed.rest - followed.rest)
        };
        let bound = self.rows.iter().filter(|(_, row)| row.iter().any(|followed| followed.part.is_some()));
        let places: Vec<_> = bound
            .map(|(node, row)| {
                (*node, row.iter().fold(model.place(*node as usize), |sum, own| sum + moved(own)))
            })
            .collect();
        places.into_iter().for_each(|(node, place)| state.position[node as usize] = place);
    }

    /// Takes the arms at a state.
    pub(crate) fn turn(&mut self, state: &State) {
        for followed in
            self.rows.iter_mut().flat_map(|(_, row)| row).filter(|followed| followed.part.is_some())
        {
            followed.arm = state.rotation[followed.node as usize] * followed.rest;
        }
        for part in &mut self.parts {
            let turn = state.rotation[part.first as usize];
            part.idle.iter_mut().zip(&part.idle_at_rest).for_each(|(now, rest)| *now = turn * rest);
        }
    }

    /// The places of the translations of a node that may follow others, and its stiffness there, equal along all axes.
    pub(crate) fn spring(&self, node: u32, stiffness: f64) -> Option<((Vec<u32>, usize), Vec<f64>)> {
        let expanded = self.expanded(&[node], false)?;
        let own = Matrix3::from_diagonal_element(stiffness);
        let whole = self.condensed(&[node], 3, &expanded, own.as_slice());
        Some((expanded, whole))
    }

    /// What forces [N] on the nodes of rigid parts are at the unknowns of these, component by component.
    pub(crate) fn pull_parts(&self, force: impl Fn(u32) -> Vector3<f64>, mut add: impl FnMut(usize, f64)) {
        for (node, row) in &self.rows {
            let parts = row.iter().filter(|followed| followed.part.is_some());
            parts.for_each(|own| own.pull(&force(*node), |c, f| add(6 * own.node as usize + c, f)));
        }
    }

    /// Adds to a stiffness what masses [kg/s²] of nodes that go with rigid parts resist with, and how the forces [N] that they resist with now
    /// turn with them; `of` gives both.
    pub(crate) fn add_parts(
        &self,
        equations: &Equations,
        matrix: &mut LowerMatrix,
        of: impl Fn(u32) -> (f64, Vector3<f64>),
    ) {
        if self.parts.is_empty() {
            return;
        }
        let mut blocks = vec![Matrix6::zeros(); self.parts.len()];
        for (node, row) in &self.rows {
            for Followed { weight, part, arm, .. } in row {
                let Some(part) = part else { continue };
                let (mass, force) = of(*node);
                let mut moves = Matrix3x6::zeros();
                moves.fixed_view_mut::<3, 3>(0, 0).fill_diagonal(*weight);
                moves.fixed_view_mut::<3, 3>(0, 3).copy_from(&-skew(arm));
                blocks[*part] += mass * moves.transpose() * moves;
                let half = 0.5 * force * arm.transpose();
                let turned = half + half.transpose() - Matrix3::from_diagonal_element(force.dot(arm));
                let mut turns = blocks[*part].fixed_view_mut::<3, 3>(3, 3);
                turns += turned;
            }
        }
        for (RigidPart { first, idle, size, .. }, mut block) in self.parts.iter().zip(blocks) {
            let number = equations.number[6 * *first as usize];
            for axis in idle.iter().filter(|_| number != NONE) {
                // Nothing pulls there: any stiffness will do.
                let mut turns = block.fixed_view_mut::<3, 3>(3, 3);
                turns += axis * axis.transpose() * (matrix.diagonal(number as usize).abs() * size * size);
            }
            let places = matrix.places(equations, &[*first], 6);
            matrix.add(equations, &[*first], 6, &places, block.as_slice());
        }
    }
}

impl Followed {
    /// What a force [N] on the node that follows is here: a force and, with an arm, a moment, component by component.
    fn pull(&self, force: &Vector3<f64>, mut add: impl FnMut(usize, f64)) {
        (0..3).for_each(|c| add(c, self.weight * force[c]));
        if self.part.is_some() {
            let moment = self.arm.cross(force);
            (0..3).for_each(|c| add(3 + c, moment[c]));
        }
    }
}
