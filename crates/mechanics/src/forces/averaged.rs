//! Linear tetrahedra whose pressure is averaged over nodes, so that they do not lock for nearly incompressible tissue.
//!
//! *Nodal* (Bonet and Burton 1998): J_n = Σ V_e J_e / Σ V_e over the cells at a node, p_n = U'(J_n), p_e the mean of the
//! cell's four p_n, f_a = V_e (P_iso + p_e cof F) B_a: exactly the gradient of Σ V_e W_iso + Σ V_n U(J_n).
//! *Variational*: J̄_e the mean of the four J_n, p_e' = U'(J̄_e), p_n their mean weighted by volume, p_e as above: the
//! gradient of Σ V_e (W_iso + U(J̄_e)). Softer; watch for pressure modes.
//! *NiftySim* (Joldes, Wittek and Miller 2009): the whole law at F̄ = (J̄_e/J_e)^(1/3) F, f_a = V_e F̄ S(F̄) B_a. Not the
//! gradient of an energy: for the answers of imported models only.
//!
//! Averages are those of one solid: a node on an interface has a J_n for each material.

use rayon::prelude::*;

use super::batch::{Batch, PACKS, pressures};
use super::{
    Findings, ForceField, PackedCells, Places, Slot, by_cell, by_component, displacement_gradient,
    for_each_task, gather, relative, scatter,
};
use crate::Real;
use crate::lanes::{Lanes, PACK, Pack, Processor, Work, entry, load_tensor};
use crate::law::{AnyLaw, Split};
use crate::model::{Averaging, CellBlock, LocalNodes, Solid};
use crate::prony::{Prony, Relaxation};
use crate::state::History;
use crate::tensor::{Symmetric, Tensor};

pub(super) struct AveragedTets<R> {
    processor: Processor,
    law: AnyLaw,
    averaging: Averaging,
    cells: PackedCells<R, 4>,
    /// Local nodes of packs of cells.
    local_nodes: Vec<[[u32; PACK]; 4]>,
    local: LocalNodes,
    /// 1/V_n with V_n = Σ V_e/4 [1/m³].
    inverse_volume: Vec<R>,
    relaxation: Relaxation<R>,
    isochoric_slots: usize,
    volumetric_slots: usize,
    /// V_e/4 times J_e − 1, or what a cell gives its nodes in a further average.
    cell_value: Vec<Pack<R>>,
    /// J_n − 1, then p_n [Pa].
    node_value: Vec<Pack<R>>,
}

impl<R: Real> AveragedTets<R> {
    pub(super) fn new(solid: &Solid, cells: &CellBlock<4>, averaging: Averaging, step: f64) -> Self {
        let local = LocalNodes::new(cells);
        let volume_at = |node| local.cells_at(node).map(|cell| 0.25 * cells.rest[cell].volume).sum::<f64>();
        let prony = &solid.material.prony;
        let packed = PackedCells::new(solid, cells);
        let last = cells.nodes.len().saturating_sub(1);
        let local_node = |pack: usize, a: usize, lane: usize| local.nodes[last.min(pack * PACK + lane)][a];
        Self {
            processor: Processor::detect(),
            law: solid.material.law,
            averaging,
            local_nodes: (packed.packs())
                .map(|pack| [0, 1, 2, 3].map(|a| std::array::from_fn(|lane| local_node(pack, a, lane))))
                .collect(),
            inverse_volume: (0..local.len()).map(|node| R::of(1.0 / volume_at(node))).collect(),
            relaxation: Relaxation::new(prony, step),
            isochoric_slots: prony.isochoric_slots(),
            volumetric_slots: prony.volumetric_slots(),
            cell_value: vec![Pack::ZERO; packed.packs().len()],
            node_value: vec![Pack::ZERO; local.len().div_ceil(PACK)],
            cells: packed,
            local,
        }
    }

    /// J_e − 1 of all cells, as their share in the average.
    fn volume_changes(&mut self, displacement: &Places<R>) {
        let mut values = std::mem::take(&mut self.cell_value);
        values.par_chunks_mut(PACKS).enumerate().with_min_len(4).for_each(|(task, values)| {
            let first = task * PACKS;
            self.processor.run(VolumeChanges { cells: &self.cells, first, displacement, values });
        });
        self.cell_value = values;
    }

    /// The mean of the cells' values at each node, weighted by volume.
    fn average_to_nodes(&mut self) {
        let (local, values, inverse_volume) = (&self.local, &self.cell_value, &self.inverse_volume);
        self.node_value.par_iter_mut().enumerate().with_min_len(16).for_each(|(pack, nodes)| {
            for (lane, value) in nodes.0.iter_mut().enumerate() {
                let node = pack * PACK + lane;
                if node < local.len() {
                    let sum = local.cells_at(node).fold(R::ZERO, |sum, cell| sum + entry(values, cell));
                    *value = sum * inverse_volume[node];
                }
            }
        });
    }

