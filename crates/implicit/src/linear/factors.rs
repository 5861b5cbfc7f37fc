//! L D Lᵀ of a symmetric matrix by fronts (multifrontal; Duff and Reid 1983): each supernode adds up its entries of the matrix and what others
//! have left to it, eliminates its columns and leaves the rest to its parent. Without pivoting: matrices are positive definite or nearly so, and
//! the signs of pivots are wanted. One thread, so bits do not depend on how many there are.

use pulp::{Arch, Simd, WithSimd};

use super::fronts::{BLOCK, Left, PivotColumns, dot, eliminate, multiply};
use super::supernodes::{Supernode, Supernodes, padded};
use crate::sparse::LowerMatrix;

/// The signs of a factorisation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Pivots {
    /// Negative pivots: directions in which the stiffness is negative.
    pub(crate) negative: usize,
    /// Equation with the smallest pivot.
    pub(crate) weakest: usize,
    /// That pivot over the diagonal entry.
    pub(crate) smallest: f64,
    /// The lowest pivot over the diagonal entry, if one is negative.
    pub(crate) lowest: f64,
}

/// Pivots below this part of the diagonal are zero but for round-off.
pub(crate) const ZERO_PIVOT: f64 = 1e-14;

/// L D Lᵀ of a matrix.
pub(crate) struct Factors {
    supernodes: Supernodes,
    /// L, panel by panel.
    value: Vec<f64>,
    /// D, and the diagonal of the matrix without signs, 1 where it is zero, by columns.
    pivot: Vec<f64>,
    diagonal: Vec<f64>,
    memory: Memory,
    arch: Arch,
}

/// Numbers on the way.
#[derive(Default)]
struct Memory {
    /// L D of some columns of a front.
    scaled: Vec<f64>,
    /// What supernodes of even and of odd depth have left, and that is not yet taken.
    stacks: [Vec<f64>; 2],
    /// The supernodes that left it, of both.
    waiting: Vec<usize>,
    /// The right-hand side by columns, and numbers of the rows below a supernode.
    right: Vec<f64>,
    below: Vec<f64>,
}

impl Factors {
    pub(crate) fn new(matrix: &LowerMatrix) -> Result<Self, faer::sparse::FaerError> {
        let supernodes = Supernodes::new(matrix)?;
        Ok(Self {
            value: vec![0.0; supernodes.values],
            pivot: vec![0.0; matrix.len()],
            diagonal: vec![0.0; matrix.len()],
            memory: Memory {
                scaled: vec![0.0; supernodes.highest * BLOCK],
                stacks: supernodes.stacks.map(|numbers| vec![0.0; numbers]),
                waiting: Vec::with_capacity(supernodes.nodes.len()),
                right: vec![0.0; matrix.len()],
                below: vec![0.0; padded(supernodes.most_below)],
            },
            arch: Arch::new(),
            supernodes,
        })
    }

    /// Factors a matrix; `None` if it holds a number that is not finite.
    pub(crate) fn factorise(&mut self, matrix: &LowerMatrix) -> Option<Pivots> {
        for (diagonal, &equation) in self.diagonal.iter_mut().zip(&self.supernodes.order) {
            let own = matrix.diagonal(equation as usize).abs();
            *diagonal = if own > 0.0 { own } else { 1.0 };
        }
        self.arch.dispatch(Factorise { own: self, matrix });
        let mut pivots = Pivots { smallest: f64::INFINITY, ..Pivots::default() };
        let columns = self.pivot.iter().zip(&self.diagonal).zip(&self.supernodes.order);
        for ((&pivot, diagonal), &equation) in columns {
            // What is not finite anywhere comes to the pivot of its row.
            if !pivot.is_finite() {
                return None;
            }
            pivots.negative += usize::from(pivot < 0.0);
            pivots.lowest = pivots.lowest.min(pivot / diagonal);
            let part = pivot.abs() / diagonal;
            if part < pivots.smallest {
                (pivots.smallest, pivots.weakest) = (part, equation as usize);
            }
        }
        Some(pivots)
    }

    /// x ← A⁻¹ x.
    pub(crate) fn solve(&mut self, x: &mut [f64]) {
        for (own, &equation) in self.memory.right.iter_mut().zip(&self.supernodes.order) {
            *own = x[equation as usize];
        }
        self.arch.dispatch(Solve { own: self });
        for (own, &equation) in self.memory.right.iter().zip(&self.supernodes.order) {
            x[equation as usize] = *own;
        }
    }
}

