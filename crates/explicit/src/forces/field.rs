//! The force field of a solid.

use pliant_mechanics::prony::Prony;
use pliant_mechanics::tensor::Vector;

use super::blocks::{Blocks, Quad};
use super::findings::Findings;
use crate::history::History;
use crate::lanes::Processor;

/// Internal forces of one solid, compiled for its element and number type.
pub(crate) trait ForceField<R>: Send + Sync {
    /// The blocks of its cells.
    fn blocks(&self) -> &Blocks;

    /// Forces [N] of each block of cells on the nodes of the block, in [`Blocks::room`] entries. With
    /// `history` the stress relaxes and the history advances to this state; an empty `history` gives the
    /// instantaneous elastic response. `findings` has one entry per block.
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
