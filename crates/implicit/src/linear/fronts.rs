//! L D Lᵀ front by front (Duff and Reid 1983, TOMS 9:302; Liu 1992, SIAM Review 34:82): columns with nearly the same rows are eliminated
//! together in a dense matrix, whose rest is added to that of the next columns. Dense columns are taken eight at a time, in
//! registers as wide as the processor's. Equations with the same neighbours, as those of a node, are ordered as one.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;
use pulp::{Arch, Simd, WithSimd};

use super::factors::{Pivots, ZERO_PIVOT};
use crate::sparse::LowerMatrix;

/// Columns of a front that are eliminated before the others take them up.
const PANEL: usize = 8;
/// Rows of a front are a multiple of this, so that each column starts with a register.
const ALIGNED: usize = 8;
/// Columns of two neighbouring fronts, and the part of zeros among their entries up to which they are taken together.
const TOGETHER: [(usize, f64); 4] = [(12, 0.6), (24, 0.3), (64, 0.12), (usize::MAX, 0.04)];

/// A front: some columns and all rows below them.
#[derive(Clone, Debug)]
struct Front {
    /// Its first column in the order of elimination, and how many.
    first: usize,
    columns: usize,
    /// Where its rows are in the list, the columns first; and its values.
    rows: std::ops::Range<usize>,
    value: usize,
    /// Where the entries of the matrix that begin in it are in the list.
    entries: std::ops::Range<usize>,
    /// Fronts whose rests it takes up, in the reverse of their order.
    children: Vec<usize>,
}

impl Front {
    fn height(&self) -> usize {
        self.rows.len()
    }

    /// Length of a column of its values.
    fn stride(&self) -> usize {
        self.rows.len().next_multiple_of(ALIGNED)
    }
}

/// The factors, with their memory.
pub(crate) struct Fronts {
    fronts: Vec<Front>,
    /// Equations in the order of elimination.
    order: Vec<u32>,
    /// Rows of all fronts, in the order of elimination.
    rows: Vec<u32>,
    /// Of each row of a front below its columns its place in the next front; those of its columns count for nothing.
    above: Vec<u32>,
    /// Entries of the matrix, with their places in fronts.
    entries: Vec<[u32; 2]>,
    value: Vec<f64>,
    /// The front at work, rests that wait, and right-hand sides.
    work: Vec<f64>,
    waiting: Vec<f64>,
    right: Vec<f64>,
    part: Vec<f64>,
    arch: Arch,
}

/// Rows of each of some columns that are above none: the lower half without the diagonal, by the order of elimination.
type Rows = Vec<Vec<u32>>;

impl Fronts {
    /// For matrices of a pattern; `None` if they are too large.
    pub(crate) fn new(matrix: &LowerMatrix) -> Option<Self> {
        let size = matrix.len();
        let (groups, neighbours) = groups(matrix);
        let counts: Vec<usize> = groups.windows(2).map(|pair| (pair[1] - pair[0]) as usize).collect();
        let (order, rows, parent) = eliminate(&neighbours)?;
        let heads = merge(&order, &rows, &parent, &counts);
        // From groups to equations.
        let mut equations = Vec::with_capacity(size);
        let mut starts = Vec::with_capacity(order.len() + 1);
        for &group in &order {
            starts.push(equations.len() as u32);
            equations.extend(groups[group as usize]..groups[group as usize + 1]);
        }
        starts.push(size as u32);
        let mut place = vec![0; size];
        equations.iter().zip(0_u32..).for_each(|(&equation, at)| place[equation as usize] = at);

        let mut own = Self {
            fronts: Vec::with_capacity(heads.len()),
            order: equations,
            rows: Vec::new(),
            above: Vec::new(),
            entries: vec![[0; 2]; matrix.value.len()],
            value: Vec::new(),
            work: Vec::new(),
            waiting: Vec::new(),
            right: vec![0.0; size],
            part: Vec::new(),
            arch: Arch::new(),
        };
        let mut of_column = vec![0; size];
        let mut value = 0;
        for (number, (head, end, below)) in heads.iter().enumerate() {
            let [first, last] = [starts[*head], starts[*end]].map(|at| at as usize);
            let from = own.rows.len();
            own.rows.extend(first as u32..last as u32);
            for &group in below {
                own.rows.extend(starts[group as usize]..starts[group as usize + 1]);
            }
            of_column[first..last].fill(number);
            let front = Front {
                first,
                columns: last - first,
                rows: from..own.rows.len(),
                value,
                entries: 0..0,
                children: Vec::new(),
            };
            value += front.stride() * front.columns;
            own.fronts.push(front);
        }
        u32::try_from(value).ok()?;
        own.value = vec![0.0; value];
        own.find_children(&of_column);
        own.find_entries(matrix, &place, &of_column);
        own.make_memory();
        Some(own)
    }

