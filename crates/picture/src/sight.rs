//! Visibility from a camera: places that nothing opaque hides.

use std::collections::BTreeSet;

use pliant_geometry::Vector3;

use crate::camera::{Camera, Projection};
use crate::plane::Plane;
use crate::regions::{Paint, Regions};
use crate::section::Section;
use crate::subject::{KIND, Subject};

/// Distance from a place, over the size of the drawn body, below which nothing hides the place. The faces
/// around it lie there.
const NEAR: f64 = 1e-5;
/// Largest number of tested triangles of a label, spread evenly over all.
const MOST: usize = 200;

/// Things that hide places from a camera.
pub struct Sight<'s> {
    subject: &'s Subject,
    points: &'s [Vector3],
    section: Vec<[Vector3; 3]>,
    section_kinds: Vec<u32>,
    /// True for each kind of cells that hides the things behind it.
    opaque: Vec<bool>,
    clip: Option<Plane>,
    camera: Camera,
    near: f64,
}

impl<'s> Sight<'s> {
    /// Prepares the visibility of a subject with its points at some places [m], cut by a plane with this
    /// section.
    pub fn new(
        subject: &'s Subject,
        points: &'s [Vector3],
        regions: &Regions,
        clip: Option<Plane>,
        section: &Section,
        camera: &Camera,
    ) -> Self {
        let place = |corner: &crate::section::Corner| {
            Vector3::from([0, 1, 2].map(|axis| f64::from(corner.point[axis])))
        };
        let parts = section.corners.chunks_exact(3);
        Self {
            subject,
            points,
            section: parts.clone().map(|corners| [0, 1, 2].map(|at| place(&corners[at]))).collect(),
            section_kinds: parts.map(|corners| corners[0].edges >> KIND).collect(),
            opaque: subject.kinds.iter().map(|kind| regions.coat(*kind).opacity >= 1.0).collect(),
            clip,
            camera: *camera,
            near: NEAR * subject.extent(),
        }
    }

    fn is_left(&self, place: &Vector3) -> bool {
        self.clip.is_none_or(|plane| plane.distance(place) <= self.near)
    }

    /// True if nothing opaque lies between the eye and a place [m].
    pub fn sees(&self, place: &Vector3) -> bool {
        let eye = self.camera.eye();
        let (along, far) = match self.camera.projection {
            Projection::Orthographic => (self.camera.axes()[2], f64::INFINITY),
            Projection::Perspective => ((eye - place).normalize(), (eye - place).norm()),
        };
        let hides = |corners: &[Vector3; 3]| {
            hit(corners, place, &along).filter(|(way, _)| (self.near..far).contains(way))
        };
        let surface = self.subject.triangles().enumerate().any(|(number, nodes)| {
            self.opaque[(self.subject.triangles[number][3] >> KIND) as usize]
                && hides(&nodes.map(|node| self.points[node as usize])).is_some_and(|(way, front)| {
                    self.subject.is_drawn(number, front) && self.is_left(&(place + along * way))
                })
        });
        let cut = || {
            let mut parts = self.section.iter().zip(&self.section_kinds);
            parts.any(|(corners, kind)| self.opaque[*kind as usize] && hides(corners).is_some())
        };
        !surface && !cut()
    }

    /// Returns the given labels that have their own colours and are nowhere visible.
    pub fn hidden_labels(&self, regions: &Regions, labels: impl Iterator<Item = i32>) -> BTreeSet<i32> {
        let of_label = |number: u32, label: i32| {
            let kind = self.subject.kinds[number as usize];
            let coat = regions.coat(kind);
            kind.label == Some(label)
                && !kind.thing
                && coat.opacity > 0.0
                && !matches!(coat.paint, Paint::Plain(_))
        };
        // Borders within bodies are drawn where one sees through these.
        let through = self.subject.kinds.iter().any(|kind| regions.coat(*kind).opacity < 1.0);
        let is_hidden = |label: &i32| {
            let inner = self.subject.beyond.iter().copied().chain(
                self.subject.triangles[self.subject.outer..].iter().map(|triangle| triangle[3] >> KIND),
            );
            if through && inner.into_iter().any(|number| of_label(number, *label)) {
                return false;
            }
            let surface = self.subject.triangles().zip(&self.subject.triangles);
            let surface = surface.filter(|(_, triangle)| of_label(triangle[3] >> KIND, *label));
            let surface = surface.map(|(nodes, _)| nodes.map(|node| self.points[node as usize]));
            let cut = self.section.iter().zip(&self.section_kinds);
            let cut = cut.filter(|(_, kind)| of_label(**kind, *label)).map(|(corners, _)| *corners);
            let triangles: Vec<[Vector3; 3]> = surface.chain(cut).collect();
            let every = triangles.len().div_ceil(MOST).max(1);
            !triangles.iter().step_by(every).any(|corners| {
                let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
                let places = corners.iter().map(|corner| corner * 0.9 + middle * 0.1);
                places.chain([middle]).any(|place| self.is_left(&place) && self.sees(&place))
            })
        };
        labels.filter(is_hidden).collect()
    }
}

/// Returns the distance of a triangle from a place along a unit direction, which points to the eye. The
/// second value is true if the front of the triangle is seen from there. `None` if the ray misses the
/// triangle (Möller and Trumbore 1997).
fn hit([a, b, c]: &[Vector3; 3], from: &Vector3, along: &Vector3) -> Option<(f64, bool)> {
    let (ab, ac) = (b - a, c - a);
    let across = along.cross(&ac);
    let volume = ab.dot(&across);
    if volume == 0.0 {
        return None;
    }
    let off = from - a;
    let u = off.dot(&across) / volume;
    let turned = off.cross(&ab);
    let v = along.dot(&turned) / volume;
    let way = ac.dot(&turned) / volume;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && way > 0.0).then_some((way, ab.cross(&ac).dot(along) > 0.0))
}
