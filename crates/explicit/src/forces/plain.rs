//! One evaluation point a cell: linear tetrahedra, and uniform-strain hexahedra with hourglass control.

use pliant_mechanics::law::AnyLaw;
use pliant_mechanics::model::{CellBlock, Solid};
use pliant_mechanics::tensor::Vector;

use super::batch::{Batch, PACKS, Wanted};
use super::blocks::Task;
use super::corners::{CornerCheck, PackedCorners, flatness, may_fold};
use super::findings::Findings;
use super::hourglass::{FindGrowth, Growth, PackedHourglass, Resistance};
use super::one_pass::{Element, OnePass};
use super::packed::{
    PackedCells, PackedRest, by_cell, displacement_gradient, nodal_forces, own_packs, relative,
};
use crate::lanes::LaneNumber;
use crate::lanes::{Lanes, PACK, Pack};
use crate::relaxation::Relaxation;

/// Cells of `N` nodes with one evaluation point; `M` is one less.
pub(super) type SolidForces<R, const N: usize, const M: usize> = OnePass<R, PlainConstants<R, N, M>>;

/// What does not change from step to step.
pub(super) struct PlainConstants<R, const N: usize, const M: usize> {
    law: AnyLaw,
    cells: PackedCells<R, N>,
    rest: Vec<PackedRest<R, M>>,
    hourglass: Option<Vec<PackedHourglass<R>>>,
    /// The shear modulus at rest [Pa], where the stiffness against hourglass patterns grows from it.
    growth: Option<f64>,
    /// Of hexahedra.
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

impl<R: LaneNumber, const N: usize, const M: usize> Element<R> for PlainConstants<R, N, M> {
    fn slots(&self) -> [usize; 2] {
        [self.history, 0]
    }
    fn relaxation(&mut self) -> &mut Relaxation<R> {
        &mut self.relaxation
    }

    #[inline(always)]
    fn pass<L: Lanes<R>>(&self, displacement: &[Vector<R>], mut task: Task<'_, R>) -> Findings<R> {
        let PlainConstants { law, cells, rest, hourglass, growth, corners, relaxation, history: per_pack } =
            self;
        task.copy_in(displacement);
        let Task { block, moved, forces: sums, history, .. } = task;
        sums.fill([R::ZERO; 4]);
        let relaxes = !history.is_empty();
        let wanted = if relaxes { Wanted::Parts } else { Wanted::Whole };
        let mut findings = Findings::default();
        let mut batch = Batch::new();
        let mut resistance = [Resistance::new(); PACKS];
        let mut grown = Growth::new();
        let mut reach = [Pack::ZERO; PACKS];
        let mut forces = [Pack([[R::ZERO; 4]; PACK]); N];
        let packs = cells.packs_of(block);
        let mut local = cells.places.at_work(block, moved, sums);
        for first in packs.clone().step_by(PACKS) {
            let count = PACKS.min(packs.end - first);
            for (index, resistance) in resistance[..count].iter_mut().enumerate() {
                let pack = first + index;
                for at in (0..PACK).step_by(L::WIDTH) {
                    let (u, _) = relative::<R, L, N, M>(&local, pack - packs.start, at);
                    let h = displacement_gradient(&u, &rest[pack].gradient, at);
                    batch.set(index, at, &h);
                    if let Some(control) = hourglass {
                        let [energy, far] = resistance.find(&control[pack], &u, &h, at);
                        far.store(&mut reach[index], at);
                        if growth.is_some() {
                            energy.store(&mut grown.constant[index], at);
                        } else {
                            (energy + L::load(&findings.hourglass, at)).store(&mut findings.hourglass, at);
                        }
                    }
                }
            }
            let fibres = cells.fibres(first, count);
            batch.evaluate::<L>(law, wanted, count, 1, fibres);
            if let Some(shear) = *growth {
                L::call(FindGrowth {
                    law,
                    shear,
                    fibres,
                    wanted,
                    batch: &batch,
                    resistance: &mut resistance[..count],
                    energy: &mut findings.hourglass,
                    growth: &mut grown,
                });
            }
            for (index, resistance) in resistance[..count].iter().enumerate() {
                let pack = first + index;
                batch.note(index, pack * PACK, &mut findings);
                let (ratio, strain) = (&batch.volume_ratio[index], &batch.strain[index]);
                if hourglass.is_some() && may_fold(&reach[index], ratio, strain) && findings.folded.is_none()
                {
                    let pack_of_block = pack - packs.start;
                    let look = CornerCheck::<R, N, M> {
                        corners: &corners[pack],
                        local: &local,
                        flatness: &flatness(ratio, strain),
                        pack: pack_of_block,
                    };
                    findings.folded = L::call(look).map(|lane| pack * PACK + lane);
                }
                let own = own_packs(pack - packs.start, *per_pack, history.len());
                for at in (0..PACK).step_by(L::WIDTH) {
                    let stress = match relaxes {
                        true => relaxation.advance(batch.parts(index, at), &mut history[own.clone()], at),
                        false => batch.stress::<L>(index, at),
                    };
                    let piola = batch.deformation_gradient::<L>(index, at).times_symmetric(&stress);
                    let mut piola = piola.scaled(L::load(&rest[pack].volume, at));
                    if growth.is_some() {
                        grown.add_to(&mut piola, &batch, index, at);
                    }
                    if let Some(control) = hourglass {
                        resistance.turn(&control[pack], &mut piola, at);
                    }
                    let mut nodal = nodal_forces(&piola, &rest[pack].gradient, at);
                    if hourglass.is_some() {
                        resistance.add_to(&mut nodal, at);
                    }
                    by_cell(&nodal, &mut forces, at);
                }
                local.add::<L>(pack - packs.start, &forces);
            }
        }
        findings
    }
}
