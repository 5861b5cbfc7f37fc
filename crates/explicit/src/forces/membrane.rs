//! Membranes: triangles of constant strain in their own plane, in plane stress
//! (`pliant_mechanics::law::plane_stress`). Let f_i = t_i + Σ u_a (B_a·t_i) be the tangents, and S the stress
//! in the frame of the triangle. Then f_a = V (f_i S_ij (B_a·t_j)) with V = A₀ t₀.
//!
//! A law works on batches as for solids, in the gradient that Cholesky's factor of C makes. The stretch
//! across is found by a search over the whole batch, three or four stresses a cell; an incompressible law
//! takes one. The incompressible neo-Hookean law, the usual one of capsules, has a closed form, S = μ (I −
//! C⁻¹/det C). This form needs neither batch nor Cholesky's factor, and takes half the time.

use pliant_mechanics::Number;
use pliant_mechanics::element::Sheet;
use pliant_mechanics::law::AnyLaw;
use pliant_mechanics::law::Split;
use pliant_mechanics::law::plane_stress::{
    Across, FLAT_WALL, InPlane, MOST_SEARCHES, ThicknessSearch, kirchhoff_across,
};
use pliant_mechanics::model::{CellBlock, Solid};
use pliant_mechanics::tensor::{Symmetric, Vector, add, cast, dot, scale};

use super::batch::{Batch, PACKS, Wanted};
use super::blocks::Task;
use super::findings::Findings;
use super::one_pass::{Element, OnePass};
use super::packed::{PackedCells, by_cell, own_packs, relative};
use crate::lanes::LaneNumber;
use crate::lanes::{Lanes, PACK, Pack, load_vector};
use crate::relaxation::Relaxation;

/// Size of the last step of a search, in units in the last place of λ₃ − 1.
const SEARCHED: f64 = 64.0;

/// The triangles of a membrane.
pub(super) type Membranes<R> = OnePass<R, MembraneConstants<R>>;

/// Constants of the membranes from step to step.
pub(super) struct MembraneConstants<R> {
    law: AnyLaw,
    /// μ [Pa] of the incompressible neo-Hookean law.
    neo_hookean: Option<R>,
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

impl<R: LaneNumber> Membranes<R> {
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
        let neo_hookean = match solid.material.law {
            AnyLaw::NeoHookean(law) if solid.material.law.is_incompressible() => Some(R::of(law.shear)),
            _ => None,
        };
        let constants = MembraneConstants {
            law: solid.material.law,
            neo_hookean,
            across: solid.material.law.across(),
            rest: packed.packs().map(rest).collect(),
            cells: packed,
            relaxation: Relaxation::new(&solid.material.prony, step),
            history: 6 * solid.material.prony.slots(),
        };
        Self::of(blocks, constants)
    }
}

impl<R: LaneNumber> PackedTriangle<R> {
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

    /// The forces on all nodes but the first, from S₁₁, S₂₂ and S₁₂ and the changes of the tangents.
    #[inline(always)]
    fn forces<L: Lanes<R>>(
        &self,
        [xx, yy, xy]: [L; 3],
        changes: &[Vector<L>; 2],
        at: usize,
    ) -> [Vector<L>; 2] {
        let [t, s] = self.axes::<L>(at);
        let (t, s) = (add(t, changes[0]), add(s, changes[1]));
        let volume = L::load(&self.volume, at);
        let along = scale(add(scale(t, xx), scale(s, xy)), volume);
        let across = scale(add(scale(t, xy), scale(s, yy)), volume);
        let [[b1, b2], [c1, c2]] = &self.gradient;
        [
            add(scale(along, L::load(b1, at)), scale(across, L::load(b2, at))),
            add(scale(along, L::load(c1, at)), scale(across, L::load(c2, at))),
        ]
    }
}

/// The strains of the packs of a batch, and the stretches across.
struct Walls<R> {
    /// Parts from [`InPlane::parts`].
    plane: [[Pack<R>; 6]; PACKS],
    /// Parts from [`ThicknessSearch::parts`].
    search: [[Pack<R>; 4]; PACKS],
    /// λ₃ − 1 of the stresses in the batch.
    change: [Pack<R>; PACKS],
}

impl<R: LaneNumber> Walls<R> {
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
            batch.evaluate::<L>(&constants.law, Wanted::Isochoric, packs, 1, fibres);
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
            batch.evaluate::<L>(&constants.law, Wanted::Whole, packs, 1, fibres);
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
                    let stress = batch.stress::<L>(pack, at);
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
        let (stress, change) = (batch.stress(pack, at), L::load(&self.change[pack], at));
        self.plane::<L>(pack, at).without_stress_across(&stress, change, L::of(constants.across.coupling))
    }
}

