//! Nodes whose translations are no unknowns of a system of equations, since other nodes move them. These are
//! tied nodes and the nodes of rigid parts. A rigid part has six unknowns at its first node. A cell at such
//! nodes becomes a cell at the nodes that they follow, K ← Tᵀ K T; its forces go there by Tᵀ. Nodes of shells
//! in a rigid part turn with the part. Nodes of shells in a solid turn with its gradient ([`Turn`]). All
//! other rotations stay with the node itself.
//!
//! In an increment a node moves by Σ w (d + θ × a). Here d and θ belong to the nodes that it follows. The arm
//! a starts at the first node of a rigid part, and is 0 for a tie. The node then is at x = X + Σ (w u +
//! (R − 1) A), exactly. The second derivative of x by θ comes from exp(θ) a ≈ a + θ × a + θ × (θ × a)/2. It
//! adds (f aᵀ + a fᵀ)/2 − (f·a) to the stiffness of θ, with f the resistance of cells less the loads.

use nalgebra::{Matrix3, Matrix3x6, Matrix6, SymmetricEigen, Vector3};
use pliant_linear::sparse::{Cell, Equations, LowerMatrix, NONE};
use pliant_mechanics::model::Motion;
use pliant_mechanics::tie::Tie;
use pliant_shells::rotation::skew;

use crate::Assembly;
use crate::model::state::AssemblyState;
use crate::system::turns::Turn;

/// The nodes whose unknowns move a cell, and how many components of each.
pub(crate) type Expanded = (Vec<u32>, usize);

/// The nodes of a model that follow others.
pub(crate) struct Followers {
    /// The row of each node; [`NONE`] of the others.
    row_of: Vec<u32>,
    /// Each node with those that it follows.
    rows: Vec<(u32, Vec<Followed>)>,
    /// Components of nodes that do not follow, as a constraint holds or moves them; increasing nodes.
    held: Vec<(u32, [bool; 3])>,
    parts: Vec<RigidPart>,
    /// Nodes that turn as the first one of their rigid part, with that.
    turned: Vec<[u32; 2]>,
    /// Nodes that turn with a solid, by increasing node.
    turns: Vec<Turn>,
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
    /// The node that holds the unknowns of the part.
    first: u32,
    /// Axes about which a turn moves no node, at rest and in the current state. Nodes on a line have one.
    idle_at_rest: Vec<Vector3<f64>>,
    idle: Vec<Vector3<f64>>,
    /// Mean edge of the model [m].
    size: f64,
}

impl RigidPart {
    fn of(model: &Assembly, nodes: &[u32], turning: &[bool]) -> Self {
        let arms = nodes.iter().map(|&node| model.place(node as usize) - model.place(nodes[0] as usize));
        let inertia = arms.fold(Matrix3::zeros(), |sum, arm| {
            sum + Matrix3::from_diagonal_element(arm.norm_squared()) - arm * arm.transpose()
        });
        let SymmetricEigen { eigenvalues, eigenvectors } = SymmetricEigen::new(inertia);
        // Nodes that turn feel every turn.
        let turns = nodes.iter().any(|&node| turning[node as usize]);
        let limit = if turns { f64::NEG_INFINITY } else { 1e-12 * eigenvalues.max() };
        let axes = eigenvalues.iter().zip(eigenvectors.column_iter());
        let idle: Vec<_> =
            axes.filter(|(value, _)| **value <= limit).map(|(_, axis)| axis.into_owned()).collect();
        Self { first: nodes[0], idle_at_rest: idle.clone(), idle, size: model.mean_edge() }
    }
}

