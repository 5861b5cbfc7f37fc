//! Distance between the boundary of a mesh and the surface of its body in both directions. The surface is
//! given, or the zero surface of a field.

use std::collections::HashMap;

use pliant_geometry::{Mesh, SurfaceLocator, Vector3, boundary};
use rayon::prelude::*;
use serde::Serialize;

use crate::error::MeshingError;
use crate::input::anatomy::Anatomy;
use crate::input::extent::checked_box;
use crate::input::field::ImplicitField;
use crate::input::given::{MeasuredTo, Patches, is_outer};
use crate::report::hausdorff::{Sample, distance};
use crate::report::percentiles::Percentiles;
use crate::tets::topology::faces_between_labels;

/// Most samples of the field along the longest side of its box.
const MOST_SAMPLES: f64 = 160.0;

/// Steps of Newton's method to the surface.
const STEPS: usize = 8;

/// Samples along an edge of the cells.
pub(crate) const SAMPLES_PER_EDGE: f64 = 4.0;

/// Distances between the boundary of a mesh and the surface of its body, both ways [m].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Deviation {
    /// The reference surface of the body.
    pub to: MeasuredTo,
    /// Largest distance from the mesh's boundary to the surface.
    pub largest_from_mesh: f64,
    /// Root mean square of the same, weighted by area.
    pub rms_from_mesh: f64,
    /// Half of the mesh's boundary is as near as this.
    pub median_from_mesh: f64,
    /// 95 % of the mesh's boundary is as near as this.
    pub p95_from_mesh: f64,
    /// The point of the mesh's boundary that is farthest from the surface [m].
    pub farthest_of_mesh: [f64; 3],
    /// Largest distance from the surface to the mesh's boundary.
    pub largest_from_body: f64,
    /// Root mean square of the same.
    pub rms_from_body: f64,
    /// Half of the surface is as near as this.
    pub median_from_body: f64,
    /// 95 % of the surface is as near as this.
    pub p95_from_body: f64,
    /// The point of the surface that is farthest from the mesh [m].
    pub farthest: [f64; 3],
}

/// Distances of samples of two surfaces from each other.
pub(crate) struct Measured {
    pub(crate) to: MeasuredTo,
    from_mesh: Samples,
    from_body: Samples,
}

/// Samples of a surface, and the distance of each from another one [m].
type Samples = (Vec<Sample>, Vec<f64>);

impl Measured {
    /// Distances of a mesh with a distance bound [m]: to triangles if they define the body, otherwise to its
    /// field.
    pub(crate) fn of(mesh: &Mesh, anatomy: &Anatomy<'_>, distance: f64) -> Result<Self, MeshingError> {
        if let Some(given) = anatomy.given().filter(|given| given.measured_to() == MeasuredTo::Triangles) {
            let (made, patches) = (faces_between_labels(mesh), anatomy.patches());
            if let Some(found) = Self::between(&made, &patches, &is_outer, distance) {
                return Ok(Self { to: given.measured_to(), ..found });
            }
        }
        Self::to_field(mesh, anatomy.field(), 4.0 * distance)
    }

    fn to_field(mesh: &Mesh, field: &(impl ImplicitField + ?Sized), edge: f64) -> Result<Self, MeshingError> {
        let points = surface_points(field, edge)?;
        let surface = boundary(mesh);
        let faces: Vec<u32> = (0..surface.faces.len() as u32).collect();
        let locator = SurfaceLocator::new(&surface, &faces, &mesh.points);
        let near = Near::new(points, edge);
        let from_mesh = surface.faces.par_iter().flat_map_iter(|face| {
            let corners = face.nodes().iter().map(|&node| mesh.points[node as usize]);
            let points: Vec<Vector3> = corners.chain([face.centre(&mesh.points)]).collect();
            let area = face.area(&mesh.points) / points.len() as f64;
            let near = &near;
            points.into_iter().map(move |point| {
                (Sample { point, area }, way_to_surface(field, &point, edge).min(near.distance(&point)))
            })
        });
        let from_mesh = from_mesh.collect::<Vec<_>>().into_iter().unzip();
        let to: Vec<Sample> = near.points.iter().map(|&point| Sample { point, area: 1.0 }).collect();
        let back = to.par_iter().map(|sample| distance(&locator, &sample.point)).collect();
        Ok(Self { to: MeasuredTo::Field, from_mesh, from_body: (to, back) })
    }

