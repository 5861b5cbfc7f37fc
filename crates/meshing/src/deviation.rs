//! How far the boundary of a mesh and the surface of the body it was made of are apart, both ways.

use std::collections::HashMap;

use pliant_geometry::{Mesh, SurfaceLocator, Vector3, boundary};
use rayon::prelude::*;
use serde::Serialize;

use crate::error::MeshingError;
use crate::extent::checked_box;
use crate::field::ImplicitField;

/// Samples of the field along the longest side of its box at most.
const MOST_SAMPLES: f64 = 160.0;

/// Steps of Newton's method to the surface.
const STEPS: usize = 8;

/// Distances between the boundary of a mesh and the surface where a field is zero [m].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Deviation {
    /// Largest distance from the nodes and face centres of the mesh's boundary to the surface.
    pub largest_from_mesh: f64,
    /// Root mean square of the same, weighted by area.
    pub rms_from_mesh: f64,
    /// Largest distance from the surface to the mesh's boundary.
    pub largest_from_body: f64,
    /// Root mean square of the same.
    pub rms_from_body: f64,
    /// The point of the surface that is farthest from the mesh [m].
    pub farthest: [f64; 3],
}

impl Deviation {
    /// Measures a mesh against a field. The surface is sampled where it crosses the edges of a grid of a quarter of `edge`
    /// [m], of a 160th of the box at least: parts thinner than that may be overlooked.
    pub fn new(mesh: &Mesh, field: &(impl ImplicitField + ?Sized), edge: f64) -> Result<Self, MeshingError> {
        let points = surface_points(field, edge)?;
        let surface = boundary(mesh);
        let faces: Vec<u32> = (0..surface.faces.len() as u32).collect();
        let locator = SurfaceLocator::new(&surface, &faces, &mesh.points);
        let mut found = Self::default();
        let samples = Samples::new(points, edge);
        let (mut squares, mut weight) = (0.0, 0.0);
        let from_mesh = surface.faces.par_iter().map(|face| {
            let corners = face.nodes().iter().map(|&node| mesh.points[node as usize]);
            let far = corners
                .chain([face.centre(&mesh.points)])
                .map(|point| way_to_surface(field, &point, edge).min(samples.distance(&point)))
                .collect::<Vec<_>>();
            (face.area(&mesh.points), far)
        });
        for (area, far) in from_mesh.collect::<Vec<_>>() {
            found.largest_from_mesh = far.iter().copied().fold(found.largest_from_mesh, f64::max);
            squares += area * far.iter().map(|d| d * d).sum::<f64>() / far.len() as f64;
            weight += area;
        }
        found.rms_from_mesh = root_mean(squares, weight);
        let to_mesh = |point: &Vector3| locator.closest(point).map_or(0.0, |at| (at.position - point).norm());
        let distances: Vec<f64> = samples.points.par_iter().map(to_mesh).collect();
        for (&distance, point) in distances.iter().zip(&samples.points) {
            if distance > found.largest_from_body {
                (found.largest_from_body, found.farthest) = (distance, (*point).into());
            }
        }
        found.rms_from_body = root_mean(distances.iter().map(|d| d * d).sum(), distances.len() as f64);
        Ok(found)
    }
}

fn root_mean(squares: f64, weight: f64) -> f64 {
    if weight > 0.0 { (squares / weight).sqrt() } else { 0.0 }
}

/// Points of the surface, in cubes by their place.
struct Samples {
    points: Vec<Vector3>,
    cubes: HashMap<[i64; 3], Vec<u32>>,
    /// Edge of the cubes [m].
    edge: f64,
}

impl Samples {
    fn new(points: Vec<Vector3>, edge: f64) -> Self {
        let mut cubes: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
        for (index, point) in (0..).zip(&points) {
            cubes.entry(cube(point, edge)).or_default().push(index);
        }
        Self { points, cubes, edge }
    }

