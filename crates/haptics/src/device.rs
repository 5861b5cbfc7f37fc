//! What the haptic thread needs of a device: a pose when it is due, and someone who feels the force.

use std::time::{Duration, Instant};

use nalgebra::Isometry3;

use crate::renderer::Answer;

/// A pose that has come in.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Of the tool in the scene [m]; numbers that are not finite hold the last one.
    pub pose: Isometry3<f64>,
    /// A bit for each button that is pressed.
    pub buttons: u32,
    /// Opening of its jaws, from 0 (closed) to 1.
    pub opening: f64,
    /// When it came, or was due.
    pub arrived: Instant,
}

/// What a device does next.
#[derive(Clone, Copy, Debug)]
pub enum Event {
    /// It is somewhere.
    Pose(Sample),
    /// No pose came in time.
    Silence,
    /// It has gone for good.
    Over,
}

/// Packets of a device by what became of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Answered.
    pub used: u64,
    /// Of another length, magic, version or kind.
    pub malformed: u64,
    /// Not after the last one used: twice, or out of order.
    pub late: u64,
    /// Overtaken by a newer one that had come, too; of a replay those that its thread came too late for.
    pub overtaken: u64,
    /// From another sender than the device.
    pub foreign: u64,
    /// Answers that could not be sent, and failures of the socket.
    pub failed: u64,
}

/// A device.
pub trait Device {
    /// Waits for the next pose, about as long as that.
    fn next(&mut self, patience: Duration) -> Event;

    /// Makes it feel the force of the last pose.
    fn feel(&mut self, answer: &Answer);

    /// What became of its packets.
    fn counts(&self) -> Counts;
}
