//! Surfaces of segmented bodies that keep their volume. Facets between points of a curved surface cut it off,
//! and smoothing takes thin parts away: a ball of few triangles has lost a fifth. All points move along their
//! normals until the surface encloses the volume of the input, less the parts that it lacks altogether. The
//! remaining error is reported.

use pliant_geometry::Vector3;
use serde::Serialize;

use crate::input::anatomy::Anatomy;
use crate::report::regions::LARGEST_VOLUME_ERROR;
use crate::surface::crossings::crossings;
use crate::surface::nesting::signed_volume;
use crate::surface::triangles::TriangleMesh;
use crate::tets::lost::{LostPart, Samples};
use crate::tets::organ::LostReport;

/// Most corrections, and their relative tolerance of the volume.
const STEPS: usize = 6;
const ENOUGH: f64 = 1e-4;

/// Largest total move of the points, in mean edges.
const MOST: f64 = 0.25;

/// One label of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LabelVolume {
    /// The label.
    pub label: i32,
    /// Its volume within the surface [m³].
    pub volume: f64,
    /// Volume of its voxels after cleaning [m³].
    pub input_volume: f64,
}

/// Volumes of a surface against its input.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SurfaceVolume {
    /// The labels. With several, each has its own voxels within the surface, and the background there that is
    /// next to it.
    pub labels: Vec<LabelVolume>,
    /// Parts of the labels that the surface lacks, the largest first.
    pub lost: Vec<LostReport>,
    /// Distance that points moved outwards to keep the volume [m].
    pub moved: f64,
}

impl LabelVolume {
    /// Relative error.
    pub fn error(&self) -> f64 {
        self.volume / self.input_volume - 1.0
    }
}

impl SurfaceVolume {
    /// Lines of a report.
    pub fn lines(&self) -> Vec<String> {
        let of_label = |entry: &LabelVolume| {
            format!(
                "label {:<10} {:.3} ml ({:+.2} % of the input)",
                entry.label,
                entry.volume * 1e6,
                entry.error() * 100.0
            )
        };
        let lost = LostReport::in_words(&self.lost).map(|lost| format!("lost             {lost}"));
        self.labels.iter().map(of_label).chain(lost).collect()
    }

    /// Deviations from the input that matter.
    pub fn warnings(&self) -> Vec<String> {
        let off = self.labels.iter().filter(|entry| entry.error().abs() > LARGEST_VOLUME_ERROR);
        let off = off.map(|entry| {
            format!(
                "the surface encloses {:.1} % {} of label {} than the input ({:.3} ml instead of {:.3} ml); \
                 use smaller triangles",
                100.0 * entry.error().abs(),
                if entry.error() < 0.0 { "less" } else { "more" },
                entry.label,
                entry.volume * 1e6,
                entry.input_volume * 1e6
            )
        });
        off.chain(self.lost_parts().filter(|_| self.lacks_much())).collect()
    }

    /// The parts that the surface lacks, where they are too small for a [warning](Self::warnings).
    pub fn note(&self) -> Option<String> {
        self.lost_parts().filter(|_| !self.lacks_much())
    }

    fn lost_parts(&self) -> Option<String> {
        LostReport::in_words(&self.lost).map(|lost| format!("the surface lacks parts of the labels: {lost}"))
    }

    fn lacks_much(&self) -> bool {
        let input: f64 = self.labels.iter().map(|entry| entry.input_volume).sum();
        let lost: f64 = self.lost.iter().map(|part| part.volume).sum();
        lost > LARGEST_VOLUME_ERROR * input
    }
}

impl TriangleMesh {
    /// Moves the surface of the voxels of an anatomy along its normals until it has their volume; `None` if
    /// the anatomy has no voxels.
    pub fn keep_volume(&mut self, anatomy: &Anatomy<'_>) -> Option<SurfaceVolume> {
        let faces = self.len();
        let area: f64 = self.alive().map(|t| self.area(t)).sum();
        // The edge of an equilateral triangle of the mean area.
        let edge = (4.0 / 3.0_f64.sqrt() * area / faces as f64).sqrt();
        let samples = Samples::of(anatomy, edge)?;
        let far = (edge / 2.0).max(anatomy.resolution());
        let covered = |surface: &Self| {
            let (points, triangles) = surface.compact();
            samples.within_surface(&points, &triangles)
        };
        let lost = samples.lost(&covered(self), far);
        let input: Vec<f64> = samples.volumes(|_| true);
        let wanted = input.iter().sum::<f64>() - lost.iter().map(LostPart::volume).sum::<f64>();
        let moved = self.inflate(wanted, MOST * edge);
        let inside = covered(self);
        let volumes = match input.len() {
            1 => vec![self.volume()],
            _ => samples.volumes_with_neighbours(&inside),
        };
        let labels = anatomy.labels();
        let labels = labels
            .iter()
            .zip(volumes)
            .zip(&input)
            .map(|((&label, volume), &input_volume)| LabelVolume { label, volume, input_volume });
        Some(SurfaceVolume {
            labels: labels.collect(),
            lost: LostReport::of(samples.lost(&inside, far), &anatomy.labels(), input.iter().sum()),
            moved,
        })
    }

    /// Volume within it [m³]; meaningless for an open surface.
    pub(crate) fn volume(&self) -> f64 {
        let (points, triangles) = self.compact();
        signed_volume(&points, &triangles)
    }

    /// Describes how much its volume differs from the volume of the input surface, if by more than 5 %;
    /// `None` for open surfaces.
    pub fn volume_warning(&self, input: &Self) -> Option<String> {
        let error = self.volume() / input.volume() - 1.0;
        (input.is_closed() && self.is_closed() && error.abs() > LARGEST_VOLUME_ERROR).then(|| {
            format!(
                "the surface encloses {:.1} % {} than the input ({:.3} ml instead of {:.3} ml); use smaller \
                 triangles",
                100.0 * error.abs(),
                if error < 0.0 { "less" } else { "more" },
                self.volume() * 1e6,
                input.volume() * 1e6
            )
        })
    }

    /// Moves all points along their normals until the surface encloses a volume [m³], by at most `most` [m];
    /// returns how far. A move that makes triangles cross is halved.
    fn inflate(&mut self, wanted: f64, most: f64) -> f64 {
        let crossing = |surface: &Self| {
            let (points, triangles) = surface.compact();
            crossings(&points, &triangles).0.len()
        };
        let before = crossing(self);
        let mut moved = 0.0_f64;
        for _ in 0..STEPS {
            let area: f64 = self.alive().map(|t| self.area(t)).sum();
            let lacks = wanted - self.volume();
            if lacks.abs() < ENOUGH * wanted {
                break;
            }
            let mut by = (moved + lacks / area).clamp(-most, most) - moved;
            let normals: Vec<Vector3> =
                (0..self.points.len() as u32).map(|point| self.point_normal(point)).collect();
            let old = self.points.clone();
            loop {
                for (point, (from, normal)) in self.points.iter_mut().zip(old.iter().zip(&normals)) {
                    *point = from + normal * by;
                }
                if by.abs() < 1e-3 * most || crossing(self) <= before {
                    break;
                }
                by /= 2.0;
            }
            moved += by;
            if by.abs() < 1e-3 * most {
                break;
            }
        }
        moved
    }
}
