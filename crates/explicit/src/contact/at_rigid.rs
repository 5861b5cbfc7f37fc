//! A surface at a rigid thing: what of it may touch the thing in a step.

use nalgebra::Vector3;
use pliant_contact::face_points::FacePoints;
use pliant_contact::pairs::Surface;
use pliant_contact::pose::{Pose, Stance};
use pliant_contact::shape::{Near, Shape};
use pliant_contact::touch::{LEFT, MARGIN, Passage, Rigid};

use super::rows::Row;

/// Distance beyond the margin up to which nodes are listed, as a multiple of the margin.
const SKIN: f64 = 1.0;

/// A surface at a rigid thing.
pub(super) struct AtRigid {
    /// The thing, by its place in [`Contacts::rigids`].
    pub rigid: usize,
    pub surface: Surface,
    /// Points of each face.
    points: FacePoints,
    /// Distance [m] at which a node at rest still counts as near.
    pub margin: f64,
    pub passage: Passage,
    /// True if the thing is a jaw that holds what touches it.
    pub grips: bool,
    /// Nodes that may touch the thing in the step, and nodes of faces that may; increasing.
    pub near: Vec<u32>,
    listed: Listed,
}

/// Nodes and faces that may come near a rigid thing, until the surface and the thing have moved too far.
struct Listed {
    /// Distance [m] up to which nodes and faces are listed.
    reach: f64,
    /// Pose and size of the thing when the list was made.
    stance: Stance,
    /// Nodes of the surface with the corners of the faces, and faces by their place; increasing.
    nodes: Vec<u32>,
    faces: Vec<u32>,
}

impl AtRigid {
    pub fn new(rigid: &Rigid, number: usize, surface: Surface, place: impl Fn(u32) -> Vector3<f64>) -> Self {
        let longest = surface.longest_edge(place);
        let start = Stance::at(Pose::identity());
        Self {
            rigid: number,
            points: FacePoints::new(&surface.faces, longest, &rigid.shape, rigid.inside),
            margin: MARGIN * longest,
            passage: Passage::new(rigid, [start; 2]),
            grips: false,
            near: Vec::new(),
            listed: Listed { reach: 0.0, stance: start, nodes: Vec::new(), faces: Vec::new() },
            surface,
        }
    }

    /// Returns the gap [m] of a node as it lies in the step, without the penetration that may remain. Also
    /// returns the direction away from the thing. `now` is the place [m] before the step, `then` the place
    /// after it.
    pub fn gap(
        &self,
        rigid: &Rigid,
        offset: f64,
        now: &Vector3<f64>,
        then: &Vector3<f64>,
    ) -> (f64, Vector3<f64>) {
        let Near { distance, normal } = self.passage.near(rigid, then);
        let mut gap = distance - offset;
        if gap < 0.0 {
            gap -= LEFT * (self.passage.distance_before(rigid, now) - offset).min(0.0);
        }
        (gap, normal)
    }

    /// True if the list has all nodes and faces that may come nearer than `room` [m] in the passage. `moved`
    /// [m] bounds the motion of the nodes since the list was made.
    pub fn holds(&self, rigid: &Rigid, room: f64, moved: f64) -> bool {
        let Listed { reach, stance, .. } = &self.listed;
        let moved = moved + self.passage.travel_from(rigid, stance);
        self.room(room) + moved <= *reach || *reach == f64::INFINITY
    }

    /// The nodes that are listed, with the corners of the faces; increasing.
    pub fn listed(&self) -> &[u32] {
        &self.listed.nodes
    }

    /// Returns `room` [m], plus the distance at which nodes at rest count as near, and the thing's travel.
    fn room(&self, room: f64) -> f64 {
        room + self.margin + self.passage.travel()
    }

