//! The points of a face that are kept out of a rigid thing, besides its corners. A ball or a capsule meets a
//! face where the face is nearest to its centre or its axis. Such a point moves along as the thing slides, so
//! that its force does not jump. Other things meet the points of a lattice.

use std::collections::BTreeSet;

use nalgebra::Vector3;
use pliant_geometry::barycentric_of_closest;

use crate::shape::Shape;
use crate::touch::{lattice, parts_of};

/// Square of the cosine of the angle to the axis of a capsule below which an edge goes along it.
pub(crate) const ALONG: f64 = 0.5;

/// Points of the faces of a surface that meet a rigid thing.
#[derive(Clone, Debug)]
pub enum FacePoints {
    /// These, by the weights of the corners; none where faces are small enough for the thing.
    Lattice(Vec<[f64; 3]>),
    /// The points nearest to a ball or a capsule.
    Nearest(NearestPoints),
}

impl FacePoints {
    /// Returns the points of faces with edges up to a length [m] at a thing that bodies are outside of, or
    /// within.
    pub fn new(faces: &[[u32; 3]], longest: f64, shape: &Shape, inside: bool) -> Self {
        let points = lattice(parts_of(longest, shape));
        let (radius, half) = match *shape {
            Shape::Sphere { radius } if !inside && !points.is_empty() => (radius, 0.0),
            Shape::Capsule { radius, length } if !inside && !points.is_empty() => (radius, 0.5 * length),
            _ => return Self::Lattice(points),
        };
        Self::Nearest(NearestPoints { radius, half, edges: first_edges(faces) })
    }

    /// Largest number of points of a face.
    pub fn most(&self) -> usize {
        match self {
            Self::Lattice(points) => points.len(),
            Self::Nearest(NearestPoints { half, .. }) if *half > 0.0 => 11,
            Self::Nearest(_) => 4,
        }
    }

    /// The edges of a face, by its number, whose points are among its own: from each corner to the next.
    pub fn edges(&self, face: usize) -> [bool; 3] {
        match self {
            Self::Lattice(_) => [false; 3],
            Self::Nearest(nearest) => nearest.edges[face],
        }
    }
}

/// The points of faces that are nearest to a ball or a capsule. The thing is all within a radius of a segment
/// along z, whose length is zero for a ball.
#[derive(Clone, Debug)]
pub struct NearestPoints {
    radius: f64,
    /// Half of the length of the segment [m].
    half: f64,
    /// The edges of each face that no face before it has.
    edges: Vec<[bool; 3]>,
}

impl NearestPoints {
    /// Calls back with the weights of the corners at the points of a face, by its number, that are nearer to
    /// the thing than a room [m]. Corners [m] are in the frame of the thing.
    pub fn of(&self, face: usize, corners: &[Vector3<f64>; 3], room: f64, mut found: impl FnMut([f64; 3])) {
        let reach = self.radius + room;
        let is_beyond = |c: usize, reach: f64| {
            corners.iter().all(|corner| corner[c] > reach) || corners.iter().all(|corner| corner[c] < -reach)
        };
        if is_beyond(0, reach) || is_beyond(1, reach) || is_beyond(2, self.half + reach) {
            return;
        }
        let mut take = |weights: [f64; 3]| {
            let point: Vector3<f64> =
                corners.iter().zip(&weights).map(|(corner, &weight)| corner * weight).sum();
            let beyond = (point.z.abs() - self.half).max(0.0);
            if point.xy().norm_squared() + beyond * beyond < reach * reach {
                found(weights);
            }
        };
        within(corners, self.half, &mut take);
        for first in (0..3).filter(|&k| self.edges[face][k]) {
            let second = (first + 1) % 3;
            on_edge(corners[first], corners[second] - corners[first], self.half, |part| {
                let mut weights = [0.0; 3];
                (weights[first], weights[second]) = (1.0 - part, part);
                take(weights);
            });
        }
    }
}

/// The edges of each face that no face before it has.
fn first_edges(faces: &[[u32; 3]]) -> Vec<[bool; 3]> {
    let mut known = BTreeSet::new();
    let mut is_first = |a: u32, b: u32| known.insert((a.min(b), a.max(b)));
    faces.iter().map(|&[a, b, c]| [is_first(a, b), is_first(b, c), is_first(c, a)]).collect()
}

/// The ends of a segment along z.
fn ends(half: f64) -> impl Iterator<Item = f64> {
    [-half, half].into_iter().skip(usize::from(half == 0.0))
}

/// Points within a face that are nearest to an end of the segment, on the side of that end.
fn within(corners: &[Vector3<f64>; 3], half: f64, mut found: impl FnMut([f64; 3])) {
    for end in ends(half).filter(|end| corners.iter().any(|corner| corner.z * end >= 0.0)) {
        let weights = barycentric_of_closest(corners, &Vector3::new(0.0, 0.0, end));
        let height: f64 = corners.iter().zip(&weights).map(|(corner, weight)| corner.z * weight).sum();
        if !weights.contains(&0.0) && height * end >= 0.0 {
            found(weights);
        }
    }
}

