//! The hand and the pins that hold a body, and tools in the hand.
//!
//! A hand has no point: it holds the surface around the one that it took, within two edges of the elements there, with the
//! weights of a Gaussian whose deviation is one edge. So a pull meets tissue as a grasper does, and not a single element. Its spring gets no
//! longer than two edges, however far the mouse goes: its force is at most that long times its stiffness.

use std::collections::HashSet;

use nalgebra::Point3;
use pliant_geometry::Vector3;
use pliant_mechanics::grip::Grip;
use pliant_picture::Subject;
use pliant_run::Live;
use pliant_sim::ToolNow;
use pliant_sim::contact::pose::Pose;
use serde::{Deserialize, Serialize};

/// A point of what is drawn: a triangle and the weights of its corners.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// The triangle, counted as drawn.
    pub triangle: u32,
    /// Weights of its corners, which sum to 1.
    pub weights: [f64; 3],
}

/// What hand and pins do.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Hand {
    /// Takes hold of the surface around a point, by a spring of a stiffness [N/m].
    Take(Point, f64),
    /// Pulls what it holds towards a place [m].
    Pull([f64; 3]),
    /// Lets go; a tool stays.
    Release,
    /// Pins the surface around a point where it is.
    Pin(Point),
    /// Removes a pin, counted from 0.
    Unpin(usize),
    /// Turns the tool that it holds about the point where it holds it, by a rotation vector [rad].
    Turn([f64; 3]),
    /// Opens the jaws of the tool that it holds by an angle [rad], or closes them if it is negative.
    Open(f64),
}

/// What is held at the moment: by the hand first, then by pins.
#[derive(Clone, Debug, Default)]
pub struct Hold {
    grips: Vec<Grip>,
    taken: Vec<Taken>,
    by_hand: bool,
    tool: Option<Tool>,
}

/// A tool in the hand.
#[derive(Clone, Debug)]
struct Tool {
    name: String,
    /// The point that was taken, in the frame of the tool [m].
    point: Vector3,
    /// Where it is led.
    goal: Pose,
    /// The angle [rad] between its jaws that it is led to.
    opening: f64,
}

/// Edges within which a hand holds the surface, and by which its spring gets longer at most.
const REACH: f64 = 2.0;
/// Simulated time [s] in which a tool follows the hand: a frame.
const FOLLOWS: f64 = 1.0 / 60.0;
/// The widest angle [rad] between jaws.
const WIDEST: f64 = 3.0;

impl Tool {
    /// The tool that a point belongs to; `None` of a point of a body.
    fn at(point: &Point, subject: &Subject, live: &Live) -> Option<Self> {
        let corners = subject.triangles().nth(point.triangle as usize)?;
        let name = live.thing_of(corners[0]).filter(|_| live.is_movable(corners[0]))?.tool().to_owned();
        let ToolNow { pose, opening, .. } = live.simulation.tool(&name)?;
        let place =
            |(corner, weight): (u32, f64)| live.place_on(corner, &subject.points[corner as usize]) * weight;
        let place: Vector3 = corners.into_iter().zip(point.weights).map(place).sum();
        let point = pose.inverse_transform_point(&place.into()).coords;
        Some(Self { name, point, goal: pose, opening })
    }

    /// The point that was taken [m] at a pose.
    fn held(&self, pose: &Pose) -> Vector3 {
        (pose * Point3::from(self.point)).coords
    }

    /// Turns it about the point that was taken, and brings this to a place [m].
    fn lead(&mut self, place: &Vector3, turn: &Vector3, live: &mut Live) -> bool {
        self.goal = Pose::rotation(*turn) * self.goal;
        self.goal.translation.vector += place - self.held(&self.goal);
        live.simulation.drive(&self.name, self.goal, FOLLOWS).is_ok()
    }

    fn open(&mut self, by: f64, live: &mut Live) -> bool {
        self.opening = (self.opening + by).clamp(0.0, WIDEST);
        live.simulation.open(&self.name, self.opening, FOLLOWS).is_ok()
    }
}

/// How a grip was taken.
#[derive(Clone, Copy, Debug)]
struct Taken {
    /// Stiffness asked for [N/m].
    stiffness: f64,
    /// From the middle of what is held to the point that was taken [m].
    offset: Vector3,
    /// Where the middle is pulled to [m].
    goal: Vector3,
    /// How long its spring can become [m], so that its force has a limit; infinite on a device.
    longest: f64,
}

/// A combination of nodes of the model.
type Nodes = Vec<(u32, f64)>;

fn add(nodes: &mut Nodes, more: Nodes, weight: f64) {
    for (node, own) in more {
        match nodes.iter_mut().find(|(known, _)| *known == node) {
            Some((_, sum)) => *sum += own * weight,
            None => nodes.push((node, own * weight)),
        }
    }
}

