//! Reference numbers, and claims that results meet them.

use std::path::PathBuf;

use serde_json::Value;

/// The path of a file in `lab/validation/data`.
pub fn data_file(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("data").join(name)
}

/// A JSON file of `lab/validation/data`.
///
/// # Panics
/// If there is no such file or it is not JSON.
pub fn reference(name: &str) -> Value {
    let path = data_file(name);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Prints a measured deviation with its limit, and asserts the limit.
///
/// # Panics
/// If the deviation exceeds the limit or is not a number.
#[track_caller]
pub fn claim(what: &str, measured: f64, limit: f64) {
    println!("{what}: {measured:.3e} (limit {limit:.1e})");
    assert!(measured <= limit, "{what}: {measured:e} exceeds {limit:e}");
}
