//! Conjugate gradients on a device, in single precision: what a device is given, and the search around it. Each pass of the device finds a
//! correction d with A d ≈ r; the residual r = b − A x of the sum of the corrections is found in double precision on the CPU and alone
//! decides when the solution is good enough. What single precision cannot solve is left to the CPU.

use std::fmt::Debug;
use std::time::Duration;

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::conjugate_gradients::{Block, BlockMatrix, Coarse, KrylovVectors};
use crate::report::{LinearError, LinearReport};
use crate::sparse::LowerMatrix;

/// The least residual over the right-hand side that is asked for in one pass: single precision comes no nearer on stiff walls.
const LEAST_GOAL: f64 = 1e-4;
/// The part of the tolerance that a pass aims at, so that round-off seldom makes another pass necessary.
const MARGIN: f64 = 0.9;
/// The largest residual that a pass aims at, and what it must reach: else it is the last one.
const MOST_GOAL: f64 = 0.25;
const WORTHWHILE: f64 = 0.5;

/// Why a device solves no equations, with a remedy.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct DeviceError(pub String);

/// A device that solves linear equations.
pub trait LinearDevice: Debug + Send + Sync {
    /// The number of aggregates that suits it: it solves for their motions with a full inverse.
    fn aggregates(&self) -> usize;

    /// A solver, which has no equations so far.
    ///
    /// # Errors
    /// If the device fails or lacks something.
    fn solver(&self) -> Result<Box<dyn DeviceSolver>, DeviceError>;
}

/// Where the blocks of a symmetric matrix are, row by row. Nodes go aggregate by aggregate, each with six components.
#[derive(Clone, Debug)]
pub struct BlockPattern<'a> {
    /// Where the blocks of each node start, and the end of the last.
    pub row_start: &'a [u32],
    /// The column of each block.
    pub column: &'a [u32],
    /// Where each entry of each block, column by column, comes from in the lower half; `u32::MAX`: it is 0.
    pub source: &'a [u32],
    /// The components of each node that have an equation, a bit each.
    pub free: Vec<u32>,
    /// Where the nodes of each aggregate start, and the end of the last.
    pub aggregate_start: &'a [u32],
    /// Pairs of aggregates (row, column) that touch, row ≥ column; `None` where their motions are not solved for.
    pub touching: Option<Vec<[u32; 2]>>,
}

impl BlockPattern<'_> {
    /// The number of nodes.
    pub fn nodes(&self) -> usize {
        self.free.len()
    }

    /// The number of aggregates.
    pub fn aggregates(&self) -> usize {
        self.aggregate_start.len() - 1
    }
}

/// The numbers of a matrix.
#[derive(Clone, Copy, Debug)]
pub struct BlockValues<'a> {
    /// The lower half, as [`BlockPattern::source`] counts it.
    pub lower: &'a [f32],
    /// Inverses of the diagonal blocks, column by column.
    pub inverse: &'a [f32],
    /// The arm [m] of each node from the middle of its aggregate, and 0.
    pub arm: &'a [[f32; 4]],
    /// Blocks between aggregates that touch, column by column.
    pub coarse: &'a [f32],
}

/// What a pass reached.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pass {
    /// Its iterations.
    pub iterations: usize,
    /// How it ended.
    pub end: PassEnd,
}

/// How a pass ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PassEnd {
    /// Its residual is below the goal.
    Reached,
    /// Iterations ran out.
    OutOfIterations,
    /// A direction seems to have no positive stiffness, in single precision.
    Indefinite,
}

/// Equations on a device.
pub trait DeviceSolver: Debug + Send + Sync {
    /// Takes the pattern of the matrices to come, in place of any before. After an error it has none, and may be given one again.
    ///
    /// # Errors
    /// If the device fails or has no room.
    fn arrange(&mut self, pattern: &BlockPattern<'_>) -> Result<(), DeviceError>;

    /// Takes a matrix.
    ///
    /// # Errors
    /// If the device fails.
    fn take(&mut self, values: &BlockValues<'_>) -> Result<(), DeviceError>;

    /// Solves for a right-hand side of size 1 from 0 on, until the residual is `goal` or so many iterations are done.
    ///
    /// # Errors
    /// If the device fails.
    fn solve(
        &mut self,
        right: &[f32],
        solution: &mut [f32],
        goal: f32,
        iterations: usize,
    ) -> Result<Pass, DeviceError>;

    /// Time spent so far.
    fn times(&self) -> DeviceTimes;
}

/// Wall time that a device took for linear equations so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DeviceTimes {
    /// Handing matrices to the device; it copies and prepares them while the CPU goes on.
    pub upload: Duration,
    /// From handing over right-hand sides to the end of the iterations, with what is left of the preparation.
    pub iterations: Duration,
    /// Reading solutions back.
    pub read_back: Duration,
}

/// Equations on a device, with what they are handed over in.
#[derive(Debug)]
pub(crate) struct OnDevice {
    solver: Box<dyn DeviceSolver>,
    /// Whether the solver has the pattern.
    is_arranged: bool,
    lower: Vec<f32>,
    inverse: Vec<f32>,
    arm: Vec<[f32; 4]>,
    coarse: Vec<f32>,
    right: Vec<f32>,
    solution: Vec<f32>,
}

/// A solution, or that the CPU has to go on.
pub(crate) enum Found {
    Solution(Result<LinearReport, LinearError>),
    /// After so many iterations single precision does no more.
    Rest(usize),
}

impl OnDevice {
    /// The equations of a pattern, on a solver that may have had others before. It gets the pattern with the first matrix at the latest.
    pub(crate) fn new(
        solver: Box<dyn DeviceSolver>,
        matrix: &LowerMatrix,
        blocks: &BlockMatrix,
        coarse: Option<&Coarse>,
    ) -> Self {
        let numbers = 6 * blocks.nodes();
        let [nodes, pairs] = coarse.map_or([0; 2], |own| [own.parts().0.len(), own.parts().1.len()]);
        Self {
            solver,
            is_arranged: false,
            lower: vec![0.0; matrix.value.len()],
            inverse: vec![0.0; 6 * numbers],
            arm: vec![[0.0; 4]; nodes],
            coarse: vec![0.0; 36 * pairs],
            right: vec![0.0; numbers],
            solution: vec![0.0; numbers],
        }
    }