/// A point as a combination of nodes; `None` of one that there is not.
pub(crate) fn nodes_of(point: &Point, subject: &Subject, live: &Live) -> Option<Nodes> {
    let corners = subject.triangles().nth(point.triangle as usize)?;
    let mut nodes = Nodes::new();
    for (corner, weight) in corners.into_iter().zip(point.weights) {
        add(&mut nodes, live.nodes_of(corner), weight);
    }
    (!nodes.is_empty()).then_some(nodes)
}

/// The mean length [m] of the edges between the nodes that carry a triangle.
fn edge(corners: [u32; 3], live: &Live) -> f64 {
    let mut nodes = Nodes::new();
    corners.into_iter().for_each(|corner| add(&mut nodes, live.nodes_of(corner), 1.0));
    let places: Vec<Vector3> = nodes.iter().map(|&(node, _)| live.simulation.rest(node).into()).collect();
    let (mut sum, mut count) = (0.0, 0);
    for (first, a) in places.iter().enumerate() {
        for b in &places[..first] {
            (sum, count) = (sum + (a - b).norm(), count + 1);
        }
    }
    if count > 0 { sum / f64::from(count) } else { 0.0 }
}

/// The surface around a point, as a combination of nodes: what lies within two edges of it at rest and hangs together with it.
fn around(point: &Point, subject: &Subject, live: &Live) -> Option<Nodes> {
    let corners = subject.triangles().nth(point.triangle as usize)?;
    let middle: Vector3 =
        corners.into_iter().zip(point.weights).map(|(corner, w)| subject.points[corner as usize] * w).sum();
    let edge = edge(corners, live);
    let distance = |corner: u32| (subject.points[corner as usize] - middle).norm();
    let mut reached: Vec<u32> = corners.into_iter().filter(|&c| distance(c) < REACH * edge).collect();
    let mut known: HashSet<u32> = reached.iter().copied().collect();
    let mut before = 0;
    while before < reached.len() {
        before = reached.len();
        for triangle in subject.triangles() {
            if triangle.iter().any(|corner| known.contains(corner)) {
                let near = triangle.into_iter().filter(|&c| distance(c) < REACH * edge);
                near.for_each(|corner| {
                    if known.insert(corner) {
                        reached.push(corner);
                    }
                });
            }
        }
    }
    let mut nodes = Nodes::new();
    for corner in reached {
        let part = distance(corner) / edge;
        add(&mut nodes, live.nodes_of(corner), (-0.5 * part * part).exp());
    }
    let sum: f64 = nodes.iter().map(|(_, weight)| weight).sum();
    nodes.iter_mut().for_each(|(_, weight)| *weight /= sum);
    if nodes.is_empty() { nodes_of(point, subject, live) } else { Some(nodes) }
}

impl Hold {
    /// Whether the first of what is held is the hand's.
    pub fn by_hand(&self) -> bool {
        self.by_hand || self.tool.is_some()
    }

    /// The tool that the hand holds.
    pub fn tool(&self) -> Option<&str> {
        self.tool.as_ref().map(|tool| tool.name.as_str())
    }

    /// Of each grip the point [m], and its force on the body [N].
    pub fn shown<'h>(&'h self, live: &'h Live) -> impl Iterator<Item = [[f64; 3]; 2]> + 'h {
        let tool = self.tool.iter().filter_map(|tool| {
            let now = live.simulation.tool(&tool.name)?;
            Some([tool.held(&now.pose).into(), now.force.map(|f| -f)])
        });
        tool.chain(self.grips.iter().zip(&self.taken).map(|(grip, taken)| {
            let [middle, force] = live.simulation.pulled(grip);
            [(Vector3::from(middle) + taken.offset).into(), force]
        }))
    }

    /// Does what hand and pins do; the stiffness stays below the bound of stable steps. False where the solver knows no hand.
    pub fn take(&mut self, hand: &Hand, subject: &Subject, live: &mut Live) -> bool {
        let grip = |point: &Point, stiffness| grip(point, stiffness, subject, &*live);
        let mut found = true;
        match hand {
            Hand::Take(point, stiffness) => {
                self.release();
                self.tool = Tool::at(point, subject, live);
                if self.tool.is_some() {
                    return true;
                }
                match grip(point, *stiffness) {
                    Some((grip, taken)) => {
                        self.grips.insert(0, grip);
                        self.taken.insert(0, taken);
                        self.by_hand = true;
                    }
                    None => found = false,
                }
            }
            Hand::Turn(by) => {
                let Some(tool) = &mut self.tool else { return true };
                let place = tool.held(&tool.goal);
                return tool.lead(&place, &(*by).into(), live);
            }
            Hand::Open(by) => return self.tool.as_mut().is_none_or(|tool| tool.open(*by, live)),
            Hand::Pull(place) if self.tool.is_some() => {
                let lead = |tool: &mut Tool| tool.lead(&(*place).into(), &Vector3::zeros(), live);
                return self.tool.as_mut().is_none_or(lead);
            }
            Hand::Pull(place) if self.by_hand => {
                self.taken[0].goal = Vector3::from(*place) - self.taken[0].offset;
                self.stretch(live);
            }
            Hand::Pull(_) => {}
            Hand::Release => self.release(),
            Hand::Pin(point) => match grip(point, f64::INFINITY) {
                Some((grip, taken)) => {
                    self.grips.push(grip);
                    self.taken.push(taken);
                }
                None => found = false,
            },
            Hand::Unpin(pin) => {
                let at = pin + usize::from(self.by_hand);
                if at < self.grips.len() {
                    self.grips.remove(at);
                    self.taken.remove(at);
                }
            }
        }
        self.hold(live) && found
    }

