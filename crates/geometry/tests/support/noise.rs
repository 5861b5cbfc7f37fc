//! Files changed at random, the same every time, and the memory that reading them took. Each test that reads broken files
//! names this file with `#[path]`.

use std::fs;

/// Peak memory of this process [KiB], on Linux.
pub fn peak() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?.split_whitespace().next()?.parse().ok()
}

/// Knuth's multiplier, for repeatable noise.
pub struct Noise(pub u64);

impl Noise {
    /// A number from 0 to below `limit`.
    pub fn below(&mut self, limit: usize) -> usize {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 33) as usize % limit.max(1)
    }

    /// The same bytes with up to four changes: cut off, cut out, filled, repeated, a bit turned.
    pub fn change(&mut self, seed: &[u8]) -> Vec<u8> {
        let mut bytes = seed.to_vec();
        for _ in 0..1 + self.below(4) {
            let at = self.below(bytes.len());
            match self.below(6) {
                0 => bytes.truncate(at),
                1 => {
                    let to = (at + self.below(24)).min(bytes.len());
                    bytes.drain(at..to);
                }
                2 => {
                    let value = [0, 0x7F, 0x80, 0xFF, b' ', b'9', b'-', b'"'][self.below(8)];
                    let to = (at + 1 + self.below(8)).min(bytes.len());
                    bytes[at.min(to)..to].fill(value);
                }
                3 => {
                    let again = bytes[at..(at + self.below(16)).min(bytes.len())].to_vec();
                    bytes.splice(at..at, again);
                }
                _ => {
                    if let Some(byte) = bytes.get_mut(at) {
                        *byte ^= 1 << self.below(8);
                    }
                }
            }
        }
        bytes
    }
}
