//! Self-intersections of a surface: pairs of triangles in which an edge of one pierces the other.
//! Leaves out: triangles that only touch, or lie in one plane.

use pliant_geometry::Vector3;
use rayon::prelude::*;
use rstar::{AABB, RTree, RTreeObject};

use crate::surface::triangles::TriangleMesh;

struct Boxed {
    number: u32,
    low: Vector3,
    high: Vector3,
}

impl RTreeObject for Boxed {
    type Envelope = AABB<[f64; 3]>;

    fn envelope(&self) -> Self::Envelope {
        AABB::from_corners(self.low.into(), self.high.into())
    }
}

/// Pairs of intersecting triangles, smaller number first, increasing, and a point of the first intersection
/// [m].
pub(crate) fn crossings(points: &[Vector3], triangles: &[[u32; 3]]) -> (Vec<[u32; 2]>, Option<Vector3>) {
    crossing_groups(points, triangles, 1, |_| true)
}

/// Pairs of intersecting groups of `each` consecutive triangles. A group that crosses itself is a pair with
/// itself. A pair counts if at least one of its groups is looked at.
pub(crate) fn crossing_groups(
    points: &[Vector3],
    triangles: &[[u32; 3]],
    each: usize,
    is_looked_at: impl Fn(u32) -> bool + Sync,
) -> (Vec<[u32; 2]>, Option<Vector3>) {
    let place_of = |n: u32| points[n as usize];
    let boxed = |nodes: &[[u32; 3]]| {
        let start = points[nodes[0][0] as usize];
        nodes.as_flattened().iter().map(|&n| &points[n as usize]).fold([start; 2], widened)
    };
    let boxes: Vec<[Vector3; 2]> = triangles.par_chunks(each).map(boxed).collect();
    let numbered = |(number, &[low, high]): (u32, &[Vector3; 2])| Boxed { number, low, high };
    let tree = RTree::bulk_load((0..).zip(&boxes).map(numbered).collect());
    let group = |number: u32| &triangles[number as usize * each..][..each];
    let within = |number: u32, [low, high]: [Vector3; 2]| {
        let reaches = move |nodes: &&[u32; 3]| {
            let [a, b, c] = nodes.map(|n| &points[n as usize]);
            (0..3).all(|k| a[k].min(b[k]).min(c[k]) <= high[k] && a[k].max(b[k]).max(c[k]) >= low[k])
        };
        group(number).iter().filter(reaches)
    };
    let meeting = |first: u32, other: u32| {
        let [a, b] = [first, other].map(|number| boxes[number as usize]);
        let both = [a[0].sup(&b[0]), a[1].inf(&b[1])];
        within(first, both).find_map(|&s| {
            let near = s.iter().map(|&n| &points[n as usize]).fold([points[s[0] as usize]; 2], widened);
            within(other, [near[0].sup(&both[0]), near[1].inf(&both[1])]).find_map(|&t| meet(&place_of, s, t))
        })
    };
    let of = |first: u32| {
        let [low, high] = boxes[first as usize];
        let near = tree.locate_in_envelope_intersecting(AABB::from_corners(low.into(), high.into()));
        let looked = is_looked_at(first);
        let others = near.map(|other| other.number).filter(|&other| {
            (other > first || each > 1 && other == first)
                && (looked || is_looked_at(other))
                && meeting(first, other).is_some()
        });
        let mut others: Vec<u32> = others.collect();
        others.sort_unstable();
        others.into_iter().map(move |other| [first, other])
    };
    let pairs: Vec<[u32; 2]> = (0..boxes.len() as u32).into_par_iter().flat_map_iter(of).collect();
    let place = pairs.first().and_then(|&[first, other]| meeting(first, other));
    (pairs, place)
}

/// Grows a box to hold a point.
pub(crate) fn widened([low, high]: [Vector3; 2], x: &Vector3) -> [Vector3; 2] {
    [low.inf(x), high.sup(x)]
}

impl TriangleMesh {
    /// The box of triangles [m]; `None` without triangles.
    pub(crate) fn bounds(&self, triangles: &[[u32; 3]]) -> Option<[Vector3; 2]> {
        let start = self.points[*triangles.as_flattened().first()? as usize];
        let corners = triangles.as_flattened().iter().map(|&n| self.points[n as usize]);
        Some(corners.fold([start; 2], |extent, x| widened(extent, &x)))
    }

    /// True if new triangles would intersect each other or existing ones, except some that would be removed.
    pub(crate) fn would_cross(&self, new: &[[u32; 3]], gone: &[u32]) -> bool {
        self.would_cross_among(new, gone, self.alive())
    }

    /// True if new triangles would intersect each other or some of the existing ones, except those that would
    /// be removed.
    pub(crate) fn would_cross_among(
        &self,
        new: &[[u32; 3]],
        gone: &[u32],
        existing: impl Iterator<Item = u32>,
    ) -> bool {
        let Some([low, high]) = self.bounds(new) else { return false };
        let near = |t: &u32| {
            let [a, b, c] = self.corners(*t);
            (0..3).all(|k| a[k].min(b[k]).min(c[k]) <= high[k] && a[k].max(b[k]).max(c[k]) >= low[k])
                && !gone.contains(t)
        };
        let cross = |s: [u32; 3], t: [u32; 3]| meet(&|n| self.points[n as usize], s, t).is_some();
        let mut others = existing.filter(near).map(|t| self.triangles[t as usize]);
        others.any(|other| new.iter().any(|&triangle| cross(triangle, other)))
            || new.iter().enumerate().any(|(k, &s)| new[..k].iter().any(|&t| cross(s, t)))
    }
}

