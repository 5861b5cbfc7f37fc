//! The critical time step of a deformed state, monitored during a run. A run takes 0.9 of the critical time
//! step at rest. Unless stated otherwise, this is the one of the assembled model, 2/ω_max.
//!
//! A cell's own limit is Δt_e = 2/√(λ_e n/(ρV)) with λ_e the largest eigenvalue of its current stiffness
//! (`tangent.rs`). No assembly moves faster than its fastest cell alone (Irons and Treharne). The current
//! limit is estimated cell by cell as Δt_cr ≈ min_e max(Δt_e, L r_e). Here L is the critical time step of a
//! reference state, at first rest. The square r_e² is the stiffness of the cell in the reference state over
//! the current one. The smaller of two ratios counts: over all modes, and over plane waves n⊗y. The first
//! ratio alone misses a compression along one axis, as does any bound V M Σ|b_a|². On the glued cube it stays
//! at 0.94 where the critical time step falls to 0.83. A cell slower than the assembly thus counts with its
//! own limit, and one that the assembly holds back, with its change. Compared with the critical time step of
//! deformed bodies, the estimate is 0 to 25 % too small. With fibres that carry tension only, whose stiffness
//! jumps at rest, it is up to 4.3 % too large: `lab/validation/tests/stability.rs`.
//!
//! *When.* Every `CHECK_EVERY` steps, and at once where the least J or the largest stretch √(1 + |C − I|)
//! has changed by [`CHANGE`]. The force pass finds both at no cost. Checks that leave the parts as they are,
//! as far as can be foreseen, are passed over (`foresight.rs`).
//!
//! *Which cells.* Stiffness is computed for the first cells of two cheap orders, one by an isotropic guess of
//! their speed and one by stretch: 18 stresses and the eigenvalue problems, a pack of cells at a time, cost
//! more than steps of these cells. Averaged tets and full hexes are taken at their mean deformation with a
//! pressure of their own. Hourglass control counts with its current factor. Loads that follow the surface do
//! not count.
//!
//! *Then.* If the estimate would change the steps, Lanczos' iteration computes the critical time step of the
//! current state from many force evaluations. The current state becomes the reference. This happens once in
//! `REFERENCE_EVERY` steps at most, and always before [`OnUnstable::Stop`] ends a run. If a part of a step
//! takes more than [`KEEP`] of the limit, whole steps are cut into equal parts that take `RESERVE` at most.
//! Fewer parts are used again once they have kept this reserve for `REJOIN_AFTER` steps. Otherwise a
//! vibrating body would be cut and rejoined in each period, at phases that add energy. Velocities continue
//! (formula in `stepper.rs`), and relaxing laws take coefficients of the new length. Observers, checkpoints
//! and step counts see whole steps only.
//!
//! *Halvings.* A run that fails all the same can go back to an earlier state and
//! [halve its steps](State::halve_steps). Whole steps are then cut into parts of at most ½, ¼ or ⅛ of their
//! length for good.
//!
//! The state holds all that monitoring needs to resume ([`Stability`] and [`State::reference`]). Stiffnesses
//! in the reference state are computed from it again, so a resumed run has the same bits. A new reference
//! allocates memory; nothing else in a step does.

use pliant_mechanics::Number;
use pliant_mechanics::law::plane_stress::InPlane;
use pliant_mechanics::model::{Cells, Model, Solid, with_cells};
use pliant_mechanics::tensor::{Symmetric, Tensor, Vector, add, cast, dot, sub};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::critical_step::{limit_alone, scaled_bound};
use crate::damping_force::{damped, undamped};
use crate::lanes::LaneNumber;
use crate::lanes::{LaneWork, Lanes, PACK, Pack, Processor, load_symmetric, load_tensor};
pub use crate::stability_record::{Stability, StepLimit};
use crate::state::State;
use crate::substeps::substeps;
pub use crate::substeps::{KEEP, MOST_HALVINGS};
use crate::tangent::{Stiffness, gradient_square, stiffness};

