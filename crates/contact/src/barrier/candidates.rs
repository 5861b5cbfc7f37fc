//! Pairs of a contact that may come near before nodes have gone further than their skins.

use nalgebra::Vector3;

use super::advance::{Kind, Query, allowed};
use super::distance::Mollifier;
use super::law::{Barrier, Slip};
use super::rows::{Mollified, Row, Stencil};
use super::surfaces::{BarrierSide, around};

/// Rest distances, over the reach, up to which parts of one surface never touch each other.
const AT_REST: f64 = 1.02;
/// The skin of a node over the motion that it is to make.
const SKIN: f64 = 2.0;
/// Width of the bins that pairs are sorted into by their distance, over the distance of the barrier.
const BIN: f64 = 0.2;
/// The least and the largest skin, over the distance of the barrier; and the largest over the mean edge, if that is more.
const SKINS: [f64; 2] = [0.5, 20.0];

/// A pair that may come near.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    kind: Kind,
    nodes: [u32; 4],
    /// The numbers of its primitives in their sides.
    numbers: [u32; 2],
    /// The area [m²] that it stands for.
    area: f64,
    /// Threshold [m⁴] of the mollifier; zero of a point and a triangle.
    threshold: f64,
    /// The distance [m] when it was listed.
    distance: f64,
    in_order: bool,
}

/// How a contact acts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Action {
    /// The distance [m] that surfaces keep, with the radius of a rigid thing that is a point or an edge.
    pub kept: f64,
    /// How far [m] the surface of a rigid thing is outside of that of its shape now.
    pub growth: f64,
    pub law: Barrier,
    /// κ [Pa].
    pub stiffness: f64,
    /// Coulomb's coefficient.
    pub friction: f64,
    /// The speed [m/s] below which friction lets bodies creep.
    pub creep_speed: f64,
    /// Friction of the present step.
    pub slip: Slip,
}

impl Action {
    /// The distance ξ [m] below which primitives are in each other.
    pub fn offset(&self) -> f64 {
        self.kept + self.growth
    }

    /// ξ + ĝ [m].
    pub fn reach(&self) -> f64 {
        self.offset() + self.law.distance
    }

    /// The same for distances from the wall as it is now, its growth taken off already.
    pub fn of_wall(&self) -> Self {
        Self { growth: 0.0, ..*self }
    }

    /// What a distance below the reach makes of a pair; `None` if it is none.
    pub fn row(&self, stencil: Stencil, area: f64, distance: f64, normal: Vector3<f64>) -> Option<Row> {
        let gap = distance - self.offset();
        (gap < self.law.distance).then(|| Row {
            stencil,
            normal,
            gap,
            energy: self.stiffness * area * self.law.energy(gap),
            force: -self.stiffness * area * self.law.slope(gap),
            stiffness: self.stiffness * area * self.law.curvature(gap),
            region: None,
            mollified: None,
        })
    }
}

/// Pairs of numbers, by the first.
#[derive(Clone, Debug, Default)]
struct Apart {
    /// Where those of each first number begin.
    start: Vec<u32>,
    /// Second numbers, increasing for each first one.
    second: Vec<u32>,
}

impl Apart {
    /// Of pairs whose first numbers are below a count.
    fn new(mut pairs: Vec<[u32; 2]>, count: usize) -> Self {
        pairs.sort_unstable();
        let start = (0..=count as u32).map(|first| pairs.partition_point(|pair| pair[0] < first) as u32);
        Self { start: start.collect(), second: pairs.iter().map(|pair| pair[1]).collect() }
    }

    /// The second numbers of a first one.
    fn of(&self, first: u32) -> &[u32] {
        match self.start.get(first as usize..first as usize + 2) {
            Some(&[from, to]) => &self.second[from as usize..to as usize],
            _ => &[],
        }
    }
}

