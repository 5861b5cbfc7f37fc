//! A simulated device in a simulated hand. The device has a mass m and a friction b of its bearings. A spring
//! and a damper of the hand pull it to the wanted place,
//!
//! ```text
//! m ẍ = F + k (x_w − x) + c (ẋ_w − ẋ) − b ẋ
//! ```
//!
//! with the force F held over a tick, as an amplifier does. The simulation finds how stiff a coupling may be
//! before the device trembles. Numbers of a hand: Hasser and Cutkosky (2002), "System identification of the
//! human hand grasping a haptic knob": tens to hundreds of N/m.

use nalgebra::{Isometry3, Vector3};

use crate::coupling::Coupling;
use crate::error::HapticsError;
use crate::model::LocalModel;
use crate::renderer::{Renderer, Settings};

/// Steps of a tick.
const STEPS: u32 = 20;

/// A device and the hand that holds it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hand {
    /// Mass of the device [kg].
    pub mass: f64,
    /// Damping of its bearings [N s/m].
    pub friction: f64,
    /// Stiffness of the hand [N/m].
    pub stiffness: f64,
    /// Damping of the hand [N s/m].
    pub damping: f64,
}

impl Default for Hand {
    /// A light device of 0.1 kg and 1 N s/m, held with 300 N/m and 3 N s/m.
    fn default() -> Self {
        Self { mass: 0.1, friction: 1.0, stiffness: 300.0, damping: 3.0 }
    }
}

/// Place and velocity of the device.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Held {
    /// Its place [m].
    pub place: Vector3<f64>,
    /// Its velocity [m/s].
    pub velocity: Vector3<f64>,
}

impl Hand {
    /// Moves the device over a time [s] under a force [N], while the hand wants to go from one place [m] to
    /// another.
    pub fn go(&self, held: &mut Held, force: &Vector3<f64>, [from, to]: [Vector3<f64>; 2], time: f64) {
        let step = time / f64::from(STEPS);
        let speed = (to - from) / time;
        for k in 1..=STEPS {
            let wanted = from.lerp(&to, f64::from(k) / f64::from(STEPS));
            // Implicit in the dampers and the hand's spring, so that any stiffness and damping is stable.
            let pull = (wanted - held.place) * self.stiffness + speed * self.damping + force;
            let slow = self.mass + step * (self.friction + self.damping + step * self.stiffness);
            held.velocity = (held.velocity * self.mass + pull * step) / slow;
            held.place += held.velocity * step;
        }
    }

    /// Returns the stiffest coupling [N/m], to 5 % and between 1 and 10⁶ N/m, that lets this device come to
    /// rest on a model. The hand is pressed into the model by a depth [m]. Without a guard, the result shows
    /// the limit of the coupling itself.
    ///
    /// # Errors
    /// If a setting is out of range.
    pub fn stiffest(&self, model: &LocalModel, settings: Settings, depth: f64) -> Result<f64, HapticsError> {
        let (mut low, mut high) = (1.0_f64, 1e6_f64);
        while high / low > 1.05 {
            let middle = (low * high).sqrt();
            let coupling = Coupling { stiffness: middle, ..settings.coupling };
            if self.rests(model, Settings { coupling, ..settings }, depth)? {
                low = middle
            } else {
                high = middle
            }
        }
        Ok(low)
    }

    /// Returns true if the device comes to rest when it is pressed for five seconds. In the last second its
    /// largest movement in a tick is below 1 µm, or a tenth less than in the second before.
    fn rests(&self, model: &LocalModel, settings: Settings, depth: f64) -> Result<bool, HapticsError> {
        let mut renderer = Renderer::new(settings)?;
        renderer.take(model.clone());
        let Some(plane) = model.planes().first() else { return Ok(true) };
        let from = model.unloaded() - plane.normal * plane.gap;
        let to = from - plane.normal * depth;
        let mut held = Held { place: from, velocity: Vector3::zeros() };
        let second = (1.0 / settings.period) as u32;
        let mut most = [0.0_f64; 5];
        for most in &mut most {
            for _ in 0..second {
                let before = held.place;
                let force = renderer.tick(&Isometry3::from(held.place)).force;
                self.go(&mut held, &force, [to, to], settings.period);
                *most = most.max((held.place - before).norm());
            }
        }
        let [.., before, last] = most;
        Ok(last < 1e-6 || last < 0.9 * before)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A weight on a spring and in a hand hangs where the forces balance; its bearing takes energy.
    #[test]
    fn a_held_device_comes_to_rest_where_forces_balance() {
        let hand = Hand::default();
        let mut held = Held::default();
        let wanted = Vector3::x() * 0.01;
        for _ in 0..2000 {
            hand.go(&mut held, &Vector3::z(), [wanted; 2], 1e-3);
        }
        let expected = wanted + Vector3::z() / hand.stiffness;
        assert!((held.place - expected).norm() < 1e-9 && held.velocity.norm() < 1e-9);
    }
}
