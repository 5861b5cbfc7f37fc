//! The outline of a body of revolution: lines and arcs in the half-plane of height and distance from the
//! axis. It has no corners, so that the direction of the signed distance is continuous near the surface.

use nalgebra::Vector2;

/// A point of a path (z, r) [m] from below upwards, rounded by a radius [m].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// Height and distance from the axis [m].
    pub at: [f64; 2],
    /// Radius [m] of the arc in its place. Of the first and the last corner it counts for nothing.
    pub rounding: f64,
}

/// Reasons why corners make no outline.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ProfileError {
    /// Too few corners.
    #[error("an outline has two points or more")]
    TooShort,
    /// A corner at a negative distance from the axis, or on it between the ends.
    #[error("point {0} of the outline lies on the axis or beyond; only the first and the last may be on it")]
    OffSide(usize),
    /// Two corners in one place.
    #[error("points {0} and {1} of the outline are in one place")]
    Same(usize, usize),
    /// A corner that turns by no radius, or back.
    #[error("point {0} of the outline needs a rounding above 0, and may not turn back")]
    Sharp(usize),
    /// Arcs that overlap.
    #[error(
        "the roundings of points {0} and {1} of the outline need {2} m between them, where there are {3} m"
    )]
    TooRound(usize, usize, f64, f64),
}

/// A piece of the outline.
#[derive(Clone, Copy, Debug)]
enum Piece {
    /// A line from a point along a unit direction over a length [m], with the direction to its outside.
    Line { from: Vector2<f64>, along: Vector2<f64>, length: f64, out: Vector2<f64> },
    /// Around a centre, with the unit direction to its middle and the cosine of half of its angle. The sign
    /// is 1 for a convex arc and −1 for a concave one.
    Arc { centre: Vector2<f64>, middle: Vector2<f64>, cosine: f64, radius: f64, sign: f64 },
}

/// The outline of a body of revolution about the z axis: all to the right of the path is in it. Beyond an end
/// that is not on the axis the path goes straight on.
#[derive(Clone, Debug)]
pub struct Profile {
    corners: Vec<Corner>,
    pieces: Vec<Piece>,
}

impl Profile {
    /// Makes the outline of corners from below upwards.
    ///
    /// # Errors
    /// If there are less than two, one is beyond the axis, or arcs don't fit between them.
    pub fn new(corners: Vec<Corner>) -> Result<Self, ProfileError> {
        let (count, place) = (corners.len(), |k: usize| Vector2::from(corners[k].at));
        if count < 2 {
            return Err(ProfileError::TooShort);
        }
        let beyond = |&k: &usize| {
            let r = corners[k].at[1];
            r < 0.0 || r == 0.0 && k > 0 && k + 1 < count
        };
        if let Some(k) = (0..count).find(beyond) {
            return Err(ProfileError::OffSide(k));
        }
        let mut ways = Vec::with_capacity(count - 1);
        for k in 1..count {
            let way = place(k) - place(k - 1);
            let along = way.try_normalize(0.0).ok_or(ProfileError::Same(k - 1, k))?;
            ways.push((along, way.norm()));
        }
        // How far from each corner its arc begins.
        let mut cut = vec![0.0; count];
        let mut pieces = Vec::new();
        for k in 1..count - 1 {
            let [from, to] = [ways[k - 1].0, ways[k].0];
            let (turn, cosine) = (from.perp(&to), from.dot(&to));
            if turn == 0.0 && cosine > 0.0 {
                continue;
            }
            let radius = corners[k].rounding;
            // The tangent of half of the angle that it turns by.
            let tangent = turn.abs() / (1.0 + cosine);
            if radius <= 0.0 || !tangent.is_finite() {
                return Err(ProfileError::Sharp(k));
            }
            cut[k] = radius * tangent;
            // To the left of the path is outside.
            let sign = -turn.signum();
            let away = Vector2::new(-from.y, from.x) * -sign;
            let centre = place(k) - from * cut[k] + away * radius;
            let middle = (from - to).normalize();
            let half = tangent.hypot(1.0).recip();
            pieces.push(Piece::Arc { centre, middle, cosine: half, radius, sign });
        }
        for (k, (along, length)) in ways.into_iter().enumerate() {
            let needed = cut[k] + cut[k + 1];
            if needed > length {
                return Err(ProfileError::TooRound(k, k + 1, needed, length));
            }
            let (from, out) = (place(k) + along * cut[k], Vector2::new(-along.y, along.x));
            pieces.push(Piece::Line { from, along, length: length - needed, out });
            if k == 0 && from.y > 0.0 {
                pieces.push(Piece::Line { from, along: -along, length: f64::INFINITY, out });
            }
            if k + 2 == count && place(count - 1).y > 0.0 {
                pieces.push(Piece::Line { from, along, length: f64::INFINITY, out });
            }
        }
        Ok(Self { corners, pieces })
    }

