//! Corners of hexahedra that turn inside out while the cell as a whole, or its Gauss points, does not. The
//! determinant of the three edges at each corner is judged, but only in flat cells.
//!
//! A uniform-strain hexahedron is looked at closely only if a corner may be inverted: F at a corner is F̄ +
//! Σ_c q_c ⊗ W_c with the hourglass displacements q_c. The second term is bounded, |Σ_c q_c ⊗ W_c| ≤ κ |q|.
//! While κ |q| stays below the least stretch no corner is inverted. The least stretch is at least J/√(λ₁λ₂).
//! With |C − I|² = S the two largest eigenvalues of C have √(λ₁λ₂) ≤ 1 + √(S/2), whose square is at most 3/2
//! (1 + S). So κ² |q|² 3/2 (1 + S) < J² is enough, which costs five operations a cell.

use pliant_mechanics::Number;
use pliant_mechanics::element::{FLAT_HEX, HEX_EDGES};
use pliant_mechanics::tensor::{Vector, add, cross, dot, sub};
use rayon::prelude::*;

use super::packed::{PackedCells, relative};
use crate::lanes::LaneNumber;
use crate::lanes::{LaneWork, Lanes, Local, PACK, Pack, load_vector};

/// Nodes of packs of hexahedra at rest, relative to their first ones [m].
pub(super) struct PackedCorners<R>([Vector<Pack<R>>; 7]);

impl<R: LaneNumber> PackedCorners<R> {
    /// Packs the corners; lanes beyond the last cell repeat it.
    pub(super) fn of<const N: usize>(packed: &PackedCells<R, N>, offsets: &[[Vector<f64>; N]]) -> Vec<Self> {
        let last = packed.count.max(1) - 1;
        let number = |pack: usize, a: usize, c: usize| {
            Pack::from_fn(|lane| R::of(offsets[last.min(pack * PACK + lane)][a][c]))
        };
        let of_pack =
            |pack| Self(std::array::from_fn(|a| [0, 1, 2].map(|component| number(pack, a + 1, component))));
        packed.packs().into_par_iter().map(of_pack).collect()
    }

    /// The least determinant of the edges at a corner, with its sign turned, of the cells from lane `at` on.
    /// `u` are the displacements of all nodes but the first, relative to it.
    #[inline(always)]
    pub(super) fn depth<L: Lanes<R>>(&self, u: &[Vector<L>; 7], at: usize) -> L {
        let mut x = [[L::ZERO; 3]; 8];
        for (x, (rest, u)) in x[1..].iter_mut().zip(self.0.iter().zip(u)) {
            *x = add(load_vector(rest, at), *u);
        }
        let mut depth = depth_at(&x, 0);
        for corner in 1..8 {
            depth = depth.max(depth_at(&x, corner));
        }
        depth
    }
}

/// The determinant of the edges at a corner, with its sign turned. Written out: `array::map` is left as a
/// call here.
#[inline(always)]
fn depth_at<N: Number>(x: &[Vector<N>; 8], corner: usize) -> N {
    let [a, b, c] = HEX_EDGES[corner];
    let origin = x[corner];
    -dot(cross(sub(x[a], origin), sub(x[b], origin)), sub(x[c], origin))
}

/// True if a cell is so flat that its corners count. `flatness` is J, for uniform-strain hexahedra over √(1 +
/// S/2).
#[inline(always)]
pub(super) fn is_flat<R: LaneNumber>(flatness: R) -> bool {
    flatness < R::of(FLAT_HEX)
}

/// Returns the square of the divisor of J in the flatness of a uniform-strain hexahedron, about its least
/// stretch. Nearly incompressible cells keep their volume when they are squeezed flat.
#[inline(always)]
fn widening<R: LaneNumber>(strain: R) -> R {
    R::ONE + R::of(0.5) * strain
}

/// J over √(1 + S/2) of the cells of a pack.
pub(super) fn flatness<R: LaneNumber>(ratio: &Pack<R>, strain: &Pack<R>) -> Pack<R> {
    Pack::from_fn(|lane| ratio.0[lane] / widening(strain.0[lane]).sqrt())
}

/// The first flat cell of a pack of which a corner's determinant, with its sign turned, is not below zero.
fn first_folded<R: LaneNumber>(depths: &Pack<R>, flatness: &Pack<R>) -> Option<usize> {
    (0..PACK).find(|&lane| depths.0[lane] >= R::ZERO && is_flat(flatness.0[lane]))
}

/// True if a cell of a pack may have an inverted corner, from 3/2 κ² |q|², J and |C − I|².
#[inline(always)]
pub(super) fn may_fold<R: LaneNumber>(reach: &Pack<R>, ratio: &Pack<R>, strain: &Pack<R>) -> bool {
    let mut sound = true;
    for lane in 0..PACK {
        let square = ratio.0[lane] * ratio.0[lane];
        let flat = square < R::of(FLAT_HEX * FLAT_HEX) * widening(strain.0[lane]);
        sound &= !flat | (reach.0[lane] * (R::ONE + strain.0[lane]) < square);
    }
    !sound
}

/// Checks the corners of a pack of cells of a block.
pub(super) struct CornerCheck<'a, 'l, R, const N: usize, const M: usize> {
    pub corners: &'a PackedCorners<R>,
    pub local: &'a Local<'l, R, N>,
    /// Flatness of the cells.
    pub flatness: &'a Pack<R>,
    /// The pack, counted in the block.
    pub pack: usize,
}

impl<R: LaneNumber, const N: usize, const M: usize> LaneWork<R> for CornerCheck<'_, '_, R, N, M> {
    /// The first lane with an inverted corner.
    type Output = Option<usize>;

    #[inline(always)]
    fn run<L: Lanes<R>>(self) -> Self::Output {
        let mut depths = Pack::ZERO;
        for at in (0..PACK).step_by(L::WIDTH) {
            let (u, _) = relative::<R, L, N, M>(self.local, self.pack, at);
            let mut displacements = [[L::ZERO; 3]; 7];
            displacements.iter_mut().zip(u).for_each(|(to, u)| *to = u);
            self.corners.depth(&displacements, at).store(&mut depths, at);
        }
        first_folded(&depths, self.flatness)
    }
}