    /// After a step: pulls on towards the goal. The force stays below its limit while what is held gives way.
    pub fn follow(&mut self, live: &mut Live) {
        if self.follows() && self.stretch(live) {
            self.hold(live);
        }
    }

    /// Whether the end of the hand's spring goes along with what is held.
    pub fn follows(&self) -> bool {
        self.by_hand && self.taken[0].longest.is_finite()
    }

    /// Brings the end of the hand's spring as near to the goal as its length allows; whether it moves.
    fn stretch(&mut self, live: &Live) -> bool {
        let (grip, Taken { goal, longest, .. }) = (&mut self.grips[0], self.taken[0]);
        let held = Vector3::from(live.simulation.pulled(grip)[0]);
        let way = goal - held;
        let length = way.norm();
        let place = if length > longest { held + way * (longest / length) } else { goal }.into();
        std::mem::replace(&mut grip.place, place) != place
    }

    /// Holds the same in another run.
    pub fn hold_on(&mut self, live: &mut Live) -> bool {
        self.tool.take_if(|tool| live.simulation.tool(&tool.name).is_none());
        for (grip, taken) in self.grips.iter_mut().zip(&self.taken) {
            grip.stiffness = taken.stiffness.min(live.simulation.stiffest(grip));
        }
        self.hold(live)
    }

    fn hold(&mut self, live: &mut Live) -> bool {
        let held = live.simulation.hold(&self.grips);
        if !held {
            *self = Self::default();
        }
        held
    }

    fn release(&mut self) {
        self.tool = None;
        if std::mem::take(&mut self.by_hand) {
            self.grips.remove(0);
            self.taken.remove(0);
        }
    }
}

/// A grip where its point is, as stiff as asked for or as steps allow.
fn grip(point: &Point, stiffness: f64, subject: &Subject, live: &Live) -> Option<(Grip, Taken)> {
    let nodes = around(point, subject, live)?;
    let at = Grip { nodes: nodes_of(point, subject, live)?, ..Grip::default() };
    let mut grip = Grip { nodes, ..Grip::default() };
    grip.stiffness = stiffness.min(live.simulation.stiffest(&grip));
    [grip.place, _] = live.simulation.pulled(&grip);
    let goal = Vector3::from(grip.place);
    let offset = Vector3::from(live.simulation.pulled(&at)[0]) - goal;
    let corners = subject.triangles().nth(point.triangle as usize)?;
    let longest = if live.is_on_device() { f64::INFINITY } else { REACH * edge(corners, live) };
    Some((grip, Taken { stiffness, offset, goal, longest }))
}

/// The first triangle that a ray meets, and where: Möller and Trumbore (1997), one triangle after the other. A tree over
/// a deforming surface would have to be renewed for each pick, which takes longer than looking at all of its triangles.
pub fn pick(
    subject: &Subject,
    points: &[Vector3],
    from: &Vector3,
    along: &Vector3,
    shown: impl Fn(&Vector3) -> bool,
) -> Option<(Point, Vector3)> {
    let mut nearest: Option<(f64, Point)> = None;
    for (corners, triangle) in subject.triangles().zip(0..) {
        let [a, b, c] = corners.map(|point| points[point as usize]);
        let (ab, ac) = (b - a, c - a);
        let across = along.cross(&ac);
        let determinant = ab.dot(&across);
        if determinant == 0.0 || !subject.is_drawn(triangle as usize, determinant > 0.0) {
            continue;
        }
        let from_a = (from - a) / determinant;
        let v = from_a.dot(&across);
        let turned = from_a.cross(&ab);
        let w = along.dot(&turned);
        let distance = ac.dot(&turned);
        let inside = v >= 0.0 && w >= 0.0 && v + w <= 1.0 && distance > 0.0;
        if inside && nearest.is_none_or(|(known, _)| distance < known) && shown(&(from + along * distance)) {
            nearest = Some((distance, Point { triangle, weights: [1.0 - v - w, v, w] }));
        }
    }
    nearest.map(|(distance, point)| (point, from + along * distance))
}
