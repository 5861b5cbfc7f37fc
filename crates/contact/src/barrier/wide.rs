//! Pairs that may come near while nodes stay within wide skins: found by trees of boxes, and kept over lists and steps. Lists are chosen from
//! them by distances alone, in the order of their numbers, so that what is in a list does not depend on when these pairs were found.

use nalgebra::Vector3;

use super::advance::Kind;
use super::surfaces::{BarrierSide, around};

/// The wide skin of a node over that of a list.
const WIDER: f64 = 2.5;
/// By how much it is wider at most, and its least, over the distance of the barrier.
const MORE: f64 = 10.0;
const LEAST: f64 = 4.0;
/// The part of the wide skin of before that it is at least.
const KEPT: f64 = 0.5;
/// What round-off takes of a distance at most, over it.
pub(super) const ROUND_OFF: f64 = 1e-9;

/// Pairs of numbers, by the first.
#[derive(Clone, Debug, Default)]
pub(super) struct Apart {
    /// Where those of each first number begin.
    start: Vec<u32>,
    /// Second numbers, increasing for each first one.
    second: Vec<u32>,
}

impl Apart {
    /// Of pairs whose first numbers are below a count.
    pub fn new(mut pairs: Vec<[u32; 2]>, count: usize) -> Self {
        pairs.sort_unstable();
        let start = (0..=count as u32).map(|first| pairs.partition_point(|pair| pair[0] < first) as u32);
        Self { start: start.collect(), second: pairs.iter().map(|pair| pair[1]).collect() }
    }

    /// How many pairs there are.
    pub fn len(&self) -> usize {
        self.second.len()
    }

    /// The second numbers of a first one.
    fn of(&self, first: u32) -> &[u32] {
        match self.start.get(first as usize..first as usize + 2) {
            Some(&[from, to]) => &self.second[from as usize..to as usize],
            _ => &[],
        }
    }
}

/// What sorts of pairs there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sort {
    /// A point of a side, by its number, and a face of the other.
    Point(usize),
    /// Edges of both.
    Edges,
}

/// A pair by the numbers of its primitives, and a bound [m] from below of its distance when it was found.
#[derive(Clone, Copy, Debug)]
struct Pair {
    numbers: [u32; 2],
    distance: f64,
}

/// Pairs of the sides of a contact.
#[derive(Clone, Debug)]
pub(super) struct Wide {
    /// Points of the first side, of the second, and edges; where each sort ends.
    pairs: Vec<Pair>,
    ends: [usize; 3],
    /// Of all nodes: skins [m], and places [m] when pairs were found; none before that.
    skin: Vec<f64>,
    place: Vec<Vector3<f64>>,
    /// The distance [m] within which they were found, beside skins.
    within: f64,
    /// Of each face or edge the number, from 1 on, of the point or edge for which it was last left out.
    left_out: Vec<u32>,
    /// How far [m] nodes have gone since, with the skins of a list; the same of the primitives of both sides.
    reach: Vec<f64>,
    of_points: [Vec<f64>; 2],
    of_faces: [Vec<f64>; 2],
    of_edges: [Vec<f64>; 2],
}

/// The surface on the other side of one.
pub(super) fn other(sides: &[BarrierSide], side: usize) -> &BarrierSide {
    if sides.len() == 1 { &sides[0] } else { &sides[1 - side] }
}

/// How far [m] the whole surface goes that touches itself: what its parts have in common.
pub(super) fn common(sides: &[BarrierSide], motion: impl Fn(u32) -> Vector3<f64>) -> Vector3<f64> {
    let points = &sides[0].points;
    if sides.len() > 1 || points.is_empty() {
        return Vector3::zeros();
    }
    points.iter().map(|&node| motion(node)).sum::<Vector3<f64>>() / points.len() as f64
}

impl Wide {
    /// For so many nodes; nothing is found yet.
    pub fn new(sides: &[BarrierSide], nodes: usize) -> Self {
        let most = sides.iter().map(|side| side.faces.len().max(side.edges.len())).max().unwrap_or(0);
        Self {
            pairs: Vec::new(),
            ends: [0; 3],
            skin: vec![0.0; nodes],
            place: Vec::new(),
            within: 0.0,
            left_out: vec![0; most],
            reach: vec![0.0; nodes],
            of_points: Default::default(),
            of_faces: Default::default(),
            of_edges: Default::default(),
        }
    }

    /// Numbers of the pairs within a distance [m] of each other at places [m]: points with faces of one surface, and edges.
    pub fn within(
        &mut self,
        sides: &mut [BarrierSide],
        place: &[Vector3<f64>],
        within: f64,
    ) -> [Vec<[u32; 2]>; 2] {
        self.skin.fill(0.0);
        self.find(sides, &Default::default(), place, within);
        let near = |sort: Sort, own: &[Pair]| {
            let distance = |pair: &&Pair| {
                let points = sort.nodes(sides, pair.numbers).map(|node| place[node as usize]);
                sort.kind().nearest(&points).distance < within
            };
            own.iter().filter(distance).map(|pair| pair.numbers).collect()
        };
        let found = [
            near(Sort::Point(0), &self.pairs[..self.ends[0]]),
            near(Sort::Edges, &self.pairs[self.ends[1]..]),
        ];
        self.place.clear();
        found
    }

