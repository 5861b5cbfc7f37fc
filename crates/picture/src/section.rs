//! Sections of volume cells by a plane. Linear interpolation gives the intersections of the plane and the
//! cell edges; sorted around their middle, these points form a convex polygon. A shell is cut along a line.
//! Leaves out: cells so distorted that their section is not convex.

use std::collections::BTreeSet;

use bytemuck::{Pod, Zeroable};
use pliant_geometry::Vector3;

use crate::lines::{Line, edges};
use crate::plane::Plane;
use crate::regions::Regions;
use crate::subject::{KIND, Subject};
use crate::vertex::staged;

/// A corner of a triangle of a section.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct Corner {
    /// Position [m] and value.
    pub point: [f32; 4],
    /// Position at rest [m].
    pub rest: [f32; 3],
    /// A bit for each edge of the triangle, numbered by the opposite corner and set if it is an edge of the
    /// polygon. The other bits hold the marks and the kind of the cell.
    pub edges: u32,
}

/// The triangles of a section, the fibres in it, and where it cuts shells.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Section {
    /// Three a triangle.
    pub(crate) corners: Vec<Corner>,
    pub(crate) fibres: Vec<Line>,
    /// Lines along which the plane cuts shells.
    pub(crate) shells: Vec<Line>,
}

/// Intersection of a plane with an edge of a cell.
struct Cut {
    angle: f64,
    point: Vector3,
    rest: Vector3,
    value: f64,
}

impl Section {
    /// Cuts the cells of a subject, with its points now [m] and a value at each.
    pub fn cut(&mut self, subject: &Subject, points: &[Vector3], values: &[f64], plane: &Plane) {
        self.corners.clear();
        self.fibres.clear();
        let distances: Vec<f64> = points.iter().map(|point| plane.distance(point)).collect();
        self.shells.clear();
        self.shells.extend(subject.shell_triangles().filter_map(|corners| {
            let crossed = [[0, 1], [1, 2], [2, 0]].map(|ends: [usize; 2]| ends.map(|at| corners[at]));
            let mut cuts = crossed.into_iter().filter_map(|nodes| {
                let [a, b] = nodes.map(|node| distances[node as usize]);
                ((a > 0.0) != (b > 0.0)).then(|| (nodes, a / (a - b)))
            });
            Some(Line::across([cuts.next()?, cuts.next()?]))
        }));
        let across = plane.normal.cross(&any_other(&plane.normal)).normalize();
        let axes = [across, plane.normal.cross(&across)];
        let rest = &subject.points;
        let mut polygon: Vec<Cut> = Vec::with_capacity(12);
        let mut taken = BTreeSet::new();
        for (number, (kind, nodes)) in subject.volume_cells().enumerate() {
            let beyond = nodes.iter().filter(|&&node| distances[node as usize] > 0.0).count();
            if beyond == 0 || beyond == nodes.len() {
                continue;
            }
            polygon.clear();
            let mut parts = [0.0; 8];
            for &[local_a, local_b] in edges(kind) {
                let (a, b) = (nodes[local_a] as usize, nodes[local_b] as usize);
                let (da, db) = (distances[a], distances[b]);
                if (da > 0.0) != (db > 0.0) {
                    let part = da / (da - db);
                    parts[local_a] += 1.0 - part;
                    parts[local_b] += part;
                    let value = |node: usize| values.get(node).copied().unwrap_or(f64::NAN);
                    polygon.push(Cut {
                        angle: 0.0,
                        point: points[a] + (points[b] - points[a]) * part,
                        rest: rest[a] + (rest[b] - rest[a]) * part,
                        value: value(a) + (value(b) - value(a)) * part,
                    });
                }
            }
            self.add(&mut polygon, &axes, subject.word(number));
            if subject.has_fibres() {
                parts.iter_mut().for_each(|part| *part /= polygon.len() as f64);
                let middle: Vector3 =
                    nodes.iter().zip(parts).map(|(&node, part)| rest[node as usize] * part).sum();
                if taken.insert(subject.fibres.cube_of(&middle)) {
                    self.fibres.extend(subject.fibres.line(number, kind, nodes, rest, &parts));
                }
            }
        }
    }

    /// The number of the kind of the cell at each corner.
    pub(crate) fn kinds(&self) -> impl Iterator<Item = u32> {
        self.corners.iter().map(|corner| corner.edges >> KIND)
    }

