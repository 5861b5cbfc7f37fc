//! Winding number of a surface round a point: 1 inside, 0 outside, in between near holes, more where parts
//! overlap (Jacobson, Kavan and Sorkine-Hornung 2013). Triangles far away count together, as a dipole at
//! their middle (Barill et al. 2018, first order). The solid angle of a near triangle is exact (van Oosterom
//! and Strackee 1983).

use pliant_geometry::Vector3;

/// Triangles in a leaf of the tree.
const LEAF: usize = 8;

/// Triangles farther than this many of their radii count together: the sum is right to about 0.01.
const FAR: f64 = 3.0;

/// A tree of triangles.
pub(crate) struct Winding {
    triangles: Vec<[Vector3; 3]>,
    nodes: Vec<Node>,
}

struct Node {
    /// Middle of the triangles, weighted by area [m].
    middle: Vector3,
    /// Sum of areas times normals [m²].
    dipole: Vector3,
    /// No corner is farther from the middle [m].
    radius: f64,
    /// Triangles of this node.
    range: [usize; 2],
    /// Two nodes into which it is divided; the first follows it.
    second: Option<usize>,
}

impl Winding {
    pub(crate) fn new(mut triangles: Vec<[Vector3; 3]>) -> Self {
        let mut nodes = Vec::new();
        divide(&mut triangles, 0, &mut nodes);
        Self { triangles, nodes }
    }

    /// The winding number at a point.
    pub(crate) fn at(&self, point: &Vector3) -> f64 {
        if self.nodes.is_empty() { 0.0 } else { self.angle(0, point) / (4.0 * std::f64::consts::PI) }
    }

    /// Solid angle of the triangles of a node [sr].
    fn angle(&self, at: usize, point: &Vector3) -> f64 {
        let node = &self.nodes[at];
        let way = node.middle - point;
        let distance = way.norm();
        if distance > FAR * node.radius {
            return way.dot(&node.dipole) / distance.powi(3);
        }
        match node.second {
            Some(second) => self.angle(at + 1, point) + self.angle(second, point),
            None => {
                let [from, to] = node.range;
                self.triangles[from..to].iter().map(|triangle| solid_angle(triangle, point)).sum()
            }
        }
    }
}

/// Sorts triangles from number `offset` on into nodes.
fn divide(triangles: &mut [[Vector3; 3]], offset: usize, nodes: &mut Vec<Node>) {
    if triangles.is_empty() {
        return;
    }
    let area = |[a, b, c]: &[Vector3; 3]| 0.5 * (b - a).cross(&(c - a));
    let centre = |[a, b, c]: &[Vector3; 3]| (a + b + c) / 3.0;
    let weight: f64 = triangles.iter().map(|t| area(t).norm()).sum();
    let sum: Vector3 = triangles.iter().map(|t| area(t).norm() * centre(t)).sum();
    let middle = if weight > 0.0 { sum / weight } else { centre(&triangles[0]) };
    let radius = triangles.iter().flatten().map(|x| (x - middle).norm()).fold(0.0, f64::max);
    let index = nodes.len();
    let dipole = triangles.iter().map(area).sum();
    nodes.push(Node { middle, dipole, radius, range: [offset, offset + triangles.len()], second: None });
    if triangles.len() <= LEAF {
        return;
    }
    let first = centre(&triangles[0]);
    let (low, high) =
        triangles.iter().map(centre).fold((first, first), |(low, high), x| (low.inf(&x), high.sup(&x)));
    let axis = (high - low).imax();
    let half = triangles.len() / 2;
    triangles.select_nth_unstable_by(half, |a, b| centre(a)[axis].total_cmp(&centre(b)[axis]));
    let (left, right) = triangles.split_at_mut(half);
    divide(left, offset, nodes);
    nodes[index].second = Some(nodes.len());
    divide(right, offset + half, nodes);
}

/// Solid angle of a triangle seen from a point [sr], positive from behind.
fn solid_angle(corners: &[Vector3; 3], point: &Vector3) -> f64 {
    let [a, b, c] = corners.map(|corner| corner - point);
    let [x, y, z] = [a.norm(), b.norm(), c.norm()];
    let volume = a.dot(&b.cross(&c));
    2.0 * volume.atan2(x * y * z + a.dot(&b) * z + b.dot(&c) * x + c.dot(&a) * y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DEFAULT_CELL_LIMIT, TriangleMesh, sphere};

    #[test]
    fn a_ball_winds_once_round_what_is_inside() {
        let ball = TriangleMesh::from_mesh(&sphere(1.0, 4, DEFAULT_CELL_LIMIT).unwrap()).unwrap().0;
        let winding = Winding::new(ball.alive().map(|t| ball.corners(t)).collect());
        for (distance, expected) in [(0.0, 1.0), (0.5, 1.0), (0.98, 1.0), (1.02, 0.0), (3.0, 0.0)] {
            let number = winding.at(&(distance * Vector3::new(0.6, -0.48, 0.64)));
            assert!((number - expected).abs() < 0.02, "{distance}: {number}");
        }
    }
}
