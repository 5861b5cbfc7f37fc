//! Pairs of a contact that may come near before nodes have gone further than their skins.

use nalgebra::Vector3;

use super::broad_phase::{Apart, BroadPhase, ROUND_OFF, Sort, common, other};
use super::ccd::{Kind, Query, collision_free_fraction};
use super::collision_mesh::CollisionMesh;
use super::collisions::{Mollified, NormalCollision, Stencil};
use super::distance::Mollifier;
use super::law::{Barrier, Slip};

/// Reach of parts of one surface that are nearer at rest than the reach of the contact, over their distance
/// at rest.
const NEAR: f64 = 0.98;
/// Rest distances, over the distance of the barrier, up to which parts of one surface are in one place, and
/// never touch each other.
const IN_ONE_PLACE: f64 = 1e-3;
/// Skin of a node around its planned motion, over that motion; the second value is for nodes of rigid things,
/// which may turn. An arc of up to half a turn about the origin of the thing is at most half of its chord
/// away from the chord. Lists are made anew where another arc leaves its skin.
const SKIN: [f64; 2] = [0.25, 0.55];
/// Width of the bins that pairs are sorted into by their distance, over the distance of the barrier.
const BIN: f64 = 0.2;
/// The most bins: those beyond are in the last one.
const BINS: usize = 1 << 12;
/// Least skin and longest motion, over the distance of the barrier. The longest motion is a mean edge if that
/// is more. It is always a mean edge for a surface that touches itself. All parts of such a surface are near
/// others, and their lists would grow with the square of a motion over an edge.
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
    /// A bound [m] of how far both primitives go towards each other on the course of the list.
    nearing: f64,
    in_order: bool,
    /// The reach [m] of parts of one surface that are near at rest; infinite of others.
    most: f64,
}

/// Parameters of a contact.
#[derive(Clone, Copy, Debug)]
pub(super) struct ContactParameters {
    /// The distance [m] that surfaces keep, with the radius of a rigid thing that is a point or an edge.
    pub kept: f64,
    /// Distance [m] that the surface of a rigid thing has grown outside the surface of its shape.
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

impl ContactParameters {
    /// The distance ξ [m] below which primitives are in each other.
    pub fn offset(&self) -> f64 {
        self.kept + self.growth
    }

    /// ξ + ĝ [m].
    pub fn reach(&self) -> f64 {
        self.offset() + self.law.distance
    }

    /// Returns the parameters for distances from the present wall, whose growth is already subtracted.
    pub fn of_wall(&self) -> Self {
        Self { growth: 0.0, ..*self }
    }

    /// Returns the parameters for a pair whose reach is at most a length [m]. The pair keeps a smaller
    /// distance, and if that is not enough, its barrier begins at a smaller gap.
    fn within(&self, most: f64) -> Self {
        if most >= self.reach() {
            return *self;
        }
        let kept = (most - self.growth - self.law.distance).clamp(0.0, self.kept);
        Self { kept, law: Barrier { distance: most - self.growth - kept }, ..*self }
    }

