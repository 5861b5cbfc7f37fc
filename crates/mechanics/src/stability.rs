//! The largest stable step of a deformed state, watched during a run.
//!
//! A cell's own limit is 2/√(λ_e n/(ρV)) with λ_e the largest eigenvalue of its current stiffness
//! ([`tangent`](crate::tangent)); no cell of an assembly moves faster than its fastest cell alone (Irons and Treharne).
//! The limit now is that at rest, L (the true limit), brought down cell by cell:
//! Δt_cr ≈ min_e max(Δt_e⁰, L) Δt_e/Δt_e⁰, with Δt_e⁰ that of the cell at rest. So a cell that is slower than the
//! assembly counts with its own limit, and a sliver, which the assembly holds back, with its change.
//! This is never above L times the smallest Δt_e over the smallest Δt_e⁰.
//!
//! Eigenvalues are found for the cells that stand first in two cheap orders, one by an isotropic guess of their limit
//! and one by stretch: 18 stresses and an eigenvalue problem a cell would cost as much as 30 steps for all.
//! Averaged tets and full hexes are taken at their mean deformation with a pressure of their own. Hourglass control
//! does not change with deformation. Loads that follow the surface do not count.

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Real;
use crate::critical_step::rest_limit;
use crate::forces::Deformed;
use crate::model::{Model, Solid, with_cells};
use crate::tangent::{gradient_square, stiffest_mode};
use crate::tensor::{Symmetric, Tensor, Vector, cast, dot, sub};

/// Steps between two looks at the limit.
pub const CHECK_EVERY: u64 = 50;
/// A look is taken earlier where the least J or the largest stretch has changed by this factor.
pub const CHANGE: f64 = 1.1;
/// Substeps are chosen so that they reach this part of the limit at the most …
pub const RESERVE: f64 = 0.95;
/// … and kept up to this part: the estimate was found up to 0.5 % above the true limit of deformed blocks, and the limit
/// may fall until the next look.
pub const KEEP: f64 = 0.98;
/// The most substeps a step is cut into.
pub const MOST_SUBSTEPS: u32 = 100;
/// One in this many cells is looked at closely, for each of the two orders …
const SHARE: usize = 64;
/// … and at least this many.
const LEAST: usize = 16;

/// What a run does when the limit falls below its step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum OnUnstable {
    /// Cut the steps into equal parts until the limit recovers.
    #[default]
    Substep,
    /// End with an error.
    Stop,
    /// Go on at the same step; the smallest limit is reported.
    Report,
}

/// How the steps of a run are cut, and what was seen of the limit. Part of the state, so that a copy of it goes on alike.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stability {
    /// Parts of the step under way, or of the last one.
    pub substeps: u32,
    /// Parts of the step under way already done; 0 between steps.
    pub done: u32,
    /// Looks taken at the limit.
    pub checks: u64,
    /// The last look.
    pub last: Option<Look>,
    /// The look with the smallest limit.
    pub smallest: Option<Look>,
    /// Steps at the start of which the limit was known to be below the whole step.
    pub steps_below: u64,
    /// How often whole steps were given up for substeps.
    pub cuts: u32,
    /// Time [s] of the first cut.
    pub first_cut: Option<f64>,
    /// Time [s] at which the last step that was cut began.
    pub last_cut: Option<f64>,
    /// The most parts of a step.
    pub most_substeps: u32,
    /// Substeps beyond one a step, in all.
    pub extra_steps: u64,
    /// Deformation at the last look.
    pub(crate) deformed: Deformed,
    /// Steps done at the last look.
    pub(crate) looked_at: u64,
}

impl Default for Stability {
    fn default() -> Self {
        Self {
            substeps: 1,
            done: 0,
            checks: 0,
            last: None,
            smallest: None,
            steps_below: 0,
            cuts: 0,
            first_cut: None,
            last_cut: None,
            most_substeps: 1,
            extra_steps: 0,
            deformed: Deformed::default(),
            looked_at: 0,
        }
    }
}

impl Stability {
    /// Records into how many parts the step that begins now is cut.
    pub(crate) fn note_substeps(&mut self, substeps: u32, time: f64) {
        if substeps > 1 {
            self.cuts += u32::from(self.substeps == 1);
            self.first_cut.get_or_insert(time);
            self.last_cut = Some(time);
            self.most_substeps = self.most_substeps.max(substeps);
            self.extra_steps += u64::from(substeps) - 1;
        }
    }
}

