//! Keeps the boundary of a mesh that changes free of intersections. A change is accepted if its faces neither
//! cross other faces nor come nearer to them than a clearance. The first boundary must have no intersections.
//! `crossings.rs` defines crossings.

use std::collections::HashMap;

use pliant_geometry::{Vector3, barycentric_of_closest};

use crate::surface::boxes::Boxes;
use crate::surface::crossings::{meet, widened};
use crate::tets::complex::Complex;

/// Faces without a common node keep this distance, in lattice constants. A barrier between them needs a gap.
const CLEARANCE: f64 = 0.04;

/// Faces of the boundary by place.
pub(crate) struct Guard {
    /// Faces, outward; removed ones stay in the list.
    faces: Vec<[u32; 3]>,
    is_gone: Vec<bool>,
    /// Numbers of faces by their sorted nodes.
    numbers: HashMap<[u32; 3], u32>,
    /// Numbers of the faces round each point; some are removed.
    round: Vec<Vec<u32>>,
    boxes: Boxes,
}

fn key(mut face: [u32; 3]) -> [u32; 3] {
    face.sort_unstable();
    face
}

impl Guard {
    /// Guards the boundary of a mesh.
    pub(crate) fn new(complex: &Complex) -> Self {
        let finest = complex.size.iter().copied().fold(f64::INFINITY, f64::min);
        let mut guard = Self {
            faces: Vec::new(),
            is_gone: Vec::new(),
            numbers: HashMap::new(),
            round: vec![Vec::new(); complex.points.len()],
            boxes: Boxes::new(finest),
        };
        for face in complex.outer_faces() {
            guard.add(complex, face);
        }
        guard
    }

    fn add(&mut self, complex: &Complex, face: [u32; 3]) {
        let number = self.faces.len() as u32;
        self.faces.push(face);
        self.is_gone.push(false);
        self.numbers.insert(key(face), number);
        face.into_iter().for_each(|node| self.round[node as usize].push(number));
        self.boxes.insert(number, box_of(face.map(|node| complex.points[node as usize])));
    }

    /// Records the new positions of points and the new faces round them.
    pub(crate) fn note(&mut self, complex: &Complex, points: &[u32]) {
        self.round.resize(complex.points.len(), Vec::new());
        for &point in points {
            let rim = complex.rim_of(point, |_| true);
            let is_there = |face: &[u32; 3]| rim.iter().any(|other| key(*other) == key(*face));
            for number in std::mem::take(&mut self.round[point as usize]) {
                let face = self.faces[number as usize];
                if self.is_gone[number as usize] {
                    continue;
                }
                if is_there(&face) {
                    self.round[point as usize].push(number);
                    self.boxes.insert(number, box_of(face.map(|node| complex.points[node as usize])));
                } else {
                    self.is_gone[number as usize] = true;
                    self.numbers.remove(&key(face));
                }
            }
            for face in rim {
                if !self.numbers.contains_key(&key(face)) {
                    self.add(complex, face);
                }
            }
        }
        if self.boxes.len() > 4 * self.numbers.len() + 1000 {
            self.boxes = self.boxes.emptied();
            for (number, face) in (0..).zip(&self.faces).filter(|(number, _)| !self.is_gone[*number as usize])
            {
                self.boxes.insert(number, box_of(face.map(|node| complex.points[node as usize])));
            }
        }
    }

    /// True if a point may move to `place`.
    pub(crate) fn lets_move(&self, complex: &Complex, point: u32, place: &Vector3) -> bool {
        let of = &self.round[point as usize];
        let rim: Vec<[u32; 3]> = of
            .iter()
            .filter(|&&number| !self.is_gone[number as usize])
            .map(|&number| self.faces[number as usize])
            .collect();
        let at = |node: u32| if node == point { *place } else { complex.points[node as usize] };
        rim.is_empty() || self.lets(complex, &rim, &at, &|face| face.contains(&point))
    }

    /// True if `gone` may be joined into `kept` at `place`.
    pub(crate) fn lets_collapse(&self, complex: &Complex, gone: u32, kept: u32, place: &Vector3) -> bool {
        let is_changed = |face: &[u32; 3]| face.contains(&gone) || face.contains(&kept);
        let of = self.round[gone as usize].iter().chain(&self.round[kept as usize]);
        let mut rim: Vec<[u32; 3]> = of
            .filter(|&&number| !self.is_gone[number as usize])
            .map(|&number| self.faces[number as usize])
            .filter(|face| !(face.contains(&gone) && face.contains(&kept)))
            .map(|face| face.map(|node| if node == gone { kept } else { node }))
            .collect();
        rim.sort_unstable();
        rim.dedup();
        let at = |node: u32| if node == kept { *place } else { complex.points[node as usize] };
        rim.is_empty() || self.lets(complex, &rim, &at, &is_changed)
    }

    /// True if the edge p q of two faces may turn to the other two nodes a, b of the faces.
    pub(crate) fn lets_turn(&self, complex: &Complex, [p, q]: [u32; 2], [a, b]: [u32; 2]) -> bool {
        let at = |node: u32| complex.points[node as usize];
        self.lets(complex, &[[a, b, p], [b, a, q]], &at, &|face| face.contains(&p) && face.contains(&q))
    }

