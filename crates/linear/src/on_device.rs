//! Conjugate gradients on a device: the search around its passes. Each pass finds a correction d with A d ≈
//! r. The CPU finds the residual r = b − A x of the sum of the corrections in double precision. This residual
//! alone decides when the solution is good enough. The CPU solves the rest that single precision cannot.

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::conjugate_gradients::{Block, BlockMatrix, Coarse, KrylovVectors};
use crate::device::{BlockValues, DeviceSolver, DeviceTimes, PassEnd};
use crate::report::{DeviceError, LinearError, LinearReport};
use crate::sparse::LowerMatrix;

/// The least residual over the right-hand side that is asked for in one pass: single precision comes no
/// nearer on stiff walls.
const LEAST_GOAL: f64 = 1e-4;
/// The part of the tolerance that a pass aims at, so that round-off seldom makes another pass necessary.
const MARGIN: f64 = 0.9;
/// The largest residual that a pass aims at, and what it must reach: else it is the last one.
const MOST_GOAL: f64 = 0.25;
const WORTHWHILE: f64 = 0.5;

/// Equations on a device, with what they are handed over in.
#[derive(Debug)]
pub(crate) struct OnDevice {
    solver: Box<dyn DeviceSolver>,
    /// True if the solver has the pattern.
    is_arranged: bool,
    lower: Vec<f32>,
    inverse: Vec<f32>,
    arm: Vec<[f32; 4]>,
    coarse: Vec<f32>,
    right: Vec<f32>,
    solution: Vec<f32>,
}

/// A solution, or a notice that the CPU has to continue.
pub(crate) enum Found {
    Solution(Result<LinearReport, LinearError>),
    /// Number of iterations after which single precision makes no more progress.
    Rest(usize),
}

impl OnDevice {
    /// The equations of a pattern, on a solver that may have had others before. It gets the pattern with the
    /// first matrix at the latest.
    pub(crate) fn new(
        solver: Box<dyn DeviceSolver>,
        matrix: &LowerMatrix,
        blocks: &BlockMatrix,
        coarse: Option<&Coarse>,
    ) -> Self {
        let numbers = 6 * blocks.nodes();
        let [nodes, pairs] = coarse.map_or([0; 2], |coarse| [coarse.parts().0.len(), coarse.parts().1.len()]);
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
