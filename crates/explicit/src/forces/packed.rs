//! Cells in packs: their constants for all elements, and the steps from displacements to gradients and from
//! stresses to nodal forces.

use std::ops::Range;

use pliant_mechanics::model::{CellBlock, Solid};
use pliant_mechanics::tensor::{Tensor, Vector, add, cast, sub};
use rayon::prelude::*;

use super::blocks::{Blocks, MOST_PACKS, Quad};
use crate::lanes::LaneNumber;
use crate::lanes::{Lanes, Local, PACK, Pack, Places, load_vector};

/// Range of the history of one of several points, `each` packs a point, in a history of `total` packs; empty
/// in an empty one.
#[inline(always)]
pub(super) fn own_packs(point: usize, each: usize, total: usize) -> Range<usize> {
    (point * each).min(total)..((point + 1) * each).min(total)
}

/// Constants of packs of cells that all elements need.
pub(super) struct PackedCells<R, const N: usize> {
    pub(super) count: usize,
    /// Nodes of packs of cells in their block.
    pub(super) places: Places<R, N>,
    /// Directions of the families.
    fibre: Vec<Vector<Pack<R>>>,
    families: usize,
}

impl<R: LaneNumber, const N: usize> PackedCells<R, N> {
    pub(super) fn new(solid: &Solid, cells: &CellBlock<N>) -> (Self, Blocks) {
        const { assert!(Places::<R, N>::can_number(MOST_PACKS)) };
        let (blocks, local) = Blocks::new(&cells.nodes);
        let last = local.len().max(1) - 1;
        let nodes = |pack: usize| {
            let node = |a: usize| std::array::from_fn(|lane| local[last.min(pack * PACK + lane)][a]);
            std::array::from_fn(node)
        };
        let mut packed = Self {
            count: local.len(),
            places: Places::new((0..local.len().div_ceil(PACK)).map(nodes), blocks.packs()),
            fibre: Vec::new(),
            families: solid.material.law.families(),
        };
        for pack in packed.packs() {
            for family in 0..packed.families {
                packed.fibre.push(packed.vector(pack, |cell| cast(solid.law_fibres(cell)[family])));
            }
        }
        (packed, blocks)
    }

    pub(super) fn packs(&self) -> Range<usize> {
        0..self.count.div_ceil(PACK)
    }

    /// The packs of a block.
    #[inline(always)]
    pub(super) fn packs_of(&self, block: usize) -> Range<usize> {
        self.places.packs_of(block)
    }

    /// A number of each cell of a pack; zero beyond the last one.
    pub(super) fn pack(&self, pack: usize, of_cell: impl Fn(usize) -> R) -> Pack<R> {
        Pack::from_fn(|lane| {
            let cell = pack * PACK + lane;
            if cell < self.count { of_cell(cell) } else { R::ZERO }
        })
    }

    pub(super) fn vector(&self, pack: usize, of_cell: impl Fn(usize) -> Vector<R>) -> Vector<Pack<R>> {
        [0, 1, 2].map(|component| self.pack(pack, |cell| of_cell(cell)[component]))
    }

    /// The directions in some packs.
    #[inline(always)]
    pub(super) fn fibres(&self, first: usize, packs: usize) -> &[Vector<Pack<R>>] {
        &self.fibre[first * self.families..(first + packs) * self.families]
    }
}

/// Gradients of the shape functions [1/m] and volumes [m³] of packs of cells. Gradients are those for all
/// nodes but the first (they sum to zero). Volumes are zero where a pack is filled up.
pub(super) struct PackedRest<R, const M: usize> {
    pub(super) gradient: [Vector<Pack<R>>; M],
    pub(super) volume: Pack<R>,
}

impl<R: LaneNumber, const M: usize> PackedRest<R, M> {
    pub(super) fn of<const N: usize>(packed: &PackedCells<R, N>, cells: &CellBlock<N>) -> Vec<Self> {
        const { assert!(M + 1 == N) };
        let rest = |pack: usize| Self {
            gradient: std::array::from_fn(|a| {
                packed.vector(pack, |cell| cast(cells.rest[cell].gradient[a + 1]))
            }),
            volume: packed.pack(pack, |cell| R::of(cells.rest[cell].volume)),
        };
        packed.packs().into_par_iter().map(rest).collect()
    }
}

/// Returns u_a − u_0 of all nodes but the first, which keeps the digits of small strains in cells that have
/// moved far. Also returns the sum of the fourth numbers of the nodes.
#[inline(always)]
pub(super) fn relative<R: LaneNumber, L: Lanes<R>, const N: usize, const M: usize>(
    local: &Local<'_, R, N>,
    pack: usize,
    at: usize,
) -> ([Vector<L>; M], L) {
    let [x, y, z, mut sum] = local.gather(pack, 0, at);
    let mut relative = [[L::ZERO; 3]; M];
    for (u, node) in relative.iter_mut().zip(1..) {
        let [ux, uy, uz, beside] = local.gather(pack, node, at);
        *u = sub([ux, uy, uz], [x, y, z]);
        sum += beside;
    }
    (relative, sum)
}

/// ∂u/∂X from the displacements relative to the first node.
#[inline(always)]
pub(super) fn displacement_gradient<R: LaneNumber, L: Lanes<R>, const M: usize>(
    u: &[Vector<L>; M],
    gradient: &[Vector<Pack<R>>; M],
    at: usize,
) -> Tensor<L> {
    let mut h = Tensor::ZERO;
    for (ua, ba) in u.iter().zip(gradient) {
        h.add_outer(*ua, load_vector(ba, at));
    }
    h
}

/// V P B_a of all nodes but the first, from V P.
#[inline(always)]
pub(super) fn nodal_forces<R: LaneNumber, L: Lanes<R>, const M: usize>(
    piola: &Tensor<L>,
    gradient: &[Vector<Pack<R>>; M],
    at: usize,
) -> [Vector<L>; M] {
    let mut forces = [[L::ZERO; 3]; M];
    for (force, b) in forces.iter_mut().zip(gradient) {
        *force = piola.apply(load_vector(b, at));
    }
    forces
}

/// Writes the forces on all nodes as vectors, [`Lanes::row_of_lane`] by lane; the first node takes what makes
/// the sum zero.
#[inline(always)]
pub(super) fn by_cell<R: LaneNumber, L: Lanes<R>, const N: usize, const M: usize>(
    forces: &[Vector<L>; M],
    to: &mut [Pack<Quad<R>>; N],
    at: usize,
) {
    let mut sum = [L::ZERO; 3];
    for (force, to) in forces.iter().zip(&mut to[1..]) {
        sum = add(sum, *force);
        L::spread([force[0], force[1], force[2], L::ZERO], to, at);
    }
    L::spread([-sum[0], -sum[1], -sum[2], L::ZERO], &mut to[0], at);
}
