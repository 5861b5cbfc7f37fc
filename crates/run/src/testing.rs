//! Small scenes for the tests of this crate.

use pliant_format::Scene;
use pliant_format::source::Source;
pub(crate) use pliant_testing::CUBE;

/// The scene of [`CUBE`] with more tables.
pub(crate) fn scene(more: &str) -> Scene {
    read(&format!("{CUBE}{more}"))
}

/// The scene of a text.
pub(crate) fn read(text: &str) -> Scene {
    let source = Source::parse("cube.toml", text).unwrap_or_else(|error| panic!("{}", error.plain()));
    Scene::from_source(source, ".".into()).unwrap_or_else(|error| panic!("{}", error.plain()))
}
