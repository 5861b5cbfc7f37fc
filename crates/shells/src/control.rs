//! The control points of a curved triangle, as its corners move them, and points to integrate over it.
//! Counted are nine: three corners, then six along the edges; the middle one is spread over them.

use std::sync::LazyLock;

use nalgebra::{Matrix3, Vector3};
use pliant_geometry::{ControlWeights, CurvedTriangle, EDGES};

use crate::element::Matrix3x18;
use crate::patch::Patch;
use crate::rotation::skew;

/// A point to integrate at.
pub(crate) struct Point {
    /// Its part of the whole area.
    pub(crate) weight: f64,
    /// Weights of the control points there.
    pub(crate) value: [f64; 9],
    /// Their derivatives with respect to the second and the third area coordinate.
    pub(crate) slopes: [[f64; 9]; 2],
}

/// The rule of 16 points of Dunavant (1985), exact to the eighth degree and the same from each corner. It
/// lists area coordinates and weight of one point of each kind, which represents all its permutations.
const RULE: [([f64; 3], f64); 5] = [
    ([1.0 / 3.0; 3], 0.144_315_607_677_787),
    ([0.081_414_823_414_554, 0.459_292_588_292_723, 0.459_292_588_292_723], 0.095_091_634_267_285),
    ([0.658_861_384_496_480, 0.170_569_307_751_760, 0.170_569_307_751_760], 0.103_217_370_534_718),
    ([0.898_905_543_365_938, 0.050_547_228_317_031, 0.050_547_228_317_031], 0.032_458_497_623_198),
    ([0.008_394_777_409_958, 0.263_112_829_634_638, 0.728_492_392_955_404], 0.027_230_314_174_435),
];

static POINTS: LazyLock<Vec<Point>> = LazyLock::new(|| {
    let mut points = Vec::new();
    for ([a, b, c], weight) in RULE {
        let turns: &[[f64; 3]] = match (a == b, b == c) {
            (true, _) => &[[a, b, c]],
            (_, true) => &[[a, b, c], [c, a, b], [b, c, a]],
            _ => &[[a, b, c], [c, a, b], [b, c, a], [a, c, b], [b, a, c], [c, b, a]],
        };
        points.extend(turns.iter().map(|&place| Point {
            weight,
            value: nine(CurvedTriangle::weights(place)),
            slopes: CurvedTriangle::weight_slopes(place).map(nine),
        }));
    }
    points
});

/// The points to integrate at; their weights add up to 1.
pub(crate) fn points() -> &'static [Point] {
    &POINTS
}

fn nine((corner, edge): ControlWeights) -> [f64; 9] {
    std::array::from_fn(|control| if control < 3 { corner[control] } else { edge[control - 3] })
}

impl Patch {
    /// The control points [m].
    pub(crate) fn controls(&self) -> [Vector3<f64>; 9] {
        std::array::from_fn(|control| {
            if control < 3 { self.corners()[control] } else { self.edge_points()[control - 3] }
        })
    }

    /// The velocity of the control points along edges: over the velocity of the end from the start, and over
    /// the spin of the start.
    pub(crate) fn edge_maps(&self) -> [[Matrix3<f64>; 2]; 6] {
        std::array::from_fn(|k| {
            let (along, turning) = self.edge_derivative(k);
            [along, -turning * skew(&self.normals()[EDGES[k][0]])]
        })
    }

    /// The velocity of each control point over velocities and spins of the three nodes.
    pub(crate) fn control_maps(&self) -> [Matrix3x18; 9] {
        let mut maps = [Matrix3x18::zeros(); 9];
        for (corner, map) in maps[..3].iter_mut().enumerate() {
            map.fixed_columns_mut::<3>(6 * corner).fill_with_identity();
        }
        for ((map, [start, end]), [along, turning]) in maps[3..].iter_mut().zip(EDGES).zip(self.edge_maps()) {
            map.fixed_columns_mut::<3>(6 * start).copy_from(&(Matrix3::identity() - along));
            map.fixed_columns_mut::<3>(6 * end).copy_from(&along);
            map.fixed_columns_mut::<3>(6 * start + 3).copy_from(&turning);
        }
        maps
    }
}