/// A point where an edge of one of two triangles pierces the other; `at` gives corners.
pub(crate) fn meet(at: &(impl Fn(u32) -> Vector3 + ?Sized), s: [u32; 3], t: [u32; 3]) -> Option<Vector3> {
    if s.iter().filter(|n| t.contains(n)).count() > 1 {
        return None;
    }
    let reaching = |&(piercing, other): &([u32; 3], [u32; 3])| !is_beside(at, other, piercing);
    [(s, t), (t, s)].into_iter().filter(reaching).find_map(|(piercing, other)| {
        (0..3).find_map(|k| {
            let edge = [piercing[k], piercing[(k + 1) % 3]];
            if edge.iter().any(|n| other.contains(n)) {
                return None;
            }
            pierced(edge.map(at), other.map(at))
        })
    })
}

/// True if a triangle lies on one side of the plane of another, or touches it. Then no edge of the triangle
/// pierces the other.
fn is_beside(at: &(impl Fn(u32) -> Vector3 + ?Sized), plane: [u32; 3], triangle: [u32; 3]) -> bool {
    let [a, b, c] = plane.map(at);
    let normal = (b - a).cross(&(c - a));
    let heights = triangle.map(|n| if plane.contains(&n) { 0.0 } else { normal.dot(&(at(n) - a)) });
    heights.iter().all(|&h| h >= 0.0) || heights.iter().all(|&h| h <= 0.0)
}

/// Point where a segment pierces a triangle, edges included: where a body meets its mirror image, edges cross
/// edges.
fn pierced([p, q]: [Vector3; 2], [a, b, c]: [Vector3; 3]) -> Option<Vector3> {
    // Six times signed volumes; values below round-off count as touching.
    let volume = |u: &Vector3, v: &Vector3, w: &Vector3, x: &Vector3| (v - u).cross(&(w - u)).dot(&(x - u));
    let size = [b - a, c - a, p - a, q - a].iter().map(|x| x.amax()).fold(0.0, f64::max);
    let least = 1e-12 * size.powi(3);
    let (above, below) = (volume(&a, &b, &c, &p), volume(&a, &b, &c, &q));
    if !(above > least && below < -least || above < -least && below > least) {
        return None;
    }
    let sides = [volume(&p, &q, &a, &b), volume(&p, &q, &b, &c), volume(&p, &q, &c, &a)];
    let inside = sides.iter().all(|&x| x >= -least) || sides.iter().all(|&x| x <= least);
    inside.then(|| p + (q - p) * (above / (above - below)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fans of triangles at places of a sequence that does not repeat within the test.
    #[test]
    fn groups_cross_where_triangles_of_theirs_do() {
        let place =
            |k: usize| [0.618, 0.414, 0.732].map(|x| (x * k as f64 + 0.1 * (k * k % 17) as f64).fract());
        let points: Vec<Vector3> = (0..180).map(|k| Vector3::from(place(k))).collect();
        let triangles: Vec<[u32; 3]> = (0..60)
            .flat_map(|k| [[3 * k, 3 * k + 1, 3 * k + 2], [3 * k, 3 * k + 2, (3 * k + 4) % 180]])
            .collect();
        let singles = crossings(&points, &triangles).0;
        for (each, odd_only) in [(2, false), (4, false), (4, true)] {
            let is_looked_at = |group: u32| !odd_only || group % 2 == 1;
            let mut expected: Vec<[u32; 2]> = singles.iter().map(|pair| pair.map(|t| t / each)).collect();
            expected.retain(|pair| pair.iter().any(|&group| is_looked_at(group)));
            expected.sort_unstable();
            expected.dedup();
            assert!(expected.len() > 10 && expected.len() < singles.len());
            assert_eq!(crossing_groups(&points, &triangles, each as usize, is_looked_at).0, expected);
        }
    }

    #[test]
    fn two_triangles_cross_touch_or_share_an_edge() {
        let points = [
            [0.0, 0.0, 0.0],
            [2.0, 0.0, 0.0],
            [0.0, 2.0, 0.0],
            [0.5, 0.5, -1.0],
            [0.5, 0.5, 1.0],
            [3.0, 3.0, 1.0],
            [0.5, 0.5, 0.0],
        ]
        .map(Vector3::from);
        let (pairs, place) = crossings(&points, &[[0, 1, 2], [3, 4, 5]]);
        assert_eq!(pairs, [[0, 1]]);
        // Where the long edge of the first passes through the second.
        assert!((place.unwrap() - Vector3::new(1.0, 1.0, 0.0)).norm() < 1e-12);
        // A corner on the inside of the other, an edge in common, a corner in common.
        for triangles in [[[0, 1, 2], [6, 4, 5]], [[0, 1, 2], [0, 1, 4]], [[0, 1, 2], [0, 4, 5]]] {
            assert!(crossings(&points, &triangles).0.is_empty(), "{triangles:?}");
        }
    }
}