/// A contact with its surfaces and lists.
#[derive(Clone, Debug)]
pub(super) struct Group {
    /// The contact, by its number.
    pub number: u32,
    /// Two surfaces, or one that touches itself.
    pub sides: Vec<BarrierSide>,
    /// The rigid thing whose distance nodes of the first keep, by its number.
    pub wall: Option<u32>,
    /// The rigid thing of the second, if there is one, by its number; and by how much [m] its surface rises in the motion that is set.
    pub thing: Option<u32>,
    pub rise: f64,
    pub action: Action,
    /// Of one surface: nodes with triangles, and edges, that are too near at rest to touch.
    apart: [Apart; 2],
    /// In bins by their distance, in the order of their numbers within one.
    candidates: Vec<Candidate>,
    /// Where the candidates of each bin begin; memory to sort them in.
    bins: Vec<u32>,
    unsorted: Vec<Candidate>,
    /// Of each face or edge the number, from 1 on, of the point or edge for which it was last left out.
    left_out: Vec<u32>,
    /// Skins [m] of all nodes, how far [m] they have gone since pairs were listed, and how far [m] they go in a motion.
    skin: Vec<f64>,
    moved: Vec<f64>,
    way: Vec<f64>,
    /// How far [m] two primitives have come nearer at most since pairs were listed.
    nearer: f64,
    /// The largest skin [m].
    largest: f64,
}

impl Group {
    pub fn new(
        number: u32,
        sides: Vec<BarrierSide>,
        [wall, thing]: [Option<u32>; 2],
        action: Action,
        rest: &[Vector3<f64>],
    ) -> Self {
        let place = |node: u32| rest[node as usize];
        let edge = sides[0].mean_edge(place);
        let largest = (SKINS[1] * action.law.distance).max(edge);
        let most = sides.iter().map(|side| side.faces.len().max(side.edges.len())).max().unwrap_or(0);
        let mut group = Self {
            number,
            sides,
            wall,
            thing,
            rise: 0.0,
            action,
            apart: Default::default(),
            candidates: Vec::new(),
            bins: Vec::new(),
            unsorted: Vec::new(),
            left_out: vec![0; most],
            skin: vec![0.0; rest.len()],
            moved: vec![0.0; rest.len()],
            way: vec![0.0; rest.len()],
            nearer: 0.0,
            largest,
        };
        if group.sides.len() == 1 {
            let near = AT_REST * group.action.reach();
            group.find(rest, near);
            let own = |kind: Kind, count: usize| {
                let of = group.candidates.iter().filter(move |one| one.kind == kind && one.distance < near);
                Apart::new(of.map(|one| one.numbers).collect(), count)
            };
            let side = &group.sides[0];
            group.apart =
                [own(Kind::PointTriangle, side.points.len()), own(Kind::EdgeEdge, side.edges.len())];
            group.candidates.clear();
        }
        group
    }

    /// Pairs that never touch, since they are too near at rest.
    pub fn apart_count(&self) -> usize {
        self.apart.iter().map(|apart| apart.second.len()).sum()
    }

    /// How far [m] the whole surface goes that touches itself: what its parts have in common.
    fn common(&self, motion: impl Fn(u32) -> Vector3<f64>) -> Vector3<f64> {
        let points = &self.sides[0].points;
        if self.sides.len() > 1 || points.is_empty() {
            return Vector3::zeros();
        }
        points.iter().map(|&node| motion(node)).sum::<Vector3<f64>>() / points.len() as f64
    }

    /// Lists what may come near while nodes go by a motion [m] from their places [m].
    pub fn list(&mut self, place: &[Vector3<f64>], motion: &[Vector3<f64>]) {
        let common = self.common(|node| motion[node as usize]);
        let least = SKINS[0] * self.action.law.distance;
        for side in &self.sides {
            for &node in &side.points {
                let way = (motion[node as usize] - common).norm();
                self.skin[node as usize] = (SKIN * way).clamp(least, self.largest);
            }
        }
        self.moved.fill(0.0);
        self.nearer = 0.0;
        self.find(place, self.action.reach() + self.rise.max(0.0));
    }

