//! Internal forces of solids: f_a = V F S B_a per cell, plus hourglass control, in first Piola–Kirchhoff form without
//! Voigt matrices. Each cell writes its nodal contributions into slots of its own; nodes gather them in a fixed order,
//! so that the number of threads never changes a bit.
//!
//! Cells lie in packs of [`PACK`], number by number, the last pack filled up with cells of no volume. Cost of a tet with
//! the split neo-Hookean law: counted in `crates/bench/src/count.rs`; in single precision 56 B of constants, 48 B gathered
//! and 64 B written (a slot is four numbers).
//! Runs on the current rayon pool.

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

use std::ops::Range;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::Real;
use crate::lanes::{Lanes, PACK, Pack, load_vector, store_vector};
use crate::model::{CellBlock, Cells, Model, Solid};
use crate::prony::Prony;
use crate::state::History;
use crate::tensor::{Tensor, Vector, add, cast, scale, sub};

/// Packs of cells per parallel task; the sums of a task are added up in order.
const TASK: usize = 32;

/// The forces [N] of a pack of cells on one of their nodes, cell by cell; the fourth number is unused.
type Slot<R> = Pack<[R; 4]>;

/// What a pass over some packs of cells found, lane by lane.
#[derive(Clone, Copy, Debug)]
pub struct Findings<R> {
    /// Energy held by hourglass patterns [J].
    hourglass: Pack<R>,
    /// The first cell of the pass with det F ≤ 0 or not a number, and its det F.
    inverted: Option<(usize, f64)>,
    /// The least det F.
    least_volume_ratio: Pack<R>,
    /// The largest |C − I|².
    largest_strain: Pack<R>,
}

impl<R: Real> Default for Findings<R> {
    fn default() -> Self {
        let least_volume_ratio = Pack([R::ONE; PACK]);
        Self { hourglass: Pack::ZERO, inverted: None, least_volume_ratio, largest_strain: Pack::ZERO }
    }
}

/// The extremes of deformation over some cells.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Deformed {
    /// The least det F.
    pub least_volume_ratio: f64,
    /// The largest |C − I|².
    pub largest_strain: f64,
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
    pub fn differs(&self, other: &Self, factor: f64) -> bool {
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
    /// Contributions [N] of each cell to its nodes, written into `slots`, pack by pack and node by node. With `history`
    /// the stress relaxes and the history advances to this state; an empty `history` gives the instantaneous elastic
    /// response.
    /// `findings` has one entry per [`TASK`] packs.
    fn evaluate(
        &mut self,
        displacement: &Places<R>,
        history: &mut History<R>,
        slots: &mut [Slot<R>],
        findings: &mut [Findings<R>],
    );

    /// Relaxes from now on over steps of `step` seconds.
    fn set_step(&mut self, prony: &Prony, step: f64);

    /// Runs from now on as on another processor.
    #[cfg(test)]
    fn set_processor(&mut self, processor: crate::lanes::Processor);
}

/// What all elements need of their cells, in packs.
struct PackedCells<R, const N: usize> {
    count: usize,
    nodes: Vec<[[u32; PACK]; N]>,
    /// Gradients of the shape functions [1/m].
    gradient: Vec<[Vector<Pack<R>>; N]>,
    /// Volumes [m³]; zero where a pack is filled up.
    volume: Vec<Pack<R>>,
    /// Directions of the families.
    fibre: Vec<Vector<Pack<R>>>,
    families: usize,
}

impl<R: Real, const N: usize> PackedCells<R, N> {
    fn new(solid: &Solid, cells: &CellBlock<N>) -> Self {
        let mut packed = Self {
            count: cells.nodes.len(),
            nodes: Vec::new(),
            gradient: Vec::new(),
            volume: Vec::new(),
            fibre: Vec::new(),
            families: solid.material.law.families(),
        };
        for pack in packed.packs() {
            let last = packed.count - 1;
            let node = |a: usize| std::array::from_fn(|lane| cells.nodes[last.min(pack * PACK + lane)][a]);
            packed.nodes.push(std::array::from_fn(node));
            packed.gradient.push(std::array::from_fn(|a| {
                packed.vector(pack, |cell| cast(cells.rest[cell].gradient[a]))
            }));
            packed.volume.push(packed.pack(pack, |cell| R::of(cells.rest[cell].volume)));
            for family in 0..packed.families {
                packed.fibre.push(packed.vector(pack, |cell| cast(solid.fibres(cell)[family])));
            }
        }
        packed
    }

    fn packs(&self) -> Range<usize> {
        0..self.count.div_ceil(PACK)
    }

