//! The broad phase: finds pairs that may come near while nodes stay within wide skins. Trees of boxes find
//! these pairs, which are kept over several lists and steps. A list takes its pairs by distance alone, in the
//! order of their numbers. Its content does not depend on when the pairs were found.

use nalgebra::Vector3;

use super::ccd::Kind;
use super::collision_mesh::{CollisionMesh, around};

/// Wide skin of a node, over the skin of a list.
const WIDER: f64 = 2.5;
/// Largest difference between the wide skin and the skin of a list, and least wide skin, over the distance of
/// the barrier.
const MORE: f64 = 10.0;
const LEAST: f64 = 4.0;
/// Least wide skin, over the previous wide skin.
const KEPT: f64 = 0.5;
/// Largest round-off of a distance, over the distance; in double and in single precision.
pub(super) const ROUND_OFF: f64 = 1e-9;
const SINGLE: f64 = 2e-7;
/// Pairs that are compared at once.
const BLOCK: usize = 16;

/// Pairs of numbers, by the first.
#[derive(Clone, Debug, Default)]
pub(super) struct Apart {
    /// The begin of the pairs of each first number.
    start: Vec<u32>,
    /// Second numbers, increasing for each first one.
    second: Vec<u32>,
}

impl Apart {
    /// A list of pairs whose first numbers are below a count.
    pub fn new(mut pairs: Vec<[u32; 2]>, count: usize) -> Self {
        pairs.sort_unstable();
        let start = (0..=count as u32).map(|first| pairs.partition_point(|pair| pair[0] < first) as u32);
        Self { start: start.collect(), second: pairs.iter().map(|pair| pair[1]).collect() }
    }

    /// The number of pairs.
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

/// The sorts of pairs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sort {
    /// A point of a side, by its number, and a face of the other.
    Point(usize),
    /// Edges of both.
    Edges,
}

/// Pairs of a sort, by their first numbers.
#[derive(Clone, Debug, Default)]
struct Pairs {
    /// The end of the pairs of each first number.
    ends: Vec<u32>,
    /// Second numbers, increasing for each first one.
    second: Vec<u32>,
    /// Bounds [m] from below of their distances when they were found.
    distance: Vec<f32>,
}

impl Pairs {
    fn clear(&mut self) {
        self.ends.clear();
        self.second.clear();
        self.distance.clear();
    }

    /// Adds the pairs of the next first number: second numbers in any order, with bounds [m] from below of
    /// their distances.
    fn add(&mut self, partners: &mut Vec<(u32, f64)>) {
        partners.sort_unstable_by_key(|pair| pair.0);
        self.second.extend(partners.iter().map(|pair| pair.0));
        self.distance.extend(partners.drain(..).map(|pair| (pair.1 * (1.0 - SINGLE)) as f32));
        self.ends.push(self.second.len() as u32);
    }

    /// Calls back with the pairs that may be within a distance [m] and the reaches [m] of both of their
    /// primitives.
    fn within(&self, within: f64, [first, second]: [&[f64]; 2], mut found: impl FnMut([u32; 2])) {
        let most = second.iter().copied().fold(0.0, f64::max);
        let mut from = 0;
        for ((number, reach), &end) in (0..).zip(first).zip(&self.ends) {
            let (limit, range) = (within + reach, from as usize..end as usize);
            from = end;
            // Most are seen to be too far apart many at once.
            let limit_of_all = ((limit + most) * (1.0 + SINGLE)) as f32;
            let blocks = self.second[range.clone()].chunks(BLOCK).zip(self.distance[range].chunks(BLOCK));
            for (numbers, distances) in blocks {
                if !distances.iter().fold(false, |any, distance| any | (*distance < limit_of_all)) {
                    continue;
                }
                for (&other, &distance) in numbers.iter().zip(distances) {
                    if f64::from(distance) < (limit + second[other as usize]) * (1.0 + ROUND_OFF) {
                        found([number, other]);
                    }
                }
            }
        }
    }

    /// Returns all pairs.
    fn listed(&self) -> impl Iterator<Item = [u32; 2]> {
        let starts = std::iter::once(&0).chain(&self.ends);
        let ranges = starts.zip(&self.ends).map(|(&from, &end)| from as usize..end as usize);
        ranges
            .zip(0..)
            .flat_map(|(range, first)| self.second[range].iter().map(move |&second| [first, second]))
    }
}

/// Pairs of the sides of a contact.
#[derive(Clone, Debug)]
pub(super) struct BroadPhase {
    /// Points of the first side, of the second, and edges.
    pairs: [Pairs; 3],
    /// Skins [m] of all nodes, and their places [m] when pairs were found; no places before the first search.
    skin: Vec<f64>,
    place: Vec<Vector3<f64>>,
    /// The distance [m], besides skins, within which pairs were found.
    within: f64,
    /// Number, from 1 on, of the point or edge for which each face or edge was last left out.
    left_out: Vec<u32>,
    /// Distance [m] that each node has gone since, with the skin of a list; its largest value on each
    /// primitive; and the largest skins on each primitive.
    reach: Vec<f64>,
    reaches: Lengths,
    skins: Lengths,
}

