//! Internal forces of solids: f_a = V F S B_a per cell, plus hourglass control, in first Piola–Kirchhoff form
//! without Voigt matrices. Cells are added up block by block (`blocks.rs`) in a fixed order, so that the
//! number of threads never changes a bit.
//!
//! Cells lie in packs of [`PACK`], number by number, the last pack filled up with cells of no volume. History
//! lies so too, in the state and in checkpoints. The cost is counted in `lab/bench/src/count.rs`. Runs on the
//! current rayon pool.
//!
//! A force field works through batches of four packs of points (`batch.rs`): displacement gradients, then
//! stresses of the law, then nodal forces. So elements and laws are each compiled once per kind of lanes,
//! never each law in each element. The law is chosen once per batch. `plain.rs`: one point per cell, with
//! hourglass control from `hourglass.rs`; `averaged.rs`: tets with averaged pressure; `full_hex.rs`: eight
//! points; `membrane.rs`: triangles in plane stress; `bar.rs`: bars and threads. Every element whose force is
//! the gradient of an energy runs through the battery in `tests.rs`.

mod averaged;
mod bar;
mod batch;
mod blocks;
mod corners;
mod field;
mod findings;
mod full_hex;
mod hourglass;
mod membrane;
mod one_pass;
mod packed;
mod plain;
#[cfg(test)]
pub(crate) mod tests;

use std::ops::Range;

use pliant_mechanics::model::{Cells, Model, Solid};
use pliant_mechanics::tensor::{Vector, add, cast};
use pliant_mechanics::tie::Tie;

use averaged::AveragedTets;
use bar::Bars;
pub(crate) use batch::{Batch, Wanted, pressure};
pub(crate) use blocks::Quad;
use blocks::Shares;
use field::ForceField;
pub use findings::Deformed;
use findings::Findings;
pub(crate) use findings::Found;
use full_hex::FullHexes;
pub(crate) use hourglass::growth;
use membrane::Membranes;
use plain::SolidForces;

use crate::history::History;
use crate::lanes::LaneNumber;
use crate::lanes::{PACK, Processor, plus};

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

/// Evaluates fields side by side: a small one, such as a vessel, has no work for several threads by itself.
/// Forces begin at the first of the offsets.
fn side_by_side<R: LaneNumber>(
    fields: &mut [Box<dyn ForceField<R>>],
    offsets: &[usize],
    displacement: &[Vector<R>],
    history: &mut [History<R>],
    forces: &mut [Quad<R>],
    findings: &mut [Vec<Findings<R>>],
) {
    let ([field, fields @ ..], [field_history, history @ ..], [found, findings @ ..]) =
        (fields, history, findings)
    else {
        return;
    };
    let (first, forces) = forces.split_at_mut(offsets[1] - offsets[0]);
    let mut evaluate = || field.evaluate(displacement, field_history, first, found);
    if fields.is_empty() {
        return evaluate();
    }
    rayon::join(evaluate, || side_by_side(fields, &offsets[1..], displacement, history, forces, findings));
}

/// Force fields of a model, the sums of their blocks, and the order in which nodes gather these sums.
pub(crate) struct InternalForces<R> {
    fields: Vec<Box<dyn ForceField<R>>>,
    /// First entry of `forces` of each field, one more than there are fields.
    field_offsets: Vec<usize>,
    /// Forces [N] of the blocks of each field, and none for nodes without cells.
    forces: Vec<Quad<R>>,
    /// Findings of each block of each field.
    findings: Vec<Vec<Findings<R>>>,
    /// Places in `forces` of the parts of each node, in the order of fields and blocks.
    shares: Shares,
    tied: Option<Tied<R>>,
}

/// Forces on nodes that follow others: found first, and given as parts to those that they follow.
struct Tied<R> {
    /// Places in `forces` of the parts of each such node, in the order of the ties.
    shares: Shares,
    /// First entry of `given` of each, one more than there are.
    offsets: Vec<u32>,
    /// Weights of each component of the force for the followed nodes; for a held component the force stays on
    /// the node.
    given: Vec<Vector<R>>,
    /// The first of their places in `forces`.
    first: usize,
    forces: Vec<Vector<R>>,
}

impl<R: LaneNumber> Tied<R> {
    /// Builds the ties of a model whose cells leave their forces at `places` before `first`. Also returns the
    /// places that the followed nodes take over.
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
        let tied_places = places.iter().map(|&(node, place)| (number[node as usize], place));
        let tied_places = tied_places.filter(|(number, _)| *number != u32::MAX);
        let tied = Self {
            shares: Shares::new(count, none, tied_places),
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
            let kept = places.into_iter().filter(|(node, _)| !follows[*node as usize]).chain(taken);
            (Some(tied), Shares::new(model.node_count(), none, kept))
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

    /// True if there is work for several threads.
    pub(crate) fn is_shared(&self) -> bool {
        self.findings.iter().map(Vec::len).sum::<usize>() > 1
    }

    /// Evaluates all cells. `history` has one entry per solid, each empty for the instantaneous elastic
    /// response.
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

    /// Lends the forces to a caller that finds other forces; afterwards the forces on nodes are restored.
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

    /// Writes the internal forces [N] on some nodes, as [`at`](Self::at) does for one, with room for as many
    /// sums.
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
