//! Linear equations on a device, in single precision: what a device is given, and what it answers.

use std::fmt::Debug;
use std::time::Duration;

use crate::report::DeviceError;

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

/// Pattern of the blocks of a symmetric matrix, row by row. Nodes go aggregate by aggregate, each with six
/// components.
#[derive(Clone, Debug)]
pub struct BlockPattern<'a> {
    /// Starts of the blocks of each node, and the end of the last.
    pub row_start: &'a [u32],
    /// The column of each block.
    pub column: &'a [u32],
    /// Place in the lower half of each entry of each block, column by column; `u32::MAX`: the entry is 0.
    pub source: &'a [u32],
    /// The components of each node that have an equation, a bit each.
    pub free: Vec<u32>,
    /// Starts of the nodes of each aggregate, and the end of the last.
    pub aggregate_start: &'a [u32],
    /// Pairs of aggregates (row, column) that touch, row ≥ column; `None` where their motions are not solved
    /// for.
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

/// Result of a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pass {
    /// Its iterations.
    pub iterations: usize,
    /// End of the pass.
    pub end: PassEnd,
}

/// End of a pass.
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
    /// Takes the pattern of the matrices to come, in place of any before. After an error it has none, and may
    /// be given one again.
    ///
    /// # Errors
    /// If the device fails or has no room.
    fn arrange(&mut self, pattern: &BlockPattern<'_>) -> Result<(), DeviceError>;

    /// Takes a matrix.
    ///
    /// # Errors
    /// If the device fails.
    fn take(&mut self, values: &BlockValues<'_>) -> Result<(), DeviceError>;

    /// Solves for a right-hand side of size 1, starting from 0, until the residual is `goal` or a number of
    /// iterations is done.
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
    /// Handing matrices to the device, which copies and prepares them while the CPU continues.
    pub upload: Duration,
    /// From handing over right-hand sides to the end of the iterations, with the rest of the preparation.
    pub iterations: Duration,
    /// Reading solutions back.
    pub read_back: Duration,
}
