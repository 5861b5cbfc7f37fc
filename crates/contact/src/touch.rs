//! The least correction of a node that would go into a rigid surface: along the normal to the surface, then
//! against sliding by the cone of friction. Let x* be the predicted place and w = ∂x/∂f the mobility of each
//! component. The gap is g = d(x*) − offset < 0. Then λ = −g / Σ w n² and x* += w n λ. The slip d over the
//! step, relative to the surface, is taken back by a force of at most μ λ. The force on the node is the
//! correction over its mobility. A step with this force is perfectly plastic along the normal and keeps
//! momentum. It leaves the critical time step as it is.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Point3, Vector3};
use pliant_mechanics::curve::Curve;
use pliant_mechanics::tensor::Vector;
use serde::{Deserialize, Serialize};

use crate::pairs::{Pairs, Surface};
use crate::pose::{Leg, Pose, Stance, Trajectory};
use crate::shape::{Near, Shape, Sides};

/// Parts of a step at most in which a node is followed along a thing.
pub(crate) const MOST_PARTS: f64 = 512.0;
/// Gap, over half of the thinnest part of a thing, at which a node has met it.
pub(crate) const MEETS: f64 = 1e-3;
/// Cosine of the angle between two directions away from a thing: where a point meets it, and where the point
/// would end. Above this cosine both are on one side.
pub(crate) const ALIKE: f64 = 0.7;
/// Part of a depth at the beginning of a step that may be left at its end. Sharp edges come between the
/// points of a face, and the way out of a thing can turn to another side. Points that come to lie in a thing
/// like this are pushed out over several steps, since one step would throw them.
pub const LEFT: f64 = 0.8;
/// Passes over all rows of a step at most.
pub const PASSES: usize = 30;
/// The largest motion by an impulse in a pass, over the depth of the deepest point, at which impulses are
/// found.
pub const FOUND: f64 = 1e-3;
/// Times at most that impulses are found with sides of things where nodes came to lie.
pub const ROUNDS: usize = 4;
/// Sides of a thing at most that are looked for at a node in a round.
pub const LOOKED: usize = 8;
/// Sides of a thing at most that a node has at a time.
pub const SIDES: usize = 4;
/// Distance of a node from the surface of a thing, over its depth as predicted, from which on it lies off or
/// behind it.
pub const OFF: f64 = 1e-3;
/// Times at most that a node is lifted out of a thing: creases turn it from one side to another.
pub const LIFTS: usize = 16;
/// The gap, over the first one, at which it is out.
pub const LIFTED: f64 = 1e-4;
/// Gaps, over the depth of the deepest point, up to which points take part.
pub const BAND: f64 = 8.0;
/// Distance from a thing within which a node counts as near, over the longest edge of its surface. The way of
/// the node in the step is added.
pub const MARGIN: f64 = 0.1;

/// A rigid thing: an obstacle, a tool or a jaw of one.
#[derive(Clone, Debug)]
pub struct Rigid {
    /// Its name.
    pub name: String,
    /// Its shape.
    pub shape: Shape,
    /// Motion of the thing; for a jaw, the motion of its tool.
    pub trajectory: Trajectory,
    /// True if bodies are inside the thing, as a brain in its skull.
    pub inside: bool,
    /// Rotation of a jaw in the frame of its tool.
    pub jaw: Option<Jaw>,
}

/// One of two jaws, which turn about the x axis of their tool.
#[derive(Clone, Debug)]
pub struct Jaw {
    /// The name of the tool.
    pub tool: String,
    /// Part of the angle between the jaws by which it turns: one half, or minus one half.
    pub part: f64,
    /// The angle [rad] between the jaws over time.
    pub opening: (f64, Curve),
    /// Pose of its shape in a closed tool.
    pub place: Pose,
    /// The angle [rad] between the jaws from which on down they hold all that touches their inner faces;
    /// `None`: they hold by friction.
    pub grip: Option<f64>,
}

/// A node that jaws hold.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gripped {
    /// The jaw, by its place in [`Contacts::rigids`].
    pub rigid: u32,
    /// The node, numbered in the model.
    pub node: u32,
    /// Place of the node in the frame of the jaw's shape [m].
    pub at: [f64; 3],
}

impl Rigid {
    /// The name of the tool or obstacle that it is, or is a jaw of.
    pub fn tool(&self) -> &str {
        self.jaw.as_ref().map_or(&self.name, |jaw| &jaw.tool)
    }

