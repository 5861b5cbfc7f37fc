//! Checks of the critical time step that can be passed over. A check ranks all cells and finds the stiffest
//! modes of some, which takes longer than a step. So a check is made only if it may change the parts of
//! steps.
//!
//! From one check to the next, steps keep their parts while the limit stays in a band. The rate at which the
//! limit changed predicts when it leaves the band. Checks are passed over up to half of the way there, and
//! near the edge every one is made. Not foreseen: a limit that falls while neither the least J nor the
//! largest stretch changes by [`CALM`], within [`LONGEST`] steps.

use serde::{Deserialize, Serialize};

use crate::forces::Deformed;
use crate::substeps::margin;

/// A check is made once the deformation has changed by this factor since the last check …
const CALM: f64 = 1.02;
/// … or after this number of steps.
const LONGEST: u64 = 1000;

/// The last check, and how fast the limit changed up to it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Foresight {
    last: Option<Check>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Check {
    /// [s].
    limit: f64,
    /// Steps done.
    steps: u64,
    deformed: Deformed,
    /// Change of ln limit per step; none of the first check.
    rate: Option<f64>,
}

impl Foresight {
    /// Notes a check.
    pub(crate) fn note(&mut self, limit: f64, steps: u64, deformed: Deformed) {
        let rate = self.last.filter(|last| last.steps < steps).map(|last| {
            let now = (limit / last.limit).ln().abs() / (steps - last.steps) as f64;
            // A limit that turns round stands still for a moment.
            now.max(0.5 * last.rate.unwrap_or(0.0))
        });
        self.last = Some(Check { limit, steps, deformed, rate });
    }

    /// Steps done at the last check.
    pub(crate) fn noted_at(&self) -> Option<u64> {
        self.last.map(|last| last.steps)
    }

    /// True if a check after `steps` steps would leave steps of a length [s] in the same parts.
    pub(crate) fn covers(&self, steps: u64, deformed: &Deformed, step: f64, parts: u32) -> bool {
        let Some(Check { limit, steps: at, deformed: seen, rate: Some(rate) }) = self.last else {
            return false;
        };
        let within = 0.5 * margin(step, limit, parts) / rate;
        // Not a number: at the edge of the band, and at rest there.
        let far = !within.is_nan() && ((steps - at) as f64) < within;
        far && steps < at + LONGEST && !deformed.differs(&seen, CALM)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A limit falls evenly through the band of whole steps. Checks grow rare in the band and frequent at its
    /// edge, where none is missed.
    #[test]
    fn a_limit_that_leaves_its_band_is_checked_there() {
        let (step, flat) = (0.9, Deformed::default());
        let limit = |steps: u64| 1.0 - 2e-5 * steps as f64;
        let mut foresight = Foresight::default();
        let mut made = Vec::new();
        for steps in (0..=5000).step_by(50) {
            if foresight.covers(steps, &flat, step, 1) {
                continue;
            }
            foresight.note(limit(steps), steps, flat);
            made.push(steps);
            if margin(step, limit(steps), 1) == 0.0 {
                break;
            }
        }
        // 0.97 L < 0.9 from 3609 steps on.
        assert_eq!(made.last(), Some(&3650));
        assert!(made.len() < 20 && made[..2] == [0, 50] && made.contains(&3600), "{made:?}");
    }

    /// A constant limit is checked every thousand steps, and where the deformation changes.
    #[test]
    fn a_limit_that_stands_still_is_checked_now_and_then() {
        let (flat, stretched) =
            (Deformed::default(), Deformed { largest_strain: 0.01, ..Deformed::default() });
        let mut foresight = Foresight::default();
        assert!(!foresight.covers(0, &flat, 0.9, 1));
        foresight.note(1.0, 0, flat);
        assert!(!foresight.covers(50, &flat, 0.9, 1));
        foresight.note(1.0, 50, flat);
        assert!(foresight.covers(1000, &flat, 0.9, 1) && !foresight.covers(1050, &flat, 0.9, 1));
        assert!(!foresight.covers(100, &stretched, 0.9, 1));
    }
}
