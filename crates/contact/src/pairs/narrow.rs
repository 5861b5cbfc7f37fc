//! Place of a point relative to a triangle, and crossing of two edges; narrow.wgsl is the twin for devices.

use nalgebra::Vector3;
use pliant_geometry::barycentric_of_closest;

/// The square of the sine between two edges up to which they count as parallel.
pub(crate) const PARALLEL: f64 = 1e-6;
/// The sine of the angle by which the triangles of an edge may be bent inward and still count as flat.
pub(crate) const FLAT: f64 = 1e-6;

/// An edge with the opposite nodes of its triangles. The first belongs to the triangle that has the ends in
/// this order, the second to the other triangle. At a border both are the same node.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    /// Its ends.
    pub ends: [u32; 2],
    /// The nodes across.
    pub across: [u32; 2],
}

impl Edge {
    /// The sum of the outward normals of its triangles.
    fn outward(&self, place: &impl Fn(u32) -> Vector3<f64>) -> Vector3<f64> {
        let [a, b] = self.ends.map(place);
        let [left, right] = self.across.map(place);
        let normal = |to: Vector3<f64>| (b - a).cross(&to).try_normalize(0.0).unwrap_or_default();
        let other = if self.across[0] == self.across[1] { Vector3::zeros() } else { normal(a - right) };
        normal(left - a) + other
    }
}

/// True if a point is farther than a distance [m] from the plane of a triangle.
#[inline]
pub(super) fn is_beyond(within: f64, [a, b, c]: &[Vector3<f64>; 3], point: &Vector3<f64>) -> bool {
    let area = (b - a).cross(&(c - a));
    let height = area.dot(&(point - a));
    height * height > within * within * area.norm_squared()
}

/// A point and a triangle.
pub(super) struct Above {
    pub normal: Vector3<f64>,
    /// Height [m] over the plane.
    pub height: f64,
    /// Weights of the point beneath, or of the closest point of the triangle if the point is far beside the
    /// triangle.
    pub weights: [f64; 3],
    /// The way [m] from there.
    pub way: Vector3<f64>,
    /// True if the point is above or beneath the triangle.
    pub is_inner: bool,
}

impl Above {
    /// Finds the place of a point relative to a triangle. Points beside the triangle by up to `beside` of its
    /// height count as inner ones.
    #[inline]
    pub fn of(corners: &[Vector3<f64>; 3], point: &Vector3<f64>, beside: f64) -> Self {
        let [a, b, c] = corners;
        let area = (b - a).cross(&(c - a));
        let normal = area.try_normalize(0.0).unwrap_or_default();
        let height = normal.dot(&(point - a));
        let part = |from: &Vector3<f64>, to: &Vector3<f64>| {
            area.dot(&(from - point).cross(&(to - point))) / area.norm_squared()
        };
        let weights = [part(b, c), part(c, a), part(a, b)];
        if weights.iter().all(|&weight| weight >= -beside) {
            return Self { normal, height, weights, way: normal * height, is_inner: true };
        }
        let weights = barycentric_of_closest(corners, point);
        let way = point - (a * weights[0] + b * weights[1] + c * weights[2]);
        Self { normal, height, weights, way, is_inner: false }
    }

    /// True if the point counts as inner though it is a little beside the triangle.
    pub fn is_beside(&self) -> bool {
        self.is_inner && self.weights.iter().any(|&weight| weight < 0.0)
    }

    pub fn distance(&self) -> f64 {
        self.way.norm()
    }
}

/// True if a way leads along a normal, or hardly against it. Bodies that touch press each other flat, and
/// round-off must not decide in a flat contact.
#[inline]
fn is_before(normal: &Vector3<f64>, way: &Vector3<f64>) -> bool {
    normal.dot(way) >= -FLAT * way.norm()
}

/// Two edges whose closest points are within both and touch from outside.
pub(super) struct Across {
    /// Place of the closest point on each edge, from 0 to 1.
    pub weights: [f64; 2],
    pub normal: Vector3<f64>,
    pub distance: f64,
}

impl Across {
    /// Finds the crossing of two edges, if they are no farther apart than a distance [m].
    pub fn of(
        [first, second]: [&Edge; 2],
        within: f64,
        place: &impl Fn(u32) -> Vector3<f64>,
    ) -> Option<Self> {
        let ([a, b], [c, d]) = (first.ends.map(place), second.ends.map(place));
        let (along, other, between) = (b - a, d - c, a - c);
        let normal = along.cross(&other);
        let [aa, bb, ab] = [along.norm_squared(), other.norm_squared(), along.dot(&other)];
        let crossed = normal.norm_squared();
        // Edges that are nearly parallel touch at their ends.
        if crossed <= PARALLEL * aa * bb {
            return None;
        }
        let [da, db] = [along.dot(&between), other.dot(&between)];
        let weights = [(ab * db - bb * da) / crossed, (aa * db - ab * da) / crossed];
        if weights.iter().any(|weight| !(0.0..=1.0).contains(weight)) {
            return None;
        }
        let normal = normal / crossed.sqrt();
        if normal.dot(&between).abs() > within {
            return None;
        }
        // The normal leads out of the second and into the first, whose triangles are all behind it or before
        // it.
        let normal = if normal.dot(&second.outward(place)) < 0.0 { -normal } else { normal };
        let behind = second.across.iter().all(|&node| is_before(&-normal, &(place(node) - c)));
        let before = first.across.iter().all(|&node| is_before(&normal, &(place(node) - a)));
        if normal.dot(&first.outward(place)) >= 0.0 || !behind || !before {
            return None;
        }
        let distance = normal.dot(&between);
        // An overlap may exceed the length by which one edge continues past the crossing. The edges then
        // separate past its end.
        let [s, t] = weights;
        let beyond = (s.min(1.0 - s) * aa.sqrt()).min(t.min(1.0 - t) * bb.sqrt());
        (distance > -beyond).then_some(Self { weights, normal, distance })
    }
}
