//! The least correction of a node that would go into a rigid surface: along the normal to the surface, then against sliding by the cone of
//! friction. With the predicted place x*, the mobility w = ∂x/∂f of each component and the gap g = d(x*) − offset < 0,
//! λ = −g / Σ w n², x* += w n λ; the slip d over the step, less that of the surface, is taken back by a force of at most μ λ. The force on the
//! node is the correction over its mobility: a step with this force is perfectly plastic along the normal, keeps momentum, and leaves the
//! critical time step as it is.

use nalgebra::{Matrix3, Point3, Vector3};
use pliant_mechanics::tensor::Vector;

use crate::pairs::Surface;
use crate::pose::{Course, Pose};
use crate::shape::{Near, Shape};

/// Parts of a step at most that a fast thing is followed through.
const MOST_PARTS: f64 = 64.0;

/// A rigid thing: an obstacle or a tool.
#[derive(Clone, Debug)]
pub struct Rigid {
    /// Its name.
    pub name: String,
    /// Its shape.
    pub shape: Shape,
    /// How it moves.
    pub course: Course,
    /// Whether bodies are inside of it, as a brain in its skull.
    pub inside: bool,
}

impl Rigid {
    /// The distance of a point [m] from where it is free of the thing, and the direction there, at a pose.
    pub fn near(&self, pose: &Pose, point: &Vector3<f64>) -> Near {
        let local = pose.inverse_transform_point(&(*point).into());
        let Near { distance, normal } = self.near_local(&local.coords);
        Near { distance, normal: pose.rotation * normal }
    }

    /// [`near`](Self::near) in the frame of the thing.
    fn near_local(&self, point: &Vector3<f64>) -> Near {
        let Near { distance, normal } = self.shape.near(point);
        let sign = if self.inside { -1.0 } else { 1.0 };
        Near { distance: sign * distance, normal: normal * sign }
    }

    /// Into how many parts a step between two times [s] is divided so that nothing is passed over: each moves the thing by half of its
    /// thinnest part at most.
    fn parts(&self, [from, to]: [Pose; 2]) -> usize {
        (2.0 * travel(self, &[from, to]) / self.shape.thinnest()).ceil().clamp(1.0, MOST_PARTS) as usize
    }
}

/// The largest way [m] of a point of a thing from one pose to another.
fn travel(rigid: &Rigid, [from, to]: &[Pose; 2]) -> f64 {
    let turned = from.rotation.angle_to(&to.rotation) * rigid.shape.reach();
    (to.translation.vector - from.translation.vector).norm() + turned
}

/// How bodies touch rigid things.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// Coulomb's coefficient μ.
    pub friction: f64,
    /// Distance [m] that nodes keep from the surface.
    pub offset: f64,
}

impl Touch {
    /// Where a node goes in the step between two times [s] that is predicted to go from `now` to `predicted` [m]; `None` where it is free.
    /// `mobility` [m/N] is that of each component, zero of those that are held.
    pub fn correct(
        &self,
        rigid: &Rigid,
        times: [f64; 2],
        now: Vector<f64>,
        predicted: Vector<f64>,
        mobility: Vector<f64>,
    ) -> Option<Vector<f64>> {
        let passage = Passage::new(rigid, times);
        let place = self.pass(rigid, &passage, &now.into(), &predicted.into(), &mobility.into())?;
        Some(place.into())
    }

    /// [`correct`](Self::correct) of a step whose poses are known.
    pub fn pass(
        &self,
        rigid: &Rigid,
        passage: &Passage,
        now: &Vector3<f64>,
        predicted: &Vector3<f64>,
        mobility: &Vector3<f64>,
    ) -> Option<Vector3<f64>> {
        let mut shift = Vector3::zeros();
        for part in 1..=passage.parts {
            let share = part as f64 / passage.parts as f64;
            let pose = passage.at(rigid, part);
            let place = now.lerp(predicted, share) + shift;
            let Near { distance, normal } = rigid.near(&pose, &place);
            let gap = distance - self.offset;
            let along = mobility.component_mul(&normal);
            let mobility_along = along.dot(&normal);
            if gap >= 0.0 || mobility_along <= 0.0 {
                continue;
            }
            let push = -gap / mobility_along;
            let lifted = place + along * push;
            // What the surface carries along.
            let carried = passage.poses[0].inverse_transform_point(&(*now).into());
            let slip = lifted - (pose * carried).coords;
            let slip = slip - normal * slip.dot(&normal);
            let length = slip.norm();
            let mut place_now = lifted;
            if self.friction > 0.0 && length > 0.0 {
                let back = slip / length;
                let against = mobility.component_mul(&back);
                let mobility_back = against.dot(&back);
                if mobility_back > 0.0 {
                    place_now -= against * (self.friction * push).min(length / mobility_back);
                }
            }
            shift += place_now - place;
        }
        (shift != Vector3::zeros()).then(|| predicted + shift)
    }
}

/// The way of a rigid thing in a step.
#[derive(Clone, Debug)]
pub struct Passage {
    /// Its poses before and after.
    poses: [Pose; 2],
    /// How its frame is turned after.
    turn: Matrix3<f64>,
    /// The motion from the pose before to that after.
    motion: Pose,
    parts: usize,
    times: [f64; 2],
}

impl Passage {
    /// In the step between two times [s].
    pub fn new(rigid: &Rigid, times: [f64; 2]) -> Self {
        let poses = times.map(|time| rigid.course.at(time));
        let [before, after] = poses;
        let turn = after.rotation.to_rotation_matrix().into_inner();
        Self { poses, turn, motion: after * before.inverse(), parts: rigid.parts(poses), times }
    }

