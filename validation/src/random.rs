//! Numbers without pattern, the same in every run.

/// A linear congruential generator (Knuth's MMIX).
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// The sequence of a seed.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// A number in [−1, 1).
    pub fn number(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// A vector in [−1, 1)³.
    pub fn vector(&mut self) -> [f64; 3] {
        [0; 3].map(|_| self.number())
    }
}
