//! Poses and helpers for tests of several files.

use nalgebra::Vector3;

use crate::rotation::exponential;

/// Corners and normals of a curved triangle.
pub(crate) type Pose = ([Vector3<f64>; 3], [Vector3<f64>; 3]);

/// A pose with one of its eighteen numbers changed. Each corner has six: three of the position [m] and three
/// of a turn of the normal [rad].
pub(crate) fn moved((p, n): &Pose, place: usize, by: f64) -> Pose {
    let (mut p, mut n) = (*p, *n);
    let mut change = Vector3::zeros();
    change[place % 3] = by;
    if place % 6 < 3 {
        p[place / 6] += change;
    } else {
        n[place / 6] = exponential(&change) * n[place / 6];
    }
    (p, n)
}
