//! Interface of a device to the haptic thread. It gives a pose when one is due, and takes the force.

use std::time::{Duration, Instant};

use nalgebra::Isometry3;

use crate::renderer::Answer;

/// A pose that has come in.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Pose of the tool in the scene [m]. A pose with numbers that are not finite counts as invalid, and the
    /// last one holds.
    pub pose: Isometry3<f64>,
    /// A bit for each button that is pressed.
    pub buttons: u32,
    /// Opening of its jaws, from 0 (closed) to 1.
    pub opening: f64,
    /// Instant at which the pose arrived, or was due.
    pub arrived: Instant,
}

/// Next event of a device.
#[derive(Clone, Copy, Debug)]
pub enum Event {
    /// The device has a pose.
    Pose(Sample),
    /// No pose came in time.
    Silence,
    /// The device has gone for good.
    Over,
}

/// Numbers of packets of a device by their fate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Answered.
    pub used: u64,
    /// Packets of another length, magic, version or kind.
    pub malformed: u64,
    /// Packets not after the last one used: twice, or out of order.
    pub late: u64,
    /// Packets overtaken by a newer one. In a replay, poses that the thread came too late for.
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

    /// Makes the device feel the force of the last pose.
    fn feel(&mut self, answer: &Answer);

    /// Returns the numbers of its packets by their fate.
    fn counts(&self) -> Counts;
}