    /// Its corners.
    pub fn corners(&self) -> &[Corner] {
        &self.corners
    }

    /// The least distance [m] of a corner from the axis that is not on it.
    pub(crate) fn least_radius(&self) -> f64 {
        self.corners.iter().map(|corner| corner.at[1]).filter(|&r| r > 0.0).fold(f64::INFINITY, f64::min)
    }

    /// Radius [m] around the origin of its corners.
    pub fn reach(&self) -> f64 {
        self.corners.iter().map(|corner| Vector2::from(corner.at).norm()).fold(0.0, f64::max)
    }

    /// The signed distance [m] of a point (z, r), and the direction in which it grows.
    pub fn near(&self, point: Vector2<f64>) -> (f64, Vector2<f64>) {
        let mut best = (f64::INFINITY, Vector2::y());
        for piece in &self.pieces {
            let found = match *piece {
                Piece::Line { from, along, length, out } => {
                    let from = point - from;
                    let away = from - along * from.dot(&along).clamp(0.0, length);
                    let distance = away.norm();
                    let sign = if away.dot(&out) < 0.0 { -1.0 } else { 1.0 };
                    (sign * distance, if distance > 0.0 { away * (sign / distance) } else { out })
                }
                Piece::Arc { centre, middle, cosine, radius, sign } => {
                    let from = point - centre;
                    let length = from.norm();
                    if length == 0.0 || from.dot(&middle) < cosine * length {
                        continue;
                    }
                    (sign * (length - radius), from * (sign / length))
                }
            };
            if found.0.abs() < best.0.abs() {
                best = found;
            }
        }
        best
    }

    /// Points (r, z) [m] along the outline, with `on_arc` points on each arc, from the axis to the axis if
    /// the outline ends there.
    pub(crate) fn drawn(&self, on_arc: u32) -> Vec<[f64; 2]> {
        let mut points = Vec::new();
        let mut arcs = self.pieces.iter().filter_map(|piece| match piece {
            Piece::Arc { centre, middle, cosine, radius, sign } => {
                Some((*centre, *middle, *cosine, *radius, *sign))
            }
            Piece::Line { .. } => None,
        });
        for (k, corner) in self.corners.iter().enumerate() {
            let place = Vector2::from(corner.at);
            let turns = k > 0 && k + 1 < self.corners.len() && {
                let [from, to] = [k - 1, k + 1].map(|other| Vector2::from(self.corners[other].at) - place);
                from.perp(&to) != 0.0
            };
            match if turns { arcs.next() } else { None } {
                Some((centre, middle, cosine, radius, sign)) => {
                    let half = cosine.acos();
                    points.extend((0..=on_arc).map(|step| {
                        let angle = half * (2.0 * f64::from(step) / f64::from(on_arc) - 1.0) * -sign;
                        let x = centre + nalgebra::Rotation2::new(angle) * middle * radius;
                        [x.y, x.x]
                    }));
                }
                None => points.push([place.y, place.x]),
            }
        }
        points
    }
}

#[cfg(test)]
mod tests {
    use pliant_testing::Random;

    use super::*;

    fn corner(z: f64, r: f64, rounding: f64) -> Corner {
        Corner { at: [z, r], rounding }
    }