/// Calls back with the place on an edge, from 0 to 1, that is nearest to the segment or to one of its ends.
/// For an edge along the axis, the points nearest to both ends count: the edge may touch all the way between
/// them.
fn on_edge(from: Vector3<f64>, along: Vector3<f64>, half: f64, mut found: impl FnMut(f64)) {
    let mut take = |part: f64| {
        if part > 0.0 && part < 1.0 {
            found(part);
        }
    };
    let (squared, across) = (along.norm_squared(), along.xy().norm_squared());
    let beside = (-from.xy().dot(&along.xy()) / across).clamp(0.0, 1.0);
    // Of an edge that is parallel to the axis it is not a number.
    let height = from.z + along.z * beside;
    if height.abs() < half {
        take(beside);
    }
    for end in ends(half) {
        if across < ALONG * squared || height * end >= half * half {
            take((end * along.z - from.dot(&along)) / squared);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pliant_testing::Random;

    /// No point of a face is nearer to a ball or a capsule than the nearest of its corners and points. The
    /// axis does not go through the face.
    #[test]
    fn no_point_of_a_face_is_nearer_than_those_found() {
        let mut random = Random::new(11);
        let fine = lattice(40);
        for shape in [Shape::Sphere { radius: 0.1 }, Shape::Capsule { radius: 0.1, length: 0.8 }] {
            let points = FacePoints::new(&[[0, 1, 2]], 1.0, &shape, false);
            let FacePoints::Nearest(nearest) = &points else { panic!("a lattice at {shape:?}") };
            let mut tried = 0;
            while tried < 2000 {
                let corners: [Vector3<f64>; 3] =
                    std::array::from_fn(|_| Vector3::from_fn(|_, _| 2.0 * random.half()));
                let distance =
                    |weights: &[f64; 3]| shape.near(&(0..3).map(|k| corners[k] * weights[k]).sum()).distance;
                let least = fine.iter().map(distance).fold(f64::INFINITY, f64::min);
                if least < 0.0 {
                    continue;
                }
                tried += 1;
                let mut closest =
                    corners.iter().map(|corner| shape.near(corner).distance).fold(f64::INFINITY, f64::min);
                let mut count = 0;
                nearest.of(0, &corners, 10.0, |weights| {
                    assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
                    closest = closest.min(distance(&weights));
                    count += 1;
                });
                // Those that are too far away are left out.
                nearest.of(0, &corners, 0.1, |weights| assert!(distance(&weights) < 0.1 + 1e-12));
                assert!(closest <= least + 1e-12 && count <= points.most(), "{closest} m, {least} m");
            }
        }
    }

    /// Two faces side by side, and the points at a thing that is at a place above them [m].
    fn points_of_strip(shape: &Shape, at: Vector3<f64>) -> Vec<Vector3<f64>> {
        let faces = [[0, 1, 2], [1, 3, 2]];
        let nodes = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
        let FacePoints::Nearest(points) = FacePoints::new(&faces, 2.0, shape, false) else {
            return Vec::new();
        };
        let mut found = Vec::new();
        for (number, face) in faces.iter().enumerate() {
            let corners =
                face.map(|node| Vector3::new(nodes[node as usize][0], nodes[node as usize][1], 0.0));
            let add = |weights: [f64; 3]| found.push((0..3).map(|k| corners[k] * weights[k]).sum());
            points.of(number, &corners.map(|corner| corner - at), 1.0, add);
        }
        found
    }

    /// The nearest point follows a ball that slides along a strip of faces.
    #[test]
    fn nearest_points_go_along_with_a_thing_that_slides() {
        for step in 0..=1000 {
            let centre = Vector3::new(0.1 + 0.8e-3 * f64::from(step), 0.4, 0.3);
            let points = points_of_strip(&Shape::Sphere { radius: 0.3 }, centre);
            let nearest = points.iter().map(|x| (x - centre).norm()).fold(f64::INFINITY, f64::min);
            assert!((nearest - 0.3).abs() < 1e-9, "{step}: {points:?}");
        }
    }

    /// A capsule touches a face or an edge at the points below its axis: upright, along the edge of two
    /// faces, and across it.
    #[test]
    fn capsules_meet_faces_and_edges_beneath_their_axes() {
        let shape = Shape::Capsule { radius: 0.1, length: 0.4 };
        let upright = points_of_strip(&shape, Vector3::new(0.2, 0.3, 0.3));
        assert!(
            upright.iter().filter(|x| (x.xy() - Vector3::new(0.2, 0.3, 0.0).xy()).norm() < 1e-9).count() == 1
        );
        // The axis of the capsule is z in its own frame, so these faces are parallel to z.
        let corners = [[0.1, -0.5, -0.5], [0.1, 0.5, -0.5], [0.1, 0.0, 0.5]].map(Vector3::from);
        let mut heights = Vec::new();
        within(&corners, 0.2, |weights| heights.push((0..3).map(|k| corners[k].z * weights[k]).sum::<f64>()));
        heights.retain(|z| (z.abs() - 0.2).abs() < 1e-9);
        assert_eq!(heights.len(), 2, "{heights:?}");
        let mut parts = Vec::new();
        on_edge(Vector3::new(0.1, 0.0, -0.5), Vector3::z(), 0.2, |part| parts.push(part));
        assert!((parts[0] - 0.3).abs() < 1e-12 && (parts[1] - 0.7).abs() < 1e-12, "{parts:?}");
    }

    /// Faces that are small for a thing, cavities and shapes with edges are as before.
    #[test]
    fn small_faces_have_none_and_other_shapes_a_lattice() {
        let ball = Shape::Sphere { radius: 0.01 };
        let of = |longest, shape: &Shape, inside| FacePoints::new(&[[0, 1, 2]], longest, shape, inside);
        assert_eq!(of(0.005, &ball, false).most(), 0);
        assert_eq!(of(0.02, &ball, false).most(), 4);
        assert_eq!(of(0.02, &ball, true).most(), lattice(3).len());
        assert!(matches!(of(0.1, &Shape::Cuboid { size: [0.02; 3] }, false), FacePoints::Lattice(_)));
        assert_eq!(first_edges(&[[0, 1, 2], [2, 1, 3]]), [[true; 3], [false, true, true]]);
    }
}