struct Factorise<'a> {
    own: &'a mut Factors,
    matrix: &'a LowerMatrix,
}

impl WithSimd for Factorise<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Factors { supernodes, value, pivot, diagonal, memory, .. } = self.own;
        let Memory { scaled, stacks: [even, odd], waiting, .. } = memory;
        let mut used = [0; 2];
        for (number, node) in supernodes.nodes.iter().enumerate() {
            let (width, height, edge) = (node.width, node.height(), padded(node.width));
            let panel = &mut value[node.value..node.value + height * width];
            fill(supernodes, node, self.matrix, panel);
            let (own, other) = (node.depth % 2, 1 - node.depth % 2);
            let (mine, theirs) = if own == 0 { (&mut *even, &*odd) } else { (&mut *odd, &*even) };
            let left = &mut mine[used[own]..used[own] + left_of(node)];
            let from_children = |columns: &mut [f64], height: usize, range: [usize; 2]| {
                let mut end = used[other];
                for &child in waiting[waiting.len() - node.children..].iter().rev() {
                    let child = &supernodes.nodes[child];
                    let start = end - left_of(child);
                    let (height_left, runs) = (padded(child.below()), supernodes.runs(child));
                    Left { numbers: &theirs[start..end], height: height_left, runs }
                        .add_to(columns, height, range);
                    end = start;
                }
                end
            };
            from_children(panel, height, [0, edge]);
            let columns = node.first..node.first + width;
            let pivots = PivotColumns {
                diagonal: &diagonal[columns.clone()],
                pivot: &mut pivot[columns],
                tiny: 0.1 * ZERO_PIVOT,
            };
            eliminate(simd, panel, width, scaled, left, pivots);
            used[other] = from_children(left, height - edge, [edge, usize::MAX]);
            used[own] += left_of(node);
            waiting.truncate(waiting.len() - node.children);
            waiting.push(number);
        }
        waiting.clear();
    }
}

/// Numbers that a supernode leaves.
fn left_of(node: &Supernode) -> usize {
    padded(node.below()) * node.below()
}

/// Puts entries of the matrix into a panel.
#[inline(always)]
fn fill(supernodes: &Supernodes, node: &Supernode, matrix: &LowerMatrix, panel: &mut [f64]) {
    let height = node.height();
    panel.fill(0.0);
    for piece in supernodes.pieces(node) {
        let to = &mut panel[piece.to as usize..];
        let from = &matrix.value[piece.from as usize..][..piece.len as usize];
        // A plain loop: zipped ones stay calls.
        let step = if piece.across { height } else { 1 };
        for (at, from) in from.iter().enumerate() {
            to[at * step] = *from;
        }
    }
}

struct Solve<'a> {
    own: &'a mut Factors,
}

impl WithSimd for Solve<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Factors { supernodes, value, pivot, memory: Memory { right, below, .. }, .. } = self.own;
        for node in &supernodes.nodes {
            let (width, height, edge) = (node.width, node.height(), padded(node.width));
            let panel = &value[node.value..node.value + height * width];
            let own = &mut right[node.first..node.first + width];
            for (c, column) in panel.chunks_exact(height).enumerate() {
                let (before, after) = own.split_at_mut(c + 1);
                let lower = &column[c + 1..width];
                after.iter_mut().zip(lower).for_each(|(after, lower)| *after -= before[c] * lower);
            }
            let sums = &mut below[..height - edge];
            multiply(simd, panel, own, edge, sums);
            for (&row, sum) in supernodes.rows(node).iter().zip(&*sums) {
                right[row as usize] -= sum;
            }
        }
        right.iter_mut().zip(&*pivot).for_each(|(own, pivot)| *own /= pivot);
        for node in supernodes.nodes.iter().rev() {
            let (width, height, edge) = (node.width, node.height(), padded(node.width));
            let panel = &value[node.value..node.value + height * width];
            let below = &mut below[..height - edge];
            below.fill(0.0);
            for (&row, below) in supernodes.rows(node).iter().zip(&mut *below) {
                *below = right[row as usize];
            }
            let own = &mut right[node.first..node.first + width];
            for (c, column) in panel.chunks_exact(height).enumerate().rev() {
                let lower = column[c + 1..width].iter().zip(&own[c + 1..]);
                own[c] -= dot(simd, &column[edge..], below) + lower.map(|(l, x)| l * x).sum::<f64>();
            }
        }
    }
}

#[cfg(test)]
mod tests;
