//! Internal forces of solids: f_a = V F S B_a per cell, plus hourglass control, in first Piola–Kirchhoff form without
//! Voigt matrices. Cells are added up block by block (`blocks.rs`) in a fixed order, so that the number of threads never
//! changes a bit.
//!
//! Cells lie in packs of [`PACK`], number by number, the last pack filled up with cells of no volume. History lies so too, in the state
//! and in checkpoints. The cost is counted in `lab/bench/src/count.rs`. Runs on the current rayon pool.
//!
//! A force field works through batches of four packs of points (`batch.rs`): displacement gradients, then stresses of the law, then nodal forces. So
//! elements and laws are each compiled once per kind of lanes, never each law in each element, and the law is chosen once per batch.
//! `plain.rs`: one point per cell, with hourglass control from `hourglass.rs`; `averaged.rs`: tets with averaged pressure; `full_hex.rs`:
//! eight points; `membrane.rs`: triangles in plane stress; `bar.rs`: bars and threads. Every element whose force is the gradient of an energy runs through the battery in `tests.rs`.

mod averaged;
mod bar;
mod batch;
mod blocks;
mod corners;
mod full_hex;
mod hourglass;
mod membrane;
mod one_pass;
mod plain;
#[cfg(test)]
pub(crate) mod tests;

use averaged::AveragedTets;
use bar::Bars;
pub(crate) use batch::{Batch, Wanted, pressure};
pub(crate) use blocks::MOST_PACKS;
pub(crate) use hourglass::growth;
use std::ops::Range;

use pliant_mechanics::model::{CellBlock, Cells, Model, Solid};
use pliant_mechanics::prony::Prony;
use pliant_mechanics::tensor::{Tensor, Vector, add, cast, sub};
use pliant_mechanics::tie::Tie;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::history::History;
use crate::lanes::LaneNumber;
use crate::lanes::{Lanes, Local, PACK, Pack, Places, Processor, load_vector, plus};
pub(crate) use blocks::Quad;
use blocks::{Blocks, Shares};
use full_hex::FullHexes;
use membrane::Membranes;
use plain::SolidForces;

/// What a pass over some packs of cells found, lane by lane.
#[derive(Clone, Copy, Debug)]
pub struct Findings<R> {
    /// Energy held by hourglass patterns [J].
    hourglass: Pack<R>,
    /// The first cell of the pass with det F ≤ 0 or not a number, and its det F.
    inverted: Option<(usize, f64)>,
    /// A cell of the pass with a corner turned inside out.
    folded: Option<usize>,
    /// The least det F.
    least_volume_ratio: Pack<R>,
    /// The largest |C − I|².
    largest_strain: Pack<R>,
}

impl<R: LaneNumber> Default for Findings<R> {
    fn default() -> Self {
        let least_volume_ratio = Pack([R::ONE; PACK]);
        Self {
            hourglass: Pack::ZERO,
            inverted: None,
            folded: None,
            least_volume_ratio,
            largest_strain: Pack::ZERO,
        }
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
        self.change(other) > factor
    }

    /// The factor, 1 or more, by which one of these two differs.
    pub fn change(&self, other: &Self) -> f64 {
        let stretch = |d: &Self| (1.0 + d.largest_strain.sqrt()).sqrt();
        let apart = |a: f64, b: f64| (a / b).max(b / a);
        apart(self.least_volume_ratio, other.least_volume_ratio).max(apart(stretch(self), stretch(other)))
    }
}

/// What an evaluation of all cells found.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Found {
    /// Energy held by hourglass patterns [J].
    pub hourglass: f64,
    /// The first inverted cell as (solid, cell, det F).
    pub inverted: Option<(usize, usize, f64)>,
    /// The first hexahedron of which a corner is turned inside out, as (solid, cell).
    pub folded: Option<(usize, usize)>,
    /// How far the cells are deformed.
    pub(crate) deformed: Deformed,
}

/// Internal forces of one solid, compiled for its element and number type.
pub trait ForceField<R>: Send + Sync {
    /// The blocks of its cells.
    fn blocks(&self) -> &Blocks;

    /// Forces [N] of each block of cells on the nodes of the block, in [`Blocks::room`] entries. With `history`
    /// the stress relaxes and the history advances to this state; an empty `history` gives the instantaneous elastic
    /// response. `findings` has one entry per block.
    fn evaluate(
        &mut self,
        displacement: &[Vector<R>],
        history: &mut History<R>,
        forces: &mut [Quad<R>],
        findings: &mut [Findings<R>],
    );

    /// Relaxes from now on over steps of `step` seconds.
    fn set_step(&mut self, prony: &Prony, step: f64);

    /// Runs from now on in other lanes.
    fn set_processor(&mut self, processor: Processor);
}