/// Steps between two checks of the limit.
pub(crate) const CHECK_EVERY: u64 = 50;
/// The limit is checked earlier where the least J or the largest stretch has changed by this factor.
pub const CHANGE: f64 = 1.1;
/// Steps between two critical time steps, except where a run would stop.
pub(crate) const REFERENCE_EVERY: u64 = 1000;
/// One in this many cells is checked closely, for each of the two orders …
const SHARE: usize = 256;
/// … rounded up to a multiple of this, so that both orders fill packs.
const LEAST: usize = PACK / 2;

/// Response of a run to a limit below its step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum OnUnstable {
    /// Cut the steps into equal parts until the limit recovers.
    #[default]
    Substep,
    /// End with an error.
    Stop,
    /// Continue at the same step; the smallest limit is reported.
    Report,
}

/// Watches the largest stable step of a model. Holds constants and scratch, and what follows from the
/// reference.
pub struct Monitor {
    on_unstable: OnUnstable,
    solids: Vec<Watch>,
    /// The reference of the state that the watch is made for.
    reference: Option<(f64, u64)>,
}

/// The cells of a solid under watch.
struct Watch {
    /// L [s].
    limit: f64,
    /// Stiffness of each cell in the reference state, once it was needed.
    reference: Vec<Option<Stiffness>>,
    /// λ of hourglass control alone at rest, over V [Pa/m²].
    hourglass: Vec<f64>,
    /// Σ B_a ⊗ B_a [1/m²] of packs of cells, as [`gradient_square_of`]: found once, a check would spend much
    /// of its time there.
    square: Vec<Symmetric<Pack<f64>>>,
    /// Weight 1/(|G| (λ+2μ) max(Δt_e, L)²), with the element bound Δt_e at rest. It brings the guesses of all
    /// cells to one scale.
    weight: Vec<f64>,
    /// The cells with their [ranks](ranked) in two orders; once they are picked, those that stand first come
    /// first.
    order: [Vec<u64>; 2],
    /// The cells that are checked closely, in the first order and then in the second, with their limits [s]
    /// and references.
    picked: Vec<u32>,
    found: Vec<(f64, Stiffness)>,
}

impl Monitor {
    /// A monitor of a model whose limit at rest is `limit` [s].
    pub fn new(model: &Model, limit: f64, on_unstable: OnUnstable) -> Self {
        let limit = undamped(limit, model.stiffness_damping);
        let solids = model.solids.iter().map(|solid| Watch::new(model, solid, limit)).collect();
        Self { on_unstable, solids, reference: None }
    }

    /// Returns the response to a limit below the step.
    pub fn on_unstable(&self) -> OnUnstable {
        self.on_unstable
    }

    /// Adopts the reference of a state, if it differs from the present one.
    pub(crate) fn refer_to<R>(&mut self, state: &State<R>) {
        let reference = state.stability.reference;
        if let (true, Some((limit, _))) = (self.reference != reference, reference) {
            for watch in &mut self.solids {
                watch.limit = limit;
                watch.reference.fill(None);
            }
        }
        self.reference = reference;
    }

    /// True if an estimate needs the critical time step, because whole steps exceed the limit. Except for
    /// [`OnUnstable::Stop`], the last critical time step has to be long past.
    pub(crate) fn doubts<R>(&self, state: &State<R>, limit: f64, step: f64, now: u32) -> bool {
        let rested = state
            .stability
            .reference
            .is_none_or(|(_, steps)| state.steps >= steps.saturating_add(REFERENCE_EVERY));
        match self.on_unstable {
            OnUnstable::Substep => rested && substeps(step, limit, now) != Some(1),
            OnUnstable::Stop => KEEP * limit < step,
            OnUnstable::Report => rested && KEEP * limit < step,
        }
    }

