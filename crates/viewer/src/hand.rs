//! The hand and the pins that hold a body, and recordings of what they did.

use pliant_geometry::Vector3;
use pliant_mechanics::Model;
use pliant_mechanics::grip::Grip;
use pliant_picture::Subject;
use pliant_scene::Live;
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
    /// Takes hold of a point, by a spring of a stiffness [N/m].
    Take(Point, f64),
    /// Pulls what it holds towards a place [m].
    Pull([f64; 3]),
    /// Lets go.
    Release,
    /// Pins a point where it is.
    Pin(Point),
    /// Removes a pin, counted from 0.
    Unpin(usize),
}

/// What is held at the moment: by the hand first, then by pins.
#[derive(Clone, Debug, Default)]
pub struct Hold {
    grips: Vec<Grip>,
    by_hand: bool,
}

/// A point as a combination of nodes of the model.
fn nodes_of(point: &Point, subject: &Subject, live: &dyn Live) -> Option<Vec<(u32, f64)>> {
    let corners = subject.triangles().nth(point.triangle as usize)?;
    let mut nodes: Vec<(u32, f64)> = Vec::new();
    for (corner, weight) in corners.into_iter().zip(point.weights) {
        for (node, own) in live.nodes_of(corner) {
            match nodes.iter_mut().find(|(known, _)| *known == node) {
                Some((_, sum)) => *sum += own * weight,
                None => nodes.push((node, own * weight)),
            }
        }
    }
    (!nodes.is_empty()).then_some(nodes)
}

impl Hold {
    /// Everything that is held.
    pub fn grips(&self) -> &[Grip] {
        &self.grips
    }

    /// Whether the first of them is the hand's.
    pub fn by_hand(&self) -> bool {
        self.by_hand
    }

    /// Does what hand and pins do; the stiffness stays below what leaves steps [s] stable.
    pub fn take(&mut self, hand: &Hand, model: &Model, step: f64, subject: &Subject, live: &mut dyn Live) {
        match hand {
            Hand::Take(point, stiffness) => {
                self.release();
                let Some(nodes) = nodes_of(point, subject, live) else { return };
                let grip = grip(nodes, *stiffness, model, step, live);
                self.grips.insert(0, grip);
                self.by_hand = true;
            }
            Hand::Pull(place) if self.by_hand => self.grips[0].place = *place,
            Hand::Pull(_) => {}
            Hand::Release => self.release(),
            Hand::Pin(point) => {
                let Some(nodes) = nodes_of(point, subject, live) else { return };
                self.grips.push(grip(nodes, f64::INFINITY, model, step, live));
            }
            Hand::Unpin(pin) => {
                let at = pin + usize::from(self.by_hand);
                if at < self.grips.len() {
                    self.grips.remove(at);
                }
            }
        }
        if !live.hold(&self.grips) {
            self.grips.clear();
            self.by_hand = false;
        }
    }

    fn release(&mut self) {
        if std::mem::take(&mut self.by_hand) {
            self.grips.remove(0);
        }
    }
}

/// A grip where its point is, as stiff as asked for or as steps allow.
fn grip(nodes: Vec<(u32, f64)>, stiffness: f64, model: &Model, step: f64, live: &dyn Live) -> Grip {
    let mut grip = Grip { nodes, place: [0.0; 3], stiffness: 0.0 };
    grip.stiffness = stiffness.min(grip.stiffest(model, step));
    grip.place = live.pulled(&grip)[0];
    grip
}

/// What was held from which step on.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Recording {
    /// Steps done before, and what was held then; whether the hand held the first of it.
    pub moves: Vec<(u64, Vec<Grip>, bool)>,
    /// Steps in all.
    pub steps: u64,
}

impl Recording {
    /// As bytes that keep every bit.
    ///
    /// # Errors
    /// Never in practice: memory that ran out.
    pub fn to_bytes(&self) -> Result<Vec<u8>, String> {
        postcard::to_stdvec(self).map_err(|error| error.to_string())
    }

    /// From these bytes.
    ///
    /// # Errors
    /// If they are no recording.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        postcard::from_bytes(bytes).map_err(|error| error.to_string())
    }
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
        if determinant == 0.0 {
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