/// The parts into which a step is cut, from how many there are now and the limit; `None` if more than
/// [`MOST_SUBSTEPS`] are needed. Fewer than now only where they keep the reserve, so that a limit that hovers at a
/// number of parts does not make it change all the time.
pub(crate) fn substeps(step: f64, limit: f64, now: u32) -> Option<u32> {
    let enough = (step / (RESERVE * limit)).ceil();
    if enough > f64::from(MOST_SUBSTEPS) || enough.is_nan() {
        return None;
    }
    let enough = (enough as u32).max(1);
    let stable = step / f64::from(now) <= KEEP * limit;
    Some(if stable { now.min(enough) } else { enough })
}

/// The limit at an instant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Look {
    /// Time [s].
    pub time: f64,
    /// Estimate of the largest stable step [s].
    pub limit: f64,
    /// The solid of the cell that sets it.
    pub solid: usize,
    /// The cell in that solid.
    pub cell: usize,
}

/// Watches the largest stable step of a model. Holds constants and scratch only.
pub struct Monitor {
    on_unstable: OnUnstable,
    solids: Vec<Watch>,
}

/// The cells of a solid under watch.
struct Watch {
    /// λ of K/V at rest [Pa/m²], hourglass control included.
    at_rest: Vec<f64>,
    /// max(Δt_e⁰, L) [s].
    limit: Vec<f64>,
    /// λ of hourglass control alone, over V [Pa/m²].
    hourglass: Vec<f64>,
    /// What stands first in the two orders.
    rank: Vec<[f64; 2]>,
    order: [Vec<u32>; 2],
}

impl Monitor {
    /// A monitor of a model whose limit at rest is `limit` [s].
    pub fn new(model: &Model, limit: f64, on_unstable: OnUnstable) -> Self {
        let watch = |solid: &Solid| {
            let count = solid.cells.len();
            let hourglass: Vec<f64> = (0..count).map(|cell| hourglass_modulus(solid, cell)).collect();
            let at_rest: Vec<f64> = (0..count)
                .into_par_iter()
                .map(|cell| stiffest(solid, cell, &Tensor::ZERO).max(hourglass[cell]))
                .collect();
            let limit_of = |cell: usize| rest_limit(model, solid, cell, at_rest[cell]).max(limit);
            Watch {
                limit: (0..count).map(limit_of).collect(),
                rank: vec![[0.0; 2]; count],
                order: [(0..count as u32).collect(), (0..count as u32).collect()],
                at_rest,
                hourglass,
            }
        };
        Self { on_unstable, solids: model.solids.iter().map(watch).collect() }
    }

    /// What to do when the limit falls below the step.
    pub fn on_unstable(&self) -> OnUnstable {
        self.on_unstable
    }

    /// The limit of a deformed state: the estimate [s], the solid and the cell that set it; `None` without cells or
    /// where no cell's stiffness is a number.
    pub fn limit<R: Real>(
        &mut self,
        model: &Model,
        displacement: &[Vector<R>],
    ) -> Option<(f64, usize, usize)> {
        let solids = self.solids.iter_mut().zip(&model.solids).enumerate();
        solids
            .filter_map(|(index, (watch, solid))| {
                watch.rank(solid, displacement);
                watch.pick();
                let found = [0, 1].map(|by| watch.smallest(solid, displacement, watch.first(by)));
                smaller(found[0], found[1]).map(|(limit, cell)| (limit, index, cell))
            })
            .min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// The same from every cell, as a measure of what [`limit`](Self::limit) leaves out.
    pub fn limit_of_all<R: Real>(
        &self,
        model: &Model,
        displacement: &[Vector<R>],
    ) -> Option<(f64, usize, usize)> {
        let solids = self.solids.iter().zip(&model.solids).enumerate();
        solids
            .filter_map(|(index, (watch, solid))| {
                let all: Vec<u32> = (0..solid.cells.len() as u32).collect();
                watch.smallest(solid, displacement, &all).map(|(limit, cell)| (limit, index, cell))
            })
            .min_by(|a, b| a.0.total_cmp(&b.0))
    }
}

impl Watch {
    /// Finds both ranks of every cell: the squared speed by an isotropic guess, and the squared stretch.
    fn rank<R: Real>(&mut self, solid: &Solid, displacement: &[Vector<R>]) {
        let bulk = solid.material.law.small_strain().bulk;
        let rest = solid.material.law.longitudinal_modulus();
        let limit = &self.limit;
        self.rank.par_iter_mut().enumerate().with_min_len(256).for_each(|(cell, rank)| {
            let (h, square) = deformation(solid, cell, displacement);
            let strain = Symmetric::green_lagrange_twice(&h);
            let c = strain + Symmetric::IDENTITY;
            let j = 1.0 + h.trace() + h.second_invariant() + h.determinant();
            let stretch = match solid.fibre.get(cell) {
                Some(&fibre) => c.quadratic(fibre),
                None => c.trace() / 3.0,
            };
            // κ J² + |p| J, and the rest of λ + 2μ grown with the mean squared stretch (spec of the current bound).
            let modulus = bulk * j * (j + (j - 1.0).abs()) + (rest - bulk) * c.trace() / 3.0;
            let inverse = c.cofactor() * (1.0 / (j * j));
            let current = contraction(&square, &inverse) / square.trace();
            *rank = [current * modulus / (rest * limit[cell] * limit[cell]), stretch];
        });
    }

