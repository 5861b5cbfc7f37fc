//! Rigid shapes, each in its frame, with their signed distance.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::grid::Grid;
pub use crate::near::{Near, Triangles};
use crate::profile::Profile;

/// A rigid shape.
#[derive(Clone, Debug)]
pub enum Shape {
    /// A ball around the origin.
    Sphere {
        /// Its radius [m].
        radius: f64,
    },
    /// The points within a radius of a segment along z, centred at the origin.
    Capsule {
        /// Its radius [m].
        radius: f64,
        /// Length of the segment [m].
        length: f64,
    },
    /// A cylinder along z with flat ends, centred at the origin.
    Cylinder {
        /// Its radius [m].
        radius: f64,
        /// Its length [m].
        length: f64,
    },
    /// A box centred at the origin.
    Cuboid {
        /// Its edges [m].
        size: [f64; 3],
    },
    /// A cone along z, its base in the plane z = 0 and its tip above.
    Cone {
        /// Radius of the base [m].
        radius: f64,
        /// Its height [m].
        height: f64,
    },
    /// The points below the plane z = 0.
    HalfSpace,
    /// A body of revolution about the z axis.
    Revolved(Arc<Profile>),
    /// Distances of a closed surface, sampled.
    Grid(Arc<Grid>),
}

/// Largest number of sides of a shape: the sides of a box.
const MOST_SIDES: usize = 6;

/// Smooth sides of a shape, the first places of the array.
pub type Sides = [Option<Near>; MOST_SIDES];

impl Shape {
    /// The distance of a point [m] of its frame, and the direction away from it.
    pub fn near(&self, point: &Vector3<f64>) -> Near {
        match self {
            Self::Sphere { radius } => around(*point, *radius),
            Self::Capsule { radius, length } => {
                let z = point.z.clamp(-0.5 * length, 0.5 * length);
                around(point - Vector3::z() * z, *radius)
            }
            Self::Cylinder { radius, length } => cylinder(point, *radius, 0.5 * length),
            Self::Cuboid { size } => cuboid(point, &(0.5 * Vector3::from(*size))),
            Self::Cone { radius, height } => cone(point, *radius, *height),
            Self::HalfSpace => Near { distance: point.z, normal: Vector3::z() },
            Self::Revolved(profile) => {
                let from_axis = Vector2::new(point.x, point.y);
                let r = from_axis.norm();
                let radial = if r > 0.0 { from_axis / r } else { Vector2::x() };
                let (distance, flat) = profile.near(Vector2::new(point.z, r));
                Near { distance, normal: Vector3::new(radial.x * flat.y, radial.y * flat.y, flat.x) }
            }
            Self::Grid(grid) => grid.near(point),
        }
    }

    /// Smooth sides for a point [m] inside: distance, negative inside, and its gradient. Each side extends
    /// beyond the corners of the shape, so that the nearest side is as far as the surface. Sampled distances
    /// have one side with a continuous gradient, shorter than 1 where it rounds corners.
    pub fn sides(&self, point: &Vector3<f64>) -> Sides {
        let side = |distance, normal| Some(Near { distance, normal });
        let mut sides = [None; MOST_SIDES];
        match self {
            Self::Cuboid { size } => {
                for (at, found) in sides.iter_mut().enumerate() {
                    let (axis, sign) = (at / 2, if at % 2 == 0 { -1.0 } else { 1.0 });
                    *found = side(sign * point[axis] - 0.5 * size[axis], Vector3::ith(axis, sign));
                }
            }
            Self::Cylinder { radius, length } => {
                sides[0] = Some(around(Vector3::new(point.x, point.y, 0.0), *radius));
                sides[1] = side(-point.z - 0.5 * length, -Vector3::z());
                sides[2] = side(point.z - 0.5 * length, Vector3::z());
            }
            Self::Cone { radius, height } => {
                let from_axis = Vector2::new(point.x, point.y);
                let radial = from_axis.try_normalize(0.0).unwrap_or(Vector2::x());
                let flat = Vector2::new(*height, *radius).normalize();
                let distance = flat.x * (from_axis.norm() - radius) + flat.y * point.z;
                sides[0] = side(-point.z, -Vector3::z());
                sides[1] = side(distance, Vector3::new(radial.x * flat.x, radial.y * flat.x, flat.y));
            }
            Self::Grid(grid) => sides[0] = Some(grid.smooth(point)),
            Self::Sphere { .. } | Self::Capsule { .. } | Self::HalfSpace | Self::Revolved(_) => {
                sides[0] = Some(self.near(point));
            }
        }
        sides
    }