    fn between(
        mesh: &Patches,
        given: &Patches,
        chosen: &dyn Fn([i32; 2]) -> bool,
        spacing: f64,
    ) -> Option<Self> {
        let [mesh, given] = [mesh, given].map(|patches| patches.only(chosen));
        let one_way = |from: &Patches, to: &SurfaceLocator| {
            let samples = from.samples(spacing);
            let far = samples.par_iter().map(|sample| distance(to, &sample.point)).collect();
            (samples, far)
        };
        let (to_mesh, to_given) = (mesh.locator()?, given.locator()?);
        Some(Self {
            to: MeasuredTo::Field,
            from_mesh: one_way(&mesh, &to_given),
            from_body: one_way(&given, &to_mesh),
        })
    }

    /// The largest distance of both directions [m].
    pub(crate) fn largest(&self) -> f64 {
        self.from_mesh.1.iter().chain(&self.from_body.1).copied().fold(0.0, f64::max)
    }

    /// Samples of both surfaces that are farther from the other one than this [m].
    pub(crate) fn beyond(&self, far: f64) -> Vec<Vector3> {
        let of = |(samples, distances): &Samples| -> Vec<Vector3> {
            let beyond = samples.iter().zip(distances).filter(|(_, distance)| **distance > far);
            beyond.map(|(sample, _)| sample.point).collect()
        };
        [of(&self.from_mesh), of(&self.from_body)].concat()
    }

    fn deviation(&self) -> Deviation {
        let [there, back] = [&self.from_mesh, &self.from_body].map(|(samples, far)| Way::new(samples, far));
        Deviation {
            to: self.to,
            largest_from_mesh: there.largest,
            rms_from_mesh: there.rms,
            median_from_mesh: there.median,
            p95_from_mesh: there.p95,
            farthest_of_mesh: there.farthest,
            largest_from_body: back.largest,
            rms_from_body: back.rms,
            median_from_body: back.median,
            p95_from_body: back.p95,
            farthest: back.farthest,
        }
    }
}

impl Deviation {
    /// Measures a mesh with cells of `edge` [m] against its input. The input is the triangles of a file, the
    /// voxel faces of an image, or the field of a function. Samples are at most a quarter of an edge apart.
    ///
    /// # Errors
    /// If the box of the field is empty or not finite.
    pub fn of(mesh: &Mesh, anatomy: &Anatomy<'_>, edge: f64) -> Result<Self, MeshingError> {
        let given = anatomy.given().and_then(|given| {
            let (made, patches) = (faces_between_labels(mesh), anatomy.patches());
            let found = Self::between(&made, &patches, &is_outer, edge / SAMPLES_PER_EDGE)?;
            Some(Self { to: given.measured_to(), ..found })
        });
        given.map_or_else(|| Self::new(mesh, anatomy.field(), edge), Ok)
    }

    /// Measures a mesh against a field. The surface is sampled at its intersections with a grid of a quarter
    /// of `edge` [m], at least a 160th of the box. Thinner parts may be missed.
    ///
    /// # Errors
    /// If the box of the field is empty or not finite.
    pub fn new(mesh: &Mesh, field: &(impl ImplicitField + ?Sized), edge: f64) -> Result<Self, MeshingError> {
        Ok(Measured::to_field(mesh, field, edge)?.deviation())
    }

    /// Distances between the triangles of a mesh and of its input with chosen sides, with samples at most
    /// `spacing` [m] apart. `None` if either has no such triangles.
    pub(crate) fn between(
        mesh: &Patches,
        given: &Patches,
        chosen: &dyn Fn([i32; 2]) -> bool,
        spacing: f64,
    ) -> Option<Self> {
        Some(Measured::between(mesh, given, chosen, spacing)?.deviation())
    }

    /// The largest distance of both directions, and its location [m].
    pub fn largest(&self) -> (f64, [f64; 3]) {
        if self.largest_from_mesh > self.largest_from_body {
            (self.largest_from_mesh, self.farthest_of_mesh)
        } else {
            (self.largest_from_body, self.farthest)
        }
    }
}