    /// Finds which front takes up the rest of each, and where its rows are there.
    fn find_children(&mut self, of_column: &[usize]) {
        self.above = vec![0; self.rows.len()];
        for number in 0..self.fronts.len() {
            let (range, columns) = (self.fronts[number].rows.clone(), self.fronts[number].columns);
            let Some(&next) = self.rows[range.clone()].get(columns) else { continue };
            let parent = of_column[next as usize];
            let rows = &self.rows[self.fronts[parent].rows.clone()];
            for at in range.skip(columns) {
                self.above[at] = rows.partition_point(|&row| row < self.rows[at]) as u32;
            }
            self.fronts[parent].children.push(number);
        }
        self.fronts.iter_mut().for_each(|front| front.children.reverse());
    }

    /// Finds where the entries of a matrix go.
    fn find_entries(&mut self, matrix: &LowerMatrix, place: &[u32], of_column: &[usize]) {
        let mut all: Vec<(usize, [u32; 2])> = Vec::with_capacity(matrix.value.len());
        for column in 0..matrix.len() {
            for at in matrix.column_start[column]..matrix.column_start[column + 1] {
                let [a, b] = [place[column], place[matrix.row[at as usize] as usize]];
                let (low, high) = (a.min(b), a.max(b));
                let number = of_column[low as usize];
                let front = &self.fronts[number];
                let row = self.rows[front.rows.clone()].partition_point(|&row| row < high);
                let to = (low as usize - front.first) * front.stride() + row;
                all.push((number, [at, to as u32]));
            }
        }
        // In the order of the matrix within each.
        all.sort_by_key(|&(number, _)| number);
        let mut from = 0;
        for (number, front) in self.fronts.iter_mut().enumerate() {
            let end = from + all[from..].partition_point(|&(of, _)| of == number);
            front.entries = from..end;
            from = end;
        }
        self.entries = all.into_iter().map(|(_, entry)| entry).collect();
    }

    /// Makes room for the largest front, and for all rests that wait at a time.
    fn make_memory(&mut self) {
        let rest = |front: &Front| (front.height() - front.columns).pow(2);
        let (mut largest, mut waiting, mut most, mut highest) = (0, 0, 0, 0);
        for front in &self.fronts {
            largest = largest.max(front.stride() * front.height());
            highest = highest.max(front.stride());
            waiting -= front.children.iter().map(|&child| rest(&self.fronts[child])).sum::<usize>();
            waiting += rest(front);
            most = most.max(waiting);
        }
        self.work = vec![0.0; largest];
        self.waiting = vec![0.0; most];
        self.part = vec![0.0; highest];
    }

    /// Factors a matrix; `None` if it holds a number that is not finite.
    pub(crate) fn factorise(&mut self, matrix: &LowerMatrix) -> Option<Pivots> {
        let mut pivots = Pivots { smallest: f64::INFINITY, ..Pivots::default() };
        let mut top = 0;
        for number in 0..self.fronts.len() {
            let front = &self.fronts[number];
            let (stride, height, columns) = (front.stride(), front.height(), front.columns);
            let work = &mut self.work[..stride * height];
            work.fill(0.0);
            for &[from, to] in &self.entries[front.entries.clone()] {
                work[to as usize] = matrix.value[from as usize];
            }
            for &child in &front.children {
                let child = &self.fronts[child];
                let above = &self.above[child.rows.start + child.columns..child.rows.end];
                let side = above.len();
                top -= side * side;
                let rest = &self.waiting[top..top + side * side];
                for (k, (&column, own)) in above.iter().zip(rest.chunks_exact(side)).enumerate() {
                    let target = &mut work[column as usize * stride..][..height];
                    for (&row, value) in above[k..].iter().zip(&own[k..]) {
                        target[row as usize] += value;
                    }
                }
            }
            for (floor, &equation) in
                self.part.iter_mut().zip(&self.order[front.first..front.first + columns])
            {
                *floor = 0.1 * ZERO_PIVOT * diagonal(matrix, equation);
            }
            self.arch.dispatch(Elimination { work, stride, height, floors: &self.part[..columns] });
            let side = height - columns;
            for (column, own) in
                self.waiting[top..top + side * side].chunks_exact_mut(side.max(1)).enumerate()
            {
                let from = (columns + column) * stride + columns + column;
                own[column..].copy_from_slice(&work[from..from + side - column]);
            }
            top += side * side;
            self.value[front.value..front.value + stride * columns]
                .copy_from_slice(&work[..stride * columns]);
            for k in 0..columns {
                let pivot = work[k * stride + k];
                let equation = self.order[front.first + k];
                let part = pivot.abs() / diagonal(matrix, equation);
                if !part.is_finite() {
                    return None;
                }
                pivots.negative += usize::from(pivot < 0.0);
                if part < pivots.smallest {
                    (pivots.smallest, pivots.weakest) = (part, equation as usize);
                }
            }
        }
        Some(pivots)
    }