    /// Returns the collision of a pair at a distance; `None` if the distance is beyond the reach.
    pub fn collision(
        &self,
        stencil: Stencil,
        area: f64,
        distance: f64,
        normal: Vector3<f64>,
    ) -> Option<NormalCollision> {
        let gap = distance - self.offset();
        (gap < self.law.distance).then(|| NormalCollision {
            stencil,
            normal,
            distance,
            gap,
            energy: self.stiffness * area * self.law.energy(gap),
            force: -self.stiffness * area * self.law.slope(gap),
            stiffness: self.stiffness * area * self.law.curvature(gap),
            region: None,
            side: 0,
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
    pub sides: Vec<CollisionMesh>,
    /// The rigid thing whose distance nodes of the first keep, by its number.
    pub wall: Option<u32>,
    /// Number of the rigid thing of the second side, if there is one; and the distance [m] by which its
    /// surface rises in the motion that is set.
    pub thing: Option<u32>,
    pub rise: f64,
    pub parameters: ContactParameters,
    /// Rest places [m] of the nodes of a surface that touches itself; its nodes and triangles, and its pairs
    /// of edges, that coincide at rest.
    rest: Vec<Vector3<f64>>,
    apart: [Apart; 2],
    /// Candidates in bins by their distance; within a bin in the order of their numbers.
    candidates: Vec<Candidate>,
    /// Begin of the candidates of each bin, and memory to sort them in.
    bins: Vec<u32>,
    unsorted: Vec<Candidate>,
    /// Pairs that candidates are chosen from.
    broad_phase: BroadPhase,
    /// The course [m] for which pairs were listed: a motion of all nodes without their common part. `gone` is
    /// the part of the course that they have gone.
    course: Vec<Vector3<f64>>,
    gone: f64,
    /// Lengths [m] of all nodes: the skin around the course, the skin with the course, the distance off the
    /// course, and the length of a motion.
    skin: Vec<f64>,
    whole: Vec<f64>,
    moved: Vec<f64>,
    way: Vec<f64>,
    /// Bound [m] of the distance by which two primitives have come nearer since pairs were listed.
    nearer: f64,
    /// The largest bound [m] of how far primitives in the list go towards each other on the course.
    nearing: f64,
    /// The longest motion [m] for which pairs are listed.
    longest: f64,
}

impl Group {
    pub fn new(
        number: u32,
        sides: Vec<CollisionMesh>,
        [wall, thing]: [Option<u32>; 2],
        parameters: ContactParameters,
        rest: &[Vector3<f64>],
    ) -> Self {
        let place = |node: u32| rest[node as usize];
        let edge = sides[0].mean_edge(place);
        let longest = if sides.len() == 1 { edge } else { (SKINS[1] * parameters.law.distance).max(edge) };
        let broad_phase = BroadPhase::new(&sides, rest.len());
        let mut group = Self {
            number,
            sides,
            wall,
            thing,
            rise: 0.0,
            parameters,
            rest: Vec::new(),
            apart: Default::default(),
            candidates: Vec::new(),
            bins: Vec::new(),
            unsorted: Vec::new(),
            broad_phase,
            course: vec![Vector3::zeros(); rest.len()],
            gone: 0.0,
            skin: vec![0.0; rest.len()],
            whole: vec![0.0; rest.len()],
            moved: vec![0.0; rest.len()],
            way: vec![0.0; rest.len()],
            nearer: 0.0,
            nearing: 0.0,
            longest,
        };
        if group.sides.len() == 1 {
            group.rest = rest.to_vec();
            let near = IN_ONE_PLACE * group.parameters.law.distance;
            let [points, edges] = group.broad_phase.within(&mut group.sides, rest, near);
            let side = &group.sides[0];
            group.apart = [Apart::new(points, side.points.len()), Apart::new(edges, side.edges.len())];
        }
        group
    }

    /// Pairs that never touch, since they are in one place at rest.
    pub(crate) fn apart_count(&self) -> usize {
        self.apart.iter().map(Apart::len).sum()
    }

    /// Lists pairs that may come near while nodes move from their places [m] by a part of a motion [m]. The
    /// part is 1 or less, so that no node goes too far. Returns the part.
    pub fn list(&mut self, place: &[Vector3<f64>], motion: &[Vector3<f64>]) -> f64 {
        let common = common(&self.sides, |node| motion[node as usize]);
        let Self { sides, course, skin, whole, .. } = self;
        let nodes = || {
            let of = |side: &CollisionMesh| if side.is_rigid { SKIN[1] } else { SKIN[0] };
            sides.iter().flat_map(move |side| side.points.iter().map(move |&node| (node as usize, of(side))))
        };
        let longest = nodes().map(|(node, _)| (motion[node] - common).norm()).fold(0.0, f64::max);
        let part = if longest > self.longest { self.longest / longest } else { 1.0 };
        let least = SKINS[0] * self.parameters.law.distance;
        for (node, times) in nodes() {
            course[node] = (motion[node] - common) * part;
            let way = course[node].norm();
            skin[node] = (times * way).max(least);
            whole[node] = way + skin[node];
        }
        self.moved.fill(0.0);
        (self.gone, self.nearer) = (0.0, 0.0);
        self.find(place, self.parameters.reach() + self.rise.max(0.0));
        part
    }

    /// Lists pairs that are within a distance [m] plus the skins of both.
    fn find(&mut self, place: &[Vector3<f64>], within: f64) {
        let Self { sides, course, skin, whole, rest, apart, unsorted, broad_phase, parameters, .. } = self;
        unsorted.clear();
        let mut largest: f64 = 0.0;
        broad_phase.each(
            sides,
            apart,
            place,
            whole,
            [within, parameters.law.distance],
            |sides, sort, numbers, most| {
                let (kind, nodes) = (sort.kind(), sort.nodes(sides, numbers));
                // Neighbours go along with each other, whatever the length of their course.
                let nearing = kind.nearing(nodes.map(|node| &course[node as usize]));
                let limit = most.min(within + nearing + kind.reach(nodes.map(|node| skin[node as usize])));
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
                        let first_area = side.edge_areas[first];
                        let area = match against.is_rigid {
                            true => first_area,
                            false => 0.25 * (first_area + against.edge_areas[second]),
                        };
                        (area, Mollifier::threshold([side.squares[first], against.squares[second]]))
                    }
                };
                let in_order = sort != Sort::Point(1);
                largest = largest.max(nearing);
                let most = if rest.is_empty() {
                    f64::INFINITY
                } else {
                    at_rest(kind, nodes, rest, parameters.reach())
                };
                unsorted.push(Candidate { kind, nodes, area, threshold, distance, nearing, in_order, most });
            },
        );
        self.nearing = largest;
        self.sort();
    }

    /// The bin of a distance [m].
    fn bin(&self, distance: f64) -> usize {
        ((distance / (BIN * self.parameters.law.distance)) as usize).min(BINS)
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
        let after = self.bin(distance + self.nearer) + 1;
        let end = self.bins.get(after).map_or(self.candidates.len(), |&end| end as usize);
        &self.candidates[..end]
    }

    /// The sum [m] of the largest of some lengths on either side.
    fn largest_of(&self, lengths: &[f64]) -> f64 {
        let of =
            |side: &CollisionMesh| side.points.iter().map(|&node| lengths[node as usize]).fold(0.0, f64::max);
        match &self.sides[..] {
            [side] => 2.0 * of(side),
            sides => sides.iter().map(of).sum(),
        }
    }
}

impl Group {
    /// The wall of a stencil of one node.
    pub(crate) fn wall_of(&self, stencil: &Stencil) -> Option<u32> {
        self.wall.filter(|_| stencil.count == 1)
    }

