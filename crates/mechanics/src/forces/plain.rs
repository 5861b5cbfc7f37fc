//! One evaluation point a cell: linear tetrahedra, and uniform-strain hexahedra with hourglass control.

use rayon::prelude::*;

use super::batch::Batch;
use super::{BATCH, CHUNK, Findings, ForceField, displacement_gradient, relative_displacements, scatter};
use crate::Real;
use crate::law::{AnyLaw, Deformation};
use crate::model::{CellBlock, Hourglass, Solid};
use crate::prony::{Prony, Relaxation};
use crate::state::History;
use crate::tensor::{Symmetric, Vector, add, cast, dot, scale};

/// Cells with one evaluation point.
pub(super) struct SolidForces<R, const N: usize> {
    law: AnyLaw,
    nodes: Vec<[u32; N]>,
    gradient: Vec<[Vector<R>; N]>,
    volume: Vec<R>,
    fibre: Vec<Vector<R>>,
    families: usize,
    hourglass: Option<Hourglass<R, N>>,
    relaxation: Relaxation<R>,
    history_slots: usize,
}

impl<R: Real, const N: usize> SolidForces<R, N> {
    pub(super) fn new(solid: &Solid, cells: &CellBlock<N>, step: f64) -> Self {
        let hourglass = cells.hourglass.as_ref().map(|control| Hourglass {
            patterns: control.patterns.iter().map(|cell| cell.map(|gamma| gamma.map(R::of))).collect(),
            stiffness: control.stiffness.iter().map(|&k| R::of(k)).collect(),
        });
        Self {
            law: solid.material.law,
            nodes: cells.nodes.clone(),
            gradient: cells.rest.iter().map(|rest| rest.gradient.map(cast)).collect(),
            volume: cells.rest.iter().map(|rest| R::of(rest.volume)).collect(),
            fibre: solid.fibre.iter().map(|&a| cast(a)).collect(),
            families: solid.material.law.families(),
            hourglass,
            relaxation: Relaxation::new(&solid.material.prony, step),
            history_slots: solid.material.prony.slots(),
        }
    }

    /// The cells from `first` on, as many as `slots` has room for.
    fn pass(
        &self,
        first: usize,
        displacement: &[Vector<R>],
        history: &mut [Symmetric<R>],
        slots: &mut [Vector<R>],
    ) -> Findings {
        let mut findings = Findings::default();
        let mut batch = Batch::new();
        for (index, slots) in slots.chunks_mut(BATCH * N).enumerate() {
            let offset = index * BATCH;
            let cells = first + offset..first + offset + slots.len() / N;
            for (point, cell) in cells.clone().enumerate() {
                let u = relative_displacements(&self.nodes[cell], displacement);
                let h = displacement_gradient(&u, &self.gradient[cell]);
                let deformation = Deformation::from_displacement_gradient(&h);
                findings.note(cell, deformation.volume_ratio, &deformation.strain_twice);
                batch.deformation[point] = deformation;
            }
            let fibres = &self.fibre[cells.start * self.families..cells.end * self.families];
            batch.evaluate(&self.law, cells.len(), fibres);
            for (point, (cell, forces)) in cells.zip(slots.chunks_exact_mut(N)).enumerate() {
                let elastic = batch.elastic[point];
                let stress = if history.is_empty() {
                    elastic.isochoric + elastic.volumetric
                } else {
                    let cell = offset + point;
                    let own = cell * self.history_slots..(cell + 1) * self.history_slots;
                    self.relaxation.advance(elastic, &mut history[own])
                };
                let piola = batch.deformation[point].gradient.times_symmetric(&stress);
                scatter(&piola, &self.gradient[cell], self.volume[cell], forces);
                if let Some(control) = &self.hourglass {
                    let u = relative_displacements(&self.nodes[cell], displacement);
                    findings.hourglass +=
                        resist_hourglass(&control.patterns[cell], control.stiffness[cell], &u, forces);
                }
            }
        }
        findings
    }
}

/// f_a += k Σ_c γ_ca q_c with q_c = Σ_b γ_cb u_b; returns the energy ½ k Σ |q_c|² [J].
#[inline(always)]
fn resist_hourglass<R: Real, const N: usize>(
    patterns: &[[R; N]; 4],
    stiffness: R,
    u: &[Vector<R>; N],
    forces: &mut [Vector<R>],
) -> f64 {
    let mut energy = R::ZERO;
    for gamma in patterns {
        let mut q = [R::ZERO; 3];
        for (&g, &ua) in gamma.iter().zip(u) {
            q = add(q, scale(ua, g));
        }
        energy += dot(q, q);
        let kq = scale(q, stiffness);
        for (force, &g) in forces.iter_mut().zip(gamma) {
            *force = add(*force, scale(kq, g));
        }
    }
    0.5 * (stiffness * energy).to_f64()
}

impl<R: Real, const N: usize> ForceField<R> for SolidForces<R, N> {
    fn evaluate(
        &mut self,
        displacement: &[Vector<R>],
        history: &mut History<R>,
        slots: &mut [Vector<R>],
        findings: &mut [Findings],
    ) {
        let this = &*self;
        let history = &mut history.cells;
        let tasks = slots.par_chunks_mut(CHUNK * N).zip(findings).enumerate();
        if history.is_empty() {
            tasks.for_each(|(task, (slots, findings))| {
                *findings = this.pass(task * CHUNK, displacement, &mut [], slots);
            });
        } else {
            tasks.zip(history.par_chunks_mut(CHUNK * this.history_slots)).for_each(
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
