//! Places of rigid things over time.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use pliant_mechanics::curve::Curve;
use serde::{Deserialize, Serialize};

/// A position and an orientation.
pub type Pose = Isometry3<f64>;

/// Pose of a rigid thing, and its growth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stance {
    /// Pose of its frame.
    pub pose: Pose,
    /// Distance [m] that its surface has grown outside the surface of its shape.
    pub growth: f64,
}

impl Stance {
    /// At a pose, as large as its shape.
    pub fn at(pose: Pose) -> Self {
        Self { pose, growth: 0.0 }
    }

    /// After a part of the way from one to another.
    pub fn between([from, to]: [&Self; 2], part: f64) -> Self {
        let pose = between([&from.pose, &to.pose], part);
        Self { pose, growth: from.growth + (to.growth - from.growth) * part }
    }
}

/// Motion and growth of a rigid thing over time.
#[derive(Clone, Debug)]
pub struct Trajectory {
    /// Pose at the start.
    start: Pose,
    motion: Motion,
    /// A distance [m] by which its surface moves outward as a curve goes.
    growth: Option<(f64, Curve)>,
    /// The force [N] that it pushes with at most.
    limit: Option<f64>,
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

impl Trajectory {
    fn of(start: Pose, motion: Motion) -> Self {
        Self { start, motion, growth: None, limit: None }
    }

    /// Returns the trajectory with a surface that moves outward by a distance [m] as a curve goes from 0
    /// to 1.
    pub fn growing(self, by: f64, curve: Curve) -> Self {
        Self { growth: Some((by, curve)), ..self }
    }

    /// Distance [m] that the surface has moved outward at a time [s].
    pub fn growth(&self, time: f64) -> f64 {
        self.growth.as_ref().map_or(0.0, |(by, curve)| by * curve.value(time))
    }

    /// True if the surface moves outward or inward.
    pub fn grows(&self) -> bool {
        self.growth.is_some()
    }

    /// Returns the trajectory with the largest force [N] that the thing pushes with. Where the thing would
    /// need more, it lags behind its trajectory.
    pub fn limited(self, force: f64) -> Self {
        Self { limit: Some(force), ..self }
    }

    /// The force [N] that the thing pushes with at most.
    pub fn limit(&self) -> Option<f64> {
        self.limit
    }

    /// At rest.
    pub fn fixed(start: Pose) -> Self {
        Self::of(start, Motion::Fixed)
    }

    /// Shifted by a vector [m] as a curve goes from 0 to 1.
    pub fn by(start: Pose, shift: [f64; 3], curve: Curve) -> Self {
        Self::of(start, Motion::By(shift.into(), curve))
    }

    /// Turned about an axis (of length 1) through a point [m] by an angle [rad] as a curve goes from 0 to 1.
    pub fn turn(start: Pose, axis: [f64; 3], centre: [f64; 3], angle: f64, curve: Curve) -> Self {
        let (axis, centre) = (axis.into(), centre.into());
        Self::of(start, Motion::Turn { axis, centre, angle, curve })
    }

    /// Poses at increasing times [s], before the start pose: the thing stays at the first one before and at
    /// the last one after. `None` without any, or where times do not increase.
    pub fn table(start: Pose, poses: Vec<(f64, Pose)>) -> Option<Self> {
        let increase = poses.windows(2).all(|pair| pair[0].0 < pair[1].0);
        (increase && !poses.is_empty()).then_some(Self::of(start, Motion::Table(poses)))
    }

    /// True if the thing moves or grows at any time.
    pub fn moves(&self) -> bool {
        self.grows() || !matches!(self.motion, Motion::Fixed)
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
                let after = poses.partition_point(|&(moment, _)| moment <= time);
                let pose = match (after.checked_sub(1).map(|before| poses[before]), poses.get(after)) {
                    (Some((from, a)), Some((to, b))) => between([&a, b], (time - from) / (to - from)),
                    (Some((_, only)), None) => only,
                    (None, Some(&(_, first))) => first,
                    (None, None) => Pose::identity(),
                };
                pose * self.start
            }
        }
    }
}

/// Returns the pose after a part of the straight way and the shortest arc from one pose to another.
pub fn between([from, to]: [&Pose; 2], part: f64) -> Pose {
    let place = from.translation.vector.lerp(&to.translation.vector, part);
    let turn = from.rotation.try_slerp(&to.rotation, part, 1e-12).unwrap_or(to.rotation);
    Pose::from_parts(place.into(), turn)
}

/// Way of a tool that is driven from outside. Its pose moves on a straight way and the shortest arc, and the
/// angle between its jaws changes evenly. At the goal it stays. Pose and angle have a way each; without one,
/// they follow the trajectory.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Leg {
    /// Positions [m] and unit quaternions (i, j, k, w).
    pose: Option<Way<([f64; 3], [f64; 4])>>,
    /// Angles [rad] between jaws.
    opening: Option<Way<f64>>,
}

