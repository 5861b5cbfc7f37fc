//! A tree of boxes around moving things. Boxes are computed anew from the leaves up when the things have
//! moved ([`Tree::refit`]). The tree is sorted anew when the boxes have grown into each other. The tree is a
//! flat array with children after their parent, so that a sweep from its end is a refit.

use nalgebra::Vector3;

/// A box along the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Its lowest corner [m].
    pub low: Vector3<f64>,
    /// Its highest corner [m].
    pub high: Vector3<f64>,
}

impl Bounds {
    /// The least box around points [m].
    #[inline]
    pub fn of<const N: usize>(points: [Vector3<f64>; N]) -> Self {
        let start = Self { low: points[0], high: points[0] };
        points[1..]
            .iter()
            .fold(start, |bounds, x| Self { low: lower(&bounds.low, x), high: higher(&bounds.high, x) })
    }

    /// The box with a margin [m] on all sides.
    #[inline]
    pub fn grown(&self, margin: f64) -> Self {
        Self { low: self.low.add_scalar(-margin), high: self.high.add_scalar(margin) }
    }

    /// True if two boxes share a point.
    #[inline]
    pub fn touches(&self, other: &Self) -> bool {
        (0..3).all(|c| self.low[c] <= other.high[c] && other.low[c] <= self.high[c])
    }

    /// The largest way [m] along an axis from one box to the other; negative if they overlap.
    #[inline]
    pub fn apart(&self, other: &Self) -> f64 {
        (0..3)
            .map(|c| (other.low[c] - self.high[c]).max(self.low[c] - other.high[c]))
            .fold(f64::MIN, f64::max)
    }

    /// The least box around two.
    #[inline]
    pub fn with(&self, other: &Self) -> Self {
        Self { low: lower(&self.low, &other.low), high: higher(&self.high, &other.high) }
    }

    /// Half of its surface [m²].
    #[inline]
    fn area(&self) -> f64 {
        let size = self.high - self.low;
        size.x * size.y + size.y * size.z + size.z * size.x
    }
}

/// The lesser of each component. Places are finite: the handling of NaN in `f64::min` would take a sixth of a
/// refit.
#[inline]
fn lower(a: &Vector3<f64>, b: &Vector3<f64>) -> Vector3<f64> {
    a.zip_map(b, |a, b| if a < b { a } else { b })
}

/// The greater of each component.
#[inline]
fn higher(a: &Vector3<f64>, b: &Vector3<f64>) -> Vector3<f64> {
    a.zip_map(b, |a, b| if a > b { a } else { b })
}

/// Things at most in a part that is not halved.
const FEW: usize = 4;
/// Surface of all boxes at which the tree is sorted anew, over the surface in a newly sorted tree.
const WORN: f64 = 1.5;

#[derive(Clone, Debug)]
struct Part {
    bounds: Bounds,
    first: u32,
    end: u32,
    /// The part after it and all within it: the next one if it is not halved.
    after: u32,
}

/// A tree of the boxes of things that are numbered from 0.
#[derive(Clone, Debug, Default)]
pub struct Tree {
    parts: Vec<Part>,
    /// The things in the order of the leaves.
    order: Vec<u32>,
    /// Surface of all boxes [m²] when the tree was sorted.
    surface: f64,
}

impl Tree {
    /// Sorts things by the middles of their boxes, halved along the longest axis until few are left.
    pub fn new(count: usize, bounds: impl Fn(u32) -> Bounds) -> Self {
        let mut tree = Self { parts: Vec::new(), order: (0..count as u32).collect(), surface: 0.0 };
        tree.sort(&bounds);
        tree
    }

    fn sort(&mut self, bounds: &impl Fn(u32) -> Bounds) {
        self.parts.clear();
        let boxes: Vec<Bounds> = (0..self.order.len() as u32).map(bounds).collect();
        if !boxes.is_empty() {
            let mut order = std::mem::take(&mut self.order);
            order.sort_unstable();
            self.halve(&mut order, 0, &boxes);
            self.order = order;
        }
        self.surface = self.parts.iter().map(|part| part.bounds.area()).sum();
    }