    /// Distance to the nearest of them [m]; infinite without any.
    fn distance(&self, from: &Vector3) -> f64 {
        let own = cube(from, self.edge);
        let near = (0..27).map(|at| [own[0] + at % 3 - 1, own[1] + at / 3 % 3 - 1, own[2] + at / 9 - 1]);
        let near = near.filter_map(|cube| self.cubes.get(&cube)).flatten();
        let nearest = near.map(|&at| (self.points[at as usize] - from).norm()).fold(f64::INFINITY, f64::min);
        // What is farther than an edge may be nearer in other cubes.
        if nearest <= self.edge {
            return nearest;
        }
        self.points.iter().map(|point| (point - from).norm()).fold(f64::INFINITY, f64::min)
    }
}

fn cube(point: &Vector3, edge: f64) -> [i64; 3] {
    [0, 1, 2].map(|axis| (point[axis] / edge).floor() as i64)
}

/// Distance to the zero surface along the gradient [m], which is exact nearby; infinite where the way is lost.
fn way_to_surface(field: &(impl ImplicitField + ?Sized), from: &Vector3, longest: f64) -> f64 {
    let mut point = *from;
    let mut value = field.value(&point);
    for _ in 0..STEPS {
        if value.abs() < 1e-3 * longest {
            break;
        }
        let gradient = field.gradient(&point);
        let step = gradient * (value / gradient.norm_squared());
        if !step.iter().all(|x| x.is_finite()) {
            return f64::INFINITY;
        }
        point -= if step.norm() > longest { step.normalize() * longest } else { step };
        value = field.value(&point);
    }
    if value.abs() < 1e-2 * longest { (point - from).norm() + value.abs() } else { f64::INFINITY }
}

/// Points of the surface: where it crosses the edges of a grid of a quarter of `edge` [m], of a 160th of the box at least.
pub(crate) fn surface_points(
    field: &(impl ImplicitField + ?Sized),
    edge: f64,
) -> Result<Vec<Vector3>, MeshingError> {
    let (low, high) = checked_box(field)?;
    let step = (edge / 4.0).max((high - low).amax() / MOST_SAMPLES);
    Ok(crossings(field, &low, &high, step))
}

/// Where the zero surface crosses the edges of a grid over a box.
fn crossings(
    field: &(impl ImplicitField + ?Sized),
    low: &Vector3,
    high: &Vector3,
    step: f64,
) -> Vec<Vector3> {
    let counts = [0, 1, 2].map(|axis| ((high[axis] - low[axis]) / step).ceil() as usize + 3);
    let [nx, ny, nz] = counts;
    let point =
        |[i, j, k]: [usize; 3]| low + Vector3::new(i as f64 - 1.0, j as f64 - 1.0, k as f64 - 1.0) * step;
    let triple = |at: usize| [at % nx, at / nx % ny, at / nx / ny];
    let values: Vec<f64> =
        (0..nx * ny * nz).into_par_iter().map(|at| field.value(&point(triple(at)))).collect();
    let strides = [1, nx, nx * ny];
    let of_point = |at: usize| {
        let from = triple(at);
        (0..3).filter(move |&axis| from[axis] + 1 < counts[axis]).filter_map({
            let values = &values;
            move |axis| {
                let [a, b] = [values[at], values[at + strides[axis]]];
                let mut crossing = point(from);
                crossing[axis] += step * a / (a - b);
                ((a > 0.0) != (b > 0.0)).then_some(crossing)
            }
        })
    };
    (0..values.len()).into_par_iter().flat_map_iter(of_point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Ellipsoid, Stuffing};

    #[test]
    fn a_ball_and_a_smaller_one_are_as_far_apart_as_their_radii() {
        let ball = |radius| Ellipsoid { centre: Vector3::zeros(), radii: Vector3::repeat(radius) };
        let mesh = Stuffing::new(0.004).mesh(&ball(0.04)).unwrap().mesh;
        let own = Deviation::new(&mesh, &ball(0.04), 0.004).unwrap();
        assert!(own.largest_from_mesh < 2e-4 && own.largest_from_body < 2e-4, "{own:?}");
        let other = Deviation::new(&mesh, &ball(0.05), 0.004).unwrap();
        for distance in
            [other.largest_from_mesh, other.rms_from_mesh, other.largest_from_body, other.rms_from_body]
        {
            assert!((distance - 0.01).abs() < 3e-4, "{other:?}");
        }
        assert!((Vector3::from(other.farthest).norm() - 0.05).abs() < 2e-4, "{other:?}");
    }
}
