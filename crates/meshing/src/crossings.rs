//! Self-intersections of a surface: pairs of triangles in which an edge of one pierces the other.
//! Leaves out: triangles that only touch, or lie in one plane.

use pliant_geometry::Vector3;
use rayon::prelude::*;
use rstar::{AABB, RTree, RTreeObject};

use crate::triangles::TriangleMesh;

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
    let boxed = |(number, nodes): (u32, &[u32; 3])| {
        let [a, b, c] = nodes.map(|n| points[n as usize]);
        Boxed { number, low: a.inf(&b).inf(&c), high: a.sup(&b).sup(&c) }
    };
    let tree = RTree::bulk_load((0..).zip(triangles).map(boxed).collect());
    let of = |own: usize| {
        let envelope = boxed((own as u32, &triangles[own])).envelope();
        let near = tree.locate_in_envelope_intersecting(envelope).map(|other| other.number);
        let crossing = |&other: &u32| {
            other as usize > own && meet(points, triangles[own], triangles[other as usize]).is_some()
        };
        let mut others: Vec<u32> = near.filter(crossing).collect();
        others.sort_unstable();
        others.into_iter().map(move |other| [own as u32, other])
    };
    let pairs: Vec<[u32; 2]> = (0..triangles.len()).into_par_iter().flat_map_iter(of).collect();
    let place = pairs.first().and_then(|&[s, t]| meet(points, triangles[s as usize], triangles[t as usize]));
    (pairs, place)
}

impl TriangleMesh {
    /// Whether new triangles would intersect each other or existing ones, except some that would be
    /// removed.
    pub(crate) fn would_cross(&self, new: &[[u32; 3]], gone: &[u32]) -> bool {
        let corners = || new.as_flattened().iter().map(|&n| self.points[n as usize]);
        let Some(start) = corners().next() else { return false };
        let (low, high) = corners().fold((start, start), |(low, high), x| (low.inf(&x), high.sup(&x)));
        let near = |t: &u32| {
            let [a, b, c] = self.corners(*t);
            (0..3).all(|k| a[k].min(b[k]).min(c[k]) <= high[k] && a[k].max(b[k]).max(c[k]) >= low[k])
                && !gone.contains(t)
        };
        let cross = |s: [u32; 3], t: [u32; 3]| meet(&self.points, s, t).is_some();
        let others = self.alive().filter(near).map(|t| self.triangles[t as usize]);
        others.into_iter().any(|other| new.iter().any(|&own| cross(own, other)))
            || new.iter().enumerate().any(|(k, &s)| new[..k].iter().any(|&t| cross(s, t)))
    }
}

/// A point where an edge of one of two triangles pierces the other.
fn meet(points: &[Vector3], s: [u32; 3], t: [u32; 3]) -> Option<Vector3> {
    if s.iter().filter(|n| t.contains(n)).count() > 1 {
        return None;
    }
    [(s, t), (t, s)].into_iter().find_map(|(own, other)| {
        (0..3).find_map(|k| {
            let edge = [own[k], own[(k + 1) % 3]];
            if edge.iter().any(|n| other.contains(n)) {
                return None;
            }
            pierced(edge.map(|n| points[n as usize]), other.map(|n| points[n as usize]))
        })
    })
}

/// Where a segment pierces a triangle, edges included: where a body meets its mirror image, edges cross edges.
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
