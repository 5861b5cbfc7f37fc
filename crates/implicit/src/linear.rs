//! Linear equations with a sparse matrix: factors L D Lᵀ or L U (faer; the symbolic part once a pattern), or conjugate gradients
//! (`gradients.rs`). Factors are found on one thread, so results do not depend on the number of threads.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::ldlt::factor::LdltRegularization;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LdltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky, supernodal::SupernodalLdltRef,
};
use faer::sparse::linalg::lu::{LuRef, LuSymbolicParams, NumericLu, SymbolicLu, factorize_symbolic_lu};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side, Spec};
use nalgebra::Vector3;

use crate::gradients::{Approximation, BlockMatrix, Coarse, Vectors};
use crate::sparse::{Equations, LowerMatrix};

/// How linear equations are solved.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum LinearSolver {
    /// Factors of the matrix: robust, and they tell unstable equilibria.
    #[default]
    Direct,
    /// Factors L U with the unsymmetric stiffness of loads: more work, and no sign of instability. Newton's method keeps its quadratic
    /// convergence under moments about fixed axes and pressures on open surfaces.
    Unsymmetric,
    /// Conjugate gradients: for positive definite matrices only.
    ConjugateGradients {
        /// Residual over the right-hand side at which to stop.
        tolerance: f64,
        /// Iterations at the most.
        iterations: usize,
        /// What the residual is multiplied by.
        preconditioner: Preconditioner,
    },
}

/// An approximate inverse for conjugate gradients.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preconditioner {
    /// The inverse of each node's diagonal block.
    BlockJacobi,
    /// This, and a solution for the rigid motions of groups of some thirty neighbouring nodes: far fewer iterations on many elements.
    Aggregates,
    /// The factors of an older matrix, made anew once this many iterations were needed.
    LaggedFactors {
        /// Iterations from which on the factors are too old.
        renew_after: usize,
    },
}

/// What a solution took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LinearReport {
    /// Iterations of conjugate gradients; 0 with factors.
    pub iterations: usize,
    /// Residual over the right-hand side; 0 with factors.
    pub residual: f64,
}

/// The signs of a factorisation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Pivots {
    /// Negative pivots: directions in which the stiffness is negative.
    pub(crate) negative: usize,
    /// Equation with the smallest pivot.
    pub(crate) weakest: usize,
    /// That pivot over the diagonal entry.
    pub(crate) smallest: f64,
}

/// Pivots below this part of the diagonal are zero but for round-off.
pub(crate) const ZERO_PIVOT: f64 = 1e-14;

/// L D Lᵀ of a matrix scaled to a unit diagonal.
pub(crate) struct Factors {
    symbolic: SymbolicCholesky<u32>,
    value: Vec<f64>,
    scale: Vec<f64>,
    scaled: Vec<f64>,
    memory: MemBuffer,
}

