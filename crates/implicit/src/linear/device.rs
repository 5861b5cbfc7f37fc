//! Conjugate gradients on a device, in single precision: what a device is given, and the search around it. Each pass of the device finds a
//! correction d with A d ≈ r; the residual r = b − A x of the sum of the corrections is found in double precision on the CPU and alone
//! decides when the solution is good enough. What single precision cannot solve is left to the CPU.

use std::fmt::Debug;
use std::time::Duration;

use nalgebra::Vector3;
use rayon::prelude::*;

use super::gradients::{Block, BlockMatrix, Coarse, KrylovVectors};
use super::report::{LinearError, LinearReport};
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
pub(super) struct OnDevice {
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
pub(super) enum Found {
    Solution(Result<LinearReport, LinearError>),
    /// After so many iterations single precision does no more.
    Rest(usize),
}

impl OnDevice {
    /// The equations of a pattern, on a solver that may have had others before. It gets the pattern with the first matrix at the latest.
    pub(super) fn new(
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
    pub(super) fn into_solver(self) -> Box<dyn DeviceSolver> {
        self.solver
    }

    /// Hands over the pattern, unless the device has it.
    pub(super) fn arrange(
        &mut self,
        blocks: &BlockMatrix,
        coarse: Option<&Coarse>,
    ) -> Result<(), DeviceError> {
        if !self.is_arranged {
            self.solver.arrange(&blocks.pattern(coarse))?;
            self.is_arranged = true;
        }
        Ok(())
    }

    /// Hands over a matrix, unless it is empty.
    pub(super) fn take(
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
    pub(super) fn solve(
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

    pub(super) fn times(&self) -> DeviceTimes {
        self.solver.times()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::Workspace;
    use super::*;
    use crate::element::Elasticity;
    use crate::sparse::Equations;
    use crate::{
        Assembly, BackwardEuler, DynamicSettings, LinearSolver, Phases, Preconditioner, Shell, SolveError,
        State, Wall,
    };
    use pliant_mechanics::curve::{Curve, Shape};
    use pliant_mechanics::load::{Load, LoadKind};

    /// What a device that is no good does.
    #[derive(Clone, Copy, Debug)]
    enum Fault {
        /// It fills its solutions with a number and says so.
        Fills(f32, PassEnd),
        Fails,
    }

    impl LinearDevice for Fault {
        fn aggregates(&self) -> usize {
            4
        }

        fn solver(&self) -> Result<Box<dyn DeviceSolver>, DeviceError> {
            Ok(Box::new(*self))
        }
    }

    impl DeviceSolver for Fault {
        fn arrange(&mut self, _pattern: &BlockPattern<'_>) -> Result<(), DeviceError> {
            Ok(())
        }

        fn take(&mut self, _values: &BlockValues<'_>) -> Result<(), DeviceError> {
            Ok(())
        }

        fn solve(
            &mut self,
            _right: &[f32],
            solution: &mut [f32],
            _goal: f32,
            _iterations: usize,
        ) -> Result<Pass, DeviceError> {
            match *self {
                Self::Fills(number, end) => {
                    solution.fill(number);
                    Ok(Pass { iterations: 1, end })
                }
                Self::Fails => Err(DeviceError("it is unplugged; plug it in".into())),
            }
        }

        fn times(&self) -> DeviceTimes {
            DeviceTimes::default()
        }
    }

    /// A strip that falls for a step.
    fn fall(device: Option<Fault>) -> Result<(State, Phases), SolveError> {
        let points = (0..42).map(|i| Vector3::new(f64::from(i / 2) * 0.1, f64::from(i % 2) * 0.1, 0.0));
        let cells =
            (0..20).flat_map(|i| [[2 * i, 2 * i + 2, 2 * i + 3], [2 * i, 2 * i + 3, 2 * i + 1]]).collect();
        let wall = Wall { elastic: Elasticity { young: 1e6, poisson: 0.3 }, density: 1000.0 };
        let mut model = Assembly::new("strip", points);
        model.add_shell(&Shell::new("strip", cells, 0.01, wall)).unwrap();
        model.model_mut().fix("clamp", vec![0, 1]);
        let kind = LoadKind::Gravity { body: 0, acceleration: [0.0, 0.0, -9.81] };
        model.model_mut().loads.push(Load::new(
            "weight",
            kind,
            Curve { shape: Shape::Hold, from: 0.0, to: 1.0 },
        ));
        let linear = LinearSolver::ConjugateGradients {
            tolerance: 1e-10,
            iterations: 1000,
            preconditioner: Preconditioner::Aggregates,
        };
        let device = device.map(|fault| Arc::new(fault) as Arc<dyn LinearDevice>);
        let settings = DynamicSettings::new(0.01).real_time(linear);
        let mut solver = BackwardEuler::on(device, model.clone(), settings)?;
        let mut state = State::at_rest(&model);
        solver.advance(&mut state)?;
        Ok((state, solver.phases()))
    }

    /// Solved to 1e-10 in the end, so displacements agree to some 1e-8.
    #[test]
    fn what_a_device_cannot_solve_is_finished_in_double_precision() {
        let (exact, alone) = fall(None).unwrap();
        assert_eq!(alone.left_to_cpu, 0);
        for (number, end) in [
            (f32::NAN, PassEnd::Reached),
            (f32::INFINITY, PassEnd::Indefinite),
            (0.0, PassEnd::Indefinite),
            (1e3, PassEnd::Reached),
        ] {
            let (state, phases) = fall(Some(Fault::Fills(number, end))).unwrap();
            let off = state.position.iter().zip(&exact.position).map(|(a, b)| (a - b).norm());
            let off = off.fold(0.0, f64::max) / (exact.position[41].z).abs();
            assert!(off < 1e-7 && phases.left_to_cpu == 1, "{number}: {off:e}, {}", phases.left_to_cpu);
            assert!(phases.iterations > 1);
        }
    }

    #[test]
    fn a_device_that_fails_ends_the_step_with_its_words() {
        match fall(Some(Fault::Fails)) {
            Err(SolveError::Device(error)) => assert_eq!(error.0, "it is unplugged; plug it in"),
            other => panic!("{:?}", other.map(|_| ())),
        }
    }

    /// A device whose solver finds no room for its second pattern the first time, and leaves each solution to the CPU. Each pattern takes it
    /// a second.
    #[derive(Debug, Default)]
    struct Narrow {
        calls: u32,
        /// Nodes of the pattern that it has.
        nodes: Option<usize>,
    }

    impl LinearDevice for Narrow {
        fn aggregates(&self) -> usize {
            4
        }

        fn solver(&self) -> Result<Box<dyn DeviceSolver>, DeviceError> {
            Ok(Box::new(Self::default()))
        }
    }

    impl DeviceSolver for Narrow {
        fn arrange(&mut self, pattern: &BlockPattern<'_>) -> Result<(), DeviceError> {
            self.calls += 1;
            self.nodes = (self.calls != 2).then(|| pattern.nodes());
            self.nodes.map(|_| ()).ok_or(DeviceError("its memory is full; use a coarser mesh".into()))
        }

        fn take(&mut self, values: &BlockValues<'_>) -> Result<(), DeviceError> {
            assert_eq!(self.nodes, Some(values.inverse.len() / 36));
            Ok(())
        }

        fn solve(
            &mut self,
            right: &[f32],
            solution: &mut [f32],
            _goal: f32,
            _iterations: usize,
        ) -> Result<Pass, DeviceError> {
            assert_eq!(self.nodes, Some(right.len() / 6));
            solution.fill(0.0);
            Ok(Pass { iterations: 1, end: PassEnd::Indefinite })
        }

        fn times(&self) -> DeviceTimes {
            DeviceTimes { upload: Duration::from_secs(self.calls.into()), ..DeviceTimes::default() }
        }
    }

    /// Springs to the ground at some nodes, on the device of the workspace before.
    fn grounded(nodes: usize, before: Option<&mut Workspace>) -> (Workspace, LowerMatrix) {
        let equations = Equations::new(&vec![true; 6 * nodes]);
        let all: Vec<[u32; 1]> = (0..nodes as u32).map(|node| [node]).collect();
        let mut matrix = LowerMatrix::new(&equations, all.iter().map(<[u32; 1]>::as_slice), &[]);
        (0..6 * nodes).for_each(|at| matrix.add_diagonal(at, 2.0));
        let preconditioner = Preconditioner::BlockJacobi;
        let solver = LinearSolver::ConjugateGradients { tolerance: 1e-10, iterations: 100, preconditioner };
        let device: Arc<dyn LinearDevice> = Arc::new(Narrow::default());
        (Workspace::new(solver, Some(&device), &equations, &matrix, before).unwrap(), matrix)
    }

    #[test]
    fn a_device_without_room_for_a_pattern_is_not_used_until_it_has_taken_it() {
        let (mut small, matrix) = grounded(3, None);
        assert!(small.prepare(&matrix).is_ok());
        let (mut large, matrix) = grounded(5, Some(&mut small));
        let full = DeviceError("its memory is full; use a coarser mesh".into());
        assert_eq!(large.prepare(&matrix).unwrap_err(), LinearError::Device(full));
        assert!(large.prepare(&matrix).is_ok());
        let mut solution = [0.0; 30];
        large.solve(&matrix, &[1.0; 30], &mut solution).unwrap();
        assert!(solution.iter().all(|x| (x - 0.5).abs() < 1e-9), "{solution:?}");
        assert_eq!(
            large.of_device(),
            (DeviceTimes { upload: Duration::from_secs(3), ..DeviceTimes::default() }, 1)
        );
    }

    #[test]
    fn a_pattern_without_equations_keeps_the_times_of_a_device() {
        let (mut some, matrix) = grounded(3, None);
        assert!(some.prepare(&matrix).is_ok());
        let times = some.of_device();
        assert_eq!(times.0.upload, Duration::from_secs(1));
        let (mut none, matrix) = grounded(0, Some(&mut some));
        assert!(none.prepare(&matrix).is_ok() && none.solve(&matrix, &[], &mut []).is_ok());
        assert_eq!(none.of_device(), times);
    }
}
