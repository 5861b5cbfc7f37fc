//! Linear equations with a sparse matrix, of nodes with six components each. Solvers are factors L D Lᵀ
//! (`factors.rs`) or L U (`unsymmetric.rs`), or conjugate gradients (`conjugate_gradients/`), also on a
//! device (`on_device.rs`). Knows no mechanics. Factors are found on one thread, and sums run in one order,
//! so results do not depend on the number of threads.
//!
//! ```
//! use pliant_linear::sparse::{Equations, LowerMatrix};
//! use pliant_linear::{LinearSolver, Workspace};
//!
//! // Two nodes whose equations are coupled, the second held; 2 x = 1 on each diagonal.
//! let free: Vec<bool> = (0..12).map(|component| component < 6).collect();
//! let equations = Equations::new(&free);
//! let mut matrix = LowerMatrix::new(&equations, [&[0, 1][..]].into_iter(), &[]);
//! matrix.add_to_each_diagonal(|_| 2.0);
//! let mut workspace = Workspace::new(LinearSolver::Direct, None, &equations, &matrix, None)?;
//! assert_eq!(workspace.prepare(&matrix)?.negative, 0);
//! let mut x = [0.0; 6];
//! workspace.solve(&matrix, &[1.0; 6], &mut x)?;
//! assert_eq!(x, [0.5; 6]);
//! # Ok::<(), pliant_linear::LinearError>(())
//! ```

mod conjugate_gradients;
mod device;
mod factors;
mod fronts;
pub mod lanes;
pub mod memory;
mod on_device;
mod report;
pub mod sparse;
mod supernodes;
mod unsymmetric;

use std::sync::Arc;

use nalgebra::Vector3;

use self::conjugate_gradients::{Approximation, BlockMatrix, Coarse, KrylovVectors};
pub use self::device::{BlockPattern, BlockValues, DeviceSolver, DeviceTimes, LinearDevice, Pass, PassEnd};
pub use self::factors::{Factors, Pivots, ZERO_PIVOT};
use self::on_device::{Found, OnDevice};
pub use self::report::{DeviceError, LinearError, LinearReport};
use self::sparse::{Equations, LowerMatrix};
use self::unsymmetric::LuFactors;

/// Solver of linear equations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum LinearSolver {
    /// Factors of the matrix: robust, and they show unstable equilibria.
    #[default]
    Direct,
    /// Factors L U with the unsymmetric stiffness of loads: more work, and no sign of instability. Newton's
    /// method keeps its quadratic convergence under moments about fixed axes and pressures on open surfaces.
    Unsymmetric,
    /// Conjugate gradients: for positive definite matrices only.
    ConjugateGradients {
        /// Residual over the right-hand side at which to stop.
        tolerance: f64,
        /// Iterations at the most.
        iterations: usize,
        /// Approximate inverse that multiplies the residual.
        preconditioner: Preconditioner,
    },
}

impl LinearSolver {
    /// True if a device can solve this way.
    pub fn suits_devices(self) -> bool {
        let Self::ConjugateGradients { preconditioner, .. } = self else { return false };
        !matches!(preconditioner, Preconditioner::LaggedFactors { .. })
    }
}

/// An approximate inverse for conjugate gradients.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preconditioner {
    /// The inverse of each node's diagonal block.
    BlockJacobi,
    /// These inverses, deflated by the rigid motions of groups of some sixteen neighbouring nodes: far fewer
    /// iterations on many elements. A GPU takes about 160 larger groups in all, and adds their correction in
    /// place of deflating.
    Aggregates,
    /// The factors of an older matrix, made anew once this many iterations were needed.
    LaggedFactors {
        /// Iterations from which on the factors are too old.
        renew_after: usize,
    },
}

/// A solver of the equations of one pattern, with its memory.
pub struct Workspace {
    solver: LinearSolver,
    factors: Option<Factors>,
    unsymmetric: Option<LuFactors>,
    /// True if the factors belong to some matrix, and so may serve as preconditioner; true if they belong to
    /// the prepared matrix.
    current: bool,
    fresh: bool,
    /// Values of the matrix whose factors serve later matrices; empty where factors are made for each.
    factored: Vec<f64>,
    /// For conjugate gradients.
    blocks: Option<BlockMatrix>,
    coarse: Option<Coarse>,
    vectors: KrylovVectors,
    /// Conjugate gradients on a device, where they run there.
    on_device: Option<OnDevice>,
    /// Solutions that the device left to the CPU.
    left_to_cpu: usize,
    pivots: Pivots,
}