    /// x ← A⁻¹ x.
    pub(crate) fn solve(&mut self, x: &mut [f64]) {
        let Self { fronts, order, rows, value, right, part, .. } = self;
        right.iter_mut().zip(&*order).for_each(|(right, &equation)| *right = x[equation as usize]);
        for front in &*fronts {
            let (stride, rows) = (front.stride(), &rows[front.rows.clone()]);
            let part = &mut part[..rows.len()];
            part[..front.columns].copy_from_slice(&right[front.first..front.first + front.columns]);
            part[front.columns..].fill(0.0);
            for (k, column) in value[front.value..][..stride * front.columns].chunks_exact(stride).enumerate()
            {
                let own = part[k];
                for (part, entry) in part[k + 1..].iter_mut().zip(&column[k + 1..]) {
                    *part -= entry * own;
                }
                right[front.first + k] = own / column[k];
            }
            for (&row, part) in rows.iter().zip(&*part).skip(front.columns) {
                right[row as usize] += part;
            }
        }
        for front in fronts.iter().rev() {
            let (stride, rows) = (front.stride(), &rows[front.rows.clone()]);
            let part = &mut part[..rows.len()];
            part.iter_mut().zip(rows).for_each(|(part, &row)| *part = right[row as usize]);
            for k in (0..front.columns).rev() {
                let column = &value[front.value + k * stride..][..rows.len()];
                let sum: f64 = column[k + 1..].iter().zip(&part[k + 1..]).map(|(a, b)| a * b).sum();
                part[k] -= sum;
            }
            right[front.first..front.first + front.columns].copy_from_slice(&part[..front.columns]);
        }
        right.iter().zip(&*order).for_each(|(right, &equation)| x[equation as usize] = *right);
    }
}

/// The size of a diagonal entry, 1 where it is zero.
fn diagonal(matrix: &LowerMatrix, equation: u32) -> f64 {
    let own = matrix.diagonal(equation as usize).abs();
    if own > 0.0 { own } else { 1.0 }
}

/// Equations that follow each other and have the same neighbours: where each group of them begins, and the end; the neighbours of groups.
fn groups(matrix: &LowerMatrix) -> (Vec<u32>, Rows) {
    let size = matrix.len();
    let mut all: Rows = vec![Vec::new(); size];
    // Columns to the left come first, so that neighbours are in order.
    for column in 0..size as u32 {
        for &row in matrix.rows(column) {
            all[column as usize].push(row);
            if row != column {
                all[row as usize].push(column);
            }
        }
    }
    all.iter_mut().for_each(|own| own.sort_unstable());
    let mut starts = vec![0];
    let mut group = vec![0_u32; size];
    for equation in 1..size {
        if all[equation] != all[equation - 1] {
            starts.push(equation as u32);
        }
        group[equation] = starts.len() as u32 - 1;
    }
    let neighbours = starts.iter().enumerate().map(|(number, &start)| {
        let mut own: Vec<u32> = all[start as usize].iter().map(|&other| group[other as usize]).collect();
        own.dedup();
        own.retain(|&other| other as usize != number);
        own
    });
    let neighbours = neighbours.collect();
    starts.push(size as u32);
    (starts, neighbours)
}

