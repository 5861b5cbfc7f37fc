//! The surface of a field in triangles. The cubes of a grid are cut into six tetrahedra each, all along the
//! same diagonals (Freudenthal 1942). In each the surface is one triangle or two. It is closed and manifold
//! for any values, as it has no ambiguous cells.

use std::collections::BTreeMap;

use pliant_geometry::Vector3;
use rayon::prelude::*;

use crate::error::{MeshingError, require_at_most, require_positive};
use crate::input::extent::checked_box;
use crate::input::field::ImplicitField;
use crate::surface::triangles::TriangleMesh;

/// The six tetrahedra of a cube: ways from its first corner to the last along one axis after the other. Odd
/// ones are left-handed.
const WAYS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];

/// Cubes of the grid allowed per allowed triangle, and always.
const CUBES_PER_TRIANGLE: usize = 4;
const CUBES_ALWAYS: usize = 50_000_000;

/// Steps of the false-position method to the surface along an edge of the grid.
const STEPS: usize = 10;

impl TriangleMesh {
    /// The zero surface of a field, on a grid of `step` [m].
    pub fn of_field(
        field: &(impl ImplicitField + ?Sized),
        step: f64,
        cell_limit: usize,
    ) -> Result<Self, MeshingError> {
        let Cut { grid, values, triangles: cut } = Cut::of(field, step, cell_limit)?;
        let mut numbers: BTreeMap<CutEdge, u32> = BTreeMap::new();
        let mut triangles = Vec::new();
        for cuts in cut {
            triangles.push(cuts.map(|cut| {
                let next = numbers.len() as u32;
                *numbers.entry(cut).or_insert(next)
            }));
        }
        if triangles.is_empty() {
            let (low, high) = field.bounds();
            return Err(MeshingError::NoCells { edge: step, size: high - low });
        }
        let mut cuts = vec![[0; 2]; numbers.len()];
        numbers.into_iter().for_each(|(cut, number)| cuts[number as usize] = cut);
        let points = cuts.par_iter().map(|cut| grid.crossing(field, *cut, &values)).collect();
        // Where the field is zero at a point of the grid, cuts of its edges lie at one place.
        Ok(Self::from_mesh(&Self::new(points, triangles).to_mesh())?.0)
    }
}

/// Euler number of the zero surface of a field on a grid of `step` [m]. The surface is closed: its edges are
/// three halves of its triangles.
pub(crate) fn euler_number_of_field(
    field: &(impl ImplicitField + ?Sized),
    step: f64,
) -> Result<i64, MeshingError> {
    let triangles = Cut::of(field, step, usize::MAX)?.triangles;
    let mut points = triangles.as_flattened().to_vec();
    points.par_sort_unstable();
    points.dedup();
    Ok(points.len() as i64 - triangles.len() as i64 / 2)
}

/// An edge of the tetrahedra: two points of the grid, the first inside.
type CutEdge = [u32; 2];

/// Section of a grid with the zero surface of a field.
struct Cut {
    grid: SampleGrid,
    values: Vec<f64>,
    triangles: Vec<[CutEdge; 3]>,
}

impl Cut {
    fn of(field: &(impl ImplicitField + ?Sized), step: f64, cell_limit: usize) -> Result<Self, MeshingError> {
        require_positive("the step of the grid", step)?;
        let (low, high) = checked_box(field)?;
        let counts = [0, 1, 2].map(|axis| ((high[axis] - low[axis]) / step).ceil() + 3.0);
        let cubes: f64 = counts.iter().product();
        let limit = cell_limit.saturating_mul(CUBES_PER_TRIANGLE).max(CUBES_ALWAYS);
        if cubes > limit.min(u32::MAX as usize) as f64 {
            return Err(MeshingError::LatticeTooLarge { cubes: cubes as u64, limit });
        }
        let grid = SampleGrid { low: low.add_scalar(-step), step, counts: counts.map(|n| n as usize) };
        let values: Vec<f64> =
            (0..grid.len()).into_par_iter().map(|at| field.value(&grid.point(at))).collect();
        if let Some(at) = values.iter().position(|value| !value.is_finite()) {
            return Err(MeshingError::FieldNotFinite { value: values[at], point: grid.point(at) });
        }
        let layers: Vec<Vec<[CutEdge; 3]>> =
            (0..grid.counts[2] - 1).into_par_iter().map(|k| grid.layer(k, &values)).collect();
        require_at_most(layers.iter().map(Vec::len).sum::<usize>() as f64, cell_limit)?;
        Ok(Self { grid, values, triangles: layers.concat() })
    }
}

struct SampleGrid {
    low: Vector3,
    step: f64,
    counts: [usize; 3],
}

impl SampleGrid {
    fn len(&self) -> usize {
        self.counts.iter().product()
    }

    fn point(&self, at: usize) -> Vector3 {
        let [nx, ny, _] = self.counts;
        let along = [at % nx, at / nx % ny, at / nx / ny];
        self.low + self.step * Vector3::from(along.map(|i| i as f64))
    }

