//! Distribution of times: a histogram of fixed size, so that counting allocates nothing.
//!
//! ```
//! use pliant_haptics::statistics::Spread;
//!
//! let mut spread = Spread::default();
//! (1..=100).for_each(|k| spread.add(f64::from(k) * 1e-5));
//! assert!((spread.quantile(0.5).unwrap() - 0.5e-3).abs() < 1e-6);
//! assert_eq!(spread.largest(), 1e-3);
//! ```

use std::fmt;

/// Width [s] of a bin.
const WIDTH: f64 = 1e-6;
/// Bins: up to 100 ms.
const BINS: usize = 100_000;

/// Times, counted by microseconds up to 100 ms.
#[derive(Clone, Debug, PartialEq)]
pub struct Spread {
    bins: Vec<u32>,
    count: u64,
    largest: f64,
}

impl Default for Spread {
    fn default() -> Self {
        Self { bins: vec![0; BINS], count: 0, largest: 0.0 }
    }
}

impl Spread {
    /// Counts a time [s].
    pub fn add(&mut self, time: f64) {
        let bin = ((time / WIDTH) as usize).min(BINS - 1);
        self.bins[bin] = self.bins[bin].saturating_add(1);
        self.count += 1;
        self.largest = self.largest.max(time);
    }

    /// Returns the number of times.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Returns the time [s] that a part of the times does not exceed, to a microsecond; `None` without any.
    pub fn quantile(&self, part: f64) -> Option<f64> {
        let rank = (part * self.count as f64).ceil().max(1.0) as u64;
        let mut below = 0;
        let bin = self.bins.iter().position(|&count| {
            below += u64::from(count);
            below >= rank
        })?;
        // Beyond the last bin all that is known is the largest.
        let upper = if bin + 1 == BINS { self.largest } else { (bin + 1) as f64 * WIDTH };
        Some(upper.min(self.largest))
    }

    /// The largest [s]; 0 without any.
    pub fn largest(&self) -> f64 {
        self.largest
    }
}

impl fmt::Display for Spread {
    /// "p50 1.000 ms, p99 1.012 ms, max 1.100 ms".
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match [0.5, 0.99].map(|part| self.quantile(part)) {
            [Some(half), Some(most)] => {
                let [half, most, largest] = [half, most, self.largest].map(|time| 1e3 * time);
                write!(f, "p50 {half:.3} ms, p99 {most:.3} ms, max {largest:.3} ms")
            }
            _ => f.write_str("none"),
        }
    }
}