    /// Takes the places [m] of all nodes; whether no node has left its skin.
    pub fn take(&mut self, place: &[Vector3<f64>], listed: &[Vector3<f64>]) -> bool {
        let mut moved = std::mem::take(&mut self.moved);
        let way = |node: u32| place[node as usize] - listed[node as usize];
        let (gone, holds) = self.off_course(way, |node, off| moved[node as usize] = off);
        (self.gone, self.moved) = (gone, moved);
        self.nearer = self.largest_of(&self.moved) + gone * self.nearing;
        holds
    }

    /// True if no node leaves its skin in a motion [m] from the places [m] last taken. Since the skin around
    /// the course is convex, no node leaves it on the way either.
    pub fn has(&self, place: &[Vector3<f64>], listed: &[Vector3<f64>], motion: &[Vector3<f64>]) -> bool {
        let way = |node: u32| place[node as usize] + motion[node as usize] - listed[node as usize];
        self.off_course(way, |_, _| ()).1
    }

    /// Returns the part of the course that nodes have gone by their ways [m], and true if all are within
    /// their skins around it. Calls back with the distance [m] of each node from the course.
    fn off_course(&self, way: impl Fn(u32) -> Vector3<f64>, mut off: impl FnMut(u32, f64)) -> (f64, bool) {
        let common = common(&self.sides, &way);
        let nodes = || self.sides.iter().flat_map(|side| &side.points);
        let (mut along, mut squared) = (0.0, 0.0);
        for &node in nodes() {
            let course = self.course[node as usize];
            along += course.dot(&(way(node) - common));
            squared += course.norm_squared();
        }
        let gone = if squared > 0.0 { (along / squared).clamp(0.0, 1.0) } else { 0.0 };
        let mut holds = true;
        for &node in nodes() {
            let remaining = (way(node) - common - self.course[node as usize] * gone).norm();
            off(node, remaining);
            holds &= remaining <= self.skin[node as usize];
        }
        (gone, holds)
    }

