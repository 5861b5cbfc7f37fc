//! Work that a fit may take, counted in searches for the nearest point of the target. The count, and so the
//! shells, are the same on every machine with any number of threads. The count does not grow with the number
//! of triangles of the target: the number of its sampled points is bounded (`target`). So the cost of a round
//! depends on its shells only.

/// Cost of a search for the nearest place of the shells, in searches for the nearest point of the target.
pub(super) const LANDING: usize = 4;

/// Cost of a row of the least-squares step, in the same unit. A check of one piece of a shell for crossings
/// costs 1.
pub(super) const ROW: usize = 4;

/// Work done so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Effort {
    done: usize,
    most: usize,
}

impl Effort {
    /// Searches of a fit to a distance: 5 to 50 s of one core, depending on the surface.
    pub(super) const MOST: usize = 12_000_000;

    /// Searches of a fit to a number of shells, which are exchanged then.
    pub(super) const MOST_TO_A_NUMBER: usize = 32_000_000;

    pub(super) fn new(most: usize) -> Self {
        Self { done: 0, most }
    }

    /// Returns the effort with at least a part of the whole left.
    pub(super) fn with_left(self, part: f64) -> Self {
        Self { done: self.done.min(((1.0 - part) * self.most as f64) as usize), ..self }
    }

    /// Adds a number of searches of a cost.
    pub(super) fn search(&mut self, number: usize, weight: usize) {
        self.done = self.done.saturating_add(number * weight);
    }

    pub(super) fn is_spent(&self) -> bool {
        self.done >= self.most
    }

    /// The part of the work that is done.
    pub(super) fn part(&self) -> f64 {
        self.done as f64 / self.most as f64
    }
}
