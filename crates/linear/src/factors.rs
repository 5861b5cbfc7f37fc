//! L D Lᵀ of a symmetric matrix by fronts (multifrontal; Duff and Reid 1983). Each supernode adds up its
//! entries of the matrix and the updates from other supernodes. It eliminates its columns and leaves an
//! update to its parent. There is no pivoting: matrices are positive definite or nearly so, and the signs of
//! pivots are wanted. Factors are found on one thread; solutions share two parts of the assembly tree between
//! threads. Bits do not depend on the number of threads.

use pulp::{Arch, Simd, WithSimd};

use crate::fronts::{BLOCK, Left, PivotColumns, dot, eliminate, multiply};
use crate::memory::zeros;
use crate::report::LinearError;
use crate::sparse::LowerMatrix;
use crate::supernodes::{Supernode, Supernodes, padded};

/// The signs of a factorisation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pivots {
    /// Negative pivots: directions in which the stiffness is negative.
    pub negative: usize,
    /// Equation with the smallest pivot.
    pub weakest: usize,
    /// The smallest pivot over its diagonal entry.
    pub smallest: f64,
    /// The lowest pivot over the diagonal entry, if one is negative.
    pub lowest: f64,
}

/// Pivots below this part of the diagonal are zero but for round-off.
pub const ZERO_PIVOT: f64 = 1e-14;

/// Numbers of factors from which on solutions are shared: they take some 15 µs.
const SHARED: usize = 1 << 15;

/// L D Lᵀ of a matrix.
pub struct Factors {
    supernodes: Supernodes,
    /// Ends of two independent shares of supernodes: up to the first number, and from there up to the second.
    /// The rest waits for both.
    shares: [usize; 2],
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
    /// Updates from supernodes of even and of odd depth that their parents have not taken yet.
    stacks: [Vec<f64>; 2],
    /// The supernodes with these updates, of both parities.
    waiting: Vec<usize>,
    /// The right-hand side by columns. Each share also has numbers of the rows below a supernode, and the
    /// part that it subtracts from the columns of the rest.
    right: Vec<f64>,
    below: [Vec<f64>; 2],
    taken: [Vec<f64>; 2],
}

impl Factors {
    /// Room for the factors of a pattern.
    ///
    /// # Errors
    /// If there are more equations than can be numbered, or no room for the factors.
    pub fn new(matrix: &LowerMatrix) -> Result<Self, LinearError> {
        Self::shared_from(matrix, SHARED)
    }

    /// Factors whose solutions are shared if the factors have at least `least` numbers.
    fn shared_from(matrix: &LowerMatrix, least: usize) -> Result<Self, LinearError> {
        let supernodes = Supernodes::new(matrix)?;
        let shares =
            if supernodes.values < least { [supernodes.nodes.len(); 2] } else { supernodes.shares() };
        let rest = matrix.columns() - supernodes.column(shares[1]);
        Ok(Self {
            shares,
            value: zeros(supernodes.values)?,
            pivot: vec![0.0; matrix.columns()],
            diagonal: vec![0.0; matrix.columns()],
            memory: Memory {
                scaled: vec![0.0; supernodes.highest * BLOCK],
                stacks: [zeros(supernodes.stacks[0])?, zeros(supernodes.stacks[1])?],
                waiting: Vec::with_capacity(supernodes.nodes.len()),
                right: vec![0.0; matrix.columns()],
                below: [(); 2].map(|()| vec![0.0; padded(supernodes.most_below)]),
                taken: [(); 2].map(|()| vec![0.0; rest]),
            },
            arch: Arch::new(),
            supernodes,
        })
    }

    /// Bytes that the factors of a pattern take.
    ///
    /// # Errors
    /// If there are more equations than can be numbered, or the order of elimination has no room.
    pub fn bytes(matrix: &LowerMatrix) -> Result<u64, LinearError> {
        let Supernodes { values, stacks: [even, odd], .. } = Supernodes::new(matrix)?;
        Ok(8 * (values + even + odd) as u64)
    }

