//! Settings of measurements.

use pliant_explicit::Instructions;

/// Settings of measurements.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Repeats that count, at least one.
    pub repeats: usize,
    /// Wall time of a repeat [s].
    pub seconds: f64,
    /// The instructions of the steps.
    pub lanes: Instructions,
}

impl Default for Settings {
    fn default() -> Self {
        Self { repeats: 5, seconds: 0.2, lanes: Instructions::widest() }
    }
}
