//! Small scenes for the tests of this crate.

use std::path::Path;

use pliant_format::Scene;
use pliant_format::diagnostic::SceneErrors;
use pliant_format::source::Source;
use pliant_geometry::DataArray;
use pliant_meshing::{Block, Resolution, VolumeCell};
pub(crate) use pliant_testing::CUBE;

use crate::assemble::{Built, build};

/// The scene of [`CUBE`] with more tables.
pub(crate) fn scene(more: &str) -> Scene {
    read(&format!("{CUBE}{more}"))
}

/// The scene of a text.
pub(crate) fn read(text: &str) -> Scene {
    let source = Source::parse("cube.toml", text).unwrap_or_else(|error| panic!("{}", error.plain()));
    Scene::from_source(source, ".".into()).unwrap_or_else(|error| panic!("{}", error.plain()))
}

/// A scene in a folder with a bar of three hexes along x, with the labels 1 (liver), 2 (tumour) and 5. The
/// text `more` follows its `mesh`. The laws are `tissue` and `hard`.
pub(crate) fn labelled(folder: &Path, more: &str) -> Scene {
    let block = Block::new([0.3, 0.1, 0.1]);
    let mut mesh = block.mesh(Resolution::Counts([3, 1, 1]), VolumeCell::Hex, 100).unwrap();
    mesh.blocks[0].data.insert("label".into(), DataArray::scalar(vec![1.0, 2.0, 5.0]));
    mesh.label_names = [(1, "liver".to_owned()), (2, "tumour".to_owned())].into();
    pliant_geometry::io::write(&folder.join("bar.vtu"), &mesh).unwrap();
    let start = &CUBE[..CUBE.find("[body").unwrap()];
    let hard = "[law.hard]\ntype = 'neo-hookean'\nyoung-modulus = 30e3\npoisson-ratio = 0.3\n";
    let text = format!("{start}{hard}[body.bar]\nmesh = {{ file = 'bar.vtu' }}\n{more}");
    let source = Source::parse("bar.toml", text).unwrap_or_else(|error| panic!("{}", error.plain()));
    Scene::from_source(source, folder.to_owned()).unwrap_or_else(|error| panic!("{}", error.plain()))
}

/// Builds [`CUBE`] with more tables.
pub(crate) fn built(more: &str) -> Built {
    build(&scene(more)).unwrap_or_else(|error| panic!("{}", error.plain()))
}

/// Returns the mistakes in [`CUBE`] with more tables.
pub(crate) fn mistakes(more: &str) -> SceneErrors {
    build(&scene(more)).expect_err("a mistake")
}

/// Builds a text alone.
pub(crate) fn built_alone(text: &str) -> Built {
    build(&read(text)).unwrap_or_else(|error| panic!("{}", error.plain()))
}

/// Returns the mistakes in a text alone, found on reading or on building.
pub(crate) fn mistakes_alone(text: &str) -> SceneErrors {
    let source = Source::parse("alone.toml", text).unwrap_or_else(|error| panic!("{}", error.plain()));
    match Scene::from_source(source, ".".into()) {
        Ok(scene) => build(&scene).expect_err("a mistake"),
        Err(errors) => errors,
    }
}