    /// Calls back with the pairs that may be within a distance [m] and the skins [m] of their nodes at places [m], sort by sort in the order of
    /// their numbers, and with more. Finds pairs anew if nodes have gone too far, with wide skins by the distance
    /// of the barrier [m].
    pub fn each(
        &mut self,
        sides: &mut [BarrierSide],
        apart: &[Apart; 2],
        place: &[Vector3<f64>],
        skin: &[f64],
        [within, barrier]: [f64; 2],
        mut found: impl FnMut(&[BarrierSide], Sort, [u32; 2]),
    ) {
        if !self.holds(sides, place, skin, within) {
            for &node in sides.iter().flat_map(|side| &side.points) {
                let (own, wide) = (skin[node as usize], &mut self.skin[node as usize]);
                *wide = (WIDER * own).min(own + MORE * barrier).max(LEAST * barrier).max(KEPT * *wide);
                self.reach[node as usize] = own;
            }
            self.find(sides, apart, place, within);
        }
        let Self { reach, of_points, of_faces, of_edges, .. } = self;
        let most = |nodes: &[u32]| nodes.iter().map(|&node| reach[node as usize]).fold(0.0, f64::max);
        for (number, side) in sides.iter().enumerate() {
            let [points, faces, edges] =
                [&mut of_points[number], &mut of_faces[number], &mut of_edges[number]];
            points.clear();
            points.extend(side.points.iter().map(|&node| reach[node as usize]));
            faces.clear();
            faces.extend(side.faces.iter().map(|corners| most(corners)));
            edges.clear();
            edges.extend(side.edges.iter().map(|ends| most(ends)));
        }
        let second = sides.len() - 1;
        let [points, others, edges] = self.ends;
        let sorts = [
            (Sort::Point(0), 0..points, &of_points[0], &of_faces[second]),
            (Sort::Point(1), points..others, &of_points[second], &of_faces[0]),
            (Sort::Edges, others..edges, &of_edges[0], &of_edges[second]),
        ];
        for (sort, range, first, second) in sorts {
            for Pair { numbers, distance } in &self.pairs[range] {
                let reach = first[numbers[0] as usize] + second[numbers[1] as usize];
                if *distance < (within + reach) * (1.0 + ROUND_OFF) {
                    found(sides, sort, *numbers);
                }
            }
        }
    }

    /// Finds how far nodes have gone, with the skins of a list; whether that is within the wide ones.
    fn holds(&mut self, sides: &[BarrierSide], place: &[Vector3<f64>], skin: &[f64], within: f64) -> bool {
        if self.place.is_empty() {
            return false;
        }
        let more = 0.5 * (within - self.within).max(0.0);
        let way = |node: u32| place[node as usize] - self.place[node as usize];
        let common = common(sides, way);
        let mut holds = true;
        for &node in sides.iter().flat_map(|side| &side.points) {
            let reach = skin[node as usize] + (way(node) - common).norm();
            self.reach[node as usize] = reach;
            holds &= reach + more <= self.skin[node as usize];
        }
        holds
    }

