//! Linear tetrahedra whose pressure is averaged over nodes, so that they do not lock for nearly
//! incompressible tissue.
//!
//! *Nodal* (Bonet and Burton 1998): J_n = Σ V_e J_e / Σ V_e over the cells at a node, p_n = U'(J_n), p_e the
//! mean of the cell's four p_n. Forces are f_a = V_e (P_iso + p_e cof F) B_a: exactly the gradient of Σ V_e
//! W_iso + Σ V_n U(J_n). *Variational*: J̄_e the mean of the four J_n, p_e' = U'(J̄_e), p_n their mean
//! weighted by volume. The p_e of the cell follows as above: the forces are the gradient of Σ V_e (W_iso +
//! U(J̄_e)). Softer; watch for pressure modes. *NiftySim* (Joldes, Wittek and Miller 2009): the whole law at
//! F̄ = (J̄_e/J_e)^(1/3) F, f_a = V_e F̄ S(F̄) B_a. These forces are not the gradient of an energy: use them
//! only to reproduce the results of imported models.
//!
//! Averages are taken within one solid: a node on an interface has a J_n for each material.

use pliant_mechanics::law::{AnyLaw, Split};
use pliant_mechanics::model::{Averaging, CellBlock, LocalNodes, Solid};
use pliant_mechanics::prony::Prony;
use pliant_mechanics::tensor::{Symmetric, Tensor, Vector};
use rayon::prelude::*;

use super::batch::{Batch, PACKS, Wanted, pressures, volume_change};
use super::blocks::{Blocks, Moved, Quad, Shares, Task};
use super::field::ForceField;
use super::findings::Findings;
use super::packed::{
    PackedCells, PackedRest, by_cell, displacement_gradient, nodal_forces, own_packs, relative,
};
use crate::history::History;
use crate::lanes::LaneNumber;
use crate::lanes::{LaneWork, Lanes, Local, PACK, Pack, Processor, entry, load_tensor};
use crate::relaxation::Relaxation;

pub(super) struct AveragedTets<R> {
    processor: Processor,
    /// Displacements of the nodes of each block, with the nodal average as the fourth number.
    moved: Moved<R>,
    constants: AveragedConstants<R>,
    /// J_n − 1, then p_n [Pa].
    node_value: Vec<Pack<R>>,
}

/// Constants of the elements from step to step.
struct AveragedConstants<R> {
    law: AnyLaw,
    averaging: Averaging,
    cells: PackedCells<R, 4>,
    rest: Vec<PackedRest<R, 3>>,
    /// The nodes of all blocks, one block after another, numbered within the solid.
    numbers: Vec<u32>,
    /// Places of the blocks' shares in the average of each node.
    shares: Shares,
    /// 1/V_n with V_n = Σ V_e/4 [1/m³].
    inverse_volume: Vec<R>,
    relaxation: Relaxation<R>,
    isochoric_slots: usize,
    volumetric_slots: usize,
}

impl<R: LaneNumber> AveragedTets<R> {
    pub(super) fn new(solid: &Solid, cells: &CellBlock<4>, averaging: Averaging, step: f64) -> Self {
        let local = LocalNodes::new(cells);
        let volume_at = |node| local.cells_at(node).map(|cell| 0.25 * cells.rest[cell].volume).sum::<f64>();
        let prony = &solid.material.prony;
        let (packed, blocks) = PackedCells::new(solid, cells);
        let mut known = blocks.all_nodes().to_vec();
        known.sort_unstable();
        known.dedup();
        let number = |node: u32| known.partition_point(|&other| other < node) as u32;
        Self {
            processor: Processor::detect(),
            constants: AveragedConstants {
                law: solid.material.law,
                averaging,
                rest: PackedRest::of(&packed, cells),
                cells: packed,
                numbers: blocks.all_nodes().iter().map(|&node| number(node)).collect(),
                shares: Shares::new(
                    local.len(),
                    u32::MAX,
                    blocks.places().map(|(node, place)| (number(node), place)),
                ),
                inverse_volume: (0..local.len()).map(|node| R::of(1.0 / volume_at(node))).collect(),
                relaxation: Relaxation::new(prony, step),
                isochoric_slots: prony.isochoric_slots(),
                volumetric_slots: prony.volumetric_slots(),
            },
            node_value: vec![Pack::ZERO; local.len().div_ceil(PACK)],
            moved: Moved::new(blocks),
        }
    }