    /// The limit of a deformed state: the estimate [s], the solid and the cell that set it; `None` without
    /// cells or where no cell's stiffness is a number. `reference` is the state whose critical time step is
    /// known.
    pub fn limit<R: LaneNumber>(
        &mut self,
        model: &Model,
        displacement: &[Vector<R>],
        reference: &[Vector<R>],
    ) -> Option<(f64, usize, usize)> {
        let solids = self.solids.iter_mut().zip(&model.solids).enumerate();
        solids
            .filter_map(|(index, (watch, solid))| {
                watch.rank(solid, displacement);
                watch.pick();
                let found = watch.smallest(model, solid, displacement, reference);
                found.map(|(limit, cell)| (damped(limit, model.stiffness_damping), index, cell))
            })
            .min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Returns the limit with every cell checked closely, as a measure of the cells that
    /// [`limit`](Self::limit) leaves out.
    pub fn limit_of_all<R: LaneNumber>(
        &self,
        model: &Model,
        displacement: &[Vector<R>],
        reference: &[Vector<R>],
    ) -> Option<(f64, usize, usize)> {
        let solids = self.solids.iter().zip(&model.solids).enumerate();
        solids
            .filter_map(|(index, (watch, solid))| {
                let numbers: Vec<u32> = (0..solid.cells.len() as u32).collect();
                let least = |cells: &[u32]| {
                    let found = watch.check(model, solid, displacement, reference, cells);
                    smallest(&found, cells)
                };
                let least = numbers.par_chunks(PACK).map(least).reduce(|| None, smaller);
                least.map(|(limit, cell)| (damped(limit, model.stiffness_damping), index, cell))
            })
            .min_by(|a, b| a.0.total_cmp(&b.0))
    }
}

/// A rank and its cell as one number, which is less for a larger rank; of equal ranks, in single precision,
/// for a lower cell. So the choice does not depend on what came before.
fn ranked(rank: f64, cell: u32) -> u64 {
    let bits = (rank as f32).to_bits();
    // Of negative numbers all bits count down, of others the sign stands above.
    let grown = if bits >> 31 == 1 { !bits } else { bits | 1 << 31 };
    u64::from(!grown) << 32 | u64::from(cell)
}

impl Watch {
    fn new(model: &Model, solid: &Solid, limit: f64) -> Self {
        let count = solid.cells.len();
        let modulus = solid.longitudinal_modulus();
        let square: Vec<Symmetric<f64>> = (0..count).map(|cell| gradient_square_of(solid, cell)).collect();
        let weight = |cell: usize| {
            let slowest = scaled_bound(model, solid, cell).max(limit);
            1.0 / (product_square(&square[cell], &Symmetric::IDENTITY).sqrt() * modulus * slowest * slowest)
        };
        Self {
            limit,
            reference: vec![None; count],
            hourglass: (0..count).map(|cell| hourglass_modulus(solid, cell)).collect(),
            weight: (0..count).map(weight).collect(),
            square: square.chunks(PACK).map(packed).collect(),
            order: [vec![0; count], vec![0; count]],
            picked: vec![0; 2 * picked(count)],
            found: vec![(0.0, Stiffness::default()); 2 * picked(count)],
        }
    }

    /// Σ B_a ⊗ B_a [1/m²] of a cell.
    fn square(&self, cell: usize) -> Symmetric<f64> {
        let mut square = Symmetric::ZERO;
        for (entry, pack) in square.0.iter_mut().zip(&self.square[cell / PACK].0) {
            *entry = pack.0[cell % PACK];
        }
        square
    }

    /// Finds both ranks of every cell: the squared speed by an isotropic guess, and the squared stretch.
    fn rank<R: LaneNumber>(&mut self, solid: &Solid, displacement: &[Vector<R>]) {
        let rest = solid.longitudinal_modulus();
        let bulk = match &solid.cells {
            // In plane stress the volume hardly counts, in a bar not at all.
            Cells::Membrane(..) | Cells::Bar(..) => 0.0,
            _ => solid.material.law.small_strain().bulk,
        };
        let processor = Processor::detect();
        let [speeds, stretches] = &mut self.order;
        let packs = speeds.par_chunks_mut(PACK).zip(stretches.par_chunks_mut(PACK));
        let packs = packs.zip(self.weight.par_chunks(PACK)).zip(&self.square);
        packs.enumerate().with_min_len(16).for_each(|(pack, (((speeds, stretches), weight), square))| {
            let first = pack * PACK;
            processor.run(Ranks {
                solid,
                displacement,
                first,
                square,
                weight,
                bulk,
                rest,
                speeds,
                stretches,
            });
        });
    }

