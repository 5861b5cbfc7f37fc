//! Internal forces of solids: f_a = V F S B_a per cell, plus hourglass control, in first Piola–Kirchhoff form without
//! Voigt matrices. Each cell writes its nodal contributions into slots of its own; nodes gather them in a fixed order,
//! so that the number of threads never changes a bit.
//!
//! Cost of a tet with the split neo-Hookean law: about 260 operations; 96 B of constants, 48 B gathered, 48 B written
//! in double precision. Runs on the current rayon pool.

mod averaged;
mod batch;
mod full_hex;
mod plain;
#[cfg(test)]
mod tests;

use averaged::AveragedTets;
pub(crate) use batch::pressure;
use full_hex::FullHexes;
use plain::SolidForces;

use serde::{Deserialize, Serialize};

use crate::Real;
use crate::model::{Cells, Model, Solid};
use crate::prony::Prony;
use crate::state::History;
use crate::tensor::{Symmetric, Tensor, Vector, add, scale, sub};

/// Cells per parallel task; the sums of a task are added up in order.
const CHUNK: usize = 256;

/// Points whose stress is asked of the law at once: few enough for the first cache. Divides [`CHUNK`].
const BATCH: usize = 32;

/// What a pass over some cells found.
#[derive(Clone, Copy, Debug, Default)]
pub struct Findings {
    /// Energy held by hourglass patterns [J].
    pub hourglass: f64,
    /// The first cell of the pass with det F ≤ 0 or not a number, and its det F.
    pub inverted: Option<(usize, f64)>,
    /// How far the cells are deformed.
    pub(crate) deformed: Deformed,
}

/// The extremes of deformation over some cells.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Deformed {
    /// The least det F.
    least_volume_ratio: f64,
    /// The largest |C − I|².
    largest_strain: f64,
}

impl Default for Deformed {
    fn default() -> Self {
        Self { least_volume_ratio: 1.0, largest_strain: 0.0 }
    }
}

impl Deformed {
    fn merge(self, other: Self) -> Self {
        Self {
            least_volume_ratio: self.least_volume_ratio.min(other.least_volume_ratio),
            largest_strain: self.largest_strain.max(other.largest_strain),
        }
    }

    /// Whether the least J or the largest stretch, taken as √(1 + |C − I|), differ by more than a factor.
    pub(crate) fn differs(&self, other: &Self, factor: f64) -> bool {
        let stretch = |d: &Self| (1.0 + d.largest_strain.sqrt()).sqrt();
        let apart = |a: f64, b: f64| a > factor * b || b > factor * a;
        apart(self.least_volume_ratio, other.least_volume_ratio) || apart(stretch(self), stretch(other))
    }
}

/// What an evaluation of all cells found.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Found {
    /// Energy held by hourglass patterns [J].
    pub hourglass: f64,
    /// The first inverted cell as (solid, cell, det F).
    pub inverted: Option<(usize, usize, f64)>,
    /// How far the cells are deformed.
    pub(crate) deformed: Deformed,
}

/// Internal forces of one solid, compiled for its element and number type.
pub trait ForceField<R>: Send + Sync {
    /// Contributions [N] of each cell to its nodes, written cell by cell into `slots`. With `history` the stress
    /// relaxes and the history advances to this state; an empty `history` gives the instantaneous elastic
    /// response.
    /// `findings` has one entry per [`CHUNK`] cells.
    fn evaluate(
        &mut self,
        displacement: &[Vector<R>],
        history: &mut History<R>,
        slots: &mut [Vector<R>],
        findings: &mut [Findings],
    );

    /// Relaxes from now on over steps of `step` seconds.
    fn set_step(&mut self, prony: &Prony, step: f64);
}

impl Findings {
    /// Notes how far a cell is deformed, by its det F and C − I, and whether it is the first whose det F is not above
    /// zero.
    #[inline(always)]
    fn note<R: Real>(&mut self, cell: usize, j: R, strain_twice: &Symmetric<R>) {
        let [xx, yy, zz, xy, yz, xz] = strain_twice.0;
        let strain = xx * xx + yy * yy + zz * zz + R::of(2.0) * (xy * xy + yz * yz + xz * xz);
        self.deformed =
            self.deformed.merge(Deformed { least_volume_ratio: j.to_f64(), largest_strain: strain.to_f64() });
        if self.inverted.is_none() && (j <= R::ZERO || j.partial_cmp(&R::ZERO).is_none()) {
            self.inverted = Some((cell, j.to_f64()));
        }
    }
}

/// u_a − u_0: keeps the digits of small strains in cells that have moved far.
#[inline(always)]
fn relative_displacements<R: Real, const N: usize>(
    nodes: &[u32; N],
    displacement: &[Vector<R>],
) -> [Vector<R>; N] {
    let origin = displacement[nodes[0] as usize];
    let mut relative = [[R::ZERO; 3]; N];
    for (u, &node) in relative.iter_mut().zip(nodes) {
        *u = sub(displacement[node as usize], origin);
    }
    relative
}