    /// Returns the pose of the tool or obstacle at a time [s], and the angle [rad] between its jaws. A leg,
    /// where it has a way, replaces the trajectory.
    pub fn posture(&self, time: f64, leg: Option<&Leg>) -> (Pose, f64) {
        let opening = |jaw: &Jaw| jaw.opening.0 * jaw.opening.1.value(time);
        let pose = leg.and_then(|leg| leg.pose(time)).unwrap_or_else(|| self.trajectory.at(time));
        let driven = leg.and_then(|leg| leg.opening(time));
        (pose, driven.unwrap_or_else(|| self.jaw.as_ref().map_or(0.0, opening)))
    }

    /// Its pose at a time [s]; driven if there is a leg.
    pub fn at(&self, time: f64, leg: Option<&Leg>) -> Pose {
        let (pose, opening) = self.posture(time, leg);
        match &self.jaw {
            Some(jaw) => pose * Pose::rotation(Vector3::x() * (jaw.part * opening)) * jaw.place,
            None => pose,
        }
    }

    /// Its pose at a time [s], driven if there is a leg, and its growth.
    pub fn stance(&self, time: f64, leg: Option<&Leg>) -> Stance {
        Stance { pose: self.at(time, leg), growth: self.trajectory.growth(time) }
    }

    /// The distance of a point [m] from where it is free of the thing, and the direction there.
    pub fn near(&self, Stance { pose, growth }: &Stance, point: &Vector3<f64>) -> Near {
        let local = pose.inverse_transform_point(&(*point).into());
        let Near { distance, normal } = self.near_local(*growth, &local.coords);
        Near { distance, normal: pose.rotation * normal }
    }

    /// [`near`](Self::near) in the frame of the thing, grown by a distance [m].
    pub fn near_local(&self, growth: f64, point: &Vector3<f64>) -> Near {
        let Near { distance, normal } = self.shape.near(point);
        let sign = self.sign();
        Near { distance: sign * (distance - growth), normal: normal * sign }
    }

    /// Distance of a point [m] from where it is free of the thing, and its gradient. A hollow thing has one
    /// for each of [`Shape::sides`], any other thing one for the nearest part of the surface.
    pub fn sides(&self, stance: &Stance, point: &Vector3<f64>) -> Sides {
        if !self.inside {
            let mut sides = Sides::default();
            sides[0] = Some(self.near(stance, point));
            return sides;
        }
        let Stance { pose, growth } = stance;
        let local = pose.inverse_transform_point(&(*point).into());
        self.shape.sides(&local.coords).map(|side| {
            side.map(|Near { distance, normal }| Near {
                distance: growth - distance,
                normal: pose.rotation * -normal,
            })
        })
    }

    /// Distance [m] from the nearest of [`sides`](Self::sides).
    pub fn distance(&self, stance: &Stance, point: &Vector3<f64>) -> f64 {
        let sides = self.sides(stance, point).into_iter().flatten();
        sides.map(|side| side.distance).fold(f64::INFINITY, f64::min)
    }

    /// −1 of a thing that bodies are inside of, else 1.
    fn sign(&self) -> f64 {
        if self.inside { -1.0 } else { 1.0 }
    }

    /// True if its jaws hold all that touches them at an angle [rad] between them.
    pub fn grips(&self, opening: f64) -> bool {
        self.jaw.as_ref().and_then(|jaw| jaw.grip).is_some_and(|closed| opening <= closed)
    }

    /// The shortest time [s] between two postures in steps of a length [s] in which no node is passed over.
    /// Of a tool with jaws, pose and opening take half of what a step allows each: they may be driven at the
    /// same time.
    pub fn shortest(&self, postures: [(Pose, f64); 2], step: f64) -> f64 {
        let [(from, closed), (to, open)] = postures;
        let moved = travel(self, &[from, to].map(Stance::at));
        let way = self.jaw.as_ref().map_or(moved, |jaw| {
            let reach = jaw.place.translation.vector.norm() + self.shape.reach();
            2.0 * moved.max((jaw.part * (open - closed)).abs() * reach)
        });
        2.0 * way / (MOST_PARTS * self.shape.thinnest()) * step
    }
}

/// The largest way [m] of a point of the surface of a thing from one stance to another.
fn travel(rigid: &Rigid, [before, after]: &[Stance; 2]) -> f64 {
    let (from, to) = (&before.pose, &after.pose);
    let reach = rigid.shape.reach() + before.growth.max(after.growth).max(0.0);
    let turned = from.rotation.angle_to(&to.rotation) * reach;
    (to.translation.vector - from.translation.vector).norm() + turned + (after.growth - before.growth).abs()
}

/// Friction and distance of a contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// Coulomb's coefficient μ.
    pub friction: f64,
    /// Distance [m] that nodes keep from the surface.
    pub offset: f64,
}

