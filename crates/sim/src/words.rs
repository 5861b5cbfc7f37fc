//! Numbers and panics in messages.

use std::any::Any;

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

/// What a panic says.
pub fn panicked(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no message")
}

/// A number of things, as "1 node" or "2 nodes".
pub fn counted(n: usize, noun: &str) -> String {
    format!("{n} {noun}{}", if n == 1 { "" } else { "s" })
}
