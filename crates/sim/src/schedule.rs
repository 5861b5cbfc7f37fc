//! Times at which an observer of a run looks.

use serde::{Deserialize, Serialize};

/// Times at which an observer looks: the first instant, the instant nearest to each multiple of an interval,
/// and the last.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Schedule {
    every: f64,
    seen: u64,
    /// The last instant that it was due at; before the first, none is.
    last: f64,
}

impl Schedule {
    /// Makes a schedule that looks every `every` seconds, from the start on.
    pub fn new(every: f64) -> Self {
        Self { every, seen: 0, last: f64::NEG_INFINITY }
    }

    /// Makes a schedule whose observer has seen all instants up to and including this one.
    pub fn after(every: f64, time: f64, step: f64) -> Self {
        let mut schedule = Self::new(every);
        schedule.is_due(time, step, true);
        schedule
    }

    /// True if the observer has yet to see an instant.
    pub fn awaits(&self, time: f64, step: f64, last: bool) -> bool {
        last || time + 0.5 * step >= self.seen as f64 * self.every
    }

    /// Number of steps from a time that miss no instant of the observer; at least one.
    pub fn stride(&self, time: f64, step: f64) -> u64 {
        steps_to(self.seen as f64 * self.every, time, step)
    }

    /// True if the observer has to see an instant; it then counts as seen.
    pub fn is_due(&mut self, time: f64, step: f64, last: bool) -> bool {
        let due = self.awaits(time, step, last);
        if due {
            self.seen = (((time + 0.5 * step) / self.every).floor() as u64).saturating_add(1);
            self.last = time;
        }
        due
    }

    /// True if the observer was due at this instant.
    pub fn has_seen(&self, time: f64) -> bool {
        self.last == time
    }
}

/// Steps from a time to the instant nearest to another time, at least one; rather one too few than one too
/// many.
pub(crate) fn steps_to(goal: f64, time: f64, step: f64) -> u64 {
    (((goal - time) / step - 0.5 - 1e-6).ceil()).max(1.0) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_schedule_sees_the_first_the_nearest_and_the_last_instant() {
        let mut schedule = Schedule::new(0.1);
        let step = 0.03;
        let seen: Vec<u32> =
            (0..=10).filter(|&n| schedule.is_due(f64::from(n) * step, step, n == 10)).collect();
        // 0.00, 0.09, 0.21, 0.30.
        assert_eq!(seen, [0, 3, 7, 10]);
    }

    #[test]
    fn strides_miss_no_instant() {
        for (every, step) in [(0.1, 0.03), (0.1, 0.1), (0.1, 0.02), (0.01, 0.05), (1.0, 1e-4)] {
            let end = 20_000_u64;
            let mut one_by_one = Schedule::new(every);
            let mut in_strides = one_by_one;
            let seen: Vec<u64> =
                (0..end).filter(|&n| one_by_one.is_due(n as f64 * step, step, false)).collect();
            let (mut found, mut looks, mut n) = (Vec::new(), 0, 0);
            while n < end {
                looks += 1;
                if in_strides.is_due(n as f64 * step, step, false) {
                    found.push(n);
                }
                n += in_strides.stride(n as f64 * step, step);
            }
            assert_eq!(seen, found, "every {every} s in steps of {step} s");
            assert!(looks <= 2 * seen.len(), "{looks} looks for {} instants", seen.len());
        }
    }

    #[test]
    fn an_interval_below_the_step_sees_every_instant_once() {
        let mut schedule = Schedule::new(0.01);
        assert!((0..20).all(|n| schedule.is_due(f64::from(n) * 0.05, 0.05, false)));
        // More intervals than an integer counts.
        let mut schedule = Schedule::new(1e-300);
        assert!((0..20).all(|n| schedule.is_due(f64::from(n) * 0.05, 0.05, false)));
    }
}
