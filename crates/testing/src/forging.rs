//! Forged inputs: bytes with harmful changes, and the result of each.
//!
//! ```
//! use pliant_testing::Random;
//! use pliant_testing::forging::{Attempts, forged};
//!
//! let mut attempts = Attempts::default();
//! for seed in 0..100 {
//!     let bytes = forged(&mut Random::new(seed), b"[1, 2, 3]");
//!     attempts.attempt(seed, || std::str::from_utf8(&bytes).is_ok());
//! }
//! assert!(attempts.panics.is_empty(), "{attempts}");
//! ```

use std::backtrace::Backtrace;
use std::collections::BTreeMap;
use std::fmt;
use std::panic::{self, AssertUnwindSafe};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use crate::Random;

/// Numbers that are rare.
const RARE: [f64; 12] = [
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::MAX,
    f64::MIN_POSITIVE,
    5e-324,
    -1.0,
    0.0,
    1e-9,
    1e9,
    1e18,
    -1e300,
];
/// The largest counts of 64, 53 and 32 bits as postcard writes them.
const LARGE: [&[u8]; 3] = [
    &[0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x01],
    &[0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x0F],
    &[0xFF, 0xFF, 0xFF, 0xFF, 0x0F],
];
/// Lengths, counts and flags lie among the first and the last bytes, before and after long lists of numbers.
const ENDS: usize = 200;

/// Returns bytes with a few changes. [`Random::damaged`] makes them anywhere or near an end. Or a rare number
/// takes the place of eight bytes, or a large count the place of one.
pub fn forged(random: &mut Random, bytes: &[u8]) -> Vec<u8> {
    let far = bytes.len().saturating_sub(ENDS);
    let mut changed = bytes.to_vec();
    match random.below(5) {
        0 => random.damaged(bytes),
        1 => [&bytes[..far], &random.damaged(&bytes[far..])].concat(),
        2 => {
            let (start, rest) = bytes.split_at(bytes.len().min(ENDS));
            [&random.damaged(start), rest].concat()
        }
        3 if bytes.len() >= 8 => {
            for _ in 0..1 + random.below(3) {
                let at = random.below(bytes.len() - 7);
                changed[at..at + 8].copy_from_slice(&RARE[random.below(RARE.len())].to_le_bytes());
            }
            changed
        }
        _ => {
            let at = match random.below(3) {
                0 => random.below(bytes.len()),
                1 => random.below(bytes.len().min(ENDS)),
                _ => far + random.below(bytes.len() - far),
            };
            let count = LARGE[random.below(LARGE.len())].iter().copied();
            changed.splice(at..(at + 1).min(bytes.len()), count);
            changed
        }
    }
}

/// Results of the attempts with inputs.
#[derive(Debug, Default)]
pub struct Attempts {
    /// Number of inputs that were taken, and of inputs that were refused.
    pub taken: u64,
    /// See [`taken`](Self::taken).
    pub refused: u64,
    /// Longest time of an input, and its seed.
    pub longest: (Duration, u64),
    /// Panics: message and place, number, first seed and its caller.
    pub panics: BTreeMap<String, (u64, u64, String)>,
}

/// The last panic, with its caller.
static LAST: Mutex<Option<(String, String)>> = Mutex::new(None);

impl Attempts {
    /// Tries the input of a seed, which is taken or refused; a panic is noted.
    pub fn attempt(&mut self, seed: u64, go: impl FnOnce() -> bool) {
        let begun = Instant::now();
        let taken = panic::catch_unwind(AssertUnwindSafe(go));
        self.longest = self.longest.max((begun.elapsed(), seed));
        match taken {
            Ok(true) => self.taken += 1,
            Ok(false) => self.refused += 1,
            Err(_) => {
                let last = LAST.lock().ok().and_then(|mut last| last.take());
                let (message, from) = last.unwrap_or_default();
                self.panics.entry(message).or_insert((0, seed, from)).0 += 1;
            }
        }
    }

    /// Calls a function while panics are noted in place of being printed.
    pub fn quietly<T>(go: impl FnOnce() -> T) -> T {
        let before = panic::take_hook();
        panic::set_hook(Box::new(|message| {
            if let Ok(mut last) = LAST.lock() {
                *last = Some((message.to_string(), Backtrace::force_capture().to_string()));
            }
        }));
        let done = panic::catch_unwind(AssertUnwindSafe(go));
        panic::set_hook(before);
        done.unwrap_or_else(|other| {
            // A panic that no attempt has caught is a fault of the test.
            if let Some((message, from)) = LAST.lock().ok().and_then(|mut last| last.take()) {
                eprintln!("{message}\n{from}");
            }
            panic::resume_unwind(other)
        })
    }
}

impl fmt::Display for Attempts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { taken, refused, longest: (longest, of), panics } = self;
        write!(f, "{taken} went on, {refused} refused, longest {longest:.1?} (seed {of})")?;
        for (message, (count, seed, from)) in panics {
            write!(f, "\n{count} × {message} (seed {seed})\n{from}")?;
        }
        Ok(())
    }
}