impl Followers {
    /// Finds the followers of ties alone, or of ties and rigid parts; `None` if there are no followers.
    pub(crate) fn of(model: &Assembly, rigid: bool) -> Option<Self> {
        let mut parts = Vec::new();
        let mut part_of = vec![None; model.rest.len()];
        let turning = model.turning();
        let mut turned = Vec::new();
        let mut rows: Vec<(u32, Vec<Followed>)> = Vec::new();
        let bound =
            model.constraints.iter().filter(|constraint| rigid && matches!(constraint.motion, Motion::Rigid));
        for constraint in bound {
            let part = parts.len();
            parts.push(RigidPart::of(model, &constraint.nodes, &turning));
            let with_first = constraint.nodes[1..].iter().filter(|&&node| turning[node as usize]);
            turned.extend(with_first.map(|&node| [node, constraint.nodes[0]]));
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
            let mut merged: Vec<Followed> = Vec::new();
            for next in row.map(|(node, weight)| followed(node, weight)) {
                match merged.iter_mut().find(|known| known.part.is_some() && known.node == next.node) {
                    Some(known) => {
                        known.weight += next.weight;
                        known.rest += next.rest;
                        known.arm += next.arm;
                    }
                    None => merged.push(next),
                }
            }
            rows.push((node, merged));
        }
        for node in (0..model.rest.len() as u32)
            .filter(|&node| part_of[node as usize].is_some_and(|part: usize| parts[part].first != node))
        {
            rows.push((node, vec![followed(node, 1.0)]));
        }
        let tied = model.ties.iter().flat_map(|tie| tie.nodes.iter().copied().zip(tie.held.iter().copied()));
        let mut held: Vec<(u32, [bool; 3])> = tied.filter(|(_, held)| held.contains(&true)).collect();
        held.sort_unstable();
        let mut row_of = vec![NONE; model.rest.len()];
        for ((node, _), number) in rows.iter().zip(0..) {
            row_of[*node as usize] = number;
        }
        turned.sort_unstable();
        let mut turns: Vec<Turn> = model.carried_turns().map(Turn::new).collect();
        turns.sort_by_key(|turn| turn.node);
        let some = !rows.is_empty() || !turns.is_empty();
        some.then_some(Self { row_of, rows, held, parts, turned, turns })
    }

    pub(crate) fn follows(&self, node: u32) -> bool {
        self.row_of[node as usize] != NONE
    }

    /// The components of a node that do not follow.
    fn held(&self, node: u32) -> [bool; 3] {
        let found = self.held.binary_search_by_key(&node, |(known, _)| *known);
        found.map_or([false; 3], |at| self.held[at].1)
    }

    /// Nodes that turn with another one, each with that.
    fn turned(&self) -> impl Iterator<Item = [usize; 2]> {
        self.turned.iter().map(|pair| pair.map(|node| node as usize))
    }

    /// The node that a node turns with, itself if with no other.
    fn turns_with(&self, node: u32) -> u32 {
        match self.turned.binary_search_by_key(&node, |[known, _]| *known) {
            Ok(at) => self.turned[at][1],
            Err(_) => node,
        }
    }

    /// The turn of a node with a solid, if it has one.
    fn carried(&self, node: u32) -> Option<&Turn> {
        let at = self.turns.binary_search_by_key(&node, |turn| turn.node).ok()?;
        Some(&self.turns[at])
    }

    /// Nodes that a node follows; empty if it follows no other.
    fn followed(&self, node: u32) -> &[Followed] {
        match self.row_of[node as usize] {
            NONE => &[],
            row => &self.rows[row as usize].1,
        }
    }

    /// The nodes whose unknowns move a cell, and how many components of each; `None` if they are its own.
    /// Where nodes turn they keep their place for that.
    pub(crate) fn expanded(&self, nodes: &[u32], turns: bool) -> Option<Expanded> {
        let first = |node: &u32| self.parts.iter().any(|part| part.first == *node);
        let carried = |node: &u32| turns && self.carried(*node).is_some();
        if !nodes.iter().any(|node| self.follows(*node) || first(node) || carried(node)) {
            return None;
        }
        let turn = |node: &u32| turns && !carried(node);
        let stays = |node: &u32| !self.follows(*node) || self.held(*node).contains(&true);
        let mut found: Vec<u32> = nodes.iter().copied().filter(|node| turn(node) || stays(node)).collect();
        let solids = nodes.iter().filter(|node| carried(node)).filter_map(|&node| self.carried(node));
        for moving in nodes.iter().copied().chain(solids.flat_map(Turn::nodes)) {
            for node in self.movers(moving) {
                if !found.contains(&node) {
                    found.push(node);
                }
            }
        }
        let turns = nodes.iter().any(turn) || found.iter().any(first);
        Some((found, if turns { 6 } else { 3 }))
    }

