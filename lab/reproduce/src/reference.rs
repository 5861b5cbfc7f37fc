//! Embedded reference numbers; `lab/validation/data/README.md` gives their sources.

use pliant_geometry::Mesh;
use pliant_geometry::io::{Format, read_bytes};
use serde_json::Value;

/// A JSON file of `lab/validation/data`, by its text.
///
/// # Panics
/// If it is not JSON.
pub fn reference(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("reference data: {error}"))
}

/// A Gmsh mesh of `lab/validation/data`, by its bytes.
///
/// # Panics
/// If the bytes are not a mesh.
pub fn mesh(bytes: &[u8]) -> Mesh {
    read_bytes(bytes, Format::Gmsh).unwrap_or_else(|error| panic!("reference data: {error}")).mesh
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