impl Workspace {
    /// A solver for matrices of one pattern, on a device if one is given. It takes over the device's arrays
    /// and kernels from the solver of the pattern before.
    ///
    /// # Errors
    /// If there are more equations than can be numbered, no room for the factors, or the device fails or has
    /// no room.
    pub fn new(
        solver: LinearSolver,
        device: Option<&Arc<dyn LinearDevice>>,
        equations: &Equations,
        matrix: &LowerMatrix,
        mut before: Option<&mut Self>,
    ) -> Result<Self, LinearError> {
        let (direct, preconditioner) = match solver {
            LinearSolver::Direct => (true, None),
            LinearSolver::Unsymmetric => (false, None),
            LinearSolver::ConjugateGradients { preconditioner, .. } => {
                (matches!(preconditioner, Preconditioner::LaggedFactors { .. }), Some(preconditioner))
            }
        };
        let whole = solver == LinearSolver::Unsymmetric;
        let empty = matrix.columns() == 0;
        let most = device.map_or(usize::MAX, |device| device.aggregates());
        let blocks = preconditioner.map(|_| BlockMatrix::new(equations, matrix, most));
        let blocks = match solver {
            LinearSolver::ConjugateGradients { tolerance, .. } if device.is_none() && !direct => {
                blocks.map(|blocks| blocks.read_for(tolerance))
            }
            _ => blocks,
        };
        let coarse = blocks.as_ref().filter(|_| preconditioner == Some(Preconditioner::Aggregates));
        let coarse = coarse.map(Coarse::new).transpose()?;
        let on_device = match (device, &blocks) {
            (Some(device), Some(blocks)) => {
                let kept = before.as_mut().and_then(|before| before.on_device.take());
                let solver = kept.map_or_else(|| device.solver(), |kept| Ok(kept.into_solver()));
                let solver = solver.map_err(LinearError::Device)?;
                let mut on_device = OnDevice::new(solver, matrix, blocks, coarse.as_ref());
                // A matrix that is too large from the start is refused before a run begins.
                if before.is_none() && !empty {
                    on_device.arrange(blocks, coarse.as_ref()).map_err(LinearError::Device)?;
                }
                Some(on_device)
            }
            _ => None,
        };
        Ok(Self {
            solver,
            factors: if direct && !empty { Some(Factors::new(matrix)?) } else { None },
            unsymmetric: if whole && !empty { Some(LuFactors::new(matrix)?) } else { None },
            current: false,
            fresh: false,
            factored: Vec::new(),
            coarse,
            on_device,
            left_to_cpu: before.map_or(0, |before| before.left_to_cpu),
            vectors: blocks
                .as_ref()
                .map(|blocks| KrylovVectors::new(blocks, matrix.columns()))
                .unwrap_or_default(),
            blocks,
            pivots: Pivots { smallest: 1.0, ..Pivots::default() },
        })
    }

    /// Takes new positions of the nodes.
    pub fn place(&mut self, position: &[Vector3<f64>]) {
        if let (Some(coarse), Some(blocks)) = (&mut self.coarse, &self.blocks) {
            coarse.place(blocks, position);
        }
    }

    /// Takes a new matrix of the pattern; the signs of its factors where there are some.
    ///
    /// # Errors
    /// If the matrix is not finite, a diagonal block is not positive definite where conjugate gradients
    /// invert it, or the device fails.
    pub fn prepare(&mut self, matrix: &LowerMatrix) -> Result<Pivots, LinearError> {
        self.fresh = false;
        if let Some(factors) = &mut self.unsymmetric {
            factors.factorise(matrix)?;
        }
        if let Some(blocks) = &mut self.blocks {
            let (coarse, on_device) = (self.coarse.as_mut(), self.on_device.is_some());
            let (sound, negative) = blocks.update(matrix, |blocks| {
                let Some(coarse) = coarse else { return Ok(None) };
                coarse.update(blocks);
                // A device inverts it itself.
                if on_device { Ok(None) } else { coarse.factorise().map(Some) }
            });
            if !sound {
                return Err(LinearError::Indefinite(0));
            }
            if let Some(negative) = negative? {
                self.pivots.negative = negative;
            }
        }
        if let (Some(on_device), Some(blocks)) = (&mut self.on_device, &self.blocks) {
            on_device.take(matrix, blocks, self.coarse.as_ref()).map_err(LinearError::Device)?;
        }
        if self.factors.is_some() && !(self.blocks.is_some() && self.current) {
            self.factorise(matrix)?;
        }
        Ok(self.pivots)
    }