/// Where the history of one of several points lies, `each` packs a point, in a history of `all` packs; nowhere in an empty one.
#[inline(always)]
fn own_packs(point: usize, each: usize, all: usize) -> Range<usize> {
    (point * each).min(all)..((point + 1) * each).min(all)
}

/// What all elements need of their cells, in packs.
struct PackedCells<R, const N: usize> {
    count: usize,
    /// Nodes of packs of cells in their block.
    places: Places<R, N>,
    /// Directions of the families.
    fibre: Vec<Vector<Pack<R>>>,
    families: usize,
}

impl<R: LaneNumber, const N: usize> PackedCells<R, N> {
    fn new(solid: &Solid, cells: &CellBlock<N>) -> (Self, Blocks) {
        let (blocks, local) = Blocks::new(&cells.nodes);
        let last = local.len().max(1) - 1;
        let nodes = |pack: usize| {
            let node = |a: usize| std::array::from_fn(|lane| local[last.min(pack * PACK + lane)][a]);
            std::array::from_fn(node)
        };
        let mut packed = Self {
            count: local.len(),
            places: Places::new((0..local.len().div_ceil(PACK)).map(nodes), blocks.packs()),
            fibre: Vec::new(),
            families: solid.material.law.families(),
        };
        for pack in packed.packs() {
            for family in 0..packed.families {
                packed.fibre.push(packed.vector(pack, |cell| cast(solid.law_fibres(cell)[family])));
            }
        }
        (packed, blocks)
    }

    fn packs(&self) -> Range<usize> {
        0..self.count.div_ceil(PACK)
    }

