//! A matrix as 6 × 6 blocks of the nodes.

use nalgebra::SMatrix;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::aggregates::aggregates;
use crate::device::BlockPattern;
use crate::lanes::{PACK, Pack};
use crate::sparse::{Equations, LowerMatrix, NONE};

/// Blocks from which on iterations read them in single precision: 9 MB in double precision. Of fewer these
/// are as fast.
const MANY: usize = 1 << 15;

/// The tolerance from which on they do.
const COARSE_TOLERANCE: f64 = 1e-5;

pub(crate) type Block = SMatrix<f64, 6, 6>;
pub(crate) type Node = [f64; 6];

/// Both halves of a symmetric matrix as 6 × 6 blocks, row by row; nodes in an order of their own, aggregate
/// by aggregate. Components without an equation are 0.
pub(crate) struct BlockMatrix {
    /// Equations of each node.
    pub(super) equations: Vec<[u32; 6]>,
    /// The node's number in the model.
    pub(super) number: Vec<u32>,
    /// Starts of the nodes of each aggregate, and the end of the last.
    pub(super) aggregate_start: Vec<u32>,
    pub(super) row_start: Vec<u32>,
    pub(super) column: Vec<u32>,
    pub(super) value: Vec<Block>,
    /// The blocks in single precision, if they are many.
    pub(super) single: Vec<SingleBlock>,
    /// Places in the lower half that the entries come from.
    pub(super) source: Vec<[u32; 36]>,
    /// Places of the diagonal blocks, and their inverses.
    pub(super) diagonal: Vec<u32>,
    pub(super) inverse: Vec<SingleBlock>,
    /// The instructions of the processor.
    pub(super) arch: Arch,
}

/// A block in single precision, half as much to read: its first four rows column by column, then the last
/// two.
pub(super) type SingleBlock = [f32; 36];

/// The place of an entry in it.
pub(super) const fn entry_of(row: usize, column: usize) -> usize {
    if row < 4 { 4 * column + row } else { 24 + 2 * column + row - 4 }
}

fn to_single(block: &Block, to: &mut SingleBlock) {
    let block = block.as_slice();
    for column in 0..6 {
        for row in 0..6 {
            to[entry_of(row, column)] = block[6 * column + row] as f32;
        }
    }
}

impl BlockMatrix {
    /// The pattern of a matrix, with at most about `most` aggregates.
    pub(crate) fn new(equations: &Equations, matrix: &LowerMatrix, most: usize) -> Self {
        let mut nodes: Vec<(u32, [u32; 6])> = Vec::new();
        // Of each node of the model, its place among those with equations.
        let mut place = vec![NONE; equations.number.len() / 6];
        for (node, c) in equations.number.chunks_exact(6).enumerate() {
            if c.iter().any(|&e| e != NONE) {
                place[node] = nodes.len() as u32;
                nodes.push((node as u32, [c[0], c[1], c[2], c[3], c[4], c[5]]));
            }
        }
        let home = |equation: u32| {
            let component = equations.component[equation as usize];
            (place[component as usize / 6] as usize, component as usize % 6)
        };
        let mut around: Vec<Vec<u32>> = vec![Vec::new(); nodes.len()];
        for (a, (_, numbers)) in nodes.iter().enumerate() {
            for &column in numbers.iter().filter(|&&e| e != NONE) {
                for &row in matrix.rows(column) {
                    let b = home(row).0;
                    around[a].push(b as u32);
                    around[b].push(a as u32);
                }
            }
        }
        for neighbours in &mut around {
            neighbours.sort_unstable();
            neighbours.dedup();
        }
        let (order, aggregate_start) = aggregates(&around, most);
        let mut position = vec![0; nodes.len()];
        for (at, &old) in order.iter().enumerate() {
            position[old as usize] = at as u32;
        }
        let (mut row_start, mut column) = (vec![0], Vec::new());
        for &old in &order {
            let first = column.len();
            column.extend(around[old as usize].iter().map(|&b| position[b as usize]));
            column[first..].sort_unstable();
            row_start.push(column.len() as u32);
        }
        let mut blocks = Self {
            equations: order.iter().map(|&old| nodes[old as usize].1).collect(),
            number: order.iter().map(|&old| nodes[old as usize].0).collect(),
            aggregate_start,
            value: vec![Block::zeros(); column.len()],
            single: Vec::new(),
            source: vec![[NONE; 36]; column.len()],
            diagonal: Vec::new(),
            inverse: vec![[0.0; 36]; order.len()],
            row_start,
            column,
            arch: Arch::new(),
        };
        blocks.diagonal = (0..order.len() as u32).map(|node| blocks.find(node, node) as u32).collect();
        for equation in 0..matrix.columns() as u32 {
            let (node, j) = home(equation);
            for (at, &row) in (matrix.column_start[equation as usize]..).zip(matrix.rows(equation)) {
                let (other, i) = home(row);
                let (a, b) = (position[other], position[node]);
                let [here, there] = [(a, b), (b, a)].map(|(row, column)| blocks.find(row, column));
                blocks.source[here][6 * j + i] = at;
                blocks.source[there][6 * i + j] = at;
            }
        }
        blocks
    }

