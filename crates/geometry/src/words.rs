//! Numbers in messages.
//!
//! ```
//! use pliant_geometry::words::{counted, number};
//!
//! assert_eq!([number(0.12345678), number(2e-6)], ["0.1235", "2.000e-6"]);
//! assert_eq!([counted(1, "node"), counted(2, "node")], ["1 node", "2 nodes"]);
//! ```

/// A number in a few digits.
pub fn number(value: f64) -> String {
    if !value.is_finite() {
        return if value.is_nan() { "unknown" } else { "unlimited" }.into();
    }
    let size = value.abs();
    if size != 0.0 && !(1e-3..1e5).contains(&size) {
        return format!("{value:.3e}");
    }
    let digits = if size == 0.0 { 0 } else { (3 - size.log10().floor() as i32).clamp(0, 6) };
    format!("{value:.*}", digits as usize)
}

/// A number of things, as "1 node" or "2 nodes".
pub fn counted(n: usize, noun: &str) -> String {
    format!("{n} {noun}{}", if n == 1 { "" } else { "s" })
}