    /// The packs of a block.
    #[inline(always)]
    fn packs_of(&self, block: usize) -> Range<usize> {
        self.places.packs_of(block)
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

/// Gradients of the shape functions [1/m] of packs of cells, of all nodes but the first (they sum to zero), and volumes
/// [m³], zero where a pack is filled up.
struct PackedRest<R, const M: usize> {
    gradient: [Vector<Pack<R>>; M],
    volume: Pack<R>,
}

impl<R: LaneNumber, const M: usize> PackedRest<R, M> {
    fn of<const N: usize>(packed: &PackedCells<R, N>, cells: &CellBlock<N>) -> Vec<Self> {
        const { assert!(M + 1 == N) };
        let rest = |pack: usize| Self {
            gradient: std::array::from_fn(|a| {
                packed.vector(pack, |cell| cast(cells.rest[cell].gradient[a + 1]))
            }),
            volume: packed.pack(pack, |cell| R::of(cells.rest[cell].volume)),
        };
        packed.packs().into_par_iter().map(rest).collect()
    }
}

/// u_a − u_0 of all nodes but the first: keeps the digits of small strains in cells that have moved far. Beside them what
/// else the nodes carry, summed.
#[inline(always)]
fn relative<R: LaneNumber, L: Lanes<R>, const N: usize, const M: usize>(
    local: &Local<'_, R, N>,
    pack: usize,
    at: usize,
) -> ([Vector<L>; M], L) {
    let [x, y, z, mut sum] = local.gather(pack, 0, at);
    let mut relative = [[L::ZERO; 3]; M];
    for (u, node) in relative.iter_mut().zip(1..) {
        let [ux, uy, uz, beside] = local.gather(pack, node, at);
        *u = sub([ux, uy, uz], [x, y, z]);
        sum += beside;
    }
    (relative, sum)
}

/// ∂u/∂X from the displacements relative to the first node.
#[inline(always)]
fn displacement_gradient<R: LaneNumber, L: Lanes<R>, const M: usize>(
    u: &[Vector<L>; M],
    gradient: &[Vector<Pack<R>>; M],
    at: usize,
) -> Tensor<L> {
    let mut h = Tensor::ZERO;
    for (ua, ba) in u.iter().zip(gradient) {
        h.add_outer(*ua, load_vector(ba, at));
    }
    h
}

/// V P B_a of all nodes but the first, from V P.
#[inline(always)]
fn nodal_forces<R: LaneNumber, L: Lanes<R>, const M: usize>(
    piola: &Tensor<L>,
    gradient: &[Vector<Pack<R>>; M],
    at: usize,
) -> [Vector<L>; M] {
    let mut forces = [[L::ZERO; 3]; M];
    for (force, b) in forces.iter_mut().zip(gradient) {
        *force = piola.apply(load_vector(b, at));
    }
    forces
}

/// Writes the forces on all nodes as vectors, [`Lanes::row_of_lane`] by lane; the first node takes what makes the sum zero.
#[inline(always)]
fn by_cell<R: LaneNumber, L: Lanes<R>, const N: usize, const M: usize>(
    forces: &[Vector<L>; M],
    to: &mut [Pack<Quad<R>>; N],
    at: usize,
) {
    let mut sum = [L::ZERO; 3];
    for (force, to) in forces.iter().zip(&mut to[1..]) {
        sum = add(sum, *force);
        L::spread([force[0], force[1], force[2], L::ZERO], to, at);
    }
    L::spread([-sum[0], -sum[1], -sum[2], L::ZERO], &mut to[0], at);
}

/// The force field of a solid for steps of `step` seconds.
fn force_field<R: LaneNumber>(solid: &Solid, step: f64) -> Box<dyn ForceField<R>> {
    match &solid.cells {
        Cells::Tet4(cells) => Box::new(SolidForces::<R, 4, 3>::new(solid, cells, step)),
        Cells::AveragedTet4(cells, averaging) => Box::new(AveragedTets::new(solid, cells, *averaging, step)),
        Cells::Hex8(cells) => Box::new(SolidForces::<R, 8, 7>::new(solid, cells, step)),
        Cells::FullHex8(cells, points) => Box::new(FullHexes::new(solid, cells, points, step)),
        Cells::Membrane(cells, sheets) => Box::new(Membranes::new(solid, cells, sheets, step)),
        Cells::Bar(cells, cord) => Box::new(Bars::new(solid, cells, cord, step)),
    }
}

/// Evaluates fields side by side: a small one, such as a vessel, has no work for several threads by itself. Forces begin at the first of
/// the offsets.
fn side_by_side<R: LaneNumber>(
    fields: &mut [Box<dyn ForceField<R>>],
    offsets: &[usize],
    displacement: &[Vector<R>],
    history: &mut [History<R>],
    forces: &mut [Quad<R>],
    findings: &mut [Vec<Findings<R>>],
) {
    let ([field, fields @ ..], [own, history @ ..], [found, findings @ ..]) = (fields, history, findings)
    else {
        return;
    };
    let (first, forces) = forces.split_at_mut(offsets[1] - offsets[0]);
    let mut evaluate = || field.evaluate(displacement, own, first, found);
    if fields.is_empty() {
        return evaluate();
    }
    rayon::join(evaluate, || side_by_side(fields, &offsets[1..], displacement, history, forces, findings));
}

/// All force fields of a model, the sums of their blocks, and the order in which nodes gather these.
pub(crate) struct InternalForces<R> {
    fields: Vec<Box<dyn ForceField<R>>>,
    /// First entry of `forces` of each field, one more than there are fields.
    field_offsets: Vec<usize>,
    /// Forces [N] of the blocks of each field, and none for nodes without cells.
    forces: Vec<Quad<R>>,
    /// What each block of each field found.
    findings: Vec<Vec<Findings<R>>>,
    /// Where in `forces` the parts of each node are, in the order of fields and blocks.
    shares: Shares,
    tied: Option<Tied<R>>,
}

/// Forces on nodes that follow others: found first, and given as parts to those that they follow.
struct Tied<R> {
    /// Where in `forces` the parts of each such node are, in the order of the ties.
    shares: Shares,
    /// First entry of `given` of each, one more than there are.
    offsets: Vec<u32>,
    /// How much of each component of the force on it goes to each node that it follows, and stays where it is held.
    given: Vec<Vector<R>>,
    /// The first of their places in `forces`.
    first: usize,
    forces: Vec<Vector<R>>,
}

impl<R: LaneNumber> Tied<R> {
    /// Of a model whose cells leave their forces at some places before `first`; with the places that the followed nodes take over.
    fn new(model: &Model, places: &[(u32, u32)], first: usize, none: u32) -> (Self, Vec<(u32, u32)>) {
        let mut number = vec![u32::MAX; model.node_count()];
        let (mut offsets, mut given, mut taken) = (vec![0], Vec::new(), Vec::new());
        for (node, row) in model.ties.iter().flat_map(Tie::component_rows) {
            number[node as usize] = offsets.len() as u32 - 1;
            for (followed, weights) in row {
                taken.push((followed, (first + given.len()) as u32));
                given.push(cast(weights));
            }
            offsets.push(given.len() as u32);
        }
        let count = offsets.len() - 1;
        let own = places.iter().map(|&(node, place)| (number[node as usize], place));
        let own = own.filter(|(number, _)| *number != u32::MAX);
        let tied = Self {
            shares: Shares::new(count, none, own),
            forces: vec![[R::ZERO; 3]; count],
            offsets,
            given,
            first,
        };
        (tied, taken)
    }

    /// Gives the forces on.
    fn give(&mut self, forces: &mut [Quad<R>]) {
        let part = |place: usize| {
            let [x, y, z, _] = forces[place];
            [x, y, z]
        };
        let count = self.forces.len();
        self.shares.visit(0..count, &mut self.forces, part, |sum, place| *sum = add(*sum, part(place)));
        for (rows, force) in self.offsets.windows(2).zip(&self.forces) {
            let row = rows[0] as usize..rows[1] as usize;
            for (to, &[x, y, z]) in forces[self.first..][row.clone()].iter_mut().zip(&self.given[row]) {
                *to = [x * force[0], y * force[1], z * force[2], R::ZERO];
            }
        }
    }
}

impl<R: LaneNumber> InternalForces<R> {
    pub(crate) fn new(model: &Model, step: f64) -> Self {
        let fields: Vec<_> = model.solids.iter().map(|solid| force_field(solid, step)).collect();
        let mut field_offsets = vec![0];
        for field in &fields {
            field_offsets.push(field_offsets[field_offsets.len() - 1] + field.blocks().room());
        }
        let count = field_offsets[fields.len()];
        let places = fields.iter().zip(&field_offsets).flat_map(|(field, &first)| {
            field.blocks().places().map(move |(node, place)| (node, first as u32 + place))
        });
        let given: usize = model.ties.iter().flat_map(Tie::component_rows).map(|(_, row)| row.count()).sum();
        let none = (count + given) as u32;
        let (tied, shares) = if model.ties.is_empty() {
            (None, Shares::new(model.node_count(), none, places))
        } else {
            let follows = model.followers();
            let places: Vec<(u32, u32)> = places.collect();
            let (tied, taken) = Tied::new(model, &places, count, none);
            let own = places.into_iter().filter(|(node, _)| !follows[*node as usize]).chain(taken);
            (Some(tied), Shares::new(model.node_count(), none, own))
        };
        Self {
            shares,
            tied,
            forces: vec![[R::ZERO; 4]; count + given + 1],
            findings: fields.iter().map(|field| vec![Findings::default(); field.blocks().len()]).collect(),
            field_offsets,
            fields,
        }
    }

    /// Whether there is work for several threads.
    pub(crate) fn is_shared(&self) -> bool {
        self.findings.iter().map(Vec::len).sum::<usize>() > 1
    }

    /// Evaluates all cells. `history` has one entry per solid, each empty for the instantaneous elastic response.
    pub(crate) fn evaluate(&mut self, displacement: &[Vector<R>], history: &mut [History<R>]) -> Found {
        let mut found = Found::default();
        let Self { fields, field_offsets, forces, findings, .. } = self;
        side_by_side(fields, field_offsets, displacement, history, forces, findings);
        for (index, findings) in self.findings.iter().enumerate() {
            for findings in findings {
                found.inverted = found.inverted.or(findings.inverted.map(|(cell, j)| (index, cell, j)));
                found.folded = found.folded.or(findings.folded.map(|cell| (index, cell)));
                for lane in 0..PACK {
                    found.hourglass += findings.hourglass.0[lane].to_f64();
                    found.deformed = found.deformed.merge(Deformed {
                        least_volume_ratio: findings.least_volume_ratio.0[lane].to_f64(),
                        largest_strain: findings.largest_strain.0[lane].to_f64(),
                    });
                }
            }
        }
        if let Some(tied) = &mut self.tied {
            tied.give(&mut self.forces);
        }
        found
    }

    /// Lends this to find other forces; afterwards the forces on nodes are those of before again.
    pub(crate) fn lend<T>(&mut self, to: impl FnOnce(&mut Self) -> T) -> T {
        let forces = self.forces.clone();
        let made = to(self);
        self.forces = forces;
        made
    }

    /// Relaxes from now on over steps of `step` seconds.
    pub(crate) fn set_step(&mut self, model: &Model, step: f64) {
        for (field, solid) in self.fields.iter_mut().zip(&model.solids) {
            field.set_step(&solid.material.prony, step);
        }
    }

    /// Runs from now on in other lanes.
    pub(crate) fn set_processor(&mut self, processor: Processor) {
        self.fields.iter_mut().for_each(|field| field.set_processor(processor));
    }

    /// The internal force [N] on a node from the last evaluation.
    #[inline(always)]
    pub(crate) fn at(&self, node: usize) -> Vector<R> {
        let (mut parts, mut force) = ([[R::ZERO; 4]], [[R::ZERO; 3]]);
        self.at_nodes(node..node + 1, &mut parts, &mut force);
        force[0]
    }

    /// The same of some nodes, with room for as many sums.
    #[inline(always)]
    pub(crate) fn at_nodes(&self, nodes: Range<usize>, sums: &mut [Quad<R>], to: &mut [Vector<R>]) {
        let sums = &mut sums[..nodes.len()];
        let part = |place: usize| self.forces[place];
        self.shares.visit(nodes, sums, part, |sum, place| *sum = plus(*sum, part(place)));
        for (to, &mut [x, y, z, _]) in to.iter_mut().zip(sums) {
            *to = [x, y, z];
        }
    }
}
