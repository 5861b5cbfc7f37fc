//! Places where a mesh tears thin parts of a body. Where a part is little thicker than the cells, all points
//! of some cells lie on its sides, and the cells are dropped. The boundary of the mesh then has bands of
//! faces that cut through the body, deep inside. A band round a hole looks inwards, towards the hole; the rim
//! of a crest that falls short looks outwards. A hole may end in an edge on the other side of the part, which
//! comes apart when its points are doubled. Two bands that look at each other through the body are the ends
//! of a broken neck.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Matrix3;
use pliant_geometry::Vector3;

use crate::input::field::ImplicitField;
use crate::report::soundness::euler_number;
use crate::surface::crossings::widened;
use crate::surface::edges::key;
use crate::tets::complex::Complex;
use crate::tets::manifold::crowded_edges;

/// A face of the boundary cuts through the body if its centre is this deep inside, in lattice constants.
const DEEP: f64 = 0.12;

/// The ends of a broken neck are at most this far from each other, in lattice constants.
const NECK: f64 = 5.0;

/// Samples on the way from one end of a neck to the other.
const SAMPLES: u32 = 20;

/// A hole in a thin part, or a broken neck.
#[derive(Clone, Debug)]
pub(crate) struct Tear {
    /// Centres of the faces round it [m], and points of the body between them.
    pub(crate) places: Vec<Vector3>,
    /// Thickness of the part there [m].
    pub(crate) thickness: f64,
}

/// Faces that cut through the body.
struct Band {
    /// Centres of the faces [m], and their mean.
    centres: Vec<Vector3>,
    middle: Vector3,
    /// Sum of their outward normals by area [m²].
    towards: Vector3,
    /// True if it looks into a hole that it goes round, or into a void that touches a side of the part in an
    /// edge.
    is_round: bool,
    thickness: f64,
    /// Lattice constant [m].
    size: f64,
}

/// The tears of the boundary of a mesh, by their first faces.
pub(crate) fn tears(complex: &Complex, field: &dyn ImplicitField) -> Vec<Tear> {
    let crowded: BTreeSet<[u32; 2]> = crowded_edges(complex).into_iter().collect();
    let bands = cuts(complex, field);
    let bands: Vec<Band> = bands.iter().map(|faces| Band::of(faces, complex, &crowded, field)).collect();
    let (round, ends): (Vec<&Band>, Vec<&Band>) = bands.iter().partition(|band| band.is_round);
    let holes =
        round.into_iter().map(|band| Tear { places: band.centres.clone(), thickness: band.thickness });
    let mut tears: Vec<Tear> = holes.collect();
    for (at, end) in ends.iter().enumerate() {
        tears.extend(ends[at + 1..].iter().filter_map(|other| end.neck_to(other, complex, field)));
    }
    tears
}

/// Faces of the boundary that cut through the body, in groups that are connected by edges.
fn cuts(complex: &Complex, field: &dyn ImplicitField) -> Vec<Vec<[u32; 3]>> {
    let is_cut = |face: &[u32; 3]| {
        let corners = face.map(|node| complex.points[node as usize]);
        field.value(&(corners.iter().sum::<Vector3>() / 3.0)) > DEEP * size_of(complex, face)
    };
    groups(&complex.outer_faces().into_iter().filter(is_cut).collect::<Vec<_>>())
}

fn size_of(complex: &Complex, face: &[u32; 3]) -> f64 {
    face.iter().map(|&node| complex.size[node as usize]).fold(f64::INFINITY, f64::min)
}