    /// The triangles between two layers of points.
    fn layer(&self, k: usize, values: &[f64]) -> Vec<[CutEdge; 3]> {
        let [nx, ny, _] = self.counts;
        let strides = [1, nx, nx * ny];
        let mut found = Vec::new();
        for first in (0..ny - 1).flat_map(|j| (0..nx - 1).map(move |i| i + nx * (j + ny * k))) {
            let inside = |at: usize| values[at] > 0.0;
            let first_inside = inside(first);
            let uniform = (1..8).all(|c| {
                inside(
                    first + (0..3).filter(|axis| c >> axis & 1 == 1).map(|axis| strides[axis]).sum::<usize>(),
                ) == first_inside
            });
            if uniform {
                continue;
            }
            for (number, way) in WAYS.into_iter().enumerate() {
                let mut tet = [first; 4];
                for (corner, axis) in way.into_iter().enumerate() {
                    tet[corner + 1] = tet[corner] + strides[axis];
                }
                if number >= 3 {
                    tet.swap(2, 3);
                }
                cut_tet(tet, inside, &mut found);
            }
        }
        found
    }

    /// Zero of the field between a point inside and one outside.
    fn crossing(&self, field: &(impl ImplicitField + ?Sized), [a, b]: CutEdge, values: &[f64]) -> Vector3 {
        let (mut p, mut q) = (self.point(a as usize), self.point(b as usize));
        let (mut u, mut v) = (values[a as usize], values[b as usize]);
        let mut at = p + (q - p) * (u / (u - v));
        let mut last = None;
        for _ in 0..STEPS {
            let value = field.value(&at);
            let inner = value > 0.0;
            // An end kept twice counts half, so that both move (the Illinois rule, Dowell and Jarratt 1971).
            let factor = if last == Some(inner) { 0.5 } else { 1.0 };
            if inner {
                (p, u, v) = (at, value, factor * v);
            } else {
                (q, v, u) = (at, value, factor * u);
            }
            last = Some(inner);
            at = p + (q - p) * (u / (u - v));
        }
        at
    }
}

/// The triangles of a right-handed tetrahedron, seen from outside counter-clockwise.
fn cut_tet(tet: [usize; 4], inside: impl Fn(usize) -> bool, found: &mut Vec<[CutEdge; 3]>) {
    // Even permutations that bring the corners inside to the front.
    const EVEN: [[usize; 4]; 12] = [
        [0, 1, 2, 3],
        [1, 0, 3, 2],
        [2, 3, 0, 1],
        [3, 2, 1, 0],
        [0, 2, 3, 1],
        [0, 3, 1, 2],
        [1, 2, 0, 3],
        [1, 3, 2, 0],
        [2, 0, 1, 3],
        [2, 1, 3, 0],
        [3, 0, 2, 1],
        [3, 1, 0, 2],
    ];
    let count = tet.iter().filter(|&&at| inside(at)).count();
    let ordered = EVEN.iter().map(|order| order.map(|k| tet[k]));
    let sorted = |t: &[usize; 4]| (0..4).all(|k| inside(t[k]) == (k < count));
    let Some([a, b, c, d]) = ordered.into_iter().find(sorted).map(|t| t.map(|at| at as u32)) else { return };
    match count {
        1 => found.push([[a, b], [a, c], [a, d]]),
        2 => found.extend([[[a, c], [a, d], [b, d]], [[a, c], [b, d], [b, c]]]),
        3 => found.push([[a, d], [b, d], [c, d]]),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Ellipsoid;

    #[test]
    fn euler_numbers_of_fields_are_those_of_their_surfaces() {
        let ball = Ellipsoid::sphere(Vector3::zeros(), 0.5);
        assert_eq!(euler_number_of_field(&ball, 0.13).unwrap(), 2);
        for step in [0.013, 0.02] {
            let liver = crate::Phantom::new(crate::Organ::Brain, 1.0).unwrap();
            let mesh = TriangleMesh::of_field(&liver, step, 1_000_000).unwrap();
            let expected = crate::report::soundness::euler_number(&mesh.compact().1);
            assert_eq!(euler_number_of_field(&liver, step).unwrap(), expected);
        }
    }

    /// Points lie on the sphere, faces point outwards, the surface is closed: V − E + F = 2.
    #[test]
    fn a_sphere_is_closed_and_looks_outwards() {
        let ball = Ellipsoid::sphere(Vector3::new(0.1, 0.0, -0.2), 0.05);
        let mesh = TriangleMesh::of_field(&ball, 0.007, 100_000).unwrap();
        assert!(mesh.points.iter().all(|x| ball.value(x).abs() < 1e-9));
        assert!(mesh.alive().all(|t| mesh.normal(t).dot(&(mesh.corners(t)[0] - ball.centre)) >= 0.0));
        assert!(mesh.edges().iter().all(|&[a, b]| mesh.sides(a, b).iter().flatten().count() == 2));
        assert_eq!(mesh.points.len() + mesh.len() - mesh.edges().len(), 2);
    }

    /// The surface passes through points of the grid, which lies at multiples of the step.
    #[test]
    fn a_cut_at_a_point_of_the_grid_leaves_no_triangle_without_area() {
        let ball = Ellipsoid::sphere(Vector3::zeros(), 0.5);
        let mut mesh = TriangleMesh::of_field(&ball, 0.125, 100_000).unwrap();
        assert!(mesh.alive().all(|t| mesh.area(t) > 1e-9));
        assert_eq!(mesh.points.len() + mesh.len() - mesh.edges().len(), 2);
        assert_eq!(mesh.decimate(crate::Fewer::Triangles(40)).unwrap(), 40);
    }
}
