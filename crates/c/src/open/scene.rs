//! A scene that is open, with what the program changes in it.

use std::path::PathBuf;

use pliant_format::Scene;
use pliant_format::source::{Given, Source};
use pliant_scene::World;

use crate::status::Fault;

/// A scene that a program can still change; simulations are made from it.
pub(crate) struct OpenScene {
    pub(crate) source: Source,
    folder: PathBuf,
    pub(crate) given: Given,
}

impl OpenScene {
    pub(crate) fn new(source: Source, folder: PathBuf) -> Self {
        Self { source, folder, given: Given::default() }
    }

    /// The world of the scene as it is now.
    pub(crate) fn world(&self) -> Result<World, Fault> {
        let source = self.source.clone().giving(self.given.clone());
        let fault = |errors| Fault::scene(&errors, Some(&source));
        let scene = Scene::from_source(source.clone(), self.folder.clone()).map_err(fault)?;
        World::new(&scene).map_err(fault)
    }
}