impl Factors {
    pub(crate) fn new(matrix: &LowerMatrix) -> Result<Self, faer::sparse::FaerError> {
        let symbolic = factorize_symbolic_cholesky(
            pattern(matrix),
            Side::Lower,
            SymmetricOrdering::Amd,
            CholeskySymbolicParams::default(),
        )?;
        let memory = MemBuffer::new(StackReq::any_of(&[
            symbolic.factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Spec::default()),
            symbolic.solve_in_place_scratch::<f64>(1, Par::Seq),
        ]));
        Ok(Self {
            value: vec![0.0; symbolic.len_val()],
            scale: vec![0.0; matrix.len()],
            scaled: vec![0.0; matrix.value.len()],
            symbolic,
            memory,
        })
    }

    /// Factors a matrix; `None` if it holds a number that is not finite.
    pub(crate) fn factorise(&mut self, matrix: &LowerMatrix) -> Option<Pivots> {
        for (equation, scale) in self.scale.iter_mut().enumerate() {
            let diagonal = matrix.diagonal(equation).abs();
            *scale = if diagonal > 0.0 { 1.0 / diagonal.sqrt() } else { 1.0 };
        }
        for (column, bounds) in matrix.column_start.windows(2).enumerate() {
            for at in bounds[0] as usize..bounds[1] as usize {
                let value = matrix.value[at] * self.scale[column] * self.scale[matrix.row[at] as usize];
                if !value.is_finite() {
                    return None;
                }
                self.scaled[at] = value;
            }
        }
        let scaled = SparseColMatRef::new(pattern(matrix), &self.scaled[..]);
        // Pivots that vanish are kept from dividing by zero; they are found below.
        let tiny = 0.1 * ZERO_PIVOT;
        let regularization = LdltRegularization {
            dynamic_regularization_signs: None,
            dynamic_regularization_delta: tiny,
            dynamic_regularization_epsilon: tiny,
        };
        let stack = MemStack::new(&mut self.memory);
        self.symbolic
            .factorize_numeric_ldlt(
                &mut self.value,
                scaled,
                Side::Lower,
                regularization,
                Par::Seq,
                stack,
                Spec::default(),
            )
            .ok()?;
        Some(self.pivots())
    }

    fn pivots(&self) -> Pivots {
        let mut pivots = Pivots { smallest: f64::INFINITY, ..Pivots::default() };
        let permutation = self.symbolic.perm();
        let mut look = |column: usize, pivot: f64| {
            pivots.negative += usize::from(pivot < 0.0);
            if pivot.abs() < pivots.smallest {
                pivots.smallest = pivot.abs();
                pivots.weakest = permutation.map_or(column, |p| p.arrays().0[column] as usize);
            }
        };
        match self.symbolic.raw() {
            SymbolicCholeskyRaw::Simplicial(symbolic) => {
                for (column, &start) in symbolic.col_ptr()[..symbolic.ncols()].iter().enumerate() {
                    look(column, self.value[start as usize]);
                }
            }
            SymbolicCholeskyRaw::Supernodal(symbolic) => {
                let factor = SupernodalLdltRef::new(symbolic, &self.value);
                for node in 0..symbolic.n_supernodes() {
                    let node = factor.supernode(node);
                    for column in 0..node.val().ncols() {
                        look(node.start() + column, node.val()[(column, column)]);
                    }
                }
            }
        }
        pivots
    }

    /// x ← A⁻¹ x.
    pub(crate) fn solve(&mut self, x: &mut [f64]) {
        let scale = |x: &mut [f64]| x.iter_mut().zip(&self.scale).for_each(|(x, s)| *x *= s);
        scale(x);
        let size = x.len();
        LdltRef::new(&self.symbolic, &self.value).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(x, size, 1),
            Par::Seq,
            MemStack::new(&mut self.memory),
        );
        scale(x);
    }
}

/// L U of the whole matrix.
struct LuFactors {
    symbolic: SymbolicLu<u32>,
    numeric: NumericLu<u32, f64>,
    column_start: Vec<u32>,
    row: Vec<u32>,
    value: Vec<f64>,
    /// Where each entry comes from: a place in the lower half, or a mirrored one.
    source: Vec<(u32, bool)>,
    memory: MemBuffer,
}

impl LuFactors {
    fn new(matrix: &LowerMatrix) -> Result<Self, faer::sparse::FaerError> {
        let mut columns: Vec<Vec<(u32, (u32, bool))>> = vec![Vec::new(); matrix.len()];
        // Columns to the left are done first, so rows above the diagonal come in order.
        for column in 0..matrix.len() {
            for at in matrix.column_start[column]..matrix.column_start[column + 1] {
                let row = matrix.row[at as usize];
                columns[column].push((row, (at, false)));
                if row as usize != column {
                    columns[row as usize].push((column as u32, (at, true)));
                }
            }
        }
        let mut column_start = vec![0];
        let (mut row, mut source) = (Vec::new(), Vec::new());
        for column in columns {
            for (r, from) in column {
                row.push(r);
                source.push(from);
            }
            column_start.push(row.len() as u32);
        }
        let size = matrix.len();
        let pattern = SymbolicSparseColMatRef::new_checked(size, size, &column_start, None, &row);
        let symbolic = factorize_symbolic_lu(pattern, LuSymbolicParams::default())?;
        let memory = MemBuffer::new(StackReq::any_of(&[
            symbolic.factorize_numeric_lu_scratch::<f64>(Par::Seq, Spec::default()),
            symbolic.solve_in_place_scratch::<f64>(1, Par::Seq),
        ]));
        let value = vec![0.0; row.len()];
        Ok(Self { symbolic, numeric: NumericLu::new(), column_start, row, value, source, memory })
    }

    /// Factors a matrix; `None` if it holds a number that is not finite.
    fn factorise(&mut self, matrix: &LowerMatrix) -> Option<()> {
        for (value, &(at, mirrored)) in self.value.iter_mut().zip(&self.source) {
            *value = if mirrored { matrix.mirror[at as usize] } else { matrix.value[at as usize] };
            if !value.is_finite() {
                return None;
            }
        }
        let size = matrix.len();
        let pattern = SymbolicSparseColMatRef::new_checked(size, size, &self.column_start, None, &self.row);
        let whole = SparseColMatRef::new(pattern, &self.value[..]);
        let stack = MemStack::new(&mut self.memory);
        self.symbolic
            .factorize_numeric_lu(&mut self.numeric, whole, Par::Seq, stack, Spec::default())
            .ok()
            .map(|_| ())
    }

