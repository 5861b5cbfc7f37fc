//! A device that replays a [trace](crate::trace) in real time, on the clock of the thread that asks it, alone
//! or [held by a hand](crate::hand).

use std::time::{Duration, Instant};

use nalgebra::{Isometry3, Translation3, Vector3};

use crate::device::{Counts, Device, Event, Sample};
use crate::hand::{Hand, Held};
use crate::renderer::Answer;
use crate::trace::Trace;

/// Time before a tick from which on the thread no longer sleeps: systems wake it up late by about that.
const AWAKE: Duration = Duration::from_micros(200);

/// A trace under way.
#[derive(Clone, Debug)]
pub struct Replay {
    trace: Trace,
    period: Duration,
    hand: Option<(Hand, Held)>,
    started: Option<Instant>,
    tick: u32,
    force: Vector3<f64>,
    counts: Counts,
}

impl Replay {
    /// Poses of a trace, a period apart. With a hand, the device is pulled there and gives way to the force;
    /// without, it is exactly there.
    pub fn new(trace: Trace, period: Duration, hand: Option<Hand>) -> Self {
        let [first, _] = trace.times();
        let held = Held { place: trace.at(first).translation.vector, velocity: Vector3::zeros() };
        let hand = hand.map(|hand| (hand, held));
        Self {
            trace,
            period,
            hand,
            started: None,
            tick: 0,
            force: Vector3::zeros(),
            counts: Counts::default(),
        }
    }

    fn at(&self, tick: u32) -> Isometry3<f64> {
        let [first, _] = self.trace.times();
        self.trace.at(first + f64::from(tick) * self.period.as_secs_f64())
    }
}

impl Device for Replay {
    fn next(&mut self, _patience: Duration) -> Event {
        let now = Instant::now();
        let started = *self.started.get_or_insert(now);
        let before = self.tick;
        self.tick += 1;
        // Poses more than a tick late are left out, so that the trace keeps to the clock.
        let present = ((now - started).as_secs_f64() / self.period.as_secs_f64()) as u32;
        if present > self.tick {
            self.counts.overtaken += u64::from(present - self.tick);
            self.tick = present;
        }
        let [first, last] = self.trace.times();
        let due = self.period * self.tick;
        if due.as_secs_f64() > last - first {
            return Event::Over;
        }
        let due = started + due;
        std::thread::sleep(due.saturating_duration_since(Instant::now()).saturating_sub(AWAKE));
        while Instant::now() < due {
            std::hint::spin_loop();
        }
        let mut pose = self.at(self.tick);
        let ways = [self.at(before), pose].map(|pose| pose.translation.vector);
        let time = self.period.as_secs_f64() * f64::from(self.tick - before);
        if let Some((hand, held)) = &mut self.hand {
            hand.go(held, &self.force, ways, time);
            pose.translation = Translation3::from(held.place);
        }
        Event::Pose(Sample { pose, buttons: 0, opening: 1.0, arrived: due })
    }

    fn feel(&mut self, answer: &Answer) {
        self.counts.used += 1;
        self.force = answer.force;
    }

    fn counts(&self) -> Counts {
        self.counts
    }
}