    /// The solver, for another pattern.
    pub(crate) fn into_solver(self) -> Box<dyn DeviceSolver> {
        self.solver
    }

    /// Hands over the pattern, unless the device has it.
    pub(crate) fn arrange(
        &mut self,
        blocks: &BlockMatrix,
        coarse: Option<&Coarse>,
    ) -> Result<(), DeviceError> {
        if !self.is_arranged {
            self.solver.arrange(&blocks.pattern(coarse.map(Coarse::touching)))?;
            self.is_arranged = true;
        }
        Ok(())
    }

    /// Hands over a matrix, unless it is empty.
    pub(crate) fn take(
        &mut self,
        matrix: &LowerMatrix,
        blocks: &BlockMatrix,
        coarse: Option<&Coarse>,
    ) -> Result<(), DeviceError> {
        const SHARE: usize = 1 << 14;
        if self.lower.is_empty() {
            return Ok(());
        }
        self.arrange(blocks, coarse)?;
        let round = |to: &mut [f32], from: &[f64]| {
            let parts = to.par_chunks_mut(SHARE).zip(from.par_chunks(SHARE));
            parts.for_each(|(to, from)| to.iter_mut().zip(from).for_each(|(to, from)| *to = *from as f32));
        };
        let round_blocks = |to: &mut [f32], from: &[Block]| {
            let parts = to.par_chunks_mut(36).zip(from).with_min_len(256);
            parts.for_each(|(to, from)| {
                to.iter_mut().zip(from.as_slice()).for_each(|(to, from)| *to = *from as f32)
            });
        };
        round(&mut self.lower, &matrix.value);
        blocks.write_inverses(&mut self.inverse);
        if let Some(coarse) = coarse {
            let (arms, values) = coarse.parts();
            let four = |arm: &Vector3<f64>| [arm.x as f32, arm.y as f32, arm.z as f32, 0.0];
            self.arm.iter_mut().zip(arms).for_each(|(to, arm)| *to = four(arm));
            round_blocks(&mut self.coarse, values);
        }
        let Self { solver, lower, inverse, arm, coarse, .. } = self;
        solver.take(&BlockValues { lower, inverse, arm, coarse })
    }

    /// x ← A⁻¹ b, as [`KrylovVectors::solve`] does.
    pub(crate) fn solve(
        &mut self,
        vectors: &mut KrylovVectors,
        blocks: &BlockMatrix,
        b: &[f64],
        x: &mut [f64],
        tolerance: f64,
        iterations: usize,
    ) -> Found {
        let found = rayon::scope(|_| self.refine(vectors, blocks, b, x, tolerance, iterations));
        vectors.take(blocks, x);
        found
    }

    fn refine(
        &mut self,
        vectors: &mut KrylovVectors,
        blocks: &BlockMatrix,
        b: &[f64],
        x: &[f64],
        tolerance: f64,
        iterations: usize,
    ) -> Found {
        let [size, mut left] = vectors.begin(blocks, b, x);
        let mut report = LinearReport::default();
        if size == 0.0 {
            return Found::Solution(Ok(report));
        }
        loop {
            report.residual = left / size;
            if report.residual <= tolerance {
                return Found::Solution(Ok(report));
            }
            if report.iterations >= iterations {
                return Found::Solution(Err(LinearError::Stalled(report)));
            }
            if !left.is_finite() {
                return Found::Solution(Err(LinearError::NotFinite));
            }
            vectors.direction(left, &mut self.right);
            let goal = (MARGIN * tolerance / report.residual).clamp(LEAST_GOAL, MOST_GOAL);
            let most = iterations - report.iterations;
            let pass = match self.solver.solve(&self.right, &mut self.solution, goal as f32, most) {
                Ok(pass) => pass,
                Err(error) => return Found::Solution(Err(LinearError::Device(error))),
            };
            report.iterations += pass.iterations;
            if !self.solution.iter().all(|d| d.is_finite()) {
                return Found::Rest(report.iterations);
            }
            let after = vectors.correct(blocks, b, left, &self.solution);
            if after > left {
                self.solution.iter_mut().for_each(|d| *d = -*d);
                vectors.correct(blocks, b, left, &self.solution);
                return Found::Rest(report.iterations);
            }
            if after > WORTHWHILE * left && pass.end != PassEnd::OutOfIterations {
                return Found::Rest(report.iterations);
            }
            left = after;
        }
    }

    pub(crate) fn times(&self) -> DeviceTimes {
        self.solver.times()
    }
}

#[cfg(test)]
mod tests;