    /// x ← A⁻¹ x.
    fn solve(&mut self, x: &mut [f64]) {
        let size = x.len();
        LuRef::new_unchecked(&self.symbolic, &self.numeric).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(x, size, 1),
            Par::Seq,
            MemStack::new(&mut self.memory),
        );
    }
}

fn pattern(matrix: &LowerMatrix) -> SymbolicSparseColMatRef<'_, u32> {
    let size = matrix.len();
    SymbolicSparseColMatRef::new_checked(size, size, &matrix.column_start, None, &matrix.row)
}

/// Why a linear solve failed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum LinearError {
    NotFinite,
    Indefinite(usize),
    Stalled(LinearReport),
}

/// A solver with its memory.
pub(crate) struct Workspace {
    solver: LinearSolver,
    factors: Option<Factors>,
    unsymmetric: Option<LuFactors>,
    /// Whether the factors are of some matrix, and so may serve as preconditioner; of the matrix prepared.
    current: bool,
    fresh: bool,
    /// For conjugate gradients.
    blocks: Option<BlockMatrix>,
    coarse: Option<Coarse>,
    vectors: Vectors,
    pivots: Pivots,
}

impl Workspace {
    /// A solver for matrices of one pattern; `None` if the equations are too many for factors.
    pub(crate) fn new(solver: LinearSolver, equations: &Equations, matrix: &LowerMatrix) -> Option<Self> {
        let (direct, preconditioner) = match solver {
            LinearSolver::Direct => (true, None),
            LinearSolver::Unsymmetric => (false, None),
            LinearSolver::ConjugateGradients { preconditioner, .. } => {
                (matches!(preconditioner, Preconditioner::LaggedFactors { .. }), Some(preconditioner))
            }
        };
        let whole = solver == LinearSolver::Unsymmetric;
        let empty = matrix.len() == 0;
        let blocks = preconditioner.map(|_| BlockMatrix::new(equations, matrix));
        let coarse = blocks.as_ref().filter(|_| preconditioner == Some(Preconditioner::Aggregates));
        Some(Self {
            solver,
            factors: if direct && !empty { Some(Factors::new(matrix).ok()?) } else { None },
            unsymmetric: if whole && !empty { Some(LuFactors::new(matrix).ok()?) } else { None },
            current: false,
            fresh: false,
            coarse: match coarse {
                Some(blocks) => Some(Coarse::new(blocks)?),
                None => None,
            },
            vectors: blocks.as_ref().map(|blocks| Vectors::new(blocks, matrix.len())).unwrap_or_default(),
            blocks,
            pivots: Pivots { smallest: 1.0, ..Pivots::default() },
        })
    }

    /// Takes new positions of the nodes.
    pub(crate) fn place(&mut self, position: &[Vector3<f64>]) {
        if let (Some(coarse), Some(blocks)) = (&mut self.coarse, &self.blocks) {
            coarse.place(blocks, position);
        }
    }

    /// Takes a new matrix.
    pub(crate) fn prepare(&mut self, matrix: &LowerMatrix) -> Result<Pivots, LinearError> {
        self.fresh = false;
        if let Some(factors) = &mut self.unsymmetric {
            factors.factorise(matrix).ok_or(LinearError::NotFinite)?;
        }
        if let Some(blocks) = &mut self.blocks
            && !blocks.update(matrix)
        {
            return Err(LinearError::Indefinite(0));
        }
        if let (Some(coarse), Some(blocks)) = (&mut self.coarse, &self.blocks)
            && !coarse.update(blocks)
        {
            return Err(LinearError::NotFinite);
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
        (self.current, self.fresh) = (true, true);
        Ok(())
    }

    /// x ← A⁻¹ b for the matrix that was prepared; conjugate gradients start from the x given.
    pub(crate) fn solve(
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
                    self.current = report.is_ok_and(|report| report.iterations < renew_after);
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
        let inverse = match (&mut self.factors, &mut self.coarse) {
            (Some(factors), _) => Approximation::Factors(factors),
            (None, Some(coarse)) => Approximation::Aggregates(coarse),
            (None, None) => Approximation::Blocks,
        };
        match &self.blocks {
            Some(blocks) => self.vectors.solve(blocks, inverse, b, x, tolerance, iterations),
            None => Ok(LinearReport::default()),
        }
    }
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