    /// Picks the cells that stand first in each order.
    fn pick(&mut self) {
        let half = self.picked.len() / 2;
        let pick = |order: &mut Vec<u64>, picked: &mut [u32]| {
            if half < order.len() {
                order.select_nth_unstable(half);
            }
            picked.iter_mut().zip(order).for_each(|(picked, entry)| *picked = *entry as u32);
        };
        let [speeds, stretches] = &mut self.order;
        let (before, after) = self.picked.split_at_mut(half);
        rayon::join(|| pick(speeds, before), || pick(stretches, after));
    }

    /// The smallest limit [s] of the cells that were picked, and its cell.
    fn smallest<R: LaneNumber>(
        &mut self,
        model: &Model,
        solid: &Solid,
        displacement: &[Vector<R>],
        reference: &[Vector<R>],
    ) -> Option<(f64, usize)> {
        let mut found = std::mem::take(&mut self.found);
        let chunks = found.par_chunks_mut(PACK).zip(self.picked.par_chunks(PACK));
        chunks.for_each(|(found, cells)| {
            found.copy_from_slice(&self.check(model, solid, displacement, reference, cells)[..found.len()]);
        });
        for (&(_, before), &cell) in found.iter().zip(&self.picked) {
            self.reference[cell as usize] = Some(before);
        }
        let least = smallest(&found, &self.picked);
        self.found = found;
        least
    }