    /// A funnel, a tube and a bag with a flat end.
    fn bag() -> Profile {
        let corners = vec![
            corner(-1.0, 2.0, 0.0),
            corner(0.0, 2.0, 0.5),
            corner(2.0, 0.5, 0.5),
            corner(4.0, 0.5, 0.2),
            corner(4.0, 3.0, 1.0),
            corner(7.0, 3.0, 1.2),
            corner(7.0, 0.0, 0.0),
        ];
        Profile::new(corners).unwrap()
    }

    #[test]
    fn distances_are_those_of_geometry() {
        let profile = bag();
        let at = |z: f64, r: f64| profile.near(Vector2::new(z, r));
        // Before its first end, in the tube, in front of the end, and in the wall around the tube.
        assert!((at(-9.0, 1.5).0 + 0.5).abs() < 1e-12);
        assert!((at(3.0, 0.2).0 + 0.3).abs() < 1e-12);
        assert!((at(6.9, 0.0).0 + 0.1).abs() < 1e-12 && (at(7.5, 0.0).0 - 0.5).abs() < 1e-12);
        assert!((at(3.0, 1.0).0 - 0.5).abs() < 1e-12);
        // The rounding of the mouth: from its centre in the wall, and from within the bag.
        assert!((at(3.8, 0.7).0 - 0.2).abs() < 1e-12);
        assert!((at(4.0, 0.5).0 + 0.2 * (2.0_f64.sqrt() - 1.0)).abs() < 1e-12);
        // In the corner of the bag: from the centre of its arc.
        assert!((at(5.8, 1.8).0 + 1.2).abs() < 1e-12);
    }

    /// The direction is the gradient of the distance, which is zero on the outline that is drawn, and its
    /// direction does not jump there.
    #[test]
    fn directions_are_gradients_without_jumps_at_the_outline() {
        let profile = bag();
        let mut random = Random::new(5);
        for drawn in profile.drawn(8) {
            let on = Vector2::new(drawn[1], drawn[0]);
            assert!(profile.near(on).0.abs() < 1e-12, "{on}");
            if on.y < 1e-3 || on.x < -0.9 {
                continue;
            }
            for _ in 0..20 {
                let shift = Vector2::new(random.number(), random.number());
                let point = on + shift * 0.05;
                let (distance, direction) = profile.near(point);
                let h = 1e-7;
                let slope =
                    |by: Vector2<f64>| (profile.near(point + by).0 - profile.near(point - by).0) / (2.0 * h);
                let found = Vector2::new(slope(Vector2::x() * h), slope(Vector2::y() * h));
                assert!((found - direction).norm() < 1e-5, "{point}: {found} {direction}");
                let mirrored = profile.near(point - direction * (2.0 * distance));
                assert!(
                    (mirrored.0 + distance).abs() < 1e-9 && (mirrored.1 - direction).norm() < 1e-6,
                    "{point}"
                );
            }
        }
    }

    #[test]
    fn corners_that_make_no_outline_are_refused() {
        let of = |corners: &[Corner]| Profile::new(corners.to_vec()).unwrap_err();
        let (first, last) = (corner(0.0, 1.0, 0.0), corner(2.0, 0.0, 0.0));
        assert_eq!(of(&[first]), ProfileError::TooShort);
        assert_eq!(of(&[first, corner(1.0, -1.0, 0.1), last]), ProfileError::OffSide(1));
        assert_eq!(of(&[first, corner(1.0, 0.0, 0.1), last]), ProfileError::OffSide(1));
        assert_eq!(of(&[first, first, last]), ProfileError::Same(0, 1));
        assert_eq!(of(&[first, corner(2.0, 1.0, 0.0), last]), ProfileError::Sharp(1));
        assert_eq!(of(&[first, corner(2.0, 1.0, 0.1), first]), ProfileError::Sharp(1));
        assert!(matches!(of(&[first, corner(2.0, 1.0, 1.5), last]), ProfileError::TooRound(1, 2, ..)));
    }
}