impl Touch {
    /// Returns the corrected place [m] of a node that is predicted to go from `now` to `predicted` [m] in the
    /// step between two times [s]. `None` where the node is free. `mobility` [m/N] has a value for each
    /// component, zero for held ones.
    pub fn correct(
        &self,
        rigid: &Rigid,
        times: [f64; 2],
        now: Vector<f64>,
        predicted: Vector<f64>,
        mobility: Vector<f64>,
    ) -> Option<Vector<f64>> {
        let passage = Passage::new(rigid, times.map(|time| rigid.stance(time, None)));
        let (now, predicted, mobility) = (now.into(), predicted.into(), mobility.into());
        let Near { distance, normal } = passage.meet(rigid, self.offset, &now, &predicted);
        let gap = distance - self.offset;
        let lifted = (gap < 0.0).then(|| self.lift(&passage, &now, &predicted, &mobility, gap, &normal));
        lifted.flatten().map(Vector::from)
    }

    /// Lifts a predicted place out of a gap < 0 along a normal, and takes back its slip; `None` if it cannot
    /// move.
    fn lift(
        &self,
        passage: &Passage,
        now: &Vector3<f64>,
        predicted: &Vector3<f64>,
        mobility: &Vector3<f64>,
        gap: f64,
        normal: &Vector3<f64>,
    ) -> Option<Vector3<f64>> {
        let along = mobility.component_mul(normal);
        let mobility_along = along.dot(normal);
        if mobility_along <= 0.0 {
            return None;
        }
        let push = -gap / mobility_along;
        let lifted = predicted + along * push;
        let slip = lifted - passage.carry(now);
        let slip = slip - normal * slip.dot(normal);
        let length = slip.norm();
        if self.friction == 0.0 || length == 0.0 {
            return Some(lifted);
        }
        let back = slip / length;
        let against = mobility.component_mul(&back);
        let mobility_back = against.dot(&back);
        if mobility_back <= 0.0 {
            return Some(lifted);
        }
        Some(lifted - against * (self.friction * push).min(length / mobility_back))
    }
}

/// The way of a rigid thing in a step.
#[derive(Clone, Debug)]
pub struct Passage {
    /// Its poses before and after.
    pub(crate) poses: [Pose; 2],
    /// Its growth [m] before and after.
    growth: [f64; 2],
    /// Rotation of its frame after the step.
    pub(crate) turn: Matrix3<f64>,
    /// The motion from the pose before to that after.
    pub(crate) motion: Pose,
    /// The largest way [m] of a point of the thing.
    pub(crate) travel: f64,
    /// Half of its thinnest part [m].
    half_thinnest: f64,
}

impl Passage {
    /// Makes the passage in the step from one stance to another.
    pub fn new(rigid: &Rigid, stances: [Stance; 2]) -> Self {
        let (poses, growth) = (stances.map(|stance| stance.pose), stances.map(|stance| stance.growth));
        let [before, after] = poses;
        let turn = after.rotation.to_rotation_matrix().into_inner();
        let half_thinnest = 0.5 * (rigid.shape.thinnest() + growth[0].min(growth[1]));
        let travel = travel(rigid, &stances);
        Self { poses, growth, turn, motion: after * before.inverse(), travel, half_thinnest }
    }

    /// Returns the distance of a point [m] from the thing at the end of the step, and the direction away from
    /// the thing.
    pub fn near(&self, rigid: &Rigid, point: &Vector3<f64>) -> Near {
        let (_, Near { distance, normal }) = self.within(rigid, point);
        Near { distance, normal: self.turn * normal }
    }

    /// Returns the distance [m] of a point [m] from the thing at the beginning of the step.
    pub fn distance_before(&self, rigid: &Rigid, point: &Vector3<f64>) -> f64 {
        rigid.near(&self.before(), point).distance
    }

    /// Returns a point [m] at the end of the step in the frame of the thing, and the distance and direction
    /// away from the thing there.
    pub fn within(&self, rigid: &Rigid, point: &Vector3<f64>) -> (Vector3<f64>, Near) {
        let local = self.turn.tr_mul(&(point - self.poses[1].translation.vector));
        (local, rigid.near_local(self.growth[1], &local))
    }

    /// Returns the place at the end of the step of a point [m] in the frame of the thing.
    pub fn place(&self, local: &Vector3<f64>) -> Vector3<f64> {
        (self.poses[1] * Point3::from(*local)).coords
    }