impl Band {
    fn of(
        faces: &[[u32; 3]],
        complex: &Complex,
        crowded: &BTreeSet<[u32; 2]>,
        field: &dyn ImplicitField,
    ) -> Self {
        let parts = faces.iter().flat_map(edges).any(|edge| crowded.contains(&edge));
        let corners: Vec<[Vector3; 3]> =
            faces.iter().map(|face| face.map(|node| complex.points[node as usize])).collect();
        let centres: Vec<Vector3> = corners.iter().map(|[a, b, c]| (a + b + c) / 3.0).collect();
        let middle = centres.iter().sum::<Vector3>() / centres.len() as f64;
        let normals: Vec<Vector3> = corners.iter().map(|[a, b, c]| (b - a).cross(&(c - a)) / 2.0).collect();
        let outwards = normals.iter().zip(&centres).map(|(normal, centre)| normal.dot(&(centre - middle)));
        let half_way = corners.iter().flat_map(|[a, b, c]| [(a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0]);
        let deepest = half_way.map(|point| field.value(&point)).fold(0.0, f64::max);
        Self {
            is_round: outwards.sum::<f64>() < 0.0 && (parts || euler_number(faces) != 1),
            towards: normals.iter().sum(),
            thickness: 2.0 * deepest,
            size: faces.iter().map(|face| size_of(complex, face)).fold(f64::INFINITY, f64::min),
            centres,
            middle,
        }
    }

    /// The neck of the body between this end and another one, if they look at each other through it.
    fn neck_to(&self, other: &Self, complex: &Complex, field: &dyn ImplicitField) -> Option<Tear> {
        let way = other.middle - self.middle;
        let faces = self.towards.dot(&way) > 0.0 && other.towards.dot(&way) < 0.0;
        if !faces || way.norm() > NECK * self.size.max(other.size) {
            return None;
        }
        let between = (1..SAMPLES).map(|at| self.middle + way * (f64::from(at) / f64::from(SAMPLES)));
        let between: Vec<Vector3> = between.collect();
        if between.iter().any(|point| field.value(point) <= 0.0) || holds_any(complex, &between) {
            return None;
        }
        Some(Tear {
            places: [&self.centres[..], &other.centres, &between].concat(),
            thickness: self.thickness.min(other.thickness),
        })
    }
}

/// True if a mesh holds one of some points.
fn holds_any(complex: &Complex, points: &[Vector3]) -> bool {
    let start = [points[0]; 2];
    let [low, high] = points.iter().fold(start, widened);
    let holds = |tet: u32| {
        let x = complex.corners(tet);
        let [least, most] = x.iter().fold([x[0]; 2], widened);
        if (0..3).any(|axis| least[axis] > high[axis] || most[axis] < low[axis]) {
            return false;
        }
        let Some(inverse) = Matrix3::from_columns(&[x[1] - x[0], x[2] - x[0], x[3] - x[0]]).try_inverse()
        else {
            return false;
        };
        points.iter().any(|point| {
            let weights = inverse * (point - x[0]);
            weights.iter().all(|&weight| weight >= 0.0) && weights.sum() <= 1.0
        })
    };
    complex.alive().any(holds)
}

fn edges(&[a, b, c]: &[u32; 3]) -> [[u32; 2]; 3] {
    [key(a, b), key(b, c), key(c, a)]
}

/// Faces in groups that are connected by edges, in the order of their first faces.
fn groups(faces: &[[u32; 3]]) -> Vec<Vec<[u32; 3]>> {
    let mut of_edge: BTreeMap<[u32; 2], Vec<usize>> = BTreeMap::new();
    for (number, face) in faces.iter().enumerate() {
        edges(face).into_iter().for_each(|edge| of_edge.entry(edge).or_default().push(number));
    }
    let mut is_taken = vec![false; faces.len()];
    let mut groups = Vec::new();
    for start in 0..faces.len() {
        let mut group = Vec::new();
        let mut ahead = vec![start];
        while let Some(number) = ahead.pop() {
            if !std::mem::replace(&mut is_taken[number], true) {
                group.push(faces[number]);
                ahead.extend(edges(&faces[number]).iter().flat_map(|edge| &of_edge[edge]));
            }
        }
        if !group.is_empty() {
            groups.push(group);
        }
    }
    groups
}
