//! L U of a matrix that is not symmetric (faer; the symbolic part once a pattern), on one thread.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::sparse::linalg::LuError;
use faer::sparse::linalg::lu::{LuRef, LuSymbolicParams, NumericLu, SymbolicLu, factorize_symbolic_lu};
use faer::sparse::{FaerError, SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Spec};

use crate::report::LinearError;
use crate::sparse::LowerMatrix;

/// L U of the whole matrix.
pub(crate) struct LuFactors {
    symbolic: SymbolicLu<u32>,
    numeric: NumericLu<u32, f64>,
    column_start: Vec<u32>,
    row: Vec<u32>,
    value: Vec<f64>,
    /// Origin of each entry: a place in the lower half, and true if the entry is mirrored.
    source: Vec<(u32, bool)>,
    memory: MemBuffer,
}

impl LuFactors {
    pub(crate) fn new(matrix: &LowerMatrix) -> Result<Self, LinearError> {
        let mut columns: Vec<Vec<(u32, (u32, bool))>> = vec![Vec::new(); matrix.columns()];
        // Columns to the left are done first, so rows above the diagonal come in order.
        for column in 0..matrix.columns() {
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
        let size = matrix.columns();
        let pattern = SymbolicSparseColMatRef::new_checked(size, size, &column_start, None, &row);
        let symbolic = factorize_symbolic_lu(pattern, LuSymbolicParams::default())?;
        let memory = MemBuffer::try_new(StackReq::any_of(&[
            symbolic.factorize_numeric_lu_scratch::<f64>(Par::Seq, Spec::default()),
            symbolic.solve_in_place_scratch::<f64>(1, Par::Seq),
        ]))
        .map_err(FaerError::from)?;
        let value = vec![0.0; row.len()];
        Ok(Self { symbolic, numeric: NumericLu::new(), column_start, row, value, source, memory })
    }

    /// Factors a matrix.
    ///
    /// # Errors
    /// If it holds a number that is not finite, or there is no room for the factors.
    pub(crate) fn factorise(&mut self, matrix: &LowerMatrix) -> Result<(), LinearError> {
        for (value, &(at, mirrored)) in self.value.iter_mut().zip(&self.source) {
            *value = if mirrored { matrix.mirror[at as usize] } else { matrix.value[at as usize] };
            if !value.is_finite() {
                return Err(LinearError::NotFinite);
            }
        }
        let size = matrix.columns();
        let pattern = SymbolicSparseColMatRef::new_checked(size, size, &self.column_start, None, &self.row);
        let whole = SparseColMatRef::new(pattern, &self.value[..]);
        let stack = MemStack::new(&mut self.memory);
        match self.symbolic.factorize_numeric_lu(&mut self.numeric, whole, Par::Seq, stack, Spec::default()) {
            Ok(_) => Ok(()),
            Err(LuError::Generic(error)) => Err(error.into()),
            Err(LuError::SymbolicSingular { .. }) => Err(LinearError::NotFinite),
        }
    }

    /// x ← A⁻¹ x.
    pub(crate) fn solve(&mut self, x: &mut [f64]) {
        let size = x.len();
        LuRef::new_unchecked(&self.symbolic, &self.numeric).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(x, size, 1),
            Par::Seq,
            MemStack::new(&mut self.memory),
        );
    }
}