    /// Lists what is within a distance [m] and the skins of both.
    fn find(&mut self, place: &[Vector3<f64>], within: f64) {
        let Self { sides, skin, apart, unsorted, left_out, .. } = self;
        unsorted.clear();
        let at = |node: u32| place[node as usize];
        let margin = |node: u32| skin[node as usize] + 0.5 * within;
        // Whole sides first: a tool that waits far away costs no more than their boxes.
        let whole = |side: &BarrierSide| {
            let boxes = side.points.iter().map(|&node| around([node], &at, &margin));
            boxes.reduce(|all, one| all.with(&one))
        };
        if let [first, second] = &sides[..]
            && !whole(first).zip(whole(second)).is_some_and(|(first, second)| first.touches(&second))
        {
            self.sort();
            return;
        }
        sides.iter_mut().for_each(|side| side.refit(at, margin));
        let most = |nodes: &[u32]| nodes.iter().map(|&node| skin[node as usize]).fold(0.0, f64::max);
        let alone = sides.len() == 1;
        let other = |side: usize| if alone { &sides[0] } else { &sides[1 - side] };
        let mut met = Vec::new();
        // Neighbours at rest are most of what boxes meet: they are marked, and seen no further.
        left_out.fill(0);
        for (number, side) in sides.iter().enumerate() {
            let against = other(number);
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
                met.sort_unstable();
                for &face in &met {
                    let corners = against.faces[face as usize];
                    if corners.contains(&node) {
                        continue;
                    }
                    let [a, b, c] = corners;
                    let nodes = [node, a, b, c];
                    let limit = within + skin[node as usize] + most(&corners);
                    let points = nodes.map(at);
                    if is_beyond(&points, limit) {
                        continue;
                    }
                    let distance = Kind::PointTriangle.nearest(&points).distance;
                    if distance < limit {
                        unsorted.push(Candidate {
                            kind: Kind::PointTriangle,
                            nodes,
                            numbers: [point, face],
                            area: match side.is_rigid {
                                true => against.face_areas[face as usize],
                                false => 0.25 * side.point_areas[point as usize],
                            },
                            threshold: 0.0,
                            distance,
                            in_order: number == 0,
                        });
                    }
                }
            }
        }
        left_out.fill(0);
        let (side, against) = (&sides[0], other(0));
        for (edge, number) in side.edges.iter().zip(0..) {
            let wanted = side.edge_boxes[number as usize];
            met.clear();
            let mark = number + 1;
            apart[1].of(number).iter().for_each(|&edge| left_out[edge as usize] = mark);
            against.edge_tree.near(&wanted, |other| {
                if (!alone || other > number)
                    && left_out[other as usize] != mark
                    && against.edge_boxes[other as usize].touches(&wanted)
                {
                    met.push(other);
                }
            });
            met.sort_unstable();
            for &second in &met {
                let ends = against.edges[second as usize];
                if edge.iter().any(|end| ends.contains(end)) {
                    continue;
                }
                let nodes = [edge[0], edge[1], ends[0], ends[1]];
                let limit = within + most(edge) + most(&ends);
                let points = nodes.map(at);
                if are_apart(&points, limit) {
                    continue;
                }
                let distance = Kind::EdgeEdge.nearest(&points).distance;
                if distance < limit {
                    let own = side.edge_areas[number as usize];
                    let rest = [side.squares[number as usize], against.squares[second as usize]];
                    unsorted.push(Candidate {
                        kind: Kind::EdgeEdge,
                        nodes,
                        numbers: [number, second],
                        area: match against.is_rigid {
                            true => own,
                            false => 0.25 * (own + against.edge_areas[second as usize]),
                        },
                        threshold: Mollifier::threshold(rest),
                        distance,
                        in_order: true,
                    });
                }
            }
        }
        self.sort();
    }

    /// The bin of a distance [m].
    fn bin(&self, distance: f64) -> usize {
        (distance / (BIN * self.action.law.distance)) as usize
    }

    /// Puts candidates into their bins.
    fn sort(&mut self) {
        let unsorted = std::mem::take(&mut self.unsorted);
        self.bins.clear();
        for one in &unsorted {
            let after = self.bin(one.distance) + 2;
            self.bins.resize(self.bins.len().max(after + 1), 0);
            self.bins[after] += 1;
        }
        for bin in 1..self.bins.len() {
            self.bins[bin] += self.bins[bin - 1];
        }
        // Each bin starts one entry late until it is filled. Entries of the former list are all overwritten.
        self.candidates.truncate(unsorted.len());
        self.candidates.extend_from_slice(&unsorted[self.candidates.len()..]);
        for one in &unsorted {
            let place = self.bin(one.distance) + 1;
            self.candidates[self.bins[place] as usize] = *one;
            self.bins[place] += 1;
        }
        self.unsorted = unsorted;
    }

    /// The candidates that may be nearer than a distance [m] now, and some more.
    fn nearer_than(&self, distance: f64) -> &[Candidate] {
        let after = self.bin(distance + self.nearer).saturating_add(1);
        let end = self.bins.get(after).map_or(self.candidates.len(), |&end| end as usize);
        &self.candidates[..end]
    }

    /// The sum [m] of the largest of some lengths on either side.
    fn largest_of(&self, lengths: &[f64]) -> f64 {
        let of =
            |side: &BarrierSide| side.points.iter().map(|&node| lengths[node as usize]).fold(0.0, f64::max);
        match &self.sides[..] {
            [side] => 2.0 * of(side),
            sides => sides.iter().map(of).sum(),
        }
    }
}

