//! The coarse equations of the rigid motions of aggregates.

use nalgebra::Vector3;
use pulp::{Simd, WithSimd};
use rayon::prelude::*;

use super::blocks::{Block, BlockMatrix, Node, SingleBlock, entry_of};
use super::kernels::SingleRow;
use crate::factors::Factors;
use crate::report::LinearError;
use crate::sparse::{Equations, LowerMatrix};

/// Pivots of the coarse matrix above minus this part of the diagonal are zero but for round-off.
const ROUND_OFF: f64 = 1e-10;

/// Rigid motions of the aggregates. With P the motion of nodes over the motions of aggregates, the coarse
/// matrix is Pᵀ A P.
pub(crate) struct Coarse {
    /// Arm of each node from the middle of its aggregate [m].
    arm: Vec<Vector3<f64>>,
    /// The aggregate of each node.
    aggregate: Vec<u32>,
    projected: Projected,
    matrix: LowerMatrix,
    factors: Factors,
    /// Pairs of aggregates (row, column) that touch, with the blocks of Pᵀ A between them …
    pairs: Vec<(u32, u32, Vec<u32>)>,
    /// … and the coarse ones.
    value: Vec<Block>,
    motion: Vec<f64>,
    force: Vec<f64>,
}

/// Pᵀ A: the forces on aggregates that resist the motion of a node.
struct Projected {
    /// Starts of the blocks of each aggregate, and the end of the last.
    start: Vec<u32>,
    /// Aggregate and node of each block, increasing.
    aggregate: Vec<u32>,
    node: Vec<u32>,
    value: Vec<Block>,
    single: Vec<SingleBlock>,
}

impl Projected {
    fn new(fine: &BlockMatrix) -> Self {
        let (mut start, mut aggregates, mut nodes) = (vec![0], Vec::new(), Vec::new());
        for (aggregate, ends) in fine.aggregate_start.windows(2).enumerate() {
            let rows = fine.row_start[ends[0] as usize] as usize..fine.row_start[ends[1] as usize] as usize;
            let mut columns = fine.column[rows].to_vec();
            columns.sort_unstable();
            columns.dedup();
            nodes.append(&mut columns);
            aggregates.resize(nodes.len(), aggregate as u32);
            start.push(nodes.len() as u32);
        }
        let value = vec![Block::zeros(); nodes.len()];
        let single = vec![[0.0; 36]; nodes.len()];
        Self { start, aggregate: aggregates, node: nodes, value, single }
    }

    fn of(&self, aggregate: usize) -> std::ops::Range<usize> {
        self.start[aggregate] as usize..self.start[aggregate + 1] as usize
    }

    /// Takes the fine matrix, with the aggregates of nodes and their arms.
    fn update(&mut self, fine: &BlockMatrix, home: &[u32], arm: &[Vector3<f64>]) {
        let ends = self.aggregate.par_iter().zip(&self.node);
        let blocks = self.value.par_iter_mut().zip(&mut self.single).zip(ends);
        blocks.with_min_len(64).for_each(|((value, single), (&aggregate, &node))| {
            fine.arch.dispatch(Project { fine, home, arm, aggregate, node, value, single });
        });
    }
}

/// The block of Pᵀ A between an aggregate and a node.
struct Project<'a> {
    fine: &'a BlockMatrix,
    home: &'a [u32],
    arm: &'a [Vector3<f64>],
    aggregate: u32,
    node: u32,
    value: &'a mut Block,
    single: &'a mut SingleBlock,
}

impl WithSimd for Project<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { fine, home, arm, aggregate, node, value, single } = self;
        let mut sum = Block::zeros();
        for at in fine.row(node as usize) {
            let other = fine.column[at] as usize;
            if home[other] == aggregate {
                add_rigid(&fine.value[at], &arm[other], &mut sum);
            }
        }
        let (sum, value) = (sum.as_slice(), value.as_mut_slice());
        for row in 0..6 {
            for column in 0..6 {
                value[6 * column + row] = sum[6 * row + column];
                single[entry_of(row, column)] = sum[6 * row + column] as f32;
            }
        }
    }
}

/// The block of Pᵀ A P of two aggregates, from some of Pᵀ A.
struct Condense<'a> {
    projected: &'a Projected,
    arm: &'a [Vector3<f64>],
    blocks: &'a [u32],
    value: &'a mut Block,
}

impl WithSimd for Condense<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { projected, arm, blocks, value } = self;
        value.fill(0.0);
        for at in blocks.iter().map(|&at| at as usize) {
            add_rigid(&projected.value[at], &arm[projected.node[at] as usize], value);
        }
    }
}

/// Adds B P of a node with an arm d, P = [I −S(d); 0 I].
#[inline(always)]
fn add_rigid(block: &Block, arm: &Vector3<f64>, to: &mut Block) {
    let (block, to) = (block.as_slice(), to.as_mut_slice());
    (0..36).for_each(|at| to[at] += block[at]);
    for row in 0..6 {
        let [x, y, z] = [block[row], block[6 + row], block[12 + row]];
        to[18 + row] += z * arm.y - y * arm.z;
        to[24 + row] += x * arm.z - z * arm.x;
        to[30 + row] += y * arm.x - x * arm.y;
    }
}

