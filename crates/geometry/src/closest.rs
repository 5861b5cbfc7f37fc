//! The point of a surface that is closest to a point, and the direction in which the surface looks there. Normals are
//! means at the nodes, weighted by area, linear in between: on a curved surface they turn smoothly, on a flat one they
//! are exact. Leaves out: which side a point is on.

use rstar::{AABB, PointDistance, RTree, RTreeObject};

use crate::locate::{barycentric_of_closest, on_triangle};
use crate::{Surface, Vector3};

/// A search tree over faces of a surface.
#[derive(Clone, Debug)]
pub struct SurfaceLocator {
    tree: RTree<Triangle>,
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
    /// Three nodes of it between which it lies (of a quad those of one half).
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
    fn closest(&self, to: &Vector3) -> SurfacePoint {
        let weights = barycentric_of_closest(&self.corners, to);
        let normal = on_triangle(&self.normals, weights).try_normalize(1e-12).unwrap_or_default();
        let position = on_triangle(&self.corners, weights);
        SurfacePoint { position, normal, face: self.face, nodes: self.nodes, weights }
    }
}

impl RTreeObject for Triangle {
    type Envelope = AABB<[f64; 3]>;

    fn envelope(&self) -> Self::Envelope {
        let [a, b, c] = self.corners;
        AABB::from_corners(a.inf(&b).inf(&c).into(), a.sup(&b).sup(&c).into())
    }
}

impl PointDistance for Triangle {
    fn distance_2(&self, point: &[f64; 3]) -> f64 {
        let point = Vector3::from(*point);
        (self.closest(&point).position - point).norm_squared()
    }
}

impl SurfaceLocator {
    /// Sorts some faces of a surface (indices into its faces) into a tree; only they count for the normals. A quad is
    /// taken as two triangles.
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
        Self { tree: RTree::bulk_load(halves.map(triangle).collect()) }
    }

    /// The closest point [m]; `None` without faces.
    pub fn closest(&self, to: &Vector3) -> Option<SurfacePoint> {
        self.tree.nearest_neighbor((*to).into()).map(|triangle| triangle.closest(to))
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

    #[test]
    fn no_faces_have_no_closest_point() {
        assert_eq!(SurfaceLocator::new(&Surface::default(), &[], &[]).closest(&Vector3::zeros()), None);
    }
}
