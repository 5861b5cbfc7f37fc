//! Reference numbers, and what it means to meet one.

use std::path::PathBuf;

use serde_json::Value;

/// The path of a file in `validation/data`.
pub fn data_file(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("data").join(name)
}

/// A JSON file of `validation/data`.
///
/// # Panics
/// If there is no such file or it is not JSON.
pub fn reference(name: &str) -> Value {
    let path = data_file(name);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// An array of numbers of a reference file; anything else counts as not a number, which meets no claim.
pub fn numbers(value: &Value) -> Vec<f64> {
    let list = value.as_array().map(Vec::as_slice).unwrap_or_default();
    list.iter().map(|x| x.as_f64().unwrap_or(f64::NAN)).collect()
}

/// The largest of some deviations; not a number if one of them is not, unlike a fold with `f64::max`.
pub fn largest(deviations: impl IntoIterator<Item = f64>) -> f64 {
    deviations.into_iter().fold(0.0, |worst, x| if x > worst || x.is_nan() { x } else { worst })
}

/// Prints a measured deviation beside its limit and holds it to the limit.
///
/// # Panics
/// If the deviation exceeds the limit or is not a number.
#[track_caller]
pub fn claim(what: &str, measured: f64, limit: f64) {
    println!("{what}: {measured:.3e} (limit {limit:.1e})");
    assert!(measured <= limit, "{what}: {measured:e} exceeds {limit:e}");
}