impl Coarse {
    pub(crate) fn new(fine: &BlockMatrix) -> Result<Self, LinearError> {
        let count = fine.aggregate_start.len() - 1;
        let mut aggregate = vec![0; fine.nodes()];
        for (number, ends) in fine.aggregate_start.windows(2).enumerate() {
            aggregate[ends[0] as usize..ends[1] as usize].fill(number as u32);
        }
        let projected = Projected::new(fine);
        let mut touching: std::collections::BTreeMap<(u32, u32), Vec<u32>> =
            std::collections::BTreeMap::new();
        for (at, (&row, &node)) in (0..).zip(projected.aggregate.iter().zip(&projected.node)) {
            let column = aggregate[node as usize];
            if row >= column {
                touching.entry((column, row)).or_default().push(at);
            }
        }
        let pairs: Vec<(u32, u32, Vec<u32>)> =
            touching.into_iter().map(|((column, row), blocks)| (row, column, blocks)).collect();
        let equations = Equations::new(&vec![true; 6 * count]);
        let ends: Vec<[u32; 2]> = pairs.iter().map(|(row, column, _)| [*row, *column]).collect();
        let matrix = LowerMatrix::new(&equations, ends.iter().map(|pair| &pair[..]), &[]);
        Ok(Self {
            arm: vec![Vector3::zeros(); fine.nodes()],
            aggregate,
            projected,
            factors: Factors::new(&matrix)?,
            matrix,
            value: vec![Block::zeros(); pairs.len()],
            pairs,
            motion: vec![0.0; 6 * count],
            force: vec![0.0; 6 * count],
        })
    }

    /// Takes new positions of the model's nodes.
    pub(crate) fn place(&mut self, fine: &BlockMatrix, position: &[Vector3<f64>]) {
        for ends in fine.aggregate_start.windows(2) {
            let members = ends[0] as usize..ends[1] as usize;
            let place = |node: usize| position[fine.number[node] as usize];
            let centre = members.clone().map(place).sum::<Vector3<f64>>() / members.len() as f64;
            members.for_each(|node| self.arm[node] = place(node) - centre);
        }
    }

    /// Takes the fine matrix.
    pub(crate) fn update(&mut self, fine: &BlockMatrix) {
        let Self { arm, aggregate, projected, value, pairs, .. } = self;
        projected.update(fine, aggregate, arm);
        value.par_iter_mut().zip(&*pairs).with_min_len(16).for_each(|(value, (_, _, blocks))| {
            fine.arch.dispatch(Condense { projected, arm, blocks, value });
        });
    }

    /// Pairs of aggregates (row, column) that touch.
    pub(crate) fn touching(&self) -> Vec<[u32; 2]> {
        self.pairs.iter().map(|(row, column, _)| [*row, *column]).collect()
    }

    /// Arms of the nodes [m], and the blocks between aggregates.
    pub(crate) fn parts(&self) -> (&[Vector3<f64>], &[Block]) {
        (&self.arm, &self.value)
    }

    /// Factors the coarse matrix; its negative pivots. As deflated directions have no part in it, iterations
    /// do not meet negative stiffness there.
    pub(crate) fn factorise(&mut self) -> Result<usize, LinearError> {
        for ((row, column, _), value) in self.pairs.iter().zip(&self.value) {
            for j in 0..6 {
                let (start, rows) =
                    (self.matrix.column_start[6 * *column as usize + j], 6 * column + j as u32);
                let below = self.matrix.rows(rows).partition_point(|&r| r < 6 * row);
                let first = if row == column { j } else { 0 };
                for i in first..6 {
                    self.matrix.value[start as usize + below + i - first] = value[(i, j)];
                }
            }
        }
        let pivots = self.factors.factorise(&self.matrix).ok_or(LinearError::NotFinite)?;
        // Motions that no node of an aggregate has leave pivots of round-off.
        Ok(if pivots.lowest < -ROUND_OFF { pivots.negative } else { 0 })
    }

    /// Finds the rigid motions c = (Pᵀ A P)⁻¹ Pᵀ (r − A z); r · P c.
    pub(crate) fn solve(&mut self, fine: &BlockMatrix, r: &[Node], z: &[Node]) -> f64 {
        let Self { arm, projected, force, motion, .. } = self;
        let aggregates = force.par_chunks_exact_mut(6).zip(motion.par_chunks_exact_mut(6)).enumerate();
        aggregates.with_min_len(16).for_each(|(number, (force, motion))| {
            let nodes = fine.aggregate_start[number] as usize..fine.aggregate_start[number + 1] as usize;
            force.copy_from_slice(&resultant(&r[nodes.clone()], &arm[nodes]));
            let range = projected.of(number);
            let blocks = &projected.single[range.clone()];
            let resisted = fine.arch.dispatch(SingleRow { blocks, columns: &projected.node[range], x: z });
            (0..6).for_each(|c| motion[c] = force[c] - resisted[c]);
        });
        self.factors.solve(&mut self.motion);
        self.force.iter().zip(&self.motion).map(|(f, m)| f * m).sum()
    }

    /// Motion of a node from the rigid motion of its aggregate.
    #[inline(always)]
    pub(super) fn motion(&self, node: usize) -> Node {
        let first = 6 * self.aggregate[node] as usize;
        let [t, w] = [0, 3].map(|c| {
            Vector3::new(self.motion[first + c], self.motion[first + c + 1], self.motion[first + c + 2])
        });
        let moved = t + w.cross(&self.arm[node]);
        [moved.x, moved.y, moved.z, w.x, w.y, w.z]
    }
}

/// Resultant and moment of forces on nodes with arms.
fn resultant(forces: &[Node], arms: &[Vector3<f64>]) -> Node {
    let mut sum = [0.0; 6];
    for (node, arm) in forces.iter().zip(arms) {
        let [f, m] = halves(node);
        let moment = m + arm.cross(&f);
        for c in 0..3 {
            sum[c] += f[c];
            sum[3 + c] += moment[c];
        }
    }
    sum
}

fn halves(node: &Node) -> [Vector3<f64>; 2] {
    [Vector3::new(node[0], node[1], node[2]), Vector3::new(node[3], node[4], node[5])]
}
