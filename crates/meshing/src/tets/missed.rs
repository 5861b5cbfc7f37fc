//! Features of a body that its mesh misses. These are parts and gaps thinner than the lattice, with their
//! location and thickness, and other surface points far from the mesh. A straight line through a part leads
//! from one point of the surface to the opposite wall. The part is thin if this line is shorter than the
//! lattice constant. It is missed if the middle of the line is not in the mesh. Gaps are treated in the same
//! way in the background.

use std::fmt;

use pliant_geometry::{CellKind, Locator, Mesh, SurfaceLocator, Vector3, boundary};
use rayon::prelude::*;
use serde::Serialize;

use crate::error::MeshingError;
use crate::input::field::ImplicitField;
use crate::report::deviation::{Deviation, surface_points};
use crate::tets::voxels::Voxels;

/// Steps along the way through a thin part, per lattice constant.
const STEPS: usize = 20;

/// Walls face each other if the cosine between their normals is below this: within 45°. Rims and notches do
/// not count.
const OPPOSITE: f64 = -0.7;

/// Distance of the middle of a thin part from the mesh, in lattice constants, above which the part is missed.
/// If nearer, the mesh only cuts a crest.
const MARGIN: f64 = 0.25;

/// A feature of a body that its mesh misses or misplaces. Locations in metres, RAS if the body comes from an
/// image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Missed {
    /// A part of the body thinner than the lattice that the mesh leaves out.
    ThinPart {
        /// Its middle [m].
        place: [f64; 3],
        /// Thickness of the part there [m].
        thickness: f64,
        /// Lattice constant [m].
        edge: f64,
    },
    /// A gap of the body thinner than the lattice that the mesh closes: its banks are glued together.
    ThinGap {
        /// Its middle [m].
        place: [f64; 3],
        /// Width of the gap there [m].
        thickness: f64,
        /// Lattice constant [m].
        edge: f64,
    },
    /// The boundary of the mesh lies far from the surface.
    Beyond {
        /// The point of the mesh's boundary that is farthest from the surface [m].
        place: [f64; 3],
        /// Distance from the surface [m].
        distance: f64,
    },
    /// A label without a cell.
    Label {
        /// The label.
        label: i32,
    },
    /// A label whose volume differs from the input.
    LabelVolume {
        /// The label.
        label: i32,
        /// Relative error of the volume.
        part: f64,
    },
    /// A label whose surface is far from its surface in the input.
    LabelAway {
        /// The label.
        label: i32,
        /// The point that is farthest from the other surface [m].
        place: [f64; 3],
        /// Distance [m].
        distance: f64,
    },
    /// A part of the surface far from the mesh that is not thin: a crest, or a small piece that was left out.
    Behind {
        /// The point of the surface that is farthest from the mesh [m].
        place: [f64; 3],
        /// Distance from the mesh [m].
        distance: f64,
    },
}

impl Missed {
    /// Distance [m] of the surface of a body from a mesh with cells of `edge` [m] above which it is reported.
    /// For tets it is half an edge. Steps of cubes stay behind the body by up to half of their diagonal.
    /// Immersed cubes contain the whole body.
    pub(crate) fn allowed(mesh: &Mesh, edge: f64) -> f64 {
        match mesh.block(CellKind::Hex) {
            None => edge / 2.0,
            Some(cubes) if cubes.data.contains_key(Voxels::FRACTION) => f64::INFINITY,
            Some(_) => edge,
        }
    }