/// The order of elimination, in which all that comes before a column and meets it is together; the rows below each column in that order, and
/// the first of them, which is its parent.
fn eliminate(neighbours: &Rows) -> Option<(Vec<u32>, Rows, Vec<u32>)> {
    let size = neighbours.len();
    let mut start = vec![0_u32];
    let mut row = Vec::new();
    for own in neighbours {
        row.extend_from_slice(own);
        start.push(u32::try_from(row.len()).ok()?);
    }
    let pattern = SymbolicSparseColMatRef::new_checked(size, size, &start, None, &row);
    let (mut order, mut place) = (vec![0_u32; size], vec![0_u32; size]);
    let mut memory = MemBuffer::new(amd::order_scratch::<u32>(size, row.len()));
    amd::order(&mut order, &mut place, pattern, amd::Control::default(), MemStack::new(&mut memory)).ok()?;
    let (_, parent) = rows_below(neighbours, &order, &place);
    // Children before their parents, each tree together.
    let mut children: Vec<Vec<u32>> = vec![Vec::new(); size];
    let mut stack = Vec::new();
    for column in (0..size as u32).rev() {
        match parent[column as usize] {
            u32::MAX => stack.push(column),
            parent => children[parent as usize].push(column),
        }
    }
    let mut reversed = Vec::with_capacity(size);
    // The one with the largest number, which most often has the most rows, comes last.
    stack.reverse();
    while let Some(column) = stack.pop() {
        reversed.push(order[column as usize]);
        let mut own = std::mem::take(&mut children[column as usize]);
        own.sort_unstable();
        stack.extend(own);
    }
    reversed.reverse();
    reversed.iter().zip(0..).for_each(|(&group, at)| place[group as usize] = at);
    let (rows, parent) = rows_below(neighbours, &reversed, &place);
    Some((reversed, rows, parent))
}

/// The rows of each column of the factors below the diagonal, increasing, and the first of them; none where there is none.
fn rows_below(neighbours: &Rows, order: &[u32], place: &[u32]) -> (Rows, Vec<u32>) {
    let size = order.len();
    let (mut rows, mut parent): (Rows, _) = (vec![Vec::new(); size], vec![u32::MAX; size]);
    let mut children: Vec<Vec<u32>> = vec![Vec::new(); size];
    for column in 0..size {
        let mut own: Vec<u32> =
            neighbours[order[column] as usize].iter().map(|&other| place[other as usize]).collect();
        for &child in &children[column] {
            own.extend_from_slice(&rows[child as usize]);
        }
        own.retain(|&row| row as usize > column);
        own.sort_unstable();
        own.dedup();
        if let Some(&first) = own.first() {
            parent[column] = first;
            children[first as usize].push(column as u32);
        }
        rows[column] = own;
    }
    (rows, parent)
}

/// Fronts: the first column of each, the one after its last, and the rows below.
fn merge(order: &[u32], rows: &Rows, parent: &[u32], counts: &[usize]) -> Vec<(usize, usize, Vec<u32>)> {
    let height = |column: usize| counts[order[column] as usize];
    let below = |rows: &[u32]| rows.iter().map(|&row| height(row as usize)).sum::<usize>();
    /// A front as it grows, with its columns, and the zeros among its entries.
    struct Grown {
        head: usize,
        columns: usize,
        zeros: usize,
    }
    let mut all: Vec<(Grown, usize)> = Vec::new();
    for column in 0..order.len() {
        let mut own = Grown { head: column, columns: height(column), zeros: 0 };
        let under = below(&rows[column]);
        // The one before it, if it ends in a child of it.
        while let Some((before, end)) = all.last() {
            if parent[*end - 1] as usize > column {
                break;
            }
            let missing = own.columns + under - below(&rows[*end - 1]);
            let zeros = before.zeros + own.zeros + before.columns * missing;
            let columns = before.columns + own.columns;
            let entries = columns * (columns + 1) / 2 + columns * under;
            let part = zeros as f64 / entries as f64;
            if zeros > 0 && !TOGETHER.iter().any(|&(most, zeros)| columns <= most && part < zeros) {
                break;
            }
            own = Grown { head: before.head, columns, zeros };
            all.pop();
        }
        all.push((own, column + 1));
    }
    all.into_iter().map(|(front, end)| (front.head, end, rows[end - 1].clone())).collect()
}

