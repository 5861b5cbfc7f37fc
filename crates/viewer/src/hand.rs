//! The hand and the pins that hold a body, and tools in the hand.
//!
//! A hand does not hold a single point. It holds the surface around the point that it took, within two edges
//! of the elements there. The weights of the nodes follow a Gaussian whose deviation is one edge. So a pull
//! meets tissue as a grasper does, and not a single element. The spring gets no longer than two edges,
//! however far the mouse goes. So the force is at most this length times the stiffness.
//!
//! There are two hands. Each holds tissue or a tool, and keeps it while the other one is led.

use nalgebra::Point3;
use pliant_geometry::{Vector3, patch};
use pliant_mechanics::grip::Grip;
use pliant_picture::Subject;
use pliant_run::Live;
use pliant_sim::ToolNow;
use pliant_sim::contact::pose::Pose;
use serde::{Deserialize, Serialize};

/// A point of a drawn surface: a triangle and the weights of its corners.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// The triangle, counted as drawn.
    pub triangle: u32,
    /// Weights of its corners, which sum to 1.
    pub weights: [f64; 3],
}

/// Actions of a hand or on a pin.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Hand {
    /// Takes hold of the surface around a point, by a spring of a stiffness [N/m].
    Take(Point, f64),
    /// Pulls what it holds towards a place [m].
    Pull([f64; 3]),
    /// Lets go; a tool stays where it is.
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

/// One of the two hands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Which {
    /// The first one.
    First,
    /// The second one.
    Second,
}

impl Which {
    /// Both hands.
    pub const BOTH: [Self; 2] = [Self::First, Self::Second];

    /// The other one.
    pub fn other(self) -> Self {
        match self {
            Self::First => Self::Second,
            Self::Second => Self::First,
        }
    }
}

/// Tissue and tools that hands and pins hold at the moment.
#[derive(Clone, Debug, Default)]
pub struct Hold {
    /// Grips of the hands that hold tissue, in the order of the hands, then of the pins.
    grips: Vec<Grip>,
    taken: Vec<Taken>,
    hands: [Holds; 2],
}

/// The object in a hand.
#[derive(Clone, Debug, Default)]
enum Holds {
    #[default]
    Nothing,
    Tissue,
    Tool(Tool),
}

/// A tool in a hand.
#[derive(Clone, Debug)]
struct Tool {
    name: String,
    /// The point that was taken, in the frame of the tool [m].
    point: Vector3,
    /// Pose that the hand leads the tool to.
    goal: Pose,
    /// The angle [rad] between its jaws that it is led to.
    opening: f64,
}

/// Edges within which a hand holds the surface, and the most by which its spring gets longer.
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

/// Data of a grip from the moment when it was taken.
#[derive(Clone, Copy, Debug)]
struct Taken {
    /// Desired stiffness [N/m].
    stiffness: f64,
    /// Vector from the middle of the held surface to the point that was taken [m].
    offset: Vector3,
    /// Place that the middle is pulled to [m].
    goal: Vector3,
    /// Largest length of the spring [m], which limits its force; infinite on a device.
    longest: f64,
}

/// A combination of nodes of the model.
type Nodes = Vec<(u32, f64)>;

