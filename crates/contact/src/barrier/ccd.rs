//! Additive continuous collision detection: the part of a motion of four points until two primitives come
//! near (Li, Kaufman and Jiang 2021, algorithm 1). No point of a primitive goes further than its fastest
//! corner. So a part (d − ξ)/l of the motion is safe, with l the sum of the largest ways of both sides. The
//! common motion is subtracted first. The result is never later than the exact time in exact arithmetic;
//! rounding of distances is far below the gap that is kept.

use nalgebra::Vector3;

use super::distance::{Nearest, edge_distance, edge_edge, point_triangle};

/// Two primitives of four points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A point and a triangle.
    PointTriangle,
    /// Two edges.
    EdgeEdge,
}

impl Kind {
    /// The nearest points, by the four points.
    pub fn nearest(self, points: &[Vector3<f64>; 4]) -> Nearest {
        match self {
            Self::PointTriangle => point_triangle(points),
            Self::EdgeEdge => edge_edge(points),
        }
    }

    /// The distance [m] alone, which is found faster.
    pub(super) fn distance(self, points: &[Vector3<f64>; 4]) -> f64 {
        match self {
            Self::PointTriangle => point_triangle(points).distance,
            Self::EdgeEdge => edge_distance(points),
        }
    }

    /// Returns the way [m] between the middles of both, and the gap between their projections on it times its
    /// length [m²]. No distance is less than that gap. Costs a tenth of the distance.
    #[inline]
    fn shadows(self, [a, b, c, d]: [&Vector3<f64>; 4]) -> (Vector3<f64>, f64) {
        match self {
            Self::PointTriangle => {
                let way = a - (b + c + d) / 3.0;
                (way, way.dot(a) - way.dot(b).max(way.dot(c)).max(way.dot(d)))
            }
            Self::EdgeEdge => {
                let way = (a + b) - (c + d);
                let half = 0.5 * (way.dot(&(b - a)).abs() + way.dot(&(d - c)).abs());
                (way, 0.5 * way.norm_squared() - half)
            }
        }
    }

    /// A bound [m] from below of the distance.
    #[inline]
    pub(super) fn bound(self, points: [&Vector3<f64>; 4]) -> f64 {
        let (way, gap) = self.shadows(points);
        if gap > 0.0 { gap / way.norm() } else { 0.0 }
    }

    /// True if the bound of [`shadows`](Self::shadows) is above a length [m].
    #[inline]
    pub(super) fn is_beyond(self, points: [&Vector3<f64>; 4], length: f64) -> bool {
        let (way, gap) = self.shadows(points);
        gap > 0.0 && (length < 0.0 || gap * gap > length * length * way.norm_squared())
    }

    /// Number of points of the first primitive, out of four.
    pub fn split(self) -> usize {
        match self {
            Self::PointTriangle => 1,
            Self::EdgeEdge => 2,
        }
    }

    /// The sum of the largest of four lengths on either side.
    pub fn reach(self, lengths: [f64; 4]) -> f64 {
        let (first, second) = lengths.split_at(self.split());
        let most = |of: &[f64]| of.iter().copied().fold(0.0, f64::max);
        most(first) + most(second)
    }

    /// A bound [m] of how far both primitives go towards each other when their points go by some ways [m].
    #[inline]
    pub(super) fn nearing(self, ways: [&Vector3<f64>; 4]) -> f64 {
        let mean = (ways[0] + ways[1] + ways[2] + ways[3]) / 4.0;
        self.reach(ways.map(|way| (way - mean).norm()))
    }
}

/// Advances at most; where they end is safe, too.
pub(super) const ADVANCES: usize = 10_000;

/// Parameters of the search for a safe part of a motion.
#[derive(Clone, Copy, Debug)]
pub struct Query {
    /// The distance ξ [m] below which the primitives are in each other.
    pub offset: f64,
    /// Growth [m] of the distance ξ over the motion.
    pub rise: f64,
    /// Part of the gap at the start that is to be kept.
    pub keep: f64,
    /// Largest part of the motion to test; 1 is the whole motion.
    pub most: f64,
}

/// Returns the part of a motion, at most `most`, along which at least half of `keep` of the first gap is left
/// everywhere. Where the part is less than `most`, no more than `keep` is left at its end. Zero where there
/// is no gap at the start.
pub fn collision_free_fraction(
    kind: Kind,
    from: &[Vector3<f64>; 4],
    motion: &[Vector3<f64>; 4],
    query: Query,
) -> f64 {
    let Query { offset, rise, keep, most } = query;
    let mean = motion.iter().sum::<Vector3<f64>>() / 4.0;
    let way = kind.reach(motion.map(|p| (p - mean).norm())) + rise.max(0.0);
    if kind.is_beyond(from.each_ref(), offset + way * most / (1.0 - keep)) {
        return most;
    }
    let start = kind.nearest(from).distance - offset;
    if start <= 0.0 {
        return 0.0;
    }
    if (1.0 - keep) * start > way * most {
        return most;
    }
    let (mut part, mut gap) = (0.0, start);
    for _ in 0..ADVANCES {
        part += (gap - 0.5 * keep * start) / way;
        if part >= most {
            return most;
        }
        let points = std::array::from_fn(|i| from[i] + (motion[i] - mean) * part);
        gap = kind.nearest(&points).distance - offset - rise * part;
        if gap <= keep * start {
            break;
        }
    }
    part
}

