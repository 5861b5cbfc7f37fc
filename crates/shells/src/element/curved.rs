//! Membrane strain of a curved triangle: the mean over its cubic Bézier patch, linear in the nodes'
//! displacements and rotations about rest. The edges of the patch turn in their surface. Their turn is (1 −
//! α) times the turn of their chord plus α times the turn of their node about its own normal. Both neighbours
//! share this normal. α = 3/2, as in the ANDES triangle, which this element becomes on a flat facet. Strain
//! and pressure come from one surface that is continuous over edges, so they leave no nodal forces that bend
//! a thin wall. Leaves out: the change of the strain as the wall bends far from its rest shape, by the square
//! of an edge's angle.

use nalgebra::{Matrix2, Matrix3, RowVector3, SMatrix, Vector2, Vector3};

use pliant_geometry::EDGES;

use super::membrane::DRILLING_TO_EDGE;
use crate::control::points;
use crate::patch::Patch;

/// Something of three rows over (u, v, w, θx, θy, θz) of three nodes.
pub(crate) type Matrix3x18 = SMatrix<f64, 3, 18>;

/// Area, strain and drilling of a curved membrane.
pub(crate) struct CurvedMembrane {
    /// Area of the patch [m²].
    pub(crate) area: f64,
    /// Mean strain (εxx, εyy, γxy).
    pub(crate) strain: Matrix3x18,
    /// Rotations of the nodes about their own normals, less the rotation of the facet.
    pub(crate) hierarchical: Matrix3x18,
}

impl CurvedMembrane {
    /// Finds the membrane of a patch in the axes of its facet, with the gradients of the facet's shape
    /// functions.
    pub(crate) fn new(patch: &Patch, gradient: &[Vector2<f64>; 3]) -> Self {
        let normals = own_normals(patch);
        let (place, mut maps) = (patch.controls(), patch.control_maps());
        add_drilling(patch, &normals, &mut maps);
        let mut area = 0.0;
        // The sum of strains over each control point's displacement.
        let mut sums = [Matrix3::<f64>::zeros(); 9];
        for point in points() {
            let [along, across]: [Vector3<f64>; 2] =
                point.slopes.map(|slopes| place.iter().zip(slopes).map(|(b, slope)| b * slope).sum());
            let cross = along.cross(&across);
            let part = 0.5 * point.weight * cross.norm();
            let normal = cross.normalize();
            // The facet's axes, turned as little as takes their normal to this one.
            let lean = (normal + Vector3::z()) / (1.0 + normal.z);
            let (first, second) = (Vector3::x() - normal.x * lean, Vector3::y() - normal.y * lean);
            let jacobian =
                Matrix2::new(along.dot(&first), along.dot(&second), across.dot(&first), across.dot(&second));
            // Only of a patch that is folded is there none.
            let inverse = jacobian.try_inverse().unwrap_or_else(Matrix2::zeros);
            area += part;
            for (control, sum) in sums.iter_mut().enumerate() {
                let g = inverse * Vector2::new(point.slopes[0][control], point.slopes[1][control]) * part;
                *sum += Matrix3::from_rows(&[
                    first.transpose() * g.x,
                    second.transpose() * g.y,
                    first.transpose() * g.y + second.transpose() * g.x,
                ]);
            }
        }
        let strain = sums.iter().zip(&maps).fold(Matrix3x18::zeros(), |total, (sum, map)| total + sum * map);
        Self { area, strain: strain / area, hierarchical: hierarchical(&normals, gradient) }
    }
}

/// The normal about which each corner drills: its own, or the facet's where both its edges are straight.
fn own_normals(patch: &Patch) -> [Vector3<f64>; 3] {
    std::array::from_fn(|corner| {
        let curved =
            EDGES.iter().zip(patch.straight()).any(|(edge, straight)| edge[0] == corner && !straight);
        if curved { patch.normals()[corner] } else { Vector3::z() }
    })
}

/// Turns the tangents of the edges with their nodes.
fn add_drilling(patch: &Patch, normals: &[Vector3<f64>; 3], maps: &mut [Matrix3x18; 9]) {
    for (k, [start, _]) in EDGES.into_iter().enumerate() {
        let reach = patch.edge_points()[k] - patch.corners()[start];
        // Along a straight edge that leaves a corner with a normal of its own, about the facet's.
        let normal = if patch.straight()[k] { Vector3::z() } else { normals[start] };
        let aside = normal.cross(&reach).normalize();
        let map = &mut maps[3 + k];
        let mut turn = -aside.transpose() * *map;
        let mut shift = turn.fixed_columns_mut::<3>(6 * start);
        shift += aside.transpose();
        let mut spin = turn.fixed_columns_mut::<3>(6 * start + 3);
        spin += normal.transpose() * reach.norm();
        *map += aside * (DRILLING_TO_EDGE * turn);
    }
}

/// (θ − ω)·n/nz at each corner, with ω the rotation of the facet.
fn hierarchical(normals: &[Vector3<f64>; 3], gradient: &[Vector2<f64>; 3]) -> Matrix3x18 {
    let mut rows = Matrix3x18::zeros();
    for (row, normal) in normals.iter().enumerate() {
        let about = normal.transpose() / normal.z;
        let mut spin = rows.fixed_view_mut::<1, 3>(row, 6 * row + 3);
        spin += about;
        for (node, g) in gradient.iter().enumerate() {
            // ω = (Σ w ∂y, −Σ w ∂x, ½ Σ (v ∂x − u ∂y)).
            let g = Vector3::new(g.x, g.y, 0.0);
            let turn: RowVector3<f64> =
                about * Matrix3::new(0.0, 0.0, g.y, 0.0, 0.0, -g.x, -0.5 * g.y, 0.5 * g.x, 0.0);
            let mut moved = rows.fixed_view_mut::<1, 3>(row, 6 * node);
            moved -= turn;
        }
    }
    rows
}
