//! Membranes: triangles of constant strain in their own plane, in plane stress (`pliant_mechanics::law::plane_stress`). With the tangents
//! f_i = t_i + Σ u_a (B_a·t_i) and S in the frame of the triangle, f_a = V (f_i S_ij (B_a·t_j)), V = A₀ t₀.
//!
//! A law works on batches as for solids, in the gradient that Cholesky's factor of C makes. The stretch across is found by a search over
//! the whole batch, three or four stresses a cell; an incompressible law takes one.

use pliant_mechanics::element::Sheet;
use pliant_mechanics::law::AnyLaw;
use pliant_mechanics::law::Split;
use pliant_mechanics::law::plane_stress::{
    Across, FLAT_WALL, InPlane, MOST_SEARCHES, ThicknessSearch, kirchhoff_across,
};
use pliant_mechanics::model::{CellBlock, Solid};
use pliant_mechanics::tensor::{Symmetric, Vector, add, cast, dot, scale};

use super::batch::{Batch, PACKS};
use super::blocks::Task;
use super::one_pass::{Element, OnePass};
use super::{Findings, PackedCells, by_cell, own_packs, relative};
use crate::Scalar;
use crate::lanes::{Lanes, Local, PACK, Pack, load_vector};
use crate::relaxation::Relaxation;

/// Where a search ends: a step of so many units in the last place of λ₃ − 1.
const SEARCHED: f64 = 64.0;

/// The triangles of a membrane.
pub(super) type Membranes<R> = OnePass<R, MembraneConstants<R>>;

/// What does not change from step to step.
pub(super) struct MembraneConstants<R> {
    law: AnyLaw,
    across: Across,
    cells: PackedCells<R, 3>,
    rest: Vec<PackedTriangle<R>>,
    relaxation: Relaxation<R>,
    /// Packs of history for a pack of cells.
    history: usize,
}

/// Triangles at rest.
struct PackedTriangle<R> {
    axes: [Vector<Pack<R>>; 2],
    /// B_a·t_1 and B_a·t_2 [1/m] of all nodes but the first.
    gradient: [[Pack<R>; 2]; 2],
    /// V [m³], zero where a pack is filled up.
    volume: Pack<R>,
}

impl<R: Scalar> Membranes<R> {
    pub(super) fn new(solid: &Solid, cells: &CellBlock<3>, sheets: &[Sheet], step: f64) -> Self {
        let (packed, blocks) = PackedCells::new(solid, cells);
        let rest = |pack: usize| PackedTriangle {
            axes: [0, 1].map(|i| packed.vector(pack, |cell| cast(sheets[cell].axes[i]))),
            gradient: [1, 2].map(|a| {
                [0, 1].map(|i| {
                    packed.pack(pack, |cell| R::of(dot(cells.rest[cell].gradient[a], sheets[cell].axes[i])))
                })
            }),
            volume: packed.pack(pack, |cell| R::of(cells.rest[cell].volume)),
        };
        let constants = MembraneConstants {
            law: solid.material.law,
            across: solid.material.law.across(),
            rest: packed.packs().map(rest).collect(),
            cells: packed,
            relaxation: Relaxation::new(&solid.material.prony, step),
            history: 6 * solid.material.prony.slots(),
        };
        Self::of(blocks, constants)
    }
}

impl<R: Scalar> PackedTriangle<R> {
    /// The changes of the tangents ∂u/∂X_i.
    #[inline(always)]
    fn changes<L: Lanes<R>>(&self, u: &[Vector<L>; 2], at: usize) -> [Vector<L>; 2] {
        // Written out: closures are not compiled for the lanes.
        let [[b1, b2], [c1, c2]] = &self.gradient;
        [
            add(scale(u[0], L::load(b1, at)), scale(u[1], L::load(c1, at))),
            add(scale(u[0], L::load(b2, at)), scale(u[1], L::load(c2, at))),
        ]
    }

    #[inline(always)]
    fn axes<L: Lanes<R>>(&self, at: usize) -> [Vector<L>; 2] {
        [load_vector(&self.axes[0], at), load_vector(&self.axes[1], at)]
    }
}

