//! Dense parts of factors: panels of columns with rows in multiples of [`PACK`], and kernels for the
//! registers of any processor. Columns are done in blocks, and these in strips that stay in registers with
//! some of their rows.

#![expect(
    clippy::needless_range_loop,
    clippy::manual_memcpy,
    reason = "plain loops over tiles stay in registers"
)]

use pulp::Simd;

use crate::supernodes::{PACK, Run, padded};

/// Columns of a block: their rows stay in the cache while the columns to the right take them off.
pub(crate) const BLOCK: usize = 48;
/// Columns of a strip, as many as a node has.
const STRIP: usize = 6;

/// Some rows of some columns in registers. They are filled and passed on in place. The compiler leaves
/// `array::from_fn` as a call and copies returned arrays, which took as long as all the rest.
type Tile<S, const C: usize, const R: usize> = [[<S as Simd>::f64s; R]; C];

/// A few registers.
#[inline(always)]
fn load<S: Simd, const R: usize>(from: &[f64], into: &mut [S::f64s; R]) {
    let registers = S::as_simd_f64s(&from[..R * S::F64_LANES]).0;
    for r in 0..R {
        into[r] = registers[r];
    }
}

#[inline(always)]
fn store<S: Simd, const R: usize>(numbers: &[S::f64s; R], to: &mut [f64]) {
    let registers = S::as_mut_simd_f64s(&mut to[..R * S::F64_LANES]).0;
    for r in 0..R {
        registers[r] = numbers[r];
    }
}

/// Calls a function of some registers of rows for all rows from a first up to a last one, both multiples of
/// [`PACK`]. Each call takes as many rows as there are registers for.
macro_rules! for_rows {
    ($simd:ident, $from:expr, $to:expr, $row:ident, $registers:ident => $call:expr) => {{
        let mut $row: usize = $from;
        let to: usize = $to;
        macro_rules! with {
            ($count:literal) => {
                while $row + $count * S::F64_LANES <= to {
                    const $registers: usize = $count;
                    $call;
                    $row += $count * S::F64_LANES;
                }
            };
        }
        match S::F64_LANES {
            8 => {
                with!(4);
                with!(2);
                with!(1);
            }
            4 => with!(2),
            2 => with!(4),
            _ => with!(1),
        }
    }};
}

/// Calls a function of a number of columns for all columns from one on up to another.
macro_rules! for_strips {
    ($from:expr, $to:expr, $column:ident, $count:ident => $call:expr) => {{
        let mut $column: usize = $from;
        let to: usize = $to;
        macro_rules! with {
            ($width:expr) => {
                while to - $column >= $width {
                    const $count: usize = $width;
                    $call;
                    $column += $width;
                }
            };
        }
        with!(STRIP);
        with!(3);
        with!(1);
    }};
}

/// Pivots of the columns of a panel, as they are found.
pub(crate) struct PivotColumns<'a> {
    /// The diagonal of the matrix, without signs.
    pub diagonal: &'a [f64],
    pub pivot: &'a mut [f64],
    /// Pivots below this part of the diagonal are made as large, so that nothing is divided by zero.
    pub tiny: f64,
}

/// Columns of a panel, and in places of them L D where these are.
struct Strip<'a> {
    /// The columns from the first of the block on, and L D of these columns.
    columns: &'a mut [f64],
    scaled: &'a mut [f64],
    /// Rows.
    height: usize,
    /// The first column of the block in the panel, and the strip's in the block.
    block: usize,
    at: usize,
}

/// L and 1/D of the rows of a strip that are its own columns.
struct Corner<const C: usize> {
    lower: [[f64; C]; C],
    inverse: [f64; C],
}