    /// A number of each cell of a pack; zero beyond the last one.
    fn pack(&self, pack: usize, of_cell: impl Fn(usize) -> R) -> Pack<R> {
        Pack::from_fn(|lane| {
            let cell = pack * PACK + lane;
            if cell < self.count { of_cell(cell) } else { R::ZERO }
        })
    }

    fn vector(&self, pack: usize, of_cell: impl Fn(usize) -> Vector<R>) -> Vector<Pack<R>> {
        [0, 1, 2].map(|component| self.pack(pack, |cell| of_cell(cell)[component]))
    }

    /// The directions in some packs.
    #[inline(always)]
    fn fibres(&self, first: usize, packs: usize) -> &[Vector<Pack<R>>] {
        &self.fibre[first * self.families..(first + packs) * self.families]
    }
}

/// Does `pass` in parallel for every [`TASK`] packs of cells: it takes the first pack, the slots (`nodes` a pack)
/// and the history (`per_pack` packs a pack of cells; none if there is no history).
fn for_each_task<R: Real>(
    slots: &mut [Slot<R>],
    nodes: usize,
    history: &mut [Pack<R>],
    per_pack: usize,
    findings: &mut [Findings<R>],
    pass: impl Fn(usize, &mut [Slot<R>], &mut [Pack<R>]) -> Findings<R> + Sync,
) {
    let tasks = slots.par_chunks_mut(TASK * nodes).zip(findings).enumerate();
    if history.is_empty() {
        tasks.for_each(|(task, (slots, findings))| *findings = pass(task * TASK, slots, &mut []));
    } else {
        tasks.zip(history.par_chunks_mut(TASK * per_pack)).for_each(
            |((task, (slots, findings)), history)| {
                *findings = pass(task * TASK, slots, history);
            },
        );
    }
}

/// Vectors of nodes, each of which can be read as four numbers at once.
pub struct Places<R>(Vec<R>);

impl<R: Real> Places<R> {
    fn set(&mut self, vectors: &[Vector<R>]) {
        let numbers = vectors.as_flattened();
        self.0.resize(numbers.len() + 1, R::ZERO);
        self.0[..numbers.len()].copy_from_slice(numbers);
    }

    /// The vector of a node, and the number after it.
    #[inline(always)]
    fn at(&self, node: u32) -> [R; 4] {
        let mut four = [R::ZERO; 4];
        four.copy_from_slice(&self.0[3 * node as usize..][..4]);
        four
    }
}

/// The displacements of the nodes of a pack of cells, cell by cell.
#[inline(always)]
fn gather<R: Real, const N: usize>(
    nodes: &[[u32; PACK]; N],
    displacement: &Places<R>,
    to: &mut [Slot<R>; N],
) {
    for (nodes, to) in nodes.iter().zip(to) {
        for (to, &node) in to.0.iter_mut().zip(nodes) {
            *to = displacement.at(node);
        }
    }
}

/// Vectors cell by cell become components side by side.
#[inline(always)]
fn by_component<R: Real, const N: usize>(cells: &[Slot<R>; N], to: &mut [Vector<Pack<R>>; N]) {
    for (cells, [x, y, z]) in cells.iter().zip(to) {
        for lane in 0..PACK {
            x.0[lane] = cells.0[lane][0];
            y.0[lane] = cells.0[lane][1];
            z.0[lane] = cells.0[lane][2];
        }
    }
}

/// Components side by side become vectors cell by cell.
#[inline(always)]
fn by_cell<R: Real>(forces: &[Vector<Pack<R>>], slots: &mut [Slot<R>]) {
    for (slot, [x, y, z]) in slots.iter_mut().zip(forces) {
        for lane in 0..PACK {
            slot.0[lane] = [x.0[lane], y.0[lane], z.0[lane], R::ZERO];
        }
    }
}

/// u_a − u_0: keeps the digits of small strains in cells that have moved far.
#[inline(always)]
fn relative<R: Real, L: Lanes<R>, const N: usize>(moved: &[Vector<Pack<R>>; N], at: usize) -> [Vector<L>; N] {
    let origin = load_vector(&moved[0], at);
    let mut relative = [[L::ZERO; 3]; N];
    for (u, moved) in relative.iter_mut().zip(moved).skip(1) {
        *u = sub(load_vector(moved, at), origin);
    }
    relative
}

/// ∂u/∂X from the displacements relative to the first node.
#[inline(always)]
fn displacement_gradient<R: Real, L: Lanes<R>, const N: usize>(
    u: &[Vector<L>; N],
    gradient: &[Vector<Pack<R>>; N],
    at: usize,
) -> Tensor<L> {
    let mut h = Tensor::ZERO;
    for (ua, ba) in u.iter().zip(gradient).skip(1) {
        h.add_outer(*ua, load_vector(ba, at));
    }
    h
}

