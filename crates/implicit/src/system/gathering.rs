//! Sums over the facets of a chunk, node by node. Threads share the nodes. Each node adds the corners that
//! meet there in the order of the facets, so the number of threads changes no bit.

use pliant_linear::sparse::{Equations, Values};

/// Nodes that a thread takes at least.
const SHARE: usize = 32;

/// The corners of the facets of a chunk by nodes.
pub(crate) struct Corners {
    /// The nodes, increasing.
    node: Vec<u32>,
    /// Start of the corners of each node, and the end of the last.
    start: Vec<u32>,
    /// Three times the facet's place in the chunk, and its corner; increasing at each node.
    corner: Vec<u32>,
}

impl Corners {
    /// Finds the corners of facets with the given nodes.
    pub(crate) fn of(facets: impl Iterator<Item = [u32; 3]>) -> Self {
        let mut pairs: Vec<(u32, u32)> = facets.flatten().zip(0..).collect();
        pairs.sort_unstable();
        let mut corners =
            Self { node: Vec::new(), start: Vec::new(), corner: Vec::with_capacity(pairs.len()) };
        for (node, corner) in pairs {
            if corners.node.last() != Some(&node) {
                corners.node.push(node);
                corners.start.push(corners.corner.len() as u32);
            }
            corners.corner.push(corner);
        }
        corners.start.push(corners.corner.len() as u32);
        corners
    }

    /// Calls `take` for each node. Its arguments are the node, its corners (facet in the chunk, corner of the
    /// facet), and the sums of a range of nodes around it.
    pub(crate) fn visit(
        &self,
        equations: &Equations,
        sums: NodeSums<'_>,
        take: &(impl Fn(u32, &[u32], &mut NodeSums<'_>) + Sync),
    ) {
        self.visit_range([0, self.node.len()], equations, sums, take);
    }

    fn visit_range(
        &self,
        [from, to]: [usize; 2],
        equations: &Equations,
        mut sums: NodeSums<'_>,
        take: &(impl Fn(u32, &[u32], &mut NodeSums<'_>) + Sync),
    ) {
        if to - from <= SHARE {
            for (at, &node) in (from..to).zip(&self.node[from..to]) {
                take(node, &self.corner[self.start[at] as usize..self.start[at + 1] as usize], &mut sums);
            }
            return;
        }
        let middle = (from + to) / 2;
        let (before, after) = sums.split_at(equations, self.node[middle]);
        rayon::join(
            || self.visit_range([from, middle], equations, before, take),
            || self.visit_range([middle, to], equations, after, take),
        );
    }
}

/// Forces and stiffness of a range of nodes.
pub(crate) struct NodeSums<'a> {
    /// The first of the nodes.
    pub(crate) first: u32,
    /// Internal forces, and fixed and controlled loads, six a node.
    pub(crate) forces: [&'a mut [f64]; 3],
    /// If it is wanted.
    pub(crate) stiffness: Option<ColumnSums<'a>>,
}

/// The stiffness of a range of equations.
pub(crate) struct ColumnSums<'a> {
    /// The first of the equations.
    pub(crate) first: usize,
    /// Forces from prescribed increments.
    pub(crate) coupling: &'a mut [f64],
    /// The columns of the matrix, and the starts of the columns of all equations.
    pub(crate) values: Values<'a>,
    pub(crate) column_start: &'a [u32],
}

impl NodeSums<'_> {
    /// Splits into the nodes before a node, and the rest.
    fn split_at(self, equations: &Equations, node: u32) -> (Self, Self) {
        let components = 6 * (node - self.first) as usize;
        let [internal, fixed, controlled] = self.forces.map(|forces| forces.split_at_mut(components));
        let (before, after) = self.stiffness.map(|columns| columns.split_at(equations.before(node))).unzip();
        let of = |first, forces, stiffness| Self { first, forces, stiffness };
        (
            of(self.first, [internal.0, fixed.0, controlled.0], before),
            of(node, [internal.1, fixed.1, controlled.1], after),
        )
    }
}

impl ColumnSums<'_> {
    /// Splits into the equations before an equation, and the rest.
    fn split_at(self, equation: usize) -> (Self, Self) {
        let Self { first, coupling, values, column_start } = self;
        let (coupling_before, coupling_after) = coupling.split_at_mut(equation - first);
        let (before, after) = values.split_at(column_start[equation] as usize);
        (
            Self { first, coupling: coupling_before, values: before, column_start },
            Self { first: equation, coupling: coupling_after, values: after, column_start },
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pliant_linear::sparse::{Cell, LowerMatrix};
    use pliant_testing::Random;

    /// Columns of a strip of triangles, with some nodes held, equal the columns from cells added one after
    /// the other, bit for bit.
    #[test]
    fn columns_are_summed_in_the_order_of_the_facets() {
        let mut random = Random::new(5);
        let nodes = 5 * SHARE as u32;
        let facets: Vec<[u32; 3]> = (0..nodes - 2).rev().map(|node| [node + 1, node, node + 2]).collect();
        let free: Vec<bool> =
            (0..6 * nodes).map(|component| component % 7 > 1 || component % 5 > 0).collect();
        let equations = Equations::new(&free);
        let mut matrix = LowerMatrix::new(&equations, facets.iter().map(|facet| &facet[..]), &[]);
        let places: Vec<Vec<u32>> = facets.iter().map(|facet| matrix.places(&equations, facet, 6)).collect();
        let entries: Vec<Vec<f64>> =
            facets.iter().map(|_| (0..324).map(|_| random.number()).collect()).collect();
        let cell = |at: usize| Cell {
            nodes: &facets[at],
            components: 6,
            places: &places[at],
            entries: &entries[at],
        };
        let mut expected = matrix.clone();
        (0..facets.len()).for_each(|at| expected.add(&equations, &cell(at)));

        let mut forces = [(); 3].map(|()| vec![0.0; 6 * nodes as usize]);
        let mut coupling = vec![0.0; equations.count()];
        let (values, column_start) = matrix.values();
        let stiffness = ColumnSums { first: 0, coupling: &mut coupling, values, column_start };
        let forces = forces.each_mut().map(|vector| &mut vector[..]);
        let sums = NodeSums { first: 0, forces, stiffness: Some(stiffness) };
        let take = |_: u32, corners: &[u32], sums: &mut NodeSums<'_>| {
            let Some(columns) = &mut sums.stiffness else { return };
            corners
                .iter()
                .for_each(|&c| columns.values.add(&equations, &cell(c as usize / 3), c as usize % 3));
        };
        Corners::of(facets.iter().copied()).visit(&equations, sums, &take);
        assert_eq!(matrix.value, expected.value);
        assert!(matrix.value.iter().any(|&value| value != 0.0));
    }
}