    /// A bound [m] of what both primitives have gone towards each other since they were listed.
    fn moved(&self, one: &Candidate) -> f64 {
        one.kind.reach(one.nodes.map(|node| self.moved[node as usize])) + self.gone * one.nearing
    }

    /// Adds the collisions of nodes at the places [m] last taken; false if there is no gap somewhere.
    pub(crate) fn find_collisions(
        &self,
        place: &[Vector3<f64>],
        collisions: &mut Vec<NormalCollision>,
    ) -> bool {
        let reach = self.parameters.reach();
        for one in self.nearer_than(reach) {
            let parameters = self.parameters.within(one.most);
            let reach = parameters.reach();
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
            let Some(mut collision) = parameters.collision(stencil, one.area, near.distance, near.normal)
            else {
                continue;
            };
            if collision.gap <= 0.0 || collision.gap.is_nan() {
                return false;
            }
            collision.region = Some(near.region);
            if one.kind == Kind::EdgeEdge {
                let mollifier = Mollifier::of(&points, one.threshold);
                if mollifier.value < 1.0 {
                    collision.mollified = Some(Mollified {
                        threshold: one.threshold,
                        gradient: mollifier.gradient,
                        energy: collision.energy,
                        force: collision.force,
                    });
                    collision.energy *= mollifier.value;
                    collision.force *= mollifier.value;
                    collision.stiffness *= mollifier.value;
                }
            }
            collisions.push(collision);
        }
        true
    }

    /// The part, `most` or less, of a motion [m] from the places [m] last taken that keeps a part of every
    /// gap.
    pub fn collision_free_fraction(
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
        let (offset, rise) = (self.parameters.offset(), self.rise);
        let widest = (self.largest_of(&self.way) + rise.max(0.0)) * most / (1.0 - keep);
        for one in self.nearer_than(offset + widest) {
            let offset = self.parameters.within(one.most).offset();
            let gap = one.distance - self.moved(one) - offset;
            let way = one.kind.reach(one.nodes.map(|node| self.way[node as usize])) + rise.max(0.0);
            if gap * (1.0 - keep) > way * most {
                continue;
            }
            let [points, ways] = [place, motion].map(|of| one.nodes.map(|node| of[node as usize]));
            most = most.min(collision_free_fraction(
                one.kind,
                &points,
                &ways,
                Query { offset, rise, keep, most },
            ));
        }
        most
    }

    /// Calls back with the nodes of all pairs within the reach of the barrier and a margin [m] more, at the
    /// places [m] last taken.
    pub fn pairs(&self, place: &[Vector3<f64>], margin: f64, mut found: impl FnMut(&[u32; 4])) {
        let reach = self.parameters.reach() + margin;
        let near = |one: &&Candidate| {
            let reach = self.parameters.within(one.most).reach() + margin;
            one.distance - self.moved(one) < reach
                && one.kind.nearest(&one.nodes.map(|node| place[node as usize])).distance < reach
        };
        self.nearer_than(reach).iter().filter(near).for_each(|one| found(&one.nodes));
    }

    /// Calls back with the nodes and gaps [m] of pairs that have no gap.
    pub(crate) fn too_close(&self, place: &[Vector3<f64>], mut found: impl FnMut([u32; 4], f64)) {
        for one in &self.candidates {
            let distance = one.kind.nearest(&one.nodes.map(|node| place[node as usize])).distance;
            let gap = distance - self.parameters.within(one.most).offset();
            if gap <= 0.0 {
                found(one.nodes, gap);
            }
        }
    }
}

/// The reach [m] of a pair of one surface that is near at rest; infinite where it has all of the reach of the
/// contact.
fn at_rest(kind: Kind, nodes: [u32; 4], rest: &[Vector3<f64>], reach: f64) -> f64 {
    let points = nodes.map(|node| &rest[node as usize]);
    if kind.is_beyond(points, reach / NEAR) {
        return f64::INFINITY;
    }
    let most = NEAR * kind.distance(&points.map(|point| *point));
    if most < reach { most } else { f64::INFINITY }
}
