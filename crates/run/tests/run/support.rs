//! Functions that several files here share.

use serde_json::Value;

#[track_caller]
pub fn assert_close(found: f64, expected: f64, tolerance: f64, what: &str) {
    assert!(
        (found - expected).abs() <= tolerance,
        "{what}: found {found}, expected {expected} ± {tolerance}"
    );
}

/// True if a number equals another one within the fraction `within`.
pub fn close(value: &Value, expected: f64, within: f64) -> bool {
    value.as_f64().is_some_and(|value| (value - expected).abs() <= within * expected.abs())
}

/// The keys of an object, in their order.
pub fn keys(object: &Value) -> Vec<&str> {
    object.as_object().expect("an object").keys().map(String::as_str).collect()
}

/// A cube of hexes between glued plates, the upper one moved as told.
pub fn squeezed(element: &str, run: &str, motion: &str) -> String {
    format!(
        "[scene]\nuntil = 0.5\n[run]\nprecision = \"double\"\n{run}\n[law.tissue]\ntype = \"neo-hookean\"\n\
         young-modulus = 3e3\npoisson-ratio = 0.45\n[body.cube]\n\
         mesh = {{ block = {{ size = [0.1, 0.1, 0.1], cells = [3, 3, 3] }}, as = \"hexes\" }}\n\
         element = \"{element}\"\nlaw = \"tissue\"\ndensity = 1000\ndamping = 60\n\
         [constraint.base]\ntype = \"fix\"\nbody = \"cube\"\nnodes = {{ set = \"z-min\" }}\n\
         [constraint.top]\ntype = \"move\"\nbody = \"cube\"\nnodes = {{ set = \"z-max\" }}\n{motion}\n\
         [output.table]\ntype = \"csv\"\nevery = 0.05\n"
    )
}