#[cfg(test)]
mod tests {
    use super::*;
    use pliant_testing::Random;
    use serde_json::Value;

    fn four(of: &Value) -> [Vector3<f64>; 4] {
        let rows = of.as_array().unwrap();
        std::array::from_fn(|i| Vector3::from_fn(|c, _| rows[i][c].as_f64().unwrap()))
    }

    /// The 100 motions of the reference: no hit is missed and no time is later than the exact one. Where a
    /// time is below 0.8 of the exact one, the gap there is at most a tenth of the first gap.
    #[test]
    fn times_of_impact_are_never_late_and_seldom_early() {
        let text = include_str!("../../../../lab/validation/data/coupling/ipc_primitives.json");
        let reference: Value = serde_json::from_str(text).unwrap();
        let (mut early, mut lowest) = (0, 1.0_f64);
        for case in reference["ccd_cases"].as_array().unwrap() {
            let kind = if case["kind"] == "pt" { Kind::PointTriangle } else { Kind::EdgeEdge };
            let (from, to) = (four(&case["x0"]), four(&case["x1"]));
            let motion: [Vector3<f64>; 4] = std::array::from_fn(|i| to[i] - from[i]);
            let found = collision_free_fraction(
                kind,
                &from,
                &motion,
                Query { offset: 0.0, rise: 0.0, keep: 0.1, most: 1.0 },
            );
            if let Some(exact) = case["toi"].as_f64().filter(|_| case["hit"] == true) {
                assert!(found <= exact, "{} {}: {found} > {exact}", case["id"], case["category"]);
                let first = kind.nearest(&from).distance;
                let then = kind.nearest(&std::array::from_fn(|i| from[i] + motion[i] * found)).distance;
                assert!(found >= 0.8 * exact || then <= 0.1 * first, "{} {found} {exact}", case["id"]);
                early += u32::from(found < 0.8 * exact);
                lowest = lowest.min(found / exact);
            }
        }
        println!("{early} of 72 hits below 0.8 of the exact time, the lowest at {lowest:.2} of it");
    }

    /// A motion is never allowed beyond an intersection, from any start, with any offset.
    #[test]
    fn what_is_allowed_keeps_a_gap_everywhere_on_the_way() {
        let mut random = Random::new(3);
        for number in 0..10_000 {
            let kind = if number % 2 == 0 { Kind::PointTriangle } else { Kind::EdgeEdge };
            let from: [Vector3<f64>; 4] = std::array::from_fn(|_| Vector3::from(random.vector()));
            let motion: [Vector3<f64>; 4] = std::array::from_fn(|_| 2.0 * Vector3::from(random.vector()));
            let start = kind.nearest(&from).distance;
            let offset = start * random.part();
            // Every third distance to keep grows or shrinks on the way.
            let rise = if number % 3 == 0 { start * (2.0 * random.part() - 1.0) } else { 0.0 };
            let part =
                collision_free_fraction(kind, &from, &motion, Query { offset, rise, keep: 0.1, most: 1.0 });
            for step in 0..=20 {
                let at = part * f64::from(step) / 20.0;
                let distance = kind.nearest(&std::array::from_fn(|i| from[i] + motion[i] * at)).distance;
                let gap = distance - offset - rise * at;
                assert!(gap > 0.0499 * (start - offset), "{number}: {gap}");
            }
        }
    }

    /// Never more than the distance, and exact where the middles face each other.
    #[test]
    fn bounds_are_below_distances() {
        let mut random = Random::new(4);
        for number in 0..100_000 {
            let kind = if number % 2 == 0 { Kind::PointTriangle } else { Kind::EdgeEdge };
            let points: [Vector3<f64>; 4] = std::array::from_fn(|_| Vector3::from(random.vector()));
            let (bound, distance) = (kind.bound(points.each_ref()), kind.nearest(&points).distance);
            assert!(bound <= distance * (1.0 + 1e-12), "{number}: {bound} {distance}");
            assert!(!kind.is_beyond(points.each_ref(), distance * (1.0 + 1e-12)), "{number}");
            assert!(kind.is_beyond(points.each_ref(), 0.99 * bound) || bound == 0.0, "{number}");
        }
        let crossed = [[-1.0, 0.0, 0.5], [1.0, 0.0, 0.5], [0.0, -1.0, 0.0], [0.0, 1.0, 0.0]];
        assert_eq!(Kind::EdgeEdge.bound(crossed.map(Vector3::from).each_ref()), 0.5);
    }

    /// A point at 1 km/s goes through no sheet of 10 µm.
    #[test]
    fn a_fast_point_passes_no_thin_sheet() {
        let sheet = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]].map(Vector3::from);
        let from = [Vector3::new(0.1, 0.0, 1e-5), sheet[0], sheet[1], sheet[2]];
        let motion = [Vector3::new(0.0, 0.0, -10.0), Vector3::zeros(), Vector3::zeros(), Vector3::zeros()];
        let part = collision_free_fraction(
            Kind::PointTriangle,
            &from,
            &motion,
            Query { offset: 0.0, rise: 0.0, keep: 0.1, most: 1.0 },
        );
        assert!(part > 0.0 && part < 1e-6, "{part}");
    }
}
