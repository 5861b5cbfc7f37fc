//! A camera that orbits a point.

use nalgebra::{Matrix4, RowVector4, Vector4};
use pliant_geometry::Vector3;

/// An axis that points up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Axis {
    /// Along x.
    X,
    /// Along y.
    Y,
    /// Along z.
    #[default]
    Z,
    /// Against x.
    MinusX,
    /// Against y.
    MinusY,
    /// Against z.
    MinusZ,
}

impl Axis {
    /// Its word in `[view] camera.up`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
            Self::MinusX => "-x",
            Self::MinusY => "-y",
            Self::MinusZ => "-z",
        }
    }

    /// The axis nearest to a direction; z for a zero vector.
    pub fn nearest(direction: &Vector3) -> Self {
        let largest = direction.iamax();
        let negative = direction[largest] < 0.0;
        match (direction[largest] != 0.0, largest, negative) {
            (true, 0, false) => Self::X,
            (true, 0, true) => Self::MinusX,
            (true, 1, false) => Self::Y,
            (true, 1, true) => Self::MinusY,
            (true, 2, true) => Self::MinusZ,
            _ => Self::Z,
        }
    }

    /// The unit vector up, and two that complete it to a right-handed frame (front, left, up).
    fn frame(self) -> [Vector3; 3] {
        let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
        match self {
            Self::X => [y, z, x],
            Self::Y => [z, x, y],
            Self::Z => [x, y, z],
            Self::MinusX => [z, y, -x],
            Self::MinusY => [x, z, -y],
            Self::MinusZ => [y, x, -z],
        }
    }
}

/// Projection of depth to size.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Projection {
    /// Perspective: near objects are larger; 30° from top to bottom.
    #[default]
    Perspective,
    /// Parallel lines stay parallel.
    Orthographic,
}

/// Tangent of half the angle from top to bottom in perspective.
const SPREAD: f64 = 0.267_949_192_431_122_7;
/// Largest elevation [°]: at the pole itself left and right are undefined.
const STEEPEST: f64 = 89.9;
/// Room around a body that fits the picture.
const MARGIN: f64 = 1.10;

/// A camera on a sphere around its target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The target [m].
    pub target: Vector3,
    /// Angle around the axis that points up [°], from the front axis on.
    pub azimuth: f64,
    /// Angle above the horizon [°].
    pub elevation: f64,
    /// Height of the view at the target [m].
    pub height: f64,
    /// Projection of depth to size.
    pub projection: Projection,
    /// The up axis.
    pub up: Axis,
}

impl Default for Camera {
    fn default() -> Self {
        Self {
            target: Vector3::zeros(),
            azimuth: -55.0,
            elevation: 22.0,
            height: 1.0,
            projection: Projection::default(),
            up: Axis::default(),
        }
    }
}

impl Camera {
    /// From a direction, with an axis up.
    pub fn looking(towards: &Vector3, up: Axis) -> Self {
        let [front, left, above] = up.frame().map(|axis| axis.dot(towards));
        let elevation = above.atan2(front.hypot(left)).to_degrees().clamp(-STEEPEST, STEEPEST);
        Self { azimuth: left.atan2(front).to_degrees(), elevation, up, ..Self::default() }
    }

    /// Unit vectors right, up and towards the camera.
    pub fn axes(&self) -> [Vector3; 3] {
        let [front, left, up] = self.up.frame();
        let (azimuth, elevation) = (self.azimuth.to_radians(), self.elevation.to_radians());
        let level = front * azimuth.cos() + left * azimuth.sin();
        let towards = level * elevation.cos() + up * elevation.sin();
        let right = left * azimuth.cos() - front * azimuth.sin();
        [right, towards.cross(&right), towards]
    }

    /// From the target to the eye [m]; where all eyes see alike, far enough.
    pub fn distance(&self) -> f64 {
        0.5 * self.height / SPREAD
    }

    /// Returns the position of the eye [m].
    pub fn eye(&self) -> Vector3 {
        self.target + self.axes()[2] * self.distance()
    }

    /// Turns by angles [°].
    pub fn orbit(&mut self, azimuth: f64, elevation: f64) {
        self.azimuth = (self.azimuth + azimuth).rem_euclid(360.0);
        self.elevation = (self.elevation + elevation).clamp(-STEEPEST, STEEPEST);
    }