    /// Finds the pairs within a distance [m] and the wide skins of both.
    fn find(&mut self, sides: &mut [BarrierSide], apart: &[Apart; 2], place: &[Vector3<f64>], within: f64) {
        let Self { pairs, ends, skin, left_out, .. } = self;
        pairs.clear();
        *ends = [0; 3];
        self.place.clear();
        self.place.extend_from_slice(place);
        self.within = within;
        let at = |node: u32| place[node as usize];
        let margin = |node: u32| skin[node as usize] + 0.5 * within;
        // Whole sides first: a tool that waits far away costs no more than their boxes.
        let whole = |side: &BarrierSide| {
            let boxes = side.points.iter().map(|&node| around([node], &at, &margin));
            boxes.reduce(|all, one| all.with(&one))
        };
        if let [first, second] = sides
            && !whole(first).zip(whole(second)).is_some_and(|(first, second)| first.touches(&second))
        {
            return;
        }
        sides.iter_mut().for_each(|side| side.refit(at, margin));
        let sides = &*sides;
        let most = |nodes: &[u32]| nodes.iter().map(|&node| skin[node as usize]).fold(0.0, f64::max);
        let mut met = Vec::new();
        // Neighbours at rest are most of what boxes meet: they are marked, and seen no further.
        left_out.fill(0);
        for (number, side) in sides.iter().enumerate() {
            let against = other(sides, number);
            for (&node, point) in side.points.iter().zip(0..) {
                let wanted = around([node], &at, &margin);
                met.clear();
                let mark = point + 1;
                apart[0].of(point).iter().for_each(|&face| left_out[face as usize] = mark);
                against.face_tree.near(&wanted, |face| {
                    if left_out[face as usize] != mark && against.face_boxes[face as usize].touches(&wanted) {
                        met.push(face);
                    }
                });
                let first = pairs.len();
                for &face in &met {
                    let corners = against.faces[face as usize];
                    if corners.contains(&node) {
                        continue;
                    }
                    let limit = within + skin[node as usize] + most(&corners);
                    let points = Sort::Point(number).nodes(sides, [point, face]).map(at);
                    let distance = bound(&points, Kind::PointTriangle);
                    if distance < limit {
                        pairs.push(Pair { numbers: [point, face], distance });
                    }
                }
                pairs[first..].sort_unstable_by_key(|pair| pair.numbers[1]);
            }
            ends[number] = pairs.len();
        }
        ends[1] = pairs.len();
        left_out.fill(0);
        let (side, against) = (&sides[0], other(sides, 0));
        for (edge, number) in side.edges.iter().zip(0..) {
            let wanted = side.edge_boxes[number as usize];
            met.clear();
            let mark = number + 1;
            apart[1].of(number).iter().for_each(|&edge| left_out[edge as usize] = mark);
            against.edge_tree.near(&wanted, |other| {
                if (sides.len() > 1 || other > number)
                    && left_out[other as usize] != mark
                    && against.edge_boxes[other as usize].touches(&wanted)
                {
                    met.push(other);
                }
            });
            let first = pairs.len();
            for &second in &met {
                let ends = against.edges[second as usize];
                if edge.iter().any(|end| ends.contains(end)) {
                    continue;
                }
                let limit = within + most(edge) + most(&ends);
                let points = Sort::Edges.nodes(sides, [number, second]).map(at);
                let distance = bound(&points, Kind::EdgeEdge);
                if distance < limit {
                    pairs.push(Pair { numbers: [number, second], distance });
                }
            }
            pairs[first..].sort_unstable_by_key(|pair| pair.numbers[1]);
        }
        ends[2] = pairs.len();
    }
}

impl Sort {
    /// The kind of its primitives.
    pub fn kind(self) -> Kind {
        match self {
            Self::Point(_) => Kind::PointTriangle,
            Self::Edges => Kind::EdgeEdge,
        }
    }

    /// The nodes of a pair.
    pub fn nodes(self, sides: &[BarrierSide], [first, second]: [u32; 2]) -> [u32; 4] {
        let [first, second] = [first as usize, second as usize];
        match self {
            Self::Point(side) => {
                let [a, b, c] = other(sides, side).faces[second];
                [sides[side].points[first], a, b, c]
            }
            Self::Edges => {
                let ([a, b], [c, d]) = (sides[0].edges[first], other(sides, 0).edges[second]);
                [a, b, c, d]
            }
        }
    }
}

/// A bound [m] from below of the distance of two primitives, the first of so many points: the gap between their shadows on the line through
/// their middles. A tenth of the work of the distance.
pub(super) fn bound(points: &[Vector3<f64>; 4], kind: Kind) -> f64 {
    let [a, b, c, d] = points;
    match kind {
        Kind::PointTriangle => {
            let way = a - (b + c + d) / 3.0;
            let most = way.dot(b).max(way.dot(c)).max(way.dot(d));
            shadow(way.dot(a) - most, &way)
        }
        Kind::EdgeEdge => {
            let way = (a + b) - (c + d);
            let half = 0.5 * (way.dot(&(b - a)).abs() + way.dot(&(d - c)).abs());
            shadow(0.5 * way.norm_squared() - half, &way)
        }
    }
}

/// A gap along a way over the length of the way; zero where there is none.
fn shadow(gap: f64, way: &Vector3<f64>) -> f64 {
    if gap > 0.0 { gap / way.norm() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use pliant_testing::Random;

    use super::*;

    /// Never more than the distance, and exact where the middles face each other.
    #[test]
    fn bounds_are_below_distances() {
        let mut random = Random::new(4);
        for number in 0..100_000 {
            let kind = if number % 2 == 0 { Kind::PointTriangle } else { Kind::EdgeEdge };
            let points: [Vector3<f64>; 4] = std::array::from_fn(|_| Vector3::from(random.vector()));
            let (bound, distance) = (bound(&points, kind), kind.nearest(&points).distance);
            assert!(bound <= distance * (1.0 + 1e-12), "{number}: {bound} {distance}");
        }
        let crossed = [[-1.0, 0.0, 0.5], [1.0, 0.0, 0.5], [0.0, -1.0, 0.0], [0.0, 1.0, 0.0]];
        assert_eq!(bound(&crossed.map(Vector3::from), Kind::EdgeEdge), 0.5);
    }
}
