//! The point of a surface that is closest to a given point, and the normal there. Normals are area-weighted
//! means at the nodes, linear in between: they turn smoothly on a curved surface and are exact on a flat one.
//! Leaves out: which side a point is on. Triangles are halved at the median of their centres until few are
//! left. The nearer half is searched first; a box farther away than the best result is skipped. Among equally
//! close triangles, the first found wins.

use crate::locate::{barycentric_of_closest, on_triangle};
use crate::{Surface, Vector3};

/// A search tree over faces of a surface.
#[derive(Clone, Debug)]
pub struct SurfaceLocator {
    triangles: Vec<Triangle>,
    /// Halves, each before the two that it is made of.
    parts: Vec<Part>,
}

/// Triangles at most in a part that is not halved.
const FEW: usize = 4;

/// Some of the triangles and the box round them.
#[derive(Clone, Debug)]
struct Part {
    low: Vector3,
    high: Vector3,
    first: u32,
    end: u32,
    /// The second of its two halves (the first is the next entry); 0 for a part that is not halved.
    second: u32,
}

impl Part {
    /// The square of the distance to the box [m²].
    fn distance_2(&self, to: &Vector3) -> f64 {
        (to.sup(&self.low).inf(&self.high) - to).norm_squared()
    }
}

/// A point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Its place [m].
    pub position: Vector3,
    /// The outward unit normal there; zero where the surface folds onto itself.
    pub normal: Vector3,
    /// The face it lies on, as an index into the surface's faces.
    pub face: u32,
    /// The three nodes around it (for a quad, the nodes of one half).
    pub nodes: [u32; 3],
    /// Their weights, which add up to 1.
    pub weights: [f64; 3],
}

#[derive(Clone, Debug)]
struct Triangle {
    corners: [Vector3; 3],
    normals: [Vector3; 3],
    face: u32,
    nodes: [u32; 3],
}

impl Triangle {
    /// The normal times twice the area [m²].
    fn area_vector(&self) -> Vector3 {
        let [a, b, c] = self.corners;
        (b - a).cross(&(c - a))
    }

    fn at(&self, weights: [f64; 3]) -> SurfacePoint {
        let normal = on_triangle(&self.normals, weights).try_normalize(1e-12).unwrap_or_default();
        let position = on_triangle(&self.corners, weights);
        SurfacePoint { position, normal, face: self.face, nodes: self.nodes, weights }
    }
}

impl SurfaceLocator {
    /// Sorts some faces of a surface (indices into its faces) into a tree; only they count for the normals. A
    /// quad is taken as two triangles.
    pub fn new(surface: &Surface, faces: &[u32], points: &[Vector3]) -> Self {
        let part = Surface { faces: faces.iter().map(|&face| surface.faces[face as usize]).collect() };
        let normals = part.node_normals(points);
        let triangle = |(face, nodes): (u32, [u32; 3])| Triangle {
            corners: nodes.map(|node| points[node as usize]),
            normals: nodes.map(|node| normals[node as usize]),
            face,
            nodes,
        };
        let halves = part.faces.iter().zip(faces).flat_map(|(face, &number)| {
            let nodes = face.nodes();
            (2..nodes.len()).map(move |k| (number, [nodes[0], nodes[k - 1], nodes[k]]))
        });
        let mut locator = Self { triangles: halves.map(triangle).collect(), parts: Vec::new() };
        if !locator.triangles.is_empty() {
            locator.sort(0, locator.triangles.len());
        }
        locator
    }

    fn sort(&mut self, first: usize, end: usize) {
        let triangles = &mut self.triangles[first..end];
        let start = triangles[0].corners[0];
        let corners = triangles.iter().flat_map(|triangle| &triangle.corners);
        let (low, high) = corners.fold((start, start), |(low, high), x| (low.inf(x), high.sup(x)));
        let number = self.parts.len();
        self.parts.push(Part { low, high, first: first as u32, end: end as u32, second: 0 });
        if triangles.len() > FEW {
            let axis = (high - low).imax();
            let centre = |triangle: &Triangle| triangle.corners.iter().map(|x| x[axis]).sum::<f64>();
            let middle = triangles.len() / 2;
            triangles.select_nth_unstable_by(middle, |a, b| {
                centre(a).total_cmp(&centre(b)).then(a.face.cmp(&b.face))
            });
            self.sort(first, first + middle);
            self.parts[number].second = self.parts.len() as u32;
            self.sort(first + middle, end);
        }
    }

    /// The closest point [m]; `None` without faces, or if `to` is not finite.
    pub fn closest(&self, to: &Vector3) -> Option<SurfacePoint> {
        self.search(to, f64::INFINITY, |_| true)
    }