    /// The mean of the cells' values at each node, weighted by volume, from the sums of the blocks.
    fn average_to_nodes(&mut self, sums: &[Quad<R>]) {
        let AveragedConstants { shares, inverse_volume, .. } = &self.constants;
        self.node_value.par_iter_mut().enumerate().with_min_len(32).for_each(|(pack, nodes)| {
            let numbers = pack * PACK..inverse_volume.len().min((pack + 1) * PACK);
            let part = |place: usize| sums[place][0];
            shares.visit(numbers.clone(), &mut nodes.0, part, |sum, place| *sum += part(place));
            for (value, &inverse) in nodes.0.iter_mut().zip(&inverse_volume[numbers]) {
                *value = *value * inverse;
            }
        });
    }

    /// p_n from J_n − 1, relaxed where the law's volumetric part relaxes.
    fn find_pressures(&mut self, history: &mut [Pack<R>]) {
        let (processor, constants) = (self.processor, &self.constants);
        let values = self.node_value.par_chunks_mut(PACKS).with_min_len(8);
        let pass = |values: &mut [Pack<R>], history: &mut [Pack<R>]| {
            processor.run(NodePressures { constants, values, history });
        };
        if history.is_empty() {
            values.for_each(|values| pass(values, &mut []));
        } else {
            let history = history.par_chunks_mut(PACKS * constants.volumetric_slots);
            values.zip(history).for_each(|(values, history)| pass(values, history));
        }
    }
}

impl<R: LaneNumber> AveragedConstants<R> {
    /// Tensors of history per cell.
    fn cell_slots(&self) -> usize {
        self.isochoric_slots + if self.averaging == Averaging::NiftySim { self.volumetric_slots } else { 0 }
    }

    /// Copies the averages of a block's nodes in.
    #[inline(always)]
    fn copy_in(&self, blocks: &Blocks, node_value: &[Pack<R>], task: &mut Task<'_, R>) {
        for (to, &number) in task.moved.iter_mut().zip(&self.numbers[blocks.entries(task.block)]) {
            to[3] = entry(node_value, number as usize);
        }
    }
}

/// The shares of the cells of a block in Σ V_e (J_e − 1)/4 of its nodes.
struct VolumeChanges<'a, R> {
    constants: &'a AveragedConstants<R>,
    displacement: &'a [Vector<R>],
    task: Task<'a, R>,
}

impl<R: LaneNumber> LaneWork<R> for VolumeChanges<'_, R> {
    type Output = Findings<R>;

    #[inline(always)]
    fn run<L: Lanes<R>>(self) -> Findings<R> {
        let Self { constants: AveragedConstants { cells, rest, .. }, displacement, mut task } = self;
        task.copy_in(displacement);
        task.forces.fill([R::ZERO; 4]);
        let packs = cells.packs_of(task.block);
        let mut local = cells.places.at_work(task.block, task.moved, task.forces);
        let mut values = Pack::ZERO;
        for pack in packs.clone() {
            for at in (0..PACK).step_by(L::WIDTH) {
                let (u, _) = relative::<R, L, 4, 3>(&local, pack - packs.start, at);
                let change = volume_change(&displacement_gradient(&u, &rest[pack].gradient, at));
                (change * L::of(0.25) * L::load(&rest[pack].volume, at)).store(&mut values, at);
            }
            local.add_number(pack - packs.start, &values);
        }
        Findings::default()
    }
}

/// The shares of the cells of a block in Σ V_e p_e/4 of its nodes, with p_e = U'(J̄_e).
struct CellPressures<'a, R> {
    constants: &'a AveragedConstants<R>,
    task: Task<'a, R>,
}

impl<R: LaneNumber> LaneWork<R> for CellPressures<'_, R> {
    type Output = Findings<R>;

    #[inline(always)]
    fn run<L: Lanes<R>>(self) -> Findings<R> {
        let Self { constants, task } = self;
        let AveragedConstants { law, cells, rest, relaxation, volumetric_slots: slots, .. } = constants;
        let Task { block, moved, forces: sums, pressures: history, .. } = task;
        sums.fill([R::ZERO; 4]);
        let mut batch = Batch::new();
        let packs = cells.packs_of(block);
        let mut local = cells.places.at_work(block, moved, sums);
        for first in packs.clone().step_by(PACKS) {
            let mut values = [Pack::ZERO; PACKS];
            let values = &mut values[..PACKS.min(packs.end - first)];
            for (value, pack) in values.iter_mut().zip(first - packs.start..) {
                for at in (0..PACK).step_by(L::WIDTH) {
                    average::<R, L>(&local, pack, at).store(value, at);
                }
            }
            let start = (first - packs.start) * slots;
            let range = start.min(history.len())..(start + values.len() * slots).min(history.len());
            relaxed_pressures::<R, L>(law, relaxation, *slots, values, &mut history[range], &mut batch);
            for ((value, pack), rest) in values.iter_mut().zip(first - packs.start..).zip(&rest[first..]) {
                for at in (0..PACK).step_by(L::WIDTH) {
                    (L::load(value, at) * L::of(0.25) * L::load(&rest.volume, at)).store(value, at);
                }
                local.add_number(pack, value);
            }
        }
        Findings::default()
    }
}

