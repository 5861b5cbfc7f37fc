//! Helpers of tests: reproducible random numbers, files with [random damage](forging), hexahedra of simple
//! bodies, and the memory of the process. The feature `images` adds image files, `organs` label images and
//! meshes of analytic organs. The feature `pieces` adds small bodies that meet, and `scenes` scenes that are
//! checked and run.
//!
//! ```
//! let mut random = pliant_testing::Random::new(1);
//! assert!((-1.0..1.0).contains(&random.number()) && random.below(3) < 3);
//! ```

pub mod forging;
mod grown;
#[cfg(feature = "images")]
pub mod image_files;
#[cfg(feature = "organs")]
pub mod mesh_checks;
#[cfg(feature = "organs")]
pub mod organs;
#[cfg(feature = "pieces")]
pub mod pieces;
mod pressed;
#[cfg(feature = "scenes")]
pub mod scenes;

use std::env;
use std::fs;
use std::io::Write;
use std::process::Command;

pub use grown::{Hexes, ball_of_hexes, grown_hexes};
pub use pressed::pressed_cube;

/// A linear congruential generator (Knuth's MMIX): the same numbers on every machine.
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// The sequence of a seed.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        self.0
    }

    /// A number in [−1, 1).
    pub fn number(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// A number in [−½, ½).
    pub fn half(&mut self) -> f64 {
        0.5 * self.number()
    }

    /// A number in [0, 1).
    pub fn part(&mut self) -> f64 {
        (self.next() >> 33) as f64 / f64::from(1_u32 << 31)
    }

    /// A vector in [−1, 1)³.
    pub fn vector(&mut self) -> [f64; 3] {
        [0; 3].map(|_| self.number())
    }

    /// A whole number from 0 to below `limit`; 0 if `limit` is 0.
    pub fn below(&mut self, limit: usize) -> usize {
        (self.next() >> 33) as usize % limit.max(1)
    }

    /// Returns the bytes with up to four changes: cut off, cut out, filled, repeated, a bit turned.
    pub fn damaged(&mut self, seed: &[u8]) -> Vec<u8> {
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

/// A scene: a cube of eight hexes, held below.
pub const CUBE: &str = r#"
[scene]
until = 0.1
[law.tissue]
type = "neo-hookean"
young-modulus = 10e3
poisson-ratio = 0.3
[body.cube]
mesh = { block = { size = [0.2, 0.1, 0.1], cells = [2, 2, 2] }, as = "hexes" }
law = "tissue"
density = 1000
[constraint.base]
type = "fix"
body = "cube"
nodes = { set = "z-min" }
"#;

/// Returns the device that a test needs, such as a GPU or a screen. Without a device it prints that the test
/// is skipped, and returns `None`.
///
/// # Panics
/// If there is no device and `PLIANT_REQUIRE_GPU=1` requires one.
#[track_caller]
pub fn found_or_skipped<T, E: std::fmt::Display>(found: Result<T, E>) -> Option<T> {
    let missing = match found {
        Ok(found) => return Some(found),
        Err(missing) => missing,
    };
    assert!(std::env::var("PLIANT_REQUIRE_GPU").as_deref() != Ok("1"), "required: {missing}");
    // Standard error is written directly, since the output of passing tests is captured. A notice that can't
    // be written is dropped.
    let _ = writeln!(std::io::stderr(), "skipped: {missing}");
    None
}

/// True if there are GPUs; otherwise like [`found_or_skipped`].
#[track_caller]
pub fn has_gpu(adapters: usize) -> bool {
    found_or_skipped((adapters > 0).then_some(()).ok_or("no GPU was found")).is_some()
}

/// Peak memory of a process that runs one test [KiB] at an instant, on Linux.
#[derive(Clone, Copy, Debug)]
pub struct PeakMemory(Option<u64>);

/// Set in the process that runs one test.
const ALONE: &str = "PLIANT_TEST_ALONE";

impl PeakMemory {
    /// The peak so far, in a process that runs the calling test `name` alone: `"module::function"`. Other
    /// tests in the same process would raise the peak. Any other process starts such a process, waits for its
    /// end and gets `None`: the calling test is then done.
    ///
    /// # Panics
    /// Where the test fails in its own process, or the program has no test of that name.
    #[track_caller]
    pub fn alone(name: &str) -> Option<Self> {
        if env::var(ALONE).as_deref() == Ok(name) {
            return Some(Self::now());
        }
        let mut command = Command::new(env::current_exe().unwrap());
        let output =
            command.args([name, "--exact", "--include-ignored", "--nocapture"]).env(ALONE, name).output();
        let output = output.unwrap();
        let [printed, failed] = [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes));
        print!("{printed}");
        assert!(
            output.status.success() && printed.contains("1 passed"),
            "{name} in its own process: {failed}"
        );
        None
    }

    fn now() -> Self {
        let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
        let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        Self(peak.and_then(|peak| peak.split_whitespace().next()?.parse().ok()))
    }

    /// Panics if the peak has risen by `limit` [KiB] or more since this instant. Prints a notice where the
    /// system names no peak.
    #[track_caller]
    pub fn assert_rise_below(self, limit: u64) {
        let Some((before, now)) = self.0.zip(Self::now().0) else {
            return println!("the system names no peak memory");
        };
        // The kernel counts in batches, so that a later reading can be a few pages lower.
        assert!(now.saturating_sub(before) < limit, "{before} KiB before, {now} KiB now");
    }
}
