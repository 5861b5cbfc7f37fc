//! Thickness of the body inside a closed surface: from points spread over its faces straight inwards to the
//! opposite side. A slab has its thickness, a ball and a cylinder their diameters; towards a sharp edge the
//! thickness goes to zero. Leaves out: inscribed balls, which are thinner where the two sides are not
//! parallel.

use pliant_geometry::Vector3;
use rayon::prelude::*;
use rstar::{AABB, RTree, RTreeObject, SelectionFunction};
use serde::Serialize;

use crate::report::hausdorff::Sample;
use crate::report::percentiles::Percentiles;
use crate::surface::triangles::TriangleMesh;

/// Faces are divided to edges of the diagonal of the box over this.
const ALONG: f64 = 100.0;

/// Most parts along an edge of a face.
const MOST_PARTS: f64 = 16.0;

/// Thickness over the area of a closed surface.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Thickness {
    /// Thickness [m].
    pub thickness: Percentiles,
    /// A point of the surface where it is smallest [m].
    pub thinnest: [f64; 3],
}

impl TriangleMesh {
    /// True if each edge has two triangles.
    pub fn is_closed(&self) -> bool {
        self.edges().iter().all(|&[a, b]| !self.is_border(a, b))
    }

    /// Thickness within the surface; `None` if it is open.
    pub fn thickness(&self) -> Option<Thickness> {
        if !self.is_closed() {
            return None;
        }
        let longest = self.diagonal() / ALONG;
        let faces: Vec<Face> = self.alive().map(|t| Face { number: t, corners: self.corners(t) }).collect();
        let tree = RTree::bulk_load(faces.clone());
        let through = |face: &Face| {
            let way = -self.normal(face.number);
            let other = |at: Vector3| {
                let ray = Ray { start: at, way };
                let hits = tree.locate_with_selection_function(ray).filter(|f| f.number != face.number);
                hits.filter_map(|face| ray.meets(&face.corners)).fold(f64::INFINITY, f64::min)
            };
            places(face, longest)
                .into_iter()
                .map(move |sample| (sample, other(sample.point)))
                .collect::<Vec<_>>()
        };
        let found: Vec<(Sample, f64)> = faces.par_iter().flat_map_iter(through).collect();
        let finite = found.iter().filter(|(_, length)| length.is_finite());
        let thinnest = finite.min_by(|a, b| a.1.total_cmp(&b.1))?.0.point.into();
        let thickness =
            Percentiles::weighted(found.iter().map(|(sample, length)| (*length, sample.area)).collect())?;
        Some(Thickness { thickness, thinnest })
    }
}

#[derive(Clone)]
struct Face {
    number: u32,
    corners: [Vector3; 3],
}

impl RTreeObject for Face {
    type Envelope = AABB<[f64; 3]>;

    fn envelope(&self) -> Self::Envelope {
        let [a, b, c] = self.corners;
        AABB::from_corners(a.inf(&b).inf(&c).into(), a.sup(&b).sup(&c).into())
    }
}

/// Centres of equal parts of a face with edges of at most `longest` [m].
fn places(face: &Face, longest: f64) -> Vec<Sample> {
    let [a, b, c] = face.corners;
    let edge = (b - a).norm().max((c - b).norm()).max((a - c).norm());
    let n = (edge / longest).ceil().clamp(1.0, MOST_PARTS) as usize;
    let area = 0.5 * (b - a).cross(&(c - a)).norm() / (n * n) as f64;
    let at = |i: f64, j: f64| Sample { point: a + (b - a) * (i / n as f64) + (c - a) * (j / n as f64), area };
    let mut found = Vec::with_capacity(n * n);
    for (i, j) in (0..n).flat_map(|i| (0..n - i).map(move |j| (i, j))) {
        let (x, y) = (i as f64, j as f64);
        found.push(at(x + 1.0 / 3.0, y + 1.0 / 3.0));
        if i + j + 1 < n {
            found.push(at(x + 2.0 / 3.0, y + 2.0 / 3.0));
        }
    }
    found
}

#[derive(Clone, Copy)]
struct Ray {
    start: Vector3,
    way: Vector3,
}

