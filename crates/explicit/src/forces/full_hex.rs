//! Hexahedra with 2×2×2 Gauss points for the change of shape and one mean dilatation. Their energy is W = Σ w
//! W_iso(F_g) + V U(v/V). They have no hourglass patterns and no locking, and take eight stresses a cell. The
//! in-house reference for `hex8`.

use pliant_mechanics::element::GaussPoints;
use pliant_mechanics::law::AnyLaw;
use pliant_mechanics::model::{CellBlock, Solid};
use pliant_mechanics::tensor::{Tensor, Vector, add, cast};

use super::averaged::relaxed_pressures;
use super::batch::{Batch, PACKS, Wanted, volume_change};
use super::blocks::Task;
use super::corners::{CornerCheck, PackedCorners, is_flat};
use super::findings::Findings;
use super::one_pass::{Element, OnePass};
use super::packed::{PackedCells, by_cell, displacement_gradient, own_packs, relative};
use crate::lanes::LaneNumber;
use crate::lanes::{Lanes, Local, PACK, Pack, load_vector, store_vector};
use crate::relaxation::Relaxation;

pub(super) type FullHexes<R> = OnePass<R, FullHexConstants<R>>;

/// Constants of the elements from step to step.
pub(super) struct FullHexConstants<R> {
    law: AnyLaw,
    cells: PackedCells<R, 8>,
    points: Vec<[Point<R>; 8]>,
    corners: Vec<PackedCorners<R>>,
    /// 1/V [1/m³]; zero beyond the last cell.
    inverse_volume: Vec<Pack<R>>,
    relaxation: Relaxation<R>,
    isochoric_slots: usize,
    volumetric_slots: usize,
}

/// Point of packs of cells, one of eight.
struct Point<R> {
    /// Gradients of the shape functions [1/m], of all nodes but the first.
    gradient: [Vector<Pack<R>>; 7],
    /// Volume [m³] of the point.
    weight: Pack<R>,
}

impl<R: LaneNumber> FullHexes<R> {
    pub(super) fn new(solid: &Solid, cells: &CellBlock<8>, points: &[GaussPoints], step: f64) -> Self {
        let prony = &solid.material.prony;
        let (packed, blocks) = PackedCells::new(solid, cells);
        let point = |pack: usize, g: usize| Point {
            gradient: std::array::from_fn(|a| {
                packed.vector(pack, |cell| cast(points[cell].gradient[g][a + 1]))
            }),
            weight: packed.pack(pack, |cell| R::of(points[cell].weight[g])),
        };
        let constants = FullHexConstants {
            law: solid.material.law,
            points: packed.packs().map(|pack| std::array::from_fn(|g| point(pack, g))).collect(),
            inverse_volume: (packed.packs())
                .map(|pack| packed.pack(pack, |cell| R::of(1.0 / cells.rest[cell].volume)))
                .collect(),
            corners: PackedCorners::of(&packed, &cells.offsets),
            cells: packed,
            relaxation: Relaxation::new(prony, step),
            isochoric_slots: prony.isochoric_slots(),
            volumetric_slots: prony.volumetric_slots(),
        };
        Self::of(blocks, constants)
    }
}

impl<R: LaneNumber> Point<R> {
    /// Adds the forces of a first Piola–Kirchhoff stress to those on all nodes but the first.
    #[inline(always)]
    fn add_forces<L: Lanes<R>>(&self, piola: &Tensor<L>, nodal: &mut [Vector<Pack<R>>; 7], at: usize) {
        let piola = piola.scaled(L::load(&self.weight, at));
        for (force, b) in nodal.iter_mut().zip(&self.gradient) {
            let contribution = piola.apply(load_vector(b, at));
            store_vector(add(load_vector(force, at), contribution), force, at);
        }
    }
}

/// Vectors of all nodes but the first, in the lanes from `at` on.
#[inline(always)]
fn load_all<R: LaneNumber, L: Lanes<R>>(packed: &[Vector<Pack<R>>; 7], at: usize) -> [Vector<L>; 7] {
    let mut loaded = [[L::ZERO; 3]; 7];
    for (to, from) in loaded.iter_mut().zip(packed) {
        *to = load_vector(from, at);
    }
    loaded
}