    /// p from J − 1, relaxed where the law's volumetric part relaxes.
    fn to_pressures(&self, values: &mut [Pack<R>], history: &mut [Pack<R>]) {
        let pass = |values: &mut [Pack<R>], history: &mut [Pack<R>]| {
            let (law, relaxation, slots) = (&self.law, &self.relaxation, self.volumetric_slots);
            self.processor.run(Pressures { law, relaxation, slots, values, history });
        };
        for_each_pressure(values, history, self.volumetric_slots, pass);
    }

    /// p_n of all nodes by way of the cells' own pressures.
    fn pressures_by_cells(&mut self, history: &mut [Pack<R>]) {
        let mut values = std::mem::take(&mut self.cell_value);
        values.par_iter_mut().enumerate().with_min_len(16).for_each(|(pack, value)| {
            *value = self.average_to_pack(pack);
        });
        self.to_pressures(&mut values, history);
        values.par_iter_mut().zip(&self.cells.volume).with_min_len(16).for_each(|(value, volume)| {
            *value = Pack::from_fn(|lane| R::of(0.25) * volume.0[lane] * value.0[lane]);
        });
        self.cell_value = values;
        self.average_to_nodes();
    }

    /// The means of the four nodal values of the cells of a pack.
    #[inline(always)]
    fn average_to_pack(&self, pack: usize) -> Pack<R> {
        let nodes = &self.local_nodes[pack];
        let value = |a: usize, lane: usize| entry(&self.node_value, nodes[a][lane] as usize);
        let mut mean = Pack::ZERO;
        for (lane, mean) in mean.0.iter_mut().enumerate() {
            *mean = (value(0, lane) + value(1, lane) + value(2, lane) + value(3, lane)) * R::of(0.25);
        }
        mean
    }

    /// Tensors of history per cell.
    fn cell_slots(&self) -> usize {
        self.isochoric_slots + if self.averaging == Averaging::NiftySim { self.volumetric_slots } else { 0 }
    }
}

/// J_e − 1 of up to [`PACKS`] packs of cells, times V_e/4.
struct VolumeChanges<'a, R> {
    cells: &'a PackedCells<R, 4>,
    first: usize,
    displacement: &'a Places<R>,
    values: &'a mut [Pack<R>],
}

impl<R: Real> Work<R> for VolumeChanges<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<R>>(self) {
        let Self { cells, first, displacement, values } = self;
        let mut gathered = [[Pack([[R::ZERO; 4]; PACK]); 4]; PACKS];
        let mut moved = [[Pack::ZERO; 3]; 4];
        for (pack, gathered) in gathered[..values.len()].iter_mut().enumerate() {
            gather(&cells.nodes[first + pack], displacement, gathered);
        }
        for ((pack, value), gathered) in values.iter_mut().enumerate().zip(&gathered) {
            by_component(gathered, &mut moved);
            for at in (0..PACK).step_by(L::WIDTH) {
                let u = relative::<R, L, 4>(&moved, at);
                let change = volume_change(&displacement_gradient(&u, &cells.gradient[first + pack], at));
                (change * L::of(0.25) * L::load(&cells.volume[first + pack], at)).store(value, at);
            }
        }
    }
}

/// J − 1, without cancellation.
#[inline(always)]
pub(super) fn volume_change<L: crate::Number>(h: &Tensor<L>) -> L {
    h.trace() + h.second_invariant() + h.determinant()
}

/// Does `pass` in parallel for every [`PACKS`] packs of pressures and their history.
pub(super) fn for_each_pressure<R: Real>(
    values: &mut [Pack<R>],
    history: &mut [Pack<R>],
    slots: usize,
    pass: impl Fn(&mut [Pack<R>], &mut [Pack<R>]) + Sync,
) {
    let values = values.par_chunks_mut(PACKS).with_min_len(4);
    if history.is_empty() {
        values.for_each(|values| pass(values, &mut []));
    } else {
        values.zip(history.par_chunks_mut(PACKS * slots)).for_each(|(values, history)| pass(values, history));
    }
}

/// Up to [`PACKS`] packs of J − 1 become pressures [Pa].
pub(super) struct Pressures<'a, R> {
    pub law: &'a AnyLaw,
    pub relaxation: &'a Relaxation<R>,
    pub slots: usize,
    pub values: &'a mut [Pack<R>],
    pub history: &'a mut [Pack<R>],
}

