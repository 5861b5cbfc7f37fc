//! The context that all phases of building a model share: the scene, the cache, the mistakes and the notes.

use pliant_format::Scene;
use pliant_format::diagnostic::{Diagnostic, SceneErrors};
use pliant_format::source::Source;

use super::Meshing;
use crate::cache::MeshCache;

/// A scene, with the findings about it.
pub(super) struct Context<'s> {
    pub scene: &'s Scene,
    pub cache: &'s MeshCache,
    /// Hears how far meshes are.
    pub watch: &'s dyn Fn(Meshing<'_>),
    /// Mistakes and doubts.
    pub out: Vec<Diagnostic>,
    /// Notes for the user, a sentence each.
    pub notes: Vec<String>,
}

impl<'s> Context<'s> {
    pub fn new(scene: &'s Scene, cache: &'s MeshCache, watch: &'s dyn Fn(Meshing<'_>)) -> Self {
        Self { scene, cache, watch, out: scene.doubts.clone(), notes: Vec::new() }
    }

    pub fn failed(&self) -> bool {
        self.out.iter().any(Diagnostic::is_error)
    }

    /// Ends the building of a model that has a mistake.
    ///
    /// # Errors
    /// All mistakes and doubts that were found, if there is a mistake.
    pub(crate) fn stop_at_mistakes(&mut self) -> Result<(), SceneErrors> {
        match self.failed() {
            true => Err(self.source().errors(std::mem::take(&mut self.out))),
            false => Ok(()),
        }
    }

    pub fn source(&self) -> &'s Source {
        &self.scene.source
    }

    pub fn error(&mut self, path: &[&str], message: impl Into<String>, label: &str, help: impl Into<String>) {
        let place = self.source().span(path);
        self.out.push(Diagnostic::error(message).at(place, label).help(help));
    }
}

/// Gives a phase the methods of the phase before, which it holds in a field.
macro_rules! follows {
    ($phase:ident, $field:ident: $before:ident) => {
        impl<'s> std::ops::Deref for $phase<'s> {
            type Target = $before<'s>;

            fn deref(&self) -> &Self::Target {
                &self.$field
            }
        }

        impl std::ops::DerefMut for $phase<'_> {
            fn deref_mut(&mut self) -> &mut Self::Target {
                &mut self.$field
            }
        }
    };
}

pub(super) use follows;