    /// True if new faces keep clear of all others and of each other. `at` gives their corners, `is_replaced`
    /// the faces that they replace.
    fn lets(
        &self,
        complex: &Complex,
        new: &[[u32; 3]],
        at: &dyn Fn(u32) -> Vector3,
        is_replaced: &dyn Fn(&[u32; 3]) -> bool,
    ) -> bool {
        let before = |node: u32| complex.points[node as usize];
        for (k, &triangle) in new.iter().enumerate() {
            if new[..k].iter().any(|&other| meet(at, triangle, other).is_some()) {
                return false;
            }
            let room =
                CLEARANCE * triangle.iter().map(|&n| complex.size[n as usize]).fold(f64::INFINITY, f64::min);
            let [low, high] = box_of(triangle.map(at));
            let [low, high] = [low.add_scalar(-room), high.add_scalar(room)];
            for number in self.boxes.near([low, high]) {
                let other = self.faces[number as usize];
                if self.is_gone[number as usize] || is_replaced(&other) {
                    continue;
                }
                let corners = other.map(before);
                let [least, most] = box_of(corners);
                if (0..3).any(|axis| least[axis] > high[axis] || most[axis] < low[axis]) {
                    continue;
                }
                if meet(at, triangle, other).is_some() {
                    return false;
                }
                if triangle.iter().all(|node| !other.contains(node)) {
                    let gap = distance(&triangle.map(at), &corners);
                    // Faces that are nearer already may only move apart.
                    if gap < room && gap < distance(&triangle.map(before), &corners) {
                        return false;
                    }
                }
            }
        }
        true
    }
}

fn box_of(corners: [Vector3; 3]) -> [Vector3; 2] {
    corners.iter().fold([corners[0]; 2], widened)
}

/// Distance of two triangles that do not cross [m]: from a corner to a triangle, or between two edges.
fn distance(triangle: &[Vector3; 3], other: &[Vector3; 3]) -> f64 {
    let from = |corner: &Vector3, face: &[Vector3; 3]| {
        let weights = barycentric_of_closest(face, corner);
        (corner - face[0] * weights[0] - face[1] * weights[1] - face[2] * weights[2]).norm()
    };
    let corners = triangle.iter().map(|x| from(x, other)).chain(other.iter().map(|x| from(x, triangle)));
    let edge = |face: &[Vector3; 3], k: usize| [face[k], face[(k + 1) % 3]];
    let edges = (0..9).map(|k| of_edges(edge(triangle, k / 3), edge(other, k % 3)));
    corners.chain(edges).fold(f64::INFINITY, f64::min)
}

/// Distance of two segments (Ericson, Real-Time Collision Detection, 2005, section 5.1.9).
fn of_edges([p, q]: [Vector3; 2], [r, s]: [Vector3; 2]) -> f64 {
    let (u, v, w) = (q - p, s - r, p - r);
    let (a, b, e) = (u.norm_squared(), u.dot(&v), v.norm_squared());
    let (c, f) = (u.dot(&w), v.dot(&w));
    let part = |over: f64, of: f64| if of > 0.0 { (over / of).clamp(0.0, 1.0) } else { 0.0 };
    let first = part(b * f - c * e, a * e - b * b);
    let second = part(b * first + f, e);
    let first = part(b * second - c, a);
    (w + u * first - v * second).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use pliant_testing::Random;

    /// Comparison with the nearest of many points of each.
    #[test]
    fn distances_of_triangles_are_those_of_their_nearest_points() {
        let mut random = Random::new(3);
        for _ in 0..200 {
            let [triangle, mut other] = [0, 1].map(|_| [0, 1, 2].map(|_| Vector3::from(random.vector())));
            other.iter_mut().for_each(|x| x.z += 2.5);
            let found = distance(&triangle, &other);
            let points = |face: &[Vector3; 3]| -> Vec<Vector3> {
                let n = 24;
                (0..=n)
                    .flat_map(|i| (0..=n - i).map(move |j| [i, j, n - i - j]))
                    .map(|w| (0..3).map(|k| face[k] * (w[k] as f64 / n as f64)).sum())
                    .collect()
            };
            let (first, second) = (points(&triangle), points(&other));
            let nearest = first
                .iter()
                .flat_map(|x| second.iter().map(move |y| (x - y).norm()))
                .fold(f64::INFINITY, f64::min);
            assert!(found <= nearest + 1e-12 && nearest < found + 0.1, "{found} {nearest}");
        }
    }

    /// Two tets, tip to tip.
    #[test]
    fn a_tip_stays_clear_of_another() {
        let tip = |sign: f64| {
            let base = [[1.0, 0.0], [-0.5, 0.8], [-0.5, -0.8]].map(|[x, y]| Vector3::new(x, y, 2.0 * sign));
            [Vector3::new(0.0, 0.0, 0.5 * sign), base[0], base[1], base[2]]
        };
        let points: Vec<Vector3> = tip(1.0).into_iter().chain(tip(-1.0)).collect();
        let mut complex = Complex::new(points, vec![[1, 3, 2, 0], [5, 6, 7, 4]], 1.0);
        assert!(complex.alive().all(|tet| complex.length(tet).abs() > 0.0));
        let mut guard = Guard::new(&complex);
        let to = |z: f64| Vector3::new(0.0, 0.0, z);
        assert!(guard.lets_move(&complex, 0, &to(-0.4)));
        assert!(!guard.lets_move(&complex, 0, &to(-0.47)), "nearer than the clearance");
        assert!(!guard.lets_move(&complex, 0, &to(-1.0)), "in the other tet");
        complex.points[4] = to(-1.0);
        guard.note(&complex, &[4]);
        assert!(guard.lets_move(&complex, 0, &to(-0.9)));
        assert!(!guard.lets_move(&complex, 0, &to(-1.2)));
    }
}