    /// Runs [`near`](Self::near) for a point that is predicted to go from one place [m] to another, and keeps
    /// an offset [m]. The point is followed on its way if it ends in the thing, could pass through it or be
    /// passed over. Each part of the way is its gap, which it can go without reaching the thing. Next to the
    /// thing, the part is half of the thinnest part. Where they meet, the tangent plane moves along with the
    /// thing. If the point ends behind the plane on another side, or has come far, its distance is measured
    /// from the plane. So no point comes to another side, however thin the thing is, however far both go and
    /// however deep forces carry the prediction. Of a depth at the beginning, [`LEFT`] may be left.
    pub fn meet(&self, rigid: &Rigid, offset: f64, now: &Vector3<f64>, predicted: &Vector3<f64>) -> Near {
        let way = (predicted - now).norm() + self.travel;
        let end = self.near(rigid, predicted);
        if way <= self.half_thinnest && end.distance >= offset {
            return end;
        }
        let least = self.half_thinnest.max(way / MOST_PARTS);
        let mut time_fraction = 0.0;
        while time_fraction < 1.0 {
            let stance = self.at(time_fraction);
            let place = now.lerp(predicted, time_fraction);
            let Near { distance, normal: outward } = rigid.near(&stance, &place);
            let gap = distance - offset;
            if gap <= MEETS * self.half_thinnest {
                let left = if time_fraction == 0.0 { LEFT * gap.min(0.0) } else { 0.0 };
                let onward = self.poses[1] * stance.pose.inverse();
                let normal = onward.rotation * outward;
                if way <= self.half_thinnest && normal.dot(&end.normal) > ALIKE {
                    return Near { distance: end.distance - left, normal: end.normal };
                }
                let on_surface = onward * Point3::from(place - outward * distance);
                let risen = rigid.sign() * (self.growth[1] - stance.growth);
                let distance = normal.dot(&(predicted - on_surface.coords)) - risen;
                if distance < offset {
                    return Near { distance: distance - left, normal };
                }
            }
            time_fraction += gap.max(least) / way;
        }
        end
    }

    /// Returns the place after the step of a point [m] that moves with the thing from before the step.
    pub fn carry(&self, point: &Vector3<f64>) -> Vector3<f64> {
        (self.motion * Point3::from(*point)).coords
    }

    /// The largest way [m] of a point of the thing.
    pub fn travel(&self) -> f64 {
        self.travel
    }

    /// The largest way [m] of a point of the thing from a stance to the end of the step; infinite for a
    /// half-space that turns.
    pub fn travel_from(&self, rigid: &Rigid, stance: &Stance) -> f64 {
        let after = self.stance();
        let is_endless = matches!(rigid.shape, Shape::HalfSpace);
        if is_endless && stance.pose.rotation != after.pose.rotation {
            f64::INFINITY
        } else {
            travel(rigid, &[*stance, after])
        }
    }

    /// Returns its pose and growth at the end of the step.
    pub fn stance(&self) -> Stance {
        Stance { pose: self.poses[1], growth: self.growth[1] }
    }

    /// Returns its pose and growth at the beginning of the step.
    fn before(&self) -> Stance {
        Stance { pose: self.poses[0], growth: self.growth[0] }
    }

    /// Returns its pose and growth after a fraction of the step.
    fn at(&self, time_fraction: f64) -> Stance {
        Stance::between([&self.before(), &self.stance()], time_fraction)
    }
}

/// A contact of a surface with its partner.
#[derive(Clone, Debug)]
pub struct Contact {
    /// Its name.
    pub name: String,
    /// The surface of a body, nodes numbered in the model and increasing. Points on its triangles touch, too:
    /// close enough together for a rigid thing.
    pub surface: Surface,
    /// Partner of the contact.
    pub with: With,
    /// Friction and distance to keep.
    pub touch: Touch,
}

impl Contact {
    /// Surfaces that take part: the contact's surface, and the surface of another body.
    pub fn surfaces(&self) -> impl Iterator<Item = &Surface> {
        let other = if let With::Body(other) = &self.with { Some(other) } else { None };
        std::iter::once(&self.surface).chain(other)
    }

    /// Returns its pairs if both partners are deformable, with renumbered nodes that keep their order.
    /// `place` gives rest places [m] by the new numbers. Bodies are in the order of their nodes; the sign is
    /// −1 where the contact names them the other way round. Results do not depend on that.
    pub fn pairs(
        &self,
        number: impl Fn(u32) -> u32,
        place: impl Fn(u32) -> Vector3<f64>,
    ) -> Option<(Pairs, f64)> {
        let first = self.surface.numbered(&number);
        let second = match &self.with {
            With::Rigid(_) => return None,
            With::Body(second) => Some(second.numbered(&number)),
            With::Itself => None,
        };
        let (first, second, sign) = match second {
            Some(second) if second.nodes < first.nodes => (second, Some(first), -1.0),
            second => (first, second, 1.0),
        };
        Some((Pairs::new(&first, second.as_ref(), self.touch.offset, place), sign))
    }
}