fn add(nodes: &mut Nodes, more: Nodes, weight: f64) {
    for (node, share) in more {
        match nodes.iter_mut().find(|(known, _)| *known == node) {
            Some((_, sum)) => *sum += share * weight,
            None => nodes.push((node, share * weight)),
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

/// Returns the surface around a point, as a combination of nodes. It is the part connected to the point
/// within two edges at rest.
fn around(point: &Point, subject: &Subject, live: &Live) -> Option<Nodes> {
    let triangles: Vec<[u32; 3]> = subject.triangles().collect();
    let corners = *triangles.get(point.triangle as usize)?;
    let radius = REACH * edge(corners, live);
    let mut nodes = Nodes::new();
    for (corner, weight) in patch(&subject.points, &triangles, corners, point.weights, Some(radius)) {
        add(&mut nodes, live.nodes_of(corner), weight);
    }
    (!nodes.is_empty()).then_some(nodes)
}

impl Hold {
    /// Index of each hand in [`Self::shown`]; `None` for a hand that holds nothing.
    pub fn hands(&self) -> [Option<usize>; 2] {
        let [first, second] = Which::BOTH.map(|which| usize::from(self.holds(which)));
        [(first > 0).then_some(0), (second > 0).then_some(first)]
    }

    /// True if a hand holds something.
    pub fn holds(&self, which: Which) -> bool {
        !matches!(self.hands[which as usize], Holds::Nothing)
    }

    /// The tool that each hand holds.
    pub fn tools(&self) -> [Option<&str>; 2] {
        [0, 1].map(|hand| match &self.hands[hand] {
            Holds::Tool(tool) => Some(tool.name.as_str()),
            _ => None,
        })
    }

    /// Returns the point [m] and the force on the body [N] of each hand that holds something, then of each
    /// pin.
    pub fn shown<'h>(&'h self, live: &'h Live) -> impl Iterator<Item = [[f64; 3]; 2]> + 'h {
        let grip = |at: usize| {
            let [middle, force] = live.simulation.pulled(&self.grips[at]);
            [(Vector3::from(middle) + self.taken[at].offset).into(), force]
        };
        let hand = move |which: Which| match &self.hands[which as usize] {
            Holds::Nothing => None,
            Holds::Tissue => Some(grip(self.grip_of(which))),
            Holds::Tool(tool) => {
                let now = live.simulation.tool(&tool.name)?;
                Some([tool.held(&now.pose).into(), now.force.map(|f| -f)])
            }
        };
        Which::BOTH.into_iter().filter_map(hand).chain((self.first_pin()..self.grips.len()).map(grip))
    }

    /// The number of the grip of a hand, or that it would have.
    fn grip_of(&self, which: Which) -> usize {
        let before = &self.hands[..which as usize];
        before.iter().filter(|holds| matches!(holds, Holds::Tissue)).count()
    }

    /// The number of the first grip that is a pin's.
    fn first_pin(&self) -> usize {
        self.hands.iter().filter(|holds| matches!(holds, Holds::Tissue)).count()
    }

    /// Performs an action of a hand or a pin; the stiffness stays below the bound of stable steps. Returns
    /// false if the solver supports no hand.
    pub fn take(&mut self, which: Which, does: &Hand, subject: &Subject, live: &mut Live) -> bool {
        let grip = |point: &Point, stiffness| grip(point, stiffness, subject, &*live);
        let mut found = true;
        match does {
            Hand::Take(point, stiffness) => {
                self.release(which);
                if let Some(tool) = Tool::at(point, subject, live) {
                    // A tool is in one hand.
                    if self.tools()[which.other() as usize] == Some(&tool.name) {
                        self.release(which.other());
                    }
                    self.hands[which as usize] = Holds::Tool(tool);
                    return true;
                }
                match grip(point, *stiffness) {
                    Some((grip, taken)) => {
                        let at = self.grip_of(which);
                        self.grips.insert(at, grip);
                        self.taken.insert(at, taken);
                        self.hands[which as usize] = Holds::Tissue;
                    }
                    None => found = false,
                }
            }
            Hand::Turn(by) => {
                let Holds::Tool(tool) = &mut self.hands[which as usize] else { return true };
                let place = tool.held(&tool.goal);
                return tool.lead(&place, &(*by).into(), live);
            }
            Hand::Open(by) => {
                let Holds::Tool(tool) = &mut self.hands[which as usize] else { return true };
                return tool.open(*by, live);
            }
            Hand::Pull(place) => match &mut self.hands[which as usize] {
                Holds::Tool(tool) => return tool.lead(&(*place).into(), &Vector3::zeros(), live),
                Holds::Tissue => {
                    let at = self.grip_of(which);
                    self.taken[at].goal = Vector3::from(*place) - self.taken[at].offset;
                    self.stretch(at, live);
                }
                Holds::Nothing => {}
            },
            Hand::Release => self.release(which),
            Hand::Pin(point) => match grip(point, f64::INFINITY) {
                Some((grip, taken)) => {
                    self.grips.push(grip);
                    self.taken.push(taken);
                }
                None => found = false,
            },
            Hand::Unpin(pin) => {
                let at = pin + self.first_pin();
                if at < self.grips.len() {
                    self.grips.remove(at);
                    self.taken.remove(at);
                }
            }
        }
        self.grip(live) && found
    }

    /// Pulls the hands on towards their goals after a step. Their forces stay below their limits while the
    /// tissue gives way.
    pub fn follow(&mut self, live: &mut Live) {
        let mut moved = false;
        for at in 0..self.first_pin() {
            moved |= self.taken[at].longest.is_finite() && self.stretch(at, live);
        }
        if moved {
            self.grip(live);
        }
    }

    /// True if the end of a hand's spring moves with the tissue.
    pub fn follows(&self) -> bool {
        self.taken[..self.first_pin()].iter().any(|taken| taken.longest.is_finite())
    }

    /// Brings the end of a hand's spring as near to the goal as its length allows; whether it moves.
    fn stretch(&mut self, at: usize, live: &Live) -> bool {
        let (grip, Taken { goal, longest, .. }) = (&mut self.grips[at], self.taken[at]);
        let held = Vector3::from(live.simulation.pulled(grip)[0]);
        let way = goal - held;
        let length = way.norm();
        let place = if length > longest { held + way * (longest / length) } else { goal }.into();
        std::mem::replace(&mut grip.place, place) != place
    }

    /// Holds the same points in another run.
    pub(crate) fn grip_again(&mut self, live: &mut Live) -> bool {
        for hand in &mut self.hands {
            if matches!(hand, Holds::Tool(tool) if live.simulation.tool(&tool.name).is_none()) {
                *hand = Holds::Nothing;
            }
        }
        for (grip, taken) in self.grips.iter_mut().zip(&self.taken) {
            grip.stiffness = taken.stiffness.min(live.simulation.stiffest(grip));
        }
        self.grip(live)
    }

    fn grip(&mut self, live: &mut Live) -> bool {
        let held = live.simulation.grip(&self.grips);
        if !held {
            *self = Self::default();
        }
        held
    }

    fn release(&mut self, which: Which) {
        let at = self.grip_of(which);
        if let Holds::Tissue = std::mem::take(&mut self.hands[which as usize]) {
            self.grips.remove(at);
            self.taken.remove(at);
        }
    }
}

/// Makes a grip around a point, with the desired stiffness or the largest one that the step allows.
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

/// The first triangle that a ray meets, and where: Möller and Trumbore (1997), one triangle after the other.
/// A tree over a deforming surface would have to be renewed for each pick, which takes longer than looking at
/// all of its triangles.
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
