//! Intersections of surfaces: edges against triangles, without the lists of the contacts. A slow and simple
//! check to test fast ones against.

use nalgebra::Vector3;

use super::collision_mesh::{CollisionMesh, around};
use super::distance::{Nearest, edge_edge, point_triangle};
use crate::touch::{Contacts, With};
use crate::tree::{Bounds, Tree};

/// Depth of an intersection, over the mean edge, up to which it does not count.
const SLIGHT: f64 = 1e-4;

/// Searches bodies that touch each other or themselves for edges that go through triangles.
pub struct IntersectionCheck {
    /// Contacts by their places, with their surfaces and the depth [m] above which an intersection counts.
    contacts: Vec<(usize, Vec<CollisionMesh>, f64)>,
}

/// An edge that goes through a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intersection {
    /// The contact, by its place.
    pub contact: usize,
    /// The shortest way [m] that parts the edge and the triangle.
    pub depth: f64,
    /// An end of the edge [m].
    pub place: [f64; 3],
    /// The nodes of that way: an end and the corners of the triangle, or the ends of two edges.
    pub nodes: [u32; 4],
    /// Coefficients c of the nodes: Σ c x is the way [m], which ends where the edge and the triangle meet no
    /// more.
    pub coefficients: [f64; 4],
    /// Σ c x over the depth.
    pub normal: Vector3<f64>,
}

impl IntersectionCheck {
    /// A check of the contacts of bodies, except those with nodes that another solver moves. Nodes are at
    /// rest at some places [m].
    pub fn new(contacts: &Contacts, rest: &[[f64; 3]]) -> Self {
        let belongs = |node: &u32| (*node as usize) < rest.len();
        let place = |node: u32| Vector3::from(rest[node as usize]);
        let of_bodies = contacts.contacts.iter().enumerate().filter(|(_, contact)| {
            !matches!(contact.with, With::Rigid(_))
                && contact.surfaces().all(|surface| surface.nodes.iter().all(belongs))
        });
        let checked = of_bodies.map(|(number, contact)| {
            let sides = contact.surfaces().map(|surface| CollisionMesh::of_body(surface, place));
            let sides: Vec<CollisionMesh> = sides.collect();
            let count = |side: &CollisionMesh| side.edges.len() as f64;
            let length: f64 = sides.iter().map(|side| side.mean_edge(place) * count(side)).sum();
            let edge_count: f64 = sides.iter().map(count).sum();
            (number, sides, SLIGHT * length / edge_count.max(1.0))
        });
        Self { contacts: checked.collect() }
    }

    /// Counts each intersection, however shallow.
    #[must_use]
    pub fn of_all(mut self) -> Self {
        self.contacts.iter_mut().for_each(|(_, _, slight)| *slight = 0.0);
        self
    }

    /// Calls back with each intersection that counts, with nodes at some places [m].
    pub fn find(&self, place: impl Fn(u32) -> Vector3<f64>, mut found: impl FnMut(Intersection)) {
        for (contact, sides, slight) in &self.contacts {
            let mut look = |edges, faces| {
                intersections([edges, faces], &place, |ends, corners| {
                    let (nodes, out) = way_out(ends, corners, &place);
                    if out.distance > *slight {
                        found(Intersection {
                            contact: *contact,
                            depth: out.distance,
                            place: place(ends[0]).into(),
                            nodes,
                            coefficients: out.coefficients,
                            normal: out.normal,
                        });
                    }
                });
            };
            match &sides[..] {
                [first, second] => {
                    look(first, second);
                    look(second, first);
                }
                sides => sides.iter().for_each(|side| look(side, side)),
            }
        }
    }
}

/// Returns the shortest way that separates an edge from a triangle which it crosses, with its nodes. Either
/// an end goes to the triangle, or the edge to a side.
fn way_out(
    [p, q]: [u32; 2],
    [a, b, c]: [u32; 3],
    place: &impl Fn(u32) -> Vector3<f64>,
) -> ([u32; 4], Nearest) {
    let ends = [p, q].map(|end| [end, a, b, c]).map(|nodes| (nodes, point_triangle(&nodes.map(place))));
    let sides = [[a, b], [b, c], [c, a]].map(|[from, to]| [p, q, from, to]);
    let sides = sides.map(|nodes| (nodes, edge_edge(&nodes.map(place))));
    let [first, second] = ends;
    let shorter = |one: ([u32; 4], Nearest), other: ([u32; 4], Nearest)| {
        if other.1.distance < one.1.distance { other } else { one }
    };
    sides.into_iter().fold(shorter(first, second), shorter)
}

