//! Sparse factors of symmetric and unsymmetric matrices.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::ldlt::factor::LdltRegularization;
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LdltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky, supernodal::SupernodalLdltRef,
};
use faer::sparse::linalg::lu::{LuRef, LuSymbolicParams, NumericLu, SymbolicLu, factorize_symbolic_lu};
use faer::sparse::linalg::{SupernodalThreshold, amd};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side, Spec};

use crate::sparse::LowerMatrix;

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

/// Operations for each entry of the factors, over the library's own measure, above which columns are taken together. Nodes have up to six
/// equations with the same pattern, so it pays from the start.
const SUPERNODES: f64 = 0.0;

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
        let order = order(matrix)?;
        let inverse = inverse_of(&order);
        let symbolic = factorize_symbolic_cholesky(
            pattern(matrix),
            Side::Lower,
            SymmetricOrdering::Custom(PermRef::new_checked(&order, &inverse, matrix.len())),
            CholeskySymbolicParams {
                supernodal_flop_ratio_threshold: SupernodalThreshold(SUPERNODES),
                ..Default::default()
            },
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
pub(super) struct LuFactors {
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
    pub(super) fn new(matrix: &LowerMatrix) -> Result<Self, faer::sparse::FaerError> {
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
    pub(super) fn factorise(&mut self, matrix: &LowerMatrix) -> Option<()> {
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
    pub(super) fn solve(&mut self, x: &mut [f64]) {
        let size = x.len();
        LuRef::new_unchecked(&self.symbolic, &self.numeric).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(x, size, 1),
            Par::Seq,
            MemStack::new(&mut self.memory),
        );
    }
}

/// An order of elimination with little fill (approximate minimum degree, Amestoy, Davis and Duff 1996). Equations that follow one another and
/// have the same neighbours, as those of a node, are ordered as one: a sixth of the work, and they stay together.
fn order(matrix: &LowerMatrix) -> Result<Vec<u32>, faer::sparse::FaerError> {
    let size = matrix.len();
    // Columns to the left that have a row.
    let mut left: Vec<Vec<u32>> = vec![Vec::new(); size];
    for column in 0..size as u32 {
        matrix.rows(column)[1..].iter().for_each(|&row| left[row as usize].push(column));
    }
    let (mut group, mut starts) = (vec![0_u32; size], Vec::new());
    for column in 0..size {
        let follows = column > 0 && {
            let [before, own] = [column - 1, column].map(|column| matrix.rows(column as u32));
            let (above, last) = (&left[column], column as u32 - 1);
            before[1..] == *own && above.split_last() == Some((&last, &left[column - 1][..]))
        };
        if !follows {
            starts.push(column as u32);
        }
        group[column] = starts.len() as u32 - 1;
    }
    let (mut ends, mut rows) = (vec![0_u32], Vec::new());
    for &start in &starts {
        let first = rows.len();
        rows.extend(matrix.rows(start).iter().map(|&row| group[row as usize]));
        let mut kept = first;
        for at in first..rows.len() {
            if at == first || rows[at] != rows[kept - 1] {
                rows[kept] = rows[at];
                kept += 1;
            }
        }
        rows.truncate(kept);
        ends.push(kept as u32);
    }
    let count = starts.len();
    let (mut order, mut place) = (vec![0_u32; count], vec![0_u32; count]);
    let mut memory = MemBuffer::new(amd::order_scratch::<u32>(count, rows.len()));
    let groups = SymbolicSparseColMatRef::new_checked(count, count, &ends, None, &rows);
    amd::order(&mut order, &mut place, groups, amd::Control::default(), MemStack::new(&mut memory))?;
    starts.push(size as u32);
    Ok(order.iter().flat_map(|&group| starts[group as usize]..starts[group as usize + 1]).collect())
}

/// Where each number is in an order.
fn inverse_of(order: &[u32]) -> Vec<u32> {
    let mut inverse = vec![0; order.len()];
    order.iter().zip(0..).for_each(|(&number, place)| inverse[number as usize] = place);
    inverse
}

fn pattern(matrix: &LowerMatrix) -> SymbolicSparseColMatRef<'_, u32> {
    let size = matrix.len();
    SymbolicSparseColMatRef::new_checked(size, size, &matrix.column_start, None, &matrix.row)
}