    /// Has iterations to a tolerance read the blocks in single precision, if they are many and the tolerance
    /// is coarse enough.
    pub(crate) fn read_for(mut self, tolerance: f64) -> Self {
        if self.value.len() >= MANY && tolerance >= COARSE_TOLERANCE {
            self.single = vec![[0.0; 36]; self.value.len()];
        }
        self
    }

    pub(crate) fn nodes(&self) -> usize {
        self.equations.len()
    }

    /// Pattern of the blocks for a device, with the pairs of touching aggregates where wanted.
    pub(crate) fn pattern(&self, touching: Option<Vec<[u32; 2]>>) -> BlockPattern<'_> {
        let bit = |(c, &equation): (usize, &u32)| u32::from(equation != NONE) << c;
        BlockPattern {
            row_start: &self.row_start,
            column: &self.column,
            source: self.source.as_flattened(),
            free: self.equations.iter().map(|numbers| numbers.iter().enumerate().map(bit).sum()).collect(),
            aggregate_start: &self.aggregate_start,
            touching,
        }
    }

    /// Writes the inverses of the diagonal blocks, column by column.
    pub(crate) fn write_inverses(&self, to: &mut [f32]) {
        let blocks = to.par_chunks_exact_mut(36).zip(&self.inverse).with_min_len(256);
        blocks.for_each(|(to, inverse)| {
            for (at, to) in to.iter_mut().enumerate() {
                *to = inverse[entry_of(at % 6, at / 6)];
            }
        });
    }

    pub(super) fn row(&self, node: usize) -> std::ops::Range<usize> {
        self.row_start[node] as usize..self.row_start[node + 1] as usize
    }

    fn find(&self, row: u32, column: u32) -> usize {
        let range = self.row(row as usize);
        range.start + self.column[range].partition_point(|&c| c < column)
    }

    /// Takes the values of a matrix and inverts the diagonal blocks, while `beside` works with the values on
    /// another thread. Whether all these blocks are positive definite, and the result of `beside`.
    pub(crate) fn update<T: Send>(
        &mut self,
        matrix: &LowerMatrix,
        beside: impl FnOnce(&Self) -> T + Send,
    ) -> (bool, T) {
        let entry = |&at: &u32| if at == NONE { 0.0 } else { matrix.value[at as usize] };
        let take = |value: &mut Block, source: &[u32; 36]| {
            value.iter_mut().zip(source).for_each(|(value, at)| *value = entry(at));
        };
        let blocks = self.value.par_iter_mut().zip(&self.source).with_min_len(64);
        if self.single.is_empty() {
            blocks.for_each(|(value, source)| take(value, source));
        } else {
            blocks.zip(&mut self.single).for_each(|((value, source), single)| {
                take(value, source);
                to_single(value, single);
            });
        }
        let mut inverse = std::mem::take(&mut self.inverse);
        let updated = &*self;
        let (done, sound) = rayon::join(|| beside(updated), || updated.invert(&mut inverse));
        self.inverse = inverse;
        (sound, done)
    }

    fn invert(&self, inverse: &mut [SingleBlock]) -> bool {
        let packs = inverse.par_chunks_mut(PACK).enumerate().with_min_len(8);
        let sound = packs
            .map(|(pack, inverse)| self.arch.dispatch(Invert { matrix: self, first: pack * PACK, inverse }));
        sound.reduce(|| true, |a, b| a && b)
    }

    pub(super) fn gather(&self, equations: &[f64], nodes: &mut [Node]) {
        for (numbers, values) in self.equations.iter().zip(nodes) {
            for (&equation, value) in numbers.iter().zip(values) {
                *value = if equation == NONE { 0.0 } else { equations[equation as usize] };
            }
        }
    }

    pub(super) fn scatter(&self, nodes: &[Node], equations: &mut [f64]) {
        for (numbers, values) in self.equations.iter().zip(nodes) {
            for (&equation, value) in numbers.iter().zip(values) {
                if equation != NONE {
                    equations[equation as usize] = *value;
                }
            }
        }
    }
}