/// The means of what the four nodes of cells carry beside their displacements.
#[inline(always)]
fn average<R: LaneNumber, L: Lanes<R>>(local: &Local<'_, R, 4>, pack: usize, at: usize) -> L {
    let mut sum = L::ZERO;
    for node in 0..4 {
        sum += local.gather::<L>(pack, node, at)[3];
    }
    sum * L::of(0.25)
}

/// Up to [`PACKS`] packs of J − 1 at nodes become pressures [Pa].
struct NodePressures<'a, R> {
    constants: &'a AveragedConstants<R>,
    values: &'a mut [Pack<R>],
    history: &'a mut [Pack<R>],
}

impl<R: LaneNumber> LaneWork<R> for NodePressures<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<R>>(self) {
        let Self { constants: AveragedConstants { law, relaxation, volumetric_slots, .. }, values, history } =
            self;
        relaxed_pressures::<R, L>(law, relaxation, *volumetric_slots, values, history, &mut Batch::new());
    }
}

/// Up to [`PACKS`] packs of J − 1 become pressures [Pa], which relax where there is a history.
#[inline(always)]
pub(super) fn relaxed_pressures<R: LaneNumber, L: Lanes<R>>(
    law: &AnyLaw,
    relaxation: &Relaxation<R>,
    slots: usize,
    values: &mut [Pack<R>],
    history: &mut [Pack<R>],
    batch: &mut Batch<R>,
) {
    pressures::<R, L>(law, values, batch);
    if history.is_empty() {
        return;
    }
    for (value, history) in values.iter_mut().zip(history.chunks_exact_mut(slots)) {
        for at in (0..PACK).step_by(L::WIDTH) {
            relaxation.advance_pressure(L::load(value, at), history, at).store(value, at);
        }
    }
}

/// A pass over the cells of a block.
struct AveragedPass<'a, R> {
    constants: &'a AveragedConstants<R>,
    task: Task<'a, R>,
}

impl<R: LaneNumber> LaneWork<R> for AveragedPass<'_, R> {
    type Output = Findings<R>;

    #[inline(always)]
    fn run<L: Lanes<R>>(self) -> Findings<R> {
        let Self { constants, task } = self;
        let AveragedConstants { law, cells, rest, .. } = constants;
        let Task { block, moved, forces: sums, history, .. } = task;
        let per_pack = 6 * constants.cell_slots();
        let of_deformation = constants.averaging == Averaging::NiftySim;
        let wanted = if of_deformation { Wanted::Parts } else { Wanted::Isochoric };
        sums.fill([R::ZERO; 4]);
        let mut findings = Findings::default();
        let mut batch = Batch::new();
        let mut averages = [Pack::ZERO; PACKS];
        let mut forces = [Pack([[R::ZERO; 4]; PACK]); 4];
        let packs = cells.packs_of(block);
        let mut local = cells.places.at_work(block, moved, sums);
        for first in packs.clone().step_by(PACKS) {
            let count = PACKS.min(packs.end - first);
            for (index, average) in averages[..count].iter_mut().enumerate() {
                let pack = first + index;
                for at in (0..PACK).step_by(L::WIDTH) {
                    let (u, beside) = relative::<R, L, 4, 3>(&local, pack - packs.start, at);
                    batch.set(index, at, &displacement_gradient(&u, &rest[pack].gradient, at));
                    (beside * L::of(0.25)).store(average, at);
                }
            }
            // A deformation that is averaged shows its own measures before, others theirs after.
            if of_deformation {
                batch.measure::<L>(count);
                for (index, average) in averages[..count].iter().enumerate() {
                    batch.note(index, (first + index) * PACK, &mut findings);
                    for at in (0..PACK).step_by(L::WIDTH) {
                        let h: Tensor<L> = load_tensor(&batch.gradient[index], at);
                        let ratio = L::load(&batch.volume_ratio[index], at);
                        batch.set(index, at, &dilated(&h, ratio, L::load(average, at)));
                    }
                }
            }
            batch.evaluate::<L>(law, wanted, count, 1, cells.fibres(first, count));
            for (index, average) in averages[..count].iter().enumerate() {
                let pack = first + index;
                if !of_deformation {
                    batch.note(index, pack * PACK, &mut findings);
                }
                let range = own_packs(pack - packs.start, per_pack, history.len());
                for at in (0..PACK).step_by(L::WIDTH) {
                    let elastic = match wanted {
                        Wanted::Parts => batch.parts::<L>(index, at),
                        _ => Split { isochoric: batch.stress(index, at), volumetric: Symmetric::ZERO },
                    };
                    let f = batch.deformation_gradient::<L>(index, at);
                    let average = L::load(average, at);
                    let piola = constants.piola(&f, elastic, average, &mut history[range.clone()], at);
                    let piola = piola.scaled(L::load(&rest[pack].volume, at));
                    by_cell(&nodal_forces(&piola, &rest[pack].gradient, at), &mut forces, at);
                }
                local.add::<L>(pack - packs.start, &forces);
            }
        }
        findings
    }
}

