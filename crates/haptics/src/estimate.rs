//! Estimate of the tissue's stiffness from the tool's places p and forces F in successive steps of the
//! simulation. The stiffness along the force is the slope of the pairs Δd = −n·Δp, ΔF = n·(F − F'), by least
//! squares that forget:
//!
//! ```text
//! k = (k₀ s + Σ γʲ Δd ΔF) / (s + Σ γʲ Δd²)
//! ```
//!
//! with a first guess k₀ of the weight s. Across the force, a body that keeps its volume gives way 1.5 times
//! as much: (1 − ν/2) / (1 − ν) at ν = 0.5 (Mindlin 1949, a round contact that sticks). The estimate is held
//! in bounds. It sets how the force changes between two models. At rest the simulation sets the force. An
//! estimate k_m above the tissue's stiffness k is safe. One below (k − K)/2 is not, with the stiffness K of
//! the coupling. A step of the simulation then changes the force by more than its error, by −(k − k_m) / (K +
//! k_m).
//!
//! ```
//! use nalgebra::Vector3;
//! use pliant_haptics::estimate::Estimate;
//!
//! let mut estimate = Estimate::new(1000.0, [100.0, 5000.0]);
//! for step in 0..100 {
//!     let depth = 2e-4 * f64::from(step);
//!     estimate.add(-Vector3::z() * depth, Vector3::z() * (400.0 * depth));
//! }
//! assert!((estimate.stiffness() - 400.0).abs() < 5.0);
//! ```

use nalgebra::{Matrix3, Vector3};

/// Part of the earlier sums that remains after the next step.
const KEPT: f64 = 0.95;
/// Way [m] below which a step teaches nothing, so that a tool at rest forgets nothing.
const STILL: f64 = 2e-6;
/// Weight [m²] of the first guess: as much as a way of 0.05 mm.
const GUESS: f64 = 2.5e-9;
/// Compliance across the force over that along it.
const ACROSS: f64 = 1.5;

/// The stiffness of the tissue around a tool.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    guess: f64,
    bounds: [f64; 2],
    last: Option<(Vector3<f64>, Vector3<f64>)>,
    /// Σ Δd ΔF [N m] and Σ Δd² [m²].
    sums: [f64; 2],
}

impl Estimate {
    /// From a guess [N/m], within bounds [N/m].
    pub fn new(guess: f64, bounds: [f64; 2]) -> Self {
        Self { guess, bounds, last: None, sums: [0.0; 2] }
    }

    /// Takes the place [m] of the tool after a step and the force [N] on it. Steps without force teach
    /// nothing.
    pub fn add(&mut self, place: Vector3<f64>, force: Vector3<f64>) {
        let last = self.last.replace((place, force));
        let Some((before, force_before)) = last else { return };
        let Some(normal) = (force + force_before).try_normalize(1e-9) else { return };
        if force == Vector3::zeros() || force_before == Vector3::zeros() {
            return;
        }
        let deeper = -normal.dot(&(place - before));
        if deeper.abs() < STILL {
            return;
        }
        let more = normal.dot(&(force - force_before));
        let [product, square] = &mut self.sums;
        *product = KEPT * *product + deeper * more;
        *square = KEPT * *square + deeper * deeper;
    }

    /// Stiffness [N/m] along the force.
    pub fn stiffness(&self) -> f64 {
        let [product, square] = self.sums;
        let [low, high] = self.bounds;
        ((self.guess * GUESS + product) / (GUESS + square)).max(low).min(high)
    }

    /// Compliance [m/N] of a tool on which a force acts along a direction of length 1.
    pub fn compliance(&self, normal: &Vector3<f64>) -> Matrix3<f64> {
        let along = normal * normal.transpose();
        (along + (Matrix3::identity() - along) * ACROSS) / self.stiffness()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_estimate_follows_the_tissue_and_keeps_to_its_bounds() {
        let mut estimate = Estimate::new(300.0, [200.0, 2000.0]);
        assert_eq!(estimate.stiffness(), 300.0);
        let normal = Vector3::new(0.6, 0.0, 0.8);
        let mut press = |stiffness: f64| {
            for step in 0..200 {
                let depth = 0.01 + 0.003 * (0.2 * f64::from(step)).sin();
                estimate.add(normal * -depth, normal * (stiffness * depth));
            }
            estimate.stiffness()
        };
        // The guess still has a weight of 2.5e-9 in about 0.0006² / 2 / 0.05 = 3.6e-6 m².
        assert!((press(800.0) - 800.0).abs() < 2e-3 * 800.0);
        assert!((press(1500.0) - 1500.0).abs() < 2e-3 * 1500.0);
        assert_eq!((press(10.0), press(1e5)), (200.0, 2000.0));
        let depth = 0.01 + 0.003 * (0.2 * 199.0_f64).sin();
        for _ in 0..1000 {
            estimate.add(normal * -depth, normal);
        }
        assert_eq!(estimate.stiffness(), 2000.0, "a tool at rest forgets nothing");
        let compliance = estimate.compliance(&normal);
        assert!((compliance * normal - normal / 2000.0).norm() < 1e-15);
        assert!((compliance * Vector3::y() - Vector3::y() * 1.5 / 2000.0).norm() < 1e-15);
    }
}