/// C₁₁ − 1, C₂₂ − 1 and C₁₂ from tangents at rest and their changes.
#[inline(always)]
fn strain_twice<L: Number>(&[t, s]: &[Vector<L>; 2], &[u, v]: &[Vector<L>; 2]) -> [L; 3] {
    let twice = L::of(2.0);
    [
        twice.mul_add(dot(t, u), dot(u, u)),
        twice.mul_add(dot(s, v), dot(v, v)),
        dot(t, v) + dot(s, u) + dot(u, v),
    ]
}

/// Walls of the incompressible neo-Hookean law.
struct NeoHookeanWall<L> {
    /// Area now over area at rest; not a number where the wall is folded flat.
    area: L,
    /// |C − I|², with C₃₃ = 1/det C.
    strain: L,
    /// S₁₁, S₂₂ and S₁₂ [Pa].
    stress: [L; 3],
}

impl<L: Number> NeoHookeanWall<L> {
    /// From C₁₁ − 1, C₂₂ − 1 and C₁₂, with d = det C − 1: S₁₁ = μ (1 − C₂₂/(1 + d)²) = μ (d (2 + d) − (C₂₂ −
    /// 1))/(1 + d)².
    #[inline(always)]
    fn new([xx, yy, xy]: [L; 3], shear: L) -> Self {
        let d = xx.mul_add(yy, xx + yy) - xy * xy;
        let thinner = L::ONE / (L::ONE + d);
        let factor = shear * thinner * thinner;
        let grown = d.mul_add(d, d + d);
        let across = d * thinner;
        let shears = xy * xy;
        Self {
            area: (L::ONE + d).sqrt(),
            strain: xx * xx + yy * yy + across * across + shears + shears,
            stress: [(grown - yy) * factor, (grown - xx) * factor, xy * factor],
        }
    }
}

/// The stress of a law that relaxes, from the elastic one: S₁₁, S₂₂ and S₁₂.
#[inline(always)]
fn relaxed<R: LaneNumber, L: Lanes<R>>(
    relaxation: &Relaxation<R>,
    [xx, yy, xy]: [L; 3],
    history: &mut [Pack<R>],
    at: usize,
) -> [L; 3] {
    let o = L::ZERO;
    let elastic = Split { isochoric: Symmetric([xx, yy, o, xy, o, o]), volumetric: Symmetric([o; 6]) };
    let [xx, yy, _, xy, ..] = relaxation.advance(elastic, history, at).0;
    [xx, yy, xy]
}

/// Notes the deformation of a pack of the batch; walls that are folded flat count as inverted.
#[inline(always)]
fn note<R: LaneNumber>(batch: &mut Batch<R>, index: usize, pack: usize, findings: &mut Findings<R>) {
    for ratio in &mut batch.volume_ratio[index].0 {
        *ratio = if *ratio < R::of(FLAT_WALL) { R::ZERO } else { *ratio };
    }
    batch.note(index, pack * PACK, findings);
}

impl<R: LaneNumber> Element<R> for MembraneConstants<R> {
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
        let mut local = cells.places.at_work(block, moved, sums);
        for first in packs.clone().step_by(PACKS) {
            let count = PACKS.min(packs.end - first);
            if let Some(shear) = self.neo_hookean {
                for index in 0..count {
                    let pack = first + index;
                    let range = own_packs(pack - packs.start, *per_pack, history.len());
                    for at in (0..PACK).step_by(L::WIDTH) {
                        let (u, _) = relative::<R, L, 3, 2>(&local, pack - packs.start, at);
                        let changes = rest[pack].changes(&u, at);
                        let strain = strain_twice(&rest[pack].axes(at), &changes);
                        let found = NeoHookeanWall::new(strain, L::splat(shear));
                        found.area.store(&mut batch.volume_ratio[index], at);
                        found.strain.store(&mut batch.strain[index], at);
                        let stress = relaxed(relaxation, found.stress, &mut history[range.clone()], at);
                        by_cell(&rest[pack].forces(stress, &changes, at), &mut forces, at);
                    }
                    note(&mut batch, index, pack, &mut findings);
                    local.add::<L>(pack - packs.start, &forces);
                }
                continue;
            }
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
                note(&mut batch, index, pack, &mut findings);
                let range = own_packs(pack - packs.start, *per_pack, history.len());
                for at in (0..PACK).step_by(L::WIDTH) {
                    let stress = walls.stress::<L>(self, &batch, index, at);
                    let stress = relaxed(relaxation, stress, &mut history[range.clone()], at);
                    // Tangents now, from displacements that are still in the first cache.
                    let (u, _) = relative::<R, L, 3, 2>(&local, pack - packs.start, at);
                    let nodal = rest[pack].forces(stress, &rest[pack].changes(&u, at), at);
                    by_cell(&nodal, &mut forces, at);
                }
                local.add::<L>(pack - packs.start, &forces);
            }
        }
        findings
    }
}