/// The strains of the packs of a batch, and the stretches across.
struct Walls<R> {
    /// Of [`InPlane::parts`].
    plane: [[Pack<R>; 6]; PACKS],
    /// Of [`ThicknessSearch::parts`].
    search: [[Pack<R>; 4]; PACKS],
    /// λ₃ − 1 of the stresses in the batch.
    change: [Pack<R>; PACKS],
}

impl<R: Scalar> Walls<R> {
    fn new() -> Self {
        Self {
            plane: [[Pack::ZERO; 6]; PACKS],
            search: [[Pack::ZERO; 4]; PACKS],
            change: [Pack::ZERO; PACKS],
        }
    }

    #[inline(always)]
    fn plane<L: Lanes<R>>(&self, pack: usize, at: usize) -> InPlane<L> {
        let [xx, yy, xy, a, b, c] = &self.plane[pack];
        InPlane::from_parts([
            L::load(xx, at),
            L::load(yy, at),
            L::load(xy, at),
            L::load(a, at),
            L::load(b, at),
            L::load(c, at),
        ])
    }

    /// Sets the gradients that the law sees, with λ₃ − 1 across.
    #[inline(always)]
    fn set<L: Lanes<R>>(&mut self, batch: &mut Batch<R>, pack: usize, at: usize, change: L) {
        change.store(&mut self.change[pack], at);
        batch.set(pack, at, &self.plane::<L>(pack, at).displacement_gradient(change));
    }

    /// Finds the stresses of the first packs.
    #[inline(always)]
    fn evaluate<L: Lanes<R>>(
        &mut self,
        constants: &MembraneConstants<R>,
        batch: &mut Batch<R>,
        packs: usize,
        fibres: &[Vector<Pack<R>>],
    ) {
        if constants.across.modulus.is_infinite() {
            for pack in 0..packs {
                for at in (0..PACK).step_by(L::WIDTH) {
                    let change = self.plane::<L>(pack, at).incompressible();
                    self.set(batch, pack, at, change);
                }
            }
            batch.evaluate::<L>(&constants.law, packs, 1, fibres);
            return;
        }
        for pack in 0..packs {
            for at in (0..PACK).step_by(L::WIDTH) {
                let search = ThicknessSearch::new(&self.plane::<L>(pack, at), constants.across);
                for (part, to) in search.parts().into_iter().zip(&mut self.search[pack]) {
                    part.store(to, at);
                }
            }
        }
        for _ in 0..MOST_SEARCHES {
            for pack in 0..packs {
                for at in (0..PACK).step_by(L::WIDTH) {
                    let change = L::load(&self.search[pack][0], at);
                    self.set(batch, pack, at, change);
                }
            }
            batch.evaluate::<L>(&constants.law, packs, 1, fibres);
            let mut found = true;
            for pack in 0..packs {
                let mut steps = Pack::ZERO;
                for at in (0..PACK).step_by(L::WIDTH) {
                    let [change, slope, last, moved] = &self.search[pack];
                    let mut search = ThicknessSearch::from_parts([
                        L::load(change, at),
                        L::load(slope, at),
                        L::load(last, at),
                        L::load(moved, at),
                    ]);
                    let Split { isochoric, volumetric } = batch.elastic::<L>(pack, at);
                    let stress = isochoric + volumetric;
                    search.improve(kirchhoff_across(&stress, search.change)).store(&mut steps, at);
                    for (part, to) in search.parts().into_iter().zip(&mut self.search[pack]) {
                        part.store(to, at);
                    }
                }
                for (step, change) in steps.0.iter().zip(&self.change[pack].0) {
                    let (step, change) = (step.to_f64().abs(), change.to_f64().abs());
                    // Not a number: a folded triangle, which ends the run.
                    found &= step.is_nan() || step <= SEARCHED * R::EPSILON * change.max(R::EPSILON);
                }
            }
            if found {
                break;
            }
        }
    }