/// The largest of some lengths [m] of nodes on each primitive of both sides.
#[derive(Clone, Debug, Default)]
struct Lengths {
    points: [Vec<f64>; 2],
    faces: [Vec<f64>; 2],
    edges: [Vec<f64>; 2],
}

impl Lengths {
    /// Takes the places of nodes.
    fn take(&mut self, sides: &[CollisionMesh], of: &[f64]) {
        let most = |nodes: &[u32]| nodes.iter().map(|&node| of[node as usize]).fold(0.0, f64::max);
        for (number, side) in sides.iter().enumerate() {
            let [points, faces, edges] =
                [&mut self.points[number], &mut self.faces[number], &mut self.edges[number]];
            points.clear();
            points.extend(side.points.iter().map(|&node| of[node as usize]));
            faces.clear();
            faces.extend(side.faces.iter().map(|corners| most(corners)));
            edges.clear();
            edges.extend(side.edges.iter().map(|ends| most(ends)));
        }
    }

    /// Returns the lengths of the first and of the second primitives of a sort, of one or two sides.
    fn of(&self, sort: Sort, sides: usize) -> [&[f64]; 2] {
        match sort {
            Sort::Point(side) => [&self.points[side], &self.faces[if sides == 1 { 0 } else { 1 - side }]],
            Sort::Edges => [&self.edges[0], &self.edges[sides - 1]],
        }
    }
}

/// The surface on the other side of one.
pub(super) fn other(sides: &[CollisionMesh], side: usize) -> &CollisionMesh {
    if sides.len() == 1 { &sides[0] } else { &sides[1 - side] }
}

/// Returns the mean motion [m] of a surface that touches itself: all its parts have this motion in common.
/// Zero with two sides.
pub(super) fn common(sides: &[CollisionMesh], motion: impl Fn(u32) -> Vector3<f64>) -> Vector3<f64> {
    let points = &sides[0].points;
    if sides.len() > 1 || points.is_empty() {
        return Vector3::zeros();
    }
    points.iter().map(|&node| motion(node)).sum::<Vector3<f64>>() / points.len() as f64
}

impl BroadPhase {
    /// Makes a broad phase for a number of nodes; no pairs are found yet.
    pub fn new(sides: &[CollisionMesh], nodes: usize) -> Self {
        let most = sides.iter().map(|side| side.faces.len().max(side.edges.len())).max().unwrap_or(0);
        Self {
            pairs: Default::default(),
            skin: vec![0.0; nodes],
            place: Vec::new(),
            within: 0.0,
            left_out: vec![0; most],
            reach: vec![0.0; nodes],
            reaches: Lengths::default(),
            skins: Lengths::default(),
        }
    }

    /// Numbers of the pairs within a distance [m] of each other at places [m]: points with faces of one
    /// surface, and edges.
    pub fn within(
        &mut self,
        sides: &mut [CollisionMesh],
        place: &[Vector3<f64>],
        within: f64,
    ) -> [Vec<[u32; 2]>; 2] {
        self.skin.fill(0.0);
        self.find(sides, &Default::default(), place, within);
        let near = |sort: Sort, pairs: &Pairs| {
            let distance = |numbers: &[u32; 2]| {
                let points = sort.nodes(sides, *numbers).map(|node| place[node as usize]);
                sort.kind().nearest(&points).distance < within
            };
            pairs.listed().filter(distance).collect()
        };
        let found = [near(Sort::Point(0), &self.pairs[0]), near(Sort::Edges, &self.pairs[2])];
        self.place.clear();
        found
    }

    /// Calls back with the pairs that may be within a distance [m] plus the skins [m] of their nodes at
    /// places [m]. Pairs come sort by sort in the order of their numbers, each with this total length; some
    /// are farther apart. Finds pairs anew if nodes have gone too far, with wide skins from the distance of
    /// the barrier [m].
    pub fn each(
        &mut self,
        sides: &mut [CollisionMesh],
        apart: &[Apart; 2],
        place: &[Vector3<f64>],
        skin: &[f64],
        [within, barrier]: [f64; 2],
        mut found: impl FnMut(&[CollisionMesh], Sort, [u32; 2], f64),
    ) {
        if !self.holds(sides, place, skin, within) {
            for &node in sides.iter().flat_map(|side| &side.points) {
                let (narrow, wide) = (skin[node as usize], &mut self.skin[node as usize]);
                *wide = (WIDER * narrow).min(narrow + MORE * barrier).max(LEAST * barrier).max(KEPT * *wide);
                self.reach[node as usize] = narrow;
            }
            self.find(sides, apart, place, within);
        }
        self.reaches.take(sides, &self.reach);
        self.skins.take(sides, skin);
        // The same surface has one sort of points.
        let sorts = [Sort::Point(0), Sort::Point(sides.len() - 1), Sort::Edges];
        for (pairs, sort) in self.pairs.iter().zip(sorts) {
            let [first, second] = self.skins.of(sort, sides.len());
            pairs.within(within, self.reaches.of(sort, sides.len()), |numbers| {
                let [a, b] = numbers.map(|number| number as usize);
                found(sides, sort, numbers, within + first[a] + second[b]);
            });
        }
    }

