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

use super::batch::{Batch, pressure};
use super::{BATCH, CHUNK, Findings, ForceField, displacement_gradient, relative_displacements, scatter};
use crate::Real;
use crate::law::{AnyLaw, Deformation, Split};
use crate::model::{Averaging, CellBlock, LocalNodes, Solid};
use crate::prony::{Prony, Relaxation};
use crate::state::History;
use crate::tensor::{Symmetric, Tensor, Vector, cast};

pub(super) struct AveragedTets<R> {
    law: AnyLaw,
    averaging: Averaging,
    nodes: Vec<[u32; 4]>,
    gradient: Vec<[Vector<R>; 4]>,
    volume: Vec<R>,
    fibre: Vec<Vector<R>>,
    families: usize,
    local: LocalNodes,
    /// V_n = Σ V_e/4 [m³].
    node_volume: Vec<R>,
    relaxation: Relaxation<R>,
    isochoric_slots: usize,
    volumetric_slots: usize,
    /// J_e − 1, or what a cell gives its nodes in a further average.
    cell_value: Vec<R>,
    /// J_n − 1, then p_n [Pa].
    node_value: Vec<R>,
}

impl<R: Real> AveragedTets<R> {
    pub(super) fn new(solid: &Solid, cells: &CellBlock<4>, averaging: Averaging, step: f64) -> Self {
        let local = LocalNodes::new(cells);
        let node_volume = (0..local.len())
            .map(|node| local.cells_at(node).map(|cell| 0.25 * cells.rest[cell].volume).sum::<f64>())
            .map(R::of)
            .collect();
        let prony = &solid.material.prony;
        Self {
            law: solid.material.law,
            averaging,
            nodes: cells.nodes.clone(),
            gradient: cells.rest.iter().map(|rest| rest.gradient.map(cast)).collect(),
            volume: cells.rest.iter().map(|rest| R::of(rest.volume)).collect(),
            fibre: solid.fibre.iter().map(|&a| cast(a)).collect(),
            families: solid.material.law.families(),
            node_volume,
            relaxation: Relaxation::new(prony, step),
            isochoric_slots: prony.isochoric_slots(),
            volumetric_slots: prony.volumetric_slots(),
            cell_value: vec![R::ZERO; cells.nodes.len()],
            node_value: vec![R::ZERO; local.len()],
            local,
        }
    }

    fn gradient_of(&self, cell: usize, displacement: &[Vector<R>]) -> Tensor<R> {
        displacement_gradient(&relative_displacements(&self.nodes[cell], displacement), &self.gradient[cell])
    }

    /// J_e − 1 of all cells.
    fn volume_changes(&mut self, displacement: &[Vector<R>]) {
        let mut values = std::mem::take(&mut self.cell_value);
        values.par_iter_mut().enumerate().with_min_len(CHUNK).for_each(|(cell, value)| {
            let h = self.gradient_of(cell, displacement);
            *value = h.trace() + h.second_invariant() + h.determinant();
        });
        self.cell_value = values;
    }

    /// The mean of the cells' values at each node, weighted by volume.
    fn average_to_nodes(&mut self) {
        let (local, volume, values, node_volume) =
            (&self.local, &self.volume, &self.cell_value, &self.node_volume);
        self.node_value.par_iter_mut().enumerate().with_min_len(CHUNK).for_each(|(node, value)| {
            let mut sum = R::ZERO;
            for cell in local.cells_at(node) {
                sum += volume[cell] * values[cell];
            }
            *value = sum * R::of(0.25) / node_volume[node];
        });
    }

    /// The mean of a cell's four nodal values.
    #[inline(always)]
    fn average_to_cell(&self, cell: usize) -> R {
        let [a, b, c, d] = self.local.nodes[cell];
        let value = |node: u32| self.node_value[node as usize];
        (value(a) + value(b) + value(c) + value(d)) * R::of(0.25)
    }

    /// p_n from J_n − 1, relaxed where the law's volumetric part relaxes.
    fn pressures_of_nodes(&mut self, history: &mut [R]) {
        let (law, relaxation) = (&self.law, &self.relaxation);
        let pressure = |value: R| pressure(law, value);
        if history.is_empty() {
            self.node_value.par_iter_mut().with_min_len(CHUNK).for_each(|value| *value = pressure(*value));
        } else {
            let own = history.par_chunks_mut(self.volumetric_slots).with_min_len(CHUNK);
            self.node_value.par_iter_mut().zip(own).for_each(|(value, history)| {
                *value = relaxation.advance_pressure(pressure(*value), history);
            });
        }
    }

    /// p_e' = U'(J̄_e) of all cells, relaxed likewise, averaged back to the nodes.
    fn pressures_by_cells(&mut self, history: &mut [R]) {
        let mut values = std::mem::take(&mut self.cell_value);
        let of_cell = |cell: usize| pressure(&self.law, self.average_to_cell(cell));
        if history.is_empty() {
            values
                .par_iter_mut()
                .enumerate()
                .with_min_len(CHUNK)
                .for_each(|(cell, value)| *value = of_cell(cell));
        } else {
            let own = history.par_chunks_mut(self.volumetric_slots).with_min_len(CHUNK);
            values.par_iter_mut().zip(own).enumerate().for_each(|(cell, (value, history))| {
                *value = self.relaxation.advance_pressure(of_cell(cell), history);
            });
        }
        self.cell_value = values;
        self.average_to_nodes();
    }