    /// Lists what may come nearer than a room [m] in this passage, and in others till the surface or the
    /// thing has moved too far.
    pub fn list(&mut self, rigid: &Rigid, room: f64, places: &[Vector3<f64>]) {
        let room = self.room(room);
        let Self { surface, points, margin, passage, listed, .. } = self;
        let Listed { reach, stance, nodes: near, faces } = listed;
        if *reach == f64::INFINITY {
            return;
        }
        // Sampled distances can change faster than a point moves, and distances to a half-space that turns
        // change without bound.
        let is_first = *reach == 0.0;
        let grows_evenly = !matches!(rigid.shape, Shape::Grid(_))
            && (is_first || passage.travel_from(rigid, stance).is_finite());
        (*reach, *stance) =
            (if grows_evenly { room + SKIN * *margin } else { f64::INFINITY }, passage.stance());
        near.clear();
        faces.clear();
        let distance = |point: &Vector3<f64>| passage.near(rigid, point).distance;
        near.extend(surface.nodes.iter().filter(|&&node| distance(&places[node as usize]) < *reach));
        if points.most() == 0 {
            return;
        }
        for (face, number) in surface.faces.iter().zip(0..) {
            let (middle, around) = middle(face, places);
            if distance(&middle) < *reach + around {
                faces.push(number);
                near.extend(face);
            }
        }
        near.sort_unstable();
        near.dedup();
    }

    /// Finds the nodes on a valid list that may come nearer than `room` [m] in the passage. Makes rows of
    /// these nodes and of points between them.
    pub fn look(
        &mut self,
        rigid: &Rigid,
        room: f64,
        places: &[Vector3<f64>],
        seen: &mut [Seen],
        mut found: impl FnMut(Row),
    ) {
        let room = self.room(room);
        self.near.clear();
        for &node in &self.listed.nodes {
            let (local, Near { distance, .. }) = self.passage.within(rigid, &places[node as usize]);
            seen[node as usize] = Seen { local, distance };
            if distance < room {
                self.near.push(node);
                found(Row::new(0, [node], [1.0]));
            }
        }
        for &number in &self.listed.faces {
            let face = self.surface.faces[number as usize];
            let corners = face.map(|node| seen[node as usize]);
            let mut is_near = false;
            let take = |weights: [f64; 3]| {
                is_near = true;
                found(Row::new(0, face, weights));
            };
            match &self.points {
                FacePoints::Nearest(nearest) => {
                    let room = room + self.passage.stance().growth;
                    nearest.of(number as usize, &corners.map(|corner| corner.local), room, take);
                }
                FacePoints::Lattice(lattice) => self.look_at_lattice(rigid, room, lattice, &corners, take),
            }
            if is_near {
                self.near.extend(face);
            }
        }
        self.near.sort_unstable();
        self.near.dedup();
    }

    /// Finds the points of a lattice on a face that may come nearer than a room [m].
    fn look_at_lattice(
        &self,
        rigid: &Rigid,
        room: f64,
        lattice: &[[f64; 3]],
        corners: &[Seen; 3],
        mut found: impl FnMut([f64; 3]),
    ) {
        let middle = corners.iter().map(|corner| corner.local).sum::<Vector3<f64>>() / 3.0;
        let around = corners.iter().map(|corner| (corner.local - middle).norm()).fold(0.0, f64::max);
        // The distances of two points differ by no more than the distance between the points.
        if corners.iter().all(|corner| corner.distance > room + 2.0 * around) {
            return;
        }
        let growth = self.passage.stance().growth;
        let middle = Seen { local: middle, distance: rigid.near_local(growth, &middle).distance };
        if middle.distance > room + around {
            return;
        }
        for &weights in lattice {
            let place = (0..3).map(|k| corners[k].local * weights[k]).sum::<Vector3<f64>>();
            let is_beyond = |seen: &Seen| {
                let far = seen.distance - room;
                far > 0.0 && (place - seen.local).norm_squared() < far * far
            };
            if !is_beyond(&middle) && !corners.iter().any(is_beyond) {
                found(weights);
            }
        }
    }
}

/// A node at a thing.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Seen {
    /// Place of the node in the frame of the thing at the end of the step [m].
    local: Vector3<f64>,
    /// Distance of the node from the thing [m].
    distance: f64,
}