    /// Finds how far nodes have gone, with the skins of a list; whether that is within the wide ones.
    fn holds(&mut self, sides: &[CollisionMesh], place: &[Vector3<f64>], skin: &[f64], within: f64) -> bool {
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
    fn find(&mut self, sides: &mut [CollisionMesh], apart: &[Apart; 2], place: &[Vector3<f64>], within: f64) {
        let Self { pairs, skin, left_out, skins, .. } = self;
        skins.take(sides, skin);
        pairs.iter_mut().for_each(Pairs::clear);
        self.place.clear();
        self.place.extend_from_slice(place);
        self.within = within;
        let at = |node: u32| place[node as usize];
        let margin = |node: u32| skin[node as usize] + 0.5 * within;
        // Whole sides first: a tool that waits far away costs no more than their boxes.
        let whole = |side: &CollisionMesh| {
            let boxes = side.points.iter().map(|&node| around([node], &at, &margin));
            boxes.reduce(|grown, one| grown.with(&one))
        };
        if let [first, second] = sides
            && !whole(first).zip(whole(second)).is_some_and(|(first, second)| first.touches(&second))
        {
            return;
        }
        sides.iter_mut().for_each(|side| side.refit(at, margin));
        left_out.fill(0);
        for number in 0..sides.len() {
            self.find_points(sides, number, &apart[0]);
        }
        self.left_out.fill(0);
        self.find_edges(sides, &apart[1]);
    }

    /// Finds the pairs of points of a side with faces.
    fn find_points(&mut self, sides: &[CollisionMesh], number: usize, apart: &Apart) {
        let Self { pairs, skin, place, within, left_out, skins, .. } = self;
        let at = |node: u32| place[node as usize];
        let margin = |node: u32| skin[node as usize] + 0.5 * *within;
        let against = other(sides, number);
        let [_, of_faces] = skins.of(Sort::Point(number), sides.len());
        let (mut met, mut partners) = (Vec::new(), Vec::new());
        for (&node, point) in sides[number].points.iter().zip(0..) {
            let wanted = around([node], &at, &margin);
            met.clear();
            // Neighbours at rest are most of what boxes meet: they are marked, and seen no further.
            let mark = point + 1;
            apart.of(point).iter().for_each(|&face| left_out[face as usize] = mark);
            against.face_tree.near(&wanted, |face| {
                if left_out[face as usize] != mark && against.face_boxes[face as usize].touches(&wanted) {
                    met.push(face);
                }
            });
            for &face in &met {
                let corners = against.faces[face as usize];
                if corners.contains(&node) {
                    continue;
                }
                let limit = *within + skin[node as usize] + of_faces[face as usize];
                let [b, c, d] = corners.map(|node| &place[node as usize]);
                let points = [&place[node as usize], b, c, d];
                if !Kind::PointTriangle.is_beyond(points, limit * (1.0 + ROUND_OFF)) {
                    partners.push((face, Kind::PointTriangle.bound(points)));
                }
            }
            pairs[number].add(&mut partners);
        }
    }

    /// Finds the pairs of edges, without neighbours, which are left out as for points.
    fn find_edges(&mut self, sides: &[CollisionMesh], apart: &Apart) {
        let Self { pairs, place, within, left_out, skins, .. } = self;
        let (side, against) = (&sides[0], other(sides, 0));
        let [own_skins, of_others] = skins.of(Sort::Edges, sides.len());
        let (mut met, mut partners) = (Vec::new(), Vec::new());
        for (edge, number) in side.edges.iter().zip(0..) {
            let wanted = side.edge_boxes[number as usize];
            met.clear();
            let mark = number + 1;
            apart.of(number).iter().for_each(|&edge| left_out[edge as usize] = mark);
            against.edge_tree.near(&wanted, |other| {
                if (sides.len() > 1 || other > number)
                    && left_out[other as usize] != mark
                    && against.edge_boxes[other as usize].touches(&wanted)
                {
                    met.push(other);
                }
            });
            for &second in &met {
                let ends = against.edges[second as usize];
                if edge.iter().any(|end| ends.contains(end)) {
                    continue;
                }
                let limit = *within + own_skins[number as usize] + of_others[second as usize];
                let points = [edge[0], edge[1], ends[0], ends[1]].map(|node| &place[node as usize]);
                if !Kind::EdgeEdge.is_beyond(points, limit * (1.0 + ROUND_OFF)) {
                    partners.push((second, Kind::EdgeEdge.bound(points)));
                }
            }
            pairs[2].add(&mut partners);
        }
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
    pub fn nodes(self, sides: &[CollisionMesh], [first, second]: [u32; 2]) -> [u32; 4] {
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
