//! Hexahedra with 2×2×2 Gauss points for the change of shape and one mean dilatation, W = Σ w W_iso(F_g) + V U(v/V):
//! no hourglass patterns, no locking, eight stresses a cell. The in-house reference for `hex8`.

use rayon::prelude::*;

use super::averaged::{Pressures, for_each_pressure, volume_change};
use super::batch::{Batch, PACKS};
use super::{
    Findings, ForceField, PackedCells, Places, Slot, by_cell, by_component, displacement_gradient,
    for_each_task, gather, relative,
};
use crate::Real;
use crate::element::GaussPoints;
use crate::lanes::{Lanes, PACK, Pack, Processor, Work, load_vector, store_vector};
use crate::law::AnyLaw;
use crate::model::{CellBlock, Solid};
use crate::prony::{Prony, Relaxation};
use crate::state::History;
use crate::tensor::{Vector, add, cast, scale};

pub(super) struct FullHexes<R> {
    processor: Processor,
    law: AnyLaw,
    cells: PackedCells<R, 8>,
    /// Gradients of the shape functions at the eight points [1/m].
    gradient: Vec<[[Vector<Pack<R>>; 8]; 8]>,
    /// Volumes of the points [m³].
    weight: Vec<[Pack<R>; 8]>,
    /// 1/V [1/m³]; zero beyond the last cell.
    inverse_volume: Vec<Pack<R>>,
    relaxation: Relaxation<R>,
    isochoric_slots: usize,
    volumetric_slots: usize,
    /// U'(v/V) of each cell [Pa].
    pressure: Vec<Pack<R>>,
}

impl<R: Real> FullHexes<R> {
    pub(super) fn new(solid: &Solid, cells: &CellBlock<8>, points: &[GaussPoints], step: f64) -> Self {
        let prony = &solid.material.prony;
        let packed = PackedCells::new(solid, cells);
        let eight = [0, 1, 2, 3, 4, 5, 6, 7];
        Self {
            processor: Processor::detect(),
            law: solid.material.law,
            gradient: (packed.packs())
                .map(|pack| {
                    eight
                        .map(|g| eight.map(|a| packed.vector(pack, |cell| cast(points[cell].gradient[g][a]))))
                })
                .collect(),
            weight: (packed.packs())
                .map(|pack| eight.map(|g| packed.pack(pack, |cell| R::of(points[cell].weight[g]))))
                .collect(),
            inverse_volume: (packed.packs())
                .map(|pack| packed.pack(pack, |cell| R::of(1.0 / cells.rest[cell].volume)))
                .collect(),
            relaxation: Relaxation::new(prony, step),
            isochoric_slots: prony.isochoric_slots(),
            volumetric_slots: prony.volumetric_slots(),
            pressure: vec![Pack::ZERO; packed.packs().len()],
            cells: packed,
        }
    }

    /// Packs of history for a pack of cells.
    fn per_pack(&self) -> usize {
        8 * 6 * self.isochoric_slots
    }

    /// U'(v/V) of all cells, relaxed where the law's volumetric part relaxes.
    fn pressures(&mut self, displacement: &Places<R>, history: &mut [Pack<R>]) {
        let mut values = std::mem::take(&mut self.pressure);
        values.par_iter_mut().enumerate().with_min_len(8).for_each(|(pack, value)| {
            self.processor.run(MeanChange { field: self, pack, displacement, value });
        });
        let (law, relaxation, slots) = (&self.law, &self.relaxation, self.volumetric_slots);
        for_each_pressure(&mut values, history, slots, |values, history| {
            self.processor.run(Pressures { law, relaxation, slots, values, history });
        });
        self.pressure = values;
    }
}

/// v/V − 1 of a pack of cells.
struct MeanChange<'a, R> {
    field: &'a FullHexes<R>,
    pack: usize,
    displacement: &'a Places<R>,
    value: &'a mut Pack<R>,
}

