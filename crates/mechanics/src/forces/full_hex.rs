//! Hexahedra with 2×2×2 Gauss points for the change of shape and one mean dilatation, W = Σ w W_iso(F_g) + V U(v/V):
//! no hourglass patterns, no locking, eight stresses a cell. The in-house reference for `hex8`.

use rayon::prelude::*;

use super::batch::{Batch, pressure};
use super::{CHUNK, Findings, ForceField, displacement_gradient, relative_displacements};
use crate::Real;
use crate::element::GaussPoints;
use crate::law::{AnyLaw, Deformation};
use crate::model::{CellBlock, Solid};
use crate::prony::{Prony, Relaxation};
use crate::state::History;
use crate::tensor::{Symmetric, Vector, add, cast, scale};

pub(super) struct FullHexes<R> {
    law: AnyLaw,
    nodes: Vec<[u32; 8]>,
    /// Gradients of the shape functions at the eight points [1/m].
    gradient: Vec<[[Vector<R>; 8]; 8]>,
    /// Volumes of the points [m³].
    weight: Vec<[R; 8]>,
    volume: Vec<R>,
    /// Directions at the eight points of each cell.
    fibre: Vec<Vector<R>>,
    families: usize,
    relaxation: Relaxation<R>,
    isochoric_slots: usize,
    volumetric_slots: usize,
    /// U'(v/V) of each cell [Pa].
    pressure: Vec<R>,
}

impl<R: Real> FullHexes<R> {
    pub(super) fn new(solid: &Solid, cells: &CellBlock<8>, points: &[GaussPoints], step: f64) -> Self {
        let prony = &solid.material.prony;
        Self {
            law: solid.material.law,
            nodes: cells.nodes.clone(),
            gradient: points.iter().map(|cell| cell.gradient.map(|point| point.map(cast))).collect(),
            weight: points.iter().map(|cell| cell.weight.map(R::of)).collect(),
            volume: cells.rest.iter().map(|rest| R::of(rest.volume)).collect(),
            fibre: (0..cells.nodes.len()).flat_map(|cell| solid.fibres(cell).repeat(8)).map(cast).collect(),
            families: solid.material.law.families(),
            relaxation: Relaxation::new(prony, step),
            isochoric_slots: prony.isochoric_slots(),
            volumetric_slots: prony.volumetric_slots(),
            pressure: vec![R::ZERO; cells.nodes.len()],
        }
    }

    fn slots(&self) -> usize {
        8 * self.isochoric_slots
    }

    /// U'(v/V) of all cells, relaxed where the law's volumetric part relaxes.
    fn pressures(&mut self, displacement: &[Vector<R>], history: &mut [R]) {
        let mut pressures = std::mem::take(&mut self.pressure);
        let of_cell = |cell: usize| {
            let u = relative_displacements(&self.nodes[cell], displacement);
            let mut change = R::ZERO;
            for (gradient, &weight) in self.gradient[cell].iter().zip(&self.weight[cell]) {
                let h = displacement_gradient(&u, gradient);
                change += weight * (h.trace() + h.second_invariant() + h.determinant());
            }
            pressure(&self.law, change / self.volume[cell])
        };
        if history.is_empty() {
            pressures.par_iter_mut().enumerate().with_min_len(CHUNK).for_each(|(cell, p)| *p = of_cell(cell));
        } else {
            let own = history.par_chunks_mut(self.volumetric_slots).with_min_len(CHUNK);
            pressures.par_iter_mut().zip(own).enumerate().for_each(|(cell, (p, history))| {
                *p = self.relaxation.advance_pressure(of_cell(cell), history);
            });
        }
        self.pressure = pressures;
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
        for (offset, forces) in slots.chunks_exact_mut(8).enumerate() {
            let own = if history.is_empty() {
                &mut []
            } else {
                &mut history[offset * self.slots()..(offset + 1) * self.slots()]
            };
            self.cell(first + offset, displacement, own, forces, &mut batch, &mut findings);
        }
        findings
    }

    fn cell(
        &self,
        cell: usize,
        displacement: &[Vector<R>],
        history: &mut [Symmetric<R>],
        forces: &mut [Vector<R>],
        batch: &mut Batch<R>,
        findings: &mut Findings,
    ) {
        let u = relative_displacements(&self.nodes[cell], displacement);
        for (deformation, gradient) in batch.deformation.iter_mut().zip(&self.gradient[cell]) {
            *deformation = Deformation::from_displacement_gradient(&displacement_gradient(&u, gradient));
            findings.note(cell, deformation.volume_ratio, &deformation.strain_twice);
        }
        batch.evaluate(&self.law, 8, &self.fibre[8 * cell * self.families..8 * (cell + 1) * self.families]);
        forces.fill([R::ZERO; 3]);
        for (point, (gradient, &weight)) in self.gradient[cell].iter().zip(&self.weight[cell]).enumerate() {
            let deformation = &batch.deformation[point];
            let mut stress = batch.elastic[point].isochoric;
            if !history.is_empty() {
                let own = point * self.isochoric_slots..(point + 1) * self.isochoric_slots;
                stress = self.relaxation.advance_isochoric(stress, &mut history[own]);
            }
            let pressure = deformation.volume_ratio * self.pressure[cell];
            stress = stress + deformation.inverse_cauchy_green * pressure;
            let piola = deformation.gradient.times_symmetric(&stress);
            for (force, &b) in forces.iter_mut().zip(gradient) {
                *force = add(*force, scale(piola.apply(b), weight));
            }
        }
    }
}

impl<R: Real> ForceField<R> for FullHexes<R> {
    fn evaluate(
        &mut self,
        displacement: &[Vector<R>],
        history: &mut History<R>,
        slots: &mut [Vector<R>],
        findings: &mut [Findings],
    ) {
        self.pressures(displacement, &mut history.pressures);
        let this = &*self;
        let tasks = slots.par_chunks_mut(CHUNK * 8).zip(findings).enumerate();
        if history.cells.is_empty() {
            tasks.for_each(|(task, (slots, findings))| {
                *findings = this.pass(task * CHUNK, displacement, &mut [], slots);
            });
        } else {
            tasks.zip(history.cells.par_chunks_mut(CHUNK * this.slots())).for_each(
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