impl Ray {
    /// Length of the way to a triangle (Möller and Trumbore 1997); edges belong to it.
    fn meets(&self, [a, b, c]: &[Vector3; 3]) -> Option<f64> {
        const ROUND_OFF: f64 = 1e-9;
        let (ab, ac) = (b - a, c - a);
        let across = self.way.cross(&ac);
        let volume = ab.dot(&across);
        let size = ab.norm() * ac.norm();
        if volume.abs() <= 1e-12 * size {
            return None;
        }
        let from = self.start - a;
        let u = from.dot(&across) / volume;
        let other = from.cross(&ab);
        let v = self.way.dot(&other) / volume;
        let length = ac.dot(&other) / volume;
        let within = u >= -ROUND_OFF && v >= -ROUND_OFF && u + v <= 1.0 + ROUND_OFF;
        (within && length > 0.0).then_some(length)
    }
}

impl SelectionFunction<Face> for Ray {
    /// True if the ray meets a box (Kay and Kajiya 1986).
    fn should_unpack_parent(&self, envelope: &AABB<[f64; 3]>) -> bool {
        let (low, high) = (envelope.lower(), envelope.upper());
        let (mut from, mut to) = (0.0_f64, f64::INFINITY);
        for axis in 0..3 {
            let (x, slope) = (self.start[axis], self.way[axis]);
            if slope == 0.0 {
                if x < low[axis] || x > high[axis] {
                    return false;
                }
                continue;
            }
            let (near, far) = ((low[axis] - x) / slope, (high[axis] - x) / slope);
            from = from.max(near.min(far));
            to = to.min(near.max(far));
        }
        // Flat boxes of faces across the ray: round-off must not lose them.
        from <= to * (1.0 + 1e-9) + 1e-12
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Block, DEFAULT_CELL_LIMIT, Pattern, Resolution, Sheet, Tube, VolumeCell, sphere};
    use pliant_geometry::Mesh;

    fn thickness(mesh: &Mesh) -> Option<Thickness> {
        TriangleMesh::from_mesh(mesh).unwrap().0.thickness()
    }

    #[test]
    fn a_slab_is_as_thick_as_it_is() {
        let slab = Block::new([0.2, 0.1, 0.004]);
        let mesh = slab.mesh(Resolution::Counts([4, 2, 1]), VolumeCell::Tet, DEFAULT_CELL_LIMIT).unwrap();
        let found = thickness(&mesh).unwrap();
        for value in [found.thickness.least, found.thickness.p5, found.thickness.median] {
            assert!((value - 0.004).abs() < 1e-12, "{found:?}");
        }
        // The rays hit the opposite narrow sides.
        assert!((found.thickness.most - 0.2).abs() < 1e-12, "{found:?}");
    }

    /// Through the middle of a facet of a ball to about the other side.
    #[test]
    fn a_ball_is_as_thick_as_its_diameter() {
        let found = thickness(&sphere(0.05, 4, DEFAULT_CELL_LIMIT).unwrap()).unwrap();
        assert!(found.thickness.least > 0.0997 && found.thickness.most < 0.1, "{found:?}");
    }

    /// A pipe has its wall, nearly everywhere: from the ends rays run along it.
    #[test]
    fn a_pipe_is_as_thick_as_its_wall() {
        let pipe = Tube { inner_radius: 0.008, outer_radius: 0.010, length: 0.1 };
        let mesh = pipe.mesh(0.001, VolumeCell::Hex, DEFAULT_CELL_LIMIT).unwrap();
        let found = thickness(&mesh).unwrap();
        assert!((found.thickness.median / 0.002 - 1.0).abs() < 0.02, "{found:?}");
        let [x, y, _] = found.thinnest;
        assert!(found.thickness.least > 0.00195 && x.hypot(y) > 0.0079, "{found:?}");
    }

    #[test]
    fn an_open_surface_has_no_thickness() {
        let plate = Sheet::Plate { size: [0.1, 0.1] };
        assert_eq!(thickness(&plate.mesh([2, 2], Pattern::Diagonal, None, 100).unwrap()), None);
    }
}
