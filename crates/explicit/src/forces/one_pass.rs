//! Elements whose forces are found in one pass over the blocks of cells.

use pliant_mechanics::prony::Prony;
use pliant_mechanics::tensor::Vector;

use super::blocks::{Blocks, Moved, Quad, Task};
use super::field::ForceField;
use super::findings::Findings;
use crate::history::History;
use crate::lanes::LaneNumber;
use crate::lanes::{LaneWork, Lanes, Processor};
use crate::relaxation::Relaxation;

/// Constants of an element's cells from step to step.
pub(super) trait Element<R: LaneNumber>: Send + Sync {
    /// Packs of history for a pack of cells, and for a pack of their pressures.
    fn slots(&self) -> [usize; 2];

    /// The coefficients of its relaxation.
    fn relaxation(&mut self) -> &mut Relaxation<R>;

    /// The pass over a block, in lanes; inlined into each kind of lanes.
    fn pass<L: Lanes<R>>(&self, displacement: &[Vector<R>], task: Task<'_, R>) -> Findings<R>;
}

/// The force field of such an element.
pub(super) struct OnePass<R, E> {
    processor: Processor,
    moved: Moved<R>,
    element: E,
}

impl<R: LaneNumber, E: Element<R>> OnePass<R, E> {
    pub(super) fn of(blocks: Blocks, element: E) -> Self {
        Self { processor: Processor::detect(), moved: Moved::new(blocks), element }
    }
}

/// A pass over the cells of a block.
struct Pass<'a, R, E> {
    element: &'a E,
    displacement: &'a [Vector<R>],
    task: Task<'a, R>,
}

impl<R: LaneNumber, E: Element<R>> LaneWork<R> for Pass<'_, R, E> {
    type Output = Findings<R>;

    #[inline(always)]
    fn run<L: Lanes<R>>(self) -> Findings<R> {
        self.element.pass::<L>(self.displacement, self.task)
    }
}

impl<R: LaneNumber, E: Element<R>> ForceField<R> for OnePass<R, E> {
    fn blocks(&self) -> &Blocks {
        &self.moved.blocks
    }
    fn evaluate(
        &mut self,
        displacement: &[Vector<R>],
        history: &mut History<R>,
        forces: &mut [Quad<R>],
        findings: &mut [Findings<R>],
    ) {
        let Self { processor, moved, element } = self;
        let [of_cells, of_pressures] = element.slots();
        let pressures = (history.pressures.as_mut_slice(), of_pressures);
        let history = (history.cells.as_mut_slice(), of_cells);
        moved.for_each(forces, history, pressures, findings, |_, task| {
            processor.run(Pass { element: &*element, displacement, task })
        });
    }
    fn set_step(&mut self, prony: &Prony, step: f64) {
        self.element.relaxation().set_step(prony, step);
    }
    fn set_processor(&mut self, processor: Processor) {
        self.processor = processor;
    }
}
