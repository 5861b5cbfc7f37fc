//! The stiffest modes of cells in a deformed state. With one evaluation point K_ab = V B_aᵀ A B_b, A = ∂P/∂F.
//! The eigenvalues of K other than zero are also the eigenvalues of V Lᵀ A L, where L Lᵀ = G = Σ B_a⊗B_a.
//! This is a 9×9 problem for any number of nodes. A comes from the law's stress by central differences, so
//! that it is right for every law: nothing about stiffening is assumed. The instantaneous response bounds the
//! response of a relaxing law. A triangle of a membrane is taken in its own frame, where it has no gradient
//! across: the modes across have no stiffness. A pack of cells is taken at once, in lanes.

use std::array::from_fn;

use pliant_mechanics::Number;
use pliant_mechanics::element::{Cord, Pull, Rest};
use pliant_mechanics::law::MOST_FAMILIES;
use pliant_mechanics::law::plane_stress::InPlane;
use pliant_mechanics::model::{Cells, Solid};
use pliant_mechanics::tensor::{Symmetric, Tensor, Vector, dot, scale};

use crate::eigenvalues::{ROWS, eigenvector, largest_of_nine, largest_of_three};
use crate::forces::{Batch, Wanted, growth};
use crate::lanes::{LaneWork, Lanes, PACK, Pack, Processor, load_symmetric, load_tensor};

/// Size of the differences of F: truncation and round-off both near 1e-10.
const DIFFERENCE: f64 = 1e-5;

/// Σ B_a ⊗ B_a [1/m²].
pub(crate) fn gradient_square(gradient: &[Vector<f64>]) -> Symmetric<f64> {
    gradient.iter().fold(Symmetric::ZERO, |sum, &b| sum + Symmetric::dyad(b))
}

/// Stiffness of a cell per volume [Pa/m²].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Stiffness {
    /// The largest eigenvalue of K/V, over all modes.
    pub mode: f64,
    /// The largest over the modes n⊗y of plane waves, which neighbours in a mesh share. A cell alone is often
    /// stiffest in a change of volume, in all directions at once. Compression along one direction hardly
    /// changes this stiffness.
    pub wave: f64,
    /// The factor on the stiffness of hourglass control.
    pub hourglass: f64,
}

/// Returns the stiffness of at most [`PACK`] cells, each with its displacement gradient and its Σ B_a ⊗ B_a
/// [1/m²]. Entries beyond the cells mean nothing. The stiffness is not a number where the law is not defined.
pub(crate) fn stiffness(
    solid: &Solid,
    cells: &[u32],
    state: impl Fn(usize) -> (Tensor<f64>, Symmetric<f64>),
) -> [Stiffness; PACK] {
    let cells: [usize; PACK] = from_fn(|lane| cells[lane.min(cells.len() - 1)] as usize);
    of_states(solid, &cells, &cells.map(state))
}

/// Stiffness of cells in known states. Not generic: so laws are compiled here, and not again in every crate
/// that steps a model.
fn of_states(
    solid: &Solid,
    cells: &[usize; PACK],
    states: &[(Tensor<f64>, Symmetric<f64>); PACK],
) -> [Stiffness; PACK] {
    if let Cells::Bar(block, cord) = &solid.cells {
        return from_fn(|lane| of_bar(solid, &block.rest[cells[lane]], cord, &states[lane].0));
    }
    let entry = |i: usize, k: usize| Pack::from_fn(|lane| states[lane].0.0[i][k]);
    let mut fibres = [[Pack::ZERO; 3]; MOST_FAMILIES];
    for (lane, &cell) in cells.iter().enumerate() {
        for (to, fibre) in fibres.iter_mut().zip(&*solid.law_fibres(cell)) {
            (0..3).for_each(|k| to[k].0[lane] = fibre[k]);
        }
    }
    let [mode, wave, hourglass] = Processor::detect().run(Tangents {
        solid,
        cells,
        gradient: &Tensor(from_fn(|i| from_fn(|k| entry(i, k)))),
        square: &Symmetric(from_fn(|k| Pack::from_fn(|lane| states[lane].1.0[k]))),
        fibres: &fibres,
    });
    from_fn(|lane| Stiffness { mode: mode.0[lane], wave: wave.0[lane], hourglass: hourglass.0[lane] })
}

/// Returns the stiffness of a bar, as if it were taut: E/(λ₀ L²) along the bar, or P/(λ L²) across, twice for
/// its two nodes. Here λ₀ is the slack.
fn of_bar(solid: &Solid, rest: &Rest<2>, cord: &Cord, h: &Tensor<f64>) -> Stiffness {
    let Pull { length, stress: [stress, _], .. } =
        cord.pull(rest, h.apply(rest.between()), solid.material.law.small_strain().young());
    let along = solid.longitudinal_modulus() / rest.length().powi(2);
    let mode = 2.0 * along.max(stress / (rest.length() * length));
    Stiffness { mode, wave: mode, hourglass: 1.0 }
}