impl<R: LaneNumber> FullHexConstants<R> {
    /// v/V − 1 of a pack, by its number in all and in the block; `u` takes the displacements of all nodes but
    /// the first, relative to it.
    #[inline(always)]
    fn volume_change<L: Lanes<R>>(
        &self,
        local: &Local<'_, R, 8>,
        [pack, pack_of_block]: [usize; 2],
        u: &mut [Vector<Pack<R>>; 7],
    ) -> Pack<R> {
        let mut changes = Pack::ZERO;
        for at in (0..PACK).step_by(L::WIDTH) {
            let (relative, _) = relative::<R, L, 8, 7>(local, pack_of_block, at);
            for (u, relative) in u.iter_mut().zip(relative) {
                store_vector(relative, u, at);
            }
            let mut change = L::ZERO;
            for Point { gradient, weight } in &self.points[pack] {
                let h = displacement_gradient(&relative, gradient, at);
                change += L::load(weight, at) * volume_change(&h);
            }
            (change * L::load(&self.inverse_volume[pack], at)).store(&mut changes, at);
        }
        changes
    }

    /// The first cell of such a pack with a corner turned inside out, from v/V − 1.
    #[inline(always)]
    fn folded<L: Lanes<R>>(
        &self,
        local: &Local<'_, R, 8>,
        [pack, pack_of_block]: [usize; 2],
        changes: &Pack<R>,
    ) -> Option<usize> {
        let mut ratio = *changes;
        ratio.0.iter_mut().for_each(|change| *change += R::ONE);
        if !ratio.0.iter().any(|&ratio| is_flat(ratio)) {
            return None;
        }
        let corners = &self.corners[pack];
        let look = CornerCheck::<R, 8, 7> { corners, local, flatness: &ratio, pack: pack_of_block };
        L::call(look).map(|lane| pack * PACK + lane)
    }
}

impl<R: LaneNumber> Element<R> for FullHexConstants<R> {
    fn slots(&self) -> [usize; 2] {
        [8 * 6 * self.isochoric_slots, self.volumetric_slots]
    }
    fn relaxation(&mut self) -> &mut Relaxation<R> {
        &mut self.relaxation
    }

    #[inline(always)]
    fn pass<L: Lanes<R>>(&self, displacement: &[Vector<R>], mut task: Task<'_, R>) -> Findings<R> {
        let FullHexConstants { law, cells, points, relaxation, .. } = self;
        task.copy_in(displacement);
        let Task { block, moved, forces: sums, history, pressures, .. } = task;
        sums.fill([R::ZERO; 4]);
        let per_point = 6 * self.isochoric_slots;
        let mut findings = Findings::default();
        let mut batch = Batch::new();
        let mut u = [[Pack::ZERO; 3]; 7];
        let mut nodal = [[Pack::ZERO; 3]; 7];
        let mut forces = [Pack([[R::ZERO; 4]; PACK]); 8];
        let packs = cells.packs_of(block);
        let mut local = cells.places.at_work(block, moved, sums);
        for pack in packs.clone() {
            let pack_of_block = pack - packs.start;
            let mut pressure = self.volume_change::<L>(&local, [pack, pack_of_block], &mut u);
            if findings.folded.is_none() {
                findings.folded = self.folded::<L>(&local, [pack, pack_of_block], &pressure);
            }
            // U'(v/V), relaxed where the law's volumetric part relaxes.
            let slots = self.volumetric_slots;
            let range = own_packs(pack_of_block, slots, pressures.len());
            let values = std::slice::from_mut(&mut pressure);
            relaxed_pressures::<R, L>(law, relaxation, slots, values, &mut pressures[range], &mut batch);
            nodal.fill([Pack::ZERO; 3]);
            for (part, points) in points[pack].chunks(PACKS).enumerate() {
                for (index, point) in points.iter().enumerate() {
                    for at in (0..PACK).step_by(L::WIDTH) {
                        let relative = load_all::<R, L>(&u, at);
                        batch.set(index, at, &displacement_gradient(&relative, &point.gradient, at));
                    }
                }
                batch.evaluate::<L>(law, Wanted::Isochoric, PACKS, PACKS, cells.fibres(pack, 1));
                for (index, point) in points.iter().enumerate() {
                    batch.note(index, pack * PACK, &mut findings);
                    let number = pack_of_block * 8 + part * PACKS + index;
                    let range = own_packs(number, per_point, history.len());
                    for at in (0..PACK).step_by(L::WIDTH) {
                        let isochoric = batch.stress::<L>(index, at);
                        let stress = relaxation.advance_isochoric(isochoric, &mut history[range.clone()], at);
                        let f = batch.deformation_gradient::<L>(index, at);
                        let piola = f.times_symmetric(&stress);
                        let piola = piola.plus_scaled(&f.cofactor(), L::load(&pressure, at));
                        point.add_forces(&piola, &mut nodal, at);
                    }
                }
            }
            for at in (0..PACK).step_by(L::WIDTH) {
                by_cell(&load_all::<R, L>(&nodal, at), &mut forces, at);
            }
            local.add::<L>(pack_of_block, &forces);
        }
        findings
    }
}