    /// Whether the thing moves so far that it could pass over a point.
    pub fn is_fast(&self) -> bool {
        self.parts > 1
    }

    /// How far a point [m] is from the thing at the end of the step, and the direction away from it.
    pub fn near(&self, rigid: &Rigid, point: &Vector3<f64>) -> Near {
        let local = self.turn.tr_mul(&(point - self.poses[1].translation.vector));
        let Near { distance, normal } = rigid.near_local(&local);
        Near { distance, normal: self.turn * normal }
    }

    /// Where a point [m] of the thing before the step is after it.
    pub fn carry(&self, point: &Vector3<f64>) -> Vector3<f64> {
        (self.motion * Point3::from(*point)).coords
    }

    /// The largest way [m] of a point of the thing.
    pub fn travel(&self, rigid: &Rigid) -> f64 {
        travel(rigid, &self.poses)
    }

    /// The pose after a part of the step.
    fn at(&self, rigid: &Rigid, part: usize) -> Pose {
        if part == self.parts {
            return self.poses[1];
        }
        let [from, to] = self.times;
        rigid.course.at(from + (to - from) * part as f64 / self.parts as f64)
    }
}

/// Who touches whom.
#[derive(Clone, Debug)]
pub struct Contact {
    /// Its name.
    pub name: String,
    /// The surface of a body, nodes numbered in the model and increasing. Points on its triangles touch, too: close enough together for a rigid
    /// thing.
    pub surface: Surface,
    /// What it touches.
    pub with: With,
    /// How.
    pub touch: Touch,
}

/// What the surface of a body touches.
#[derive(Clone, Debug)]
pub enum With {
    /// A rigid thing, by its place in [`Contacts::rigids`].
    Rigid(usize),
    /// Another body.
    Body(Surface),
    /// Other parts of the same surface.
    Itself,
}

/// The contacts of a model.
#[derive(Clone, Debug, Default)]
pub struct Contacts {
    /// Obstacles and tools.
    pub rigids: Vec<Rigid>,
    /// Who touches whom.
    pub contacts: Vec<Contact>,
}

/// Points on a triangle besides its corners, by their weights: a lattice of so many parts of an edge.
pub fn lattice(parts: usize) -> Vec<[f64; 3]> {
    let all = (0..=parts).flat_map(|i| (0..=parts - i).map(move |j| [i, j, parts - i - j]));
    let inner = all.filter(|point| !point.contains(&parts));
    inner.map(|point| point.map(|k| k as f64 / parts as f64)).collect()
}

/// Parts of an edge [m] whose points lie close enough together for a thing: nearer than seven tenths of its thinnest part; eight at most.
pub fn parts_of(edge: f64, shape: &Shape) -> usize {
    let parts = edge / (0.7 * shape.thinnest());
    if parts.is_finite() { parts.ceil().clamp(1.0, 8.0) as usize } else { 1 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pliant_mechanics::curve::{Curve, Shape as CurveShape};

    fn tool(shift: [f64; 3]) -> Rigid {
        let curve = Curve { shape: CurveShape::Ramp, from: 0.0, to: 1.0 };
        let course = Course::by(Pose::identity(), shift, curve);
        Rigid { name: "tool".into(), shape: Shape::Sphere { radius: 0.01 }, course, inside: false }
    }

    /// A ball that passes over a node in one step takes it along, as it does in many.
    #[test]
    fn a_fast_tool_passes_over_no_node() {
        let touch = Touch { friction: 0.0, offset: 0.0 };
        let node = [0.05, 0.001, 0.0];
        let pushed = touch.correct(&tool([0.1, 0.0, 0.0]), [0.0, 1.0], node, node, [1.0; 3]).unwrap();
        assert!((Vector3::from(pushed) - Vector3::new(0.1, 0.0, 0.0)).norm() > 0.01 - 1e-12, "{pushed:?}");
        assert!(Vector3::from(pushed) != Vector3::from(node));
        let beside = [0.05, 0.02, 0.0];
        assert!(touch.correct(&tool([0.1, 0.0, 0.0]), [0.0, 1.0], beside, beside, [1.0; 3]).is_none());
    }

    /// Held components stay; what a surface carries along does not slip.
    #[test]
    fn friction_acts_against_the_slip_on_the_surface_and_held_components_stay() {
        let touch = Touch { friction: 10.0, offset: 0.0 };
        let carried = tool([0.0005, 0.0, 0.0]);
        let (now, then) = ([0.0, 0.0, 0.0101], [0.0, 0.0, 0.009]);
        let place = touch.correct(&carried, [0.0, 1.0], now, then, [1.0; 3]).unwrap();
        assert!((place[0] - 0.0005).abs() < 1e-4, "{place:?}");
        let held = touch.correct(&carried, [0.0, 1.0], now, then, [0.0, 0.0, 1.0]).unwrap();
        assert_eq!([held[0], held[1]], [0.0; 2]);
        assert!(touch.correct(&carried, [0.0, 1.0], now, then, [0.0; 3]).is_none());
    }

    #[test]
    fn lattices_have_the_points_between_the_corners() {
        assert!(lattice(1).is_empty());
        assert_eq!(lattice(2).len(), 3);
        assert_eq!(lattice(3).len(), 7);
        assert!(lattice(4).iter().all(|w| (w.iter().sum::<f64>() - 1.0).abs() < 1e-15));
        assert_eq!(parts_of(0.02, &Shape::HalfSpace), 1);
        assert_eq!(parts_of(0.02, &Shape::Sphere { radius: 0.01 }), 3);
    }
}