impl Strip<'_> {
    /// Subtracts columns before the strip from the strip.
    #[inline(always)]
    fn take_off<S: Simd, const C: usize, const R: usize>(&mut self, simd: S, row: usize) {
        let mut tile: Tile<S, C, R> = [[simd.splat_f64s(0.0); R]; C];
        self.load_rows::<S, C, R>(row, &mut tile);
        self.less_columns::<S, C, R>(simd, row, &mut tile);
        for c in 0..C {
            store::<S, R>(&tile[c], &mut self.columns[(self.at + c) * self.height + row..]);
        }
    }

    #[inline(always)]
    fn load_rows<S: Simd, const C: usize, const R: usize>(&self, row: usize, tile: &mut Tile<S, C, R>) {
        for c in 0..C {
            load::<S, R>(&self.columns[(self.at + c) * self.height + row..], &mut tile[c]);
        }
    }

    #[inline(always)]
    fn less_columns<S: Simd, const C: usize, const R: usize>(
        &self,
        simd: S,
        row: usize,
        tile: &mut Tile<S, C, R>,
    ) {
        let Self { columns, scaled, height, block, at } = self;
        less_products::<S, C, R>(simd, tile, [scaled, columns], *height, *at, [row, block + at]);
    }

    /// Solves for L D and L of some rows below the columns of the strip; whose columns before are taken off
    /// already, or not yet.
    #[inline(always)]
    fn divide<S: Simd, const C: usize, const R: usize>(
        &mut self,
        simd: S,
        row: usize,
        corner: &Corner<C>,
        is_reached: bool,
    ) {
        let mut tile: Tile<S, C, R> = [[simd.splat_f64s(0.0); R]; C];
        self.load_rows::<S, C, R>(row, &mut tile);
        if !is_reached {
            self.less_columns::<S, C, R>(simd, row, &mut tile);
        }
        // Written out: numbers that a variable index chooses would not stay in registers.
        macro_rules! column {
            ($c:literal $($before:literal)*) => {
                if $c < C {
                    $({
                        let l = simd.splat_f64s(corner.lower[$c][$before]);
                        for r in 0..R {
                            tile[$c][r] = simd.negate_mul_add_e_f64s(tile[$before][r], l, tile[$c][r]);
                        }
                    })*
                    let at = (self.at + $c) * self.height + row;
                    store::<S, R>(&tile[$c], &mut self.scaled[at..]);
                    let inverse = simd.splat_f64s(corner.inverse[$c]);
                    let mut lower = tile[$c];
                    for r in 0..R {
                        lower[r] = simd.mul_f64s(tile[$c][r], inverse);
                    }
                    store::<S, R>(&lower, &mut self.columns[at..]);
                }
            };
        }
        column!(0);
        column!(1 0);
        column!(2 0 1);
        column!(3 0 1 2);
        column!(4 0 1 2 3);
        column!(5 0 1 2 3 4);
    }

    /// L D Lᵀ of the rows that are the strip's own columns, from which columns before are taken off.
    #[inline(always)]
    fn corner<const C: usize>(&self, pivots: &mut PivotColumns<'_>) -> Corner<C> {
        let first = self.block + self.at;
        let mut entries = [[0.0; C]; C];
        for c in 0..C {
            entries[c].copy_from_slice(&self.columns[(self.at + c) * self.height + first..][..C]);
        }
        let mut corner = Corner { lower: [[0.0; C]; C], inverse: [0.0; C] };
        for c in 0..C {
            let mut pivot = entries[c][c];
            let tiny = pivots.tiny * pivots.diagonal[first + c];
            if pivot.abs() < tiny {
                pivot = tiny.copysign(pivot);
            }
            pivots.pivot[first + c] = pivot;
            let inverse = 1.0 / pivot;
            corner.inverse[c] = inverse;
            for r in c + 1..C {
                corner.lower[r][c] = entries[c][r] * inverse;
            }
            for right in c + 1..C {
                for r in right..C {
                    entries[right][r] -= corner.lower[right][c] * entries[c][r];
                }
            }
        }
        corner
    }

    #[inline(always)]
    fn eliminate<S: Simd, const C: usize>(&mut self, simd: S, pivots: &mut PivotColumns<'_>) {
        let first = self.block + self.at;
        let (top, bottom) = (first / PACK * PACK, padded(first + C));
        for_rows!(simd, top, bottom, row, R => self.take_off::<S, C, R>(simd, row));
        let corner = self.corner::<C>(pivots);
        for_rows!(simd, top, bottom, row, R => self.divide::<S, C, R>(simd, row, &corner, true));
        for_rows!(simd, bottom, self.height, row, R => self.divide::<S, C, R>(simd, row, &corner, false));
    }
}