/// ∂ū/∂X of F̄ = (J̄/J)^(1/3) F, with J̄ − 1 in `change`.
#[inline(always)]
fn dilated<L: pliant_mechanics::Number>(h: &Tensor<L>, volume_ratio: L, change: L) -> Tensor<L> {
    let ratio = ((L::ONE + change) / volume_ratio).cbrt();
    let mut scaled = *h;
    for i in 0..3 {
        for k in 0..3 {
            scaled.0[i][k] = ratio * h.0[i][k];
        }
        scaled.0[i][i] += ratio - L::ONE;
    }
    scaled
}

impl<R: LaneNumber> AveragedConstants<R> {
    /// Returns the first Piola–Kirchhoff stress. If the deformation is averaged, it comes from the law.
    /// Otherwise it is F S_iso + p cof F, of the law's isochoric part and the pressure of the nodes.
    #[inline(always)]
    fn piola<L: Lanes<R>>(
        &self,
        f: &Tensor<L>,
        elastic: Split<Symmetric<L>>,
        average: L,
        history: &mut [Pack<R>],
        at: usize,
    ) -> Tensor<L> {
        if self.averaging == Averaging::NiftySim {
            return f.times_symmetric(&self.relaxation.advance(elastic, history, at));
        }
        let isochoric = self.relaxation.advance_isochoric(elastic.isochoric, history, at);
        f.times_symmetric(&isochoric).plus_scaled(&f.cofactor(), average)
    }
}

impl<R: LaneNumber> ForceField<R> for AveragedTets<R> {
    fn blocks(&self) -> &Blocks {
        &self.moved.blocks
    }
    fn evaluate(
        &mut self,
        displacement: &[Vector<R>],
        history: &mut History<R>,
        forces: &mut [Quad<R>],
        findings: &mut [Findings<R>],
    ) {
        let (processor, constants) = (self.processor, &self.constants);
        self.moved.for_each(forces, (&mut [], 0), (&mut [], 0), findings, |_, task| {
            processor.run(VolumeChanges { constants, displacement, task })
        });
        self.average_to_nodes(forces);
        match self.constants.averaging {
            Averaging::Nodal => self.find_pressures(&mut history.pressures),
            Averaging::Variational => {
                let (constants, values) = (&self.constants, &self.node_value);
                let pressures = (history.pressures.as_mut_slice(), constants.volumetric_slots);
                self.moved.for_each(forces, (&mut [], 0), pressures, findings, |blocks, mut task| {
                    constants.copy_in(blocks, values, &mut task);
                    processor.run(CellPressures { constants, task })
                });
                self.average_to_nodes(forces);
            }
            Averaging::NiftySim => {}
        }
        let (constants, values) = (&self.constants, &self.node_value);
        let history = (history.cells.as_mut_slice(), 6 * constants.cell_slots());
        self.moved.for_each(forces, history, (&mut [], 0), findings, |blocks, mut task| {
            constants.copy_in(blocks, values, &mut task);
            processor.run(AveragedPass { constants, task })
        });
    }
    fn set_step(&mut self, prony: &Prony, step: f64) {
        self.constants.relaxation.set_step(prony, step);
    }
    fn set_processor(&mut self, processor: Processor) {
        self.processor = processor;
    }
}
