//! Disjoint sets: connected items, found pair by pair.

/// Disjoint sets of the numbers from 0 (union by smaller root, paths halved).
///
/// ```
/// let mut sets = pliant_geometry::DisjointSets::new(4);
/// sets.join(3, 1);
/// assert_eq!((sets.root(3), sets.root(0), sets.count()), (1, 0, 3));
/// ```
#[derive(Clone, Debug)]
pub struct DisjointSets(Vec<usize>);

impl DisjointSets {
    /// Makes a set of each number below `count`.
    pub fn new(count: usize) -> Self {
        Self((0..count).collect())
    }

    /// Finds the smallest number of the set of a number.
    pub fn root(&mut self, mut at: usize) -> usize {
        while self.0[at] != at {
            self.0[at] = self.0[self.0[at]];
            at = self.0[at];
        }
        at
    }

    /// Joins the sets of two numbers.
    pub fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b)] = a.min(b);
    }

    /// Counts the sets.
    pub fn count(&self) -> usize {
        self.0.iter().enumerate().filter(|(at, root)| at == *root).count()
    }
}