impl<R: Real> Work<R> for MeanChange<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<R>>(self) {
        let Self { field, pack, displacement, value } = self;
        let mut gathered = [Pack([[R::ZERO; 4]; PACK]); 8];
        let mut moved = [[Pack::ZERO; 3]; 8];
        gather(&field.cells.nodes[pack], displacement, &mut gathered);
        by_component(&gathered, &mut moved);
        for at in (0..PACK).step_by(L::WIDTH) {
            let u = relative::<R, L, 8>(&moved, at);
            let mut change = L::ZERO;
            for (gradient, weight) in field.gradient[pack].iter().zip(&field.weight[pack]) {
                change += L::load(weight, at) * volume_change(&displacement_gradient(&u, gradient, at));
            }
            (change * L::load(&field.inverse_volume[pack], at)).store(value, at);
        }
    }
}

/// A pass over the packs from `first` on, as many as `slots` has room for.
struct Pass<'a, R> {
    field: &'a FullHexes<R>,
    first: usize,
    displacement: &'a Places<R>,
    history: &'a mut [Pack<R>],
    slots: &'a mut [Slot<R>],
}

impl<R: Real> Work<R> for Pass<'_, R> {
    type Output = Findings<R>;

    #[inline(always)]
    fn run<L: Lanes<R>>(self) -> Findings<R> {
        let Self { field, first, displacement, history, slots } = self;
        let mut findings = Findings::default();
        let mut batch = Batch::new();
        let mut gathered = [Pack([[R::ZERO; 4]; PACK]); 8];
        let mut moved = [[Pack::ZERO; 3]; 8];
        let mut forces = [[Pack::ZERO; 3]; 8];
        let per_point = 6 * field.isochoric_slots;
        for (index, slots) in slots.chunks_exact_mut(8).enumerate() {
            let cells = first + index;
            gather(&field.cells.nodes[cells], displacement, &mut gathered);
            by_component(&gathered, &mut moved);
            forces.fill([Pack::ZERO; 3]);
            for points in [0, PACKS] {
                for pack in 0..PACKS {
                    for at in (0..PACK).step_by(L::WIDTH) {
                        let u = relative::<R, L, 8>(&moved, at);
                        let gradient = &field.gradient[cells][points + pack];
                        batch.set(pack, at, &displacement_gradient(&u, gradient, at));
                    }
                }
                batch.evaluate::<L>(&field.law, PACKS, PACKS, field.cells.fibres(cells, 1));
                for pack in 0..PACKS {
                    batch.note(pack, cells * PACK, &mut findings);
                    let point = points + pack;
                    let own = (index * 8 + point) * per_point;
                    let own = own.min(history.len())..(own + per_point).min(history.len());
                    for at in (0..PACK).step_by(L::WIDTH) {
                        let isochoric = batch.elastic::<L>(pack, at).isochoric;
                        let stress =
                            field.relaxation.advance_isochoric(isochoric, &mut history[own.clone()], at);
                        let f = batch.deformation_gradient::<L>(pack, at);
                        let pressure = L::load(&field.pressure[cells], at);
                        let piola = f.times_symmetric(&stress).plus_scaled(&f.cofactor(), pressure);
                        let weight = L::load(&field.weight[cells][point], at);
                        for (force, b) in forces.iter_mut().zip(&field.gradient[cells][point]) {
                            let own = scale(piola.apply(load_vector(b, at)), weight);
                            store_vector(add(load_vector(force, at), own), force, at);
                        }
                    }
                }
            }
            by_cell(&forces, slots);
        }
        findings
    }
}

impl<R: Real> ForceField<R> for FullHexes<R> {
    fn evaluate(
        &mut self,
        displacement: &Places<R>,
        history: &mut History<R>,
        slots: &mut [Slot<R>],
        findings: &mut [Findings<R>],
    ) {
        self.pressures(displacement, &mut history.pressures);
        let this = &*self;
        for_each_task(slots, 8, &mut history.cells, this.per_pack(), findings, |first, slots, history| {
            this.processor.run(Pass { field: this, first, displacement, history, slots })
        });
    }
    fn set_step(&mut self, prony: &Prony, step: f64) {
        self.relaxation.set_step(prony, step);
    }
    #[cfg(test)]
    fn set_processor(&mut self, processor: Processor) {
        self.processor = processor;
    }
}
