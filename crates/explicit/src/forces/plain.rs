//! One evaluation point a cell: linear tetrahedra, and uniform-strain hexahedra with hourglass control.

use pliant_mechanics::law::AnyLaw;
use pliant_mechanics::model::{CellBlock, Solid};
use pliant_mechanics::tensor::Vector;

use super::batch::{Batch, PACKS, Wanted};
use super::blocks::{Quad, Task};
use super::corners::{CornerCheck, PackedCorners, flatness, may_fold};
use super::findings::Findings;
use super::hourglass::{FindGrowth, Growth, PackedHourglass, Resistance};
use super::one_pass::{Element, OnePass};
use super::packed::{
    PackedCells, PackedRest, by_cell, displacement_gradient, nodal_forces, own_packs, relative,
};
use crate::lanes::LaneNumber;
use crate::lanes::{Lanes, Local, PACK, Pack};
use crate::relaxation::Relaxation;

/// Cells of `N` nodes with one evaluation point; `M` is one less.
pub(super) type SolidForces<R, const N: usize, const M: usize> = OnePass<R, PlainConstants<R, N, M>>;

/// Constants of the elements from step to step.
pub(super) struct PlainConstants<R, const N: usize, const M: usize> {
    law: AnyLaw,
    cells: PackedCells<R, N>,
    rest: Vec<PackedRest<R, M>>,
    hourglass: Option<Vec<PackedHourglass<R>>>,
    /// The shear modulus at rest [Pa], where the stiffness against hourglass patterns grows from it.
    growth: Option<f64>,
    /// Corners of hexahedra.
    corners: Vec<PackedCorners<R>>,
    relaxation: Relaxation<R>,
    /// Packs of history for a pack of cells.
    history: usize,
}

impl<R: LaneNumber, const N: usize, const M: usize> SolidForces<R, N, M> {
    pub(super) fn new(solid: &Solid, cells: &CellBlock<N>, step: f64) -> Self {
        let (packed, blocks) = PackedCells::new(solid, cells);
        let hourglass = cells.hourglass.as_ref().map(|control| PackedHourglass::of(&packed, control));
        let corners = match hourglass {
            Some(_) => PackedCorners::of(&packed, &cells.offsets),
            None => Vec::new(),
        };
        let constants = PlainConstants {
            law: solid.material.law,
            rest: PackedRest::of(&packed, cells),
            cells: packed,
            hourglass,
            growth: solid.hourglass_growth(),
            corners,
            relaxation: Relaxation::new(&solid.material.prony, step),
            history: 6 * solid.material.prony.slots(),
        };
        Self::of(blocks, constants)
    }
}

/// A batch of packs of cells.
struct AtWork<R> {
    batch: Batch<R>,
    resistance: [Resistance<R>; PACKS],
    grown: Growth<R>,
    /// 3/2 κ² |q|²; see `corners.rs`.
    reach: [Pack<R>; PACKS],
}

impl<R: LaneNumber, const N: usize, const M: usize> PlainConstants<R, N, M> {
    /// Finds the displacement gradients of a pack, and its resistance to hourglass patterns. The pack is
    /// numbered among all packs and in the block. Adds the energy of the patterns if their stiffness does not
    /// grow.
    #[inline(always)]
    fn deform<L: Lanes<R>>(
        &self,
        local: &Local<'_, R, N>,
        [pack, pack_of_block]: [usize; 2],
        index: usize,
        work: &mut AtWork<R>,
        hourglass: &mut Pack<R>,
    ) {
        let AtWork { batch, resistance, grown, reach } = work;
        for at in (0..PACK).step_by(L::WIDTH) {
            let (u, _) = relative::<R, L, N, M>(local, pack_of_block, at);
            let h = displacement_gradient(&u, &self.rest[pack].gradient, at);
            batch.set(index, at, &h);
            if let Some(control) = &self.hourglass {
                let [energy, far] = resistance[index].find(&control[pack], &u, &h, at);
                far.store(&mut reach[index], at);
                if self.growth.is_some() {
                    energy.store(&mut grown.constant[index], at);
                } else {
                    (energy + L::load(hourglass, at)).store(hourglass, at);
                }
            }
        }
    }

