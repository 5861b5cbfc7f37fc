//! Bounds on the motion of nodes, over all of them at once, so that no contact looks at a node far from all
//! things.

use std::ops::Range;

use pliant_mechanics::tensor::Vector;

use crate::lanes::LaneNumber;
use crate::lanes::{LaneWork, Lanes, Processor};

/// Components that are compared at once.
const WIDTH: usize = 32;

/// The nodes of a model at the beginning of a step.
#[derive(Clone, Copy)]
pub(crate) struct Nodes<'a, R> {
    /// Displacement of each [m].
    pub displacement: &'a [Vector<R>],
    /// The increment that led there [m].
    pub increment: &'a [Vector<R>],
    /// Length of the step over the length of the step before.
    pub ratio: f64,
    pub processor: Processor,
}

impl<R: LaneNumber> Nodes<'_, R> {
    /// Bounds [m] on the motion of these nodes in the step, from that in the step before, and on their motion
    /// since they were listed.
    pub fn ways(&self, nodes: Range<usize>, listed: &[Vector<R>]) -> [f64; 2] {
        let increment = self.increment[nodes.clone()].as_flattened();
        let (displacement, listed) = (self.displacement[nodes].as_flattened(), listed.as_flattened());
        let [way, moved] = self.processor.run(Largest { increment, displacement, listed });
        [self.ratio * (3.0 * way).sqrt(), (3.0 * moved).sqrt()]
    }
}

/// The largest square of an increment's component, and of the difference of displacements.
struct Largest<'a, R> {
    increment: &'a [R],
    displacement: &'a [R],
    listed: &'a [R],
}

impl<R: LaneNumber> LaneWork<R> for Largest<'_, R> {
    type Output = [f64; 2];

    #[inline(always)]
    fn run<L: Lanes<R>>(self) -> [f64; 2] {
        let Self { increment, displacement, listed } = self;
        let (mut way, mut moved) = ([R::ZERO; WIDTH], [R::ZERO; WIDTH]);
        let (blocks, rest) = increment.as_chunks::<WIDTH>();
        for block in blocks {
            take_larger(&mut way, block, &[R::ZERO; WIDTH]);
        }
        take_larger(&mut way, rest, &[R::ZERO; WIDTH][..rest.len()]);
        let ((now, rest_now), (then, rest_then)) =
            (displacement.as_chunks::<WIDTH>(), listed.as_chunks::<WIDTH>());
        for (now, then) in now.iter().zip(then) {
            take_larger(&mut moved, now, then);
        }
        take_larger(&mut moved, rest_now, rest_then);
        [way, moved].map(|lanes| lanes.iter().map(|x| x.to_f64()).fold(0.0, f64::max))
    }
}

/// Raises `most` to the squares of differences where these are larger.
#[inline(always)]
fn take_larger<R: LaneNumber>(most: &mut [R; WIDTH], a: &[R], b: &[R]) {
    for (most, (&a, &b)) in most.iter_mut().zip(a.iter().zip(b)) {
        let squared = (a - b) * (a - b);
        *most = if squared > *most { squared } else { *most };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pliant_testing::Random;

    /// Both bounds hold for every node, and are at most √3 times the largest motion.
    #[test]
    fn ways_are_bounds() {
        let mut random = Random::new(5);
        for count in [1, 7, 11, 200] {
            let mut field = || -> Vec<Vector<f32>> {
                (0..count).map(|_| std::array::from_fn(|_| random.half() as f32)).collect()
            };
            let (displacement, increment, listed) = (field(), field(), field());
            let processor = Processor::detect();
            let nodes = Nodes { displacement: &displacement, increment: &increment, ratio: 0.5, processor };
            for first in [0, count / 2] {
                let [way, moved] = nodes.ways(first..count, &listed[first..]);
                let length = |v: Vector<f32>| v.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>().sqrt();
                let longest = |lengths: &mut dyn Iterator<Item = f64>| lengths.fold(0.0, f64::max);
                let goes = 0.5 * longest(&mut increment[first..].iter().map(|&v| length(v)));
                let between = |k: usize| [0, 1, 2].map(|c| displacement[k][c] - listed[k][c]);
                let went = longest(&mut (first..count).map(|k| length(between(k))));
                for (bound, true_way) in [(way, goes), (moved, went)] {
                    assert!(
                        bound >= true_way * (1.0 - 1e-6) && bound <= 1.733 * true_way,
                        "{bound} {true_way}"
                    );
                }
            }
        }
    }
}