    /// The least distance [m] that a point can go through it; infinite of a half-space.
    pub fn thinnest(&self) -> f64 {
        match self {
            Self::Sphere { radius } | Self::Capsule { radius, .. } => *radius,
            Self::Cylinder { radius, length } => radius.min(0.5 * length),
            Self::Cuboid { size } => 0.5 * size.iter().copied().fold(f64::INFINITY, f64::min),
            Self::Cone { radius, height } => 0.5 * radius.min(*height),
            Self::HalfSpace => f64::INFINITY,
            Self::Revolved(profile) => profile.least_radius(),
            Self::Grid(grid) => grid.thinnest(),
        }
    }

    /// Radius [m] around the origin of all that moves fastest when it turns: of a half-space zero.
    pub fn reach(&self) -> f64 {
        match self {
            Self::Sphere { radius } => *radius,
            Self::Capsule { radius, length } => radius + 0.5 * length,
            Self::Cylinder { radius, length } => radius.hypot(0.5 * length),
            Self::Cuboid { size } => 0.5 * Vector3::from(*size).norm(),
            Self::Cone { radius, height } => radius.max(*height),
            Self::HalfSpace => 0.0,
            Self::Revolved(profile) => profile.reach(),
            Self::Grid(grid) => grid.reach(),
        }
    }
}

/// Points around a circle of a surface that is drawn.
const AROUND: u32 = 32;

