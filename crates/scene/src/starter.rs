//! The scene that `pliant new` writes: small, commented, runs as it is.

/// The text of a starter scene with a title.
pub fn starter(name: &str) -> String {
    // A TOML string: what a folder can be called may hold quotes.
    let title = serde_json::Value::from(name).to_string();
    include_str!("starter.toml").replace("\"TITLE\"", &title)
}
