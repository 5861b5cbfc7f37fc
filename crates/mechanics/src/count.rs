//! Counts in the bytes of states. No run reaches a count that would overflow soon; such a count is refused.
//!
//! ```
//! #[derive(Debug, serde::Deserialize)]
//! struct Done {
//!     #[serde(deserialize_with = "pliant_mechanics::count::read")]
//!     steps: u64,
//! }
//!
//! assert_eq!(serde_json::from_str::<Done>(r#"{ "steps": 7 }"#)?.steps, 7);
//! assert!(serde_json::from_str::<Done>(r#"{ "steps": 18446744073709551615 }"#).is_err());
//! # Ok::<(), serde_json::Error>(())
//! ```

use serde::de::{Deserialize, Deserializer, Error};

/// A number that counts.
pub trait Count: Copy {
    /// True if a run can continue counting from here: the highest bits are 0.
    fn can_go_on(self) -> bool;
}

impl Count for u32 {
    fn can_go_on(self) -> bool {
        self >> 31 == 0
    }
}

impl Count for u64 {
    fn can_go_on(self) -> bool {
        self >> 53 == 0
    }
}

impl Count for usize {
    fn can_go_on(self) -> bool {
        (self as u64).can_go_on()
    }
}

/// Reads a count.
///
/// # Errors
/// If the value is no count, or too large to continue counting from.
pub fn read<'de, D: Deserializer<'de>, C: Count + Deserialize<'de>>(from: D) -> Result<C, D::Error> {
    let count = C::deserialize(from)?;
    if count.can_go_on() { Ok(count) } else { Err(D::Error::custom("a count that no run reaches")) }
}

/// True if a time [s] can occur in a run: it is not before the start, and steps of a length [s] still change
/// it.
pub fn is_time(time: f64, step: f64) -> bool {
    time >= 0.0 && time + 1e-3 * step > time
}