    /// The limits [s] that some cells set, at most [`PACK`], and their stiffnesses in the reference state.
    fn check<R: LaneNumber>(
        &self,
        model: &Model,
        solid: &Solid,
        displacement: &[Vector<R>],
        reference: &[Vector<R>],
        cells: &[u32],
    ) -> [(f64, Stiffness); PACK] {
        let in_state = |displacement: &[Vector<R>]| {
            let state = |cell: usize| (displacement_gradient(solid, cell, displacement), self.square(cell));
            let mut found = stiffness(solid, cells, state);
            for (stiffness, &cell) in found.iter_mut().zip(cells) {
                stiffness.mode = stiffness.mode.max(self.hourglass[cell as usize] * stiffness.hourglass);
            }
            found
        };
        let now = in_state(displacement);
        let known = cells.iter().all(|&cell| self.reference[cell as usize].is_some());
        let found_before = if known { now } else { in_state(reference) };
        let mut limits = [(f64::NAN, Stiffness::default()); PACK];
        for (lane, &cell) in cells.iter().enumerate() {
            let before = self.reference[cell as usize].unwrap_or(found_before[lane]);
            let [mode, wave] = [before.mode / now[lane].mode, before.wave / now[lane].wave].map(f64::sqrt);
            let alone = limit_alone(model, solid, cell as usize, now[lane].mode);
            limits[lane] = (alone.max(self.limit * mode.min(wave)), before);
        }
        limits
    }
}

/// The smallest limit [s] of some cells, and its cell.
fn smallest(found: &[(f64, Stiffness)], cells: &[u32]) -> Option<(f64, usize)> {
    let limits = found.iter().zip(cells).map(|(&(limit, _), &cell)| (limit, cell as usize));
    limits.map(finite).fold(None, smaller)
}

/// The limit [s] of a cell alone in a deformed state, Δt_e above: no assembly is unstable at the smallest
/// one. Displacements [m], one per node.
pub fn cell_limit<R: LaneNumber>(
    model: &Model,
    solid: usize,
    cell: usize,
    displacement: &[Vector<R>],
) -> f64 {
    limits_alone(model, &model.solids[solid], &[cell as u32], displacement)[0]
}

/// Returns the limit [s] of each cell of a solid on its own.
pub fn cell_limits<R: LaneNumber>(model: &Model, solid: usize, displacement: &[Vector<R>]) -> Vec<f64> {
    let solid = &model.solids[solid];
    let cells: Vec<u32> = (0..solid.cells.len() as u32).collect();
    let of = |cells: &[u32]| {
        let limits = limits_alone(model, solid, cells, displacement);
        limits.into_iter().take(cells.len())
    };
    cells.par_chunks(PACK).flat_map_iter(of).collect()
}

/// Returns the limit [s] of each cell of a pack on its own.
fn limits_alone<R: LaneNumber>(
    model: &Model,
    solid: &Solid,
    cells: &[u32],
    displacement: &[Vector<R>],
) -> [f64; PACK] {
    let state =
        |cell: usize| (displacement_gradient(solid, cell, displacement), gradient_square_of(solid, cell));
    let found = stiffness(solid, cells, state);
    let mut limits = [f64::NAN; PACK];
    for (limit, (&cell, stiffness)) in limits.iter_mut().zip(cells.iter().zip(&found)) {
        let cell = cell as usize;
        let hourglass = hourglass_modulus(solid, cell) * stiffness.hourglass;
        let alone = limit_alone(model, solid, cell, stiffness.mode.max(hourglass));
        *limit = damped(alone, model.stiffness_damping);
    }
    limits
}

/// Returns the number of cells that are checked closely for each order.
fn picked(count: usize) -> usize {
    (count / SHARE).max(1).next_multiple_of(LEAST).min(count)
}

/// A limit that is a number, with its cell.
fn finite((limit, cell): (f64, usize)) -> Option<(f64, usize)> {
    limit.is_finite().then_some((limit, cell))
}

/// Returns the smaller limit; of equal limits, the one with the lower cell number.
fn smaller(a: Option<(f64, usize)>, b: Option<(f64, usize)>) -> Option<(f64, usize)> {
    match (a, b) {
        (Some(x), Some(y)) => Some(if (y.0, y.1) < (x.0, x.1) { y } else { x }),
        (found, None) | (None, found) => found,
    }
}

/// c μ ΣB² [Pa/m²] at rest, see [`critical_step::cell_bound`](crate::critical_step::cell_bound).
fn hourglass_modulus(solid: &Solid, cell: usize) -> f64 {
    solid.cells.hourglass_modulus(cell) * solid.cells.gradient_square_sum(cell)
}

/// Σ B_a ⊗ B_a [1/m²]; of a membrane in the frame of the triangle.
fn gradient_square_of(solid: &Solid, cell: usize) -> Symmetric<f64> {
    let square = with_cells!(&solid.cells, block => gradient_square(&block.rest[cell].gradient));
    match &solid.cells {
        Cells::Membrane(_, sheets) => {
            let [t, s] = sheets[cell].axes;
            let mixed = dot(t, square.apply(s));
            Symmetric([square.quadratic(t), square.quadratic(s), 0.0, mixed, 0.0, 0.0])
        }
        _ => square,
    }
}

/// ∂u/∂X, the mean over the cell; of a membrane in the frame of the triangle, thinned as if it kept its
/// volume.
#[inline(always)]
fn displacement_gradient<R: LaneNumber>(
    solid: &Solid,
    cell: usize,
    displacement: &[Vector<R>],
) -> Tensor<f64> {
    // Four columns at once, of which the last has no meaning. Behind the gradient of each node but the last
    // there is another one to read, so the last is the origin.
    let mut rows = [[0.0; 4]; 3];
    with_cells!(&solid.cells, block => {
        let ([nodes @ .., last], gradient) = (&block.nodes[cell], block.rest[cell].gradient.as_flattened());
        let origin: Vector<f64> = cast(displacement[*last as usize]);
        for (&node, b) in nodes.iter().zip(gradient.windows(4).step_by(3)) {
            for (row, u) in rows.iter_mut().zip(sub(cast(displacement[node as usize]), origin)) {
                row.iter_mut().zip(b).for_each(|(entry, b)| *entry += u * b);
            }
        }
    });
    let [[xx, xy, xz, _], [yx, yy, yz, _], [zx, zy, zz, _]] = rows;
    let h = Tensor([[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]]);
    let Cells::Membrane(_, sheets) = &solid.cells else { return h };
    let axes = sheets[cell].axes;
    let plane = InPlane::from_changes(&axes, &axes.map(|axis| h.apply(axis)));
    plane.displacement_gradient(plane.incompressible())
}

/// The largest squared stretch of the fibres of a cell with a displacement gradient; `None` without fibres.
#[inline(always)]
fn largest_fibre_stretch(solid: &Solid, cell: usize, h: &Tensor<f64>) -> Option<f64> {
    let stretch = |&fibre: &Vector<f64>| {
        let deformed = add(fibre, h.apply(fibre));
        dot(deformed, deformed)
    };
    solid.law_fibres(cell).iter().map(stretch).reduce(f64::max)
}

/// Symmetric tensors side by side; zero beyond the last.
fn packed(tensors: &[Symmetric<f64>]) -> Symmetric<Pack<f64>> {
    let mut packed = Symmetric([Pack::ZERO; 6]);
    for (lane, tensor) in tensors.iter().enumerate() {
        for (pack, &entry) in packed.0.iter_mut().zip(&tensor.0) {
            pack.0[lane] = entry;
        }
    }
    packed
}

/// A pack of cells, to be ranked.
struct Ranks<'a, R> {
    solid: &'a Solid,
    displacement: &'a [Vector<R>],
    /// The first of the cells.
    first: usize,
    /// Σ B_a ⊗ B_a [1/m²].
    square: &'a Symmetric<Pack<f64>>,
    /// Weights that bring guesses to one scale.
    weight: &'a [f64],
    /// κ and λ + 2μ at rest [Pa].
    bulk: f64,
    rest: f64,
    /// Ranks by the squared speed of an isotropic guess, and by the squared stretch.
    speeds: &'a mut [u64],
    stretches: &'a mut [u64],
}