/// ∂u/∂X from the displacements relative to the first node.
#[inline(always)]
fn displacement_gradient<R: Real, const N: usize>(
    u: &[Vector<R>; N],
    gradient: &[Vector<R>; N],
) -> Tensor<R> {
    let mut h = Tensor::ZERO;
    for (ua, ba) in u.iter().zip(gradient).skip(1) {
        h.add_outer(*ua, *ba);
    }
    h
}

/// f_a = V P B_a; the first node takes what makes the sum zero.
#[inline(always)]
fn scatter<R: Real, const N: usize>(
    piola: &Tensor<R>,
    gradient: &[Vector<R>; N],
    volume: R,
    forces: &mut [Vector<R>],
) {
    let mut sum = [R::ZERO; 3];
    for (force, &b) in forces.iter_mut().zip(gradient).skip(1) {
        *force = scale(piola.apply(b), volume);
        sum = add(sum, *force);
    }
    forces[0] = scale(sum, -R::ONE);
}

/// The force field of a solid for steps of `step` seconds.
pub(crate) fn force_field<R: Real>(solid: &Solid, step: f64) -> Box<dyn ForceField<R>> {
    match &solid.cells {
        Cells::Tet4(cells) => Box::new(SolidForces::new(solid, cells, step)),
        Cells::AveragedTet4(cells, averaging) => Box::new(AveragedTets::new(solid, cells, *averaging, step)),
        Cells::Hex8(cells) => Box::new(SolidForces::new(solid, cells, step)),
        Cells::FullHex8(cells, points) => Box::new(FullHexes::new(solid, cells, points, step)),
    }
}

/// All force fields of a model, their contribution slots, and the order in which nodes gather them.
pub(crate) struct InternalForces<R> {
    fields: Vec<Box<dyn ForceField<R>>>,
    /// First slot of each field, one more than there are fields.
    field_offsets: Vec<usize>,
    slots: Vec<Vector<R>>,
    /// What each task of each field found.
    findings: Vec<Vec<Findings>>,
    /// First entry of `incident` of each node, one more than there are nodes.
    node_offsets: Vec<u32>,
    /// Slots of each node, in the order of fields and cells.
    incident: Vec<u32>,
}

impl<R: Real> InternalForces<R> {
    pub(crate) fn new(model: &Model, step: f64) -> Self {
        let mut field_offsets = vec![0];
        let mut counts = vec![0_u32; model.node_count() + 1];
        for solid in &model.solids {
            for cell in 0..solid.cells.len() {
                for &node in solid.cells.nodes(cell) {
                    counts[node as usize + 1] += 1;
                }
            }
            field_offsets.push(
                field_offsets[field_offsets.len() - 1] + solid.cells.len() * solid.cells.nodes_per_cell(),
            );
        }
        for node in 0..model.node_count() {
            counts[node + 1] += counts[node];
        }
        let mut next = counts.clone();
        let slot_count = field_offsets[field_offsets.len() - 1];
        let mut incident = vec![0; slot_count];
        let mut slot = 0;
        for solid in &model.solids {
            for cell in 0..solid.cells.len() {
                for &node in solid.cells.nodes(cell) {
                    incident[next[node as usize] as usize] = slot;
                    next[node as usize] += 1;
                    slot += 1;
                }
            }
        }
        Self {
            fields: model.solids.iter().map(|solid| R::force_field(solid, step)).collect(),
            field_offsets,
            slots: vec![[R::ZERO; 3]; slot_count],
            findings: (model.solids.iter())
                .map(|solid| vec![Findings::default(); solid.cells.len().div_ceil(CHUNK)])
                .collect(),
            node_offsets: counts,
            incident,
        }
    }

    /// Evaluates all cells. `history` has one entry per solid, each empty for the instantaneous elastic response.
    pub(crate) fn evaluate(&mut self, displacement: &[Vector<R>], history: &mut [History<R>]) -> Found {
        let mut found = Found::default();
        for (index, field) in self.fields.iter_mut().enumerate() {
            let slots = &mut self.slots[self.field_offsets[index]..self.field_offsets[index + 1]];
            field.evaluate(displacement, &mut history[index], slots, &mut self.findings[index]);
            for findings in &self.findings[index] {
                found.hourglass += findings.hourglass;
                found.inverted = found.inverted.or(findings.inverted.map(|(cell, j)| (index, cell, j)));
                found.deformed = found.deformed.merge(findings.deformed);
            }
        }
        found
    }

    /// Relaxes from now on over steps of `step` seconds.
    pub(crate) fn set_step(&mut self, model: &Model, step: f64) {
        for (field, solid) in self.fields.iter_mut().zip(&model.solids) {
            field.set_step(&solid.material.prony, step);
        }
    }

    /// The internal force [N] on a node from the last evaluation.
    #[inline(always)]
    pub(crate) fn at(&self, node: usize) -> Vector<R> {
        let slots = &self.incident[self.node_offsets[node] as usize..self.node_offsets[node + 1] as usize];
        slots.iter().fold([R::ZERO; 3], |sum, &slot| add(sum, self.slots[slot as usize]))
    }
}