impl<R: Real> Work<R> for Pressures<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<R>>(self) {
        let Self { law, relaxation, slots, values, history } = self;
        pressures::<R, L>(law, values, &mut Batch::new());
        if history.is_empty() {
            return;
        }
        for (value, history) in values.iter_mut().zip(history.chunks_exact_mut(slots)) {
            for at in (0..PACK).step_by(L::WIDTH) {
                relaxation.advance_pressure(L::load(value, at), history, at).store(value, at);
            }
        }
    }
}

/// A pass over the packs from `first` on, as many as `slots` has room for.
struct Pass<'a, R> {
    field: &'a AveragedTets<R>,
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
        let cells = &field.cells;
        let per_pack = 6 * field.cell_slots();
        let mut findings = Findings::default();
        let mut batch = Batch::new();
        let mut gathered = [[Pack([[R::ZERO; 4]; PACK]); 4]; PACKS];
        let mut moved = [[Pack::ZERO; 3]; 4];
        let mut forces = [[Pack::ZERO; 3]; 4];
        let mut averages = [Pack::ZERO; PACKS];
        for (index, slots) in slots.chunks_mut(PACKS * 4).enumerate() {
            let first = first + index * PACKS;
            let packs = slots.len() / 4;
            for (pack, (gathered, average)) in gathered.iter_mut().zip(&mut averages).take(packs).enumerate()
            {
                gather(&cells.nodes[first + pack], displacement, gathered);
                *average = field.average_to_pack(first + pack);
            }
            // A deformation that is averaged shows its own measures before, others theirs after.
            for (pack, gathered) in gathered[..packs].iter().enumerate() {
                by_component(gathered, &mut moved);
                for at in (0..PACK).step_by(L::WIDTH) {
                    let u = relative::<R, L, 4>(&moved, at);
                    batch.set(pack, at, &displacement_gradient(&u, &cells.gradient[first + pack], at));
                }
            }
            if field.averaging == Averaging::NiftySim {
                batch.measure::<L>(packs);
                for (pack, average) in averages[..packs].iter().enumerate() {
                    batch.note(pack, (first + pack) * PACK, &mut findings);
                    for at in (0..PACK).step_by(L::WIDTH) {
                        let h: Tensor<L> = load_tensor(&batch.gradient[pack], at);
                        let own = L::load(&batch.volume_ratio[pack], at);
                        batch.set(pack, at, &dilated(&h, own, L::load(average, at)));
                    }
                }
            }
            batch.evaluate::<L>(&field.law, packs, 1, cells.fibres(first, packs));
            for (pack, slots) in slots.chunks_exact_mut(4).enumerate() {
                if field.averaging != Averaging::NiftySim {
                    batch.note(pack, (first + pack) * PACK, &mut findings);
                }
                let own = (index * PACKS + pack) * per_pack;
                let own = own.min(history.len())..(own + per_pack).min(history.len());
                for at in (0..PACK).step_by(L::WIDTH) {
                    let elastic = batch.elastic::<L>(pack, at);
                    let f = batch.deformation_gradient::<L>(pack, at);
                    let piola =
                        field.piola(&f, elastic, L::load(&averages[pack], at), &mut history[own.clone()], at);
                    let volume = L::load(&cells.volume[first + pack], at);
                    scatter(&piola, &cells.gradient[first + pack], volume, &mut forces, at);
                }
                by_cell(&forces, slots);
            }
        }
        findings
    }
}

/// ∂ū/∂X of F̄ = (J̄/J)^(1/3) F, with J̄ − 1 in `change`.
#[inline(always)]
fn dilated<L: crate::Number>(h: &Tensor<L>, volume_ratio: L, change: L) -> Tensor<L> {
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

impl<R: Real> AveragedTets<R> {
    /// The first Piola–Kirchhoff stress: of the law where the deformation is averaged, else of its isochoric part and the
    /// pressure of the nodes, F S_iso + p cof F.
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

impl<R: Real> ForceField<R> for AveragedTets<R> {
    fn evaluate(
        &mut self,
        displacement: &Places<R>,
        history: &mut History<R>,
        slots: &mut [Slot<R>],
        findings: &mut [Findings<R>],
    ) {
        self.volume_changes(displacement);
        self.average_to_nodes();
        match self.averaging {
            Averaging::Nodal => {
                let mut values = std::mem::take(&mut self.node_value);
                self.to_pressures(&mut values, &mut history.pressures);
                self.node_value = values;
            }
            Averaging::Variational => self.pressures_by_cells(&mut history.pressures),
            Averaging::NiftySim => {}
        }
        let this = &*self;
        let per_pack = 6 * this.cell_slots();
        for_each_task(slots, 4, &mut history.cells, per_pack, findings, |first, slots, history| {
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