/// Directions in which the search for the stiffest wave begins: axes and diagonals of the square.
const BEGINNINGS: [Vector<f64>; 9] = [
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.0, 1.0, 1.0],
    [0.0, 1.0, -1.0],
    [1.0, 0.0, 1.0],
    [1.0, 0.0, -1.0],
    [1.0, 1.0, 0.0],
    [1.0, -1.0, 0.0],
];
/// Rows and columns of the entries of a symmetric tensor.
const ENTRIES: [[usize; 2]; 6] = [[0, 0], [1, 1], [2, 2], [0, 1], [1, 2], [0, 2]];
/// Turns of the search.
const TURNS: usize = 4;

/// Pack of cells, with the input of [`stiffness`] for each cell.
struct Tangents<'a> {
    solid: &'a Solid,
    cells: &'a [usize; PACK],
    gradient: &'a Tensor<Pack<f64>>,
    square: &'a Symmetric<Pack<f64>>,
    fibres: &'a [Vector<Pack<f64>>; MOST_FAMILIES],
}

/// Lᵀ A L, rows and columns by direction of displacement, then by column of L.
type Matrix<N> = [[N; ROWS]; ROWS];

impl LaneWork<f64> for Tangents<'_> {
    /// The largest eigenvalues over all modes and over plane waves, and the factors on hourglass control.
    type Output = [Pack<f64>; 3];

    #[inline(always)]
    fn run<L: Lanes<f64>>(self) -> Self::Output {
        let mut batch = Batch::new();
        let mut matrix: Matrix<Pack<f64>> = [[Pack::ZERO; ROWS]; ROWS];
        for i in 0..3 {
            for p in 0..3 {
                self.displace::<L>(&mut batch, i, p);
                self.stresses::<L>(&mut batch);
                self.fill_column::<L>(&batch, &mut matrix, 3 * i + p);
            }
        }
        let hourglass = self.hourglass::<L>(&mut batch);
        let (mut mode, mut wave) = (Pack::ZERO, Pack::ZERO);
        for at in (0..PACK).step_by(L::WIDTH) {
            let size = load_symmetric::<f64, L>(self.square, at).trace();
            let mut symmetric = [[L::ZERO; ROWS]; ROWS];
            // A value that is not a number stays so: maxima on the way may lose it.
            let mut sound = L::ZERO;
            for i in 0..ROWS {
                for k in 0..ROWS {
                    symmetric[i][k] = L::of(0.5) * (L::load(&matrix[i][k], at) + L::load(&matrix[k][i], at));
                    sound += L::ZERO * symmetric[i][k];
                }
            }
            (size * stiffest_wave(&symmetric) + sound).store(&mut wave, at);
            (size * largest_of_nine(&mut { symmetric }) + sound).store(&mut mode, at);
        }
        [mode, wave, hourglass]
    }
}

impl Tangents<'_> {
    /// The factors on the stiffness of hourglass control.
    #[inline(always)]
    fn hourglass<L: Lanes<f64>>(&self, batch: &mut Batch<f64>) -> Pack<f64> {
        let mut factors = Pack([1.0; PACK]);
        if let Some(shear) = self.solid.hourglass_growth() {
            for at in (0..PACK).step_by(L::WIDTH) {
                batch.set(0, at, &load_tensor::<f64, L>(self.gradient, at));
            }
            batch.evaluate::<L>(&self.solid.material.law, Wanted::Whole, 1, 1, self.fibres);
            for at in (0..PACK).step_by(L::WIDTH) {
                growth::<f64, L>(batch, shear, at).store(&mut factors, at);
            }
        }
        factors
    }

    /// The columns of L over √|G|.
    #[inline(always)]
    fn columns<L: Lanes<f64>>(&self, at: usize) -> [Vector<L>; 3] {
        let square: Symmetric<L> = load_symmetric(self.square, at);
        cholesky_columns(&(square * (L::ONE / square.trace())))
    }

    /// Moves row `i` of the displacement gradient along column `p`, ahead and behind.
    #[inline(always)]
    fn displace<L: Lanes<f64>>(&self, batch: &mut Batch<f64>, i: usize, p: usize) {
        for at in (0..PACK).step_by(L::WIDTH) {
            let (h, columns): (Tensor<L>, _) = (load_tensor(self.gradient, at), self.columns::<L>(at));
            for (pack, by) in [DIFFERENCE, -DIFFERENCE].into_iter().enumerate() {
                let mut moved = h;
                for (entry, c) in moved.0[i].iter_mut().zip(scale(columns[p], L::of(by))) {
                    *entry += c;
                }
                batch.set(pack, at, &moved);
            }
        }
    }

    /// The elastic stresses ahead and behind.
    #[inline(always)]
    fn stresses<L: Lanes<f64>>(&self, batch: &mut Batch<f64>) {
        match &self.solid.cells {
            Cells::Membrane(..) => plane_stresses(self.solid, self.cells, batch),
            _ => batch.evaluate::<L>(&self.solid.material.law, Wanted::Whole, 2, 2, self.fibres),
        }
    }

    /// A column of Lᵀ A L from the stresses ahead and behind.
    #[inline(always)]
    fn fill_column<L: Lanes<f64>>(&self, batch: &Batch<f64>, matrix: &mut Matrix<Pack<f64>>, column: usize) {
        for at in (0..PACK).step_by(L::WIDTH) {
            let columns = self.columns::<L>(at);
            let [ahead, behind] =
                [first_piola_kirchhoff::<L>(batch, 0, at), first_piola_kirchhoff(batch, 1, at)];
            let change = ahead.plus_scaled(&behind, -L::ONE).scaled(L::of(0.5 / DIFFERENCE));
            for (k, row) in change.0.into_iter().enumerate() {
                for (q, &factor) in columns.iter().enumerate() {
                    dot(row, factor).store(&mut matrix[3 * k + q][column], at);
                }
            }
        }
    }
}