/// Takes (L D) Lᵀ of a number of columns of a panel off some rows of some columns: L D of the rows from one
/// on, L of those from another on.
#[inline(always)]
fn less_products<S: Simd, const C: usize, const R: usize>(
    simd: S,
    tile: &mut Tile<S, C, R>,
    [scaled, lower]: [&[f64]; 2],
    height: usize,
    count: usize,
    [row, other]: [usize; 2],
) {
    let mut here = [simd.splat_f64s(0.0); R];
    for column in 0..count {
        load::<S, R>(&scaled[column * height + row..], &mut here);
        let there = &lower[column * height + other..][..C];
        for c in 0..C {
            let l = simd.splat_f64s(there[c]);
            for r in 0..R {
                tile[c][r] = simd.negate_mul_add_e_f64s(here[r], l, tile[c][r]);
            }
        }
    }
}

/// Columns of a matrix of which the lower half is wanted, and their place in a panel whose products they
/// take.
struct Rest<'a> {
    columns: &'a mut [f64],
    height: usize,
    /// The columns there are, the first of them by its row.
    range: [usize; 2],
    /// The row of the panel that is row 0 here.
    shift: usize,
    /// True if the columns count as zero so far, whatever is stored.
    is_new: bool,
}

impl Rest<'_> {
    /// Takes (L D) Lᵀ of columns of a panel of some height off.
    #[inline(always)]
    fn take<S: Simd>(&mut self, simd: S, of: [&[f64]; 2], height: usize, count: usize) {
        let [from, to] = self.range;
        for_strips!(from, to, column, C => {
            for_rows!(simd, column / PACK * PACK, self.height, row, R => {
                self.take_rows::<S, C, R>(simd, of, [height, count], [column, row]);
            });
        });
    }

    #[inline(always)]
    fn take_rows<S: Simd, const C: usize, const R: usize>(
        &mut self,
        simd: S,
        of: [&[f64]; 2],
        [height, count]: [usize; 2],
        [column, row]: [usize; 2],
    ) {
        let first = (column - self.range[0]) * self.height + row;
        let mut tile: Tile<S, C, R> = [[simd.splat_f64s(0.0); R]; C];
        if !self.is_new {
            for c in 0..C {
                load::<S, R>(&self.columns[first + c * self.height..], &mut tile[c]);
            }
        }
        let places = [self.shift + row, self.shift + column];
        less_products::<S, C, R>(simd, &mut tile, of, height, count, places);
        for c in 0..C {
            store::<S, R>(&tile[c], &mut self.columns[first + c * self.height..]);
        }
    }
}

/// Computes L of a panel of some columns, and the update of the rows below. These rows begin at the padded
/// width.
#[inline(always)]
pub(crate) fn eliminate<S: Simd>(
    simd: S,
    panel: &mut [f64],
    width: usize,
    scaled: &mut [f64],
    left: &mut [f64],
    mut pivots: PivotColumns<'_>,
) {
    let height = panel.len() / width;
    let edge = padded(width);
    let below = left.len() / (height - edge).max(1);
    for block in (0..width).step_by(BLOCK) {
        let count = BLOCK.min(width - block);
        let (columns, others) = panel[block * height..].split_at_mut(count * height);
        for_strips!(0, count, at, C => {
            let mut strip = Strip { columns: &mut *columns, scaled: &mut *scaled, height, block, at };
            strip.eliminate::<S, C>(simd, &mut pivots);
        });
        let products = [&*scaled, &*columns];
        let range = [block + count, width];
        let mut rest = Rest { columns: others, height, range, shift: 0, is_new: false };
        rest.take(simd, products, height, count);
        let (height_left, range, is_new) = (height - edge, [0, below], block == 0);
        let mut rest = Rest { columns: &mut *left, height: height_left, range, shift: edge, is_new };
        rest.take(simd, products, height, count);
    }
}