/// Edges that go through triangles: calls back with the ends and the corners. Of one side alone those with a
/// node in common count for nothing.
pub(super) fn intersections(
    [edges, faces]: [&CollisionMesh; 2],
    place: &impl Fn(u32) -> Vector3<f64>,
    mut found: impl FnMut([u32; 2], [u32; 3]),
) {
    let none = |_| 0.0;
    let mut met = Vec::new();
    let mut look = |ends: [u32; 2], wanted: &Bounds, met: &[u32]| {
        for &face in met {
            let corners = faces.faces[face as usize];
            let apart = !ends.iter().any(|end| corners.contains(end));
            let near = apart && around(corners, place, &none).touches(wanted);
            if near && goes_through(ends.map(place), corners.map(place)) {
                found(ends, corners);
            }
        }
    };
    if edges.edges.len() <= FEW {
        met.extend(0..faces.faces.len() as u32);
        edges.edges.iter().for_each(|&ends| look(ends, &around(ends, place, &none), &met));
        return;
    }
    let tree = Tree::new(faces.faces.len(), |face| around(faces.faces[face as usize], place, &none));
    for &ends in &edges.edges {
        let wanted = around(ends, place, &none);
        met.clear();
        tree.near(&wanted, |face| met.push(face));
        met.sort_unstable();
        look(ends, &wanted, &met);
    }
}

/// Edges for which no tree of triangles is made.
const FEW: usize = 4;

/// Volume of points in a plane due to round-off, over the cube of the largest extent.
const FLAT: f64 = 1e-14;

/// True if an edge goes through a triangle. Its ends are on both sides of the plane, and the line goes round
/// all three edges in one sense. False if all points are in one plane.
fn goes_through([p, q]: [Vector3<f64>; 2], [a, b, c]: [Vector3<f64>; 3]) -> bool {
    // Six times the volume of a tetrahedron.
    let volume = |x: &Vector3<f64>, y: &Vector3<f64>, z: &Vector3<f64>, of: &Vector3<f64>| {
        (x - of).dot(&(y - of).cross(&(z - of)))
    };
    let largest = [q, a, b, c].iter().map(|x| (x - p).amax()).fold(0.0, f64::max);
    let none = FLAT * largest.powi(3);
    let [above, below] = [volume(&a, &b, &c, &p), volume(&a, &b, &c, &q)];
    if above * below >= 0.0 || above.abs() < none || below.abs() < none {
        return false;
    }
    let around = [volume(&a, &b, &q, &p), volume(&b, &c, &q, &p), volume(&c, &a, &q, &p)];
    around.iter().all(|&v| v > none) || around.iter().all(|&v| v < -none)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A spike that goes through a block by a tenth of its edge: by the way back, not by the length of its
    /// edges.
    #[test]
    fn an_intersection_is_as_deep_as_the_way_out() {
        let triangle = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let of = |p: [f64; 3], q: [f64; 3]| {
            let points: Vec<Vector3<f64>> = triangle.into_iter().chain([p, q]).map(Vector3::from).collect();
            let (nodes, out) = way_out([3, 4], [0, 1, 2], &|node| points[node as usize]);
            let way: Vector3<f64> =
                nodes.iter().zip(out.coefficients).map(|(&node, c)| c * points[node as usize]).sum();
            assert!((way - out.normal * out.distance).norm() < 1e-12);
            out.distance
        };
        assert!((of([0.3, 0.3, 1.0], [0.3, 0.3, -0.1]) - 0.1).abs() < 1e-12);
        assert!((of([0.3, 0.02, 1.0], [0.3, 0.02, -1.0]) - 0.02).abs() < 1e-12);
        assert!((of([0.4, 0.5, 1.0], [0.4, 0.5, -1.0]) - 0.1 / 2.0_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn edges_go_through_triangles_within_their_borders() {
        let triangle = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(Vector3::from);
        let through = |p: [f64; 3], q: [f64; 3]| goes_through([p, q].map(Vector3::from), triangle);
        assert!(through([0.2, 0.2, 1.0], [0.3, 0.2, -1.0]) && through([0.2, 0.2, -1.0], [0.3, 0.2, 1.0]));
        assert!(!through([0.2, 0.2, 1.0], [0.3, 0.2, 0.1]) && !through([0.8, 0.8, 1.0], [0.8, 0.8, -1.0]));
        assert!(!through([-0.1, 0.5, 0.0], [1.0, 0.5, 0.0]));
        // In a line with a side, outside the triangle, in one plane but for round-off.
        let sheet = |x: f64, y: f64| Vector3::new(0.1 * x, 0.1 * y, 1e-17 * x);
        let corners = [sheet(4.0, 1.0), sheet(4.0, 2.0), sheet(3.0, 2.0)];
        assert!(!goes_through([sheet(2.0, 3.0), sheet(1.0, 4.0)], corners));
        assert!(through([0.2, 0.2, 1e-9], [0.3, 0.2, -1e-9]));
    }
}