/// F S [Pa].
#[inline(always)]
fn first_piola_kirchhoff<L: Lanes<f64>>(batch: &Batch<f64>, pack: usize, at: usize) -> Tensor<L> {
    batch.deformation_gradient::<L>(pack, at).times_symmetric(&batch.stress::<L>(pack, at))
}

/// The stresses of the triangles of a membrane, at the first two packs.
fn plane_stresses(solid: &Solid, cells: &[usize; PACK], batch: &mut Batch<f64>) {
    for pack in 0..2 {
        for (lane, &cell) in cells.iter().enumerate() {
            // Columns of H are the changes of the axes of the frame.
            let changes = [0, 1].map(|i| [0, 1, 2].map(|k| batch.gradient[pack].0[k][i].0[lane]));
            let plane = InPlane::from_changes(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], &changes);
            let found = solid.material.law.plane_stress(plane.strain_twice, &solid.law_fibres(cell));
            let [xx, yy, xy] = found.stress;
            for (to, s) in batch.stress[pack].0.iter_mut().zip([xx, yy, 0.0, xy, 0.0, 0.0]) {
                to.0[lane] = s;
            }
        }
    }
}

/// Returns max (n⊗y):A:(n⊗y) over unit n and y, by turns. With one of the two kept, the other is an
/// eigenvector of a 3×3 matrix.
#[inline(always)]
fn stiffest_wave<N: Number>(a: &Matrix<N>) -> N {
    let mut y = [N::ONE, N::ZERO, N::ZERO];
    let mut largest = largest_of_three(&along(a, y));
    for other in &BEGINNINGS[1..] {
        let length = dot(*other, *other).sqrt();
        let other = [N::of(other[0] / length), N::of(other[1] / length), N::of(other[2] / length)];
        let eigenvalue = largest_of_three(&along(a, other));
        // One where it is larger, and zero elsewhere.
        let better = N::of(0.5) * (N::ONE + N::ONE.copysign(eigenvalue - largest));
        for (y, other) in y.iter_mut().zip(other) {
            *y += better * (other - *y);
        }
        largest = largest.max(eigenvalue);
    }
    let mut n = y;
    for _ in 0..TURNS {
        let matrix = along(a, y);
        n = eigenvector(&matrix, largest_of_three(&matrix), n);
        let matrix = across(a, n);
        let value = largest_of_three(&matrix);
        y = eigenvector(&matrix, value, y);
        largest = largest.max(value);
    }
    largest
}

/// Contracted with y twice over columns of L, which leaves displacements.
#[inline(always)]
fn along<N: Number>(a: &Matrix<N>, y: Vector<N>) -> Symmetric<N> {
    contracted(a, y, 3, 1)
}

/// Contracted with n twice over displacements, which leaves columns of L.
#[inline(always)]
fn across<N: Number>(a: &Matrix<N>, n: Vector<N>) -> Symmetric<N> {
    contracted(a, n, 1, 3)
}

/// Contracted twice with a vector over indices that lie `over` rows apart; those that stay lie `kept` rows
/// apart.
#[inline(always)]
fn contracted<N: Number>(a: &Matrix<N>, with: Vector<N>, kept: usize, over: usize) -> Symmetric<N> {
    let mut found = Symmetric::ZERO;
    for (entry, [i, k]) in found.0.iter_mut().zip(ENTRIES) {
        for (p, &component) in with.iter().enumerate() {
            let (row, first) = (&a[kept * i + over * p], kept * k);
            *entry += component * dot([row[first], row[first + over], row[first + 2 * over]], with);
        }
    }
    found
}

/// The columns of the lower triangle L with L Lᵀ = S; of a plane S the last one is zero.
#[inline(always)]
fn cholesky_columns<N: Number>(s: &Symmetric<N>) -> [Vector<N>; 3] {
    let [xx, yy, zz, xy, yz, xz] = s.0;
    let a = xx.sqrt();
    let (b, c) = (xy / a, xz / a);
    let d = (yy - b * b).sqrt();
    let e = (yz - b * c) / d;
    let o = N::ZERO;
    [[a, b, c], [o, d, e], [o, o, (zz - c * c - e * e).max(o).sqrt()]]
}