    /// The closest point, less than `within` [m] away, among the faces whose normals have a cosine above
    /// `least` with the unit vector `facing`; `None` if none is near enough.
    pub fn closest_facing(
        &self,
        to: &Vector3,
        facing: &Vector3,
        least: f64,
        within: f64,
    ) -> Option<SurfacePoint> {
        let faces = |triangle: &Triangle| {
            let across = triangle.area_vector();
            across.dot(facing) > least * across.norm()
        };
        self.search(to, within * within, faces)
    }

    /// The closest point of the triangles that count, nearer than the root of `least` [m²].
    fn search(
        &self,
        to: &Vector3,
        mut least: f64,
        counts: impl Fn(&Triangle) -> bool,
    ) -> Option<SurfacePoint> {
        let mut best: Option<(usize, [f64; 3])> = None;
        let mut ahead = [(0, 0.0); 64];
        let mut count = usize::from(!self.parts.is_empty() && to.iter().all(|x| x.is_finite()));
        while count > 0 {
            count -= 1;
            let (number, distance) = ahead[count];
            if distance >= least {
                continue;
            }
            let part = &self.parts[number];
            if part.second == 0 {
                for at in part.first as usize..part.end as usize {
                    let weights = barycentric_of_closest(&self.triangles[at].corners, to);
                    let distance = (on_triangle(&self.triangles[at].corners, weights) - to).norm_squared();
                    if distance < least && counts(&self.triangles[at]) {
                        (best, least) = (Some((at, weights)), distance);
                    }
                }
            } else {
                let of = |half: usize| (half, self.parts[half].distance_2(to));
                let (first, second) = (of(number + 1), of(part.second as usize));
                // The nearer one comes next.
                (ahead[count], ahead[count + 1]) =
                    if second.1 < first.1 { (first, second) } else { (second, first) };
                count += 2;
            }
        }
        best.map(|(at, weights)| self.triangles[at].at(weights))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::boundary;
    use crate::testing::{block_of_hexes, block_of_tets};

    #[test]
    fn the_closest_point_of_a_block_is_on_its_nearest_face() {
        for mesh in [block_of_hexes([4, 4, 4]), block_of_tets([4, 4, 4])] {
            let surface = boundary(&mesh);
            let top = (0..).zip(&surface.faces).filter(|(_, face)| face.centre(&mesh.points).z > 3.999);
            let top: Vec<u32> = top.map(|(index, _)| index).collect();
            let locator = SurfaceLocator::new(&surface, &top, &mesh.points);
            // Above, below, and beyond an edge, where the other sides of the block are nearer.
            for (at, expected) in [
                ([1.3, 2.1, 3.0], [1.3, 2.1, 4.0]),
                ([1.3, 2.1, 9.0], [1.3, 2.1, 4.0]),
                ([-1.0, 2.1, 1.0], [0.0, 2.1, 4.0]),
            ] {
                let found = locator.closest(&Vector3::from(at)).unwrap();
                assert!((found.position - Vector3::from(expected)).norm() < 1e-12, "{found:?}");
                assert!((found.normal - Vector3::z()).norm() < 1e-12, "{found:?}");
            }
        }
    }

    /// Over the top of a block 4 high: its bottom is closest among downward faces, its sides among lateral
    /// ones.
    #[test]
    fn faces_that_look_the_other_way_do_not_count() {
        let mesh = block_of_tets([4, 4, 4]);
        let surface = boundary(&mesh);
        let faces: Vec<u32> = (0..surface.faces.len() as u32).collect();
        let locator = SurfaceLocator::new(&surface, &faces, &mesh.points);
        let over = Vector3::new(1.3, 2.1, 4.5);
        let found = |facing: Vector3, within: f64| {
            locator.closest_facing(&over, &facing, 0.0, within).map(|at| at.position)
        };
        assert!((found(Vector3::z(), 1.0).unwrap() - Vector3::new(1.3, 2.1, 4.0)).norm() < 1e-12);
        assert!((found(-Vector3::z(), 5.0).unwrap() - Vector3::new(1.3, 2.1, 0.0)).norm() < 1e-12);
        assert!((found(-Vector3::x(), 5.0).unwrap() - Vector3::new(0.0, 2.1, 4.0)).norm() < 1e-12);
        assert_eq!(found(-Vector3::z(), 4.0), None);
    }

    #[test]
    fn no_faces_have_no_closest_point() {
        assert_eq!(SurfaceLocator::new(&Surface::default(), &[], &[]).closest(&Vector3::zeros()), None);
    }
}