/// Whether a point is farther from a triangle than a distance [m], by the ball around the triangle.
fn is_beyond([point, a, b, c]: &[Vector3<f64>; 4], distance: f64) -> bool {
    let middle = (a + b + c) / 3.0;
    let squares = [a, b, c].map(|corner| (corner - middle).norm_squared());
    let limit = distance + squares[0].max(squares[1]).max(squares[2]).sqrt();
    (point - middle).norm_squared() > limit * limit
}

/// Whether two edges are farther from each other than a distance [m], by the balls around them.
fn are_apart([a, b, c, d]: &[Vector3<f64>; 4], distance: f64) -> bool {
    let between = 0.5 * ((a + b) - (c + d)).norm();
    between > distance + 0.5 * ((b - a).norm() + (d - c).norm())
}

impl Group {
    /// Takes the places [m] of all nodes; whether no node has left its skin.
    pub fn take(&mut self, place: &[Vector3<f64>], listed: &[Vector3<f64>]) -> bool {
        let way = |node: u32| place[node as usize] - listed[node as usize];
        let common = self.common(way);
        let Self { sides, skin, moved, .. } = self;
        let mut holds = true;
        for &node in sides.iter().flat_map(|side| &side.points) {
            let own = (way(node) - common).norm();
            moved[node as usize] = own;
            holds &= own <= skin[node as usize];
        }
        self.nearer = self.largest_of(&self.moved);
        holds
    }

    /// The part of a motion [m] in which no node leaves its skin.
    pub fn within_skins(&self, motion: &[Vector3<f64>]) -> f64 {
        let common = self.common(|node| motion[node as usize]);
        let nodes = self.sides.iter().flat_map(|side| &side.points);
        let part = nodes.map(|&node| {
            let (left, way) = (
                self.skin[node as usize] - self.moved[node as usize],
                (motion[node as usize] - common).norm(),
            );
            if way > left { (left / way).max(0.0) } else { 1.0 }
        });
        part.fold(1.0, f64::min)
    }