/// The columns of a front, column by column, made those of L with D on the diagonal, and what is left of the others.
struct Elimination<'a> {
    work: &'a mut [f64],
    stride: usize,
    height: usize,
    /// Of each column to eliminate, the pivot that takes the place of smaller ones.
    floors: &'a [f64],
}

impl WithSimd for Elimination<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { work, stride, height, floors } = self;
        let columns = floors.len();
        for first in (0..columns).step_by(PANEL) {
            let last = (first + PANEL).min(columns);
            panel(simd, work, stride, first, &floors[first..last]);
            let (left, right) = work.split_at_mut(last * stride);
            let left = &left[first * stride..];
            let right = &mut right[..(height - last) * stride];
            match last - first {
                1 => rest::<S, 1>(simd, left, right, stride, [first, last]),
                2 => rest::<S, 2>(simd, left, right, stride, [first, last]),
                3 => rest::<S, 3>(simd, left, right, stride, [first, last]),
                4 => rest::<S, 4>(simd, left, right, stride, [first, last]),
                5 => rest::<S, 5>(simd, left, right, stride, [first, last]),
                6 => rest::<S, 6>(simd, left, right, stride, [first, last]),
                7 => rest::<S, 7>(simd, left, right, stride, [first, last]),
                _ => rest::<S, PANEL>(simd, left, right, stride, [first, last]),
            }
        }
    }
}

/// Eliminates some columns among themselves.
#[inline(always)]
fn panel<S: Simd>(simd: S, work: &mut [f64], stride: usize, first: usize, floors: &[f64]) {
    for (column, &floor) in (first..).zip(floors) {
        let (left, right) = work.split_at_mut(column * stride);
        let own = &mut right[..stride];
        for before in first..column {
            update::<S, 1, 1>(simd, &left[before * stride..], own, stride, [before, column]);
        }
        // Pivots that vanish are kept from dividing by zero; they are found later.
        let pivot = if own[column].abs() <= floor { floor } else { own[column] };
        let factor = simd.splat_f64s(1.0 / pivot);
        for entries in &mut S::as_mut_simd_f64s(own).0[column / S::F64_LANES..] {
            *entries = simd.mul_f64s(*entries, factor);
        }
        own[column] = pivot;
    }
}

/// Takes what columns make from all others, four at a time.
#[inline(always)]
fn rest<S: Simd, const N: usize>(
    simd: S,
    left: &[f64],
    right: &mut [f64],
    stride: usize,
    [first, last]: [usize; 2],
) {
    let mut column = last;
    let mut fours = right.chunks_exact_mut(4 * stride);
    for four in &mut fours {
        update::<S, N, 4>(simd, left, four, stride, [first, column]);
        column += 4;
    }
    for one in fours.into_remainder().chunks_exact_mut(stride) {
        update::<S, N, 1>(simd, left, one, stride, [first, column]);
        column += 1;
    }
}