    /// Moves the view by fractions of the picture height to the right and up.
    pub fn pan(&mut self, right: f64, up: f64) {
        let [x, y, _] = self.axes();
        self.target -= (x * right + y * up) * self.height;
    }

    /// Zooms: a factor below 1 moves nearer.
    pub fn zoom(&mut self, factor: f64) {
        self.height = (self.height * factor).clamp(1e-9, 1e9);
    }

    /// Looks at all finite points, for a picture of this ratio of width to height (`aspect`).
    pub fn fit<'p>(&mut self, points: impl IntoIterator<Item = &'p Vector3>, aspect: f64) {
        let axes = self.axes();
        let seen: Vec<Vector3> = (points.into_iter())
            .filter(|point| point.iter().all(|x| x.is_finite()))
            .map(|point| Vector3::from(axes.map(|axis| axis.dot(point))))
            .collect();
        let Some(first) = seen.first() else { return };
        let (low, high) = seen.iter().fold((*first, *first), |(low, high), p| (low.inf(p), high.sup(p)));
        let mut centre = 0.5 * (low + high);
        // In perspective a few iterations find the middle of the view: near objects reach further out.
        for _ in 0..8 {
            let height = self.needed(&seen, &centre, aspect);
            self.height = height * MARGIN;
            if self.projection == Projection::Orthographic {
                break;
            }
            let distance = self.distance();
            let (mut least, mut most) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
            for point in &seen {
                let scale = distance / (distance - (point.z - centre.z)).max(1e-3 * distance);
                for c in 0..2 {
                    let at = (point[c] - centre[c]) * scale;
                    (least[c], most[c]) = (least[c].min(at), most[c].max(at));
                }
            }
            for c in 0..2 {
                centre[c] += 0.5 * (least[c] + most[c]);
            }
        }
        self.target = axes[0] * centre.x + axes[1] * centre.y + axes[2] * centre.z;
        if self.height < 1e-9 {
            self.height = 1e-3;
        }
    }

    /// The height at the target that shows all points, given in the camera's axes.
    fn needed(&self, seen: &[Vector3], centre: &Vector3, aspect: f64) -> f64 {
        let half = seen.iter().map(|point| {
            let [x, y, z] = (point - centre).into();
            let across = y.abs().max(x.abs() / aspect);
            match self.projection {
                Projection::Orthographic => across,
                Projection::Perspective => across + z * SPREAD,
            }
        });
        2.0 * half.fold(0.0, f64::max)
    }

    /// Returns the matrix from space to clip space, for a picture with this ratio of width to height. Objects
    /// lie within a distance of the target [m]. Depth increases from 0 near to 1 far.
    pub(crate) fn projection_view(&self, aspect: f64, reach: f64) -> Matrix4<f32> {
        let [x, y, z] = self.axes();
        let eye = self.eye();
        let row = |axis: Vector3| Vector4::new(axis.x, axis.y, axis.z, -axis.dot(&eye)).transpose();
        let view = Matrix4::from_rows(&[row(x), row(y), row(z), Vector4::w().transpose()]);
        let distance = self.distance();
        let far = distance + reach;
        // The camera may be inside the objects.
        let (near, scale) = match self.projection {
            Projection::Perspective => ((distance - reach).max(0.01 * distance), 1.0 / SPREAD),
            Projection::Orthographic => (distance - reach, 2.0 / self.height),
        };
        let depth = 1.0 / (far - near);
        let (depths, divisor) = match self.projection {
            Projection::Perspective => ([0.0, 0.0, -far * depth, -far * near * depth], [0.0, 0.0, -1.0, 0.0]),
            Projection::Orthographic => ([0.0, 0.0, -depth, -near * depth], [0.0, 0.0, 0.0, 1.0]),
        };
        let rows = [[scale / aspect, 0.0, 0.0, 0.0], [0.0, scale, 0.0, 0.0], depths, divisor];
        let projection = Matrix4::from_rows(&rows.map(RowVector4::from));
        (projection * view).cast()
    }

    /// Returns the point and the unit direction of the ray through a place of the picture. The coordinates
    /// are x to the right and y up, from −1 to 1.
    pub fn ray(&self, [x, y]: [f64; 2], aspect: f64) -> (Vector3, Vector3) {
        let [right, up, towards] = self.axes();
        let across = (right * (x * aspect) + up * y) * (0.5 * self.height);
        match self.projection {
            Projection::Perspective => {
                let eye = self.eye();
                (eye, (self.target + across - eye).normalize())
            }
            Projection::Orthographic => (self.eye() + across, -towards),
        }
    }

    /// The place of a point in the picture: x to the right and y up, from −1 to 1; `None` behind the eye.
    pub fn place(&self, point: &Vector3, aspect: f64) -> Option<[f64; 2]> {
        let from = point - self.target;
        let [x, y, z] = self.axes().map(|axis| axis.dot(&from));
        let scale = match self.projection {
            Projection::Orthographic => 1.0,
            Projection::Perspective => {
                let distance = self.distance();
                if z >= 0.999 * distance {
                    return None;
                }
                distance / (distance - z)
            }
        };
        let unit = 2.0 * scale / self.height;
        Some([x * unit / aspect, y * unit])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Axis; 6] = [Axis::X, Axis::Y, Axis::Z, Axis::MinusX, Axis::MinusY, Axis::MinusZ];

    fn corners() -> Vec<Vector3> {
        (0..8)
            .map(|i| Vector3::new(f64::from(i & 1), f64::from(i >> 1 & 1) * 2.0, f64::from(i >> 2) * 0.3))
            .collect()
    }

    #[test]
    fn a_camera_looks_from_where_it_was_told() {
        for up in ALL {
            let from = Vector3::new(0.3, -0.8, 0.5);
            let [_, _, towards] = Camera::looking(&from, up).axes();
            assert!((towards - from.normalize()).norm() < 1e-12, "{up:?}");
        }
    }

    #[test]
    fn axes_are_right_handed_and_up_is_up() {
        for up in ALL {
            let [front, left, above] = up.frame();
            assert!((front.cross(&left) - above).norm() < 1e-15, "{up:?}");
            let camera = Camera { up, ..Camera::default() };
            let [x, y, z] = camera.axes();
            assert!((x.cross(&y) - z).norm() < 1e-12 && x.dot(&above).abs() < 1e-12 && y.dot(&above) > 0.5);
            assert_eq!(Axis::nearest(&above), up);
        }
    }

    #[test]
    fn what_fits_lies_within_the_picture_and_touches_its_margin() {
        for projection in [Projection::Perspective, Projection::Orthographic] {
            for aspect in [0.5, 1.0, 1.6] {
                let mut camera = Camera { projection, ..Camera::default() };
                camera.fit(&corners(), aspect);
                let places: Vec<[f64; 2]> =
                    corners().iter().map(|point| camera.place(point, aspect).unwrap()).collect();
                let reach = places.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
                assert!(reach < 1.0 && reach > 0.8, "{projection:?} {aspect}: {reach}");
            }
        }
    }

    #[test]
    fn rays_go_through_what_is_placed_and_matrices_agree() {
        for projection in [Projection::Perspective, Projection::Orthographic] {
            let mut camera = Camera { projection, up: Axis::Y, ..Camera::default() };
            camera.fit(&corners(), 1.6);
            for point in corners() {
                let place = camera.place(&point, 1.6).unwrap();
                let (from, along) = camera.ray(place, 1.6);
                assert!((point - from).cross(&along).norm() < 1e-9);
                let clip = camera.projection_view(1.6, 3.0)
                    * Vector4::new(point.x, point.y, point.z, 1.0).cast::<f32>();
                assert!((f64::from(clip.x / clip.w) - place[0]).abs() < 1e-5);
                assert!((f64::from(clip.y / clip.w) - place[1]).abs() < 1e-5);
                assert!((0.0..=1.0).contains(&(clip.z / clip.w)));
            }
        }
    }

    #[test]
    fn orbits_end_at_the_poles_and_points_that_are_not_finite_are_ignored() {
        let mut camera = Camera::default();
        camera.orbit(0.0, 500.0);
        assert!(camera.axes()[0].norm() > 0.99 && camera.elevation < 90.0);
        let before = camera;
        camera.fit(&[Vector3::repeat(f64::NAN)], 1.0);
        assert_eq!(camera, before);
    }
}
