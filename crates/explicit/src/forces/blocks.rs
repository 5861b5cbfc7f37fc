//! Cells block by block. A block copies in the displacements of its nodes and adds up the forces of its cells
//! in its own sums. It leaves these sums for the nodes. Each node adds up the few blocks at it in their
//! order. So a block works in the first caches, and neither its size nor its sums depend on the number of
//! threads. No atomic is needed, and all arrays have their final length from the start.

use std::ops::Range;

use pliant_mechanics::tensor::Vector;
use rayon::iter::{Either, repeat_n};
use rayon::prelude::*;

use super::batch::PACKS;
use super::findings::Findings;
use crate::lanes::LaneNumber;
use crate::lanes::{PACK, Pack};

/// Packs of cells in a block of a large model. Of 55,566 tets on one thread 32 take 3 % longer; with 128
/// hexes leave the first cache.
const BLOCK: usize = 64;

/// Packs that a block may have more, in place of two further blocks.
const SPARE: usize = 8;

/// The most packs of a block.
pub(super) const MOST_PACKS: usize = BLOCK + SPARE;

/// Nodes of packs of cells, each pack with its own nodes, that are worth a second thread on every machine. A
/// model of 1,000 hexes is smaller. Two threads took 0.68 of the time of one where cores answer each other
/// fast. They took 1.15 to 1.4 of it on the same machine where cores did not.
const SHARED: usize = 512;

/// Returns the packs of each block, for `packs` packs of cells with `nodes` nodes. A small model has two,
/// four or six blocks, so that two threads have as much to do.
fn packs_per_block(packs: usize, nodes: usize) -> usize {
    if packs <= MOST_PACKS && packs * nodes < SHARED {
        return MOST_PACKS;
    }
    let pairs = packs.saturating_sub(2 * SPARE).div_ceil(2 * BLOCK).max(1);
    packs.div_ceil(2 * pairs).next_multiple_of(PACKS)
}

/// Three components and a fourth number, read and written at once.
pub type Quad<R> = [R; 4];

/// The nodes of blocks of cells.
#[derive(Clone, Debug)]
pub struct Blocks {
    /// Nodes of all blocks, one block after another, increasing in each.
    nodes: Vec<u32>,
    /// First entry of `nodes` of each block, one more than there are blocks.
    offsets: Vec<u32>,
    /// The most nodes of a block; each block has room for this number.
    stride: usize,
    /// Packs of cells in each block but the last.
    packs: usize,
}

impl Blocks {
    /// Builds the blocks of cells in their order, and the number of each cell's nodes in its block.
    pub(super) fn new<const N: usize>(cells: &[[u32; N]]) -> (Self, Vec<[u16; N]>) {
        let packs = packs_per_block(cells.len().div_ceil(PACK), N);
        let mut blocks = Self { nodes: Vec::new(), offsets: vec![0], stride: 0, packs };
        let mut local = Vec::with_capacity(cells.len());
        let [low, high] = cells
            .as_flattened()
            .iter()
            .fold([u32::MAX, 0], |[low, high], &node| [low.min(node), high.max(node)]);
        // The number of each node in the block, from the lowest node on; u16::MAX of others.
        let mut numbers = vec![u16::MAX; (high + 1).saturating_sub(low) as usize];
        for cells in cells.chunks(packs * PACK) {
            let first = blocks.nodes.len();
            let mut members = Vec::new();
            for &node in cells.as_flattened() {
                if std::mem::replace(&mut numbers[(node - low) as usize], 0) == u16::MAX {
                    members.push(node);
                }
            }
            members.sort_unstable();
            members.iter().zip(0..).for_each(|(&node, number)| numbers[(node - low) as usize] = number);
            local.extend(cells.iter().map(|cell| cell.map(|node| numbers[(node - low) as usize])));
            members.iter().for_each(|&node| numbers[(node - low) as usize] = u16::MAX);
            blocks.stride = blocks.stride.max(members.len());
            blocks.nodes.extend(members);
            blocks.offsets.push(blocks.nodes.len() as u32);
            debug_assert!(blocks.nodes.len() - first <= usize::from(u16::MAX));
        }
        (blocks, local)
    }

    /// Number of blocks.
    pub(super) fn len(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Packs of cells in each block but the last.
    pub(super) fn packs(&self) -> usize {
        self.packs
    }

    /// The nodes of a block.
    #[inline(always)]
    pub(super) fn nodes(&self, block: usize) -> &[u32] {
        &self.nodes[self.entries(block)]
    }

    /// Returns the range of a block's nodes among the nodes of all blocks, one block after another.
    #[inline(always)]
    pub(super) fn entries(&self, block: usize) -> Range<usize> {
        self.offsets[block] as usize..self.offsets[block + 1] as usize
    }

    /// The nodes of all blocks, one block after another.
    pub(super) fn all_nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// Entries in rows of one for each node of a block, as many in each row as the largest block needs.
    pub(super) fn room(&self) -> usize {
        self.len() * self.stride
    }

    /// Every node of every block and its place in such rows.
    pub(super) fn places(&self) -> impl Iterator<Item = (u32, u32)> + Clone + '_ {
        (0..self.len()).flat_map(|block| {
            let first = block * self.stride;
            self.nodes(block).iter().enumerate().map(move |(k, &node)| (node, (first + k) as u32))
        })
    }
}