    /// The deformation whose stress the law is asked for: the cell's own, or F̄ = (J̄/J)^(1/3) F.
    #[inline(always)]
    fn deformation(
        &self,
        cell: usize,
        displacement: &[Vector<R>],
        findings: &mut Findings,
    ) -> Deformation<R> {
        let h = self.gradient_of(cell, displacement);
        let own = Deformation::from_displacement_gradient(&h);
        findings.note(cell, own.volume_ratio, &own.strain_twice);
        if self.averaging != Averaging::NiftySim {
            return own;
        }
        let ratio = ((R::ONE + self.average_to_cell(cell)) / own.volume_ratio).cbrt();
        let mut scaled = Tensor::ZERO;
        for (i, row) in scaled.0.iter_mut().enumerate() {
            for (k, entry) in row.iter_mut().enumerate() {
                let unit = if i == k { R::ONE } else { R::ZERO };
                *entry = ratio * h.0[i][k] + (ratio - R::ONE) * unit;
            }
        }
        Deformation::from_displacement_gradient(&scaled)
    }

    /// The stress that goes with it: the law's where the deformation is averaged, else its isochoric part and the
    /// pressure of the nodes.
    #[inline(always)]
    fn stress(
        &self,
        cell: usize,
        deformation: &Deformation<R>,
        elastic: Split<Symmetric<R>>,
        history: &mut [Symmetric<R>],
    ) -> Symmetric<R> {
        if self.averaging == Averaging::NiftySim {
            return if history.is_empty() {
                elastic.isochoric + elastic.volumetric
            } else {
                self.relaxation.advance(elastic, history)
            };
        }
        let isochoric = if history.is_empty() {
            elastic.isochoric
        } else {
            self.relaxation.advance_isochoric(elastic.isochoric, history)
        };
        let pressure = deformation.volume_ratio * self.average_to_cell(cell);
        isochoric + deformation.inverse_cauchy_green * pressure
    }

    fn pass(
        &self,
        first: usize,
        displacement: &[Vector<R>],
        history: &mut [Symmetric<R>],
        slots: &mut [Vector<R>],
    ) -> Findings {
        let mut findings = Findings::default();
        let mut batch = Batch::new();
        let per_cell = self.cell_slots();
        for (index, slots) in slots.chunks_mut(BATCH * 4).enumerate() {
            let offset = index * BATCH;
            let cells = first + offset..first + offset + slots.len() / 4;
            for (point, cell) in cells.clone().enumerate() {
                batch.deformation[point] = self.deformation(cell, displacement, &mut findings);
            }
            let fibres = &self.fibre[cells.start * self.families..cells.end * self.families];
            batch.evaluate(&self.law, cells.len(), fibres);
            for (point, (cell, forces)) in cells.zip(slots.chunks_exact_mut(4)).enumerate() {
                let own = if history.is_empty() {
                    &mut []
                } else {
                    &mut history[(offset + point) * per_cell..(offset + point + 1) * per_cell]
                };
                let deformation = &batch.deformation[point];
                let stress = self.stress(cell, deformation, batch.elastic[point], own);
                let piola = deformation.gradient.times_symmetric(&stress);
                scatter(&piola, &self.gradient[cell], self.volume[cell], forces);
            }
        }
        findings
    }

    fn cell_slots(&self) -> usize {
        self.isochoric_slots + if self.averaging == Averaging::NiftySim { self.volumetric_slots } else { 0 }
    }
}

impl<R: Real> ForceField<R> for AveragedTets<R> {
    fn evaluate(
        &mut self,
        displacement: &[Vector<R>],
        history: &mut History<R>,
        slots: &mut [Vector<R>],
        findings: &mut [Findings],
    ) {
        self.volume_changes(displacement);
        self.average_to_nodes();
        match self.averaging {
            Averaging::Nodal => self.pressures_of_nodes(&mut history.pressures),
            Averaging::Variational => self.pressures_by_cells(&mut history.pressures),
            Averaging::NiftySim => {}
        }
        let this = &*self;
        let tasks = slots.par_chunks_mut(CHUNK * 4).zip(findings).enumerate();
        if history.cells.is_empty() {
            tasks.for_each(|(task, (slots, findings))| {
                *findings = this.pass(task * CHUNK, displacement, &mut [], slots);
            });
        } else {
            tasks.zip(history.cells.par_chunks_mut(CHUNK * this.cell_slots())).for_each(
                |((task, (slots, findings)), history)| {
                    *findings = this.pass(task * CHUNK, displacement, history, slots);
                },
            );
        }
    }
    fn set_step(&mut self, prony: &Prony, step: f64) {
        self.relaxation.set_step(prony, step);
    }
}
