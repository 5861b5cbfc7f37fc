//! Growth of a motion or a load over time: a factor from 0 to 1 between two times, or a table.

use std::f64::consts::TAU;

/// A factor over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Its form.
    pub shape: Shape,
    /// Time [s] at which it leaves 0.
    pub from: f64,
    /// Time [s] at which it reaches 1 and stays there; of a wave, at which it is back at 0.
    pub to: f64,
}

/// The form of a curve.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// Linear; its kinks send waves through an explicit model.
    Ramp,
    /// 3s² − 2s³: continuous velocity.
    SmoothStep,
    /// 10s³ − 15s⁴ + 6s⁵: continuous acceleration.
    Polynomial,
    /// (1 − cos 2πs)/2, again and again: from 0 to 1 and back, with continuous velocity.
    Wave,
    /// 1 from the start.
    Hold,
    /// (time [s], factor), linear between the points, constant outside; times increase.
    Table(Vec<(f64, f64)>),
}

impl Curve {
    /// The factor at a time [s].
    pub fn value(&self, time: f64) -> f64 {
        match &self.shape {
            Shape::Hold => f64::from(u8::from(time >= self.from)),
            Shape::Table(points) => interpolate(points, time),
            Shape::Wave => {
                let s = (time - self.from).max(0.0) / (self.to - self.from);
                0.5 - 0.5 * (TAU * s).cos()
            }
            Shape::Ramp | Shape::SmoothStep | Shape::Polynomial => {
                let s = ((time - self.from) / (self.to - self.from)).clamp(0.0, 1.0);
                match self.shape {
                    Shape::Ramp => s,
                    Shape::SmoothStep => s * s * (3.0 - 2.0 * s),
                    _ => s * s * s * (10.0 + s * (6.0 * s - 15.0)),
                }
            }
        }
    }

    /// ∫ factor dt from 0 to a time [s]: the displacement that a velocity with this curve makes.
    pub fn integral(&self, time: f64) -> f64 {
        if let Shape::Table(points) = &self.shape {
            return integrate(points, time);
        }
        // ∫ before 0 never counts: curves start at 0 or later.
        let length = self.to - self.from;
        let s = ((time - self.from) / length).clamp(0.0, 1.0);
        let after = (time - self.to).max(0.0);
        match self.shape {
            Shape::Hold => (time - self.from).max(0.0),
            Shape::Wave => {
                let s = (time - self.from).max(0.0) / length;
                length * (0.5 * s - (TAU * s).sin() / (2.0 * TAU))
            }
            Shape::Ramp => length * s * s / 2.0 + after,
            Shape::SmoothStep => length * s * s * s * (1.0 - s / 2.0) + after,
            _ => length * s.powi(4) * (2.5 + s * (s - 3.0)) + after,
        }
    }

    /// Returns a curve that starts from 0: a value at time 0 is reached linearly at a time [s]. A static
    /// solver that halves its first load step needs this. A curve that begins at 0 stays unchanged.
    #[must_use]
    pub fn from_rest(self, until: f64) -> Self {
        match self.shape {
            Shape::Hold if self.from <= 0.0 => Self { shape: Shape::Ramp, from: 0.0, to: until },
            Shape::Table(ref points) if self.value(0.0) != 0.0 => {
                let later = points.iter().copied().filter(|&(time, _)| time > until);
                let eased = [(0.0, 0.0), (until, self.value(until))].into_iter().chain(later);
                Self { shape: Shape::Table(eased.collect()), ..self }
            }
            _ => self,
        }
    }

    /// The least and the largest factor of all times.
    pub fn range(&self) -> [f64; 2] {
        match &self.shape {
            Shape::Table(points) => {
                points.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], point| {
                    [low.min(point.1), high.max(point.1)]
                })
            }
            _ => [0.0, 1.0],
        }
    }
}

fn interpolate(points: &[(f64, f64)], time: f64) -> f64 {
    let next = points.partition_point(|&(t, _)| t <= time);
    match (next.checked_sub(1).map(|i| points[i]), points.get(next)) {
        (Some((t0, f0)), Some(&(t1, f1))) => f0 + (f1 - f0) * (time - t0) / (t1 - t0),
        (Some((_, f)), None) | (None, Some(&(_, f))) => f,
        (None, None) => 0.0,
    }
}

fn integrate(points: &[(f64, f64)], time: f64) -> f64 {
    let mut knots: Vec<f64> = points.iter().map(|&(t, _)| t).filter(|&t| t > 0.0 && t < time).collect();
    knots.insert(0, 0.0);
    knots.push(time);
    knots
        .windows(2)
        .map(|w| 0.5 * (interpolate(points, w[0]) + interpolate(points, w[1])) * (w[1] - w[0]))
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curves() -> Vec<Curve> {
        let table = Shape::Table(vec![(0.0, 0.0), (0.4, 1.0), (0.9, -0.5), (1.5, 0.2)]);
        [Shape::Ramp, Shape::SmoothStep, Shape::Polynomial, Shape::Wave, Shape::Hold, table]
            .map(|shape| Curve { shape, from: 0.25, to: 1.25 })
            .to_vec()
    }

    #[test]
    fn integral_is_the_area_under_the_curve() {
        for curve in curves() {
            for time in [0.1, 0.5, 1.0, 1.25, 2.0] {
                let n = 20_000;
                let h = time / f64::from(n);
                let sum: f64 = (0..n).map(|i| curve.value((f64::from(i) + 0.5) * h) * h).sum();
                assert!((curve.integral(time) - sum).abs() < 1e-4, "{curve:?} at {time}");
            }
        }
    }

    /// A value at the start is reached within a first step; later values are unchanged, and curves from 0
    /// keep their shape.
    #[test]
    fn curves_from_rest_begin_at_zero_and_are_the_same_later() {
        let table = |points: &[(f64, f64)]| Shape::Table(points.to_vec());
        let shapes = [Shape::Hold, table(&[(0.0, 0.5), (0.5, 1.0), (2.0, -1.0)]), table(&[(0.7, -0.3)])];
        for shape in shapes {
            let curve = Curve { shape, from: 0.0, to: 1.25 };
            let eased = curve.clone().from_rest(0.25);
            assert_eq!(eased.value(0.0), 0.0);
            assert!((eased.value(0.125) - 0.5 * curve.value(0.25)).abs() < 1e-15, "{curve:?}");
            for time in [0.25, 0.3, 0.5, 1.0, 1.9, 3.0] {
                assert!((eased.value(time) - curve.value(time)).abs() < 1e-15, "{curve:?} at {time}");
            }
        }
        for curve in curves() {
            assert_eq!(curve.clone().from_rest(0.25), curve);
        }
    }

    #[test]
    fn steps_start_at_zero_and_end_at_one() {
        for curve in &curves()[..3] {
            assert_eq!(curve.value(0.25), 0.0);
            assert_eq!(curve.value(1.25), 1.0);
            assert!((curve.value(0.75) - 0.5).abs() < 1e-15);
        }
    }
}