/// A way from one value to another.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Way<T> {
    /// Times [s] at which the way begins and ends.
    times: [f64; 2],
    ends: [T; 2],
}

impl<T> Way<T> {
    /// The part of the way done at a time [s], from 0 to 1.
    fn part(&self, time: f64) -> f64 {
        let [from, to] = self.times;
        if to > from { ((time - from) / (to - from)).clamp(0.0, 1.0) } else { 1.0 }
    }
}

impl Leg {
    /// Makes a leg from one pose to another between two times [s].
    pub fn to_pose(times: [f64; 2], poses: [Pose; 2]) -> Self {
        let plain = |pose: Pose| (pose.translation.vector.into(), pose.rotation.coords.into());
        Self { pose: Some(Way { times, ends: poses.map(plain) }), opening: None }
    }

    /// Makes a leg from one angle [rad] between jaws to another between two times [s].
    pub fn to_opening(times: [f64; 2], angles: [f64; 2]) -> Self {
        Self { pose: None, opening: Some(Way { times, ends: angles }) }
    }

    /// Returns the leg with the missing ways taken from `before`.
    pub fn or(self, before: &Self) -> Self {
        Self { pose: self.pose.or(before.pose), opening: self.opening.or(before.opening) }
    }

    /// The pose at a time [s], if it has a way.
    pub fn pose(&self, time: f64) -> Option<Pose> {
        self.pose.as_ref().map(|way| {
            let poses = way.ends.map(|(place, turn)| {
                let turn = UnitQuaternion::new_unchecked(Quaternion::from_vector(turn.into()));
                Pose::from_parts(place.into(), turn)
            });
            between([&poses[0], &poses[1]], way.part(time))
        })
    }

    /// The angle [rad] between jaws at a time [s], if it has a way.
    pub fn opening(&self, time: f64) -> Option<f64> {
        self.opening.as_ref().map(|way| {
            let [from, to] = way.ends;
            from + (to - from) * way.part(time)
        })
    }

    /// True if all numbers are finite.
    pub fn is_finite(&self) -> bool {
        let poses = self.pose.iter().flat_map(|way| {
            let of_poses = way.ends.iter().flat_map(|(place, turn)| place.iter().chain(turn));
            of_poses.chain(&way.times)
        });
        let openings = self.opening.iter().flat_map(|way| way.ends.iter().chain(&way.times));
        poses.chain(openings).all(|x| x.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pliant_mechanics::curve::Shape;

    fn place(trajectory: &Trajectory, time: f64) -> Vector3<f64> {
        trajectory.at(time).translation.vector
    }

    #[test]
    fn courses_are_where_their_curves_and_tables_say() {
        let start = Pose::translation(1.0, 0.0, 0.0);
        let curve = Curve { shape: Shape::Ramp, from: 0.0, to: 2.0 };
        assert_eq!(
            place(&Trajectory::by(start, [0.0, 4.0, 0.0], curve.clone()), 1.0),
            Vector3::new(1.0, 2.0, 0.0)
        );
        let quarter = Trajectory::turn(start, [0.0, 0.0, 1.0], [0.0; 3], std::f64::consts::PI, curve);
        assert!((place(&quarter, 1.0) - Vector3::y()).norm() < 1e-15);
        let turned = Pose::rotation(Vector3::z() * 1.0);
        let table = vec![(1.0, Pose::identity()), (3.0, Pose::translation(0.0, 0.0, 2.0) * turned)];
        let trajectory = Trajectory::table(start, table.clone()).unwrap();
        assert_eq!(place(&trajectory, 0.0), Vector3::x());
        assert!((place(&trajectory, 2.0) - Vector3::new(0.5_f64.cos(), 0.5_f64.sin(), 1.0)).norm() < 1e-15);
        assert_eq!(place(&trajectory, 9.0), place(&trajectory, 3.0));
        let leg = Leg::to_pose([1.0, 3.0], [table[0].1, table[1].1]);
        let pose = leg.pose(2.0).unwrap();
        assert!((pose.inverse() * trajectory.at(2.0) * start.inverse()).translation.vector.norm() < 1e-15);
        assert!(leg.pose(0.0) == leg.pose(1.0) && leg.pose(9.0) == leg.pose(3.0));
        let both = Leg::to_opening([2.0, 4.0], [0.5, 0.1]).or(&leg);
        assert!((both.opening(3.0).unwrap() - 0.3).abs() < 1e-15 && both.pose(2.0) == Some(pose));
        assert!(Trajectory::table(start, Vec::new()).is_none());
        assert!(Trajectory::table(start, table.into_iter().rev().collect()).is_none());
    }
}