impl Shape {
    /// Its surface in its own frame, to be drawn; of a half-space a square of this width [m].
    pub fn surface(&self, width: f64) -> Triangles {
        let arc = |centre: f64, radius: f64, from: i32, to: i32| {
            (from..=to).map(move |step| {
                let angle = f64::from(step) * std::f64::consts::PI / 16.0;
                [radius * angle.cos(), centre + radius * angle.sin()]
            })
        };
        match *self {
            Self::Sphere { radius } => revolved(&arc(0.0, radius, -8, 8).collect::<Vec<_>>()),
            Self::Capsule { radius, length } => {
                let [low, high] = [-0.5, 0.5].map(|part| part * length);
                revolved(&arc(low, radius, -8, 0).chain(arc(high, radius, 0, 8)).collect::<Vec<_>>())
            }
            Self::Cylinder { radius, length } => {
                let [low, high] = [-0.5, 0.5].map(|part| part * length);
                revolved(&[[0.0, low], [radius, low], [radius, high], [0.0, high]])
            }
            Self::Cone { radius, height } => revolved(&[[0.0, 0.0], [radius, 0.0], [0.0, height]]),
            Self::Cuboid { size } => {
                let corner =
                    |k: usize| Vector3::from_fn(|c, _| (f64::from((k >> c & 1) as u8) - 0.5) * size[c]);
                let faces =
                    [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
                let halves = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
                ((0..8).map(corner).collect(), halves.collect())
            }
            Self::HalfSpace => {
                let corner = |[x, y]: [f64; 2]| Vector3::new(0.5 * width * x, 0.5 * width * y, 0.0);
                let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
                (corners.map(corner).to_vec(), vec![[0, 1, 2], [0, 2, 3]])
            }
            Self::Revolved(ref profile) => revolved(&profile.drawn(AROUND / 4)),
            Self::Grid(ref grid) => grid.surface().clone(),
        }
    }
}

/// Largest distance that a drawn corner moves where the surface grows by 1. Without this limit the tip of a
/// sharp cone could move any distance.
const FARTHEST: f64 = 3.0;

impl Shape {
    /// Motion of the points [m] of the drawn surface per growth distance. Sides move straight outward by that
    /// distance, so that edges stay sharp in pictures.
    pub fn outward(&self, (points, triangles): &Triangles) -> Vec<Vector3<f64>> {
        if matches!(self, Self::Sphere { .. } | Self::Capsule { .. }) {
            return points.iter().map(|point| self.near(point).normal).collect();
        }
        // Points that stand for one place are one.
        let bits = |x: &Vector3<f64>| [x.x, x.y, x.z].map(|c| (c + 0.0).to_bits());
        let mut sides = BTreeMap::<[u64; 3], (Matrix3<f64>, Vector3<f64>)>::new();
        for corners in triangles {
            let [a, b, c] = corners.map(|k| points[k as usize]);
            let Some(normal) = (b - a).cross(&(c - a)).try_normalize(0.0) else { continue };
            for corner in [a, b, c] {
                let (squares, sum) = sides.entry(bits(&corner)).or_default();
                *squares += normal * normal.transpose();
                *sum += normal;
            }
        }
        let way = |point: &Vector3<f64>| {
            let (squares, sum) = sides.get(&bits(point)).copied().unwrap_or_default();
            let inverse = squares.pseudo_inverse(1e-6 * squares.trace().max(f64::MIN_POSITIVE));
            inverse.map_or(Vector3::zeros(), |inverse| (inverse * sum).cap_magnitude(FARTHEST))
        };
        points.iter().map(way).collect()
    }
}

/// The surface of a profile of radii and heights, from the axis to the axis, around z.
fn revolved(profile: &[[f64; 2]]) -> Triangles {
    let mut points = Vec::new();
    let mut triangles = Vec::new();
    for &[radius, z] in profile {
        points.extend((0..AROUND).map(|k| {
            let angle = f64::from(k) * std::f64::consts::TAU / f64::from(AROUND);
            Vector3::new(radius * angle.cos(), radius * angle.sin(), z)
        }));
    }
    for ring in 1..profile.len() as u32 {
        for k in 0..AROUND {
            let [low, high] = [ring - 1, ring].map(|ring| [k, (k + 1) % AROUND].map(|k| ring * AROUND + k));
            let flat = |ring: u32| profile[ring as usize][0] < 1e-12;
            if !flat(ring - 1) {
                triangles.push([low[0], low[1], high[1]]);
            }
            if !flat(ring) {
                triangles.push([low[0], high[1], high[0]]);
            }
        }
    }
    (points, triangles)
}

/// A ball of a radius, from its centre.
fn around(from: Vector3<f64>, radius: f64) -> Near {
    let distance = from.norm();
    let normal = if distance > 0.0 { from / distance } else { Vector3::x() };
    Near { distance: distance - radius, normal }
}

/// Distance from a cylinder: from a rectangle of this width and half height, in the half-plane of the
/// distance from the axis and the height.
fn cylinder(point: &Vector3<f64>, radius: f64, half: f64) -> Near {
    let from_axis = Vector2::new(point.x, point.y);
    let q = from_axis.norm();
    let radial = if q > 0.0 { from_axis / q } else { Vector2::x() };
    let up = if point.z < 0.0 { -1.0 } else { 1.0 };
    let beyond = Vector2::new(q - radius, point.z.abs() - half);
    let outside = beyond.map(|x| x.max(0.0));
    let distance = outside.norm();
    let (distance, flat) = match distance > 0.0 {
        true => (distance, outside / distance),
        false if beyond.x > beyond.y => (beyond.x, Vector2::x()),
        false => (beyond.y, Vector2::y()),
    };
    Near { distance, normal: Vector3::new(radial.x * flat.x, radial.y * flat.x, up * flat.y) }
}

fn cuboid(point: &Vector3<f64>, half: &Vector3<f64>) -> Near {
    let beyond = point.abs() - half;
    let outside = beyond.map(|x| x.max(0.0));
    let distance = outside.norm();
    let signs = point.map(|x| if x < 0.0 { -1.0 } else { 1.0 });
    if distance > 0.0 {
        return Near { distance, normal: outside.component_mul(&signs) / distance };
    }
    let axis = beyond.imax();
    let mut normal = Vector3::zeros();
    normal[axis] = signs[axis];
    Near { distance: beyond[axis], normal }
}

/// Distance from a cone: from the nearest point of the base or of the slope, in the half-plane of the
/// distance from the axis and the height.
fn cone(point: &Vector3<f64>, radius: f64, height: f64) -> Near {
    let from_axis = Vector2::new(point.x, point.y);
    let q = Vector2::new(from_axis.norm(), point.z);
    let slope = Vector2::new(-radius, height);
    let on_base = Vector2::new(q.x.min(radius), 0.0);
    let along = ((q - Vector2::new(radius, 0.0)).dot(&slope) / slope.norm_squared()).clamp(0.0, 1.0);
    let on_slope = Vector2::new(radius, 0.0) + slope * along;
    let inside = q.y > 0.0 && q.x / radius + q.y / height < 1.0;
    let nearest = if (q - on_base).norm() < (q - on_slope).norm() { on_base } else { on_slope };
    let away = q - nearest;
    let distance = away.norm();
    let sign = if inside { -1.0 } else { 1.0 };
    let flat = match distance > 0.0 {
        true => away * (sign / distance),
        // On the surface: across the slope or down.
        false if nearest == on_base => Vector2::new(0.0, -1.0),
        false => Vector2::new(height, radius).normalize(),
    };
    let radial = if q.x > 0.0 { from_axis / q.x } else { Vector2::x() };
    Near { distance: sign * distance, normal: Vector3::new(radial.x * flat.x, radial.y * flat.x, flat.y) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::profile::Corner;
    use pliant_testing::Random;

    /// A body of revolution with flat ends, its edges rounded.
    fn barrel() -> Shape {
        let corner = |z: f64, r: f64, rounding: f64| Corner { at: [z, r], rounding };
        let corners = vec![
            corner(-0.4, 0.0, 0.0),
            corner(-0.4, 0.3, 0.1),
            corner(0.0, 0.5, 0.3),
            corner(0.5, 0.3, 0.1),
            corner(0.5, 0.0, 0.0),
        ];
        Shape::Revolved(Arc::new(Profile::new(corners).unwrap()))
    }

    /// Normals are the gradients of the distance, by central differences, and the distance along them changes
    /// as fast as they say.
    #[test]
    fn normals_are_gradients_of_the_distance() {
        let shapes = [
            Shape::Sphere { radius: 0.3 },
            Shape::Capsule { radius: 0.2, length: 0.7 },
            Shape::Cylinder { radius: 0.3, length: 0.8 },
            Shape::Cuboid { size: [0.5, 0.9, 0.4] },
            Shape::Cone { radius: 0.4, height: 0.6 },
            Shape::HalfSpace,
            barrel(),
        ];
        let mut random = Random::new(3);
        for shape in &shapes {
            let mut inside = 0;
            let mut rough = 0;
            for _ in 0..2000 {
                let point = Vector3::from_fn(|_, _| 2.0 * random.part() - 1.0);
                let near = shape.near(&point);
                inside += u32::from(near.distance < 0.0);
                let h = 1e-6;
                let slope = Vector3::from_fn(|c, _| {
                    let mut step = Vector3::zeros();
                    step[c] = h;
                    (shape.near(&(point + step)).distance - shape.near(&(point - step)).distance) / (2.0 * h)
                });
                assert!((near.normal.norm() - 1.0).abs() < 1e-12, "{shape:?} at {point}");
                // At an edge of the inner skeleton the distance has no gradient.
                rough += u32::from((slope - near.normal).norm() > 1e-4);
                let onto = point - near.normal * near.distance;
                assert!(
                    shape.near(&onto).distance.abs() < 1e-9 || near.distance < 0.0,
                    "{shape:?} at {point}"
                );
            }
            assert!(inside > 20 && rough < 5, "{shape:?}: {inside} inside, {rough} rough");
        }
    }

    /// A point inside is as far from the surface as from the nearest side; sides have continuous gradients,
    /// also at corners.
    #[test]
    fn the_nearest_side_is_as_far_as_the_surface() {
        let shapes = [
            Shape::Sphere { radius: 0.3 },
            Shape::Cylinder { radius: 0.3, length: 0.8 },
            Shape::Cuboid { size: [0.5, 0.9, 0.4] },
            Shape::Cone { radius: 0.4, height: 0.6 },
            barrel(),
        ];
        let mut random = Random::new(4);
        for shape in &shapes {
            let sides = |point: &Vector3<f64>| shape.sides(point).into_iter().flatten().collect::<Vec<_>>();
            let mut inside = 0;
            for _ in 0..2000 {
                let point = Vector3::from_fn(|_, _| random.part() - 0.5);
                let near = shape.near(&point);
                let found = sides(&point);
                if near.distance >= 0.0 {
                    continue;
                }
                inside += 1;
                let nearest = found.iter().map(|side| side.distance).fold(f64::NEG_INFINITY, f64::max);
                assert!((nearest - near.distance).abs() < 1e-12, "{shape:?} at {point}: {nearest}");
                let h = 1e-6;
                for (k, side) in found.iter().enumerate().filter(|(_, side)| side.distance > -0.05) {
                    for c in 0..3 {
                        let mut step = Vector3::zeros();
                        step[c] = h;
                        let [ahead, behind] = [point + step, point - step].map(|at| sides(&at)[k].distance);
                        let slope = (ahead - behind) / (2.0 * h);
                        assert!((slope - side.normal[c]).abs() < 1e-4, "{shape:?} at {point}, side {k}");
                    }
                }
            }
            assert!(inside > 20, "{shape:?}: {inside} inside");
        }
    }

    /// Points lie on the surface, and triangles face outward.
    #[test]
    fn drawn_surfaces_are_those_of_the_shapes() {
        for shape in [
            Shape::Sphere { radius: 0.3 },
            Shape::Capsule { radius: 0.2, length: 0.7 },
            Shape::Cylinder { radius: 0.3, length: 0.8 },
            Shape::Cuboid { size: [0.5, 0.9, 0.4] },
            Shape::Cone { radius: 0.4, height: 0.6 },
            Shape::HalfSpace,
            barrel(),
        ] {
            let (points, triangles) = shape.surface(1.0);
            assert!(!triangles.is_empty() && points.iter().all(|x| shape.near(x).distance.abs() < 1e-12));
            for corners in triangles {
                let [a, b, c] = corners.map(|k| points[k as usize]);
                let normal = (b - a).cross(&(c - a));
                let outward = shape.near(&((a + b + c) / 3.0 + 1e-3 * normal.normalize())).distance;
                let inward = shape.near(&((a + b + c) / 3.0 - 1e-3 * normal.normalize())).distance;
                assert!(outward > inward, "{shape:?}: {corners:?}");
            }
        }
    }

    /// A drawn surface that has grown lies on the larger shape. Its edges are excepted: pictures leave them
    /// sharp.
    #[test]
    fn drawn_surfaces_grow_outward() {
        let cylinder = Shape::Cylinder { radius: 0.3, length: 0.8 };
        let grown = |shape: &Shape, by: f64| {
            let surface = shape.surface(1.0);
            let outward = shape.outward(&surface);
            surface.0.iter().zip(outward).map(|(point, way)| point + way * by).collect::<Vec<_>>()
        };
        for (shape, larger) in [
            (Shape::Sphere { radius: 0.3 }, Shape::Sphere { radius: 0.35 }),
            (Shape::Capsule { radius: 0.2, length: 0.7 }, Shape::Capsule { radius: 0.25, length: 0.7 }),
            (Shape::Cuboid { size: [0.5, 0.9, 0.4] }, Shape::Cuboid { size: [0.6, 1.0, 0.5] }),
            (Shape::HalfSpace, Shape::HalfSpace),
        ] {
            let raised = if matches!(shape, Shape::HalfSpace) { 0.05 } else { 0.0 };
            let off = grown(&shape, 0.05)
                .iter()
                .map(|x| (larger.near(x).distance - raised).abs())
                .fold(0.0, f64::max);
            assert!(off < 1e-12, "{shape:?}: {off:e}");
        }
        // The 32 flat sides go out by as much as the round one.
        let larger = Shape::Cylinder { radius: 0.35, length: 0.9 };
        let off = grown(&cylinder, 0.05).iter().map(|x| larger.near(x).distance.abs()).fold(0.0, f64::max);
        assert!(off < 3e-4, "{off:e}");
    }

    #[test]
    fn distances_are_those_of_geometry() {
        let near = |shape: Shape, at: [f64; 3]| shape.near(&at.into());
        assert_eq!(near(Shape::Sphere { radius: 1.0 }, [0.0, 3.0, 4.0]).distance, 4.0);
        assert_eq!(near(Shape::Capsule { radius: 1.0, length: 4.0 }, [3.0, 0.0, 1.0]).distance, 2.0);
        assert_eq!(near(Shape::Capsule { radius: 1.0, length: 4.0 }, [0.0, 0.0, 5.0]).distance, 2.0);
        assert_eq!(near(Shape::Cuboid { size: [2.0, 2.0, 2.0] }, [4.0, 5.0, 0.0]).distance, 5.0);
        assert_eq!(near(Shape::Cuboid { size: [2.0, 2.0, 2.0] }, [0.25, 0.0, 0.0]).distance, -0.75);
        let cylinder = Shape::Cylinder { radius: 1.0, length: 4.0 };
        assert_eq!(near(cylinder.clone(), [3.0, 0.0, 1.0]).distance, 2.0);
        assert_eq!(near(cylinder.clone(), [0.5, 0.0, -4.0]).distance, 2.0);
        assert_eq!(near(cylinder.clone(), [0.0, 4.0, 6.0]).distance, 5.0);
        assert_eq!(near(cylinder.clone(), [0.25, 0.0, 0.0]).distance, -0.75);
        assert_eq!(near(cylinder, [0.0, 0.0, 1.5]).normal, Vector3::z());
        let cone = Shape::Cone { radius: 3.0, height: 4.0 };
        assert_eq!(near(cone.clone(), [0.0, 0.0, -2.0]).distance, 2.0);
        assert_eq!(near(cone.clone(), [0.0, 0.0, 6.0]).distance, 2.0);
        let side = near(cone, [3.0, 0.0, 4.0]);
        assert!((side.distance - 2.4).abs() < 1e-12 && (side.normal.x - 0.8).abs() < 1e-12);
    }
}