    /// Values in the section, of cells that show theirs.
    pub fn values(&self, subject: &Subject, regions: &Regions) -> impl Iterator<Item = f64> {
        let shows = subject.showing(regions);
        let seen = self.corners.iter().filter(move |corner| shows[(corner.edges >> KIND) as usize]);
        // Missing values are drawn as a large one.
        seen.map(|corner| f64::from(corner.point[3])).filter(|value| *value < 1e30)
    }

    /// Places [m] in the section with their values, of cells that show theirs.
    pub(crate) fn places(
        &self,
        subject: &Subject,
        regions: &Regions,
    ) -> impl Iterator<Item = (Vector3, f64)> {
        let shows = subject.showing(regions);
        let seen = self.corners.iter().filter(move |corner| shows[(corner.edges >> KIND) as usize]);
        let place = |corner: &Corner| Vector3::from([0, 1, 2].map(|axis| f64::from(corner.point[axis])));
        seen.map(move |corner| (place(corner), f64::from(corner.point[3]))).filter(|(_, value)| *value < 1e30)
    }

    fn add(&mut self, polygon: &mut [Cut], axes: &[Vector3; 2], word: u32) {
        let middle = polygon.iter().map(|cut| cut.point).sum::<Vector3>() / polygon.len() as f64;
        for cut in polygon.iter_mut() {
            let from = cut.point - middle;
            cut.angle = axes[1].dot(&from).atan2(axes[0].dot(&from));
        }
        polygon.sort_by(|a, b| a.angle.total_cmp(&b.angle));
        let last = polygon.len().saturating_sub(1);
        for at in 1..last {
            // Bit 0: from the second to the third corner, an edge always; the others are ends of the fan.
            let edges = word | 1 | (u32::from(at + 1 == last) << 1) | (u32::from(at == 1) << 2);
            let corner = |at: usize| {
                let Cut { point, rest, value, .. } = &polygon[at];
                Corner {
                    point: staged(point, *value),
                    rest: [rest.x, rest.y, rest.z].map(|x| x as f32),
                    edges,
                }
            };
            self.corners.extend([corner(0), corner(at), corner(at + 1)]);
        }
    }
}

/// A direction that is not along another.
fn any_other(direction: &Vector3) -> Vector3 {
    if direction.x.abs() < 0.8 { Vector3::x() } else { Vector3::y() }
}

#[cfg(test)]
mod tests {
    use pliant_geometry::{CellBlock, CellKind, Mesh};

    use super::*;
    use crate::subject::tests::{block, tets};

    fn area(section: &Section) -> f64 {
        let at = |c: &Corner| Vector3::from([0, 1, 2].map(|axis| f64::from(c.point[axis])));
        let triangle = |c: &[Corner]| (at(&c[1]) - at(&c[0])).cross(&(at(&c[2]) - at(&c[0]))).norm() / 2.0;
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
            for Corner { point: [x, y, _, value], rest, .. } in &section.corners {
                assert_eq!([*x, *y], rest[..2], "at rest");
                assert!((x + 2.0 * y - value).abs() < 1e-5);
            }
        }
    }

    /// A sheet over the unit square is cut along a line of length 1 / n_y, as straight as the plane.
    #[test]
    fn a_shell_is_cut_along_a_line() {
        let mut mesh = Mesh::default();
        let place = |index: u32| Vector3::new(f64::from(index % 4), f64::from(index / 4), 0.0) / 3.0;
        mesh.points = (0..16).map(place).collect();
        let squares = (0..9).map(|cell| cell / 3 * 4 + cell % 3);
        let nodes = squares.flat_map(|low| [low, low + 1, low + 5, low, low + 5, low + 4]).collect();
        mesh.blocks.push(CellBlock::new(CellKind::Triangle, nodes));
        let subject = Subject::new(&mesh);
        let plane = Plane::through(&Vector3::new(0.41, 0.5, 0.0), &Vector3::new(1.0, 0.3, 0.0)).unwrap();
        let mut section = Section::default();
        section.cut(&subject, &mesh.points, &[], &plane);
        let ends: Vec<[Vector3; 2]> = section.shells.iter().map(|line| line.at(&mesh.points)).collect();
        assert!(ends.iter().flatten().all(|end| plane.distance(end).abs() < 1e-6));
        let length: f64 = ends.iter().map(|[a, b]| (a - b).norm()).sum();
        assert!((length - 1.0 / plane.normal.x).abs() < 1e-6, "{length}");
        assert!(section.corners.is_empty());
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
