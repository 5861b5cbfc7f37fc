//! Sections: what a plane cuts of volume cells. A cell's edges are cut where linear interpolation meets the plane; the
//! points, turned around their middle, make a convex polygon. Leaves out: cells that are so bent that their section is not convex.

use pliant_geometry::{CellKind, Vector3};

use crate::renderer::staged;
use crate::subject::Subject;

/// A plane: what lies on the side of its normal is taken away.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Unit normal.
    pub normal: Vector3,
    /// Distance from the origin along the normal [m].
    pub offset: f64,
}

impl Plane {
    /// Through a point; `None` for a normal without direction.
    pub fn through(point: &Vector3, normal: &Vector3) -> Option<Self> {
        let normal = normal.try_normalize(1e-300)?;
        Some(Self { normal, offset: normal.dot(point) })
    }

    /// Distance of a point [m], positive on the side that is taken away.
    pub fn distance(&self, point: &Vector3) -> f64 {
        self.normal.dot(point) - self.offset
    }
}

/// The triangles of a section.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Section {
    /// Three corners a triangle: position [m] and value.
    pub corners: Vec<[f32; 4]>,
    /// For each triangle a bit for each edge, that opposite to the corner, which is one of the polygon.
    pub edges: Vec<u32>,
}

/// Local nodes of the edges of a cell.
const fn edges(kind: CellKind) -> &'static [[usize; 2]] {
    match kind {
        CellKind::Tet => &[[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]],
        CellKind::Hex => {
            &[[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]]
        }
        _ => &[],
    }
}

impl Section {
    /// Cuts the cells of a subject, with its points now [m] and a value at each.
    pub fn cut(&mut self, subject: &Subject, points: &[Vector3], values: &[f64], plane: &Plane) {
        self.corners.clear();
        self.edges.clear();
        let distances: Vec<f64> = points.iter().map(|point| plane.distance(point)).collect();
        let across = plane.normal.cross(&any_other(&plane.normal)).normalize();
        let axes = [across, plane.normal.cross(&across)];
        let mut polygon: Vec<(f64, Vector3, f64)> = Vec::with_capacity(12);
        for (kind, nodes) in subject.volume_cells() {
            let beyond = nodes.iter().filter(|&&node| distances[node as usize] > 0.0).count();
            if beyond == 0 || beyond == nodes.len() {
                continue;
            }
            polygon.clear();
            for &[a, b] in edges(kind) {
                let (a, b) = (nodes[a] as usize, nodes[b] as usize);
                let (da, db) = (distances[a], distances[b]);
                if (da > 0.0) != (db > 0.0) {
                    let part = da / (da - db);
                    let value = |node: usize| values.get(node).copied().unwrap_or(f64::NAN);
                    let mixed = value(a) + (value(b) - value(a)) * part;
                    polygon.push((0.0, points[a] + (points[b] - points[a]) * part, mixed));
                }
            }
            self.add(&mut polygon, &axes);
        }
    }

    fn add(&mut self, polygon: &mut [(f64, Vector3, f64)], axes: &[Vector3; 2]) {
        let middle = polygon.iter().map(|(_, point, _)| point).sum::<Vector3>() / polygon.len() as f64;
        for (angle, point, _) in polygon.iter_mut() {
            let from = *point - middle;
            *angle = axes[1].dot(&from).atan2(axes[0].dot(&from));
        }
        polygon.sort_by(|a, b| a.0.total_cmp(&b.0));
        let corner = |at: usize| {
            let (_, point, value) = &polygon[at];
            staged(point, *value)
        };
        let last = polygon.len().saturating_sub(1);
        for at in 1..last {
            self.corners.extend([corner(0), corner(at), corner(at + 1)]);
            // Bit 0: from the second to the third corner, an edge always; the others are ends of the fan.
            self.edges.push(1 | (u32::from(at + 1 == last) << 1) | (u32::from(at == 1) << 2));
        }
    }
}

/// A direction that is not along another.
fn any_other(direction: &Vector3) -> Vector3 {
    if direction.x.abs() < 0.8 { Vector3::x() } else { Vector3::y() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::subject::tests::{block, tets};

    fn area(section: &Section) -> f64 {
        let at = |&[x, y, z, _]: &[f32; 4]| Vector3::new(x.into(), y.into(), z.into());
        let triangle = |c: &[[f32; 4]]| (at(&c[1]) - at(&c[0])).cross(&(at(&c[2]) - at(&c[0]))).norm() / 2.0;
        section.corners.chunks(3).map(triangle).sum()
    }

    #[test]
    fn a_section_has_the_area_and_the_values_of_the_body_there() {
        for mesh in [block(3), tets(3)] {
            let subject = Subject::new(&mesh);
            let values: Vec<f64> = mesh.points.iter().map(|point| point.x + 2.0 * point.y).collect();
            let normal = Vector3::new(1.0, 0.3, 0.2);
            let plane = Plane::through(&Vector3::new(0.5, 0.5, 0.5), &normal).unwrap();
            let mut section = Section::default();
            section.cut(&subject, &mesh.points, &values, &plane);
            // Of the unit cube, a plane that meets only the four edges along x: 1 / n_x.
            assert!((area(&section) - 1.0 / plane.normal.x).abs() < 1e-6, "{}", area(&section));
            for [x, y, _, value] in &section.corners {
                assert!((x + 2.0 * y - value).abs() < 1e-5);
            }
            assert_eq!(section.edges.len() * 3, section.corners.len());
        }
    }

    #[test]
    fn a_plane_beside_the_body_cuts_nothing() {
        let mesh = block(2);
        let plane = Plane { normal: Vector3::x(), offset: 2.0 };
        let mut section = Section::default();
        section.cut(&Subject::new(&mesh), &mesh.points, &[], &plane);
        assert_eq!(section, Section::default());
        assert!(Plane::through(&plane.normal, &Vector3::zeros()).is_none());
    }
}
