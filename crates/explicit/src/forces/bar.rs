//! Bars and threads: f = A P (x₂ − x₁)/l with P = E (λ − 1), which relaxes as the law does; of a thread, no
//! compression.
//!
//! A bar takes 24 bytes of displacements and 44 of its own in single precision, and some 40 operations.

use pliant_mechanics::element::Cord;
use pliant_mechanics::law::Split;
use pliant_mechanics::model::{CellBlock, Solid};
use pliant_mechanics::tensor::{Symmetric, Vector, add, cast, dot, scale};

use super::blocks::Task;
use super::findings::Findings;
use super::one_pass::{Element, OnePass};
use super::packed::{PackedCells, by_cell, own_packs, relative};
use crate::lanes::LaneNumber;
use crate::lanes::{Lanes, PACK, Pack, load_vector};
use crate::relaxation::Relaxation;

/// Bars of one solid.
pub(super) type Bars<R> = OnePass<R, BarConstants<R>>;

/// Constants of the bars from step to step.
pub(super) struct BarConstants<R> {
    cells: PackedCells<R, 2>,
    rest: Vec<PackedBar<R>>,
    tension_only: bool,
    relaxation: Relaxation<R>,
    /// Packs of history for a pack of bars.
    history: usize,
}

/// Rest geometry of a pack of bars; beyond the last bar a copy of the last one without cross section.
struct PackedBar<R> {
    /// The second node from the first [m].
    between: Vector<Pack<R>>,
    /// Length [m].
    length: Pack<R>,
    /// Length at rest less the length without force [m].
    longer: Pack<R>,
    /// E over the length without force [Pa/m].
    modulus: Pack<R>,
    /// Cross section [m²].
    area: Pack<R>,
}

impl<R: LaneNumber> Bars<R> {
    pub(super) fn new(solid: &Solid, cells: &CellBlock<2>, cord: &Cord, step: f64) -> Self {
        let (packed, blocks) = PackedCells::new(solid, cells);
        let young = solid.material.law.small_strain().young();
        let rest = |pack: usize| {
            let of = |lane: usize| &cells.rest[(pack * PACK + lane).min(cells.rest.len() - 1)];
            let between: [Vector<R>; PACK] = std::array::from_fn(|lane| cast(of(lane).between()));
            PackedBar {
                between: [0, 1, 2].map(|c| Pack::from_fn(|lane| between[lane][c])),
                length: Pack::from_fn(|lane| R::of(of(lane).length())),
                longer: Pack::from_fn(|lane| R::of((1.0 - cord.slack) * of(lane).length())),
                modulus: Pack::from_fn(|lane| R::of(young / (cord.slack * of(lane).length()))),
                area: packed.pack(pack, |cell| R::of(cells.rest[cell].area())),
            }
        };
        let constants = BarConstants {
            rest: packed.packs().map(rest).collect(),
            cells: packed,
            tension_only: cord.tension_only,
            relaxation: Relaxation::new(&solid.material.prony, step),
            history: 6 * solid.material.prony.slots(),
        };
        Self::of(blocks, constants)
    }
}

impl<R: LaneNumber> Element<R> for BarConstants<R> {
    fn slots(&self) -> [usize; 2] {
        [self.history, 0]
    }
    fn relaxation(&mut self) -> &mut Relaxation<R> {
        &mut self.relaxation
    }

    #[inline(always)]
    fn pass<L: Lanes<R>>(&self, displacement: &[Vector<R>], mut task: Task<'_, R>) -> Findings<R> {
        let BarConstants { cells, rest, tension_only, relaxation, history: per_pack } = self;
        task.copy_in(displacement);
        let Task { block, moved, forces: sums, history, .. } = task;
        sums.fill([R::ZERO; 4]);
        let mut forces = [Pack([[R::ZERO; 4]; PACK]); 2];
        let packs = cells.packs_of(block);
        let mut local = cells.places.at_work(block, moved, sums);
        for pack in packs.clone() {
            let range = own_packs(pack - packs.start, *per_pack, history.len());
            let bar = &rest[pack];
            for at in (0..PACK).step_by(L::WIDTH) {
                let ([moved], _) = relative::<R, L, 2, 1>(&local, pack - packs.start, at);
                let (between, from) = (load_vector(&bar.between, at), L::load(&bar.length, at));
                let now = add(between, moved);
                let length = dot(now, now).sqrt();
                let twice = add(add(between, between), moved);
                let longer = dot(moved, twice) / (from + length) + L::load(&bar.longer, at);
                let mut stress = longer * L::load(&bar.modulus, at);
                if *tension_only {
                    stress = stress.max(L::ZERO);
                }
                let o = L::ZERO;
                let elastic =
                    Split { isochoric: Symmetric([stress, o, o, o, o, o]), volumetric: Symmetric([o; 6]) };
                let [mut stress, ..] = relaxation.advance(elastic, &mut history[range.clone()], at).0;
                if *tension_only {
                    stress = stress.max(L::ZERO);
                }
                // A bar of no length pulls nowhere.
                let length = length.max(from * L::of(1e-6));
                by_cell(&[scale(now, stress * L::load(&bar.area, at) / length)], &mut forces, at);
            }
            local.add::<L>(pack - packs.start, &forces);
        }
        Findings::default()
    }
}