    fn halve(&mut self, things: &mut [u32], first: usize, boxes: &[Bounds]) {
        let around = things.iter().map(|&thing| boxes[thing as usize]).reduce(|a, b| a.with(&b));
        let Some(bounds) = around else { return };
        let number = self.parts.len();
        self.parts.push(Part {
            bounds,
            first: first as u32,
            end: (first + things.len()) as u32,
            after: number as u32 + 1,
        });
        if things.len() <= FEW {
            return;
        }
        let axis = (bounds.high - bounds.low).imax();
        let middle = |thing: u32| boxes[thing as usize].low[axis] + boxes[thing as usize].high[axis];
        let half = things.len() / 2;
        things.select_nth_unstable_by(half, |&a, &b| middle(a).total_cmp(&middle(b)).then(a.cmp(&b)));
        let (left, right) = things.split_at_mut(half);
        self.halve(left, first, boxes);
        self.halve(right, first + half, boxes);
        self.parts[number].after = self.parts.len() as u32;
    }

    /// Takes the boxes of the same things at other places.
    pub fn refit(&mut self, bounds: impl Fn(u32) -> Bounds) {
        let mut surface = 0.0;
        for number in (0..self.parts.len()).rev() {
            let Part { first, end, after, .. } = self.parts[number];
            let around = if after as usize == number + 1 {
                // A loop, since the compiler leaves `reduce` as a call.
                let [one, others @ ..] = &self.order[first as usize..end as usize] else { continue };
                let mut around = bounds(*one);
                for &thing in others {
                    around = around.with(&bounds(thing));
                }
                around
            } else {
                let [left, right] = [number + 1, self.parts[number + 1].after as usize];
                self.parts[left].bounds.with(&self.parts[right].bounds)
            };
            surface += around.area();
            self.parts[number].bounds = around;
        }
        if surface > WORN * self.surface {
            self.sort(&bounds);
        }
    }

    /// The things in leaves that touch a box. Whether a thing itself does is for the caller to see.
    pub fn near(&self, wanted: &Bounds, mut found: impl FnMut(u32)) {
        let mut number = 0;
        while let Some(part) = self.parts.get(number) {
            let touches = part.bounds.touches(wanted);
            let next = number + 1;
            if touches && part.after as usize == next {
                self.order[part.first as usize..part.end as usize].iter().for_each(|&thing| found(thing));
            }
            number = if touches { next } else { part.after as usize };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pliant_testing::Random;

    /// The tree finds the same things as a test of all, after any motion. The order of things does not depend
    /// on how often the tree was sorted.
    #[test]
    fn what_is_near_is_what_brute_force_finds() {
        let mut random = Random::new(5);
        let mut point = || Vector3::from_fn(|_, _| random.number());
        let mut places: Vec<Vector3<f64>> = (0..500).map(|_| point()).collect();
        let around = |places: &[Vector3<f64>], thing: u32| Bounds::of([places[thing as usize]]).grown(0.05);
        let mut tree = Tree::new(places.len(), |thing| around(&places, thing));
        for _ in 0..20 {
            for _ in 0..10 {
                let wanted = Bounds::of([point(), point()]);
                let mut found = Vec::new();
                tree.near(&wanted, |thing| found.push(thing));
                found.retain(|&thing| around(&places, thing).touches(&wanted));
                found.sort_unstable();
                let indices = 0..places.len() as u32;
                let brute: Vec<u32> =
                    indices.filter(|&thing| around(&places, thing).touches(&wanted)).collect();
                assert_eq!(found, brute);
            }
            places.iter_mut().for_each(|place| *place += 0.1 * point());
            tree.refit(|thing| around(&places, thing));
        }
        assert!(Tree::new(0, |_| Bounds::of([Vector3::zeros()])).parts.is_empty());
    }
}