/// Distances one way [m].
struct Way {
    largest: f64,
    rms: f64,
    median: f64,
    p95: f64,
    farthest: [f64; 3],
}

impl Way {
    fn new(samples: &[Sample], far: &[f64]) -> Self {
        let weighted = samples.iter().zip(far).map(|(sample, &far)| (far, sample.area));
        let spread = Percentiles::weighted(weighted.collect());
        let (median, p95) = spread.map_or((0.0, 0.0), |spread| (spread.median, spread.p95));
        let (squares, area) = samples.iter().zip(far).fold((0.0, 0.0), |(squares, area), (sample, far)| {
            (squares + sample.area * far * far, area + sample.area)
        });
        let first_farthest =
            samples.iter().zip(far).fold(None, |most: Option<(&Sample, f64)>, (sample, &far)| {
                if most.is_none_or(|(_, most)| far > most) { Some((sample, far)) } else { most }
            });
        let (largest, farthest) =
            first_farthest.map_or((0.0, [0.0; 3]), |(sample, far)| (far, sample.point.into()));
        Self { largest, rms: root_mean(squares, area), median, p95, farthest }
    }
}

fn root_mean(squares: f64, weight: f64) -> f64 {
    if weight > 0.0 { (squares / weight).sqrt() } else { 0.0 }
}

/// Points of the surface, in cubes by their place.
struct Near {
    points: Vec<Vector3>,
    cubes: HashMap<[i64; 3], Vec<u32>>,
    /// Edge of the cubes [m].
    edge: f64,
}

impl Near {
    fn new(points: Vec<Vector3>, edge: f64) -> Self {
        let mut cubes: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
        for (index, point) in (0..).zip(&points) {
            cubes.entry(cube(point, edge)).or_default().push(index);
        }
        Self { points, cubes, edge }
    }

    /// Distance to the nearest point [m]; infinite without any.
    fn distance(&self, from: &Vector3) -> f64 {
        let middle = cube(from, self.edge);
        let near =
            (0..27).map(|at| [middle[0] + at % 3 - 1, middle[1] + at / 3 % 3 - 1, middle[2] + at / 9 - 1]);
        let near = near.filter_map(|cube| self.cubes.get(&cube)).flatten();
        let nearest = near.map(|&at| (self.points[at as usize] - from).norm()).fold(f64::INFINITY, f64::min);
        // Points farther than an edge may be nearer in other cubes.
        if nearest <= self.edge {
            return nearest;
        }
        self.points.iter().map(|point| (point - from).norm()).fold(f64::INFINITY, f64::min)
    }
}

fn cube(point: &Vector3, edge: f64) -> [i64; 3] {
    [0, 1, 2].map(|axis| (point[axis] / edge).floor() as i64)
}

/// Distance to the zero surface along the gradient [m], which is exact nearby; infinite if the path fails.
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

/// Points of the surface: its intersections with the edges of a grid of a quarter of `edge` [m], at least a
/// 160th of the box.
pub(crate) fn surface_points(
    field: &(impl ImplicitField + ?Sized),
    edge: f64,
) -> Result<Vec<Vector3>, MeshingError> {
    let (low, high) = checked_box(field)?;
    Ok(crossings(field, &low, &high, sample_step(field, edge)?))
}

/// Step of the grid that samples a field for cells of `edge` [m].
pub(crate) fn sample_step(field: &(impl ImplicitField + ?Sized), edge: f64) -> Result<f64, MeshingError> {
    let (low, high) = checked_box(field)?;
    Ok((edge / SAMPLES_PER_EDGE).max((high - low).amax() / MOST_SAMPLES))
}

/// Points where the zero surface crosses the edges of a grid over a box.
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
        let deviation = Deviation::new(&mesh, &ball(0.04), 0.004).unwrap();
        assert!(deviation.largest_from_mesh < 2e-4 && deviation.largest_from_body < 2e-4, "{deviation:?}");
        let other = Deviation::new(&mesh, &ball(0.05), 0.004).unwrap();
        for distance in
            [other.largest_from_mesh, other.rms_from_mesh, other.largest_from_body, other.rms_from_body]
        {
            assert!((distance - 0.01).abs() < 3e-4, "{other:?}");
        }
        assert!((Vector3::from(other.farthest).norm() - 0.05).abs() < 2e-4, "{other:?}");
    }
}