    /// Features of the body of a field that a mesh with cells of `edge` [m] misses. These are the worst thin
    /// part and the worst thin gap. The farthest point of the surface follows if it is farther than `allowed`
    /// [m] and no thin part explains it. If nothing else is found, the farthest point of the mesh boundary
    /// counts, beyond `allowed`.
    ///
    /// # Errors
    /// If the box of the field is empty or not finite.
    pub(crate) fn of(
        mesh: &Mesh,
        field: &(impl ImplicitField + ?Sized),
        edge: f64,
        deviation: &Deviation,
        allowed: f64,
    ) -> Result<Vec<Self>, MeshingError> {
        let ways = thin_ways(field, edge)?;
        let mut missed = Vec::new();
        if !ways.is_empty() {
            let locator = Locator::new(mesh);
            let surface = boundary(mesh);
            let faces: Vec<u32> = (0..surface.faces.len() as u32).collect();
            let rim = SurfaceLocator::new(&surface, &faces, &mesh.points);
            // Distance by which the mesh misses the middle of a way.
            let by = |way: &ThinWay| {
                let covered = locator.locate(way.middle).is_some_and(|found| found.distance == 0.0);
                let far =
                    rim.closest(&way.middle).map_or(f64::INFINITY, |at| (at.position - way.middle).norm());
                if covered == way.inside { 0.0 } else { far }
            };
            let by: Vec<f64> = ways.par_iter().map(by).collect();
            for inside in [true, false] {
                let mut worst: Option<(f64, &ThinWay)> = None;
                for (&by, way) in
                    by.iter().zip(&ways).filter(|(by, way)| way.inside == inside && **by > MARGIN * edge)
                {
                    if worst.is_none_or(|(most, _)| by > most) {
                        worst = Some((by, way));
                    }
                }
                missed.extend(worst.map(|(_, way)| way.missed(edge)));
            }
        }
        let thin = missed.iter().any(|missed| matches!(missed, Self::ThinPart { .. }));
        if !thin && deviation.largest_from_body > allowed {
            missed.push(Self::Behind { place: deviation.farthest, distance: deviation.largest_from_body });
        } else if missed.is_empty() && deviation.largest_from_mesh > allowed {
            let (place, distance) = (deviation.farthest_of_mesh, deviation.largest_from_mesh);
            missed.push(Self::Beyond { place, distance });
        }
        Ok(missed)
    }
}

impl fmt::Display for Missed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let at = |[x, y, z]: &[f64; 3]| format!("({x:.4}, {y:.4}, {z:.4}) m");
        match self {
            Self::ThinPart { place, thickness, edge } => write!(
                f,
                "the mesh misses a part of the body {:.1} mm thick at {}, thinner than the cells of {:.1} mm: a smaller edge keeps it",
                thickness * 1e3,
                at(place),
                edge * 1e3
            ),
            Self::ThinGap { place, thickness, edge } => write!(
                f,
                "the mesh closes a gap {:.1} mm wide at {}, thinner than the cells of {:.1} mm, and connects \
                 its sides: a smaller edge keeps them apart",
                thickness * 1e3,
                at(place),
                edge * 1e3
            ),
            Self::Behind { place, distance } => write!(
                f,
                "the mesh boundary is {:.1} mm inside the body at {}: a sharp crest, or a dropped small \
                 piece",
                distance * 1e3,
                at(place)
            ),
            Self::Beyond { place, distance } => write!(
                f,
                "the mesh boundary is {:.1} mm from the surface of the body at {}",
                distance * 1e3,
                at(place)
            ),
            Self::Label { label } => write!(f, "label {label} has no cell: it is smaller than a cell"),
            Self::LabelVolume { label, part } => write!(
                f,
                "label {label} has {:.1} % {} volume than the input",
                100.0 * part.abs(),
                if *part < 0.0 { "less" } else { "more" }
            ),
            Self::LabelAway { label, place, distance } => {
                write!(
                    f,
                    "the surface of label {label} is {:.1} mm from the input at {}",
                    distance * 1e3,
                    at(place)
                )
            }
        }
    }
}

/// A way straight through a thin part or a thin gap.
struct ThinWay {
    middle: Vector3,
    length: f64,
    /// True through the body, false through the background.
    inside: bool,
}

impl ThinWay {
    fn missed(&self, edge: f64) -> Missed {
        let (place, thickness) = (self.middle.into(), self.length);
        match self.inside {
            true => Missed::ThinPart { place, thickness, edge },
            false => Missed::ThinGap { place, thickness, edge },
        }
    }
}

/// Lines shorter than the lattice constant between facing walls, in the order of the surface points.
fn thin_ways(field: &(impl ImplicitField + ?Sized), edge: f64) -> Result<Vec<ThinWay>, MeshingError> {
    let points = surface_points(field, edge)?;
    let ways = points
        .par_iter()
        .flat_map_iter(|point| [true, false].map(|inside| thin_way(field, point, edge, inside)));
    Ok(ways.collect::<Vec<_>>().into_iter().flatten().collect())
}

