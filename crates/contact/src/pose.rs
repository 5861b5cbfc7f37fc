//! Where rigid things are over time.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use pliant_mechanics::curve::Curve;

/// A position and an orientation.
pub type Pose = Isometry3<f64>;

/// How a rigid thing moves.
#[derive(Clone, Debug)]
pub struct Course {
    /// Where it is at the start.
    start: Pose,
    motion: Motion,
}

#[derive(Clone, Debug)]
enum Motion {
    Fixed,
    /// By a vector [m] as a curve goes.
    By(Vector3<f64>, Curve),
    /// About an axis through a point by an angle [rad] as a curve goes.
    Turn {
        axis: Vector3<f64>,
        centre: Vector3<f64>,
        angle: f64,
        curve: Curve,
    },
    /// Poses at increasing times [s], in between on a straight way and the shortest arc.
    Table(Vec<(f64, Pose)>),
}

impl Course {
    /// At rest.
    pub fn fixed(start: Pose) -> Self {
        Self { start, motion: Motion::Fixed }
    }

    /// Shifted by a vector [m] as a curve goes from 0 to 1.
    pub fn by(start: Pose, shift: [f64; 3], curve: Curve) -> Self {
        Self { start, motion: Motion::By(shift.into(), curve) }
    }

    /// Turned about an axis (of length 1) through a point [m] by an angle [rad] as a curve goes from 0 to 1.
    pub fn turn(start: Pose, axis: [f64; 3], centre: [f64; 3], angle: f64, curve: Curve) -> Self {
        let (axis, centre) = (axis.into(), centre.into());
        Self { start, motion: Motion::Turn { axis, centre, angle, curve } }
    }

    /// Poses at increasing times [s], before the start pose: the thing stays at the first one before and at the last one after.
    /// `None` without any, or where times do not increase.
    pub fn table(start: Pose, poses: Vec<(f64, Pose)>) -> Option<Self> {
        let increase = poses.windows(2).all(|pair| pair[0].0 < pair[1].0);
        (increase && !poses.is_empty()).then_some(Self { start, motion: Motion::Table(poses) })
    }

    /// The pose at a time [s].
    pub fn at(&self, time: f64) -> Pose {
        match &self.motion {
            Motion::Fixed => self.start,
            Motion::By(shift, curve) => Translation3::from(shift * curve.value(time)) * self.start,
            Motion::Turn { axis, centre, angle, curve } => {
                let turn = UnitQuaternion::from_scaled_axis(axis * (angle * curve.value(time)));
                let back = Translation3::from(*centre) * turn * Translation3::from(-centre);
                back * self.start
            }
            Motion::Table(poses) => {
                let after = poses.partition_point(|&(own, _)| own <= time);
                let pose = match (after.checked_sub(1).map(|before| poses[before]), poses.get(after)) {
                    (Some((from, a)), Some((to, b))) => {
                        let part = (time - from) / (to - from);
                        let place = a.translation.vector.lerp(&b.translation.vector, part);
                        let turn = a.rotation.try_slerp(&b.rotation, part, 1e-12).unwrap_or(b.rotation);
                        Pose::from_parts(place.into(), turn)
                    }
                    (Some((_, only)), None) => only,
                    (None, Some(&(_, first))) => first,
                    (None, None) => Pose::identity(),
                };
                pose * self.start
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pliant_mechanics::curve::Shape;

    fn place(course: &Course, time: f64) -> Vector3<f64> {
        course.at(time).translation.vector
    }

    #[test]
    fn courses_are_where_their_curves_and_tables_say() {
        let start = Pose::translation(1.0, 0.0, 0.0);
        let curve = Curve { shape: Shape::Ramp, from: 0.0, to: 2.0 };
        assert_eq!(
            place(&Course::by(start, [0.0, 4.0, 0.0], curve.clone()), 1.0),
            Vector3::new(1.0, 2.0, 0.0)
        );
        let quarter = Course::turn(start, [0.0, 0.0, 1.0], [0.0; 3], std::f64::consts::PI, curve);
        assert!((place(&quarter, 1.0) - Vector3::y()).norm() < 1e-15);
        let turned = Pose::rotation(Vector3::z() * 1.0);
        let table = vec![(1.0, Pose::identity()), (3.0, Pose::translation(0.0, 0.0, 2.0) * turned)];
        let course = Course::table(start, table.clone()).unwrap();
        assert_eq!(place(&course, 0.0), Vector3::x());
        assert!((place(&course, 2.0) - Vector3::new(0.5_f64.cos(), 0.5_f64.sin(), 1.0)).norm() < 1e-15);
        assert_eq!(place(&course, 9.0), place(&course, 3.0));
        assert!(Course::table(start, Vec::new()).is_none());
        assert!(Course::table(start, table.into_iter().rev().collect()).is_none());
    }
}