    /// The first cell of such a pack with a corner turned inside out.
    #[inline(always)]
    fn folded<L: Lanes<R>>(
        &self,
        local: &Local<'_, R, N>,
        [pack, pack_of_block]: [usize; 2],
        index: usize,
        AtWork { batch, reach, .. }: &AtWork<R>,
    ) -> Option<usize> {
        let (ratio, strain) = (&batch.volume_ratio[index], &batch.strain[index]);
        if self.hourglass.is_none() || !may_fold(&reach[index], ratio, strain) {
            return None;
        }
        let look = CornerCheck::<R, N, M> {
            corners: &self.corners[pack],
            local,
            flatness: &flatness(ratio, strain),
            pack: pack_of_block,
        };
        L::call(look).map(|lane| pack * PACK + lane)
    }

    /// The forces of a pack on its nodes, from the stresses that the law found. They relax where there is a
    /// history.
    #[inline(always)]
    fn forces<L: Lanes<R>>(
        &self,
        pack: usize,
        index: usize,
        AtWork { batch, resistance, grown, .. }: &AtWork<R>,
        history: &mut [Pack<R>],
        forces: &mut [Pack<Quad<R>>; N],
    ) {
        let PackedRest { gradient, volume } = &self.rest[pack];
        for at in (0..PACK).step_by(L::WIDTH) {
            let stress = match history.is_empty() {
                true => batch.stress::<L>(index, at),
                false => self.relaxation.advance(batch.parts(index, at), history, at),
            };
            let piola = batch.deformation_gradient::<L>(index, at).times_symmetric(&stress);
            let mut piola = piola.scaled(L::load(volume, at));
            if self.growth.is_some() {
                grown.add_to(&mut piola, batch, index, at);
            }
            if let Some(control) = &self.hourglass {
                resistance[index].turn(&control[pack], &mut piola, at);
            }
            let mut nodal = nodal_forces(&piola, gradient, at);
            if self.hourglass.is_some() {
                resistance[index].add_to(&mut nodal, at);
            }
            by_cell(&nodal, forces, at);
        }
    }
}

impl<R: LaneNumber, const N: usize, const M: usize> Element<R> for PlainConstants<R, N, M> {
    fn slots(&self) -> [usize; 2] {
        [self.history, 0]
    }
    fn relaxation(&mut self) -> &mut Relaxation<R> {
        &mut self.relaxation
    }

    #[inline(always)]
    fn pass<L: Lanes<R>>(&self, displacement: &[Vector<R>], mut task: Task<'_, R>) -> Findings<R> {
        let PlainConstants { law, cells, growth, history: per_pack, .. } = self;
        task.copy_in(displacement);
        let Task { block, moved, forces: sums, history, .. } = task;
        sums.fill([R::ZERO; 4]);
        let wanted = if history.is_empty() { Wanted::Whole } else { Wanted::Parts };
        let mut findings = Findings::default();
        let mut work = AtWork {
            batch: Batch::new(),
            resistance: [Resistance::new(); PACKS],
            grown: Growth::new(),
            reach: [Pack::ZERO; PACKS],
        };
        let mut forces = [Pack([[R::ZERO; 4]; PACK]); N];
        let packs = cells.packs_of(block);
        let mut local = cells.places.at_work(block, moved, sums);
        for first in packs.clone().step_by(PACKS) {
            let count = PACKS.min(packs.end - first);
            for index in 0..count {
                let pack = [first + index, first + index - packs.start];
                self.deform::<L>(&local, pack, index, &mut work, &mut findings.hourglass);
            }
            let fibres = cells.fibres(first, count);
            work.batch.evaluate::<L>(law, wanted, count, 1, fibres);
            if let Some(shear) = *growth {
                L::call(FindGrowth {
                    law,
                    shear,
                    fibres,
                    wanted,
                    batch: &work.batch,
                    resistance: &mut work.resistance[..count],
                    energy: &mut findings.hourglass,
                    growth: &mut work.grown,
                });
            }
            for index in 0..count {
                let pack = [first + index, first + index - packs.start];
                work.batch.note(index, pack[0] * PACK, &mut findings);
                if findings.folded.is_none() {
                    findings.folded = self.folded::<L>(&local, pack, index, &work);
                }
                let range = own_packs(pack[1], *per_pack, history.len());
                self.forces::<L>(pack[0], index, &work, &mut history[range], &mut forces);
                local.add::<L>(pack[1], &forces);
            }
        }
        findings
    }
}
