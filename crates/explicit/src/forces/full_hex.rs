//! Hexahedra with 2×2×2 Gauss points for the change of shape and one mean dilatation, W = Σ w W_iso(F_g) + V U(v/V):
//! no hourglass patterns, no locking, eight stresses a cell. The in-house reference for `hex8`.

use pliant_mechanics::element::GaussPoints;
use pliant_mechanics::law::AnyLaw;
use pliant_mechanics::model::{CellBlock, Solid};
use pliant_mechanics::tensor::{Vector, add, cast};

use super::averaged::relaxed_pressures;
use super::batch::{Batch, PACKS, Wanted, volume_change};
use super::blocks::Task;
use super::corners::{CornerCheck, PackedCorners, is_flat};
use super::findings::Findings;
use super::one_pass::{Element, OnePass};
use super::packed::{PackedCells, by_cell, displacement_gradient, own_packs, relative};
use crate::lanes::LaneNumber;
use crate::lanes::{Lanes, PACK, Pack, load_vector, store_vector};
use crate::relaxation::Relaxation;

pub(super) type FullHexes<R> = OnePass<R, FullHexConstants<R>>;

/// What does not change from step to step.
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

/// One of the eight points of packs of cells.
struct Point<R> {
    /// Gradients of the shape functions [1/m], of all nodes but the first.
    gradient: [Vector<Pack<R>>; 7],
    /// Its volume [m³].
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

impl<R: LaneNumber> Element<R> for FullHexConstants<R> {
    fn slots(&self) -> [usize; 2] {
        [8 * 6 * self.isochoric_slots, self.volumetric_slots]
    }
    fn relaxation(&mut self) -> &mut Relaxation<R> {
        &mut self.relaxation
    }

    #[inline(always)]
    fn pass<L: Lanes<R>>(&self, displacement: &[Vector<R>], mut task: Task<'_, R>) -> Findings<R> {
        let FullHexConstants { law, cells, points, corners, inverse_volume, relaxation, .. } = self;
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
            let mut pressure = Pack::ZERO;
            for at in (0..PACK).step_by(L::WIDTH) {
                let (relative, _) = relative::<R, L, 8, 7>(&local, pack - packs.start, at);
                for (u, relative) in u.iter_mut().zip(relative) {
                    store_vector(relative, u, at);
                }
                // v/V − 1.
                let mut change = L::ZERO;
                for Point { gradient, weight } in &points[pack] {
                    let h = displacement_gradient(&relative, gradient, at);
                    change += L::load(weight, at) * volume_change(&h);
                }
                (change * L::load(&inverse_volume[pack], at)).store(&mut pressure, at);
            }
            let mut ratio = pressure;
            ratio.0.iter_mut().for_each(|change| *change += R::ONE);
            if findings.folded.is_none() && ratio.0.iter().any(|&ratio| is_flat(ratio)) {
                let pack_of_block = pack - packs.start;
                let look = CornerCheck::<R, 8, 7> {
                    corners: &corners[pack],
                    local: &local,
                    flatness: &ratio,
                    pack: pack_of_block,
                };
                findings.folded = L::call(look).map(|lane| pack * PACK + lane);
            }
            // U'(v/V), relaxed where the law's volumetric part relaxes.
            let slots = self.volumetric_slots;
            let own = own_packs(pack - packs.start, slots, pressures.len());
            let values = std::slice::from_mut(&mut pressure);
            relaxed_pressures::<R, L>(law, relaxation, slots, values, &mut pressures[own], &mut batch);
            nodal.fill([Pack::ZERO; 3]);
            for (part, points) in points[pack].chunks(PACKS).enumerate() {
                for (index, point) in points.iter().enumerate() {
                    for at in (0..PACK).step_by(L::WIDTH) {
                        let mut relative = [[L::ZERO; 3]; 7];
                        for (relative, u) in relative.iter_mut().zip(&u) {
                            *relative = load_vector(u, at);
                        }
                        batch.set(index, at, &displacement_gradient(&relative, &point.gradient, at));
                    }
                }
                batch.evaluate::<L>(law, Wanted::Isochoric, PACKS, PACKS, cells.fibres(pack, 1));
                for (index, point) in points.iter().enumerate() {
                    batch.note(index, pack * PACK, &mut findings);
                    let number = (pack - packs.start) * 8 + part * PACKS + index;
                    let own = own_packs(number, per_point, history.len());
                    for at in (0..PACK).step_by(L::WIDTH) {
                        let isochoric = batch.stress::<L>(index, at);
                        let stress = relaxation.advance_isochoric(isochoric, &mut history[own.clone()], at);
                        let f = batch.deformation_gradient::<L>(index, at);
                        let piola = f.times_symmetric(&stress);
                        let piola = piola.plus_scaled(&f.cofactor(), L::load(&pressure, at));
                        let piola = piola.scaled(L::load(&point.weight, at));
                        for (force, b) in nodal.iter_mut().zip(&point.gradient) {
                            let own = piola.apply(load_vector(b, at));
                            store_vector(add(load_vector(force, at), own), force, at);
                        }
                    }
                }
            }
            for at in (0..PACK).step_by(L::WIDTH) {
                let mut own = [[L::ZERO; 3]; 7];
                for (own, force) in own.iter_mut().zip(&nodal) {
                    *own = load_vector(force, at);
                }
                by_cell(&own, &mut forces, at);
            }
            local.add::<L>(pack - packs.start, &forces);
        }
        findings
    }
}
