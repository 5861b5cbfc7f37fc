//! Tools and moved nodes that push with no more than a force: how far they lag behind their trajectory.
//!
//! A hand that meets something stiffer than it can bear comes to rest there, and moves again when it is
//! called back. A tool with a limit does the same. It goes a part of its way against what it pushes. The part
//! falls from 1 at half of the limit over 0 at the limit to −1. The rest of the way is its lag, which it
//! makes good over time.
//!
//! ```
//! use nalgebra::Vector3;
//! use pliant_contact::lag::Lag;
//!
//! // Pushed by 0.1 m/s against a spring of 100 N/m with a limit of 2 N, it stops at 20 mm.
//! let mut lag = Lag::new(0);
//! for step in 0..10_000 {
//!     let depth = 0.1 * 1e-3 * f64::from(step) + lag.now().z;
//!     lag.follow(2.0, Vector3::z() * 1e-4, 1e-3);
//!     lag.found(Vector3::z() * (100.0 * depth));
//!     lag.advance(1e-3 * f64::from(step));
//! }
//! let depth = 0.1 * 10.0 + lag.now().z;
//! assert!((depth - 0.02).abs() < 1e-3);
//! ```

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Time [s] in which most of a lag is made good where nothing is in the way.
const CATCHES_UP: f64 = 0.3;
/// Time [s] over which forces are averaged: forces of single steps jump where nodes enter or leave contact.
const FELT: f64 = 0.01;

/// The lag of a rigid thing or of moved nodes behind their trajectory.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lag {
    number: u32,
    /// Way [m] from its place on the trajectory to its real place, before and after the step.
    ways: [[f64; 3]; 2],
    /// The force [N] with which it pushes: on average until the step before, and in this one.
    forces: [[f64; 3]; 2],
    /// Length of this step [s].
    step: f64,
    /// The longest lag so far [m], and when it was that [s].
    longest: (f64, f64),
}

impl Lag {
    /// Makes a lag without way. `number` is the index of a thing among the rigid things of the contacts, or
    /// of the constraint of moved nodes in its model.
    pub fn new(number: u32) -> Self {
        Self { number, ways: [[0.0; 3]; 2], forces: [[0.0; 3]; 2], step: 0.0, longest: (0.0, 0.0) }
    }

    /// The place of the thing or of the constraint.
    pub fn number(&self) -> usize {
        self.number as usize
    }

    /// Returns the way [m] from its place on the trajectory to its real place.
    pub fn now(&self) -> Vector3<f64> {
        self.ways[0].into()
    }

    /// Returns the lag [m] after the step.
    pub fn next(&self) -> Vector3<f64> {
        self.ways[1].into()
    }

    /// The longest lag so far [m], and when it was that [s].
    pub fn longest(&self) -> (f64, f64) {
        self.longest
    }

    /// The force [N] with which it pushes, on average.
    pub fn force(&self) -> Vector3<f64> {
        self.forces[0].into()
    }

    /// The part of a way against what it pushes that a thing goes, if it pushes with a force [N] under a
    /// limit [N].
    pub fn part(force: f64, limit: f64) -> f64 {
        (2.0 * (1.0 - force / limit)).clamp(-1.0, 1.0)
    }

    /// Finds the lag after a step of a length [s], over which the trajectory goes a way [m], under a limit
    /// [N].
    pub fn follow(&mut self, limit: f64, way: Vector3<f64>, step: f64) {
        self.go(self.force(), Self::part(self.force().norm(), limit), way, step);
    }

    /// Finds the lag after a step of a length [s], over which the trajectory goes a way [m]. The thing goes
    /// only a part of the way along the force [N] with which it pushes. Returns the full length [m] of that
    /// way.
    pub fn go(&mut self, force: Vector3<f64>, part: f64, way: Vector3<f64>, step: f64) -> f64 {
        let mut wanted = way - self.now() * (step / CATCHES_UP).min(1.0);
        let ahead = force.try_normalize(0.0).unwrap_or_default();
        let into = wanted.dot(&ahead).max(0.0);
        wanted -= ahead * (into * (1.0 - part));
        self.ways[1] = (self.now() + wanted - way).into();
        self.step = step;
        into
    }

    /// Stands by a way [m] off the trajectory after the step.
    pub fn stand(&mut self, way: Vector3<f64>) {
        self.ways[1] = way.into();
    }

    /// Takes the force [N] with which it pushes in this step.
    pub fn found(&mut self, force: Vector3<f64>) {
        self.forces[1] = force.into();
    }

    /// Advances to the end of the step, a time [s].
    pub fn advance(&mut self, time: f64) {
        self.ways[0] = self.ways[1];
        let [mean, found] = self.forces.map(Vector3::from);
        self.forces[0] = mean.lerp(&found, (self.step / FELT).min(1.0)).into();
        let size = self.now().norm();
        if size > self.longest.0 {
            self.longest = (size, time);
        }
    }

    /// True if all numbers are finite.
    pub fn is_finite(&self) -> bool {
        let numbers = self.ways.iter().chain(&self.forces).flatten();
        numbers.chain([&self.step, &self.longest.0, &self.longest.1]).all(|x| x.is_finite())
    }
}