    /// Factors a matrix; `None` if it holds a number that is not finite.
    pub(crate) fn factorise(&mut self, matrix: &LowerMatrix) -> Option<Pivots> {
        for (diagonal, &equation) in self.diagonal.iter_mut().zip(&self.supernodes.order) {
            let entry = matrix.diagonal(equation as usize).abs();
            *diagonal = if entry > 0.0 { entry } else { 1.0 };
        }
        self.arch.dispatch(Factorise { factors: self, matrix });
        let mut pivots = Pivots { smallest: f64::INFINITY, ..Pivots::default() };
        let columns = self.pivot.iter().zip(&self.diagonal).zip(&self.supernodes.order);
        for ((&pivot, diagonal), &equation) in columns {
            // A number that is not finite anywhere reaches the pivot of its row.
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
    pub fn solve(&mut self, x: &mut [f64]) {
        let Self { supernodes, shares: [middle, end], value, pivot, memory, arch, .. } = self;
        let Memory { right, below: [below, below_other], taken: [taken, taken_other], .. } = memory;
        for (entry, &equation) in right.iter_mut().zip(&supernodes.order) {
            *entry = x[equation as usize];
        }
        let (arch, node_count, count) = (*arch, supernodes.nodes.len(), right.len());
        let [first, beyond] = [*middle, *end].map(|node| supernodes.column(node));
        let (shared, rest) = right.split_at_mut(beyond);
        let (one, other) = shared.split_at_mut(first);
        let share = |nodes, beyond| Share { supernodes, value, pivot, nodes, beyond };
        let (a, b, last) =
            (share([0, *middle], beyond), share([*middle, *end], beyond), share([*end, node_count], count));
        join(
            *middle < *end,
            || arch.dispatch(Forward { share: &a, right: one, rest: taken, below }),
            || arch.dispatch(Forward { share: &b, right: other, rest: taken_other, below: below_other }),
        );
        for ((entry, one), other) in rest.iter_mut().zip(&*taken).zip(&*taken_other) {
            *entry -= one + other;
        }
        arch.dispatch(Forward { share: &last, right: rest, rest: &mut [], below });
        arch.dispatch(Backward { share: &last, right: rest, rest: &[], below });
        join(
            *middle < *end,
            || arch.dispatch(Backward { share: &a, right: one, rest, below }),
            || arch.dispatch(Backward { share: &b, right: other, rest, below: below_other }),
        );
        for (entry, &equation) in right.iter().zip(&supernodes.order) {
            x[equation as usize] = *entry;
        }
    }
}

/// Calls two functions, on two threads where there is something to share.
fn join(shared: bool, one: impl FnOnce() + Send, other: impl FnOnce() + Send) {
    if shared {
        rayon::join(one, other);
    } else {
        one();
    }
}

struct Factorise<'a> {
    factors: &'a mut Factors,
    matrix: &'a LowerMatrix,
}

impl WithSimd for Factorise<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Factors { supernodes, value, pivot, diagonal, memory, .. } = self.factors;
        let Memory { scaled, stacks: [even, odd], waiting, .. } = memory;
        let mut used = [0; 2];
        for (number, node) in supernodes.nodes.iter().enumerate() {
            let (width, height, edge) = (node.width, node.height(), padded(node.width));
            let panel = &mut value[node.value..node.value + height * width];
            fill(supernodes, node, self.matrix, panel);
            let (stack, other) = (node.depth % 2, 1 - node.depth % 2);
            let (mine, theirs) = if stack == 0 { (&mut *even, &*odd) } else { (&mut *odd, &*even) };
            let left = &mut mine[used[stack]..used[stack] + left_of(node)];
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
            used[stack] += left_of(node);
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

/// Some supernodes that follow one another.
struct Share<'a> {
    supernodes: &'a Supernodes,
    value: &'a [f64],
    pivot: &'a [f64],
    /// Begin and end of the supernodes.
    nodes: [usize; 2],
    /// The first column of the rest.
    beyond: usize,
}

impl<'a> Share<'a> {
    fn nodes(&self) -> &'a [Supernode] {
        &self.supernodes.nodes[self.nodes[0]..self.nodes[1]]
    }

    fn first(&self) -> usize {
        self.supernodes.column(self.nodes[0])
    }
}

/// Solves L D y = b for the columns of a share; with what its rows take off the rest.
struct Forward<'a> {
    share: &'a Share<'a>,
    right: &'a mut [f64],
    rest: &'a mut [f64],
    below: &'a mut [f64],
}

impl WithSimd for Forward<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { share, right, rest, below } = self;
        let (first, beyond) = (share.first(), share.beyond);
        rest.fill(0.0);
        for node in share.nodes() {
            let (width, height, edge) = (node.width, node.height(), padded(node.width));
            let panel = &share.value[node.value..node.value + height * width];
            let unknowns = &mut right[node.first - first..][..width];
            for (c, column) in panel.chunks_exact(height).enumerate() {
                let (before, after) = unknowns.split_at_mut(c + 1);
                let lower = &column[c + 1..width];
                after.iter_mut().zip(lower).for_each(|(after, lower)| *after -= before[c] * lower);
            }
            let sums = &mut below[..height - edge];
            multiply(simd, panel, unknowns, edge, sums);
            for (row, sum) in share.supernodes.rows(node).iter().map(|&row| row as usize).zip(&*sums) {
                if row < beyond {
                    right[row - first] -= sum;
                } else {
                    rest[row - beyond] += sum;
                }
            }
        }
        right.iter_mut().zip(&share.pivot[first..]).for_each(|(entry, pivot)| *entry /= pivot);
    }
}

/// Solves Lᵀ x = y for the columns of a share, with x of the rest.
struct Backward<'a> {
    share: &'a Share<'a>,
    right: &'a mut [f64],
    rest: &'a [f64],
    below: &'a mut [f64],
}

impl WithSimd for Backward<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { share, right, rest, below } = self;
        let (first, beyond) = (share.first(), share.beyond);
        for node in share.nodes().iter().rev() {
            let (width, height, edge) = (node.width, node.height(), padded(node.width));
            let panel = &share.value[node.value..node.value + height * width];
            let below = &mut below[..height - edge];
            below.fill(0.0);
            for (row, below) in share.supernodes.rows(node).iter().map(|&row| row as usize).zip(&mut *below) {
                *below = if row < beyond { right[row - first] } else { rest[row - beyond] };
            }
            let unknowns = &mut right[node.first - first..][..width];
            for (c, column) in panel.chunks_exact(height).enumerate().rev() {
                let lower = column[c + 1..width].iter().zip(&unknowns[c + 1..]);
                unknowns[c] -= dot(simd, &column[edge..], below) + lower.map(|(l, x)| l * x).sum::<f64>();
            }
        }
    }
}

#[cfg(test)]
mod tests;