/// From a point of the surface against its normal, or along it, to the next wall.
fn thin_way(
    field: &(impl ImplicitField + ?Sized),
    start: &Vector3,
    edge: f64,
    inside: bool,
) -> Option<ThinWay> {
    // Larger values are towards the inside.
    let uphill = |point: &Vector3| field.gradient(point).try_normalize(0.0);
    let sign = if inside { 1.0 } else { -1.0 };
    let inward = uphill(start)?;
    let at = |length: f64| start + inward * (sign * length);
    let beyond = |length: f64| sign * field.value(&at(length)) <= 0.0;
    let step = edge / STEPS as f64;
    // The start lies on the surface up to the error of a linear interpolation, so one step is skipped.
    let wall = (2..STEPS).map(|steps| steps as f64 * step).find(|&length| beyond(length))?;
    let (mut low, mut high) = (wall - step, wall);
    for _ in 0..10 {
        let middle = 0.5 * (low + high);
        if beyond(middle) { high = middle } else { low = middle }
    }
    let facing = uphill(&at(high))?.dot(&inward) < OPPOSITE;
    facing.then(|| ThinWay { middle: at(high / 2.0), length: high, inside })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Anatomy, OrganTets, Stuffing};

    /// Two slabs: 30 mm of body with a plate `thickness` thick on it, sticking out to x = 60 mm; a gap of
    /// `gap` between two blocks.
    struct Plates {
        plate: f64,
        gap: f64,
    }

    impl ImplicitField for Plates {
        fn value(&self, p: &Vector3) -> f64 {
            let slab = |centre: [f64; 3], half: [f64; 3]| {
                let q = (p - Vector3::from(centre)).abs() - Vector3::from(half);
                -(q.sup(&Vector3::zeros()).norm() + q.max().min(0.0))
            };
            let block = slab([0.0, 0.0, 0.0], [0.03, 0.03, 0.03]);
            let plate = slab([0.05, 0.0, 0.0], [0.03, 0.03, self.plate / 2.0]);
            let cut = slab([-0.02, 0.0, 0.001], [0.03, 0.05, self.gap / 2.0]);
            block.max(plate).min(-cut)
        }

        fn bounds(&self) -> (Vector3, Vector3) {
            (Vector3::new(-0.032, -0.032, -0.032), Vector3::new(0.082, 0.032, 0.032))
        }
    }

    fn missed(mesh: &Mesh, field: &Plates, edge: f64) -> Vec<Missed> {
        let deviation = Deviation::new(mesh, field, edge).unwrap();
        Missed::of(mesh, field, edge, &deviation, edge).unwrap()
    }

    #[test]
    fn a_lost_plate_and_a_closed_gap_are_told_with_place_and_thickness() {
        let body = Plates { plate: 0.002, gap: 0.002 };
        // Centres of cubes at ± 4, 12, ... mm from the middle: none in the plate or the gap.
        let cubes = Voxels::new(0.008).mesh(&body).unwrap().mesh;
        let reported = missed(&cubes, &body, 0.008);
        let near = |found: f64| (found - 0.002).abs() < 2e-4;
        let [Missed::ThinPart { place, thickness, .. }, Missed::ThinGap { place: gap, thickness: width, .. }] =
            reported[..]
        else {
            panic!("{reported:?}")
        };
        assert!(near(thickness) && place[0] > 0.03 && place[2].abs() < 2e-4, "{reported:?}");
        assert!(near(width) && gap[0] < 0.01 && (gap[2] - 0.001).abs() < 2e-4, "{reported:?}");
        assert!(reported[0].to_string().contains("2.0 mm thick at (0.0"), "{}", reported[0]);
    }

    #[test]
    fn tets_tell_a_lost_plate_and_keep_the_gap_open() {
        let body = Plates { plate: 0.002, gap: 0.004 };
        let request = OrganTets { origin: Some(Vector3::new(0.0, 0.0, 0.0025)), ..OrganTets::new(0.01) };
        let mesh = request.mesh(&Anatomy::new(1, &body), &|_| {}).unwrap().mesh;
        let reported = missed(&mesh, &body, 0.01);
        assert!(matches!(reported[..], [Missed::ThinPart { .. }]), "{reported:?}");
    }

    #[test]
    fn what_is_thicker_than_the_lattice_is_no_news() {
        let body = Plates { plate: 0.02, gap: 0.012 };
        let mesh = Stuffing::new(0.008).mesh(&body).unwrap().mesh;
        assert_eq!(missed(&mesh, &body, 0.008), []);
    }
}