impl Contacts {
    /// [`Contact::pairs`] of a contact by its place, with the nodes that keep less.
    pub fn pairs(
        &self,
        contact: usize,
        number: impl Fn(u32) -> u32,
        place: impl Fn(u32) -> Vector3<f64>,
    ) -> Option<(Pairs, f64)> {
        let (pairs, sign) = self.contacts[contact].pairs(&number, &place)?;
        let Some(near) = self.near.get(&contact) else { return Some((pairs, sign)) };
        let near = near.iter().map(|&(node, kept)| (number(node), kept));
        Some((pairs.keeping(near, place), sign))
    }

    /// Returns all nodes that may touch something, increasing.
    pub fn nodes(&self) -> Vec<u32> {
        let surfaces = self.contacts.iter().flat_map(Contact::surfaces);
        let mut nodes: Vec<u32> = surfaces.flat_map(|surface| &surface.nodes).copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }
}

/// Partner of the surface of a body in a contact.
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
    /// Contacts of surfaces with their partners.
    pub contacts: Vec<Contact>,
    /// Rest places [m] of nodes that another solver moves: in surfaces they are numbered after the nodes of
    /// the model.
    pub coupled_nodes: Vec<Vector<f64>>,
    /// Nodes that keep a smaller distance [m] than their [`Touch`] says, by the index of a contact of bodies.
    /// They are nearer at the start.
    pub near: BTreeMap<usize, Vec<(u32, f64)>>,
}

/// Points on a triangle besides its corners, by their weights: a lattice with `parts` parts of an edge.
pub fn lattice(parts: usize) -> Vec<[f64; 3]> {
    let points = (0..=parts).flat_map(|i| (0..=parts - i).map(move |j| [i, j, parts - i - j]));
    let inner = points.filter(|point| !point.contains(&parts));
    inner.map(|point| point.map(|k| k as f64 / parts as f64)).collect()
}

/// Parts of an edge [m] whose points lie close enough together for a thing: nearer than seven tenths of its
/// thinnest part; eight at most.
pub fn parts_of(edge: f64, shape: &Shape) -> usize {
    let parts = edge / (0.7 * shape.thinnest());
    if parts.is_finite() { parts.ceil().clamp(1.0, 8.0) as usize } else { 1 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pliant_mechanics::curve::Shape as CurveShape;

    fn tool(shift: [f64; 3]) -> Rigid {
        let curve = Curve { shape: CurveShape::Ramp, from: 0.0, to: 1.0 };
        let trajectory = Trajectory::by(Pose::identity(), shift, curve);
        Rigid {
            name: "tool".into(),
            shape: Shape::Sphere { radius: 0.01 },
            trajectory,
            inside: false,
            jaw: None,
        }
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

    /// A particle at rest on a slope of ½ that steps by 1 ms. With μ = ½ it stays; with less it slides by ½ g
    /// (sin − μ cos) t² (A4).
    #[test]
    fn a_particle_on_an_incline_sticks_exactly_or_slides_by_coulombs_law() {
        let (step, mass) = (1e-3, 0.1);
        let floor = Rigid {
            name: "floor".into(),
            shape: Shape::HalfSpace,
            trajectory: Trajectory::fixed(Pose::identity()),
            inside: false,
            jaw: None,
        };
        let pull = Vector3::new(0.2_f64.sqrt(), 0.0, -0.8_f64.sqrt()) * 9.81;
        for (friction, slid) in [(0.5, 0.0), (0.49, 0.0438716537), (0.3, 0.877433074), (0.0, 2.19358269)] {
            let touch = Touch { friction, offset: 0.0 };
            // With the increment that uniform acceleration had before the start.
            let (mut now, mut moved) = (Vector3::zeros(), Vector3::new(-slid * step * step, 0.0, 0.0));
            for k in 0..1000 {
                let then = now + moved + pull * (step * step);
                let time = f64::from(k) * step;
                let placed = touch.correct(
                    &floor,
                    [time, time + step],
                    now.into(),
                    then.into(),
                    [step * step / mass; 3],
                );
                let placed = placed.map_or(then, Vector3::from);
                (moved, now) = (placed - now, placed);
            }
            println!("friction {friction}: {} m of {slid} m", now.x);
            assert!((now.x - slid).abs() <= 1e-8 * slid && now.z == 0.0, "friction {friction}: {now}");
        }
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