/// The middle of a face [m], and how far its corners are from there at most [m].
fn middle(face: &[u32; 3], places: &[Vector3<f64>]) -> (Vector3<f64>, f64) {
    let corners = face.map(|node| places[node as usize]);
    let middle = corners.iter().sum::<Vector3<f64>>() / 3.0;
    (middle, corners.iter().map(|corner| (corner - middle).norm()).fold(0.0, f64::max))
}

#[cfg(test)]
mod tests {
    use super::*;
    use pliant_contact::pose::Trajectory;
    use pliant_testing::Random;

    const CELLS: u32 = 12;

    /// A sheet of triangles over the unit square.
    fn sheet() -> (Surface, Vec<Vector3<f64>>) {
        let across = CELLS + 1;
        let node = |i: u32, j: u32| i * across + j;
        let cells = (0..CELLS).flat_map(|i| (0..CELLS).map(move |j| (i, j)));
        let faces = cells.flat_map(|(i, j)| {
            let [a, b, c, d] = [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)];
            [[a, b, c], [a, c, d]]
        });
        let place =
            |k: u32| Vector3::new(f64::from(k / across), f64::from(k % across), 0.0) / f64::from(CELLS);
        let nodes: Vec<u32> = (0..across * across).collect();
        (Surface { faces: faces.collect(), nodes: nodes.clone() }, nodes.into_iter().map(place).collect())
    }

    /// Lists made in each step give the same rows, however the sheet waves and the thing moves and turns.
    #[test]
    fn lists_leave_nothing_out() {
        let (surface, rest) = sheet();
        let shapes = [
            Shape::Capsule { radius: 0.05, length: 0.3 },
            Shape::Cuboid { size: [0.1, 0.3, 0.2] },
            Shape::HalfSpace,
        ];
        for shape in shapes {
            let rigid = Rigid {
                name: "thing".into(),
                shape,
                trajectory: Trajectory::fixed(Pose::identity()),
                inside: false,
                jaw: None,
            };
            let fresh = || AtRigid::new(&rigid, 0, surface.clone(), |node| rest[node as usize]);
            let (mut kept, mut random) = (fresh(), Random::new(7));
            let (mut places, mut then) = (rest.clone(), rest.clone());
            let mut before = Pose::translation(0.1, 0.5, 0.1);
            let (mut listed, mut found) = (0, 0);
            for step in 0..400 {
                let time = f64::from(step) * 0.01;
                for (place, at) in places.iter_mut().zip(&rest) {
                    *place =
                        at + Vector3::z() * (0.02 * (3.0 * time + 5.0 * at.x).sin() + 1e-4 * random.part());
                }
                let turn = Vector3::new(0.2 * time.sin(), 0.0, 0.1 * time);
                let after = Pose::new(Vector3::new(0.1 + 0.2 * time, 0.5, 0.08 + 0.05 * time.cos()), turn);
                let rows = |at_rigid: &mut AtRigid| {
                    at_rigid.passage = Passage::new(&rigid, [before, after].map(Stance::at));
                    let ways = places.iter().zip(&then).map(|(now, then)| (now - then).norm());
                    if !at_rigid.holds(&rigid, 1e-3, ways.fold(0.0, f64::max)) {
                        at_rigid.list(&rigid, 1e-3, &places);
                    }
                    let mut rows = Vec::new();
                    let mut seen = vec![Seen::default(); rest.len()];
                    at_rigid
                        .look(&rigid, 1e-3, &places, &mut seen, |row| rows.push((row.nodes, row.weights)));
                    rows
                };
                let anew = rows(&mut fresh());
                let (stance, reach) = (kept.listed.stance, kept.listed.reach);
                assert_eq!(rows(&mut kept), anew, "{:?} at {time} s", rigid.shape);
                if (kept.listed.stance, kept.listed.reach) != (stance, reach) {
                    listed += 1;
                    then.clone_from(&places);
                }
                found += anew.len();
                before = after;
            }
            println!("{:?}: {found} rows in 400 steps, listed anew in {listed}", rigid.shape);
            assert!(found > 1000 && (listed < 200 || matches!(rigid.shape, Shape::HalfSpace)));
        }
    }
}
