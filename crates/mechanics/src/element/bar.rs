//! The bar of two nodes: a ligament, a chord of a valve, a thread. It carries force along its length only,
//! linear in its stretch.

use super::Rest;
use crate::tensor::{Vector, add, dot, scale, sub};

/// Slack and compression behaviour of bars.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cord {
    /// Length without force over the length at rest: above 1 hangs through, below 1 pulls from the start.
    pub slack: f64,
    /// True if the bar takes no compression, as a thread.
    pub tension_only: bool,
}

impl Default for Cord {
    /// Without force at rest, in tension and compression.
    fn default() -> Self {
        Self { slack: 1.0, tension_only: false }
    }
}

/// Stretch and stress of a bar in a state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pull {
    /// Length over that without force, λ.
    pub stretch: f64,
    /// Unit vector from the first node to the second; zero for a bar of no length.
    pub along: Vector<f64>,
    /// Length [m].
    pub length: f64,
    /// P = E (λ − 1) [Pa], and its derivative by λ: zero of a thread that hangs through.
    pub stress: [f64; 2],
}

/// The rest quantities of a bar from its nodes [m] and its cross section [m²].
pub fn bar(x: &[Vector<f64>; 2], area: f64) -> Rest<2> {
    let between = sub(x[1], x[0]);
    let square = dot(between, between);
    let gradient = scale(between, 1.0 / square);
    Rest { volume: area * square.sqrt(), gradient: [scale(gradient, -1.0), gradient] }
}

impl Rest<2> {
    /// Length [m] of a bar at rest.
    pub fn length(&self) -> f64 {
        1.0 / dot(self.gradient[1], self.gradient[1]).sqrt()
    }

    /// The second node from the first [m] at rest.
    pub fn between(&self) -> Vector<f64> {
        scale(self.gradient[1], self.length().powi(2))
    }

    /// Cross section [m²] of a bar at rest.
    pub fn area(&self) -> f64 {
        self.volume / self.length()
    }
}

impl Cord {
    /// Returns the pull of a bar of Young's modulus `young` [Pa] whose second node has moved by `moved` [m]
    /// relative to the first. The change of length is found without cancellation.
    pub fn pull(&self, rest: &Rest<2>, moved: Vector<f64>, young: f64) -> Pull {
        let (before, from) = (rest.between(), rest.length());
        let now = add(before, moved);
        let length = dot(now, now).sqrt();
        let longer = dot(moved, add(scale(before, 2.0), moved)) / (from + length);
        let strain = (longer + (1.0 - self.slack) * from) / (self.slack * from);
        let hangs = self.tension_only && strain <= 0.0;
        let along = if length > 0.0 { scale(now, 1.0 / length) } else { [0.0; 3] };
        let stress = if hangs { [0.0; 2] } else { [young * strain, young] };
        Pull { stretch: 1.0 + strain, along, length, stress }
    }

    /// Strain energy [J] of such a bar, ½ E (λ − 1)² of the volume that it has without force.
    pub fn energy(&self, rest: &Rest<2>, pull: &Pull) -> f64 {
        0.5 * pull.stress[0] * (pull.stretch - 1.0) * self.slack * rest.volume
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ENDS: [Vector<f64>; 2] = [[0.1, 0.2, 0.0], [0.1, 0.5, 0.4]];

    #[test]
    fn the_force_is_the_derivative_of_the_energy_and_a_thread_hangs_through() {
        let rest = bar(&ENDS, 2e-6);
        assert!((rest.length() - 0.5).abs() < 1e-15 && (rest.area() - 2e-6).abs() < 1e-20);
        for slack in [1.0, 0.9, 1.05] {
            for tension_only in [false, true] {
                let cord = Cord { slack, tension_only };
                let energy = |moved: Vector<f64>| cord.energy(&rest, &cord.pull(&rest, moved, 3e6));
                for moved in [[0.02, 0.05, 0.01], [-0.01, -0.06, -0.03], [0.3, -0.2, -0.5]] {
                    let pull = cord.pull(&rest, moved, 3e6);
                    let force = pull.stress[0] * rest.area();
                    for c in 0..3 {
                        let beside = |by: f64| {
                            let mut beside = moved;
                            beside[c] += by;
                            energy(beside)
                        };
                        let slope = (beside(1e-7) - beside(-1e-7)) / 2e-7;
                        assert!((slope - force * pull.along[c]).abs() < 1e-6, "{slack} {tension_only} {c}");
                    }
                    assert!(!tension_only || force >= 0.0);
                }
            }
        }
    }

    /// A strain of 1e-12 keeps four digits.
    #[test]
    fn small_strains_keep_their_digits() {
        let rest = bar(&ENDS, 1e-6);
        let moved = scale(sub(ENDS[1], ENDS[0]), 1e-12);
        let [stress, _] = Cord::default().pull(&rest, moved, 1.0).stress;
        assert!((stress / 1e-12 - 1.0).abs() < 1e-4, "{stress}");
    }
}
