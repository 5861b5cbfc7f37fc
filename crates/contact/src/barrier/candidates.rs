//! Pairs of a contact that may come near before nodes have gone further than their skins.

use nalgebra::Vector3;

use super::advance::{Kind, Query, allowed};
use super::distance::Mollifier;
use super::law::{Barrier, Slip};
use super::rows::{Mollified, Row, Stencil};
use super::surfaces::BarrierSide;
use super::wide::{Apart, ROUND_OFF, Sort, Wide, common, other};

/// Rest distances, over the reach, up to which parts of one surface never touch each other.
const AT_REST: f64 = 1.02;
/// The skin of a node over the motion that it is to make.
const SKIN: f64 = 1.25;
/// Width of the bins that pairs are sorted into by their distance, over the distance of the barrier.
const BIN: f64 = 0.2;
/// The least and the largest skin, over the distance of the barrier. The largest is a mean edge if that is more, and that of a surface which touches
/// itself always: all its parts are near others, and their lists would grow with the square of a skin over an edge.
const SKINS: [f64; 2] = [0.5, 20.0];

/// A pair that may come near.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    kind: Kind,
    nodes: [u32; 4],
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
    /// Pairs that candidates are chosen from.
    wide: Wide,
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
        let largest = if sides.len() == 1 { edge } else { (SKINS[1] * action.law.distance).max(edge) };
        let wide = Wide::new(&sides, rest.len());
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
            wide,
            skin: vec![0.0; rest.len()],
            moved: vec![0.0; rest.len()],
            way: vec![0.0; rest.len()],
            nearer: 0.0,
            largest,
        };
        if group.sides.len() == 1 {
            let near = AT_REST * group.action.reach();
            let [points, edges] = group.wide.within(&mut group.sides, rest, near);
            let side = &group.sides[0];
            group.apart = [Apart::new(points, side.points.len()), Apart::new(edges, side.edges.len())];
        }
        group
    }

    /// Pairs that never touch, since they are too near at rest.
    pub fn apart_count(&self) -> usize {
        self.apart.iter().map(Apart::len).sum()
    }

    /// Lists what may come near while nodes go by a motion [m] from their places [m].
    pub fn list(&mut self, place: &[Vector3<f64>], motion: &[Vector3<f64>]) {
        let common = common(&self.sides, |node| motion[node as usize]);
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
        let Self { sides, skin, apart, unsorted, wide, action, .. } = self;
        unsorted.clear();
        wide.each(sides, apart, place, skin, [within, action.law.distance], |sides, sort, numbers, limit| {
            let (kind, nodes) = (sort.kind(), sort.nodes(sides, numbers));
            let points = nodes.map(|node| &place[node as usize]);
            if kind.is_beyond(points, limit * (1.0 + ROUND_OFF)) {
                return;
            }
            let distance = kind.distance(&points.map(|point| *point));
            if distance >= limit {
                return;
            }
            let [first, second] = numbers.map(|number| number as usize);
            let (area, threshold) = match sort {
                Sort::Point(side) if sides[side].is_rigid => (other(sides, side).face_areas[second], 0.0),
                Sort::Point(side) => (0.25 * sides[side].point_areas[first], 0.0),
                Sort::Edges => {
                    let (side, against) = (&sides[0], other(sides, 0));
                    let own = side.edge_areas[first];
                    let area = match against.is_rigid {
                        true => own,
                        false => 0.25 * (own + against.edge_areas[second]),
                    };
                    (area, Mollifier::threshold([side.squares[first], against.squares[second]]))
                }
            };
            let in_order = sort != Sort::Point(1);
            unsorted.push(Candidate { kind, nodes, area, threshold, distance, in_order });
        });
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

impl Group {
    /// Takes the places [m] of all nodes; whether no node has left its skin.
    pub fn take(&mut self, place: &[Vector3<f64>], listed: &[Vector3<f64>]) -> bool {
        let way = |node: u32| place[node as usize] - listed[node as usize];
        let common = common(&self.sides, way);
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
        let common = common(&self.sides, |node| motion[node as usize]);
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
            if one.kind.is_beyond(one.nodes.map(|node| &place[node as usize]), reach * (1.0 + ROUND_OFF)) {
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
        let common = common(&self.sides, |node| motion[node as usize]);
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