/// Places of the parts of the sum at each node. Most nodes have one part. These parts come first, without a
/// branch, then the others, in the order of the nodes and of adding.
#[derive(Clone, Debug)]
pub(super) struct Shares {
    /// The first part of each node; for a node without any, an entry beyond all parts.
    first: Vec<u32>,
    /// Further parts, as node and place.
    further: Vec<[u32; 2]>,
    /// Entry of `further` at which each group of [`PACK`] nodes begins.
    starts: Vec<u32>,
}

impl Shares {
    /// Builds the shares of `count` nodes, from pairs of node and place in the order of adding. The place
    /// `none` holds nothing.
    pub(super) fn new(count: usize, none: u32, pairs: impl Iterator<Item = (u32, u32)>) -> Self {
        let (mut first, mut further) = (vec![none; count], Vec::new());
        for (node, place) in pairs {
            match &mut first[node as usize] {
                first if *first == none => *first = place,
                _ => further.push([node, place]),
            }
        }
        // Stable: each node keeps the order of adding.
        further.sort_by_key(|[node, _]| *node);
        let start = |pack: usize| further.partition_point(|[node, _]| (*node as usize) < pack * PACK) as u32;
        Self { starts: (0..=count / PACK).map(start).collect(), first, further }
    }

    /// Hands out the places of the parts of some nodes: `first` for each node, then `further` in order, each
    /// with the number of the node among them.
    #[inline(always)]
    pub(super) fn visit<T>(
        &self,
        nodes: Range<usize>,
        sums: &mut [T],
        first: impl Fn(usize) -> T,
        further: impl Fn(&mut T, usize),
    ) {
        for (sum, &place) in sums.iter_mut().zip(&self.first[nodes.clone()]) {
            *sum = first(place as usize);
        }
        for &[node, place] in &self.further[self.starts[nodes.start / PACK] as usize..] {
            if node as usize >= nodes.end {
                break;
            }
            if node as usize >= nodes.start {
                further(&mut sums[node as usize - nodes.start], place as usize);
            }
        }
    }
}

/// Displacements [m] of the nodes of each block, with a fourth number that some elements need.
#[derive(Clone, Debug)]
pub(super) struct Moved<R> {
    pub blocks: Blocks,
    vectors: Vec<Quad<R>>,
}

/// Block at work.
pub(super) struct Task<'a, R> {
    /// Number of the block.
    pub block: usize,
    /// Nodes of the block.
    pub nodes: &'a [u32],
    /// Displacements [m] of these nodes.
    pub moved: &'a mut [Quad<R>],
    /// The forces [N] of its cells on them.
    pub forces: &'a mut [Quad<R>],
    /// History of the block's cells; empty for elastic laws.
    pub history: &'a mut [Pack<R>],
    /// History of the pressures of the block's cells.
    pub pressures: &'a mut [Pack<R>],
}

impl<R: LaneNumber> Task<'_, R> {
    /// Copies the displacements of its nodes in.
    #[inline(always)]
    pub(super) fn copy_in(&mut self, displacement: &[Vector<R>]) {
        for (to, &node) in self.moved.iter_mut().zip(self.nodes) {
            let [x, y, z] = displacement[node as usize];
            *to = [x, y, z, R::ZERO];
        }
    }
}

impl<R: LaneNumber> Moved<R> {
    pub(super) fn new(blocks: Blocks) -> Self {
        Self { vectors: vec![[R::ZERO; 4]; blocks.room()], blocks }
    }

    /// Does `pass` for every block in parallel; `history` and `pressures` come with how much of them belongs
    /// to a pack of cells.
    pub(super) fn for_each(
        &mut self,
        forces: &mut [Quad<R>],
        history: (&mut [Pack<R>], usize),
        pressures: (&mut [Pack<R>], usize),
        findings: &mut [Findings<R>],
        pass: impl Fn(&Blocks, Task<'_, R>) -> Findings<R> + Sync,
    ) {
        let Self { blocks, vectors } = self;
        let (count, stride) = (blocks.len(), blocks.stride.max(1));
        let of_blocks = |(values, per_pack)| in_blocks(values, per_pack * blocks.packs, count);
        let history = of_blocks(history).zip(of_blocks(pressures));
        let rows = vectors.par_chunks_mut(stride).zip(forces.par_chunks_mut(stride));
        rows.zip(history).zip(findings).enumerate().for_each(
            |(block, (((moved, forces), (history, pressures)), findings))| {
                let nodes = blocks.nodes(block);
                let (moved, forces) = (&mut moved[..nodes.len()], &mut forces[..nodes.len()]);
                *findings = pass(blocks, Task { block, nodes, moved, forces, history, pressures });
            },
        );
    }
}

/// Splits the history into its blocks; an empty history gives each block an empty part.
fn in_blocks<R: LaneNumber>(
    history: &mut [Pack<R>],
    per_block: usize,
    blocks: usize,
) -> impl IndexedParallelIterator<Item = &mut [Pack<R>]> {
    if history.is_empty() {
        Either::Left(repeat_n((), blocks).map(|()| <&mut [Pack<R>]>::default()))
    } else {
        Either::Right(history.par_chunks_mut(per_block))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_threads_have_as_much_to_do() {
        for (packs, nodes, each) in [
            (63, 4, MOST_PACKS),
            (100, 2, 52),
            (129, 4, 68),
            (160, 4, 40),
            (375, 4, 64),
            (63, 8, MOST_PACKS),
            (70, 8, 36),
        ] {
            assert_eq!(packs_per_block(packs, nodes), each, "{packs}");
        }
        assert!((64..5000).all(|packs| packs_per_block(packs, 4) <= MOST_PACKS));
    }
}