    fn factorise(&mut self, matrix: &LowerMatrix) -> Result<(), LinearError> {
        self.current = false;
        if let Some(factors) = &mut self.factors {
            self.pivots = factors.factorise(matrix).ok_or(LinearError::NotFinite)?;
        }
        if self.blocks.is_some() {
            self.factored.clone_from(&matrix.value);
        }
        (self.current, self.fresh) = (true, true);
        Ok(())
    }

    /// Values of the older matrix whose factors precondition the next one, if there is one.
    pub fn factored(&self) -> Option<&[f64]> {
        (self.current && !self.factored.is_empty()).then_some(&self.factored)
    }

    /// Takes the factors of a matrix of this pattern with other values as preconditioner of the next one.
    /// Values that have none are left.
    pub fn precondition_with(&mut self, mut values: Vec<f64>, matrix: &mut LowerMatrix) {
        if self.blocks.is_some() && self.factors.is_some() && values.len() == matrix.value.len() {
            std::mem::swap(&mut matrix.value, &mut values);
            self.current = self.factorise(matrix).is_ok();
            self.fresh = false;
            std::mem::swap(&mut matrix.value, &mut values);
        }
    }

    /// x ← A⁻¹ b for the matrix that was prepared; conjugate gradients start from the multiple of
    /// the x given that leaves the smallest residual.
    ///
    /// # Errors
    /// If iterations run out or meet a direction without positive stiffness, numbers are not finite, or the
    /// device fails.
    pub fn solve(
        &mut self,
        matrix: &LowerMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<LinearReport, LinearError> {
        match self.solver {
            LinearSolver::Direct => {
                x.copy_from_slice(b);
                if let Some(factors) = &mut self.factors {
                    factors.solve(x);
                }
                Ok(LinearReport::default())
            }
            LinearSolver::Unsymmetric => {
                x.copy_from_slice(b);
                if let Some(factors) = &mut self.unsymmetric {
                    factors.solve(x);
                }
                if x.iter().all(|x| x.is_finite()) {
                    Ok(LinearReport::default())
                } else {
                    Err(LinearError::NotFinite)
                }
            }
            LinearSolver::ConjugateGradients { tolerance, iterations, preconditioner } => {
                let mut report = self.conjugate_gradients(b, x, tolerance, iterations);
                if let Preconditioner::LaggedFactors { renew_after } = preconditioner {
                    if report.is_err() && !self.fresh {
                        self.factorise(matrix)?;
                        x.fill(0.0);
                        report = self.conjugate_gradients(b, x, tolerance, iterations);
                    }
                    self.current = report.as_ref().is_ok_and(|report| report.iterations < renew_after);
                }
                report
            }
        }
    }

    fn conjugate_gradients(
        &mut self,
        b: &[f64],
        x: &mut [f64],
        tolerance: f64,
        iterations: usize,
    ) -> Result<LinearReport, LinearError> {
        let mut done = 0;
        if let (Some(on_device), Some(blocks)) = (&mut self.on_device, &self.blocks) {
            match on_device.solve(&mut self.vectors, blocks, b, x, tolerance, iterations) {
                Found::Solution(result) => return result,
                Found::Rest(iterations) => done = iterations,
            }
            self.left_to_cpu += 1;
            self.coarse.as_mut().map(Coarse::factorise).transpose()?;
        }
        let inverse = match (&mut self.factors, &mut self.coarse) {
            (Some(factors), _) => Approximation::Factors(factors),
            (None, Some(coarse)) => Approximation::Aggregates(coarse),
            (None, None) => Approximation::Blocks,
        };
        match &self.blocks {
            Some(blocks) => {
                let report = self.vectors.solve(blocks, inverse, b, x, tolerance, iterations - done);
                let counted =
                    |report: LinearReport| LinearReport { iterations: report.iterations + done, ..report };
                report.map(counted).map_err(|error| match error {
                    LinearError::Stalled(report) => LinearError::Stalled(counted(report)),
                    other => other,
                })
            }
            None => Ok(LinearReport::default()),
        }
    }

    /// Time of the device so far, and how many solutions it left to the CPU.
    pub fn of_device(&self) -> (DeviceTimes, usize) {
        let times = self.on_device.as_ref().map(OnDevice::times).unwrap_or_default();
        (times, self.left_to_cpu)
    }
}

/// a · b.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