    /// How many cells are looked at closely for each order.
    fn picked(&self) -> usize {
        let count = self.rank.len();
        (count / SHARE).max(LEAST).min(count)
    }

    /// The cells that stand first in an order.
    fn first(&self, by: usize) -> &[u32] {
        &self.order[by][..self.picked()]
    }

    /// Brings those cells to the front of each order.
    fn pick(&mut self) {
        let (rank, picked) = (&self.rank, self.picked());
        for (by, order) in self.order.iter_mut().enumerate() {
            // Cells of equal rank go by number, so that the choice does not depend on what came before.
            let first =
                |a: &u32, b: &u32| rank[*b as usize][by].total_cmp(&rank[*a as usize][by]).then(a.cmp(b));
            if picked < order.len() {
                order.select_nth_unstable_by(picked, first);
            }
        }
    }

    /// The smallest limit [s] of some cells, and its cell.
    fn smallest<R: Real>(
        &self,
        solid: &Solid,
        displacement: &[Vector<R>],
        cells: &[u32],
    ) -> Option<(f64, usize)> {
        let limit = |&cell: &u32| {
            let cell = cell as usize;
            let (h, _) = deformation(solid, cell, displacement);
            let stiffness = stiffest(solid, cell, &h).max(self.hourglass[cell]);
            let limit = self.limit[cell] * (self.at_rest[cell] / stiffness).sqrt();
            limit.is_finite().then_some((limit, cell))
        };
        cells.par_iter().with_min_len(16).map(limit).reduce(|| None, smaller)
    }
}

/// The smaller limit; of equal ones that of the first cell.
fn smaller(a: Option<(f64, usize)>, b: Option<(f64, usize)>) -> Option<(f64, usize)> {
    match (a, b) {
        (Some(x), Some(y)) => Some(if (y.0, y.1) < (x.0, x.1) { y } else { x }),
        (found, None) | (None, found) => found,
    }
}

fn stiffest(solid: &Solid, cell: usize, h: &Tensor<f64>) -> f64 {
    let square = with_cells!(&solid.cells, block => gradient_square(&block.rest[cell].gradient));
    let fibre = solid.fibre.get(cell).copied().unwrap_or_default();
    stiffest_mode(&solid.material.law, fibre, h, &square)
}

/// c μ ΣB² [Pa/m²], see [`critical_step::cell_bound`](crate::critical_step::cell_bound).
fn hourglass_modulus(solid: &Solid, cell: usize) -> f64 {
    solid.cells.hourglass_modulus(cell) * solid.cells.gradient_square_sum(cell)
}

/// ∂u/∂X (mean over the cell) and Σ B_a ⊗ B_a.
fn deformation<R: Real>(
    solid: &Solid,
    cell: usize,
    displacement: &[Vector<R>],
) -> (Tensor<f64>, Symmetric<f64>) {
    with_cells!(&solid.cells, block => {
        let (nodes, gradient) = (&block.nodes[cell], &block.rest[cell].gradient);
        let origin: Vector<f64> = cast(displacement[nodes[0] as usize]);
        let mut h = Tensor::ZERO;
        for (&node, &b) in nodes.iter().zip(gradient).skip(1) {
            h.add_outer(sub(cast(displacement[node as usize]), origin), b);
        }
        (h, gradient_square(gradient))
    })
}

/// A : B.
fn contraction(a: &Symmetric<f64>, b: &Symmetric<f64>) -> f64 {
    let ([xx, yy, zz, xy, yz, xz], b) = (a.0, b.0);
    dot([xx, yy, zz], [b[0], b[1], b[2]]) + 2.0 * dot([xy, yz, xz], [b[3], b[4], b[5]])
}