/// Growth factor of the diagonals of inverses. It exceeds the rounding error of six numbers of a row, so that
/// the inverse stays positive definite.
const GROWN: f64 = 1.0 + 4.0 * f32::EPSILON as f64;

/// Inverts the diagonal blocks of some nodes from one on, with ones where these have no equation; false if
/// one is not positive definite.
struct Invert<'a> {
    matrix: &'a BlockMatrix,
    first: usize,
    inverse: &'a mut [SingleBlock],
}

impl WithSimd for Invert<'_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> bool {
        let Self { matrix, first, inverse } = self;
        let mut a = [[[0.0; PACK]; 6]; 6];
        (0..6).for_each(|k| a[k][k] = [1.0; PACK]);
        let diagonal = matrix.equations[first..].iter().zip(&matrix.diagonal[first..]);
        for (lane, (equations, &at)) in diagonal.take(inverse.len()).enumerate() {
            let block = matrix.value[at as usize].as_slice();
            for (i, row) in a.iter_mut().enumerate() {
                for (j, entry) in row.iter_mut().enumerate() {
                    entry[lane] = block[6 * j + i];
                }
                if equations[i] == NONE {
                    row[i][lane] = 1.0;
                }
            }
        }
        let sound = invert(&mut a);
        for (lane, inverse) in inverse.iter_mut().enumerate() {
            for i in 0..6 {
                for j in 0..6 {
                    let entry = a[i.max(j)][i.min(j)][lane];
                    inverse[entry_of(i, j)] = (if i == j { entry * GROWN } else { entry }) as f32;
                }
            }
        }
        sound
    }
}

/// Inverts symmetric matrices side by side, by Gauss and Jordan's elimination; false if one is not positive
/// definite.
#[inline(always)]
pub(super) fn invert(a: &mut [[Pack; 6]; 6]) -> bool {
    let mut sound = true;
    for k in 0..6 {
        let row = a[k];
        sound &= row[k].iter().all(|&pivot| pivot > 0.0);
        for target in &mut *a {
            let factor: Pack = std::array::from_fn(|lane| target[k][lane] / row[k][lane]);
            for (entry, row) in target.iter_mut().zip(&row) {
                let lanes = entry.iter_mut().zip(row).zip(&factor);
                lanes.for_each(|((number, row), factor)| *number -= factor * row);
            }
            target[k] = factor.map(|factor| -factor);
        }
        a[k] = row.map(|entry| std::array::from_fn(|lane| entry[lane] / row[k][lane]));
        a[k][k] = row[k].map(|pivot| 1.0 / pivot);
    }
    sound
}