impl<R: LaneNumber> LaneWork<f64> for Ranks<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes<f64>>(self) {
        let (mut gradient, mut along) = (Tensor([[Pack::ZERO; 3]; 3]), [None; PACK]);
        for (lane, along) in along[..self.speeds.len()].iter_mut().enumerate() {
            let h = displacement_gradient(self.solid, self.first + lane, self.displacement);
            *along = largest_fibre_stretch(self.solid, self.first + lane, &h);
            for (to, entry) in gradient.0.as_flattened_mut().iter_mut().zip(h.0.as_flattened()) {
                to.0[lane] = *entry;
            }
        }
        let (mut speed, mut stretch) = (Pack::ZERO, Pack::ZERO);
        let (bulk, rest) = (L::of(self.bulk), L::of(self.rest));
        for at in (0..PACK).step_by(L::WIDTH) {
            let (h, square): (Tensor<L>, _) = (load_tensor(&gradient, at), load_symmetric(self.square, at));
            let c = Symmetric::green_lagrange_twice(&h) + Symmetric::IDENTITY;
            let change = h.trace() + h.second_invariant() + h.determinant();
            let j = L::ONE + change;
            let mean = c.trace() * L::of(1.0 / 3.0);
            // κ J² + |p| J, and the rest of λ + 2μ grown with the mean squared stretch (spec of the current
            // bound).
            let modulus = bulk * j * (j + change.max(-change)) + (rest - bulk) * mean;
            // |G C⁻¹| over |G|: how much closer the deformed faces lie, the closest pair counting most.
            let closeness = product_square(&square, &(c.cofactor() * (L::ONE / (j * j)))).sqrt();
            (closeness * modulus).store(&mut speed, at);
            mean.store(&mut stretch, at);
        }
        for (lane, (speeds, stretches)) in self.speeds.iter_mut().zip(self.stretches).enumerate() {
            let cell = (self.first + lane) as u32;
            *speeds = ranked(speed.0[lane] * self.weight[lane], cell);
            *stretches = ranked(along[lane].unwrap_or(stretch.0[lane]), cell);
        }
    }
}

/// tr (A B A B).
#[inline(always)]
fn product_square<N: Number>(a: &Symmetric<N>, b: &Symmetric<N>) -> N {
    let product = a.full().times_symmetric(b);
    let transposed = product.transpose();
    dot(product.0[0], transposed.0[0])
        + dot(product.0[1], transposed.0[1])
        + dot(product.0[2], transposed.0[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn larger_ranks_come_first_and_lower_cells_of_equal_ones() {
        // 1 + 1e-9 is 1 in single precision.
        let ranks =
            [f64::NAN, f64::INFINITY, 2e9, 1.0 + 1e-6, 1.0, 1.0 + 1e-9, 1e-30, 0.0, -0.0, -1e-30, -1.0];
        let order: Vec<u64> = (0..).zip(ranks).map(|(cell, rank)| ranked(rank, cell)).collect();
        assert!(order.is_sorted(), "{order:x?}");
        assert!((0..).zip(&order).all(|(cell, &entry)| entry as u32 == cell));
    }
}
