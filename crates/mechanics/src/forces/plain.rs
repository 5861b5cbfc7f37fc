//! One evaluation point a cell: linear tetrahedra, and uniform-strain hexahedra with hourglass control.

use super::batch::{Batch, PACKS};
use super::{
    Findings, ForceField, PackedCells, Places, Slot, by_cell, by_component, displacement_gradient,
    for_each_task, gather, relative, scatter,
};
use crate::Real;
use crate::lanes::{Lanes, PACK, Pack, Processor, Work, load_vector, store_vector};
use crate::law::AnyLaw;
use crate::model::{CellBlock, Solid};
use crate::prony::{Prony, Relaxation};
use crate::state::History;
use crate::tensor::{Vector, add, dot, scale};

/// Cells with one evaluation point.
pub(super) struct SolidForces<R, const N: usize> {
    processor: Processor,
    law: AnyLaw,
    cells: PackedCells<R, N>,
    hourglass: Option<PackedHourglass<R, N>>,
    relaxation: Relaxation<R>,
    /// Packs of history for a pack of cells.
    history: usize,
}

/// Hourglass control of packs of cells; see [`Hourglass`](crate::model::Hourglass).
struct PackedHourglass<R, const N: usize> {
    patterns: Vec<[[Pack<R>; N]; 4]>,
    stiffness: Vec<Pack<R>>,
}

impl<R: Real, const N: usize> SolidForces<R, N> {
    pub(super) fn new(solid: &Solid, cells: &CellBlock<N>, step: f64) -> Self {
        let packed = PackedCells::new(solid, cells);
        let hourglass = cells.hourglass.as_ref().map(|control| PackedHourglass {
            patterns: (packed.packs())
                .map(|pack| {
                    [0, 1, 2, 3].map(|c| {
                        std::array::from_fn(|a| packed.pack(pack, |cell| R::of(control.patterns[cell][c][a])))
                    })
                })
                .collect(),
            stiffness: (packed.packs())
                .map(|pack| packed.pack(pack, |cell| R::of(control.stiffness[cell])))
                .collect(),
        });
        Self {
            processor: Processor::detect(),
            law: solid.material.law,
            cells: packed,
            hourglass,
            relaxation: Relaxation::new(&solid.material.prony, step),
            history: 6 * solid.material.prony.slots(),
        }
    }
}

/// A pass over the packs from `first` on, as many as `slots` has room for.
struct Pass<'a, R, const N: usize> {
    field: &'a SolidForces<R, N>,
    first: usize,
    displacement: &'a Places<R>,
    history: &'a mut [Pack<R>],
    slots: &'a mut [Slot<R>],
}

impl<R: Real, const N: usize> Work<R> for Pass<'_, R, N> {
    type Output = Findings<R>;

    #[inline(always)]
    fn run<L: Lanes<R>>(self) -> Findings<R> {
        let Self { field, first, displacement, history, slots } = self;
        let cells = &field.cells;
        let mut findings = Findings::default();
        let mut batch = Batch::new();
        let mut gathered = [[Pack([[R::ZERO; 4]; PACK]); N]; PACKS];
        let mut moved = [[[Pack::ZERO; 3]; N]; PACKS];
        let mut forces = [[Pack::ZERO; 3]; N];
        for (index, slots) in slots.chunks_mut(PACKS * N).enumerate() {
            let first = first + index * PACKS;
            let packs = slots.len() / N;
            for (pack, gathered) in gathered[..packs].iter_mut().enumerate() {
                gather(&cells.nodes[first + pack], displacement, gathered);
            }
            for (pack, moved) in moved[..packs].iter_mut().enumerate() {
                by_component(&gathered[pack], moved);
                for at in (0..PACK).step_by(L::WIDTH) {
                    let u = relative::<R, L, N>(moved, at);
                    batch.set(pack, at, &displacement_gradient(&u, &cells.gradient[first + pack], at));
                }
            }
            batch.evaluate::<L>(&field.law, packs, 1, cells.fibres(first, packs));
            for (pack, slots) in slots.chunks_exact_mut(N).enumerate() {
                batch.note(pack, (first + pack) * PACK, &mut findings);
                for at in (0..PACK).step_by(L::WIDTH) {
                    let elastic = batch.elastic::<L>(pack, at);
                    let own = (index * PACKS + pack) * field.history;
                    let own = own.min(history.len())..(own + field.history).min(history.len());
                    let stress = field.relaxation.advance(elastic, &mut history[own], at);
                    let piola = batch.deformation_gradient::<L>(pack, at).times_symmetric(&stress);
                    let volume = L::load(&cells.volume[first + pack], at);
                    scatter(&piola, &cells.gradient[first + pack], volume, &mut forces, at);
                }
                if let Some(control) = &field.hourglass {
                    for at in (0..PACK).step_by(L::WIDTH) {
                        let u = relative::<R, L, N>(&moved[pack], at);
                        let stiffness = L::load(&control.stiffness[first + pack], at);
                        let patterns = &control.patterns[first + pack];
                        let energy = resist_hourglass(patterns, stiffness, &u, &mut forces, at);
                        (energy + L::load(&findings.hourglass, at)).store(&mut findings.hourglass, at);
                    }
                }
                by_cell(&forces, slots);
            }
        }
        findings
    }
}

/// f_a += k Σ_c γ_ca q_c with q_c = Σ_b γ_cb u_b; returns the energy ½ k Σ |q_c|² [J].
#[inline(always)]
fn resist_hourglass<R: Real, L: Lanes<R>, const N: usize>(
    patterns: &[[Pack<R>; N]; 4],
    stiffness: L,
    u: &[Vector<L>; N],
    forces: &mut [Vector<Pack<R>>],
    at: usize,
) -> L {
    let mut energy = L::ZERO;
    let mut kq = [[L::ZERO; 3]; 4];
    for (gamma, kq) in patterns.iter().zip(&mut kq) {
        let mut q = [L::ZERO; 3];
        for (g, &ua) in gamma.iter().zip(u) {
            q = add(q, scale(ua, L::load(g, at)));
        }
        energy += dot(q, q);
        *kq = scale(q, stiffness);
    }
    for (a, force) in forces.iter_mut().enumerate() {
        let mut sum = load_vector(force, at);
        for (gamma, &kq) in patterns.iter().zip(&kq) {
            sum = add(sum, scale(kq, L::load(&gamma[a], at)));
        }
        store_vector(sum, force, at);
    }
    L::of(0.5) * stiffness * energy
}

impl<R: Real, const N: usize> ForceField<R> for SolidForces<R, N> {
    fn evaluate(
        &mut self,
        displacement: &Places<R>,
        history: &mut History<R>,
        slots: &mut [Slot<R>],
        findings: &mut [Findings<R>],
    ) {
        let this = &*self;
        for_each_task(slots, N, &mut history.cells, this.history, findings, |first, slots, history| {
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