/// f_a = V P B_a; the first node takes what makes the sum zero.
#[inline(always)]
fn scatter<R: Real, L: Lanes<R>, const N: usize>(
    piola: &Tensor<L>,
    gradient: &[Vector<Pack<R>>; N],
    volume: L,
    forces: &mut [Vector<Pack<R>>],
    at: usize,
) {
    let mut sum = [L::ZERO; 3];
    for (force, b) in forces.iter_mut().zip(gradient).skip(1) {
        let own = scale(piola.apply(load_vector(b, at)), volume);
        sum = add(sum, own);
        store_vector(own, force, at);
    }
    store_vector(scale(sum, -L::ONE), &mut forces[0], at);
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
    slots: Vec<Slot<R>>,
    displacement: Places<R>,
    /// What each task of each field found.
    findings: Vec<Vec<Findings<R>>>,
    /// First entry of `incident` of each node, one more than there are nodes.
    node_offsets: Vec<u32>,
    /// Where in the slots the contributions to each node are, in the order of fields and cells: slot × [`PACK`] + lane.
    incident: Vec<u32>,
}

impl<R: Real> InternalForces<R> {
    pub(crate) fn new(model: &Model, step: f64) -> Self {
        let mut field_offsets = vec![0];
        let mut places = Vec::new();
        for solid in &model.solids {
            let (first, nodes) = (field_offsets[field_offsets.len() - 1], solid.cells.nodes_per_cell());
            for cell in 0..solid.cells.len() {
                for (a, &node) in solid.cells.nodes(cell).iter().enumerate() {
                    let slot = first + cell / PACK * nodes + a;
                    places.push((node, (slot * PACK + cell % PACK) as u32));
                }
            }
            field_offsets.push(first + solid.cells.len().div_ceil(PACK) * nodes);
        }
        let mut node_offsets = vec![0_u32; model.node_count() + 1];
        places.iter().for_each(|(node, _)| node_offsets[*node as usize + 1] += 1);
        for node in 0..model.node_count() {
            node_offsets[node + 1] += node_offsets[node];
        }
        // Stable: each node keeps the order of fields and cells.
        places.sort_by_key(|(node, _)| *node);
        Self {
            fields: model.solids.iter().map(|solid| R::force_field(solid, step)).collect(),
            slots: vec![Pack([[R::ZERO; 4]; PACK]); field_offsets[field_offsets.len() - 1]],
            field_offsets,
            displacement: Places(vec![R::ZERO; 3 * model.node_count() + 1]),
            findings: (model.solids.iter())
                .map(|solid| vec![Findings::default(); solid.cells.len().div_ceil(TASK * PACK)])
                .collect(),
            node_offsets,
            incident: places.into_iter().map(|(_, place)| place).collect(),
        }
    }

    /// Evaluates all cells. `history` has one entry per solid, each empty for the instantaneous elastic response.
    pub(crate) fn evaluate(&mut self, displacement: &[Vector<R>], history: &mut [History<R>]) -> Found {
        let mut found = Found::default();
        self.displacement.set(displacement);
        for (index, field) in self.fields.iter_mut().enumerate() {
            let slots = &mut self.slots[self.field_offsets[index]..self.field_offsets[index + 1]];
            field.evaluate(&self.displacement, &mut history[index], slots, &mut self.findings[index]);
            for findings in &self.findings[index] {
                found.inverted = found.inverted.or(findings.inverted.map(|(cell, j)| (index, cell, j)));
                for lane in 0..PACK {
                    found.hourglass += findings.hourglass.0[lane].to_f64();
                    found.deformed = found.deformed.merge(Deformed {
                        least_volume_ratio: findings.least_volume_ratio.0[lane].to_f64(),
                        largest_strain: findings.largest_strain.0[lane].to_f64(),
                    });
                }
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
        let places = &self.incident[self.node_offsets[node] as usize..self.node_offsets[node + 1] as usize];
        // Four sums, so that an addition need not wait for the one before.
        let mut sums = [[R::ZERO; 4]; 4];
        for places in places.chunks(4) {
            for (sum, &place) in sums.iter_mut().zip(places) {
                let force = &self.slots[place as usize / PACK].0[place as usize % PACK];
                for c in 0..4 {
                    sum[c] += force[c];
                }
            }
        }
        let [a, b, d, e] = sums;
        [0, 1, 2].map(|c| (a[c] + b[c]) + (d[c] + e[c]))
    }
}
