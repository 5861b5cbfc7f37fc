//! Values and lists of the user in words.

use crate::source::{Node, Value};

/// Returns a value of the user in words.
pub(super) fn found(node: &Node) -> String {
    let short = |text: &str| match text.char_indices().nth(40) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    };
    match &node.value {
        Value::Table(_) => "a table".to_owned(),
        Value::Array(items) => match items.len() {
            0 => "an empty array".to_owned(),
            1 => "an array of 1 value".to_owned(),
            n => format!("an array of {n} values"),
        },
        Value::String(text) => format!("the text {:?}", short(text)),
        Value::Integer(n) => n.to_string(),
        Value::Float(x) => number(*x),
        Value::Boolean(truth) => truth.to_string(),
        Value::Datetime(time) => format!("the date or time {}", short(time)),
    }
}

/// A number as one would write it.
pub(super) fn number(x: f64) -> String {
    let size = x.abs();
    if x.is_nan() {
        "nan".to_owned()
    } else if x.is_infinite() || size == 0.0 || (1e-4..1e10).contains(&size) {
        x.to_string()
    } else {
        format!("{x:e}")
    }
}

/// A text without line ends.
pub(crate) fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// "`a`, `b`".
pub(super) fn names(keys: &[&str]) -> String {
    keys.iter().map(|key| format!("`{key}`")).collect::<Vec<_>>().join(", ")
}

/// "a, b or c".
pub(super) fn alternatives(parts: &[String]) -> String {
    match parts {
        [] => "nothing".to_owned(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} or {last}", first.join(", ")),
    }
}