/// Update of a supernode for its rows below.
pub(crate) struct Left<'a> {
    pub numbers: &'a [f64],
    /// Rows, padded.
    pub height: usize,
    pub runs: &'a [Run],
}

impl Left<'_> {
    /// Adds the update of the front's columns in a range to `columns`. Their first row belongs to the first
    /// of these columns.
    #[inline(always)]
    pub(crate) fn add_to(&self, columns: &mut [f64], height: usize, [from, to]: [usize; 2]) {
        let is_there = |run: &Run| (from..to).contains(&(run.to as usize));
        for (number, across) in self.runs.iter().enumerate().filter(|(_, run)| is_there(run)) {
            let numbers =
                &self.numbers[across.from as usize * self.height..][..across.len as usize * self.height];
            let to = &mut columns[(across.to as usize - from) * height..][..across.len as usize * height];
            // Of its own rows those above the diagonal go along: nobody looks at them.
            for run in &self.runs[number..] {
                let places = [run.from as usize, run.to as usize - from];
                // Rows of a node or of its translations, mostly. Loops: zipped iterators that fold stay
                // calls.
                macro_rules! add_columns {
                    ($add:expr) => {
                        for (column, to) in numbers.chunks_exact(self.height).zip(to.chunks_exact_mut(height))
                        {
                            $add(column, to, places);
                        }
                    };
                }
                match run.len {
                    3 => add_columns!(add::<3>),
                    6 => add_columns!(add::<6>),
                    len => add_columns!(|column, to, places| add_all(column, to, places, len as usize)),
                }
            }
        }
    }
}

/// Adds `N` numbers from a place on to others.
#[inline(always)]
fn add<const N: usize>(from: &[f64], to: &mut [f64], [source, other]: [usize; 2]) {
    let (to, from) = (&mut to[other..other + N], &from[source..source + N]);
    for i in 0..N {
        to[i] += from[i];
    }
}

/// Adds any count of numbers, mostly a multiple of three.
#[inline(always)]
fn add_all(from: &[f64], to: &mut [f64], places: [usize; 2], len: usize) {
    let mut done = 0;
    macro_rules! add {
        ($count:literal) => {{
            add::<$count>(from, to, places.map(|place| place + done));
            done += $count;
        }};
    }
    while done + 12 <= len {
        add!(12);
    }
    if done + 6 <= len {
        add!(6);
    }
    if done + 3 <= len {
        add!(3);
    }
    while done < len {
        add!(1);
    }
}

/// Sums of the rows of a panel from one on, each column times a number.
#[inline(always)]
pub(crate) fn multiply<S: Simd>(simd: S, panel: &[f64], numbers: &[f64], from: usize, sums: &mut [f64]) {
    let height = panel.len() / numbers.len();
    for_rows!(simd, 0, sums.len(), row, R => {
        let mut totals = [simd.splat_f64s(0.0); R];
        let mut entry = totals;
        for (column, number) in numbers.iter().enumerate() {
            let number = simd.splat_f64s(*number);
            load::<S, R>(&panel[column * height + from + row..], &mut entry);
            for r in 0..R {
                totals[r] = simd.mul_add_e_f64s(entry[r], number, totals[r]);
            }
        }
        store::<S, R>(&totals, &mut sums[row..]);
    });
}

/// a · b of multiples of [`PACK`].
#[inline(always)]
pub(crate) fn dot<S: Simd>(simd: S, a: &[f64], b: &[f64]) -> f64 {
    let mut sum = simd.splat_f64s(0.0);
    for (a, b) in S::as_simd_f64s(a).0.iter().zip(S::as_simd_f64s(b).0) {
        sum = simd.mul_add_e_f64s(*a, *b, sum);
    }
    simd.reduce_sum_f64s(sum)
}