    /// S₁₁, S₂₂ and S₁₂.
    #[inline(always)]
    fn stress<L: Lanes<R>>(
        &self,
        constants: &MembraneConstants<R>,
        batch: &Batch<R>,
        pack: usize,
        at: usize,
    ) -> [L; 3] {
        let Split { isochoric, volumetric } = batch.elastic::<L>(pack, at);
        let whole = if constants.across.modulus.is_infinite() { isochoric } else { isochoric + volumetric };
        let change = L::load(&self.change[pack], at);
        self.plane::<L>(pack, at).without_stress_across(&whole, change, L::of(constants.across.coupling))
    }
}

impl<R: Scalar> Element<R> for MembraneConstants<R> {
    fn slots(&self) -> [usize; 2] {
        [self.history, 0]
    }
    fn relaxation(&mut self) -> &mut Relaxation<R> {
        &mut self.relaxation
    }

    #[inline(always)]
    fn pass<L: Lanes<R>>(&self, displacement: &[Vector<R>], mut task: Task<'_, R>) -> Findings<R> {
        let MembraneConstants { cells, rest, relaxation, history: per_pack, .. } = self;
        task.copy_in(displacement);
        let Task { block, moved, forces: sums, history, .. } = task;
        sums.fill([R::ZERO; 4]);
        let mut findings = Findings::default();
        let mut batch = Batch::new();
        let mut walls = Walls::new();
        let mut forces = [Pack([[R::ZERO; 4]; PACK]); 3];
        let packs = cells.packs_of(block);
        let mut local = Local::new(moved, sums, &cells.nodes[packs.clone()]);
        for first in packs.clone().step_by(PACKS) {
            let count = PACKS.min(packs.end - first);
            for index in 0..count {
                let pack = first + index;
                for at in (0..PACK).step_by(L::WIDTH) {
                    let (u, _) = relative::<R, L, 3, 2>(&local, pack - packs.start, at);
                    let plane = InPlane::from_changes(&rest[pack].axes(at), &rest[pack].changes(&u, at));
                    for (part, to) in plane.parts().into_iter().zip(&mut walls.plane[index]) {
                        part.store(to, at);
                    }
                }
            }
            walls.evaluate::<L>(self, &mut batch, count, cells.fibres(first, count));
            for index in 0..count {
                let pack = first + index;
                for at in (0..PACK).step_by(L::WIDTH) {
                    let area = L::ONE + walls.plane::<L>(index, at).area_change();
                    area.store(&mut batch.volume_ratio[index], at);
                }
                for ratio in &mut batch.volume_ratio[index].0 {
                    *ratio = if *ratio < R::of(FLAT_WALL) { R::ZERO } else { *ratio };
                }
                batch.note(index, pack * PACK, &mut findings);
                let own = own_packs(pack - packs.start, *per_pack, history.len());
                for at in (0..PACK).step_by(L::WIDTH) {
                    let [xx, yy, xy] = walls.stress::<L>(self, &batch, index, at);
                    let o = L::ZERO;
                    let elastic =
                        Split { isochoric: Symmetric([xx, yy, o, xy, o, o]), volumetric: Symmetric([o; 6]) };
                    let stress = relaxation.advance(elastic, &mut history[own.clone()], at);
                    let [xx, yy, _, xy, ..] = stress.0;
                    // Tangents now, from displacements that are still in the first cache.
                    let (u, _) = relative::<R, L, 3, 2>(&local, pack - packs.start, at);
                    let changes = rest[pack].changes(&u, at);
                    let [t, s] = rest[pack].axes::<L>(at);
                    let (t, s) = (add(t, changes[0]), add(s, changes[1]));
                    let volume = L::load(&rest[pack].volume, at);
                    let along = scale(add(scale(t, xx), scale(s, xy)), volume);
                    let across = scale(add(scale(t, xy), scale(s, yy)), volume);
                    let [[b1, b2], [c1, c2]] = &rest[pack].gradient;
                    let nodal = [
                        add(scale(along, L::load(b1, at)), scale(across, L::load(b2, at))),
                        add(scale(along, L::load(c1, at)), scale(across, L::load(c2, at))),
                    ];
                    by_cell(&nodal, &mut forces, at);
                }
                local.add::<L>(pack - packs.start, &forces);
            }
        }
        findings
    }
}