    /// The nodes that a node follows, with their weights; nothing, if it follows no other.
    pub(crate) fn weights(&self, node: u32) -> impl Iterator<Item = (u32, f64)> + '_ {
        self.followed(node).iter().map(|followed| (followed.node, followed.weight))
    }

    /// The nodes whose unknowns move a node: itself, or those that it follows.
    fn movers(&self, node: u32) -> impl Iterator<Item = u32> + '_ {
        let itself = (!self.follows(node)).then_some(node);
        itself.into_iter().chain(self.followed(node).iter().map(|followed| followed.node))
    }

    /// Computes Tᵀ K T of a cell on its [`expanded`](Self::expanded) nodes, column by column, for a number of
    /// components a node.
    pub(crate) fn condensed(
        &self,
        nodes: &[u32],
        components: usize,
        (expanded, wide): &Expanded,
        tangent: &[f64],
    ) -> Vec<f64> {
        let place = |node: u32| wide * expanded.iter().position(|&known| known == node).unwrap_or(0);
        let shift = |node: u32, c: usize, by: f64, entries: &mut Vec<(usize, f64)>| {
            let followed = self.followed(node);
            if followed.is_empty() || self.held(node)[c] {
                entries.push((place(node) + c, by));
                return;
            }
            for Followed { node, weight, part, arm, .. } in followed {
                let at = place(*node);
                entries.push((at + c, by * weight));
                if part.is_some() {
                    let [next, last] = [(c + 1) % 3, (c + 2) % 3];
                    entries.extend([(at + 3 + next, by * arm[last]), (at + 3 + last, -by * arm[next])]);
                }
            }
        };
        // Of each component the unknowns that move it.
        let moves = |i: usize| -> Vec<(usize, f64)> {
            let (node, c) = (nodes[i / components], i % components);
            let mut entries = Vec::new();
            match self.carried(node).filter(|_| c >= 3) {
                _ if c < 3 => shift(node, c, 1.0, &mut entries),
                None => entries.push((place(self.turns_with(node)) + c, 1.0)),
                Some(turn) => {
                    for (node, block) in turn.blocks() {
                        (0..3).for_each(|k| shift(node, k, block[(c - 3, k)], &mut entries));
                    }
                }
            }
            entries
        };
        let unknowns: Vec<_> = (0..components * nodes.len()).map(moves).collect();
        let (count, size) = (unknowns.len(), wide * expanded.len());
        // K T first, then Tᵀ (K T): a component of a carried turn has some thirty entries.
        let mut moved = vec![0.0; count * size];
        for (column, entries) in unknowns.iter().zip(tangent.chunks_exact(count)) {
            for &(q, w) in column {
                moved[q * count..][..count]
                    .iter_mut()
                    .zip(entries)
                    .for_each(|(sum, entry)| *sum += w * entry);
            }
        }
        let mut whole = vec![0.0; size * size];
        for (column, entries) in whole.chunks_exact_mut(size).zip(moved.chunks_exact(count)) {
            for (row, entry) in unknowns.iter().zip(entries) {
                row.iter().for_each(|&(p, w)| column[p] += w * entry);
            }
        }
        whole
    }

    /// Takes translations and turns along with an increment, six components a node.
    pub(crate) fn follow(&self, components: &mut [f64]) {
        for [node, first] in self.turned() {
            components.copy_within(6 * first + 3..6 * first + 6, 6 * node + 3);
        }
        for (node, row) in &self.rows {
            let along = |c: usize| {
                let of = |followed: &Followed| {
                    let Followed { node, weight, part, arm, .. } = followed;
                    let of_leader = &components[6 * *node as usize..];
                    let [next, last] = [(c + 1) % 3, (c + 2) % 3];
                    let turned = if part.is_some() {
                        of_leader[3 + next] * arm[last] - of_leader[3 + last] * arm[next]
                    } else {
                        0.0
                    };
                    weight * of_leader[c] + turned
                };
                row.iter().map(of).sum::<f64>()
            };
            let (along, held) = ([0, 1, 2].map(along), self.held(*node));
            for c in (0..3).filter(|&c| !held[c]) {
                components[6 * *node as usize + c] = along[c];
            }
        }
        for turn in &self.turns {
            let moved = |node: u32| Vector3::from_column_slice(&components[6 * node as usize..][..3]);
            let spin = turn.spin(moved);
            components[6 * turn.node as usize + 3..][..3].copy_from_slice(spin.as_slice());
        }
    }

    /// Gives the moments on nodes that turn with a solid to that, six components a node.
    pub(crate) fn give_moments_back(&self, components: &mut [f64]) {
        for turn in &self.turns {
            let on_node = &mut components[6 * turn.node as usize + 3..][..3];
            let moment = Vector3::from_column_slice(on_node);
            on_node.fill(0.0);
            for (node, force) in turn.forces(&moment) {
                (0..3).for_each(|c| components[6 * node as usize + c] += force[c]);
            }
        }
    }

    /// Gives forces to the nodes that are followed, six components a node; moments on nodes that turn with a
    /// solid are given already.
    pub(crate) fn give_back(&self, components: &mut [f64]) {
        for [node, first] in self.turned() {
            for c in 3..6 {
                components[6 * first + c] += std::mem::take(&mut components[6 * node + c]);
            }
        }
        for (node, row) in &self.rows {
            let (held, mut force) = (self.held(*node), Vector3::zeros());
            for c in (0..3).filter(|&c| !held[c]) {
                force[c] = std::mem::take(&mut components[6 * *node as usize + c]);
            }
            row.iter().for_each(|followed| {
                followed.pull(&force, |c, f| components[6 * followed.node as usize + c] += f)
            });
        }
    }

    /// Puts the nodes that go with rigid parts where these are.
    pub(crate) fn place(&self, model: &Assembly, state: &mut AssemblyState) {
        let moved = |followed: &Followed| {
            let node = followed.node as usize;
            followed.weight * (state.position[node] - model.place(node))
                + (state.rotation[node] * followed.rest - followed.rest)
        };
        let bound = self.rows.iter().filter(|(_, row)| row.iter().any(|followed| followed.part.is_some()));
        let places: Vec<_> = bound
            .map(|(node, row)| {
                (*node, row.iter().fold(model.place(*node as usize), |sum, leader| sum + moved(leader)))
            })
            .collect();
        for (node, place) in places {
            let held = self.held(node);
            (0..3).filter(|&c| !held[c]).for_each(|c| state.position[node as usize][c] = place[c]);
        }
        for [node, first] in self.turned() {
            state.rotation[node] = state.rotation[first];
        }
        for turn in &self.turns {
            state.rotation[turn.node as usize] = turn.rotation(state);
        }
    }

    /// Takes the arms at a state, and how nodes turn with solids.
    pub(crate) fn turn(&mut self, state: &AssemblyState) {
        self.turns.iter_mut().for_each(|turn| turn.turn(state));
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

    /// The places of the translations of a node that may follow others, and its stiffness there, equal along
    /// all axes.
    pub(crate) fn spring(&self, node: u32, stiffness: f64) -> Option<(Expanded, Vec<f64>)> {
        let expanded = self.expanded(&[node], false)?;
        let diagonal = Matrix3::from_diagonal_element(stiffness);
        let whole = self.condensed(&[node], 3, &expanded, diagonal.as_slice());
        Some((expanded, whole))
    }

    /// Carries forces [N] and moments [N m] on nodes of rigid parts, and moments on nodes that turn with a
    /// solid, to the unknowns. It calls `add` component by component.
    pub(crate) fn pull(
        &self,
        force: impl Fn(u32) -> Vector3<f64>,
        moment: impl Fn(u32) -> Vector3<f64>,
        mut add: impl FnMut(usize, f64),
    ) {
        for turn in &self.turns {
            for (node, force) in turn.forces(&moment(turn.node)) {
                if !self.follows(node) {
                    (0..3).for_each(|c| add(6 * node as usize + c, force[c]));
                }
                let followed = self.followed(node).iter();
                followed.for_each(|leader| leader.pull(&force, |c, f| add(6 * leader.node as usize + c, f)));
            }
        }
        for &[node, first] in &self.turned {
            let moment = moment(node);
            (0..3).for_each(|c| add(6 * first as usize + 3 + c, moment[c]));
        }
        for (node, row) in &self.rows {
            let parts = row.iter().filter(|followed| followed.part.is_some());
            parts.for_each(|part| part.pull(&force(*node), |c, f| add(6 * part.node as usize + c, f)));
        }
    }

    /// Adds the turns of nodes with a solid to a stiffness. Forces from moments [N m] on these nodes change
    /// as the solid deforms, and rotary inertias [N m] resist.
    pub(crate) fn add_turns(
        &self,
        equations: &Equations,
        matrix: &mut LowerMatrix,
        moment: impl Fn(u32) -> Vector3<f64>,
        rotary: impl Fn(u32) -> f64,
    ) {
        for turn in &self.turns {
            let nodes: Vec<u32> = turn.nodes().collect();
            let change = turn.change(&moment(turn.node), rotary(turn.node));
            let (moving, components, whole) = match self.expanded(&nodes, false) {
                Some(expanded) => {
                    let whole = self.condensed(&nodes, 3, &expanded, &change);
                    (expanded.0, expanded.1, whole)
                }
                None => (nodes, 3, change),
            };
            let places = matrix.places(equations, &moving, components);
            matrix.add(equations, &Cell { nodes: &moving, components, places: &places, entries: &whole });
        }
    }

    /// The nodes of the solid of each node that turns with one.
    pub(crate) fn turning_nodes(&self) -> impl Iterator<Item = Vec<u32>> + '_ {
        self.turns.iter().map(|turn| turn.nodes().collect())
    }

    /// Adds the resistance of masses [kg/s²] and rotary inertias [N m] of nodes in rigid parts to a
    /// stiffness. It adds the change of the present resisting forces [N] as the parts turn. `of` gives the
    /// masses with the forces, `rotary` the inertias.
    pub(crate) fn add_parts(
        &self,
        equations: &Equations,
        matrix: &mut LowerMatrix,
        of: impl Fn(u32) -> (f64, Vector3<f64>),
        rotary: impl Fn(u32) -> f64,
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
        for &[node, first] in &self.turned {
            if let Some(part) = self.parts.iter().position(|part| part.first == first) {
                (3..6).for_each(|c| blocks[part][(c, c)] += rotary(node));
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
            let entries = block.as_slice();
            matrix.add(equations, &Cell { nodes: &[*first], components: 6, places: &places, entries });
        }
    }
}

impl Assembly {
    /// Puts all nodes that follow others where these are at a state, and turns those that turn with a solid.
    pub fn take_along(&self, state: &mut AssemblyState) {
        for (node, row) in self.ties.iter().flat_map(pliant_mechanics::tie::Tie::component_rows) {
            let moved = |followed: usize| state.position[followed] - self.place(followed);
            let along = row.map(|(followed, w)| moved(followed as usize).component_mul(&Vector3::from(w)));
            state.position[node as usize] = self.place(node as usize) + along.sum::<Vector3<f64>>();
        }
        for turn in self.carried_turns() {
            state.rotation[turn.node as usize] = Turn::new(turn).rotation(state);
        }
    }
}

impl Followed {
    /// Carries a force [N] on the following node to this node: a force and, with an arm, a moment, component
    /// by component.
    fn pull(&self, force: &Vector3<f64>, mut add: impl FnMut(usize, f64)) {
        (0..3).for_each(|c| add(c, self.weight * force[c]));
        if self.part.is_some() {
            let moment = self.arm.cross(force);
            (0..3).for_each(|c| add(3 + c, moment[c]));
        }
    }
}

#[cfg(test)]
mod tests;