/// C −= L D Lᵀ of N columns of L, whose first pivot is in row `first`, for M columns from one on.
#[inline(always)]
fn update<S: Simd, const N: usize, const M: usize>(
    simd: S,
    left: &[f64],
    to: &mut [f64],
    stride: usize,
    [first, column]: [usize; 2],
) {
    let from = column / S::F64_LANES;
    let factors: [[S::f64s; M]; N] = std::array::from_fn(|n| {
        let own = &left[n * stride..][..stride];
        std::array::from_fn(|m| simd.splat_f64s(own[column + m] * own[first + n]))
    });
    let left: [&[S::f64s]; N] =
        std::array::from_fn(|n| &S::as_simd_f64s(&left[n * stride..][..stride]).0[from..]);
    let mut columns = to.chunks_exact_mut(stride);
    let to: [&mut [S::f64s]; M] = std::array::from_fn(|_| {
        columns.next().map_or(&mut [][..], |own| &mut S::as_mut_simd_f64s(own).0[from..])
    });
    let registers = left[0].len();
    let left = left.map(|own| &own[..registers]);
    for register in 0..registers {
        let mut sums: [S::f64s; M] = std::array::from_fn(|m| to[m][register]);
        for n in 0..N {
            let own = left[n][register];
            for m in 0..M {
                sums[m] = simd.negate_mul_add_e_f64s(own, factors[n][m], sums[m]);
            }
        }
        for m in 0..M {
            to[m][register] = sums[m];
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, SymmetricEigen};
    use pliant_testing::Random;

    use super::*;
    use crate::sparse::Equations;

    /// A strip of triangles of a width, some of whose nodes touch others far away; a few components are held.
    fn pattern(width: u32, length: u32, contacts: usize) -> LowerMatrix {
        let mut random = Random::new(5);
        let nodes = width * length;
        let cells: Vec<[u32; 3]> = (0..(width - 1) * (length - 1))
            .flat_map(|k| {
                let a = k % (width - 1) + width * (k / (width - 1));
                [[a, a + 1, a + width], [a + 1, a + width + 1, a + width]]
            })
            .collect();
        let mut some = || (random.part() * f64::from(nodes)) as u32;
        let mut pairs: Vec<[u32; 2]> = (0..contacts).map(|_| [some(), some()]).collect();
        pairs.retain(|[a, b]| a < b);
        let free: Vec<bool> = (0..6 * nodes).map(|component| component % 41 != 0).collect();
        LowerMatrix::new(&Equations::new(&free), cells.iter().map(|cell| &cell[..]), &pairs)
    }

    /// Values between −1 and 1, and larger ones of both signs on the diagonal, every `period`th negative.
    fn fill(matrix: &mut LowerMatrix, period: usize) {
        let mut random = Random::new(9);
        matrix.value.iter_mut().for_each(|value| *value = random.number());
        for equation in 0..matrix.len() {
            let at = matrix.column_start[equation] as usize;
            matrix.value[at] = if equation % period == period - 1 { -40.0 } else { 40.0 };
        }
    }

    /// Strips of several widths, with and without contacts, definite and not: residuals are round-off.
    #[test]
    fn solutions_solve_the_equations() {
        for (width, length, contacts, period) in
            [(2, 2, 0, 7), (3, 40, 0, usize::MAX), (8, 9, 30, 5), (12, 12, 100, usize::MAX)]
        {
            let mut matrix = pattern(width, length, contacts);
            fill(&mut matrix, period);
            let mut fronts = Fronts::new(&matrix).unwrap();
            // The memory of a first factorisation leaves no trace.
            for _ in 0..2 {
                let pivots = fronts.factorise(&matrix).unwrap();
                assert_eq!(pivots.negative > 0, period < usize::MAX, "{width} {length}");
                let right: Vec<f64> = (0..matrix.len()).map(|k| (k as f64).sin()).collect();
                let (mut x, mut back) = (right.clone(), right.clone());
                fronts.solve(&mut x);
                matrix.multiply_values(&matrix.value, &x, &mut back);
                let off = back.iter().zip(&right).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(off < 1e-11, "{width} {length}: {off:e}");
            }
        }
    }

    /// Sylvester's law: as many pivots are negative as eigenvalues.
    #[test]
    fn negative_pivots_are_counted_as_negative_eigenvalues() {
        let mut matrix = pattern(4, 5, 10);
        fill(&mut matrix, 3);
        let mut dense = DMatrix::zeros(matrix.len(), matrix.len());
        for column in 0..matrix.len() {
            for at in matrix.column_start[column]..matrix.column_start[column + 1] {
                let row = matrix.row[at as usize] as usize;
                dense[(row, column)] = matrix.value[at as usize];
                dense[(column, row)] = matrix.value[at as usize];
            }
        }
        let negative = SymmetricEigen::new(dense).eigenvalues.iter().filter(|value| **value < 0.0).count();
        let pivots = Fronts::new(&matrix).unwrap().factorise(&matrix).unwrap();
        assert_eq!(pivots.negative, negative);
    }

    /// A row of zeros is found as the weakest pivot; a number that is not finite is told.
    #[test]
    fn a_singular_matrix_is_found() {
        let mut matrix = pattern(4, 4, 0);
        fill(&mut matrix, usize::MAX);
        let equation = 17;
        for column in 0..matrix.len() {
            for at in matrix.column_start[column] as usize..matrix.column_start[column + 1] as usize {
                if column == equation || matrix.row[at] as usize == equation {
                    matrix.value[at] = 0.0;
                }
            }
        }
        let mut fronts = Fronts::new(&matrix).unwrap();
        let pivots = fronts.factorise(&matrix).unwrap();
        assert!(pivots.smallest < ZERO_PIVOT && pivots.weakest == equation, "{pivots:?}");
        matrix.value[3] = f64::NAN;
        assert!(fronts.factorise(&matrix).is_none());
    }
}
