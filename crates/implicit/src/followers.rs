//! Nodes that follow others in systems of equations: their translations are no unknowns. A cell at such nodes becomes a cell at the nodes
//! that they follow, K ← Tᵀ K T, with T the rows of the ties; its forces go there by Tᵀ. Rotations stay with the node itself.

use pliant_mechanics::tie::Tie;

use crate::Assembly;
use crate::sparse::NONE;

/// The nodes of a model that follow others.
pub(crate) struct Followers {
    /// The row of each node; [`NONE`] of the others.
    row_of: Vec<u32>,
    /// Each node with those that it follows and their weights.
    rows: Vec<(u32, Vec<(u32, f64)>)>,
}

impl Followers {
    /// `None` without ties.
    pub(crate) fn of(model: &Assembly) -> Option<Self> {
        if model.ties.is_empty() {
            return None;
        }
        let rows: Vec<_> =
            model.ties.iter().flat_map(Tie::rows).map(|(node, row)| (node, row.collect())).collect();
        let mut row_of = vec![NONE; model.rest.len()];
        for ((node, _), number) in rows.iter().zip(0..) {
            row_of[*node as usize] = number;
        }
        Some(Self { row_of, rows })
    }

    pub(crate) fn follows(&self, node: u32) -> bool {
        self.row_of[node as usize] != NONE
    }

    /// What a node follows: itself, if it follows no other.
    fn followed(&self, node: u32) -> &[(u32, f64)] {
        match self.row_of[node as usize] {
            NONE => &[],
            row => &self.rows[row as usize].1,
        }
    }

    /// The nodes whose unknowns move a cell; `None` if they are its own. Where nodes turn they keep their place for that.
    pub(crate) fn expanded(&self, nodes: &[u32], turns: bool) -> Option<Vec<u32>> {
        if !nodes.iter().any(|&node| self.follows(node)) {
            return None;
        }
        let mut all: Vec<u32> = nodes.iter().copied().filter(|&node| turns || !self.follows(node)).collect();
        for &node in nodes {
            for &(followed, _) in self.followed(node) {
                if !all.contains(&followed) {
                    all.push(followed);
                }
            }
        }
        Some(all)
    }

    /// Tᵀ K T of a cell of so many components a node, on its [`expanded`](Self::expanded) nodes, column by column.
    pub(crate) fn condensed(
        &self,
        nodes: &[u32],
        expanded: &[u32],
        components: usize,
        tangent: &[f64],
    ) -> Vec<f64> {
        let place = |node: u32| expanded.iter().position(|&known| known == node).unwrap_or(0);
        // Of each component the unknowns that move it.
        let moves = |i: usize| -> Vec<(usize, f64)> {
            let (node, c) = (nodes[i / components], i % components);
            match self.followed(node) {
                followed if c < 3 && !followed.is_empty() => {
                    followed.iter().map(|&(node, w)| (components * place(node) + c, w)).collect()
                }
                _ => vec![(components * place(node) + c, 1.0)],
            }
        };
        let all: Vec<_> = (0..components * nodes.len()).map(moves).collect();
        let size = components * expanded.len();
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

    /// Takes translations along, six components a node.
    pub(crate) fn follow(&self, components: &mut [f64]) {
        for (node, row) in &self.rows {
            for c in 0..3 {
                let along = row.iter().map(|&(followed, w)| w * components[6 * followed as usize + c]).sum();
                components[6 * *node as usize + c] = along;
            }
        }
    }

    /// Gives forces to the nodes that are followed, six components a node.
    pub(crate) fn give_back(&self, components: &mut [f64]) {
        for (node, row) in &self.rows {
            for c in 0..3 {
                let force = std::mem::take(&mut components[6 * *node as usize + c]);
                row.iter().for_each(|&(followed, w)| components[6 * followed as usize + c] += w * force);
            }
        }
    }
}