    /// A bound [m] of what both primitives have gone towards each other since they were listed.
    fn moved(&self, one: &Candidate) -> f64 {
        one.kind.reach(one.nodes.map(|node| self.moved[node as usize]))
    }

    /// Adds what acts with nodes at the places [m] last taken; false if there is no gap somewhere.
    pub fn act(&self, place: &[Vector3<f64>], rows: &mut Vec<Row>) -> bool {
        let reach = self.action.reach();
        for one in self.nearer_than(reach) {
            if one.distance - self.moved(one) >= reach {
                continue;
            }
            let points = one.nodes.map(|node| place[node as usize]);
            let near = one.kind.nearest(&points);
            let stencil = Stencil {
                nodes: one.nodes,
                coefficients: near.coefficients,
                count: 4,
                contact: self.number,
                split: one.kind.split() as u8,
                in_order: one.in_order,
            };
            let Some(mut row) = self.action.row(stencil, one.area, near.distance, near.normal) else {
                continue;
            };
            if row.gap <= 0.0 || row.gap.is_nan() {
                return false;
            }
            row.region = Some(near.region);
            if one.kind == Kind::EdgeEdge {
                let mollifier = Mollifier::of(&points, one.threshold);
                if mollifier.value < 1.0 {
                    row.mollified = Some(Mollified {
                        threshold: one.threshold,
                        gradient: mollifier.gradient,
                        energy: row.energy,
                        force: row.force,
                    });
                    row.energy *= mollifier.value;
                    row.force *= mollifier.value;
                    row.stiffness *= mollifier.value;
                }
            }
            rows.push(row);
        }
        true
    }

    /// The part, `most` or less, of a motion [m] from the places [m] last taken that keeps a part of every gap.
    pub fn allowed(
        &mut self,
        place: &[Vector3<f64>],
        motion: &[Vector3<f64>],
        keep: f64,
        mut most: f64,
    ) -> f64 {
        let common = self.common(|node| motion[node as usize]);
        let Self { sides, way, .. } = self;
        for &node in sides.iter().flat_map(|side| &side.points) {
            way[node as usize] = (motion[node as usize] - common).norm();
        }
        let (offset, rise) = (self.action.offset(), self.rise);
        let widest = (self.largest_of(&self.way) + rise.max(0.0)) * most / (1.0 - keep);
        for one in self.nearer_than(offset + widest) {
            let gap = one.distance - self.moved(one) - offset;
            let way = one.kind.reach(one.nodes.map(|node| self.way[node as usize])) + rise.max(0.0);
            if gap * (1.0 - keep) > way * most {
                continue;
            }
            let [points, ways] = [place, motion].map(|of| one.nodes.map(|node| of[node as usize]));
            most = most.min(allowed(one.kind, &points, &ways, Query { offset, rise, keep, most }));
        }
        most
    }

    /// Calls back with the nodes of all pairs within the reach of the barrier and a margin [m] more, at the places [m] last taken.
    pub fn pairs(&self, place: &[Vector3<f64>], margin: f64, mut found: impl FnMut(&[u32; 4])) {
        let reach = self.action.reach() + margin;
        let near = |one: &&Candidate| {
            one.distance - self.moved(one) < reach
                && one.kind.nearest(&one.nodes.map(|node| place[node as usize])).distance < reach
        };
        self.nearer_than(reach).iter().filter(near).for_each(|one| found(&one.nodes));
    }

    /// Calls back with the nodes and gaps [m] of pairs that have no gap.
    pub fn too_close(&self, place: &[Vector3<f64>], mut found: impl FnMut([u32; 4], f64)) {
        for one in &self.candidates {
            let gap =
                one.kind.nearest(&one.nodes.map(|node| place[node as usize])).distance - self.action.offset();
            if gap <= 0.0 {
                found(one.nodes, gap);
            }
        }
    }

    /// Pairs in the list.
    pub fn listed(&self) -> usize {
        self.candidates.len()
    }
}
